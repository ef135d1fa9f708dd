#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "models/error.h"
#include "models/math/constants.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/identifiability.h"
#include "sysid/stochastic/descent.h"
#include "sysid/stochastic/rollout_gradient.h"
#include "sysid/stochastic/stochastic_fit.h"
#include "sysid/stochastic/words.h"

namespace sysid {
namespace {

// The length of a rollout, s: as given, or, online, such that enough arrive.
double RolloutLength(const ShootingProblem& problem,
                     const MixtureOptions& options) {
  if (problem.options().segment > 0) return problem.options().segment;
  const int runs = static_cast<int>(problem.runs().size());
  if (!options.online || runs >= options.online_samples) return kInfinity;
  double duration = 0.0;
  for (const auto& run : problem.runs()) {
    duration += run->run.t.back() - run->run.t.front();
  }
  return duration / options.online_samples;
}

class MixtureDescent {
 public:
  MixtureDescent(const ShootingProblem& problem, const MixtureOptions& options)
      : problem_(problem),
        options_(options),
        descent_(problem, "gmm", RolloutLength(problem, options),
                 options.from_rest),
        random_(options.seed),
        result_(*descent_.fit()),
        n_(problem.map().size()),
        adam_(options.kernels * (1 + 2 * n_), options.adam) {
    mixture_ = StartingMixture(options.kernels, n_, options.spread, &random_);
    good_ = mixture_;
    options_.adam.epochs = options.epochs();
  }

  MixtureFit Run();

 private:
  // One step; false where all draws have failed too often, or it was stopped.
  bool Epoch(int epoch, int arrived);
  // v of ParameterMixture::Mean() as it was recorded last.
  Eigen::VectorXd Estimate() const;
  void Record(int epoch, int rollouts, double loss);
  // A draw whose rollout all but fails has a gradient that is larger than the
  // others' by any factor. One such would fill Adam's second moment and stop it
  // for a thousand epochs: cut to kClip times what is usual.
  void Clip(Eigen::VectorXd* gradient);
  void CountBeyondBounds();
  void Judge();
  void RemarkOnCuts();
  void RemarkOnDraws();
  void RemarkOnKernels();
  // What the kernels leave open joins what the Jacobian does.
  void MarkDisagreeing();

