// Panel 1: how good is the model, in one sentence and a few numbers.
import type {ComponentChildren} from 'preact';
import {candidateName, errorsOver, positionUnit, prediction, runLabel, worstChannel, worstSegment} from '../data';
import {fmt, fmtError, fmtPercent, fmtTime, fmtTimes, fmtUnit, list, sentence} from '../format';
import type {CandidateData, ModelData, PageData} from '../page_data';
import {current, setCursor, setRun, setZoom, useStore} from '../state';
import {HowSure, ofRefit, Rivals} from './evidence';
import {Panel} from './panel';

const kWords = {
  adequate: 'Adequate', missing_effect: 'An effect is missing', undecided: 'Undecided', unexplained: 'Unexplained',
};

export function Verdict({page}: {page: PageData}) {
  const model = page.models[useStore(current)];
  const first = model.candidates[0];
  return (
    <Panel id="verdict" title="1 Verdict" wide
      how="Errors are multiples of the measurement noise: 1 × noise is as good as the sensor allows, with 5 × noise the model is wrong. Held-out data were not fitted by the search.">
      <Distrust model={model} />
      <p class="sentence">
        {model.verdict && <strong class={`badge ${model.verdict}`}>{kWords[model.verdict]}</strong>} {model.sentence}
      </p>
      <End page={page} model={model} />
      <HowSure page={page} model={model} />
      <Rivals page={page} model={model} />
      <dl class="tiles">
        <Tile name="Error of the fitted runs" value={fmtTimes(model.trainError)} note={fitOf(model.trainFitPercent) + errorsOver(model)} />
        <Tile name="Error of the held-out runs" value={fmtTimes(model.holdoutError)}
          note={model.holdoutError === null ? 'nothing was held out' : `${fitOf(model.holdoutFitPercent)}over segments of ${fmt(model.segment_s, 3)} s, each from its own state${model.joined ? ': not to be compared with that of the fitted runs' : ''}`} />
        <WholeRunsTile model={model} />
        {first && model.verdict !== 'adequate' && <FirstTile model={model} first={first} />}
        <WorstTile page={page} model={model} />
        <Tile name="Noise" value={fmtUnit(page.noise, positionUnit(page), 3)} note="standard deviation of a measured position" />
      </dl>
      <CannotBeTold model={model} />
      {page.notices.map(d => <p class="doubt" key={d}>{sentence(d)}</p>)}
      <Channels model={model} />
    </Panel>
  );
}

const kMostChannels = 4;

// Fitted and held-out runs by one measure: predicted from one initial state each.
function WholeRunsTile({model}: {model: ModelData}) {
  const open = model.open?.length ? model.open : model.wholeRuns?.open ?? [];
  if (!open.length) return null;
  const lines = [false, true].flatMap(heldOut => {
    const runs = open.filter(o => o.held_out === heldOut), time = runs.reduce((sum, o) => sum + o.duration_s, 0);
    return (runs[0]?.channels ?? []).slice(0, kMostChannels).map(({name, unit}) => {
      const of = runs.map(o => ({o, c: o.channels.find(c => c.name === name)}));
      const square = of.reduce((sum, {o, c}) => sum + o.duration_s * (c?.rms ?? NaN) ** 2, 0) / time;
      const worst = Math.min(...of.map(({c}) => c?.fit_percent ?? NaN));
      return `${name}, ${heldOut ? 'held out' : 'fitted'}: ${fmtUnit(Math.sqrt(square), unit, 3)}${Number.isFinite(worst) ? `, fit ${fmtPercent(worst)}` : ''}`;
    });
  });
  return <Tile name="Prediction of whole runs" isName value={lines[0]} note="rms error from one initial state for each run; of several runs the lowest fit">
    {lines.slice(1).map(l => <span class="note" key={l}>{l}</span>)}
  </Tile>;
}

function fitOf(percent: number | null | undefined): string {
  return percent === null || percent === undefined ? '' : `fit ${fmtPercent(percent)}, `;
}

// Why the fit is not to be trusted: before all else, for all else is its word.
function Distrust({model}: {model: ModelData}) {
  const why = model.doubts.length ? model.doubts : [
    ...(model.converged ? [] : [`the fit did not converge: ${model.termination}`]),
    ...model.parameters.filter(p => p.atBound).map(p => `${p.name} ended at its bound`),
  ];
  if (!why.length) return null;
  return (
    <div class="distrust" role="note" aria-label="Unreliable fit">
      <strong>Unreliable fit</strong>
      <ul>{why.map(d => <li key={d}>{sentence(d)}</li>)}</ul>
    </div>
  );
}

