#include "sysid/stochastic/rollout_gradient.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <stan/math/rev/core.hpp>
#include <stan/math/rev/scal.hpp>

#include "sysid/stochastic/tape_rollout.h"

namespace sysid {
namespace {

using stan::math::ChainableStack;
using stan::math::var;
using stan::math::vari;

// The process has one tape (Stan is compiled without STAN_THREADS, which would
// need TBB linked): one gradient at a time. What is put on it is recovered.
class Tape {
 public:
  Tape() : lock_(Mutex()) {
    // RStan's headers have a tape for each thread, but make the main thread's
    // only.
    static thread_local const ChainableStack of_this_thread;
    stan::math::start_nested();
  }
  ~Tape() {
    Use().last_call = ChainableStack::instance_->memalloc_.bytes_allocated();
    stan::math::recover_memory_nested();
    Use().nodes_left = ChainableStack::instance_->var_stack_.size() +
                       ChainableStack::instance_->var_nochain_stack_.size();
  }
  Tape(const Tape&) = delete;
  Tape& operator=(const Tape&) = delete;

  static TapeUse& Use() {
    static TapeUse use;
    return use;
  }

 private:
  static std::mutex& Mutex() {
    static std::mutex mutex;
    return mutex;
  }
  std::lock_guard<std::mutex> lock_;
};

// L of (9.1) at points theta that are on the tape, n numbers each.
class LossOnTape {
 public:
  LossOnTape(const Rollouts& rollouts, const std::vector<int>& which,
             const LossOptions& options)
      : rollouts_(rollouts), which_(which), options_(options) {}

  // Nothing where the dynamics fail.
  std::vector<std::optional<var>> operator()(const std::vector<var>& thetas,
                                             RolloutSums* sums) const {
    const int n = rollouts_.num_parameters();
    std::vector<std::optional<var>> losses = options_.way == GradientWay::kTape
                                                 ? ByTape(thetas)
                                                 : ByNodes(thetas, sums);
    const double samples = rollouts_.Samples(which_);
    for (size_t p = 0; p < losses.size(); ++p) {
      if (!losses[p]) continue;
      losses[p] = (*losses[p] + rollouts_.Prior(&thetas[p * n])) / samples;
    }
    return losses;
  }

 private:
  // One node for each point: Stan's precomputed gradients, (9.7).
  std::vector<std::optional<var>> ByNodes(const std::vector<var>& thetas,
                                          RolloutSums* sums) const {
    const int n = rollouts_.num_parameters();
    const int points = static_cast<int>(thetas.size()) / n;
    RowMatrixXd values(points, n);
    for (int at = 0; at < points * n; ++at) {
      values.data()[at] = thetas[at].val();
    }
    sums->Evaluate(rollouts_, which_, options_.huber, options_.threads, values);
    std::vector<std::optional<var>> nodes(points);
    std::vector<var> theta(n);
    std::vector<double> gradient(n);
    for (int p = 0; p < points; ++p) {
      if (!std::isfinite(sums->values()[p])) continue;
      std::copy_n(&thetas[p * n], n, theta.begin());
      std::copy_n(sums->gradients().row(p).data(), n, gradient.begin());
      nodes[p] =
          stan::math::precomputed_gradients(sums->values()[p], theta, gradient);
    }
    return nodes;
  }

  std::vector<std::optional<var>> ByTape(const std::vector<var>& thetas) const {
    const int n = rollouts_.num_parameters();
    std::vector<std::optional<var>> totals(thetas.size() / n);
    for (size_t p = 0; p < totals.size(); ++p) {
      var sum(0.0);
      bool ok = true;
      for (const int i : which_) {
        std::vector<var> errors(rollouts_.num_errors(i));
        ok = ok && RollOutOnTape(rollouts_.functor(i), rollouts_.first_state(i),
                                 &thetas[p * n], errors.data());
        if (ok) Add(i, errors, &sum);
      }
      if (ok && std::isfinite(sum.val())) totals[p] = sum;
    }
    return totals;
  }

  void Add(int rollout, const std::vector<var>& errors, var* sum) const {
    for (const Rollouts::Group& group : rollouts_.groups(rollout)) {
      var s(0.0);
      for (int k = 0; k < group.size; ++k) {
        const var e = group.weight * errors[group.first + k];
        s += e * e;
      }
      *sum += HuberLoss(s, options_.huber);
    }
  }

  const Rollouts& rollouts_;
  const std::vector<int>& which_;
  const LossOptions& options_;
};

// The mean of L(T(v)) over the rows of v whose dynamics do not fail, and its
// derivatives by all v. False where all fail.
bool MeanLossGradient(const Rollouts& rollouts, const std::vector<int>& which,
                      const Transformation& transformation,
                      const LossOptions& options, const RowMatrixXd& v,
                      double* loss, int* failed, Eigen::ArrayXXd* gradient,
                      RolloutSums* sums) {
  const int n = static_cast<int>(v.cols());
  const Tape tape;
  const std::vector<var> unknown(v.data(), v.data() + v.size());
  std::vector<var> thetas(unknown.size());
  for (Eigen::Index p = 0; p < v.rows(); ++p) {
    transformation.Theta<var>(&unknown[p * n], &thetas[p * n]);
  }
  RolloutSums own;
  const std::vector<std::optional<var>> losses = LossOnTape(
      rollouts, which, options)(thetas, sums != nullptr ? sums : &own);
  var sum(0.0);
  int count = 0;
  for (const auto& one : losses) {
    if (!one) continue;
    sum += *one;
    ++count;
  }
  *failed = static_cast<int>(v.rows()) - count;
  if (count == 0) return false;
  const var mean = sum / double(count);
  *loss = mean.val();
  stan::math::grad(mean.vi_);
  gradient->setZero(v.rows(), n);
  for (Eigen::Index p = 0; p < v.rows(); ++p) {
    // Operations that overflowed say that 0 times infinity is NaN.
    if (!losses[p]) continue;
    for (int i = 0; i < n; ++i) (*gradient)(p, i) = unknown[p * n + i].adj();
  }
  return std::isfinite(*loss) && gradient->allFinite();
}

}  // namespace

bool HaveStanMath() { return true; }

bool LossGradient(const Rollouts& rollouts, const std::vector<int>& which,
                  const Transformation& transformation,
                  const LossOptions& options, const Eigen::VectorXd& v,
                  double* loss, Eigen::VectorXd* gradient, RolloutSums* sums) {
  int failed = 0;
  Eigen::ArrayXXd by_v;
  const bool ok = MeanLossGradient(rollouts, which, transformation, options,
                                   v.transpose(), loss, &failed, &by_v, sums);
  if (ok) *gradient = by_v.row(0).matrix();
  return ok;
}

bool MixtureLossGradient(const Rollouts& rollouts,
                         const std::vector<int>& which,
                         const Transformation& transformation,
                         const LossOptions& options, const SoftDraws& draws,
                         double* loss, int* failed, Eigen::VectorXd* gradient,
                         RolloutSums* sums) {
  Eigen::ArrayXXd by_v;
  if (!MeanLossGradient(rollouts, which, transformation, options, draws.v(),
                        loss, failed, &by_v, sums)) {
    return false;
  }
  *gradient = draws.Gradient(by_v);
  return gradient->allFinite();
}

TapeUse LastTapeUse() { return Tape::Use(); }

}  // namespace sysid
