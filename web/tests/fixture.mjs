// Documents for the tests: what sysid would write of a planar double pendulum
// with a hidden Coulomb friction, of a long run, and of a spherical pendulum.

// Small and repeatable (mulberry32).
export function random(seed) {
  let a = seed >>> 0;
  const uniform = () => {
    a = (a + 0x6D2B79F5) >>> 0;
    let t = Math.imul(a ^ (a >>> 15), 1 | a);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
  const normal = () => Math.sqrt(-2 * Math.log(1 - uniform())) * Math.cos(2 * Math.PI * uniform());
  return {uniform, normal};
}

export function series(values) {
  return {f32: Buffer.from(Float32Array.from(values).buffer).toString('base64')};
}

const kNoise = 1e-3, kRate_hz = 100, kLength = 0.5, kMass = 1, kGravity = 9.81;
const kFriction = 0.05, kSegment_s = 2;

const kPlanarUrdf = `<?xml version="1.0"?>
<robot name="pendulum2_planar">
  <link name="base"/>
  <joint name="joint1" type="continuous"><origin xyz="0 0 0"/><parent link="base"/><child link="link1"/><axis xyz="0 1 0"/></joint>
  <link name="link1"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="4e-5" ixy="0" ixz="0" iyy="4e-5" iyz="0" izz="7.5e-5"/></inertial></link>
  <joint name="joint2" type="continuous"><origin xyz="0 0 -0.5"/><parent link="link1"/><child link="link2"/><axis xyz="0 1 0"/></joint>
  <link name="link2"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="4e-5" ixy="0" ixz="0" iyy="4e-5" iyz="0" izz="7.5e-5"/></inertial></link>
  <joint name="tip_joint" type="fixed"><origin xyz="0 0 -0.5"/><parent link="link2"/><child link="tip"/></joint>
  <link name="tip"/>
</robot>`;

// Accelerations of two point masses on rods; x = q1, q2, qd1, qd2, with q2
// relative to the first rod and friction in the second joint.
function derivative(x, friction) {
  const [q1, q2, w1, w2] = x;
  const a = q1, b = q1 + q2, va = w1, vb = w1 + w2;
  const tau = -friction * Math.tanh(w2 / 0.01);
  const l = kLength, m = kMass, c = Math.cos(a - b), s = Math.sin(a - b);
  // M [a''; b''] = f in absolute angles; the joint's torque acts on both.
  const m11 = 2 * m * l * l, m12 = m * l * l * c, m22 = m * l * l;
  const f1 = -m * l * l * s * vb * vb - 2 * m * kGravity * l * Math.sin(a) - tau;
  const f2 = m * l * l * s * va * va - m * kGravity * l * Math.sin(b) + tau;
  const det = m11 * m22 - m12 * m12;
  const aa = (m22 * f1 - m12 * f2) / det, bb = (m11 * f2 - m12 * f1) / det;
  return [w1, w2, aa, bb - aa];
}

function step(x, h, friction) {
  const plus = (y, k, s) => y.map((v, i) => v + s * k[i]);
  const k1 = derivative(x, friction), k2 = derivative(plus(x, k1, h / 2), friction);
  const k3 = derivative(plus(x, k2, h / 2), friction), k4 = derivative(plus(x, k3, h), friction);
  return x.map((v, i) => v + h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]));
}

function simulate(start, samples, friction) {
  const out = [start];
  while (out.length < samples) out.push(step(out[out.length - 1], 1 / kRate_hz, friction));
  return out;
}

function rms(lists) {
  let sum = 0, n = 0;
  for (const values of lists) for (const v of values) if (Number.isFinite(v)) sum += v * v, n++;
  return Math.sqrt(sum / n);
}

const column = (states, i) => states.map(x => x[i]);