// What is true at the end, which the model that is shown first does not say.
function End({page, model}: {page: PageData; model: ModelData}) {
  const m = useStore(current), last = page.models.length - 1;
  if (page.conclusion) {
    const {sentence: text, good} = page.conclusion;
    return <p class="sentence end">
      <strong class={`badge ${good ? 'adequate' : 'unexplained'}`}>{good ? 'In the end: adequate' : page.steps.length ? 'In the end it still fails' : 'As given it fails'}</strong> {text}{' '}
      {m !== last && <button type="button" onClick={() => current.set(last)}>Show the final model</button>}
    </p>;
  }
  if (!model.wholeRuns) return null;
  return <p class="end">Fitted once more, as one trajectory over each whole run: {model.wholeRuns.sentence}
    {!model.wholeRuns.good && model.verdict === 'adequate' && ' What is small over a segment adds up over a whole run.'}</p>;
}

function Tile({name, value, note, children, isName}: {
  name: string; value: ComponentChildren; note?: string; children?: ComponentChildren; isName?: boolean;
}) {
  return <div class="tile"><dt>{name}</dt><dd><span class={isName ? 'big name' : 'big'}>{value}</span>{note && <span class="note">{note}</span>}{children}</dd></div>;
}

function WorstTile({page, model}: {page: PageData; model: ModelData}) {
  const channel = worstChannel(model), segment = worstSegment(model);
  if (!channel) return null;
  const index = segment ? page.runs.findIndex(r => r.name === segment.trajectory) : -1;
  const show = () => {
    setRun(index);
    setCursor((segment!.t_start + segment!.t_end) / 2);
    setZoom([segment!.t_start, segment!.t_end]);
    document.getElementById('compare')?.scrollIntoView();
  };
  return (
    <Tile name="Worst channel" isName value={channel.name}
      note={`${fmtTimes(channel.normalized_rms)}, ${fmtUnit(channel.rms, channel.unit, 3)} rms`}>
      {segment && <span class="note">
        worst in {index >= 0 ? runLabel(page, index) : segment.trajectory} from {fmtTime(segment.t_start)} s to {fmtTime(segment.t_end)} s: {fmtTimes(segment.normalized_rms)}{' '}
        {index >= 0 && <button type="button" onClick={show}>Show it</button>}
      </span>}
    </Tile>
  );
}

function FirstTile({model, first}: {model: ModelData; first: CandidateData}) {
  const confirmed = first.confirmed && `after a refit: ${fmtTimes(first.confirmed.train)}`
    + (first.confirmed.holdout === null ? '' : `, held out ${fmtTimes(first.confirmed.holdout)}`)
    + ofRefit(model, first).map(words => `, ${words}`).join('');
  return (
    <Tile name={model.verdict === 'missing_effect' ? 'First missing effect'
      : model.verdict === 'undecided' ? 'First of several candidates' : 'Best candidate, which does not explain it'}
      isName value={<>{first.effect}<wbr />@{first.target}</>} note={prediction(model, first)}>
      {confirmed && <span class="note">{confirmed}</span>}
    </Tile>
  );
}

function CannotBeTold({model}: {model: ModelData}) {
  // Among the doubts already, where there are any.
  const lines: string[] = (model.doubts.length ? [] : model.notIdentifiable).map(
    group => `${list(group)} ${group.length > 1 ? 'are not separately' : 'is not'} identifiable from this data.`);
  const first = model.candidates[0];
  if (model.verdict !== 'adequate' && first?.indistinguishableFrom.length) {
    lines.push(`${candidateName(first)} is indistinguishable from ${list(first.indistinguishableFrom)} in this data`
      + (first.separatedBy ? `: ${first.separatedBy}.` : '.'));
  }
  if (!lines.length) return null;
  return <>{lines.map(l => <p class="doubt" key={l}>{l}</p>)}</>;
}

function Channels({model}: {model: ModelData}) {
  if (!model.channels.length) return null;
  return (
    <details>
      <summary>Errors of all channels</summary>
      <div class="table-scroll"><table>
        <caption>Errors over segments of {fmt(model.segment_s, 3)} s{model.joined ? ', joined to one trajectory a run' : ', each predicted from its own state'}; the fit is the error as a share of the motion: 100 % is perfect, 0 % no better than the mean</caption>
        <thead><tr><th scope="col">channel</th><th scope="col" class="number">error, × noise</th><th scope="col" class="number">rms</th><th scope="col" class="number">fit</th><th scope="col" class="number">noise</th></tr></thead>
        <tbody>{model.channels.map(c => <tr key={c.name}>
          <th scope="row">{c.name}</th><td class="number">{fmtError(c.normalized_rms)}</td>
          <td class="number">{fmtUnit(c.rms, c.unit, 3)}</td><td class="number">{fmtPercent(c.fit_percent)}</td><td class="number">{fmtUnit(c.noise, c.unit, 3)}</td>
        </tr>)}</tbody>
      </table></div>
    </details>
  );
}