  const ShootingProblem& problem_;
  MixtureOptions options_;
  Descent descent_;
  std::mt19937_64 random_;
  MixtureFit result_;
  int n_;
  GaussianMixture mixture_, good_;
  Adam adam_;
  // Of an epoch; kept for their memory.
  MixtureNoise noise_;
  SoftDraws draws_;
  Eigen::Array<bool, Eigen::Dynamic, 1> beyond_;
  RolloutSums sums_;
  double usual_norm_ = 0.0;  // of the gradient
  double slower_ = 1.0;      // after failures
  int failures_ = 0;         // in a row
};

void MixtureDescent::Record(int epoch, int rollouts, double loss) {
  result_.epochs.push_back(
      {epoch, rollouts, loss,
       InParameters(problem_, descent_.transformation(), mixture_)});
}

Eigen::VectorXd MixtureDescent::Estimate() const {
  Eigen::VectorXd theta;
  // A weighted sum of possible bodies is one, unless an inertia has overflown.
  const bool possible =
      problem_.map().ThetaOf(result_.epochs.back().kernels.Mean(), &theta);
  return possible ? descent_.transformation().Inverse(theta) : mixture_.Mean();
}

void MixtureDescent::CountBeyondBounds() {
  const Eigen::VectorXd mean = mixture_.Mean();
  const Eigen::VectorXd theta = descent_.transformation().Theta(mean);
  const Eigen::VectorXd slope = descent_.transformation().Slope(mean);
  beyond_.setConstant(draws_.count(), false);
  for (int i = 0; i < n_; ++i) {
    if (problem_.map().IsTransformed(i)) continue;
    const auto linear = theta[i] + slope[i] * (draws_.v().col(i) - mean[i]);
    beyond_ = beyond_ || linear < problem_.free()[i].lower ||
              linear > problem_.free()[i].upper;
  }
  result_.beyond_bounds += static_cast<int>(beyond_.count());
}

void MixtureDescent::Clip(Eigen::VectorXd* gradient) {
  constexpr double kClip = 10.0;
  constexpr double kForget = 0.1;
  const double norm = gradient->norm();
  if (usual_norm_ == 0.0) usual_norm_ = norm;
  const double most = kClip * usual_norm_;
  if (norm > most) {
    *gradient *= most / norm;
    ++result_.clipped_epochs;
  }
  usual_norm_ += kForget * (std::min(norm, most) - usual_norm_);
}

bool MixtureDescent::Epoch(int epoch, int arrived) {
  constexpr int kStepEvery = 10;
  constexpr int kMostFailures = 20;
  constexpr double kRecovery = 1.2;  // of the learning rate, an epoch
  Fit* fit = descent_.fit();
  if (epoch % kStepEvery == 0 || failures_ > 0) {
    descent_.ShortenStep(mixture_.Mean());
  }
  DrawNoise(options_.draws, options_.kernels, n_, &random_, &noise_);
  draws_.Draw(mixture_, noise_, options_.temperature);
  CountBeyondBounds();
  double loss = 0.0;
  int failed = 0;
  Eigen::ArrayXXd by_v;
  Eigen::VectorXd gradient, packed = mixture_.Pack();
  if (epoch > 1) sums_.StopAt(problem_.options().stop);  // one step is taken
  bool ok = false;
  try {
    ok = MeanLossGradient(descent_.rollouts(), arrived,
                          descent_.transformation(), options_.huber, draws_.v(),
                          &sums_, &loss, &failed, &by_v);
  } catch (const Cancelled&) {
    if (!descent_.Interrupted(epoch - 1)) throw;
    return false;
  }
  if (ok) gradient = draws_.Gradient(by_v);
  ok = ok && gradient.allFinite();
  result_.draws += options_.draws;
  result_.failed_draws += failed;
  fit->evaluations += options_.draws;
  fit->iterations = epoch;
  if (!ok) {
    // Half the way back, and shorter steps from there on.
    if (++failures_ > kMostFailures) return false;
    packed = 0.5 * (packed + good_.Pack());
    slower_ *= 0.5;
    loss = kInfinity;
  } else {
    failures_ = 0;
    slower_ = std::min(1.0, kRecovery * slower_);
    good_ = mixture_;
    Clip(&gradient);
    adam_.Step(gradient, slower_ * LearningRate(options_.adam, epoch), &packed);
  }
  mixture_.Unpack(packed);
  Record(epoch, arrived, loss);
  descent_.Note(epoch, options_.epochs(), loss,
                descent_.rollouts().Samples(arrived), Estimate());
  return true;
}

void MixtureDescent::Judge() {
  // Parts of a parameter's size within which the mean is taken as arrived.
  constexpr double kArrived = 0.05;
  Fit* fit = descent_.fit();
  if (failures_ > 0) {
    fit->termination =
        "diverged: every draw's rollouts fail; a lower --learning_rate, a "
        "smaller --spread or shorter --segment may help";
    return;
  }
  const GaussNewtonStep step = descent_.RemainingStep(Estimate());
  if (!std::isfinite(step.gain)) {
    fit->termination =
        "diverged: the rollouts of the mean fail; a lower --learning_rate or a "
        "smaller --spread may help";
    return;
  }
  int worst = 0;
  const double move = step.dv.cwiseAbs().maxCoeff(&worst);
  fit->converged = move < kArrived || step.squares < 1.0;
  fit->termination =
      std::string(fit->converged ? "settled" : "the mean has not settled") +
      ": a Gauss-Newton step from it would move " +
      problem_.free()[worst].parameter.name + " by " +
      Words("%.2g %%", 100.0 * move) + " of its size" +
      (fit->converged ? ""
                      : "; more --epochs or another --learning_rate may help");
}

// Online, too few runs are cut, which the other solvers do not do.
void MixtureDescent::RemarkOnCuts() {
  const double length = RolloutLength(problem_, options_);
  if (problem_.options().segment > 0 || length == kInfinity) return;
  result_.remarks.push_back("--online cut the runs into " +
                            std::to_string(descent_.rollouts().size()) +
                            Words(" rollouts of about %.2g s, ", length) +
                            "with first states from the data");
}

void MixtureDescent::RemarkOnDraws() {
  if (result_.failed_draws > 0) {
    result_.remarks.push_back(std::to_string(result_.failed_draws) + " of " +
                              std::to_string(result_.draws) +
                              " draws were left out: their rollouts failed");
  }
  if (result_.clipped_epochs > 0) {
    result_.remarks.push_back(
        "the gradient of " + std::to_string(result_.clipped_epochs) +
        " epochs was cut: rollouts of some draws all but failed");
  }
  if (result_.beyond_bounds > 0) {
    result_.remarks.push_back(
        std::to_string(result_.beyond_bounds) + " of " +
        std::to_string(result_.draws) +
        " draws would have been beyond their bounds (a negative length), were "
        "the kernels Gaussian in the parameters; the transformation kept them "
        "inside");
  }
}

void MixtureDescent::RemarkOnKernels() {
  constexpr double kLost = 0.01;      // weight
  constexpr double kSmall = 1e-3;     // deviation, part of a parameter's size
  constexpr double kEqual = 10.0;     // of log-likelihood ratio, doubled
  constexpr double kTakesPart = 0.1;  // as in AnalyseIdentifiability
  constexpr int kPolish = 3;          // Gauss-Newton steps
  const Eigen::VectorXd weights = mixture_.Weights();
  const Eigen::MatrixXd deviations = mixture_.Deviations();
  const int all = descent_.rollouts().size();
  const double samples = descent_.rollouts().Samples(all);
  const double noise = descent_.fit()->noise;
  std::vector<Eigen::VectorXd> polished;
  std::vector<double> squares;
  for (int k = 0; k < mixture_.kernels(); ++k) {
    if (weights[k] < kLost) {
      result_.remarks.push_back("kernel " + std::to_string(k + 1) +
                                " has lost its weight (" +
                                Words("%.2g", weights[k]) + ")");
    } else if (deviations.row(k).maxCoeff() < kSmall) {
      result_.remarks.push_back("kernel " + std::to_string(k + 1) +
                                " has collapsed to a point: its deviations are "
                                "below 0.1 % of the parameters");
    }
    Eigen::VectorXd v = mixture_.means.row(k);
    for (int i = 0; i < kPolish; ++i) {
      // No further than a kernel reached: along what is not determined the
      // step is nothing, so kernels that a valley holds apart stay apart.
      const GaussNewtonStep step = descent_.RemainingStep(v);
      const double length = step.dv.cwiseAbs().maxCoeff();
      v += step.dv * std::min(1.0, 0.5 / std::max(length, 1e-12));
    }
    polished.push_back(v);
    squares.push_back(descent_.rollouts().Loss(
                          all, descent_.transformation().Theta(v), kInfinity) *
                      samples / (noise * noise));
  }
  const double best = *std::min_element(squares.begin(), squares.end());
  const double dof = std::max(1.0, problem_.data().DofPerSample() * samples);
  const double equal = kEqual * std::max(1.0, best / dof);
  std::vector<bool> apart(n_, false);
  for (size_t a = 0; a < polished.size(); ++a) {
    for (size_t b = a + 1; b < polished.size(); ++b) {
      if (!(squares[a] - best < equal && squares[b] - best < equal)) continue;
      const Eigen::VectorXd off = (polished[a] - polished[b]).cwiseAbs();
      if (off.maxCoeff() <= kUndetermined) continue;
      for (int i = 0; i < n_; ++i) {
        apart[i] = apart[i] || off[i] > kTakesPart * off.maxCoeff();
      }
    }
  }
  std::vector<std::string> names;
  for (int i = 0; i < n_; ++i) {
    if (apart[i]) names.push_back(problem_.free()[i].parameter.name);
  }
  if (names.empty()) return;
  result_.remarks.push_back("the kernels lead to different " + Join(names) +
                            " that fit equally well");
  result_.disagreeing = names;
}

void MixtureDescent::MarkDisagreeing() {
  Fit* fit = &result_.fit;
  std::vector<std::string> open;  // said of no parameter yet
  for (ParameterEstimate& p : fit->parameters) {
    const auto& names = result_.disagreeing;
    if (!p.identifiable ||
        std::find(names.begin(), names.end(), p.name) == names.end()) {
      continue;
    }
    open.push_back(p.name);
    p.identifiable = false;
    p.std_error = p.ci95[0] = p.ci95[1] =
        std::numeric_limits<double>::quiet_NaN();
  }
  if (!open.empty()) fit->not_identifiable.push_back(open);
}

MixtureFit MixtureDescent::Run() {
  Fit* fit = descent_.fit();
  fit->termination = descent_.hopeless();
  Record(0, 0, kInfinity);
  if (fit->termination.empty()) {
    RemarkOnCuts();
    const int total = descent_.rollouts().size();
    const int epochs = options_.epochs();
    const Eigen::VectorXd mean = Estimate();
    descent_.Note(
        0, epochs,
        descent_.rollouts().Loss(total, descent_.transformation().Theta(mean),
                                 options_.huber),
        descent_.rollouts().Samples(total), mean);
    for (int epoch = 1; epoch <= epochs; ++epoch) {
      int arrived = total;
      if (options_.online) {
        const int portion = (epoch - 1) / options_.online_epochs + 1;
        arrived = (total * portion + options_.online_samples - 1) /
                  options_.online_samples;
      }
      if (!Epoch(epoch, arrived)) break;
      if (descent_.Interrupted(epoch)) break;
    }
    if (fit->termination.empty()) Judge();  // else interrupted
    RemarkOnDraws();
    RemarkOnKernels();
  }
  result_.fit = descent_.Finish(Estimate());
  MarkDisagreeing();
  result_.kernels = mixture_;
  result_.mixture = result_.epochs.back().kernels;
  return std::move(result_);
}

}  // namespace

MixtureFit FitGaussianMixture(const ShootingProblem& problem,
                              const MixtureOptions& options) {
  return MixtureDescent(problem, options).Run();
}

Eigen::MatrixXd SampleParameters(const ShootingProblem& problem,
                                 const GaussianMixture& kernels, int count,
                                 std::uint64_t seed) {
  const Transformation transformation(problem);
  std::mt19937_64 random(seed);
  const int n = problem.map().size();
  Eigen::MatrixXd values(count, n);
  for (int i = 0; i < count; ++i) {
    const Eigen::VectorXd theta = transformation.Theta(kernels.Sample(&random));
    Eigen::VectorXd value(n);
    problem.map().ValuesOf<double>(theta.data(), value.data());
    values.row(i) = value;
  }
  return values;
}

}  // namespace sysid
