#include "sysid/estimation/step_size.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "models/dynamics.h"
#include "models/state.h"
#include "models/workspace.h"
#include "sysid/estimation/elimination.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/linearization.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/state_weights.h"

namespace sysid {
namespace {

// The longest h r of a step that follows a decay exp(-r t) and stays stable
// (2.78 of Runge and Kutta's, 2 of Euler's), less a tenth.
double StableTime(Integrator integrator) {
  return integrator == Integrator::kRungeKutta4 ? 2.5 : 1.8;
}

// The fastest rate, 1/s, at which the effects brake a joint: of the change of
// its acceleration with its own speed, where the segments start,
//
//   r = max_i -(qdd_i(qd + v e_i) - qdd_i(qd - v e_i)) / (2 v),
//
// less that of the mechanism without effects. v is the largest speed of the
// joint: a dry friction changes by no more than twice its size.
double DampingRate(const ShootingProblem& problem, const Solution& point) {
  const Model& model = problem.model();
  if (model.effects().parameters().empty()) return 0.0;
  MechanismParameters<double> values;
  problem.map().Apply<double>(point.theta.data(), &values);
  Workspace<double> with(model), without(model);
  with.SetParameters(values);
  for (size_t i = 0; i < values.effects.size(); ++i) {
    values.effects[i] = model.effects().parameters()[i].null_value;
  }
  without.SetParameters(values);
  const StateLayout& at = model.layout();
  std::vector<double> speed(at.nv(), 0.0);
  for (const Solution::Nodes& nodes : point.runs) {
    for (const Body& body : model.movers()) {
      const auto qd = nodes.states.middleCols(at.qd(body), VelocitySize(body));
      const double fastest = qd.size() > 0 ? qd.cwiseAbs().maxCoeff() : 0.0;
      for (int i = 0; i < VelocitySize(body); ++i) {
        double& v = speed[body.v_index + i];
        v = std::max(v, fastest);
      }
    }
  }
  problem.processes().Max(&speed);
  const std::vector<double> held(model.held_size(), 0.0);
  std::vector<double> qdd(at.nv());
  // Of one workspace; 0 where its dynamics fail.
  const auto braked = [&](Workspace<double>* ws, const std::vector<double>& x,
                          int i) {
    double change = 0.0;
    for (const double sign : {1.0, -1.0}) {
      std::vector<double> moved = x;
      moved[at.qd() + i] += sign * speed[i];
      if (at.nz() > 0) ws->z = moved.data() + at.z();
      if (!ForwardDynamics<double>(ws, moved.data() + at.q(),
                                   moved.data() + at.qd(), held.data(),
                                   qdd.data())) {
        return 0.0;
      }
      change += sign * qdd[i];
    }
    return -change / (2.0 * speed[i]);
  };
  double rate = 0.0;
  for (const Solution::Nodes& nodes : point.runs) {
    for (int k = 0; k < nodes.segments(); ++k) {
      const auto row = nodes.states.row(k);
      const std::vector<double> x(row.data(), row.data() + row.size());
      for (int i = 0; i < at.nv(); ++i) {
        if (!(speed[i] > 0) || !std::isfinite(speed[i])) continue;
        rate = std::max(rate, braked(&with, x, i) - braked(&without, x, i));
      }
    }
  }
  return MaxOver(problem.processes(), rate);
}

// The longest step that is accurate enough: NeededStep without what stability
// needs. A period takes 64 at most: a smoothed dry friction that stops a spin
// of hardly any inertia may chatter, which no sensor sees.
double AccurateStep(const ShootingProblem& problem, const Solution& point,
                    double step_error) {
  constexpr int kMostParts = 64;
  constexpr int kSegments = 40;  // of a run, evenly spread
  const double period = problem.data().MedianSamplePeriod();
  const int size = problem.model().state_size();
  const std::vector<double> state_sigma = DefectSigma(problem);
  // The whitened errors of a segment, and the state at its end.
  const auto roll = [&](const RunData& data, const Solution::Nodes& nodes,
                        int k, double step, std::vector<double>* errors,
                        std::vector<double>* x_end) {
    RolloutOptions options = point.rollout;
    options.step = step;
    const SegmentRollout rollout(&problem.model(), &problem.map(),
                                 &data.measurements, nodes.samples[k],
                                 nodes.samples[k + 1], options);
    errors->resize(rollout.num_residuals());
    x_end->resize(size);
    if (!rollout(nodes.states.row(k).data(), point.theta.data(), errors->data(),
                 x_end->data())) {
      return false;
    }
    for (const SegmentRow& row : rollout.rows()) {
      for (int i = 0; i < row.size; ++i) {
        (*errors)[row.first + i] /= data.sigma[row.channel];
      }
    }
    return true;
  };
  std::vector<SegmentPlace> some;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const int segments = point.runs[r].segments();
    const int count = std::min(segments, kSegments);
    for (int i = 0; i < count; ++i) {
      some.push_back({static_cast<int>(r), segments * i / count});
    }
  }
  int parts = 1;
  // Whether half the step changes a segment by no more than is allowed.
  const auto fine_enough = [&](int i) {
    const auto [r, k] = some[i];
    const RunData& data = *problem.runs()[r];
    const Solution::Nodes& nodes = point.runs[r];
    std::vector<double> coarse, fine, coarse_end, fine_end;
    if (!roll(data, nodes, k, period / parts, &coarse, &coarse_end) ||
        !roll(data, nodes, k, period / (2 * parts), &fine, &fine_end)) {
      return false;
    }
    double squares = 0.0;
    for (size_t j = 0; j < coarse.size(); ++j) {
      squares += (coarse[j] - fine[j]) * (coarse[j] - fine[j]);
    }
    if (coarse.empty()) return true;
    const double errors = std::sqrt(squares / coarse.size());
    // What no sensor sees goes on in the next segment: a spin that the step
    // does not follow.
    std::vector<double> end(state_sigma.size());
    BoxMinus<double>(problem.model(), coarse_end.data(), fine_end.data(),
                     end.data());
    squares = 0.0;
    for (size_t j = 0; j < end.size(); ++j) {
      squares += std::pow(end[j] / state_sigma[j], 2);
    }
    const double ends = std::sqrt(squares / end.size());
    return errors <= step_error && ends <= step_error;
  };
  const auto all_fine_enough = [&] {
    return AllTrue(problem.processes(),
                   ParallelFor(static_cast<int>(some.size()),
                               problem.options().threads, fine_enough));
  };
  while (parts < kMostParts && !all_fine_enough()) parts *= 2;
  return period / parts;
}

// The longest step that stays stable under DampingRate: of Rosenbrock's, which
// takes the damping implicitly, any.
double StableStep(const ShootingProblem& problem, const Solution& point) {
  const Integrator integrator = point.rollout.integrator;
  if (integrator == Integrator::kRosenbrock2) {
    return std::numeric_limits<double>::infinity();
  }
  return StableTime(integrator) / DampingRate(problem, point);
}

// The step of ChooseRollout with the point's integrator.
double NeededStep(const ShootingProblem& problem, const Solution& point,
                  double step_error) {
  constexpr double kShortest = 1.0 / 4096;  // of a period: a guard, no choice
  const double period = problem.data().MedianSamplePeriod();
  const double stable = StableStep(problem, point);
  double step = AccurateStep(problem, point, step_error);
  while (step > stable && step > kShortest * period) step *= 0.5;
  return std::max(step, problem.options().shortest_step);
}

// The point with the effects' parameters doubled and at least of their typical
// size; none where no parameter of an effect is free.
std::optional<Solution> Grown(const ShootingProblem& problem,
                              const Solution& point) {
  Solution ahead = point;
  bool grows = false;
  for (size_t i = 0; i < problem.free().size(); ++i) {
    const FreeParameter& free = problem.free()[i];
    if (free.parameter.kind != ParameterKind::kEffect) continue;
    grows = true;
    double& value = ahead.theta[i];
    const double size =
        std::max(2.0 * std::abs(value), free.parameter.typical_scale);
    value = std::clamp(value < 0 ? -size : size, free.lower, free.upper);
  }
  if (!grows) return std::nullopt;
  return ahead;
}

// The step of ChooseRolloutAhead with the point's integrator.
double NeededStepAhead(const ShootingProblem& problem, const Solution& point) {
  const double needed =
      NeededStep(problem, point, problem.options().step_error);
  const std::optional<Solution> grown = Grown(problem, point);
  if (!grown) return needed;
  return std::max(
      problem.options().shortest_step,
      std::min(needed, AccurateStep(problem, *grown, kStableError)));
}

// Whether Runge and Kutta's steps are shorter than samples only to stay stable,
// at one of these points.
bool IsStiff(const ShootingProblem& problem,
             const std::vector<const Solution*>& points) {
  const Model& model = problem.model();
  if (!model.followers().empty()) return false;
  if (!Workspace<double>(model).dry_bodies.empty()) return false;
  const double period = problem.data().MedianSamplePeriod();
  return std::any_of(points.begin(), points.end(), [&](const Solution* point) {
    return StableStep(problem, *point) < period;
  });
}

// The cheaper of the integrators, each with the step that it needs; the point
// has that of the options.
template <typename Needed>
RolloutOptions Cheaper(bool stiff, Solution point, const Needed& needed) {
  // A step of Rosenbrock's has two evaluations, one of Runge and Kutta's four.
  constexpr double kCost = 0.5;
  point.rollout.step = needed(point);
  if (!stiff) return point.rollout;
  Solution other = point;
  other.rollout.integrator = Integrator::kRosenbrock2;
  other.rollout.step = needed(other);
  return other.rollout.step > kCost * point.rollout.step ? other.rollout
                                                         : point.rollout;
}

// The point with the integrator of the options.
Solution AsAsked(const ShootingProblem& problem, const Solution& point) {
  Solution asked = point;
  asked.rollout.integrator = problem.options().rollout.integrator;
  return asked;
}

// Whether another may be chosen in its place.
bool MayChange(const ShootingProblem& problem) {
  const RolloutOptions& options = problem.options().rollout;
  return options.may_change && options.integrator == Integrator::kRungeKutta4;
}

}  // namespace

