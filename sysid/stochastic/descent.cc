#include "sysid/stochastic/descent.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/math/decompositions.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/preflight.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/step_size.h"
#include "sysid/estimation/stop_later.h"

namespace sysid {

Descent::Descent(const ShootingProblem& problem, const std::string& solver,
                 double segment, bool from_rest)
    : problem_(problem),
      choose_step_(problem.options().rollout.step <= 0),
      start_s_(Now()),
      start_cpu_s_(CpuSeconds()),
      transformation_(problem),
      fit_(problem.model()) {
  fit_.solver = solver;
  fit_.samples = problem.data().samples();
  fit_.noise = problem.data().PooledNoise();
  const Eigen::VectorXd v = Eigen::VectorXd::Zero(transformation_.size());
  point_ = CutPoint(problem_, transformation_.Theta(v),
                    AllStatesFromData(problem_), segment);
  if (from_rest) StartAtRest(problem.model(), &point_);
  ShortenStep(v);
  ShootingSegments segments(problem_, point_);
  hopeless_ = WhyHopeless(problem_, point_, &segments);
  rollouts_ = std::make_unique<Rollouts>(&problem_, point_);
}

double Descent::Seconds() const { return Now() - start_s_; }

bool Descent::ShortenStep(const Eigen::VectorXd& v) {
  if (!choose_step_) return false;
  point_.theta = transformation_.Theta(v);
  const bool changed = AdaptRollout(problem_, &point_);
  if (rollouts_ != nullptr) rollouts_->SetRollout(point_.rollout);
  return changed;
}

bool Descent::Interrupted(int epoch) {
  const EstimationOptions& options = problem_.options();
  if (!options.keep_best || epoch == 0 || !options.stop.stop_requested()) {
    return false;
  }
  fit_.termination =
      InterruptedWords("after " + std::to_string(epoch) + " epochs");
  return true;
}

void Descent::Note(int epoch, int epochs, double loss, int samples,
                   const Eigen::VectorXd& v) {
  const double squares = loss * samples / (fit_.noise * fit_.noise);
  fit_.history.push_back(
      {epoch, 0.5 * squares, Seconds(), transformation_.Theta(v)});
  if (!problem_.options().keep_best) {
    ThrowIfCancelled(problem_.options().stop);
  }
  if (!problem_.options().progress) return;
  const double dof = std::max(1.0, problem_.data().DofPerSample() * samples);
  problem_.options().progress(
      {fit_.solver, epoch, epochs, std::sqrt(squares / dof)});
}

GaussNewtonStep Descent::RemainingStep(const Eigen::VectorXd& v) const {
  constexpr double kRank = 1e-5;  // of the largest singular value
  constexpr double kHeld = 0.01;  // of the slope at the start
  const int n = transformation_.size();
  const Eigen::VectorXd theta = transformation_.Theta(v);
  const Eigen::VectorXd slope = transformation_.Slope(v);
  const Eigen::VectorXd first = transformation_.Slope(Eigen::VectorXd::Zero(n));
  GaussNewtonStep step;
  step.gain = step.squares = std::numeric_limits<double>::infinity();
  step.dv = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  double sum;
  if (!rollouts_->NormalEquations(theta, &H, &g, &sum)) return step;
  H = slope.asDiagonal() * H * slope.asDiagonal();
  g = slope.cwiseProduct(g);
  std::vector<int> loose;
  for (int i = 0; i < n; ++i) {
    if (std::abs(slope[i]) > kHeld * std::abs(first[i])) loose.push_back(i);
  }
  if (loose.empty()) {
    step.gain = step.squares = 0.0;
    return step;
  }
  const Eigen::MatrixXd H_loose = H(loose, loose);
  const Eigen::VectorXd g_loose = g(loose);
  // H is squared: so is the rank's threshold.
  const SingularValues svd = SingularValuesOf(H_loose);
  const double least = kRank * kRank * svd.s[0];
  const Eigen::VectorXd inverse =
      (svd.s.array() > least).select(svd.s.cwiseInverse(), 0.0);
  const Eigen::VectorXd dv =
      -svd.V * inverse.cwiseProduct(svd.U.transpose() * g_loose);
  step.dv(loose) = dv;
  const double gained = -g_loose.dot(dv);
  step.gain = sum > 0 ? gained / sum : 0.0;
  step.squares = gained / (fit_.noise * fit_.noise);
  return step;
}

Fit Descent::Finish(const Eigen::VectorXd& v) {
  point_.theta = transformation_.Theta(v);
  const StopLater later(problem_.options().stop);
  const EstimationOptions options = WithGrace(problem_, later);
  const ShootingProblem rest = problem_.With(options);
  fit_.defect = std::numeric_limits<double>::infinity();
  // The states were given.
  SummarizeFit(rest, point_, transformation_.size(), &fit_);
  // A start at a bound was moved.
  for (int i = 0; i < transformation_.size(); ++i) {
    fit_.parameters[i].initial = transformation_.start()[i];
  }
  try {
    fit_.horizon = EvaluateHorizon(rest, point_);
    fit_.open = EvaluateOpen(rest, point_);
  } catch (const Cancelled&) {
    if (!options.keep_best) throw;
  }
  fit_.wall_time_s = Seconds();
  fit_.cpu_time_s = CpuSeconds() - start_cpu_s_;
  return fit_;
}

}  // namespace sysid
