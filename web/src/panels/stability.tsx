// Of panel 5: whether each law of the answer is constant.
import {runLabel} from '../data';
import {list, unitText} from '../format';
import type {ModelData, PageData, StabilityData} from '../page_data';
import {XyChart, type Layer} from '../plots/xy_chart';
import {axisOf, constancyOf, inWords, known, leaves, meaning, rangeOf, runsOf, type ConstancyOfParameter} from '../stability';
import {evidenceOfEnd} from './evidence';

const kHow = 'A law that explains has the same parameters at all times, speeds, positions, efforts and amplitudes, and in every run. Here the data are split into parts of equal size by one of these after the other. '
  + 'Each mark is the value that the parameter would have in that part alone, all other parameters being common; the bar is its 95 % interval. The line is the value for all data, with its interval as a band. '
  + 'A law whose force surely changes from part to part by 15 % or more, where that matters for the error, is not the true one: it stands in for another law.';
const kMost = 6; // parameters
const kMostRuns = 12; // that are named

export function Stability({page, model}: {page: PageData; model: ModelData}) {
  const all = constancyOf(model);
  if (!all.length) return null;
  const overall = new Map(evidenceOfEnd(page, model).flatMap(row => row.parameters.map(p => [p.name, p] as const)));
  const shown = all.slice(0, kMost), more = all.length - shown.length;
  const byRun = shown.some(p => p.splits.some(s => s.strata === 'run'));
  const runs = page.runs.filter(r => !r.heldOut).map((_, i) => runLabel(page, i)); // these come first
  return (
    <div class="stability" id="stability">
      <h3>Is each law constant?</h3>
      <p class="how">{kHow}</p>
      {shown.map(p => <Parameter key={`${p.effect} ${p.parameter}`} page={page} constancy={p} overall={overall.get(p.parameter)} />)}
      {byRun && <p class="note">{runs.length <= kMostRuns ? `Runs: ${list(runs.map((name, i) => `${i + 1} is ${name}`))}.`
        : 'Runs are numbered in the order in which they were given.'}</p>}
      {more > 0 && <p class="note">{more} more {more === 1 ? 'parameter, which differs' : 'parameters, which differ'} less for how well {more === 1 ? 'it is' : 'they are'} known, {more === 1 ? 'is' : 'are'} in the diagnosis.json of sysid_diagnose, under stability.</p>}
    </div>
  );
}

type Value = {value: number | null; stdError: number | null};

function Parameter({page, constancy, overall}: {page: PageData; constancy: ConstancyOfParameter; overall?: Value}) {
  const {parameter, effect, unit, joint, splits} = constancy;
  const bad = constancy.standsIn && splits.some(s => !s.constant);
  const range = rangeOf(splits);
  const ofMotion = splits.some(s => s.strata !== 'time' && s.strata !== 'run');
  return <>
    <h4>{parameter} <span class="note">of {effect}{ofMotion && !effect.endsWith(`@${joint}`) && `; by the motion of ${joint}`}</span>
      {bad && <>{' '}<span class="badge">stands in for another law</span></>}</h4>
    <div class="small-charts">
      {splits.map(s => <Split key={s.strata} page={page} split={s} bad={constancy.standsIn && !s.constant}
        name={parameter} unit={unitText(unit) || 'no unit'} range={range} overall={overall} />)}
    </div>
  </>;
}

function Split({page, split, bad, name, unit, range, overall}: {
  page: PageData; split: StabilityData; bad: boolean; name: string; unit: string; range: number[]; overall?: Value;
}) {
  const estimates = known(split), color = bad ? 'var(--bad)' : 'var(--first)', isRun = split.strata === 'run';
  const parts = estimates.map(({from, to}, i) => isRun ? runsOf(split, i) : [from, to]);
  const layers: Layer[] = [
    {label: '', color, kind: 'line', x: parts.flatMap(([from, to]) => [from, to, NaN]), y: estimates.flatMap(e => [e.value, e.value, NaN])},
    {label: '', color, kind: 'points', size: 6, x: parts.map(([from, to]) => (from + to) / 2), y: estimates.map(e => e.value),
      error: estimates.map(e => 1.96 * e.std_error), barOpacity: 1},
  ];
  const half = overall?.stdError === null ? 0 : 1.96 * (overall?.stdError ?? 0);
  const level = overall && overall.value !== null ? {value: overall.value, low: overall.value - half, high: overall.value + half} : undefined;
  return (
    <XyChart title={inWords(split)} of={name} bad={bad} xLabel={axisOf(page, split)} yLabel={unit} layers={layers} level={level} rangeY={range} whole={isRun} height={190}>
      <div>
        {bad && <p class="note">{meaning(split)}</p>}
        {leaves(split, range) && <p class="note">Where a bar leaves the panel, that part of the data tells little of it.</p>}
      </div>
    </XyChart>
  );
}
