#include "sysid/session/next_experiment.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

#include "models/error.h"
#include "models/math/decompositions.h"
#include "sysid/diagnosis/longer_segments.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/linearization.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/io/cell.h"
#include "sysid/session/check_runs.h"
#include "sysid/simulation/simulate.h"

namespace sysid {
namespace {

constexpr size_t kMostRivals = 4;  // each pair is a linearisation a motion
constexpr double kDecides = 0.99;  // wrong once in a hundred
// Below, a recording says little more than a coin.
constexpr double kLeastProbability = 0.75;
// Samples of a motion: what a linearisation holds in memory.
constexpr double kMostSamples = 1e5;

// A motion that could be recorded, as sysid_simulate makes it.
struct Motion {
  double duration = 0.0;  // s
  double tilt = 0.0;      // largest angle of the start, rad
  bool is_driven = false;
  double amplitude = 1.0;            // of --excite
  double lowest = 0.1, highest = 2;  // its band, Hz
};

// A rival with what the recordings say of it.
struct Rival {
  std::string name;
  ShootingProblem problem;
  Fit fit;
  Eigen::MatrixXd L;       // of theta
  double misfit = 1.0;     // its error over segments, in times the noise
  double segment_s = 0.0;  // of those
  bool fits = false;       // at the noise
};

// Sigma = L L'. What the recordings leave open is as wide as it is large; what
// a bound holds stays.
Eigen::MatrixXd SquareRoot(const ShootingProblem& problem, const Fit& fit) {
  Eigen::MatrixXd sigma = fit.theta_covariance;
  const Eigen::VectorXd scale = ThetaScale(problem, fit.point.theta);
  for (size_t i = 0; i < fit.parameters.size(); ++i) {
    if (!fit.parameters[i].identifiable) sigma(i, i) += scale[i] * scale[i];
  }
  if (sigma.rows() == 0) return sigma;
  return RootOfCovariance(sigma);
}

// A rival of the diagnosis, fitted to whole runs where it follows them.
std::optional<Rival> OpenRival(const DiagnosisProblem& problem,
                               const RivalModel& from) {
  EstimationOptions quiet = problem.options;
  quiet.progress = nullptr;
  const EvaluatedModel& model = *from.model;
  const ShootingProblem all = WithAllRuns(problem, model).With(quiet);
  const std::optional<Fit> whole = FitWholeRuns(all, model);
  Rival rival{Join(from.effects, " and "),
              all,
              whole ? *whole : model.fit,
              {},
              std::max(1.0, model.train_error()),
              model.fit.segment_s,
              IsAtNoiseFloor(model)};
  if (!std::isfinite(rival.misfit)) return std::nullopt;
  rival.L = SquareRoot(rival.problem, rival.fit);
  return rival;
}

double LongestRun(const std::vector<Run>& runs) {
  double longest = 0.0;
  for (const Run& run : runs) {
    longest = std::max(longest, run.t.back() - run.t.front());
  }
  return longest;
}

// The widest half of a range of an angle; what sysid_simulate takes where none
// was measured.
double Amplitude(const std::vector<Run>& runs) {
  constexpr double kDefault = 0.6;
  constexpr double kLeast = 0.1;  // a joint that hardly moved shows nothing
  double widest = 0.0;
  for (const Run& run : runs) {
    for (const Channel& channel : run.channels) {
      if (channel.kind != ChannelKind::kPosition) continue;
      widest = std::max(widest, 0.5 * Range(channel));
    }
  }
  return widest > 0.0 ? std::clamp(widest, kLeast, M_PI) : kDefault;
}

double Rounded(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
  return std::round(value / unit) * unit;
}

// Short ones first. Efforts as fast as sysid_simulate has them, and slow: one
// to four periods in the recording; both within what it allows at that rate.
std::vector<Motion> MotionsLike(const std::vector<Run>& runs, double rate) {
  const double duration = LongestRun(runs), amplitude = Amplitude(runs);
  const bool is_driven =
      std::any_of(runs.begin(), runs.end(),
                  [](const Run& run) { return !run.effort.isZero(0.0); });
  std::vector<Motion> motions;
  for (const double longer : {1.0, 2.0, 4.0}) {
    if (longer * duration * rate > kMostSamples) continue;
    for (const double wider : {1.0, 2.0, 0.5}) {
      Motion motion;
      motion.duration = Rounded(longer * duration);
      motion.tilt = Rounded(std::min(wider * amplitude, M_PI));
      motion.is_driven = is_driven;
      if (is_driven) {
        // The start matters little: the drive moves the joints.
        motion.tilt = Rounded(std::min(amplitude, 0.6));
        motion.amplitude = wider;
        motion.highest = std::min(motion.highest, 0.25 * rate);
      }
      if (motion.lowest < motion.highest) motions.push_back(motion);
      if (!is_driven) continue;
      motion.lowest = Rounded(1.0 / motion.duration);
      if (4.0 * motion.lowest >= 0.5 * motion.highest) continue;  // not slow
      motion.highest = 4.0 * motion.lowest;
      motions.push_back(motion);
    }
  }
  return motions;
}

SimulationOptions OptionsOf(const Motion& motion, double rate, double noise) {
  SimulationOptions options;
  options.duration = motion.duration;
  options.rate = rate;
  options.noise = noise;
  if (motion.is_driven) {
    // As sysid_simulate has them.
    options.excitation = Excitation::kWithinLimits;
    options.excitation_level *= motion.amplitude;
    options.excursion = std::min(motion.amplitude, 1.0);
    options.lowest_frequency = motion.lowest;
    options.highest_frequency = motion.highest;
  }
  return options;
}

// A motion as one trajectory of the rival.
Solution PointOf(const Rival& rival, const Motion& motion, int samples) {
  Solution point = rival.fit.point;
  const Eigen::VectorXd x0 = RandomState(rival.fit.model, motion.tilt, 1);
  point.runs.assign(1, {{0, samples - 1}, x0.transpose()});
  return point;
}

// What a motion under efforts would measure by the sensors of the recordings,
// as a data set, without noise; null where it does not stay finite.
std::shared_ptr<const DataSet> Predict(const Rival& rival, const Motion& motion,
                                       const DataSet& recorded, Run run) {
  for (Channel& channel : run.channels) {
    // Of unit length, for orientations; never read.
    channel.values.setConstant(run.size(), channel.values.cols(), 0.5);
  }
  const auto as_data = [&] {
    return MakeDataSetLike(rival.fit.model, {run}, rival.problem.options(),
                           recorded);
  };
  const ShootingProblem problem = rival.problem.WithData(as_data());
  const Solution point = PointOf(rival, motion, run.size());
  RowMatrixXd states;
  if (!SampleStates(problem, point, 0, &states) || !states.allFinite()) {
    return nullptr;
  }
  const std::vector<RowMatrixXd> values =
      PredictChannels(problem, point, 0, states);
  for (size_t c = 0; c < values.size(); ++c) {
    if (!values[c].allFinite()) return nullptr;
    run.channels[c].values = values[c];
  }
  return as_data();
}

// (7.16) of data that another rival made; 0 where the rival's own motion does
// not stay finite.
double WhatIsLeft(const Rival& rival, double misfit,
                  std::shared_ptr<const DataSet> data) {
  const ShootingProblem problem = rival.problem.WithData(std::move(data));
  Solution point = CutPoint(problem, rival.fit.point.theta,
                            AllStatesFromData(problem), rival.segment_s);
  point.rollout = rival.fit.point.rollout;
  LinearizationOptions options;
  options.defect = std::numeric_limits<double>::infinity();
  std::vector<RunLinearization> runs;
  if (!Linearize(problem, point, options, &runs)) return 0.0;
  // Of a segment's triangle the rows below those of its state are free of it.
  const Eigen::Index n_x = problem.model().tangent_size();
  const Eigen::Index n_theta = problem.map().size();
  Eigen::Index n = 0;
  for (const SegmentLinearization& segment : runs[0].segments) {
    n += std::max<Eigen::Index>(0, segment.r.size() - n_x);
  }
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n + n_theta, n_theta);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n + n_theta);
  n = 0;
  for (const SegmentLinearization& segment : runs[0].segments) {
    const Eigen::Index rows = std::max<Eigen::Index>(0, segment.r.size() - n_x);
    A.middleRows(n, rows) = segment.J_theta.bottomRows(rows) * rival.L / misfit;
    b.segment(n, rows) = segment.r.tail(rows) / misfit;
    n += rows;
  }
  A.bottomRows(n_theta).setIdentity();
  if (!A.allFinite() || !b.allFinite()) return 0.0;
  if (n_theta == 0) return b.squaredNorm();
  const Eigen::VectorXd z = LeastSquares(A, -b);
  return (b + A * z).squaredNorm();
}

