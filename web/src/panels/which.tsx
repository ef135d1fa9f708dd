// Panel 5: which effect is missing.
import {Fragment} from 'preact';
import {useState} from 'preact/hooks';
import {candidateName, forceName, lawQuantity, meanSquare} from '../data';
import {fmt, fmtError, fmtP, fmtUnit, forceLabel, list, unitText} from '../format';
import type {CandidateData, ModelData, PageData} from '../page_data';
import {XyChart} from '../plots/xy_chart';
import {standsIn} from '../stability';
import {current, useStore} from '../state';
import {AddButton} from './add';
import {ofRefit} from './evidence';
import {forceLayers, quantityName} from './force_layers';
import {DataTable, Empty, Panel, type Column} from './panel';
import {Proposals} from './proposals';
import {Stability} from './stability';

const kHow = 'Each row of the table is an effect that the model could lack. Predicted is the error (× noise) that a refit with it should reach, by a linearisation; confirmed is what a refit did reach, first on the fitted runs, then on the held-out ones. '
  + 'The p-value is the chance of such a score where the effect is absent, to first order too: far from the noise it says little, and the refit decides. '
  + 'Accepted: it lowers the error of held-out data, and its parameters are plausible and significantly different from zero. '
  + 'Not constant: it does so in place of another law.';

export function Which({page}: {page: PageData}) {
  const model = page.models[useStore(current)];
  const first = model.candidates[0];
  const [open, setOpen] = useState<Set<string> | null>(null);
  if (!first) {
    return <Panel id="which" title="5 Which effect" how={kHow} wide><Empty>{noCandidates(page, model)}</Empty><Stability page={page} model={model} /></Panel>;
  }
  const shown = open ?? new Set([candidateName(first)]);
  const toggle = (name: string) => {
    const next = new Set(shown);
    if (!next.delete(name)) next.add(name);
    setOpen(next);
  };
  const all = model.candidates.map(candidateName);
  const without = [...new Set(model.candidates.filter(c => c.predictedError === null && c.noPrediction).map(c => c.noPrediction))];
  return (
    <Panel id="which" title="5 Which effect" how={kHow} wide>
      {model.verdict === 'adequate' && <Empty>{kNothingMissing} What follows could hide in the noise: it would be seen from the sizes given.</Empty>}
      <Stability page={page} model={model} />
      <Proposals model={model} />
      <h3>Candidates</h3>
      {without.map(why => <p class="note" key={why}>No prediction (–): {why}.</p>)}
      <p class="buttons">
        <button type="button" onClick={() => setOpen(new Set(all))}>Show all pictures</button>
        <button type="button" onClick={() => setOpen(new Set())}>Hide all pictures</button>
      </p>
      <DataTable caption={`Candidates, those that were accepted first; model: ${model.title}`} rows={model.candidates} rowKey={candidateName}
        columns={columns(model, shown, toggle, page.live && model.verdict !== 'adequate' ? model : null)}
        detail={c => shown.has(candidateName(c)) ? <Picture page={page} model={model} candidate={c} /> : null} />
    </Panel>
  );
}

export const kNothingMissing = 'The model is adequate: nothing is missing that this data can show.';

export function noCandidates(page: PageData, model: ModelData): string {
  if (model.verdict === 'adequate') {
    return kNothingMissing;
  }
  if (page.program === 'sysid_fit') {
    return 'sysid_fit does not ask which effect is missing: sysid_diagnose with the same flags does.';
  }
  return 'Which effect is missing was not asked for this model: sysid_diagnose with its effects (--add) does.';
}

