#include "sysid/estimation/levenberg_marquardt.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "glog/logging.h"
#include "models/dynamics.h"
#include "models/error.h"
#include "models/state.h"
#include "sysid/estimation/elimination.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/identifiability.h"
#include "sysid/estimation/initial_states.h"

namespace sysid {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Segments grow from the first length by this factor a stage.
constexpr double kFirstLength = 0.1;  // s
constexpr double kStageGrowth = 4.0;
// Longer ones save nothing, and fewer segments fall into wrong minima sooner:
// EMPS in one segment of 24.8 s ends at 90.7 kg, a minimum 4 % above that at
// 96.0 kg which segments of 0.8 s and of 3.2 s find.
constexpr double kLongestLength = 3.2;  // s
// Above this many times the noise a model misses something, and one trajectory
// through all of a chaotic run is not to be had (nor worth anything).
constexpr double kMissing = 2.0;

std::vector<RowMatrixXd> AllSampleStates(const ShootingProblem& problem,
                                         const ShootingPoint& point) {
  std::vector<RowMatrixXd> states(point.runs.size());
  for (size_t r = 0; r < point.runs.size(); ++r) {
    if (!SampleStates(problem, point, static_cast<int>(r), &states[r])) {
      states[r] = StatesFromData(problem, static_cast<int>(r));
    }
  }
  return states;
}

double MeanSegment(const ShootingProblem& problem, const ShootingPoint& point) {
  double duration = 0.0;
  int segments = 0;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const std::vector<double>& t = problem.runs()[r]->run.t;
    duration += t.back() - t.front();
    segments += point.runs[r].segments();
  }
  return duration / segments;
}

// Cuts the point anew, with states from its own trajectories.
void Recut(const ShootingProblem& problem, double length,
           ShootingPoint* point) {
  *point =
      CutPoint(problem, point->theta, AllSampleStates(problem, *point), length);
}

bool SameCut(const ShootingPoint& a, const ShootingPoint& b) {
  for (size_t r = 0; r < a.runs.size(); ++r) {
    if (a.runs[r].samples != b.runs[r].samples) return false;
  }
  return true;
}

// The longest length, doubling up to kLongestLength or the whole run, over
// which a change of the initial position grows less than kGrowth fold anywhere:
// chaos asks for short segments.
double ChooseSegment(const ShootingProblem& problem,
                     const ShootingPoint& point) {
  constexpr double kGrowth = 4.0;
  constexpr int kStarts = 12;  // of a run, evenly spread
  const Model& model = problem.model();
  const int nv = model.nv();
  const double longest = std::min(problem.LongestDuration(), kLongestLength);
  double best = kFirstLength;
  while (best < longest) {
    const double length = 2.0 * best;
    for (size_t r = 0; r < point.runs.size(); ++r) {
      const RunData& data = *problem.runs()[r];
      const ShootingPoint::Nodes& nodes = point.runs[r];
      const std::vector<double>& t = data.run.t;
      const int count = std::min(nodes.segments(), kStarts);
      for (int i = 0; i < count; ++i) {
        const int k = nodes.segments() * i / count;
        const int first = nodes.samples[k];
        const auto end =
            std::upper_bound(t.begin(), t.end(), t[first] + length);
        const int last = static_cast<int>(end - t.begin()) - 1;
        if (last <= first) continue;
        const SegmentRollout rollout(&model, &problem.map(), &data.measurements,
                                     first, last, problem.options().rollout);
        std::vector<double> errors(rollout.num_residuals());
        std::vector<double> x_end(model.state_size());
        RowMatrixXd J, J_end;
        if (!rollout.Linearize(nodes.states.row(k).data(), point.theta.data(),
                               false, errors.data(), x_end.data(), &J,
                               &J_end) ||
            !(J_end.topLeftCorner(nv, nv).operatorNorm() < kGrowth)) {
          return best;
        }
      }
    }
    best = length;
  }
  return std::min(best, longest);
}

// theta moved a little inside its bounds: what has no influence there either
// has none.
Eigen::VectorXd Nudged(const ShootingProblem& problem,
                       const Eigen::VectorXd& theta) {
  Eigen::VectorXd nudged = theta;
  for (size_t i = 0; i < problem.free().size(); ++i) {
    const FreeParameter& free = problem.free()[i];
    const double delta = problem.map().IsTransformed(i)
                             ? 0.01
                             : 0.01 * free.parameter.typical_scale;
    nudged[i] += nudged[i] + delta <= free.upper ? delta : -delta;
  }
  return nudged;
}

