#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/QR>

#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/clock.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/linearization.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/step_size.h"
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

class InverseDynamicsFit {
 public:
  explicit InverseDynamicsFit(const ShootingProblem& problem)
      : problem_(problem),
        map_(problem.map()),
        coordinates_(problem.model(), map_.parameters()) {
    for (const auto& data : problem.runs()) runs_.push_back(&data->run);
  }
  Fit Estimate();

 private:
  EquationRegression Regress(const Eigen::VectorXd& theta,
                             const EquationFilter& filter) const;
  // What is left by joint, without linearising.
  Eigen::VectorXd LeftAt(const Eigen::VectorXd& theta,
                         const EquationFilter& filter) const;
  // Once more from theta, until nothing moves that the equations are not linear
  // in.
  void Solve(const EquationFilter& filter, Eigen::VectorXd theta);
  void SayParameters(Fit* fit) const;
  void SayPositions(Fit* fit) const;

  const ShootingProblem& problem_;
  const ParameterMap& map_;
  const EquationCoordinates coordinates_;
  std::vector<const Run*> runs_;
  std::optional<EquationRegression> regression_;
  Eigen::VectorXd xi0_;  // where it was linearised
  RegressionEstimate found_;
  int iterations_ = 0;
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
    const Eigen::VectorXd& theta, const EquationFilter& filter) const {
  MechanismParameters<double> values;
  map_.Apply<double>(theta.data(), &values);
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
    regression_ = Regress(theta, filter);
    MechanismParameters<double> values;
    map_.Apply<double>(theta.data(), &values);
    xi0_.resize(coordinates_.size());
    coordinates_.Read<double>(values, xi0_.data());
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
  RowMatrixXd priors;
  Eigen::VectorXd unused;
  LinearizePriors(problem_, found_.theta, &priors, &unused);
  RowMatrixXd rows =
      RowMatrixXd::Zero(R.rows() + priors.rows() + map_.size(), map_.size());
  rows.topRows(R.rows()) = R * at.D;
  rows.middleRows(R.rows(), priors.rows()) = priors;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(rows);
  static_cast<Estimates&>(*fit) = MakeEstimates(
      problem_, found_.theta,
      qr.matrixQR().topRows(map_.size()).triangularView<Eigen::Upper>(), 1.0);
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

// How well positions are predicted over short segments, from states as the data
// gives them.
void InverseDynamicsFit::SayPositions(Fit* fit) const {
  const double given = problem_.options().segment;
  Solution point =
      CutPoint(problem_, found_.theta, AllStatesFromData(problem_),
               given > 0.0 ? given : kFirstLength);
  if (!(point.rollout.step > 0.0)) {
    point.rollout.step =
        ChooseStep(problem_, point, problem_.options().step_error);
  }
  fit->point = point;
  fit->train = EvaluateErrors(problem_, point, map_.size());
  fit->step_s = point.rollout.step;
  fit->segment_s = MeanSegment(problem_, point);
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
  std::fprintf(stderr, "filter %.3f\n", Now() - start_s);
  Solve(filter, problem_.InitialTheta());
  std::fprintf(stderr, "solved %.3f\n", Now() - start_s);
  fit.converged = found_.converged;
  fit.iterations = iterations_;
  fit.termination =
      "the equations of motion below a cut-off of " +
      std::to_string(CutOff(filter.average)) + " Hz determine " +
      std::to_string(fit.base.size()) + " combinations of " +
      std::to_string(coordinates_.size()) + " coefficients";
  map_.Apply<double>(found_.theta.data(), &values);
  fit.model.SetNominal(values);
  SayParameters(&fit);
  std::fprintf(stderr, "parameters %.3f\n", Now() - start_s);
  SayPositions(&fit);
  std::fprintf(stderr, "positions %.3f\n", Now() - start_s);
  fit.wall_time_s = Now() - start_s;
  fit.cpu_time_s = CpuSeconds() - start_cpu_s;
  return fit;
}

}  // namespace

Fit FitInverseDynamics(const ShootingProblem& problem) {
  return InverseDynamicsFit(problem).Estimate();
}

}  // namespace sysid