RolloutOptions ChooseRollout(const ShootingProblem& problem,
                             const Solution& point, double step_error) {
  const Solution asked = AsAsked(problem, point);
  return Cheaper(MayChange(problem) && IsStiff(problem, {&asked}), asked,
                 [&](const Solution& with) {
                   return NeededStep(problem, with, step_error);
                 });
}

RolloutOptions ChooseRolloutAhead(const ShootingProblem& problem,
                                  const Solution& point) {
  const Solution asked = AsAsked(problem, point);
  std::vector<const Solution*> points = {&asked};
  const std::optional<Solution> grown = Grown(problem, asked);
  if (grown) points.push_back(&*grown);
  return Cheaper(
      MayChange(problem) && IsStiff(problem, points), asked,
      [&](const Solution& with) { return NeededStepAhead(problem, with); });
}

bool AdaptRollout(const ShootingProblem& problem, Solution* solution) {
  constexpr double kTooLong = 0.75;  // steps are halved: between 1/2 and 1
  const double step = solution->rollout.step;
  if (step > 0.0 && NeededStepAhead(problem, *solution) >= kTooLong * step) {
    return false;
  }
  solution->rollout = ChooseRolloutAhead(problem, *solution);
  return true;
}

double RefineStep(const ShootingProblem& problem, double defect,
                  const Solution& point) {
  constexpr double kStepBias = 0.2;
  constexpr int kMostHalvings = 5;
  double step = point.rollout.step;
  if (Order(point.rollout.integrator) < 2) return step;
  RowMatrixXd J_prior;
  Eigen::VectorXd r_prior;
  LinearizePriors(problem, point.theta, &J_prior, &r_prior);
  r_prior.setZero();
  const double missed =
      std::max(1.0, EvaluateErrors(problem, point, 0.0).total.normalized_rms);
  SegmentResiduals residuals;
  double before = 0.0;  // the change by the halving before this one
  for (int halving = 0; halving < kMostHalvings; ++halving) {
    RolloutOptions fine = point.rollout;
    fine.step = 0.5 * step;
    // Linearised where it starts; finer rollouts only say by how much the
    // residuals are off.
    std::vector<RunLinearization> runs;
    if (!LinearizeChange(problem, point, {.defect = defect}, fine, &residuals,
                         &runs)) {
      break;
    }
    const RowMatrixXd R = EliminateStates(
        runs, J_prior, r_prior, problem.options().threads, problem.processes());
    const double change = R.rightCols(1).norm();
    if (change < kStepBias * missed) break;
    step = fine.step;
    // The next halving falls behind this one as this one does behind the one
    // before: by 2^p, where the motion is as smooth as a method of order p
    // takes it for. Twice the work of all before need not say so.
    if (halving > 0 && change * change < kStepBias * missed * before) break;
    before = change;
  }
  return step;
}

}  // namespace sysid