// Names of the parameters that change no residual, at theta or beside it.
std::vector<std::string> WithoutInfluence(const ShootingProblem& problem,
                                          const ShootingPoint& point) {
  const int n = problem.map().size();
  Eigen::VectorXd norms = Eigen::VectorXd::Zero(n);
  bool known = false;
  for (const bool nudge : {false, true}) {
    ShootingPoint at = point;
    if (nudge) at.theta = Nudged(problem, point.theta);
    ShootingStage::Options options;
    options.defect = kLooseDefect;
    const ShootingStage stage(problem, options, &at);
    std::vector<RunLinearization> runs;
    if (!stage.Linearize(&runs)) continue;
    known = true;
    for (const RunLinearization& run : runs) {
      for (const SegmentLinearization& segment : run.segments) {
        if (segment.J_theta.rows() == 0) continue;
        norms += segment.J_theta.colwise().squaredNorm().transpose();
      }
    }
  }
  std::vector<std::string> names;
  for (int i = 0; known && i < n; ++i) {
    const double scale = problem.free()[i].parameter.typical_scale;
    // A full change of its own size that moves all residuals together by less
    // than a millionth of the noise.
    if (!(std::sqrt(norms[i]) * scale > 1e-6)) {
      names.push_back(problem.free()[i].parameter.name);
    }
  }
  return names;
}

// Why the model cannot be rolled out at theta, else "".
std::string WhyImmobile(const ShootingProblem& problem,
                        const Eigen::VectorXd& theta) {
  const std::string link = problem.map().FirstImpossibleLink(theta.data());
  if (!link.empty()) {
    return "link '" + link +
           "' is no possible body at the start: check its "
           "mass and its moments of inertia";
  }
  MechanismParameters<double> values;
  problem.map().Apply<double>(theta.data(), &values);
  Model start = problem.model();
  start.SetNominal(values);
  return Join(SingularJoints(start), "; ");
}

// Halves the step until theta does not depend on it: until the change of the
// residuals that another halving makes moves theta, by the linearised problem,
// less than kStepBias standard errors. (ChooseStep sees one segment at a time;
// along a whole run its small errors add up, most of all those of dry friction,
// whose kinks the steps pass over.) A first-order step never gets there and is
// left as it is.
void RefineStep(ShootingProblem* problem, double defect, ShootingPoint* point) {
  constexpr double kStepBias = 0.2;
  constexpr int kMostHalvings = 5;
  RolloutOptions& rollout = problem->mutable_options()->rollout;
  if (Order(rollout.integrator) < 4) return;
  ShootingStage::Options options;
  options.defect = defect;
  const ShootingStage stage(*problem, options, point);
  RowMatrixXd J_prior;
  Eigen::VectorXd r_prior;
  stage.LinearizePriors(&J_prior, &r_prior);
  const double missed =
      std::max(1.0, EvaluateErrors(*problem, *point, 0.0).total.normalized_rms);
  const auto linearize = [&](std::vector<RunLinearization>* runs) {
    return ShootingStage(*problem, options, point).Linearize(runs);
  };
  std::vector<RunLinearization> coarse, fine;
  if (!linearize(&coarse)) return;
  for (int halving = 0; halving < kMostHalvings; ++halving) {
    const double step = rollout.step;
    rollout.step = 0.5 * step;
    if (!linearize(&fine)) {
      rollout.step = step;
      break;
    }
    std::vector<RunLinearization> change = fine;
    for (size_t r = 0; r < change.size(); ++r) {
      change[r].r_prior.setZero();
      for (size_t k = 0; k < change[r].segments.size(); ++k) {
        change[r].segments[k].r -= coarse[r].segments[k].r;
      }
    }
    const RowMatrixXd R =
        EliminateStates(change, J_prior, Eigen::VectorXd::Zero(r_prior.size()),
                        problem->options().threads);
    if (R.rightCols(1).norm() < kStepBias * missed) {
      rollout.step = step;
      break;
    }
    coarse = std::move(fine);
  }
}

Eigen::VectorXd ThetaScale(const ShootingProblem& problem,
                           const Eigen::VectorXd& theta) {
  Eigen::VectorXd scale(theta.size());
  for (int i = 0; i < theta.size(); ++i) {
    scale[i] = problem.map().IsTransformed(i)
                   ? 1.0
                   : std::max(std::abs(theta[i]),
                              problem.free()[i].parameter.typical_scale);
  }
  return scale;
}

