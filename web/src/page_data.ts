// What the page shows: one document, inlined in report.html, or given by
// GET /api/page of sysid_studio. sysid/report/page_data.cc writes it. Numbers
// are SI and finite or null; `error`s and residuals are normalised (1 is the
// noise floor) unless a name says otherwise.

// Little-endian float32, base64; what is missing is NaN. To each value `offset`
// is to be added: for times that float32 cannot hold.
export interface Series {
  f32: string;
  offset?: number;
}

// Of what is only drawn: offset + step times a little-endian uint16, base64;
// 65535 is missing.
export interface DrawnSeries {
  u16: string;
  step: number;
  offset: number;
}

export interface PageData {
  schema: "sysid.page/1";
  program: string; // "sysid_fit", "sysid_diagnose", "sysid_studio"
  version: string;
  live: boolean; // whether there is a server to ask
  model: string; // "pendulum2_planar"
  command: string; // what made this, for the shell
  notices: string[];
  noise: number; // rad or m, of positions
  mechanism: MechanismData;
  runs: RunData[]; // fitted ones first, then held-out ones
  models: ModelData[]; // in the order in which they were made
  // Which of `models` is to be seen first, and which it is compared with.
  current: number;
  compared: number | null;
  steps: StepData[]; // the waterfall: what was added and removed
  // Where a search ended, and what became of that model over whole runs (the
  // last of `models`); null: there was none.
  conclusion: { sentence: string; good: boolean } | null;
  // The model in which a search ended, and what it was without each of its
  // effects, fitted again, over the same segments; null: it added none.
  leftOut: LeftOutData | null;
}

export interface LeftOutData {
  effects: string[]; // of that model
  with: CrossValidationData | null;
  without: { effect: string; crossValidation: CrossValidationData | null }[];
}

export interface MechanismData {
  urdf: string; // of the model as given, text; joints may be type="spherical"
  joints: JointData[]; // those that move, in the order of q
}

export interface JointData {
  name: string;
  type: "revolute" | "continuous" | "prismatic" | "spherical";
  unit: string; // of position: "rad" or "m"
  effortUnit: string; // "N m" or "N"
  q: number; // first place in q: 1 number, or the quaternion x, y, z, w
  v: number; // first place in v: 1 number, or 3 (child's axes)
}

export interface RunData {
  name: string; // "run.csv"
  heldOut: boolean;
  t: Series; // s
  channels: ChannelData[];
  efforts: { joint: string; components: string[]; unit: string; values: Series[] }[];
}

export interface ChannelData {
  name: string; // "joint1", as fit.json has it
  joint: string | null; // whose motion it tells; null: a frame's
  kind: "position" | "rotation" | "velocity" | "angular_velocity" | "frame_position" | "motor_position";
  unit: string; // of `measured` ("-" for the parts of a heading)
  noise: number; // standard deviation, SI
  components: string[]; // ["q"], heading: ["z_x","z_y","z_z"], ...
  measured: Series[]; // one for each component
}