function makeRun(name, start, samples, heldOut, rng) {
  const truth = simulate(start, samples, kFriction);
  const measured = [0, 1].map(i => truth.map(x => x[i] + kNoise * rng.normal()));
  measured[1].fill(NaN, 40, 44); // a gap
  return {
    truth, measured, t: truth.map((_, i) => i / kRate_hz),
    data: {
      name, heldOut, t: series(truth.map((_, i) => i / kRate_hz)),
      channels: [0, 1].map(i => ({
        name: `joint${i + 1}`, joint: `joint${i + 1}`, kind: 'position', unit: 'rad', noise: kNoise,
        components: ['q'], measured: [series(measured[i])],
      })),
      efforts: [],
    },
  };
}

function predict(run, friction) {
  const per = kSegment_s * kRate_hz;
  const states = [], cuts = [];
  for (let i = 0; i < run.truth.length; i += per) {
    cuts.push(i / kRate_hz);
    states.push(...simulate(run.truth[i], Math.min(per, run.truth.length - i), friction));
  }
  cuts.push(run.t[run.t.length - 1]);
  const residual = [0, 1].map(i => states.map((x, k) => (x[i] - run.measured[i][k]) / kNoise));
  return {
    states, residual, cuts,
    data: {
      cuts, efforts: null,
      channels: [0, 1].map(i => ({predicted: [series(column(states, i))], residual: [series(residual[i])]})),
      q: [0, 1].map(i => series(column(states, i))),
      qd: [2, 3].map(i => series(column(states, i))),
      measuredQ: run.measured.map(series),
    },
  };
}

function errors(runs, predictions) {
  const of = held => {
    const lists = predictions.filter((_, i) => runs[i].data.heldOut === held).flatMap(p => p.residual);
    return lists.length ? rms(lists) : null;
  };
  const channels = [0, 1].map(i => {
    const normalized_rms = rms(predictions.map(p => p.residual[i]));
    return {name: `joint${i + 1}`, unit: 'rad', rms: normalized_rms * kNoise, normalized_rms, noise: kNoise};
  });
  const segments = predictions.flatMap((p, r) => p.cuts.slice(0, -1).map((t, k) => ({
    trajectory: runs[r].data.name, t_start: t, t_end: p.cuts[k + 1],
    normalized_rms: rms(p.residual.map(x => x.slice(k * kSegment_s * kRate_hz, (k + 1) * kSegment_s * kRate_hz))),
  })));
  return {trainError: of(false), holdoutError: of(true), channels, segments};
}

// Of stretches of a second; one without data has no error.
export function crossValidation(stretches) {
  const logs = stretches.filter(s => s.error !== null).map(s => Math.log(s.error)), n = logs.length;
  const mean = logs.reduce((a, b) => a + b, 0) / n;
  const std = Math.sqrt(logs.reduce((a, b) => a + (b - mean) ** 2, 0) / (n * (n - 1)));
  return {error: Math.exp(mean), stdError: Math.exp(mean) * std, stretches};
}

function leftOut(runs, predictions) {
  return crossValidation(predictions.flatMap((p, r) => Array.from({length: Math.floor(runs[r].t.at(-1))}, (_, k) => ({
    trajectory: runs[r].data.name, t_start: k, t_end: k + 1,
    error: rms(p.residual.map(v => v.slice(k * kRate_hz, (k + 1) * kRate_hz))),
  }))));
}

// The same errors times a factor that varies a little from stretch to stretch.
const scaled = (cv, factor) => crossValidation(cv.stretches.map((s, i) => ({...s, error: s.error * factor * (1 + 0.1 * Math.sin(i))})));

// One prediction over each whole run, `times` as far off as the noise.
function open(runs, times) {
  return runs.map(r => ({trajectory: r.data.name, duration_s: r.t.at(-1), held_out: r.data.heldOut,
    channels: [1, 2].map(i => ({name: `joint${i}`, unit: 'rad', rms: times * i * kNoise, fit_percent: 100 - 0.1 * times * i}))}));
}

