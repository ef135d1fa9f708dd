#include "sysid/checks/knobs.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sysid/estimation/linearization.h"

namespace sysid {
namespace {

// Residuals of every segment, in order; empty where the dynamics fail.
std::vector<RunLinearization> LinearizeAt(const ShootingProblem& problem,
                                          const Solution& at) {
  std::vector<RunLinearization> runs;
  const LinearizationOptions options{
      .defect = std::numeric_limits<double>::infinity(), .triangular = false};
  if (!Linearize(problem, at, options, &runs)) runs.clear();
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
    const ShootingProblem problem(
        model.model, model.free,
        MakeDataSetLike(model.model, excerpt.Windows([&](Run* run) {
          knobs[i].change(knobs[i].probe, run);
        }),
                        fit.problem->options(), fit.problem->data()),
        fit.problem->options());
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

// One step by (C.1) from a fit with the knob at `value`: whether there is more
// to turn.
bool Step(const LooseModel& model, const QuickFit& fit, const Excerpt& excerpt,
          const Knob& knob, double* value, double* std_error) {
  const KnobScore score =
      ScoreKnobs(model, fit, excerpt, {Beyond(knob, *value)}).front();
  if (!score.known) return false;
  *std_error = score.std_error;
  const double enough = std::max(0.3 * score.std_error, 1e-3 * knob.least);
  if (std::abs(score.value) < enough) return false;
  *value = std::clamp(*value + score.value, -knob.most, knob.most);
  return true;
}

std::vector<Run> Turned(const Excerpt& excerpt, const Knob& knob,
                        double value) {
  return excerpt.Windows([&](Run* run) { knob.change(value, run); });
}

}  // namespace

TurnedKnob TurnShort(const LooseModel& model, const Excerpt& excerpt,
                     const EstimationOptions& options, const Knob& knob,
                     double start, int iterations, const QuickFit& like) {
  constexpr int kSteps = 8, kInVain = 2;
  TurnedKnob best;
  QuickFit fit =
      FitShort(model, Turned(excerpt, knob, start), options, iterations, &like);
  double value = start, std_error = best.std_error;
  for (int step = 0, in_vain = 0;; ++step) {
    const double at = value;
    const bool more = Step(model, fit, excerpt, knob, &value, &std_error);
    const bool is_best = step == 0 || fit.error < best.fit.error;
    if (is_best) best = {at, std_error, fit};
    // The first fits are far from where they would end: a step that seems to be
    // in vain may be none.
    in_vain = is_best ? 0 : in_vain + 1;
    if (!more || step == kSteps || in_vain == kInVain) return best;
    fit = FitOn(model, Turned(excerpt, knob, value), options, fit);
  }
}

TurnedKnob TurnLong(const LooseModel& model, const Excerpt& excerpt,
                    const EstimationOptions& options, const Knob& knob,
                    double value, QuickFit fit) {
  constexpr int kSteps = 4;
  TurnedKnob turned;
  for (int step = 0; step < kSteps && fit.error < turned.fit.error; ++step) {
    turned.value = value;
    turned.fit = fit;
    if (!Step(model, fit, excerpt, knob, &value, &turned.std_error)) break;
    fit = FitOn(model, Turned(excerpt, knob, value), options, fit);
  }
  return turned;
}

TurnedKnob ToGrain(const LooseModel& model, const Excerpt& excerpt,
                   const EstimationOptions& options, const Knob& knob,
                   TurnedKnob turned) {
  // Of the error of the best value: between samples a cubic smooths the noise,
  // by a tenth at the most.
  constexpr double kAsGood = 1.1;
  if (!(knob.grain > 0.0) || !std::isfinite(turned.fit.error)) return turned;
  const double whole = knob.grain * std::round(turned.value / knob.grain);
  if (whole == 0.0) return turned;
  QuickFit fit =
      FitOn(model, Turned(excerpt, knob, whole), options, turned.fit);
  if (!(fit.error <= kAsGood * turned.fit.error)) return turned;
  return {whole, turned.std_error, std::move(fit)};
}

}  // namespace sysid