// That a motion decides rightly between two rivals, of each two, to first
// order; 0 where the motion cannot be made.
Eigen::MatrixXd Probabilities(const std::vector<Rival>& rivals,
                              const Motion& motion, const DataSet& recorded,
                              double rate) {
  const int n = static_cast<int>(rivals.size());
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(n, n);
  Run run;
  try {
    run = Simulate(rivals[0].fit.model,
                   RandomState(rivals[0].fit.model, motion.tilt, 1),
                   OptionsOf(motion, rate, recorded.PooledNoise()));
  } catch (const InputError&) {
    return none;  // not within the limits, or not finite
  }
  run.channels = recorded.runs()[0]->run.channels;
  Eigen::MatrixXd right = none;
  for (int i = 0; i < n; ++i) {
    const auto data = Predict(rivals[i], motion, recorded, run);
    if (data == nullptr) return none;
    for (int j = 0; j < n; ++j) {
      if (i == j) continue;
      const double misfit = std::max(rivals[i].misfit, rivals[j].misfit);
      const double left = WhatIsLeft(rivals[j], misfit, data);
      right(i, j) = 0.5 * std::erfc(-0.5 * std::sqrt(left) / M_SQRT2);
    }
  }
  return right.cwiseMin(right.transpose());
}

std::string Digits(double value) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.6g", value);
  return text;
}