function parameters(withEffect) {
  const of = (name, unit, value, stdError, more = {}) => ({
    name, unit, initial: 0.45, value, stdError, ci95: [value - 1.96 * stdError, value + 1.96 * stdError],
    lower: 0.05, upper: 2, atBound: false, identifiable: true, ofEffect: null, ...more,
  });
  return [
    of('link1.length', 'm', 0.50012, 2.1e-5), of('link2.length', 'm', 0.4996, 3.3e-5),
    ...(withEffect ? [of('joint2.friction', 'N m', 0.04998, 8.5e-5, {initial: 0, lower: null, upper: null, ofEffect: 'coulomb_friction@joint2'})] : []),
  ];
}

function candidates(force) {
  const velocities = force.map(f => f.velocityValues);
  const law = f => velocities.map((v, i) => series(force[i].joint === 'joint2' ? v.map(f) : v.map(() => 0)));
  const make = (effect, target, text, predicted, name, unit, value, more = {}) => ({
    effect, target, law: text, score: 1e5 / predicted, dof: 1, pValue: predicted > 4 ? 1e-7 : 0, predictedError: predicted, noPrediction: predicted === null ? 'to first order it gains nothing' : '',
    expected: [{name, unit, value, stdError: value * 0.01, detectable: Math.abs(value) * 0.004}],
    confirmed: null, accepted: false, refused: '', indistinguishableFrom: [], separatedBy: '', force: [],
    command: `sysid_fit --model pendulum2_planar --traj run_1.csv --holdout run_2.csv --add ${effect}@${target}`, ...more,
  });
  return [
    make('coulomb_friction', 'joint2', '-c sign(qd), smoothed', 1.04, 'joint2.friction', 'N m', kFriction, {
      confirmed: {train: 1.002, holdout: 1.01, crossValidation: null, segment_s: kSegment_s, togetherWith: [], parameters: [{name: 'joint2.friction', unit: 'N m', value: 0.04998}]},
      accepted: true, indistinguishableFrom: ['stribeck_friction@joint2'],
      separatedBy: 'stribeck_friction@joint2 is identified by very slow beside fast motion of the joint',
      force: law(v => -kFriction * Math.tanh(v / 0.01)),
    }),
    make('viscous_damping', 'joint2', '-d qd', 3.4, 'joint2.damping', 'N m s/rad', 0.0173, {
      confirmed: {train: 3.5, holdout: 4.1, crossValidation: null, segment_s: kSegment_s, togetherWith: [], parameters: [{name: 'joint2.damping', unit: 'N m s/rad', value: 0.018}]},
      refused: 'the held-out error falls less than another effect lets it',
      force: law(v => -0.0173 * v),
    }),
    make('quadratic_drag', 'joint2', '-b |qd| qd', 5.2, 'joint2.quadratic_drag', 'N m s^2/rad^2', 0.0061, {force: law(v => -0.0061 * Math.abs(v) * v)}),
    make('sensor_offset', 'joint1', 'measured = true + offset', 11.3, 'joint1.sensor_offset', 'rad', 0.0004),
    make('effort_delay', 'base', 'measured effort acts later', null, 'effort_delay', 's', 0, {pValue: 1}),
  ];
}

// What no candidate explains, at knots 0.1 s apart.
function forces(runs, rng) {
  return runs.filter(r => !r.data.heldOut).flatMap(run => [0, 1].map(i => {
    const knots = run.truth.filter((_, k) => k % 10 === 0).slice(0, 400);
    const velocityValues = knots.map(x => x[2 + i]);
    const value = knots.map(x => (i ? -kFriction * Math.tanh(x[3] / 0.01) : 0) + 0.004 * rng.normal());
    return {velocityValues, joint: `joint${i + 1}`, data: {
      joint: `joint${i + 1}`, component: '', unit: 'N m', trajectory: run.data.name,
      t: series(knots.map((_, k) => k / 10)), value: series(value), std: series(value.map(() => 0.004)),
      position: series(column(knots, i)), velocity: series(velocityValues), effort: series([]),
    }};
  }));
}