bool AtBound(double value, double bound, double scale) {
  return std::isfinite(bound) && std::abs(value - bound) <= 1e-6 * scale;
}

// Which values are at one of their bounds.
std::vector<bool> HeldByBounds(const ShootingProblem& problem,
                               const Eigen::VectorXd& values) {
  std::vector<bool> held(values.size());
  for (int i = 0; i < values.size(); ++i) {
    const FreeParameter& free = problem.free()[i];
    const double scale =
        std::max(std::abs(values[i]), free.parameter.typical_scale);
    held[i] = AtBound(values[i], free.lower, scale) ||
              AtBound(values[i], free.upper, scale);
  }
  return held;
}

// What the data says of the parameters that no bound holds, as if the others
// were fixed where they are.
Identifiability AnalyseLoose(const RowMatrixXd& R, const Eigen::VectorXd& scale,
                             const std::vector<bool>& held) {
  const int n = static_cast<int>(R.cols());
  std::vector<int> loose;
  for (int i = 0; i < n; ++i) {
    if (!held[i]) loose.push_back(i);
  }
  const Identifiability part =
      AnalyseIdentifiability(R(Eigen::all, loose), scale(loose));
  Identifiability all;
  all.identifiable.assign(n, true);
  all.covariance.setZero(n, n);
  all.covariance(loose, loose) = part.covariance;
  for (size_t k = 0; k < loose.size(); ++k) {
    all.identifiable[loose[k]] = part.identifiable[k];
  }
  for (const std::vector<int>& group : part.groups) {
    all.groups.emplace_back();
    for (const int k : group) all.groups.back().push_back(loose[k]);
  }
  for (const int k : part.without_influence) {
    all.without_influence.push_back(loose[k]);
  }
  return all;
}

void FillEstimates(const ShootingProblem& problem, const ShootingPoint& point,
                   const RowMatrixXd& R, double inflation, Fit* fit) {
  const int n = problem.map().size();
  Eigen::VectorXd values(n);
  problem.map().ValuesOf<double>(point.theta.data(), values.data());
  const Eigen::VectorXd scale = ThetaScale(problem, point.theta);
  const std::vector<bool> at_bound = HeldByBounds(problem, values);
  // A bound on a transformed parameter is no bound of theta.
  std::vector<bool> held = at_bound;
  for (int i = 0; i < n; ++i) {
    if (problem.map().IsTransformed(i)) held[i] = false;
  }
  const Identifiability known = AnalyseLoose(R, scale, held);
  const Eigen::MatrixXd D = problem.map().ValueJacobian(point.theta);
  fit->covariance = D * known.covariance * D.transpose() * inflation;
  for (int i = 0; i < n; ++i) {
    const FreeParameter& free = problem.free()[i];
    ParameterEstimate estimate;
    estimate.name = free.parameter.name;
    estimate.unit = free.parameter.unit;
    estimate.initial = free.initial;
    estimate.value = values[i];
    estimate.lower = free.lower;
    estimate.upper = free.upper;
    estimate.identifiable = known.identifiable[i];
    estimate.at_bound = at_bound[i];
    const double sigma = std::sqrt(fit->covariance(i, i));
    const bool usable =
        estimate.identifiable && !held[i] && std::isfinite(sigma);
    estimate.std_error = usable ? sigma : kNaN;
    estimate.ci95[0] = usable ? values[i] - 1.959964 * sigma : kNaN;
    estimate.ci95[1] = usable ? values[i] + 1.959964 * sigma : kNaN;
    fit->parameters.push_back(estimate);
  }
  for (const std::vector<int>& group : known.groups) {
    std::vector<std::string> names;
    for (const int i : group) {
      names.push_back(problem.free()[i].parameter.name);
    }
    fit->not_identifiable.push_back(names);
  }
}

}  // namespace

int MinSegmentSamples(const ShootingProblem& problem) {
  const double per_sample = std::max(problem.DofPerSample(), 0.1);
  return std::max(5, static_cast<int>(std::ceil(
                         2.0 * problem.model().tangent_size() / per_sample)));
}

ShootingPoint CutPoint(const ShootingProblem& problem,
                       const Eigen::VectorXd& theta,
                       const std::vector<RowMatrixXd>& sample_states,
                       double length) {
  const int min_samples = MinSegmentSamples(problem);
  ShootingPoint point;
  point.theta = theta;
  for (size_t r = 0; r < problem.runs().size(); ++r) {
    ShootingPoint::Nodes nodes;
    nodes.samples = CutRun(problem.runs()[r]->run.t, length, min_samples);
    nodes.states.resize(nodes.segments(), sample_states[r].cols());
    for (int k = 0; k < nodes.segments(); ++k) {
      nodes.states.row(k) = sample_states[r].row(nodes.samples[k]);
    }
    point.runs.push_back(std::move(nodes));
  }
  return point;
}

