// Of panel 1: what speaks for each effect, and what else would explain the data.
import {compareStretches, evidenceOf, factorOf, fmtCrossValidation, sameEffects, sameSegments, type Evidence} from '../cross_validation';
import {modelWithId, wayTo, withOthers} from '../data';
import {fmt, fmtError, list, sentence, unitText} from '../format';
import type {CandidateData, CrossValidationData, ModelData, PageData} from '../page_data';
import {standsIn} from '../stability';
import {fold} from '../state';
import {Command} from './panel';

const kHow = 'Errors are those of cross-validation: of data that the parameters were not fitted to, × noise, ± standard error. '
  + 'The ratio is the error without the effect, all else fitted again, over that with it, with its 95 % interval: if that contains 1, the data do not show that the effect is there.';

// The model in which the steps end, where they begin with the one that is shown.
function endOf(page: PageData, model: ModelData): ModelData {
  const last = page.steps.at(-1);
  if (!last || !model.verdict || page.live) return model;
  return wayTo(page, last.model)[0]?.from === model.id ? modelWithId(page, last.model) ?? model : model;
}

export function evidenceOfEnd(page: PageData, model: ModelData): Evidence[] {
  const end = endOf(page, model);
  return evidenceOf(page, end, wayTo(page, end.id));
}

export function HowSure({page, model}: {page: PageData; model: ModelData}) {
  const end = endOf(page, model), rows = evidenceOfEnd(page, model);
  if (!rows.length) return null;
  const proposed = !end.effects.length, unexplained = model.verdict === 'unexplained';
  return (
    <div class="evidence">
      <h3>{unexplained ? 'What was tried, and does not explain it' : proposed ? 'What is missing, and how sure that is' : 'What was added, and how sure that is'}</h3>
      <div class="table-scroll"><table>
        <thead><tr><th scope="col">effect</th><th scope="col">parameters, ± 95 %</th><th scope="col" class="number">error without → with</th>
          <th scope="col" class="number">ratio (95 %)</th><th scope="col">lower in</th></tr></thead>
        <tbody>{rows.map(row => <Row key={row.effects.join()} row={row} notConstant={row.effects.filter(e => standsIn(model, e))} />)}</tbody>
      </table></div>
      <p class="note">{kHow}</p>
    </div>
  );
}

function Row({row, notConstant}: {row: Evidence; notConstant: string[]}) {
  const ratio = compareStretches(row.without, row.with);
  return <tr>
    <th scope="row">{list(row.effects)}{row.instead.length > 0 && <span class="note">in place of {list(row.instead)}, with which it is compared</span>}
      {notConstant.length > 0 && <a class="bad" href="#stability" onClick={() => fold('which', false)}>{row.effects.length > 1 ? `${list(notConstant)}: ` : ''}not constant, stands in for another law</a>}</th>
    <td><ul class="plain">{row.parameters.map(p => <li key={p.name}>{p.name} <span class="whole">{fmt(p.value)}</span>{' '}
      <span class="whole">{p.stdError !== null && `± ${fmt(1.96 * p.stdError, 2)} `}{unitText(p.unit)}</span></li>)}</ul></td>
    <td class="number">{row.with ? `${fmtCrossValidation(row.without)} → ${fmtCrossValidation(row.with)}` : '–'}</td>
    <td class="number">{ratio ? factorOf(ratio) : '–'}</td>
    <td>{ratio ? `${ratio.lower} of ${ratio.of} stretches` : '–'}</td>
  </tr>;
}

export function Rivals({page, model}: {page: PageData; model: ModelData}) {
  const rivals = model.rivals ?? [];
  if (rivals.length < 2) return null;
  const errorOf = (i: number) => rivals[i].crossValidation ?? crossValidationOf(page, model, rivals[i].effects);
  const oneForce = rivals.every(rival => rival.sameForce);
  return (
    <div class="rivals">
      <h3>{oneForce ? 'Other names of the same force' : model.verdict === 'unexplained' ? 'Other models that explain as much' : 'Models between which the data do not decide'}</h3>
      <div class="table-scroll"><table>
        <thead><tr><th scope="col">added effects</th><th scope="col" class="number">error</th><th scope="col" class="number">held out</th><th scope="col" class="number">ratio to the first (95 %)</th><th scope="col">a recording that would decide</th></tr></thead>
        <tbody>{rivals.map(({effects, separatedBy, sameForce, holdoutError}, i) => {
          const cv = errorOf(i), ratio = i ? compareStretches(cv, errorOf(0)) : null;
          return <tr key={effects.join()}>
            <th scope="row">{list(effects)}{i === 0 && <span class="badge chosen">chosen</span>}</th>
            <td class="number">{fmtCrossValidation(cv)}</td><td class="number">{fmtError(holdoutError)}</td><td class="number">{ratio ? factorOf(ratio) : '–'}</td>
            <td>{i ? (sameForce ? 'None: the same force in this data' : sentence(separatedBy) || '–') : ''}</td>
          </tr>;
        })}</tbody>
      </table></div>
      <p class="note">{oneForce
        ? 'In this data each is the same force as the first: what matters of them is one number, whichever name it has. Errors are × noise, as above.'
        : 'These are rivals: each has no more parameters than the first and predicts unseen data as well, within one standard error. Errors are × noise, as above. Record a motion that would decide, and ask again with that recording among the runs.'}</p>
      {model.nextExperiment && <>
        <p>The next experiment: {model.nextExperiment.words}.</p>
        {model.nextExperiment.command && <Command text={model.nextExperiment.command} label="command of the next experiment" />}
      </>}
    </div>
  );
}

// What else a candidate's refit is of: effects that were added with it, and
// segments of another length than the model's.
export function ofRefit(model: ModelData, candidate: CandidateData): string[] {
  const {confirmed} = candidate;
  if (!confirmed) return [];
  return [
    ...(confirmed.togetherWith.length ? [`together with ${list(confirmed.togetherWith)}`] : []),
    ...(sameSegments(confirmed.segment_s, model.segment_s) ? [] : [`over segments of ${fmt(confirmed.segment_s, 3)} s`]),
  ];
}

// Of the model with these effects: one of the search, or the refit of a candidate.
function crossValidationOf(page: PageData, model: ModelData, effects: string[]): CrossValidationData | null {
  const same = (names: string[]) => sameEffects(names, effects);
  const refit = model.candidates.find(c => c.confirmed && same(withOthers(c)));
  if (refit?.confirmed?.crossValidation) return refit.confirmed.crossValidation;
  return [...page.models].reverse().find(m => m.crossValidation && same(m.effects))?.crossValidation ?? null;
}