// What makes the plain model of the file that of the first rival.
void AddModelFlags(const Catalogue& catalogue, const Session& session,
                   const Model& model, NextExperiment* experiment) {
  const auto add = [&](const std::string& name,
                       const std::vector<std::string>& parts) {
    if (!parts.empty()) experiment->flags.push_back({name, Join(parts, ",")});
  };
  std::vector<std::string> locks, effects, values;
  for (const NamedValue& lock : session.locked) {
    locks.push_back(lock.value ? lock.name + "=" + ShortestText(*lock.value)
                               : lock.name);
  }
  std::vector<NamedValue> held = session.locked;
  std::string file;
  std::vector<std::string> notices;
  Model plain =
      session.given != nullptr
          ? AdaptModel(*session.given, catalogue, &held, &notices,
                       session.columns)
          : OpenModel(session.model_file.empty() ? session.model_name
                                                 : session.model_file,
                      catalogue, &held, &file, &notices, session.columns);
  for (const std::string& name : model.effects().names()) {
    if (plain.effects().Contains(name)) continue;
    // A pair of joints would be two entries of the list.
    std::string entry = name;
    if (!entry.starts_with("custom@")) {
      std::replace(entry.begin(), entry.end(), ',', '+');
    }
    effects.push_back(entry);
  }
  // Lengths act first: they scale what the other parameters say.
  const auto differ = [&](const Parameter& p) {
    constexpr double kSame = 1e-9;
    const std::vector<Parameter> of_plain = AllParameters(plain);
    const auto at =
        std::find_if(of_plain.begin(), of_plain.end(),
                     [&](const Parameter& own) { return own.name == p.name; });
    return at == of_plain.end() ||
           !(std::abs(p.nominal - at->nominal) <= kSame * std::abs(p.nominal));
  };
  const auto set = [&](bool lengths) {
    std::vector<std::string> names;
    std::vector<double> numbers;
    for (const Parameter& p : AllParameters(model)) {
      if ((p.kind == ParameterKind::kLength) != lengths || !differ(p)) continue;
      values.push_back(p.name + "=" + Digits(p.nominal));
      names.push_back(p.name);
      numbers.push_back(p.nominal);
    }
    if (!lengths) return;
    SetParameters(FindParameters(plain, names, "lengths"), numbers, &plain);
  };
  set(true);
  set(false);
  add("lock", locks);
  add("add", effects);
  add("set", values);
}