function history(solver, iterations, rate, floor) {
  return {solver, points: Array.from({length: iterations}, (_, i) => ({iteration: i, cost: floor + 4e4 * Math.exp(-rate * i), time_s: 0.01 * (i + 1)}))};
}

// Short segments, then long ones, whose cost is higher.
function stages(solver) {
  const short = history(solver, 5, 1.6, 300).points, long = history(solver, 4, 2, 8e4).points;
  return {solver, points: [...short, ...long.map((p, i) => ({...p, iteration: 5 + i, time_s: 0.06 + 0.03 * i}))]};
}

// As one trajectory a run.
function wholeRuns(withEffect, found, runs) {
  return {
    sentence: `The error is ${withEffect ? '1.00' : '61.2'} times the noise (held out ${found.holdoutError.toPrecision(3)}): ${withEffect ? 'at the noise floor' : 'the model misses something'}.`,
    good: withEffect, trainError: withEffect ? 1.0 : 61.2, holdoutError: found.holdoutError, open: open(runs, withEffect ? 1.1 : 120),
    parameters: [{name: 'link1.length', unit: 'm', value: 0.50021, ci95: [0.50015, 0.50027]}],
  };
}

function files(title) {
  return [
    {name: 'identified.urdf', type: 'application/xml', text: kPlanarUrdf},
    {name: 'fit.json', type: 'application/json', text: JSON.stringify({schema: 'sysid.fit/1', title}, null, 1)},
    {name: 'identified.sysid.yaml', type: 'application/yaml', text: 'model: identified.urdf\n'},
    {name: 'prediction.csv', type: 'text/csv', text: null},
  ];
}

// `seconds` of two runs, the second held out.
// White with the effect; without it, joint2 is correlated with itself.
function correlograms(withEffect) {
  const of = (lags, value) => ({lag_s: lags, value: lags.map(value), band: lags.map(() => 0.09)});
  const lags = Array.from({length: 20}, (_, l) => (l + 1) / kRate_hz);
  return {
    channels: ['joint1', 'joint2'].map((channel, c) => ({channel,
      ...of(lags, (t, l) => !withEffect && c ? 0.8 * Math.exp(-12 * t) : 0.05 * Math.sin(7 * l + c))})),
    inputs: [{channel: 'joint1', input: 'joint2', ...of([-0.1, 0, 0.1, 0.2, 0.3, 0.4], t => withEffect ? 0.02 : 0.4 - t)}],
  };
}

