// Panel 6: add an effect, remove it again, and see the error fall.
import type {ComponentChildren} from 'preact';
import {useState} from 'preact/hooks';
import {sameEffects, sameSegments} from '../cross_validation';
import {candidateName, modelWithId, prediction, wayTo, withOthers} from '../data';
import {fmtError, fmtTimes, fmtUnit} from '../format';
import type {CandidateData, ModelData, PageData} from '../page_data';
import {Waterfall, type Fall} from '../plots/waterfall';
import {add, isRunning, remove} from '../server';
import {compared, current, studio, useStore} from '../state';
import {Choice, Command, Empty, Panel} from './panel';
import {Path} from './path';
import {kNothingMissing, noCandidates} from './which';

const kOffered = 8;

export function Add({page}: {page: PageData}) {
  const m = useStore(current);
  const model = page.models[m];
  return (
    <Panel id="add" title="6 Add" wide how={page.live
      ? 'A button adds the effect and fits again; the page then shows the new model beside the one it came of, which stays.'
      : 'This page is frozen: copy a command and run it to add the effect and fit again; sysid_studio, by the last of these commands, does it by a button.'}>
      {page.live ? <LiveAdd page={page} model={model} /> : <FrozenAdd page={page} model={model} />}
      <h3>How the error fell</h3>
      <Steps page={page} />
      <h3>Two models beside each other</h3>
      <TwoModels page={page} m={m} />
    </Panel>
  );
}

function LiveAdd({page, model}: {page: PageData; model: ModelData}) {
  const busy = isRunning(useStore(studio));
  return <>
    {model.candidates.length === 0 && <Empty>{noCandidates(page, model)}</Empty>}
    {model.candidates.length > 0 && model.verdict !== 'adequate' && <p>The buttons in the <a href="#which">table of candidates</a> add an effect.</p>}
    {model.candidates.length > 0 && model.verdict === 'adequate' && <Offers model={model}><ul class="offers">
      {model.candidates.slice(0, kOffered).map(c => {
        return <li key={candidateName(c)}><AddButton model={model} candidate={c} />
          <span class="note">{prediction(model, c)}</span></li>;
      })}
    </ul></Offers>}
    <ul class="offers">
      {model.effects.map(name => <li key={`-${name}`}>
        <button type="button" disabled={busy} onClick={() => void remove(model.id, name)}>Remove {name}</button></li>)}
    </ul>
    <TypedEffect model={model} busy={busy} />
  </>;
}

// Any effect of the catalogue, and laws of the user's own.
function TypedEffect({model, busy}: {model: ModelData; busy: boolean}) {
  const [text, setText] = useState('');
  return <form class="typed" onSubmit={e => {
    e.preventDefault();
    if (text.trim() && !busy) void add(model.id, text.trim());
  }}>
    <label>Another effect, or a law of your own
      <input type="text" value={text} spellcheck={false} autocomplete="off" placeholder="custom@joint1: -k*q^3 - b*abs(qd)*qd"
        onInput={e => setText(e.currentTarget.value)} /></label>
    <button type="submit" disabled={busy || !text.trim()}>Screen it and add it</button>
    <p class="note">KIND@TARGET, as --add takes it. In a law, q and qd are the joint's position and velocity, joint2.q another joint's, t the time; other names are parameters, which the fit estimates.</p>
  </form>;
}

export function AddButton({model, candidate}: {model: ModelData; candidate: CandidateData}) {
  const name = toAdd(candidate), busy = isRunning(useStore(studio));
  return <button type="button" class="primary" disabled={busy} onClick={() => void add(model.id, name)}>Add {name}</button>;
}

// An adequate model lacks nothing: its candidates are there for who asks.
function Offers({model, children}: {model: ModelData; children: ComponentChildren}) {
  if (model.verdict !== 'adequate') return <>{children}</>;
  return <>
    <Empty>{kNothingMissing}</Empty>
    <details><summary>Add an effect all the same</summary>{children}</details>
  </>;
}

// Those that add the same effects once.
function offers(model: ModelData): CandidateData[] {
  return model.candidates.filter((c, i, all) => all.findIndex(o => sameEffects(withOthers(o), withOthers(c))) === i);
}

// A prediction is of the candidate alone: of several the refit tells.
function promise(model: ModelData, c: CandidateData): string {
  const {confirmed} = c;
  if (!confirmed?.togetherWith.length) return prediction(model, c);
  return `after a refit: ${fmtTimes(confirmed.train)}${confirmed.holdout === null ? '' : `, held out ${fmtTimes(confirmed.holdout)}`}, over segments of ${fmtUnit(confirmed.segment_s, 's', 3)}`;
}

const toAdd = (c: CandidateData): string => withOthers(c).join(',');

// The same runs and options; what only its program knows left out.
export function studioCommand(page: PageData): string {
  return page.command.replace(/^\S+/, 'sysid_studio').replace(/ --auto(?= |$)/, '');
}

function FrozenAdd({page, model}: {page: PageData; model: ModelData}) {
  return <>
    {model.candidates.length ? <FrozenOffers model={model} /> : <Empty>{noCandidates(page, model)}</Empty>}
    <p>To add and remove by a button:</p>
    <Command text={studioCommand(page)} label="command of the studio" />
  </>;
}

