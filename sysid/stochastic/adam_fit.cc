#include <algorithm>
#include <cmath>
#include <limits>

#include "sysid/estimation/cancelled.h"
#include "sysid/stochastic/descent.h"
#include "sysid/stochastic/rollout_gradient.h"
#include "sysid/stochastic/stochastic_fit.h"
#include "sysid/stochastic/words.h"

namespace sysid {
namespace {

constexpr int kStepEvery = 10;     // epochs between looks at the step
constexpr int kMostFailures = 20;  // in a row
constexpr double kRecovery = 1.2;  // of the learning rate, an epoch

// Whether a Gauss-Newton step would gain nothing to speak of: a hundredth of
// the loss, half a unit of log-likelihood, or a thousandth of every parameter.
bool IsDone(const GaussNewtonStep& step) {
  return step.gain < 0.01 || step.squares < 1.0 ||
         (std::isfinite(step.gain) && step.dv.cwiseAbs().maxCoeff() < 1e-3);
}

}  // namespace

Fit FitAdam(const ShootingProblem& problem, const AdamFitOptions& options) {
  const double given = problem.options().segment;
  Descent descent(problem, "adam",
                  given > 0 ? given : std::numeric_limits<double>::infinity(),
                  options.from_rest);
  Fit* fit = descent.fit();
  Eigen::VectorXd v = Eigen::VectorXd::Zero(problem.map().size());
  fit->termination = descent.hopeless();
  if (!fit->termination.empty()) return descent.Finish(v);

  const Rollouts& rollouts = descent.rollouts();
  const int all = rollouts.size(), epochs = options.adam.epochs;
  const int samples = rollouts.Samples(all);
  Adam adam(static_cast<int>(v.size()), options.adam);
  RolloutSums sums;
  Eigen::ArrayXXd gradient;  // one row
  Eigen::VectorXd good = v, best = v;
  double best_loss = std::numeric_limits<double>::infinity();
  double slower = 1.0;  // after failures
  int failures = 0;     // in a row
  for (int epoch = 1; epoch <= epochs + 1; ++epoch) {
    double loss = 0.0;
    int failed = 0;
    if (epoch > 2) sums.StopAt(problem.options().stop);  // one step is taken
    ++fit->evaluations;
    const auto evaluate = [&] {
      return MeanLossGradient(rollouts, all, descent.transformation(),
                              options.huber, v.transpose(), &sums, &loss,
                              &failed, &gradient);
    };
    bool shortened = epoch % kStepEvery == 0 && descent.ShortenStep(v);
    bool ok = false;
    try {
      ok = evaluate();
      if (!ok && descent.ShortenStep(v)) {
        shortened = true;
        ok = evaluate();
      }
    } catch (const Cancelled&) {
      if (!descent.Interrupted(epoch - 1)) throw;
      break;
    }
    if (shortened) {
      best_loss = std::numeric_limits<double>::infinity();  // another loss
    }
    if (!ok) {
      // Half the way back, and shorter steps for a while.
      if (++failures > kMostFailures) break;
      v = 0.5 * (v + good);
      slower *= 0.5;
      descent.Note(epoch - 1, epochs, std::numeric_limits<double>::infinity(),
                   samples, v);
      continue;
    }
    failures = 0;
    slower = std::min(1.0, kRecovery * slower);
    good = v;
    if (loss < best_loss) {
      best_loss = loss;
      best = v;
    }
    descent.Note(epoch - 1, epochs, loss, samples, v);
    if (epoch > epochs || descent.Interrupted(epoch - 1)) break;
    fit->iterations = epoch;
    adam.Step(gradient.row(0).matrix(),
              slower * LearningRate(options.adam, epoch), &v);
  }
  v = best;
  if (!std::isfinite(best_loss)) {
    fit->termination =
        "diverged: the rollouts fail from where they start; another start, a "
        "shorter --step or --segment may help";
    return descent.Finish(v);
  }
  if (!fit->termination.empty()) return descent.Finish(v);  // interrupted
  const GaussNewtonStep step = descent.RemainingStep(v);
  fit->converged = IsDone(step) && failures == 0;
  if (fit->converged) {
    fit->termination = "settled: a Gauss-Newton step would lower the loss by " +
                       Words("%.2g %%", 100.0 * step.gain);
  } else if (failures > 0) {
    fit->termination =
        "diverged: rollouts fail beside the best point; a lower "
        "--learning_rate may help";
  } else {
    int worst = 0;
    step.dv.cwiseAbs().maxCoeff(&worst);
    fit->termination =
        "after " + std::to_string(epochs) +
        " epochs the loss is not at a minimum: a Gauss-Newton step would "
        "take " +
        Words("%.2g %%", 100.0 * step.gain) + " of it away and move " +
        problem.free()[worst].parameter.name + " by " +
        Words("%.2g %%", 100.0 * std::abs(step.dv[worst])) +
        " of its size; more --epochs or another --learning_rate may help";
  }
  return descent.Finish(v);
}

}  // namespace sysid