ShootingPoint StatesOnly(const ShootingProblem& problem, double length,
                         double defect) {
  CHECK_EQ(problem.map().size(), 0);
  std::vector<RowMatrixXd> states;
  for (size_t r = 0; r < problem.runs().size(); ++r) {
    states.push_back(StatesFromData(problem, static_cast<int>(r)));
  }
  ShootingPoint point =
      CutPoint(problem, Eigen::VectorXd(0), states, kFirstLength);
  std::vector<HistoryEntry> history;
  ShootingStage::Options options;
  options.defect = kLooseDefect;
  options.max_iterations = 20;
  options.function_tolerance = 1e-4;
  ShootingStage(problem, options, &point).Solve("states", Now(), &history);
  ShootingPoint longer =
      CutPoint(problem, point.theta, AllSampleStates(problem, point), length);
  options.defect = defect;
  options.max_iterations = 100;
  options.function_tolerance = 1e-8;
  ShootingStage(problem, options, &longer).Solve("states", Now(), &history);
  return longer;
}

double ChooseStep(const ShootingProblem& problem, const ShootingPoint& point) {
  constexpr int kMost = 64;
  constexpr int kSegments = 40;  // of a run, evenly spread
  const double period = problem.MedianSamplePeriod();
  const int size = problem.model().state_size();
  const auto roll = [&](const RunData& data, const ShootingPoint::Nodes& nodes,
                        int k, double step, std::vector<double>* errors) {
    RolloutOptions options = problem.options().rollout;
    options.step = step;
    const SegmentRollout rollout(&problem.model(), &problem.map(),
                                 &data.measurements, nodes.samples[k],
                                 nodes.samples[k + 1], options);
    errors->resize(rollout.num_residuals());
    std::vector<double> x_end(size);
    if (!rollout(nodes.states.row(k).data(), point.theta.data(), errors->data(),
                 x_end.data())) {
      return false;
    }
    for (const SegmentRow& row : rollout.rows()) {
      for (int i = 0; i < row.size; ++i) {
        (*errors)[row.first + i] /= data.sigma[row.channel];
      }
    }
    return true;
  };
  int parts = 1;
  for (; parts < kMost; parts *= 2) {
    double worst = 0.0;
    for (size_t r = 0; r < point.runs.size() && worst <= kStepError; ++r) {
      const RunData& data = *problem.runs()[r];
      const ShootingPoint::Nodes& nodes = point.runs[r];
      const int count = std::min(nodes.segments(), kSegments);
      for (int i = 0; i < count && worst <= kStepError; ++i) {
        const int k = nodes.segments() * i / count;
        std::vector<double> coarse, fine;
        if (!roll(data, nodes, k, period / parts, &coarse) ||
            !roll(data, nodes, k, period / (2 * parts), &fine)) {
          worst = kInfinity;
          break;
        }
        double squares = 0.0;
        for (size_t j = 0; j < coarse.size(); ++j) {
          squares += (coarse[j] - fine[j]) * (coarse[j] - fine[j]);
        }
        if (coarse.empty()) continue;
        const double rms = std::sqrt(squares / coarse.size());
        worst = std::isfinite(rms) ? std::max(worst, rms) : kInfinity;
      }
    }
    if (worst <= kStepError) break;
  }
  return period / parts;
}