// A fitted model: the model as given, and those after each step.
export interface ModelData {
  id: number;
  title: string; // "as given", "+ coulomb_friction@joint1"
  effects: string[]; // that it has beyond the model as given
  converged: boolean;
  termination: string;
  trainError: number | null;
  holdoutError: number | null;
  // As shares of the motion: 100 is perfect, 0 no better than the mean.
  trainFitPercent: number | null;
  holdoutFitPercent: number | null;
  verdict: "adequate" | "missing_effect" | "undecided" | "unexplained" | null; // null: not asked
  sentence: string; // the verdict in words, with the numbers
  doubts: string[];
  segment_s: number; // over which errors and predictions are
  joined: boolean; // to one trajectory a run; else each segment from its own initial state
  // What became of it when it was fitted once more, to whole runs; live: what
  // `files` are of. Null: it was not.
  wholeRuns: WholeRunsData | null;
  // One prediction over each whole run from one initial state; empty where it
  // was not made.
  open: OpenData[];
  crossValidation: CrossValidationData | null; // null: not asked
  // Where the data do not decide: the effects that were chosen, and those of
  // each other model of no more parameters that predicts as well. Empty else.
  rivals: { effects: string[]; separatedBy: string; sameForce: boolean; crossValidation: CrossValidationData | null; holdoutError: number | null }[];
  // Of each parameter of the effects that are proposed, or were added, its
  // values in parts of the data; and the effects that lower the error without
  // being constant. Empty where it was not asked.
  stability: StabilityData[];
  standIns: { effect: string; parameter: string; strata: StabilityData["strata"] }[];
  // Formulas for a force that no effect of the catalogue explains, best first.
  proposals: ProposalData[];
  // What a recording would show that decides between those, or why there is none;
  // and the command that simulates it, or "".
  nextExperiment: { words: string; command: string } | null;
  predictions: PredictionData[]; // one a run, as in PageData.runs
  // What the inverse dynamics leave of the efforts of all fitted, all held-out
  // runs; null: none were measured, or a joint's position was not.
  efforts: EffortErrorsData | null;
  holdoutEfforts: EffortErrorsData | null;
  // What the model misses beside the noise, as a random force: its standard
  // deviation, SI. Empty where the error is that of the noise.
  discrepancy: { joint: string; force_std: number; correlation_time_s: number }[];
  // Whether the errors are white noise; null: not asked.
  residuals: ResidualsData | null;
  channels: { name: string; unit: string; rms: number; normalized_rms: number; fit_percent: number | null; noise: number }[];
  segments: { trajectory: string; t_start: number; t_end: number; normalized_rms: number }[];
  // `noise_rms`: what noise alone would make of it, were the model true.
  horizon: { horizon_s: number; rms: number; noise_rms: number | null }[];
  parameters: ParameterData[];
  correlation: (number | null)[][]; // of `parameters` that are identifiable; their
  correlationNames: string[]; // names, in order
  notIdentifiable: string[][];
  // Levenberg-Marquardt's, Adam's ...: cost over iterations.
  histories: { solver: string; points: { iteration: number; cost: number; time_s: number }[] }[];
  candidates: CandidateData[]; // best first; empty where it was not asked
  force: ForceData[]; // unexplained generalised forces
  files: { name: string; type: string; text: string | null }[]; // to take away; live: GET /api/models/ID/NAME
  nextCommand: string; // "" where there is nothing to do
}

// Correlations over lags; 99 % of those of white noise are within +-band.
export interface CorrelogramData {
  lag_s: number[];
  value: (number | null)[];
  band: (number | null)[];
}

export interface ResidualsData {
  channels: (CorrelogramData & { channel: string })[]; // with themselves, lag_s later
  inputs: (CorrelogramData & { channel: string; input: string })[]; // with efforts, lag_s earlier
}

// By prediction of what the parameters were not fitted to, over the model's
// segments.
export interface CrossValidationData {
  error: number; // the geometric mean over the stretches
  stdError: number | null; // as it varies from stretch to stretch
  stretches: { trajectory: string; t_start: number; t_end: number; error: number | null }[];
}

// As diagnosis.json has it.
export interface StabilityData {
  effect: string; // "coulomb_friction@joint1"
  parameter: string; // "joint1.friction"
  unit: string;
  joint: string; // whose motion the data are split by
  strata: "time" | "speed" | "position" | "effort" | "amplitude" | "run";
  // Of runs `from` and `to` are their numbers, from 1.
  estimates: { from: number | null; to: number | null; value: number | null; std_error: number | null }[];
  spread: number | null; // as a share of the value
  least_spread: number | null; // of the force, at 95 %
  trend: "rises" | "falls" | "none"; // of its size
  constant: boolean;
}

export interface ProposalData {
  effects: string[]; // "custom@joint2: c1*q^2*qd", then those of the catalogue
  parameters: { name: string; unit: string; value: number | null; stdError: number | null }[];
  crossValidatedError: number | null; // × noise, of data that was left out
  holdoutError: number | null;
  segment_s: number; // over which these errors are
  command: string; // that adds it
}

export interface OpenData {
  trajectory: string;
  duration_s: number;
  held_out: boolean;
  channels: { name: string; unit: string; rms: number | null; fit_percent: number | null }[];
}

export interface WholeRunsData {
  sentence: string; // as ModelData.sentence
  good: boolean; // at the noise
  trainError: number | null;
  holdoutError: number | null;
  open: OpenData[]; // as ModelData.open
  parameters: { name: string; unit: string; value: number | null; ci95: [number | null, number | null] }[];
}

