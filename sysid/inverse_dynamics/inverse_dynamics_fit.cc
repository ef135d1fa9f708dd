#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>


#include "models/error.h"
#include "models/state.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/clock.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/inverse_dynamics/base_parameters.h"
#include "sysid/inverse_dynamics/estimate.h"
#include "sysid/inverse_dynamics/filter_choice.h"
#include "sysid/inverse_dynamics/motion.h"
#include "sysid/inverse_dynamics/regression.h"

namespace sysid {
namespace {

// d xi / d theta, and xi, at theta.
struct CoordinatesAt {
  Eigen::VectorXd xi;
  RowMatrixXd D;
};

CoordinatesAt DifferentiateCoordinates(const EquationCoordinates& coordinates,
                                       const ParameterMap& map,
                                       const double* theta) {
  constexpr int kWidth = EquationCoordinates::kWidth;
  CoordinatesAt at;
  const int n = coordinates.size(), p = map.size();
  at.xi.resize(n);
  at.D.resize(n, p);
  std::vector<Jet24> seeded(theta, theta + p), xi(n);
  MechanismParameters<Jet24> values;
  for (int begin = 0; begin == 0 || begin < p; begin += kWidth) {
    const int count = std::min(kWidth, p - begin);
    for (int c = 0; c < count; ++c) {
      seeded[begin + c] = Jet24(theta[begin + c], c);
    }
    map.Apply<Jet24>(seeded.data(), &values);
    coordinates.Read<Jet24>(values, xi.data());
    for (int i = 0; i < n; ++i) {
      at.xi[i] = xi[i].a;
      for (int c = 0; c < count; ++c) at.D(i, begin + c) = xi[i].v[c];
    }
    for (int c = 0; c < count; ++c) {
      seeded[begin + c] = Jet24(theta[begin + c]);
    }
  }
  return at;
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
        coordinates_(problem.model(), map_.parameters()) {
    for (const auto& data : problem.runs()) {
      runs_.push_back(&data->run);
      CheckMeasured(problem.model(), data->run);
    }
  }
  Fit Estimate();

 private:
  EquationRegression Regress(const MechanismParameters<double>& values,
                             const EquationFilter& filter) const;
  // What is left by joint, without linearising.
  Eigen::VectorXd LeftAt(const Eigen::VectorXd& theta,
                         const EquationFilter& filter) const;
  std::string Words(const EquationFilter& filter, const Fit& fit) const;
  // Once more from theta, until nothing moves that the equations are not linear
  // in.
  void Solve(const EquationFilter& filter, Eigen::VectorXd theta);
  void SayParameters(Fit* fit) const;
  void SayPositions(const EquationFilter& filter, Fit* fit) const;

  const ShootingProblem& problem_;
  const ParameterMap& map_;
  const EquationCoordinates coordinates_;
  std::vector<const Run*> runs_;
  std::optional<EquationRegression> regression_;
  Eigen::VectorXd xi0_;  // where it was linearised
  RegressionEstimate found_;
  int iterations_ = 0;
  bool only_ratios_ = false;  // no efforts were measured
};

Eigen::VectorXd InverseDynamicsFit::LeftAt(const Eigen::VectorXd& theta,
                                           const EquationFilter& filter) const {
  MechanismParameters<double> values;
  map_.Apply<double>(theta.data(), &values);
  const Seeding<Jet8> seeding = [&](int, MechanismParameters<Jet8>* out) {
    values.CastTo(out);
  };
  std::vector<EquationRows> rows;
  for (const Run* run : runs_) {
    rows.push_back(MakeEquationRows<Jet8>(problem_.model(), *run,
                                          run->t.front(), run->t.back(), filter,
                                          0, seeding));
  }
  return EquationRegression(std::move(rows), RobustLoss::kNone, 1.0)
      .Left(Eigen::VectorXd());
}

EquationRegression InverseDynamicsFit::Regress(
    const MechanismParameters<double>& values,
    const EquationFilter& filter) const {
  const Seeding<Jet24> seeding = [&](int begin, MechanismParameters<Jet24>* s) {
    coordinates_.Seed(values, begin, s);
  };
  std::vector<EquationRows> rows;
  for (const Run* run : runs_) {
    rows.push_back(MakeEquationRows<Jet24>(
        problem_.model(), *run, run->t.front(), run->t.back(), filter,
        coordinates_.size(), seeding));
    ThrowIfCancelled(problem_.options().stop);
  }
  return EquationRegression(std::move(rows), problem_.options().loss,
                            problem_.options().loss_scale);
}

void InverseDynamicsFit::Solve(const EquationFilter& filter,
                               Eigen::VectorXd theta) {
  constexpr int kReweighed = 3;  // sizes settle to some per cent
  constexpr int kMost = 10;
  // Of what is left: a rollout would not see more.
  constexpr double kLinear = 1e-3;
  for (int i = 0; i < kMost; ++i) {
    MechanismParameters<double> values;
    map_.Apply<double>(theta.data(), &values);
    regression_ = Regress(values, filter);
    xi0_.resize(coordinates_.size());
    coordinates_.Read<double>(values, xi0_.data());
    only_ratios_ = regression_->IsHomogeneous(xi0_);
    if (only_ratios_) {
      // (11.10): the rows without gravity, p = R_p xi.
      values.gravity = 0.0;
      const RowMatrixXd triangle = Regress(values, filter).Triangle();
      const int n = coordinates_.size();
      regression_->Hold(triangle.col(n).transpose() * triangle.leftCols(n),
                        xi0_);
    }
    for (int k = 0; k < kReweighed; ++k) {
      regression_->Reweigh(SolveUnconstrained(regression_->Triangle()));
    }
    found_ = EstimateByRegression(problem_, coordinates_,
                                  regression_->Triangle(), theta);
    iterations_ += found_.iterations;
    theta = found_.theta;
    const Eigen::VectorXd expected = regression_->Left(found_.xi - xi0_);
    if ((LeftAt(theta, filter) - expected).norm() < kLinear * expected.norm()) {
      return;
    }
  }
}

// Theta, and what the data tell of it.
void InverseDynamicsFit::SayParameters(Fit* fit) const {
  const Eigen::VectorXd d = found_.xi - xi0_;
  const RowMatrixXd R = regression_->InformationTriangle(d);
  const CoordinatesAt at =
      DifferentiateCoordinates(coordinates_, map_, found_.theta.data());
  static_cast<Estimates&>(*fit) = EstimatesByRank(
      problem_, found_.theta, R.leftCols(coordinates_.size()) * at.D);
  fit->base = BaseParameters(coordinates_, R, found_.xi);
  const Eigen::VectorXd left = regression_->Left(d);
  const Eigen::VectorXd size = regression_->EffortSize();
  for (const Body& body : problem_.model().bodies()) {
    for (int k = 0; k < VelocitySize(body.type); ++k) {
      const int v = body.v_index + k;
      if (!(size[v] > 0.0)) continue;
      std::string name = problem_.model().mechanism().joints[body.joint].name;
      if (body.type == JointType::kSpherical) name += std::string(".") + "xyz"[k];
      fit->effort.push_back({name, left[v], 100.0 * left[v] / size[v]});
    }
  }
}

// The state at a time of a run: by SmoothMotion, or near the ends, where that
// has nothing to go by, on from the next time that it has.
Eigen::VectorXd StateAt(const Model& model, const Run& run, int sample,
                        double width) {
  const bool later = 2 * sample < run.size();
  int known = sample;
  MotionSample motion = SmoothMotion(model, run, run.t[known], width);
  while (!motion.known && (later ? known + 1 < run.size() : known > 0)) {
    known += later ? 1 : -1;
    motion = SmoothMotion(model, run, run.t[known], width);
  }
  if (!motion.known) return NeutralState(model);
  const double s = run.t[sample] - run.t[known];
  const StateLayout& at = model.layout();
  Eigen::VectorXd x(at.size()), dx(at.tangent_size());
  x << motion.q, motion.qd;
  dx << motion.qd * s + 0.5 * s * s * motion.qdd, motion.qdd * s;
  BoxPlus<double>(model, x.data(), dx.data(), x.data());
  return x;
}

// How well positions are predicted over short segments, from states as the
// filter gives them.
void InverseDynamicsFit::SayPositions(const EquationFilter& filter,
                                      Fit* fit) const {
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
      nodes.states.row(k) = StateAt(problem_.model(), *run, nodes.samples[k],
                                    filter.motion);
    }
    point.runs.push_back(std::move(nodes));
  }
  fit->train = EvaluateErrors(problem_, point, map_.size());
  fit->step_s = point.rollout.step;
  fit->segment_s = MeanSegment(problem_, point);
  fit->point = std::move(point);
}