export function planarPage({seconds = 8, live = false} = {}) {
  const rng = random(1);
  const n = Math.round(seconds * kRate_hz) + 1;
  const runs = [
    makeRun('run_1.csv', [0.9, -0.4, 0, 1.5], n, false, rng),
    makeRun('run_2.csv', [-0.6, 0.8, 0.5, 0], Math.min(n, 801), true, rng),
  ];
  const force = forces(runs, rng);
  const model = (id, withEffect) => {
    const predictions = runs.map(r => predict(r, withEffect ? kFriction : 0));
    const found = errors(runs, predictions);
    const shown = x => x.toPrecision(3);
    return {
      id, title: withEffect ? '+ coulomb_friction@joint2' : 'as given',
      effects: withEffect ? ['coulomb_friction@joint2'] : [], converged: true,
      termination: 'The cost no longer falls.', ...found,
      verdict: withEffect ? 'adequate' : 'missing_effect',
      sentence: withEffect
        ? `The error is ${shown(found.trainError)} times the noise (held out ${shown(found.holdoutError)}): nothing is missing that this data can show.`
        : `The error is ${shown(found.trainError)} times the noise (held out ${shown(found.holdoutError)}): coulomb_friction@joint2 is missing; with it the error is 1.00 (held out 1.01).`,
      doubts: [], segment_s: kSegment_s, joined: false, wholeRuns: live ? wholeRuns(withEffect, found, runs) : null, predictions: predictions.map(p => p.data),
      open: [], crossValidation: leftOut(runs, predictions), rivals: [], stability: [], standIns: [], proposals: [], nextExperiment: null,
      horizon: [0.1, 0.2, 0.5, 1, 2].map(h => ({horizon_s: h, rms: kNoise * (withEffect ? 1.02 : 1 + 12 * h ** 1.6), noise_rms: kNoise * (1 + 0.3 * h)})),
      parameters: parameters(withEffect),
      efforts: null, holdoutEfforts: null,
      discrepancy: withEffect ? [] : [{joint: 'joint2', force_std: 0.0471, correlation_time_s: 0.32}],
      residuals: correlograms(withEffect),
      correlation: withEffect ? [[1, -0.83, 0.21], [-0.83, 1, null], [0.21, null, 1]] : [[1, -0.82], [-0.82, 1]],
      correlationNames: parameters(withEffect).map(p => p.name), notIdentifiable: [['link1.mass', 'link2.mass']],
      histories: [stages('lm'), history('Adam', 80, 0.09, 900)],
      candidates: withEffect ? [] : candidates(force), force: withEffect ? [] : force.map(f => f.data),
      files: files(id), nextCommand: withEffect ? '' : 'sysid_fit --model pendulum2_planar --traj run_1.csv --holdout run_2.csv --add coulomb_friction@joint2',
    };
  };
  const models = [model(0, false), model(1, true)];
  models[0].candidates[0].confirmed.crossValidation = models[1].crossValidation;
  models[0].candidates[1].confirmed.crossValidation = scaled(models[0].crossValidation, 0.08);
  return {
    schema: 'sysid.page/1', program: live ? 'sysid_studio' : 'sysid_diagnose', version: '0.2.0', live,
    model: 'pendulum2_planar', command: 'sysid_diagnose --model pendulum2_planar --traj run_1.csv --holdout run_2.csv --auto --out result',
    notices: [], noise: kNoise,
    mechanism: {urdf: kPlanarUrdf, joints: [0, 1].map(i => ({name: `joint${i + 1}`, type: 'continuous', unit: 'rad', effortUnit: 'N m', q: i, v: i}))},
    runs: runs.map(r => r.data), models, current: 0, compared: 1,
    conclusion: null, leftOut: null, steps: [{title: '+ coulomb_friction@joint2', model: 1, from: 0, predicted: 1.04, trainBefore: models[0].trainError,
      trainAfter: models[1].trainError, holdoutBefore: models[0].holdoutError, holdoutAfter: models[1].holdoutError,
      segment_s: kSegment_s, crossValidationBefore: models[0].crossValidation}],
  };
}

// What sysid_fit leaves: one model, nothing asked of it.
export function fitPage() {
  const page = planarPage();
  const model = {...page.models[0], verdict: null, crossValidation: null, candidates: [], force: [], horizon: [], holdoutError: null, nextCommand: 'sysid_diagnose --model pendulum2_planar --traj run_1.csv',
    sentence: 'The error of the fitted runs is far above the noise: the model misses something.'};
  return {...page, program: 'sysid_fit', models: [model], steps: [], current: 0, compared: null, runs: page.runs.map(r => ({...r, heldOut: false}))};
}

// What sysid_diagnose --auto leaves of a search that did not mend the model: the
// first fit at its bounds, the last fit of whole runs far from the noise.
export function failedPage() {
  const page = planarPage();
  const [given, added] = page.models;
  const doubted = {...given, doubts: ['link1.inertia_scale ended at its bound', 'link1.mass, link2.mass are not separately identifiable from this data'],
    candidates: given.candidates.map((c, i) => ({...c, predictedError: null, noPrediction: 'the model is too far from this data for a prediction', pValue: i ? c.pValue : 1}))};
  const runs = page.runs.map(r => ({data: r, t: [0, 8]}));
  const whole = {...wholeRuns(false, added, runs), trainError: 8.75, sentence: 'The error is 8.75 times the noise (held out 9.1): the model misses something.'};
  const final = {...added, id: 2, title: 'final fit, whole runs', verdict: null, sentence: whole.sentence, trainError: 8.75, holdoutError: 9.1, joined: true, crossValidation: null, open: whole.open};
  return {...page, models: [doubted, {...added, wholeRuns: whole}, final],
    conclusion: {good: false, sentence: 'The search ended with coulomb_friction@joint2: over segments of 2 s, each from its own state, the error is 1.00 times the noise (held out 1.01), and no relevant effect is missing. '
      + 'Fitted once more, as one trajectory over each whole run, the error is 8.75 times the noise (held out 9.1): the model misses something. What is small over a segment adds up over a whole run.'}};
}

