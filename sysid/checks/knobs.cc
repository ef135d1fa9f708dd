#include "sysid/checks/knobs.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sysid/estimation/shooting_stage.h"

namespace sysid {
namespace {

ShootingStage::Options StageOptions() {
  ShootingStage::Options options;
  options.defect = std::numeric_limits<double>::infinity();
  options.quiet = true;
  return options;
}

// Residuals of every segment, in order; empty where the dynamics fail.
std::vector<RunLinearization> LinearizeAt(const ShootingProblem& problem,
                                          const ShootingPoint& at) {
  ShootingPoint point = at;
  const ShootingStage stage(problem, StageOptions(), &point);
  std::vector<RunLinearization> runs;
  if (!stage.Linearize(&runs)) runs.clear();
  return runs;
}

}  // namespace

std::vector<KnobScore> ScoreKnobs(const LooseModel& model, const QuickFit& fit,
                                  const Excerpt& excerpt,
                                  const std::vector<Knob>& knobs) {
  std::vector<KnobScore> scores(knobs.size());
  const std::vector<RunLinearization> base =
      LinearizeAt(*fit.problem, fit.point);
  if (base.empty() || !std::isfinite(fit.error)) return scores;
  // The change of the residuals by each knob, per run and segment.
  std::vector<std::vector<RunLinearization>> moved(knobs.size());
  for (size_t i = 0; i < knobs.size(); ++i) {
    ShootingProblem problem(model.model, model.free,
                            excerpt.Windows([&](Run* run) {
                              knobs[i].change(knobs[i].probe, run);
                            }),
                            fit.problem->options());
    problem.UseNoiseOf(*fit.problem);
    moved[i] = LinearizeAt(problem, fit.point);
  }
  const int n_theta = fit.problem->map().size();
  const int count = static_cast<int>(knobs.size());
  // Rows that speak of theta and the knobs alone: [J_theta | C | r].
  std::vector<RowMatrixXd> left;
  int rows = 0;
  std::vector<bool> usable(knobs.size(), true);
  for (size_t r = 0; r < base.size(); ++r) {
    for (size_t k = 0; k < base[r].segments.size(); ++k) {
      const SegmentLinearization& segment = base[r].segments[k];
      const int m = static_cast<int>(segment.r.size());
      const int n_x = static_cast<int>(segment.J_x.cols());
      RowMatrixXd C = RowMatrixXd::Zero(m, count);
      for (int i = 0; i < count; ++i) {
        if (moved[i].empty()) {
          usable[i] = false;
          continue;
        }
        const Eigen::VectorXd& other = moved[i][r].segments[k].r;
        if (other.size() != m) continue;  // something missing: says nothing
        C.col(i) = (other - segment.r) / knobs[i].probe;
      }
      RowMatrixXd all(m, n_theta + count + 1);
      all << segment.J_theta, C, segment.r;
      if (m <= n_x) continue;
      Eigen::HouseholderQR<Eigen::MatrixXd> qr(segment.J_x);
      const Eigen::MatrixXd turned = qr.householderQ().adjoint() * all;
      left.push_back(turned.bottomRows(m - n_x));
      rows += m - n_x;
    }
  }
  Eigen::MatrixXd stacked(rows, n_theta + count + 1);
  for (int at = 0; const RowMatrixXd& part : left) {
    stacked.middleRows(at, part.rows()) = part;
    at += static_cast<int>(part.rows());
  }
  if (rows <= n_theta + 1) return scores;
  Eigen::MatrixXd rest = stacked.rightCols(count + 1);
  if (n_theta > 0) {
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(
        stacked.leftCols(n_theta));
    const int rank = static_cast<int>(qr.rank());
    Eigen::MatrixXd turned = qr.householderQ().adjoint() * rest;
    rest = turned.bottomRows(rows - rank);
  }
  const double total = rest.col(count).squaredNorm();
  const double whole = fit.error * fit.error * fit.dof;
  for (int i = 0; i < count; ++i) {
    const double cc = rest.col(i).squaredNorm();
    if (!usable[i] || !(cc > 0.0) || !(whole > 0.0)) continue;
    const double cr = rest.col(i).dot(rest.col(count));
    KnobScore& score = scores[i];
    score.known = true;
    score.value = -cr / cc;
    score.std_error = std::max(1.0, fit.error) *
                      std::sqrt(std::max(1.0, fit.correlation) / cc);
    const double gain = std::min(1.0, cr * cr / cc / total);
    score.error = fit.error * std::sqrt(1.0 - gain);
  }
  return scores;
}

namespace {

// The knob turned to `value` and beyond.
Knob Beyond(const Knob& knob, double value) {
  Knob beyond = knob;
  beyond.change = [&knob, value](double more, Run* run) {
    knob.change(value + more, run);
  };
  return beyond;
}

}  // namespace

TurnedKnob TurnKnob(const LooseModel& model, const QuickFit& short_as_read,
                    const QuickFit& as_read, const Excerpt& excerpt,
                    const EstimationOptions& options, const Knob& knob,
                    double start) {
  constexpr int kShortSteps = 8, kSteps = 4;
  constexpr double kHardly = 1.03;  // of the error of short segments
  // Of the error of the best value: between samples a cubic smooths the noise,
  // by a tenth at the most.
  constexpr double kAsGood = 1.1;
  double value = start;
  const auto windows = [&] {
    return excerpt.Windows([&](Run* run) { knob.change(value, run); });
  };
  // By (C.1) again and again; whether there is more to turn.
  KnobScore score;
  const auto turn = [&](const QuickFit& fit) {
    score = ScoreKnobs(model, fit, excerpt, {Beyond(knob, value)}).front();
    const double enough = std::max(0.3 * score.std_error, 1e-3 * knob.least);
    if (!score.known || std::abs(score.value) < enough) return false;
    value = std::clamp(value + score.value, -knob.most, knob.most);
    return true;
  };
  QuickFit fit =
      FitShort(model, windows(), options, kShortIterations, &as_read);
  for (int step = 0; step < kShortSteps && turn(fit); ++step) {
    const double before = fit.error;
    fit = FitOn(model, windows(), options, fit);
    if (!(fit.error < before)) break;
  }
  TurnedKnob turned;
  if (!(fit.error * kHardly < short_as_read.error)) return turned;
  fit = FitLong(fit);
  for (int step = 0; step < kSteps && fit.error < turned.error; ++step) {
    turned.error = fit.error;
    turned.value = value;
    turned.windows = PartImproved(fit, as_read, 1.0);
    const bool more = turn(fit);
    if (score.known) turned.std_error = score.std_error;
    if (!more) break;
    fit = FitOn(model, windows(), options, fit);
  }
  const double whole = knob.grain > 0.0
                           ? knob.grain * std::round(turned.value / knob.grain)
                           : 0.0;
  if (whole == 0.0 || !std::isfinite(turned.error)) return turned;
  value = whole;
  fit = FitOn(model, windows(), options, fit);
  if (!(fit.error <= kAsGood * turned.error)) return turned;
  turned.value = whole;
  turned.error = fit.error;
  turned.windows = PartImproved(fit, as_read, 1.0);
  return turned;
}

}  // namespace sysid