export interface PredictionData {
  cuts: number[]; // s: where segments begin, and the end
  // As RunData.channels: predicted, and the residual in units of the noise.
  channels: { predicted: Series[]; residual: Series[] }[];
  efforts: EffortCurvesData | null; // null: nothing to compare in this run
  // The states of the prediction and those nearest the measurement, nq and nv
  // each, for the 3D view and the phase portrait. `measured` has NaN where a
  // joint is not measured.
  q: DrawnSeries[];
  qd: DrawnSeries[];
  measuredQ: DrawnSeries[];
}

// By joints of one degree of freedom, and the axes of others: "shoulder.x".
export interface EffortErrorsData {
  cutOff_hz: number; // of the low-pass filter that efforts and equations pass
  // `rms` of what is left, in `unit`; `percent` of that of the measured.
  joints: { joint: string; unit: string; rms: number; percent: number }[];
}

// Behind that filter, one of its widths apart; missing where the motion was not
// measured around.
export interface EffortCurvesData {
  t: Series; // s
  curves: { joint: string; unit: string; measured: DrawnSeries; predicted: DrawnSeries }[];
}

export interface ParameterData {
  name: string;
  unit: string;
  initial: number | null;
  value: number | null;
  stdError: number | null;
  ci95: [number | null, number | null];
  lower: number | null; // null: none
  upper: number | null;
  atBound: boolean;
  identifiable: boolean;
  ofEffect: string | null; // "coulomb_friction@joint1"
}

export interface CandidateData {
  effect: string; // "coulomb_friction"
  target: string; // "joint1"
  law: string; // "-d qd"
  score: number;
  dof: number;
  pValue: number | null; // null: not tested
  predictedError: number | null; // null: none, for the reason that follows
  noPrediction: string; // "" else
  expected: { name: string; unit: string; value: number; stdError: number | null; detectable: number | null }[];
  // After a refit; null where it was not refitted.
  confirmed: {
    train: number;
    holdout: number | null;
    crossValidation: CrossValidationData | null;
    parameters: { name: string; unit: string; value: number }[];
    segment_s: number; // over which these errors are
    togetherWith: string[]; // that were added with it; `command` adds all
  } | null;
  accepted: boolean;
  refused: string; // why a refit was not accepted, "" else
  indistinguishableFrom: string[];
  separatedBy: string; // the motion that would tell them apart, "" where nothing is to tell
  // The force that the effect would add with the expected parameters, at the
  // knots of ModelData.force (same order); empty where it acts otherwise.
  force: Series[];
  command: string; // that adds it
}

export interface ForceData {
  joint: string;
  component: string; // "", or "x", "y", "z"
  unit: string;
  trajectory: string;
  t: Series;
  value: Series;
  std: Series;
  // At the same times, of the joint (and component): what to draw it against.
  position: Series; // "tilt" for a spherical joint
  velocity: Series;
  effort: Series; // empty where none was measured
}

export interface StepData {
  title: string; // "+ coulomb_friction@joint1", "- viscous_damping@joint1"
  model: number; // that it led to
  from: number | null; // that it began with; null: none that is here
  predicted: number | null;
  trainBefore: number | null;
  trainAfter: number | null;
  holdoutBefore: number | null;
  holdoutAfter: number | null;
  segment_s: number | null; // over which the errors before are
  crossValidationBefore: CrossValidationData | null; // over those segments
}

// ---- The server of sysid_studio. All answers are JSON; an error is
// {"error": "...", "hint": "..."} with status 4xx. Requests that change
// something are POST with a JSON body and Content-Type application/json.
//
// GET  /                     the page
// GET  /api/page             PageData
// GET  /api/models/ID/NAME   a file of a model (ModelData.files)
// GET  /api/events           server-sent events, each `data:` a StudioEvent;
//                            the first says what is so now
// POST /api/add    {"model": ID, "effect": "coulomb_friction@joint1"}
// POST /api/remove {"model": ID, "effect": "coulomb_friction@joint1"}
// POST /api/cancel {}
// add and remove answer 202 at once, or 409 while another fit runs; progress and
// the end come as events. A new model is appended to PageData.models; the model
// that it came of stays.
export type StudioEvent =
  | { type: "idle" } // nothing runs
  | { type: "progress"; title: string; doing: string; iteration: number; of: number; error: number | null; elapsed_s: number }
  | { type: "done"; model: number } // ask /api/page again
  | { type: "cancelled" }
  | { type: "failed"; error: string; hint: string };