// What sysid_diagnose --auto leaves where the data do not decide: two steps, the
// second one over longer segments, and a rival in its place.
export function undecidedPage() {
  const page = planarPage();
  const [given, first] = page.models;
  const effects = ['coulomb_friction@joint2', 'viscous_damping@joint1'];
  const longer = scaled(first.crossValidation, 1.9), cv = scaled(first.crossValidation, 1.2);
  const second = {...first, id: 2, title: '+ viscous_damping@joint1', effects, segment_s: 4, crossValidation: cv, trainError: 1.2, holdoutError: 1.3,
    verdict: 'unexplained', sentence: 'The error is 1.20 times the noise (held out 1.30): the model does not explain the data.',
    parameters: [...first.parameters, {...first.parameters[2], name: 'joint1.damping', unit: 'N m s/rad', value: 0.0113, ofEffect: effects[1]}]};
  const rivals = [
    {effects, separatedBy: '', sameForce: true, crossValidation: cv, holdoutError: 1.3},
    {effects: [effects[0], 'quadratic_drag@joint1'], sameForce: false, separatedBy: 'they differ only in how they grow over both slow and fast motion of the joint: the wider its range, the better',
      crossValidation: scaled(cv, 1.02), holdoutError: 1.31},
  ];
  return {...page, models: [{...given, verdict: 'undecided', rivals,
    nextExperiment: {words: 'if one of the rivals is right, this motion shows which, with a probability of 0.99',
      command: 'sysid_simulate --model pendulum2_planar --tilt 1.2 --duration 16 --out_csv planned_motion.csv'},
    sentence: 'The error is 44.2 times the noise (held out 64.2): an effect is missing; these explain the data equally well: coulomb_friction@joint2 and viscous_damping@joint1; coulomb_friction@joint2 and quadratic_drag@joint1. With the first the error is 1.20 (held out 1.30).'},
    first, second], compared: 2,
    steps: [...page.steps, {...page.steps[0], title: second.title, model: 2, from: 1, predicted: 1.3, trainBefore: 2.0, trainAfter: 1.2, holdoutBefore: 2.1,
      holdoutAfter: 1.3, segment_s: 4, crossValidationBefore: longer}]};
}

// Of a parameter in equal parts of what goes from `from` to `to`.
export function split(effect, parameter, strata, [from, to], values, stdErrors, more = {}) {
  const width = (to - from) / values.length;
  return {effect, parameter, unit: 'N m s/rad', joint: 'joint2', strata, spread: 0.02, least_spread: 0, trend: 'none', constant: true,
    estimates: values.map((value, i) => ({from: from + i * width, to: from + (i + 1) * width, value, std_error: stdErrors[i]})), ...more};
}