std::string InverseDynamicsFit::Words(const EquationFilter& filter,
                                      const Fit& fit) const {
  char cut_off[32];
  std::snprintf(cut_off, sizeof cut_off, "%.2g", CutOff(filter.average));
  return std::string("equations of motion up to ") + cut_off +
         " Hz, where they still explain half of the efforts: " +
         std::to_string(fit.base.size()) + " of " +
         std::to_string(coordinates_.size()) +
         " coefficients, or combinations of them, show" +
         (only_ratios_ ? "; without efforts only their ratios do, and the scale "
                         "is the URDF's"
                       : "") +
         (found_.converged ? "" : "; the minimum was not reached");
}

Fit InverseDynamicsFit::Estimate() {
  Fit fit(problem_.model());
  const double start_s = Now(), start_cpu_s = CpuSeconds();
  fit.solver = "inverse_dynamics";
  fit.samples = problem_.data().samples();
  fit.noise = problem_.data().PooledNoise();
  const EquationFilter first = FirstFilter(runs_);
  Solve(first, problem_.InitialTheta());
  MechanismParameters<double> values;
  map_.Apply<double>(found_.theta.data(), &values);
  const EquationFilter filter =
      ChooseFilter(problem_.model(), values, runs_, first);
  Solve(filter, problem_.InitialTheta());
  fit.converged = found_.converged;
  fit.iterations = iterations_;
  map_.Apply<double>(found_.theta.data(), &values);
  fit.model.SetNominal(values);
  SayParameters(&fit);
  SayPositions(filter, &fit);
  fit.termination = Words(filter, fit);
  fit.wall_time_s = Now() - start_s;
  fit.cpu_time_s = CpuSeconds() - start_cpu_s;
  return fit;
}

}  // namespace

Fit FitInverseDynamics(const ShootingProblem& problem) {
  return InverseDynamicsFit(problem).Estimate();
}

}  // namespace sysid
