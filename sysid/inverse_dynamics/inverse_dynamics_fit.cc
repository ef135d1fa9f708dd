#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "models/error.h"
#include "models/math/decompositions.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/clock.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/step_size.h"
#include "sysid/inverse_dynamics/base_parameters.h"
#include "sysid/inverse_dynamics/effort_comparison.h"
#include "sysid/inverse_dynamics/estimate.h"
#include "sysid/inverse_dynamics/filter_choice.h"
#include "sysid/inverse_dynamics/motion.h"
#include "sysid/inverse_dynamics/regression.h"
#include "sysid/inverse_dynamics/regression_equations.h"

namespace sysid {
namespace {

// Whether some change of theta multiplies all coordinates by one factor.
bool MovesScale(const CoordinatesAt& at) {
  constexpr double kRounding = 1e-6;
  return (at.D * LeastSquares(at.D, at.xi) - at.xi).norm() <
         kRounding * at.xi.norm();
}

void CheckCarried(const Model& model) {
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    if (effect.states().empty()) continue;
    throw InputError(
        "--solver inverse_dynamics",
        "does not carry " + effect.name() + ", which has an internal state",
        "leave it out, or use --solver lm");
  }
}

void CheckMeasured(const Model& model, const Run& run) {
  const std::vector<std::string> missing = UnmeasuredJoints(model, run);
  if (missing.empty()) return;
  throw InputError("--solver inverse_dynamics",
                   run.name + " does not measure the position of " +
                       Join(missing) + ", which the equations of motion need",
                   "--solver lm estimates joints that are not measured");
}

class InverseDynamicsFit {
 public:
  explicit InverseDynamicsFit(const ShootingProblem& problem)
      : problem_(problem),
        map_(problem.map()),
        coordinates_(problem.model(), map_.parameters()),
        undriven_(UndrivenJoints(problem)),
        gains_(EffortGains(problem.model(), undriven_, coordinates_.Names())) {
    for (const auto& data : problem.runs()) {
      runs_.push_back(&data->run);
      CheckMeasured(problem.model(), data->run);
    }
  }
  // The whole fit, and theta alone.
  Fit Estimate();
  std::optional<Eigen::VectorXd> Theta();
  // After Theta(); null where efforts are not measured, whose scale the
  // equations leave open.
  std::shared_ptr<const ThetaEquations> Equations() const;

 private:
  bool Search();  // false as Solve()
  // The same with nothing free: only the filter is to be chosen.
  bool Compare(const EquationFilter& first);
  void Filter(const EquationFilter& filter);
  // Whether equations are those of an acceleration, (11.10), or of a measured
  // effort: what the parameters enter as ratios.
  bool IsRelative() const {
    return !undriven_.empty() || std::any_of(gains_.begin(), gains_.end(),
                                             [](int g) { return g >= 0; });
  }
  // What the equations leave, without linearising: a vector a run, times x
  // joints; and its root mean square by joint.
  std::vector<Eigen::VectorXd> Residuals(const Eigen::VectorXd& theta) const;
  Eigen::VectorXd LeftAt(const Eigen::VectorXd& theta) const;
  // (11.7) of that, by the weights that the regression has. Lowered, it lowers
  // the likelihood too, whose s_v follow (a tangent lies above a logarithm).
  double CostAt(const Eigen::VectorXd& theta) const;
  // Cuts the step from `from` until it lowers the cost. Whether it was settled.
  bool Descend(const Eigen::VectorXd& from, RegressionEstimate* to) const;
  std::string Words(const Fit& fit) const;
  // Once more from theta, until nothing moves that the equations are not linear
  // in. False where no time of the runs has samples enough around it.
  bool Solve(Eigen::VectorXd theta);
  void SayParameters(Fit* fit);
  void SayPositions(Fit* fit) const;