// What sysid_diagnose leaves where a law only stands in for another one: a damping
// for the friction that is missing, which falls with the speed. A formula closes
// the gap.
export function standInPage() {
  const page = planarPage();
  const [given, added] = page.models;
  const effects = ['gravity_tilt@base', 'viscous_damping@joint2'];
  const stability = [
    split(effects[0], 'gravity_tilt_x', 'time', [0, 8], [0.0101, 0.0099, 0.0100, 0.0102], [1e-4, 1e-4, 1e-4, 1e-4], {unit: 'rad', joint: 'joint1'}),
    split(effects[0], 'gravity_tilt_x', 'speed', [0, 4], [0.0103, 0.0098, 0.0101, 0.0099], [2e-4, 2e-4, 2e-4, 2e-4], {unit: 'rad', joint: 'joint1'}),
    split(effects[1], 'joint2.damping', 'time', [0, 8], [0.0175, 0.0171, 0.0174, 0.0172], [4e-4, 4e-4, 4e-4, 4e-4]),
    split(effects[1], 'joint2.damping', 'speed', [0, 4], [0.046, 0.024, 0.016, 0.0121], [4e-3, 9e-4, 6e-4, 4e-4], {spread: 0.61, least_spread: 0.5, trend: 'falls', constant: false}),
    split(effects[1], 'joint2.damping', 'position', [-1, 1], [0.0174, 0.3, 0.0169, 0.0171], [8e-4, 0.2, 8e-4, 7e-4]),
    split(effects[1], 'joint2.damping', 'run', [1, 3], [0.0172, 0.0173], [7e-4, 5e-4], {spread: 0}),
  ];
  const standIns = [{effect: effects[1], parameter: 'joint2.damping', strata: 'speed'}];
  const proposals = [{effects: ['custom@joint2: c1*qd/(0.01+abs(qd))'], crossValidatedError: 1.06, holdoutError: 1.09, segment_s: kSegment_s,
    parameters: [{name: 'joint2.c1', unit: '', value: -0.0497, stdError: 1.1e-4}],
    command: "sysid_fit --model pendulum2_planar --traj run_1.csv --holdout run_2.csv --add 'custom@joint2: c1*qd/(0.01+abs(qd))'"}];
  const found = {stability, standIns};
  const estimate = (name, unit, value, stdError, ofEffect) => ({...added.parameters[2], name, unit, value, stdError, ofEffect});
  return {...page, models: [
    {...given, ...found, proposals, verdict: 'unexplained',
      sentence: 'The error is 44.2 times the noise (held out 64.2), and no effect of the catalogue explains it: the unexplained forces show what is left. With gravity_tilt@base and viscous_damping@joint2 the error is 3.50 times the noise (held out 4.10). '
        + 'viscous_damping@joint2 lowers the error, but a law that explains is constant, and joint2.damping falls with the speed of joint2: 0.046 at 0 to 1 rad/s, 0.0121 at 3 to 4 rad/s. It stands in for another law.'},
    {...added, ...found, title: '+ gravity_tilt@base + viscous_damping@joint2', effects, verdict: 'unexplained', trainError: 3.5, holdoutError: 4.1,
      parameters: [...added.parameters.slice(0, 2), estimate('gravity_tilt_x', 'rad', 0.01, 6e-5, effects[0]), estimate('joint2.damping', 'N m s/rad', 0.0173, 3e-4, effects[1])]},
  ], steps: [{...page.steps[0], title: '+ gravity_tilt@base + viscous_damping@joint2'}]};
}

