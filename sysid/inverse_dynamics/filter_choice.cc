#include "sysid/inverse_dynamics/filter_choice.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "models/dynamics.h"
#include "residuals/acting_inputs.h"
#include "sysid/estimation/parallel.h"
#include "sysid/inverse_dynamics/motion.h"

namespace sysid {
namespace {

// Samples in the finest width: a quintic takes six to determine, and reaches
// over five widths.
constexpr double kFewestSamples = 2.0;
// Widths are tried up to so many of the finest: beyond there is no motion left.
constexpr double kCoarsest = 256.0;
// What is smoothed over so many steps is as well known from every second.
constexpr double kThinned = 4.0;

double MedianPeriodOf(const std::vector<const Run*>& runs,
                      const Processes& all) {
  std::vector<double> periods;
  for (const Run* run : runs) {
    for (int k = 1; k < run->size(); ++k) {
      periods.push_back(run->t[k] - run->t[k - 1]);
    }
  }
  return MedianOver(all, std::move(periods));
}

// The fit of the motion bends what g lets pass, by the fourth power of the
// ratio of their widths: at a half, the acceleration at the cut-off by about 1
// %.
EquationFilter FilterOf(double width) { return {0.5 * width, width}; }

// [r | M qdd | u] of a run on even times, nv columns each.
struct Unfiltered {
  std::vector<char> known;  // not bool: threads set one each
  RowMatrixXd values;
};

// Sets the times [first, last).
void EvaluateRange(const Model& model,
                   const MechanismParameters<double>& values, const Run& run,
                   double width, double step, int first, int last,
                   Unfiltered* out) {
  const int nv = model.nv();
  Workspace<double> ws(model);
  ws.SetParameters(values);
  Eigen::VectorXd u(model.held_size()), needed(nv), without(nv);
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(nv);
  MotionSmoother smoother(model, run, width);
  for (int k = first; k < last; ++k) {
    const double time = run.t.front() + (k + 0.5) * step;
    const MotionSample motion = smoother.At(time);
    if (!motion.known) continue;
    out->known[k] = 1;
    const double from = time - 0.5 * step;
    ActingInputs<double>(run, ws, RowBefore(run, time), from, step, u.data());
    // A step may be longer than a sample: without a delay efforts are means.
    if (ws.delay_effects.empty()) {
      MeanEffort(run, from, from + step, u.data());
      for (const auto& effect : ws.input_effects) {
        effect.hooks->ModifyInput(
            effect.p, u.data() + model.bodies()[effect.body].v_index);
      }
    }
    InverseDynamics<double>(&ws, motion.q.data(), motion.qd.data(),
                            motion.qdd.data(), u.data(), needed.data());
    InverseDynamics<double>(&ws, motion.q.data(), motion.qd.data(), rest.data(),
                            u.data(), without.data());
    out->values.row(k) << (u.head(nv) - needed).transpose(),
        (needed - without).transpose(), u.head(nv).transpose();
  }
}

Unfiltered Evaluate(const Model& model,
                    const MechanismParameters<double>& values, const Run& run,
                    double width, double step, int threads) {
  Unfiltered out;
  const int n = static_cast<int>((run.t.back() - run.t.front()) / step);
  out.values.setZero(n, 3 * model.nv());
  out.known.assign(n, 0);
  ParallelRanges(n, kTimesOfRange, threads, [&](int first, int last) {
    EvaluateRange(model, values, run, width, step, first, last, &out);
  });
  return out;
}

// A Gaussian of `width` steps over the rows; times with unknown ones around
// are taken from those that are known.
RowMatrixXd Smooth(const Unfiltered& now, double width, int threads) {
  const int n = static_cast<int>(now.values.rows());
  const int reach = static_cast<int>(std::ceil(kGaussianReach * width));
  RowMatrixXd out = RowMatrixXd::Zero(n, now.values.cols());
  Eigen::RowVectorXd weights(2 * reach + 1);
  for (int i = -reach; i <= reach; ++i) {
    weights[i + reach] = GaussianWeight(i / width);
  }
  ParallelRanges(n, kTimesOfRange, threads, [&](int begin, int end) {
    Eigen::RowVectorXd used;
    for (int k = begin; k < end; ++k) {
      const int first = std::max(0, k - reach);
      const int last = std::min(n, k + reach + 1);
      used = weights.segment(first - k + reach, last - first);
      for (int i = first; i < last; ++i) {
        if (!now.known[i]) used[i - first] = 0.0;
      }
      const double total = used.sum();
      if (!(total > 0.0)) continue;
      out.row(k).noalias() =
          used / total * now.values.middleRows(first, last - first);
    }
  });
  return out;
}

// Leaves the series smoothed; the power of what that took, by column.
Eigen::RowVectorXd TakeBand(double width, int threads, Unfiltered* now) {
  RowMatrixXd smooth = Smooth(*now, width, threads);
  Eigen::RowVectorXd powers = Eigen::RowVectorXd::Zero(smooth.cols());
  for (size_t k = 0; k < now->known.size(); ++k) {
    if (now->known[k]) {
      powers += (now->values.row(k) - smooth.row(k)).cwiseAbs2();
    }
  }
  now->values = std::move(smooth);
  return powers;
}

// Keeps every second time.
void Thin(Unfiltered* now) {
  const int n = static_cast<int>(now->known.size()) / 2;
  for (int k = 0; k < n; ++k) {
    now->known[k] = now->known[2 * k];
    now->values.row(k) = now->values.row(2 * k).eval();
  }
  now->known.resize(n);
  now->values.conservativeResize(n, Eigen::NoChange);
}

}  // namespace

EquationFilter FirstFilter(const std::vector<const Run*>& runs,
                           const Processes& all) {
  constexpr double kFirst = 0.030;
  const double period = MedianPeriodOf(runs, all);
  return FilterOf(std::max(kFirst, 2.0 * kFewestSamples * period));
}

EquationFilter ChooseFilter(const Model& model,
                            const MechanismParameters<double>& values,
                            const std::vector<const Run*>& runs,
                            const EquationFilter& first, int threads,
                            const Processes& all) {
  const double finest = kFewestSamples * MedianPeriodOf(runs, all);
  double step = 0.5 * finest;
  std::vector<Unfiltered> series;
  for (const Run* run : runs) {
    if (run->t.back() - run->t.front() < 2.0 * step) continue;
    series.push_back(Evaluate(model, values, *run, finest, step, threads));
  }
  // A Gaussian after another: the squares of their widths add up.
  double had = 0.0;
  for (double width = step; width < kCoarsest * finest;
       width *= std::sqrt(2.0)) {
    const double more = std::sqrt(width * width - had * had) / step;
    const int nv = model.nv();
    Totals totals(3 * nv);
    for (Unfiltered& now : series) {
      totals.Add(0, TakeBand(more, threads, &now));
    }
    const Eigen::VectorXd powers = totals.Over(all);
    const auto told =
        (powers.head(nv).array() <
         0.5 * powers.segment(nv, nv).cwiseMax(powers.tail(nv)).array())
            .count();
    if (had >= 2.0 * finest && 2 * told >= model.nv()) return FilterOf(had);
    had = width;
    if (had >= kThinned * step) {
      step *= 2.0;
      for (Unfiltered& now : series) Thin(&now);
    }
  }
  return first;
}

}  // namespace sysid