// `to`: the model to which a button adds the candidate; null: no button.
function columns(model: ModelData, shown: Set<string>, toggle: (name: string) => void, to: ModelData | null): Column<CandidateData>[] {
  return [
    {key: 'effect', name: 'effect', sort: candidateName, cell: c => <>
      {c.effect}<wbr />@{c.target}{c.accepted && <span class="badge adequate">accepted</span>}{standsIn(model, candidateName(c)) && <span class="badge">not constant</span>}{c.refused && <span class="badge">rejected</span>}
      <span class="law">{c.law}</span>{c.refused && <span class="note">{c.refused}</span>}
      {to && <><AddButton model={to} candidate={c} />{' '}</>}
      <button type="button" aria-expanded={shown.has(candidateName(c))} onClick={() => toggle(candidateName(c))}>
        {shown.has(candidateName(c)) ? 'Hide picture' : 'Show picture'}<span class="hidden"> of {candidateName(c)}</span></button></>},
    {key: 'predicted', name: 'predicted', unit: '× noise', number: true, sort: c => c.predictedError, cell: c => <>{fmtError(c.predictedError)}{c.predictedError === null && <span class="hidden"> {c.noPrediction}</span>}</>},
    {key: 'expected', name: 'expected parameters', unit: '± 95 %', cell: c => <ul class="plain">{c.expected.map(e =>
      <li key={e.name}>{e.name} <span class="whole">{fmt(e.value)}</span>{' '}
        <span class="whole">{e.stdError !== null && `± ${fmt(1.96 * e.stdError, 2)} `}{unitText(e.unit)}</span>
        {e.detectable !== null && <span class="note">detectable from {fmtUnit(e.detectable, e.unit, 2)}</span>}</li>)}</ul>},
    {key: 'p', name: 'p-value', number: true, sort: c => c.pValue, cell: c => <>{fmtP(c.pValue)}{c.accepted && c.pValue !== null && c.pValue > 0.01 && <span class="note">the refit decides</span>}</>},
    {key: 'train', name: 'confirmed', unit: '× noise', number: true, sort: c => c.confirmed?.train ?? null, cell: c => <>{fmtError(c.confirmed?.train)}{ofRefit(model, c).map(words => <span class="note" key={words}>{words}</span>)}</>},
    {key: 'holdout', name: 'held out', unit: '× noise', number: true, sort: c => c.confirmed?.holdout ?? null, cell: c => fmtError(c.confirmed?.holdout)},
    {key: 'same', name: 'indistinguishable from', cell: c => c.indistinguishableFrom.length
      ? <><Names names={c.indistinguishableFrom} />{c.separatedBy && <span class="note">{c.separatedBy}</span>}</> : '–'},
  ];
}

// Each may break before its target.
function Names({names}: {names: string[]}) {
  return <>{names.map((name, i) => {
    const at = name.lastIndexOf('@');
    return <Fragment key={name}>{i > 0 && ', '}{name.slice(0, at)}<wbr />{name.slice(at)}</Fragment>;
  })}</>;
}

// The unexplained force against what the law depends on, the law over it.
function Picture({page, model, candidate}: {page: PageData; model: ModelData; candidate: CandidateData}) {
  const places = strongestPlaces(model, candidate);
  const quantity = lawQuantity(candidate.effect);
  const name = candidateName(candidate);
  return (
    <div>
      {candidate.confirmed && <p class="note">After the refit: {list(candidate.confirmed.parameters.map(
        p => `${p.name} ${fmtUnit(p.value, p.unit)}`))}{ofRefit(model, candidate).map(words => `, ${words}`)}.</p>}
      {places.length === 0 && <Empty>{name} does not act as a force on a joint that can be drawn, or no unexplained force was found: judge it by its errors.</Empty>}
      <div class="grid-of-charts">
        {places.map(place => {
          const unit = model.force.find(f => forceName(f) === place)!.unit;
          const used = forceLayers(model, place, quantity, [candidate], [candidate]) ? quantity : 'velocity';
          const layers = forceLayers(model, place, used, [candidate], [candidate]);
          return layers && <XyChart key={place} title={`Unexplained force of ${place}, and ${name} with its expected parameters`}
            xLabel={quantityName(page, model, place, used)} yLabel={forceLabel(unit)} layers={layers} rules={[{y: 0, label: ''}]} />;
        })}
      </div>
    </div>
  );
}

// At most two, where the effect acts most.
function strongestPlaces(model: ModelData, c: CandidateData): string[] {
  const power = new Map<string, number>();
  c.force.forEach((series, i) => {
    const sum = meanSquare(series);
    const place = model.force[i] && forceName(model.force[i]);
    if (place && sum > 0) power.set(place, (power.get(place) ?? 0) + sum);
  });
  return [...power].sort((a, b) => b[1] - a[1]).slice(0, 2).map(([place]) => place);
}