function FrozenOffers({model}: {model: ModelData}) {
  return (
    <Offers model={model}><ul class="offers frozen">
      {offers(model).slice(0, kOffered).map((c, i) => {
        const name = toAdd(c);
        const body = <Command text={c.command} label={`command that adds ${name}`} />;
        return <li key={name}>{i === 0
          ? <><span>Add {name}; {promise(model, c)}</span>{body}</>
          : <details><summary>Add {name}; {promise(model, c)}</summary>{body}</details>}</li>;
      })}
    </ul></Offers>
  );
}

const titleOf = (page: PageData, id: number | null) =>
  (id === null ? undefined : modelWithId(page, id)?.title) ?? 'without it';

function Steps({page}: {page: PageData}) {
  const m = useStore(current);
  if (!page.steps.length) {
    return <Empty>No effect was added or removed yet: {page.live ? 'a button above does.' : 'sysid_diagnose --auto adds what is missing, sysid_studio adds it by a button.'}</Empty>;
  }
  // Of models beside each other, the way to the one that is shown.
  const way = [page.models[m].id, page.steps[page.steps.length - 1].model]
    .map(id => wayTo(page, id)).find(w => w.length) ?? page.steps;
  const first = way[0];
  const falls: Fall[] = [
    {title: titleOf(page, first.from), train: first.trainBefore, holdout: first.holdoutBefore,
     predicted: null, trainBefore: null, holdoutBefore: null},
    ...way.map(s => ({title: s.title, train: s.trainAfter, holdout: s.holdoutAfter,
      predicted: s.predicted, trainBefore: s.trainBefore, holdoutBefore: s.holdoutBefore})),
  ];
  return <>
    <div class="grid-of-charts course">
      <Path page={page} way={way} end={modelWithId(page, way[way.length - 1].model)!} />
      <Waterfall falls={falls} />
    </div>
    {way.length < page.steps.length && <p class="note">The bars are the way to {titleOf(page, way[way.length - 1].model)}; the table has every step.</p>}
    <div class="table-scroll"><table>
      <caption>Errors before and after each step, × noise</caption>
      <thead><tr>{['step', 'of', 'predicted', 'fitted, before', 'fitted, after', 'held out, before', 'held out, after'].map((h, i) =>
        <th scope="col" key={h} class={i > 1 ? 'number' : ''}>{h}</th>)}<th scope="col">show</th></tr></thead>
      <tbody>{page.steps.map((s, i) => <tr key={i}>
        <th scope="row">{s.title}</th>
        <td>{titleOf(page, s.from)}</td>
        {[s.predicted, s.trainBefore, s.trainAfter, s.holdoutBefore, s.holdoutAfter].map((v, k) =>
          <td class="number" key={k}>{fmtError(v)}</td>)}
        <td><ShowStep page={page} id={s.model} title={s.title} /></td>
      </tr>)}</tbody>
    </table></div>
  </>;
}

function ShowStep({page, id, title}: {page: PageData; id: number; title: string}) {
  const model = modelWithId(page, id);
  const m = useStore(current);
  if (!model) return null;
  const index = page.models.indexOf(model);
  return <button type="button" aria-pressed={m === index} onClick={() => {
    if (m !== index) compared.set(m);
    current.set(index);
  }}>Show<span class="hidden"> {title}</span></button>;
}

function TwoModels({page, m}: {page: PageData; m: number}) {
  const c = useStore(compared);
  if (page.models.length < 2) return <Empty>There is one model so far; a second one comes with the first effect.</Empty>;
  const a = page.models[m], b = page.models[c ?? m];
  const names = [...new Set([...a.parameters, ...b.parameters].map(p => p.name))];
  const value = (model: ModelData, name: string) => {
    const p = model.parameters.find(x => x.name === name);
    return p ? fmtUnit(p.value, p.unit) : '–';
  };
  const models = page.models.map((x, i) => ({value: i, text: x.title}));
  return <>
    <div class="row">
      <Choice label="Model" value={m} options={models} onChange={v => current.set(v)} />
      <Choice label="Compared with" value={c ?? m} options={models} onChange={v => compared.set(v)} />
    </div>
    <div class="table-scroll"><table>
      <caption>{a.title} beside {b.title}</caption>
      <thead><tr><th scope="col" /><th scope="col" class="number">{a.title}</th><th scope="col" class="number">{b.title}</th></tr></thead>
      <tbody>
        <tr><th scope="row">error of fitted data</th><td class="number">{fmtTimes(a.trainError)}</td><td class="number">{fmtTimes(b.trainError)}</td></tr>
        <tr><th scope="row">error of held-out data</th><td class="number">{fmtTimes(a.holdoutError)}</td><td class="number">{fmtTimes(b.holdoutError)}</td></tr>
        <tr><th scope="row">over segments of</th><td class="number">{fmtUnit(a.segment_s, 's', 3)}</td><td class="number">{fmtUnit(b.segment_s, 's', 3)}</td></tr>
        {names.map(n => <tr key={n}><th scope="row">{n}</th><td class="number">{value(a, n)}</td><td class="number">{value(b, n)}</td></tr>)}
      </tbody>
    </table></div>
    {!sameSegments(a.segment_s, b.segment_s) && <p class="note">Errors grow along a segment, so that these are not comparable; each step of the path above compares over one length.</p>}
  </>;
}