  const ShootingProblem& problem_;
  const ParameterMap& map_;
  const EquationCoordinates coordinates_;
  const std::vector<int> undriven_;
  const std::vector<int> gains_;  // EffortGains
  std::vector<const Run*> runs_;
  EquationFilter filter_;
  std::vector<SampledMotion> sampled_;  // of the runs, by this filter
  std::optional<EquationRegression> regression_;
  Eigen::VectorXd xi0_;  // where it was linearised
  RegressionEstimate found_;
  int iterations_ = 0;
  bool only_ratios_ = false;  // no efforts were measured
  bool holds_scale_ = false;  // (11.11)
};

void InverseDynamicsFit::Filter(const EquationFilter& filter) {
  filter_ = filter;
  ThrowIfCancelled(problem_.options().stop);  // also where there are no runs
  sampled_ = SampleRuns(problem_, filter);
}

std::vector<Eigen::VectorXd> InverseDynamicsFit::Residuals(
    const Eigen::VectorXd& theta) const {
  MechanismParameters<double> values;
  map_.Apply<double>(theta.data(), &values);
  Eigen::VectorXd xi(coordinates_.size());
  coordinates_.Read<double>(values, xi.data());
  std::vector<Eigen::VectorXd> residuals;
  for (const SampledMotion& motion : sampled_) {
    EquationRows rows =
        EvaluateEquations(problem_.model(), motion, values, undriven_,
                          problem_.options().threads);
    Silence(problem_.options().no_efforts, &rows);
    residuals.push_back(rows.rows.col(0));
    Eigen::VectorXd& r = residuals.back();
    const int nv = problem_.model().nv();
    for (int i = 0; i < r.size(); ++i) {
      if (gains_[i % nv] >= 0) r[i] /= 1.0 + xi[gains_[i % nv]];
    }
  }
  return residuals;
}

Eigen::VectorXd InverseDynamicsFit::LeftAt(const Eigen::VectorXd& theta) const {
  const int nv = problem_.model().nv();
  Totals totals(nv + 1);  // squares, times
  for (const Eigen::VectorXd& of_run : Residuals(theta)) {
    const Eigen::Map<const RowMatrixXd> r(of_run.data(), of_run.size() / nv,
                                          nv);
    totals.Add(0, r.colwise().squaredNorm());
    totals.Add(nv, static_cast<double>(r.rows()));
  }
  const Eigen::VectorXd sums = totals.Over(problem_.processes());
  return (sums.head(nv) / sums[nv]).cwiseSqrt();
}

double InverseDynamicsFit::CostAt(const Eigen::VectorXd& theta) const {
  if (!map_.FirstImpossibleLink(theta.data()).empty()) return INFINITY;
  const double cost = regression_->HalfSquares(Residuals(theta)) +
                      CostOfBeliefs(problem_, coordinates_, theta);
  return std::isnan(cost) ? INFINITY : cost;
}

bool InverseDynamicsFit::Descend(const Eigen::VectorXd& from,
                                 RegressionEstimate* to) const {
  constexpr int kMost = 10;
  // Of the cost of one time, which is about 1/2 a joint.
  constexpr double kSettled = 1e-6;
  const double little = kSettled * regression_->times();
  const double before = CostAt(from);
  // By the equations as they were linearised.
  const RowMatrixXd triangle = regression_->Triangle();
  const auto z = triangle.col(coordinates_.size());
  const double expected =
      0.5 * z.squaredNorm() + CostOfBeliefs(problem_, coordinates_, from) -
      0.5 * (triangle.leftCols(coordinates_.size()) * (to->xi - xi0_) + z)
                .squaredNorm() -
      CostOfBeliefs(problem_, coordinates_, to->theta);
  Eigen::VectorXd step = to->theta - from;
  double after = CostAt(from + step);
  for (int i = 0; i < kMost && !(after < before); ++i) {
    step *= 0.5;
    after = CostAt(from + step);
  }
  if (after < before) {
    to->theta = from + step;
  } else {
    to->theta = from;
    to->converged = to->converged && expected < little;
  }
  MechanismParameters<double> values;
  map_.Apply<double>(to->theta.data(), &values);
  coordinates_.Read<double>(values, to->xi.data());
  return !(after < before - little);
}

bool InverseDynamicsFit::Solve(Eigen::VectorXd theta) {
  constexpr int kReweighed = 3;  // sizes settle to some per cent
  // A length that starts at a hundredth of itself doubles with each (11.10).
  constexpr int kMost = 20;
  // Of what is left: a rollout would not see more.
  constexpr double kLinear = 1e-3;
  bool settled = false;
  for (int i = 0; i < kMost && !settled; ++i) {
    MechanismParameters<double> values;
    map_.Apply<double>(theta.data(), &values);
    regression_ =
        RegressEquations(problem_, coordinates_, sampled_, values, undriven_);
    if (regression_->times() == 0) return false;
    xi0_.resize(coordinates_.size());
    coordinates_.Read<double>(values, xi0_.data());
    only_ratios_ = regression_->IsHomogeneous(xi0_);
    regression_->NormaliseByGain(gains_, xi0_);
    // By theta to first order. Coordinates that move one by one may meet the
    // equations of a free swing as no body does.
    const RowMatrixXd D =
        DifferentiateCoordinates(coordinates_, map_, theta.data()).D;
    // By what is left here the step lowers the cost.
    if (IsRelative()) regression_->Reweigh(Eigen::VectorXd::Zero(D.rows()));
    for (int k = 0; k < kReweighed && !IsRelative(); ++k) {
      const RowMatrixXd triangle = regression_->Triangle();
      RowMatrixXd by_theta(triangle.rows(), D.cols() + 1);
      by_theta << triangle.leftCols(D.rows()) * D, triangle.rightCols(1);
      regression_->Reweigh(D * SolveUnconstrained(by_theta));
    }
    found_ = EstimateByRegression(problem_, coordinates_,
                                  regression_->Triangle(), theta);
    iterations_ += found_.iterations;
    if (IsRelative()) {
      settled = Descend(theta, &found_);
    } else {
      const Eigen::VectorXd expected = regression_->Left(found_.xi - xi0_);
      const Eigen::VectorXd missed = LeftAt(found_.theta) - expected;
      settled = missed.norm() < kLinear * expected.norm();
    }
    theta = found_.theta;
  }
  found_.converged = found_.converged && settled;
  return true;
}

// Theta, and what the data tell of it.
void InverseDynamicsFit::SayParameters(Fit* fit) {
  MechanismParameters<double> values;
  map_.Apply<double>(found_.theta.data(), &values);
  fit->effort =
      CompareEffortsBy(problem_, [&](int run) {
        return EvaluateEquations(problem_.model(), sampled_[run], values, {},
                                 problem_.options().threads);
      }).errors;
  const std::vector<std::string> joints = VelocityNames(problem_.model());
  for (const int v : problem_.options().no_efforts) {
    std::erase_if(fit->effort, [&](const EffortError& error) {
      return error.joint == joints[v];
    });
  }
  if (map_.size() == 0) return;
  const Eigen::VectorXd d = found_.xi - xi0_;
  const CoordinatesAt at =
      DifferentiateCoordinates(coordinates_, map_, found_.theta.data());
  holds_scale_ = only_ratios_ && MovesScale(at);
  if (holds_scale_) {
    values.gravity = 0.0;
    regression_->HoldScale(
        RegressEquations(problem_, coordinates_, sampled_, values, {}), xi0_);
  }
  const RowMatrixXd R = regression_->Triangle();
  const RowMatrixXd E = regression_->ErrorRoot(R, d);
  static_cast<Estimates&>(*fit) = EstimatesByRank(
      problem_, found_.theta, R.leftCols(coordinates_.size()) * at.D, E);
  // A table of coordinates that theta cannot move one by one would mislead.
  if (RankOf(at.D) == coordinates_.size()) {
    fit->base = BaseParameters(coordinates_, R, E, found_.xi);
  }
}

// How well positions are predicted over short segments, from states as the
// filter gives them.
void InverseDynamicsFit::SayPositions(Fit* fit) const {
  const EstimationOptions& options = problem_.options();
  Solution point;
  point.theta = found_.theta;
  point.rollout = options.rollout;
  // One step a sample, which is no part of the estimate.
  if (!(point.rollout.step > 0.0)) {
    point.rollout.step = problem_.data().MedianSamplePeriod();
  }
  const double length = options.segment > 0.0 ? options.segment : kFirstLength;
  for (const Run* run : runs_) {
    Solution::Nodes nodes;
    nodes.samples = CutRun(run->t, length, MinSegmentSamples(problem_));
    nodes.states.resize(nodes.segments(), problem_.model().state_size());
    for (int k = 0; k < nodes.segments(); ++k) {
      nodes.states.row(k) =
          SmoothState(problem_.model(), *run, nodes.samples[k], filter_.motion);
    }
    point.runs.push_back(std::move(nodes));
  }
  fit->train = EvaluateErrors(problem_, point, map_.size());
  if (!std::isfinite(fit->train.total.rms) && !(options.rollout.step > 0.0)) {
    // A joint that dry friction makes stiff, say.
    point.rollout = ChooseRollout(problem_, point, options.step_error);
    fit->train = EvaluateErrors(problem_, point, map_.size());
  }
  fit->step_s = point.rollout.step;
  fit->segment_s = MeanSegment(problem_, point);
  fit->point = std::move(point);
}

std::string InverseDynamicsFit::Words(const Fit& fit) const {
  char cut_off[32];
  std::snprintf(cut_off, sizeof cut_off, "%.2g", CutOff(filter_.average));
  std::string words =
      std::string("equations of motion up to ") + cut_off +
      " Hz, where they still explain half of what moves the joints";
  if (!fit.base.empty()) {
    words += ": " + std::to_string(fit.base.size()) + " of " +
             std::to_string(coordinates_.size()) +
             " coefficients, or combinations of them, show";
  }
  if (holds_scale_) {
    words +=
        "; without efforts only their ratios do, and the scale is the URDF's";
  }
  return words + (found_.converged ? "" : "; the minimum was not reached");
}

bool InverseDynamicsFit::Compare(const EquationFilter& first) {
  MechanismParameters<double> values;
  map_.Apply<double>(found_.theta.data(), &values);
  for (const EquationFilter& filter :
       {ChooseFilter(problem_.model(), values, runs_, first,
                     problem_.options().threads),
        first}) {
    Filter(filter);
    for (const SampledMotion& sampled : sampled_) {
      if (EvaluateEquations(problem_.model(), sampled, values).times() > 0) {
        found_.converged = true;
        return true;
      }
    }
  }
  return false;
}

bool InverseDynamicsFit::Search() {
  const Processes& all = problem_.processes();
  const EquationFilter first = FirstFilter(runs_, all);
  if (map_.size() == 0) return Compare(first);
  Filter(first);
  if (!Solve(problem_.InitialTheta())) return false;
  MechanismParameters<double> values;
  map_.Apply<double>(found_.theta.data(), &values);
  Filter(ChooseFilter(problem_.model(), values, runs_, first,
                      problem_.options().threads, all));
  if (Solve(found_.theta)) return true;
  // A wider filter may leave nothing.
  Filter(first);
  return Solve(problem_.InitialTheta());
}

std::optional<Eigen::VectorXd> InverseDynamicsFit::Theta() {
  if (!Search() || !found_.theta.allFinite()) return std::nullopt;
  return found_.theta;
}

std::shared_ptr<const ThetaEquations> InverseDynamicsFit::Equations() const {
  if (only_ratios_) return nullptr;
  return std::make_shared<RegressionEquations>(problem_,
                                               regression_->Triangle(), xi0_);
}

Fit InverseDynamicsFit::Estimate() {
  Fit fit(problem_.model());
  const double start_s = Now(), start_cpu_s = CpuSeconds();
  fit.solver = "inverse_dynamics";
  fit.samples = problem_.data().samples();
  fit.noise = problem_.data().PooledNoise();
  if (!Search()) {
    throw InputError("--solver inverse_dynamics",
                     "the runs are too short to tell accelerations: none has "
                     "samples enough around a time",
                     "record for longer, or at a higher rate; --solver lm "
                     "needs no accelerations");
  }
  fit.converged = found_.converged;
  fit.iterations = iterations_;
  MechanismParameters<double> values;
  map_.Apply<double>(found_.theta.data(), &values);
  fit.model.SetNominal(values);
  SayParameters(&fit);
  SayPositions(&fit);
  fit.cut_off_hz = CutOff(filter_.average);
  fit.only_ratios = only_ratios_;
  fit.holds_scale = holds_scale_;
  fit.termination = Words(fit);
  // Of parameters that show in combinations alone none is identifiable.
  if (!fit.parameters.empty() && fit.covariance.isZero(0.0)) {
    fit.converged = false;
    fit.termination =
        "no free parameter has any influence on the equations of motion with "
        "what was measured; fix them";
  }
  fit.wall_time_s = Now() - start_s;
  fit.cpu_time_s = CpuSeconds() - start_cpu_s;
  return fit;
}

// Whether a value is at a bound that its user gave, who knows no more than that
// it is not beyond. (Friction may well be zero.)
bool IsAtGivenBound(const FreeParameter& free, double value) {
  FreeParameter given = free;
  if (free.lower <= free.parameter.lower) given.lower = -INFINITY;
  if (free.upper >= free.parameter.upper) given.upper = INFINITY;
  return HeldByBounds(given, value);
}

// Where inverse dynamics ends. A parameter that ends at a given bound is no
// estimate: the others once more, with such ones at their initial values.
// `equations`, where it is not null: those of all.
std::optional<Eigen::VectorXd> ThetaWithinBounds(
    const ShootingProblem& problem,
    std::shared_ptr<const ThetaEquations>* equations) {
  InverseDynamicsFit fit(problem);
  const std::optional<Eigen::VectorXd> theta = fit.Theta();
  if (!theta) return theta;
  if (equations != nullptr) *equations = fit.Equations();
  const Eigen::VectorXd initial = problem.InitialTheta();
  Eigen::VectorXd values(theta->size());
  problem.map().ValuesOf<double>(theta->data(), values.data());
  std::vector<FreeParameter> within;
  std::vector<int> places;
  for (int i = 0; i < values.size(); ++i) {
    const FreeParameter& free = problem.free()[i];
    if (IsAtGivenBound(free, values[i]) && (*theta)[i] != initial[i]) continue;
    within.push_back(free);
    places.push_back(i);
  }
  if (within.size() == problem.free().size()) return theta;
  Eigen::VectorXd best = initial;
  if (within.empty()) return best;
  Model model = problem.model();
  MechanismParameters<double> held;
  problem.map().Apply<double>(initial.data(), &held);
  model.SetNominal(held);
  const std::optional<Eigen::VectorXd> found = ThetaWithinBounds(
      ShootingProblem(model, within, problem.shared_data(), problem.options()),
      nullptr);
  if (!found) return std::nullopt;
  best(places) = *found;
  return best;
}

// (6.5), whose s_c is e_c, or that of the noise where e_c is less; -infinity
// where the dynamics fail.
double LogLikelihoodOfErrors(const ShootingProblem& problem,
                             const Solution& point) {
  double sum = 0.0;
  for (const ChannelError& channel :
       EvaluateErrors(problem, point, 0.0).channels) {
    const double e = channel.normalized_rms, s = std::max(1.0, e);
    if (!std::isfinite(e)) return -std::numeric_limits<double>::infinity();
    sum -= channel.dof * (std::log(s) + 0.5 * e * e / (s * s));
  }
  return sum;
}

}  // namespace

