#include "sysid/hypotheses/secants.h"

#include <cmath>

namespace sysid {

Secants::Secants(const CoarseFitter& fitter, const CoarseFit& fit)
    : fitter_(fitter), fit_(fit), linearized_(*fit.train, fit.point) {
  for (const auto& data : fit.train->runs()) work_ += data->run.size();
}

Secants::Columns Secants::Change(const Supposition& supposed) const {
  const ShootingProblem& problem = *fit_.train;
  const std::vector<Run> windows = fitter_.Train(supposed);
  std::vector<Measurements> measurements;
  for (const Run& window : windows) {
    Measurements of_window{&window, {}};
    for (const Channel& channel : window.channels) {
      of_window.residuals.push_back(MakeChannelResidual(
          problem.model().mechanism(), channel, problem.options().orientation));
    }
    measurements.push_back(std::move(of_window));
  }
  Columns columns;
  for (const auto& segment : linearized_.segments()) {
    const auto& nodes = fit_.point.runs[segment->run];
    const SegmentRollout rollout(
        &problem.model(), &problem.map(), &measurements[segment->run],
        nodes.samples[segment->index], nodes.samples[segment->index + 1],
        fit_.point.rollout);
    Eigen::MatrixXd change_of_r = Eigen::MatrixXd::Zero(segment->rows(), 1);
    // Where a measurement came or went nothing compares.
    if (rollout.num_residuals() == segment->rows()) {
      std::vector<double> errors(rollout.num_residuals()),
          x_end(problem.model().state_size());
      if (!rollout(nodes.states.row(segment->index).data(),
                   fit_.point.theta.data(), errors.data(), x_end.data())) {
        return {};
      }
      change_of_r = linearized_.Whiten(
          *segment,
          Eigen::Map<const Eigen::VectorXd>(errors.data(), segment->rows()) -
              segment->errors);
      if (!change_of_r.allFinite()) return {};
    }
    columns.push_back(linearized_.WithoutStates(*segment, change_of_r));
  }
  return columns;
}

Secants::Columns Secants::OfRun(const Columns& columns, int run) const {
  Columns of_run = columns;
  for (size_t s = 0; s < of_run.size(); ++s) {
    // Every other window is a training window.
    const int window = 2 * linearized_.segments()[s]->run;
    if (fitter_.excerpt().run(window) != run) of_run[s].setZero();
  }
  return of_run;
}

Secant Secants::Test(const Columns& change, double step) const {
  Secant secant;
  Columns c = change;
  linearized_.ProjectOutTheta(&c);
  double cc = 0.0, cr = 0.0, rr = 0.0;
  for (size_t s = 0; s < c.size(); ++s) {
    c[s] /= step;
    const Eigen::VectorXd& r = linearized_.segments()[s]->r;
    cc += c[s].squaredNorm();
    cr += c[s].col(0).dot(r);
    rr += r.squaredNorm();
  }
  if (!(cc > 0.0) || !(rr > 0.0)) return secant;
  secant.value = -cr / cc;
  secant.ratio = std::sqrt(std::max(0.0, 1.0 - cr * cr / cc / rr));
  double variance = 0.0, of_window = 0.0;
  for (size_t s = 0; s < c.size(); ++s) {
    const Eigen::VectorXd& r = linearized_.segments()[s]->r;
    of_window += c[s].col(0).dot(r + secant.value * c[s].col(0));
    if (s + 1 == c.size() ||
        linearized_.segments()[s + 1]->run != linearized_.segments()[s]->run) {
      variance += of_window * of_window;
      of_window = 0.0;
    }
  }
  secant.std_error = std::sqrt(variance) / cc;
  return secant;
}

double Secants::Ratio(const Columns& change) const {
  Columns c = change;
  linearized_.ProjectOutTheta(&c);
  double after = 0.0, before = 0.0;
  for (size_t s = 0; s < c.size(); ++s) {
    const Eigen::VectorXd& r = linearized_.segments()[s]->r;
    after += (r + c[s].col(0)).squaredNorm();
    before += r.squaredNorm();
  }
  return before > 0.0 ? std::sqrt(after / before) : 1.0;
}

}  // namespace sysid