void AddMotionFlags(const Motion& motion, double rate, double noise,
                    NextExperiment* experiment) {
  auto& flags = experiment->flags;
  flags.push_back({"tilt", Digits(motion.tilt)});
  if (motion.is_driven) {
    flags.push_back({"excite", "multisine"});
    flags.push_back({"amplitude", Digits(motion.amplitude)});
    flags.push_back(
        {"band", Digits(motion.lowest) + "," + Digits(motion.highest)});
  }
  flags.push_back({"duration", Digits(motion.duration)});
  flags.push_back({"rate", Digits(rate)});
  flags.push_back({"noise", Digits(noise)});
  // Not a name that a recording would have.
  flags.push_back({"out_csv", "planned_motion.csv"});
}

}  // namespace

std::optional<NextExperiment> ChooseExperiment(const Catalogue& catalogue,
                                               const Session& session,
                                               const DiagnosisProblem& problem,
                                               const Diagnosis& diagnosis) {
  if (diagnosis.verdict != Verdict::kUndecided || diagnosis.rivals.size() < 2 ||
      diagnosis.by_equations || session.runs.empty()) {
    return std::nullopt;
  }
  if (problem.options.progress) {
    problem.options.progress(
        {"which recording would decide", 0, 0, diagnosis.last().train_error()});
  }
  NextExperiment best;
  const auto none = [&](const std::string& why) {
    best.why_none = why;
    return best;
  };
  const std::string reads_inputs =
      "a model that reads inputs, whose next values nobody knows, is not "
      "simulated";
  const EffectSet& own = problem.model.effects();
  for (int i = 0; i < own.size(); ++i) {
    if (!own.effect(i).inputs().empty()) return none(reads_inputs);
  }
  std::vector<Rival> rivals;
  for (const RivalModel& from : diagnosis.rivals) {
    if (rivals.size() == kMostRivals) break;
    // No motion tells another name of the same force apart.
    if (from.same_force && !rivals.empty()) continue;
    for (const auto& effect : from.model->added) {
      if (!effect->inputs().empty()) return none(reads_inputs);
    }
    std::optional<Rival> rival = OpenRival(problem, from);
    if (rival) {
      rivals.push_back(std::move(*rival));
    } else if (rivals.empty()) {
      break;  // the command is of the first
    }
  }
  best.one_fits = std::any_of(rivals.begin(), rivals.end(),
                              [](const Rival& rival) { return rival.fits; });
  if (rivals.size() < 2) return none("the rivals could not be fitted again");
  const double rate = 1.0 / problem.train->MedianSamplePeriod();
  const double noise = problem.train->PooledNoise();
  const std::vector<Motion> motions = MotionsLike(session.runs, rate);
  std::vector<Eigen::MatrixXd> right;  // of each motion, pair by pair
  const int n = static_cast<int>(rivals.size());
  Eigen::MatrixXd most = Eigen::MatrixXd::Identity(n, n);
  for (const Motion& motion : motions) {
    ThrowIfCancelled(problem.options.stop);
    right.push_back(Probabilities(rivals, motion, *problem.train, rate));
    right.back().diagonal().setOnes();
    most = most.cwiseMax(right.back());
    if (right.back().minCoeff() > kDecides) break;
  }
  // Two that no motion tells apart do not choose it.
  const Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> told =
      most.array() >= kLeastProbability;
  const std::string nothing_tells =
      "no motion like the recorded ones, longer or wider tells the rivals "
      "apart";
  if (told.count() == n) return none(nothing_tells);  // each from itself
  std::vector<bool> grouped(n, false);
  for (int i = 0; i < n; ++i) {
    if (grouped[i]) continue;
    std::vector<std::string> group{rivals[i].name};
    for (int j = i + 1; j < n; ++j) {
      if (told(i, j) || grouped[j]) continue;
      grouped[j] = true;
      group.push_back(rivals[j].name);
    }
    if (group.size() > 1) best.alike.push_back(group);
  }
  size_t chosen = 0;
  for (size_t m = 0; m < right.size() && best.probability <= kDecides; ++m) {
    const double least = told.select(right[m].array(), 1.0).minCoeff();
    if (least <= best.probability) continue;
    best.probability = least;
    chosen = m;
  }
  if (best.probability < kLeastProbability) return none(nothing_tells);
  AddModelFlags(catalogue, session, rivals[0].fit.model, &best);
  AddMotionFlags(motions[chosen], rate, noise, &best);
  return best;
}

}  // namespace sysid