ShootingProblem StartByInverseDynamics(const ShootingProblem& problem) {
  if (problem.map().size() == 0 || problem.model().layout().nz() > 0) {
    return problem;
  }
  if (!MeasuresAllJoints(problem)) return problem;
  std::shared_ptr<const ThetaEquations> equations;
  const std::optional<Eigen::VectorXd> theta =
      ThetaWithinBounds(WithRowsInMemory(problem), &equations);
  if (!theta) return problem;
  const Solution nominal = ShortSegments(problem);
  Solution started = nominal;
  started.theta = *theta;
  // By more than as many parameters gain by fitting noise: the Bayesian
  // information criterion, for errors of a size of their own in each channel,
  // (6.5). What the motion does not show would otherwise be moved for nothing.
  const double gain = LogLikelihoodOfErrors(problem, started) -
                      LogLikelihoodOfErrors(problem, nominal);
  const double samples = problem.data().samples();
  const double limit = problem.map().size() * std::log(samples);
  if (!(2.0 * gain > limit)) return problem;
  return problem.StartingAt(*theta).WithEquations(equations);
}

Fit FitInverseDynamics(const ShootingProblem& problem) {
  CheckCarried(problem.model());
  return InverseDynamicsFit(problem).Estimate();
}

}  // namespace sysid