// A spherical pendulum that swings on a cone; the second joint unmeasured.
export function sphericalPage() {
  const page = fitPage();
  const n = 801, t = Array.from({length: n}, (_, i) => i / kRate_hz);
  const quaternion = (lean, turn) => [Math.sin(lean / 2) * Math.cos(turn), Math.sin(lean / 2) * Math.sin(turn), 0, Math.cos(lean / 2)];
  const heading = ([x, y, z, w]) => [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)];
  const truth = t.map(s => quaternion(0.7, 3 * s)), predicted = t.map(s => quaternion(0.7 + 0.01 * (s % 2), 3 * s));
  const zero = series(t.map(() => 0)), none = series(t.map(() => NaN));
  const parts = (qs, f) => [0, 1, 2].map(k => series(qs.map(q => f(heading(q)[k], k))));
  const urdf = kPlanarUrdf.replaceAll('type="continuous"', 'type="spherical"').replaceAll('<axis xyz="0 1 0"/>', '');
  const second = t.map(s => quaternion(0.4, -2 * s));
  const prediction = {
    cuts: [0, 2, 4, 6, 8], efforts: null,
    channels: [{predicted: parts(predicted, v => v),
      residual: [0, 1, 2].map(k => series(t.map((_, i) => (heading(predicted[i])[k] - heading(truth[i])[k]) / kNoise)))}],
    q: [...[0, 1, 2, 3].map(k => series(column(predicted, k))), ...[0, 1, 2, 3].map(k => series(column(second, k)))],
    qd: Array.from({length: 6}, () => zero),
    measuredQ: [...[0, 1, 2, 3].map(k => series(column(truth, k))), none, none, none, none],
  };
  const run = {name: 'cone.csv', heldOut: false, t: series(t), efforts: [], channels: [{
    name: 'joint1', joint: 'joint1', kind: 'position', unit: '-', noise: kNoise,
    components: ['z_x', 'z_y', 'z_z'], measured: parts(truth, v => v)}]};
  return {
    ...page, model: 'pendulum2', runs: [run],
    mechanism: {urdf, joints: [0, 1].map(i => ({name: `joint${i + 1}`, type: 'spherical', unit: 'rad', effortUnit: 'N m', q: 4 * i, v: 3 * i}))},
    models: page.models.map(m => ({...m, predictions: [prediction],
      channels: [{name: 'joint1', unit: '-', rms: 0.005, normalized_rms: 5, noise: kNoise}],
      segments: [{trajectory: 'cone.csv', t_start: 2, t_end: 4, normalized_rms: 5.1}]})),
  };
}

// The page with a document inlined, as the C++ side does it.
export function freeze(html, page) {
  const json = JSON.stringify(page, (_, v) => typeof v === 'number' && !Number.isFinite(v) ? null : v).replaceAll('<', '\\u003c');
  const marker = '<script id="page-data" type="application/json">';
  if (html.split(marker).length !== 2) throw new Error('the page has no place for its data');
  return html.replace(marker, () => marker + json);
}

// Of what is only drawn; NaN is missing.
export function drawn(values) {
  const known = values.filter(Number.isFinite);
  const offset = Math.min(...known), step = (Math.max(...known) - offset) / 65534 || 1;
  const places = Uint16Array.from(values, v => Number.isFinite(v) ? Math.round((v - offset) / step) : 65535);
  return {u16: Buffer.from(places.buffer).toString('base64'), step, offset};
}

// The planar page of driven joints: the model as given leaves the friction of
// the second one, the other model hardly anything. Each has a filter of its own.
export function drivenPage() {
  const page = planarPage();
  const widths_s = [0.04, 0.03], cutOffs_hz = [3.313, 4.417];
  page.models.forEach((model, m) => {
    const efforts = run => {
      const n = Math.floor(7.6 / widths_s[m]), t = Array.from({length: n}, (_, i) => 0.2 + i * widths_s[m]);
      const curves = [0, 1].map(j => {
        const measured = t.map(s => (2 - j) * Math.sin((2 + j) * s + run) + 0.5 * Math.sin(7 * s));
        const rest = t.map(s => 0.01 * Math.sin(31 * s) + (j && !m ? 0.3 * Math.tanh(5 * Math.cos(3 * s + run)) : 0));
        if (j && !run) measured[30] = NaN;
        return {joint: `joint${j + 1}`, unit: 'N m', rest, measured, predicted: measured.map((v, i) => v - rest[i])};
      });
      return {t, curves};
    };
    const said = run => ({cutOff_hz: cutOffs_hz[m] + run, joints: efforts(run).curves.map(c => (
      {joint: c.joint, unit: c.unit, rms: rms([c.rest]), percent: 100 * rms([c.rest]) / rms([c.measured])}))});
    model.efforts = said(0);
    model.holdoutEfforts = said(1);
    model.predictions.forEach((p, run) => {
      const {t, curves} = efforts(run);
      p.efforts = {t: series(t), curves: curves.map(c => ({joint: c.joint, unit: c.unit, measured: drawn(c.measured), predicted: drawn(c.predicted)}))};
    });
  });
  return page;
}