Fit FitLevenbergMarquardt(ShootingProblem* problem) {
  Fit fit(problem->model());
  const double start = Now();
  const EstimationOptions& options = problem->options();
  const bool choose_step = options.rollout.step <= 0;
  for (const auto& run : problem->runs()) fit.samples += run->run.size();
  fit.noise = problem->PooledNoise();

  std::vector<RowMatrixXd> states;
  for (size_t r = 0; r < problem->runs().size(); ++r) {
    states.push_back(StatesFromData(*problem, static_cast<int>(r)));
  }
  ShootingPoint point =
      CutPoint(*problem, problem->InitialTheta(), states, kFirstLength);
  if (choose_step) {
    problem->mutable_options()->rollout.step = ChooseStep(*problem, point);
  }

  StageSummary summary;
  fit.termination = WhyImmobile(*problem, point.theta);
  const bool mobile = fit.termination.empty();
  std::vector<std::string> idle;
  if (mobile) idle = WithoutInfluence(*problem, point);
  if (!mobile) {
    // Said already.
  } else if (!idle.empty()) {
    fit.termination = (idle.size() == 1 ? "parameter " : "parameters ") +
                      [&] {
                        std::string list;
                        for (const std::string& name : idle) {
                          list += (list.empty() ? "'" : ", '") + name + "'";
                        }
                        return list;
                      }() +
                      " without any influence on what was measured; fix " +
                      (idle.size() == 1 ? "it" : "them");
  } else {
    // Short segments, loosely joined.
    const auto stage = [&](const std::string& name, double defect,
                           double tolerance, int most,
                           double twist_hold = 0.0) {
      ShootingStage::Options stage_options;
      stage_options.far = twist_hold > 0.0;
      stage_options.twist_hold = std::max(1.0, twist_hold);
      stage_options.defect = defect;
      stage_options.function_tolerance = tolerance;
      stage_options.max_iterations =
          std::max(1, std::min(most, options.max_iterations - fit.iterations));
      ShootingStage shooting(*problem, stage_options, &point);
      const StageSummary done = shooting.Solve(name, start, &fit.history);
      fit.iterations += done.iterations;
      return done;
    };
    double last_length = options.segment;
    const ShootingPoint whole =
        CutPoint(*problem, point.theta, states, kInfinity);
    const bool single = SameCut(point, whole);
    if (single) {
      // No shorter segments to begin with: hold the spin instead.
      const double missed =
          EvaluateErrors(*problem, point, 0.0).total.normalized_rms;
      stage("first steps", kLooseDefect, 1e-2, 30, missed);
    } else {
      stage("short segments", kLooseDefect, 1e-3, 30);
    }
    const double regular = ChooseSegment(*problem, point);
    const bool chaotic = regular < kLongestLength * (1 - 1e-9) &&
                         regular < problem->LongestDuration() * (1 - 1e-9);
    if (last_length <= 0) last_length = regular;
    for (double length = kFirstLength * kStageGrowth;
         length * kStageGrowth < last_length; length *= kStageGrowth) {
      Recut(*problem, length, &point);
      stage("growing segments", kMiddleDefect, 1e-3, 10);
    }
    Recut(*problem, last_length, &point);
    if (choose_step) {
      problem->mutable_options()->rollout.step = ChooseStep(*problem, point);
    }
    if (!single) stage("long segments", kJoinedDefect, 1e-4, 1000);
    const RunErrors joined = EvaluateErrors(*problem, point, 0.0);
    const bool one_trajectory =
        !chaotic || joined.total.normalized_rms < kMissing;
    fit.defect = one_trajectory ? TightDefect(point) : kJoinedDefect;
    if (choose_step) RefineStep(problem, fit.defect, &point);
    summary = stage("one trajectory", fit.defect, 1e-7, 1000);
    fit.converged = summary.converged;
    fit.termination = summary.message;
  }
  fit.step_s = problem->options().rollout.step;
  fit.segment_s = MeanSegment(*problem, point);

  const int n = problem->map().size();
  RowMatrixXd R = RowMatrixXd::Zero(n, n + 1);
  {
    ShootingStage::Options stage_options;
    stage_options.defect = fit.defect;
    const ShootingStage final_stage(*problem, stage_options, &point);
    std::vector<RunLinearization> runs;
    RowMatrixXd J_prior;
    Eigen::VectorXd r_prior;
    final_stage.LinearizePriors(&J_prior, &r_prior);
    if (final_stage.Linearize(&runs)) {
      R = EliminateStates(runs, J_prior, r_prior, options.threads);
    } else {
      fit.converged = false;
    }
  }
  const double fitted = n + ObservedStateDof(*problem) * problem->runs().size();
  fit.train = EvaluateErrors(*problem, point, fitted);
  const double chi2 =
      fit.train.total.normalized_rms * fit.train.total.normalized_rms;
  const double inflation =
      std::max(1.0, chi2) * AutocorrelationTime(*problem, point);
  FillEstimates(*problem, point, R.leftCols(n), inflation, &fit);
  MechanismParameters<double> values;
  problem->map().Apply<double>(point.theta.data(), &values);
  fit.model.SetNominal(values);
  fit.horizon = EvaluateHorizon(*problem, point.theta);
  fit.open = EvaluateOpen(*problem, point);
  fit.point = point;
  fit.wall_time_s = Now() - start;
  return fit;
}

}  // namespace sysid
