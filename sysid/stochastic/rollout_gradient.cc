#include "sysid/stochastic/rollout_gradient.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <stan/math/rev/core.hpp>
#include <stan/math/rev/scal.hpp>

namespace sysid {
namespace {

using stan::math::ChainableStack;
using stan::math::var;

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

// The sum in (9.1) at each point theta on the tape, n numbers each: one node of
// Stan's precomputed gradients, (9.7). Nothing where the dynamics fail.
std::vector<std::optional<var>> SumNodes(const Rollouts& rollouts, int count,
                                         double huber,
                                         const std::vector<var>& thetas,
                                         RolloutSums* sums) {
  const int n = rollouts.num_parameters();
  const int points = static_cast<int>(thetas.size()) / n;
  RowMatrixXd values(points, n);
  for (int at = 0; at < points * n; ++at) values.data()[at] = thetas[at].val();
  sums->Evaluate(rollouts, count, huber, values);
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

}  // namespace

bool HaveStanMath() { return true; }

bool MeanLossGradient(const Rollouts& rollouts, int count,
                      const Transformation& transformation, double huber,
                      const RowMatrixXd& points, RolloutSums* sums,
                      double* loss, int* failed, Eigen::ArrayXXd* gradient) {
  const int n = static_cast<int>(points.cols());
  const Tape tape;
  const std::vector<var> unknown(points.data(), points.data() + points.size());
  std::vector<var> thetas(unknown.size());
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    transformation.Theta<var>(&unknown[p * n], &thetas[p * n]);
  }
  const std::vector<std::optional<var>> nodes =
      SumNodes(rollouts, count, huber, thetas, sums);
  const double samples = rollouts.Samples(count);
  var sum(0.0);
  *failed = 0;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    if (nodes[p]) {
      sum += (*nodes[p] + rollouts.Prior(&thetas[p * n])) / samples;
    } else {
      ++*failed;
    }
  }
  const Eigen::Index done = points.rows() - *failed;
  if (done == 0) return false;
  const var mean = sum / double(done);
  *loss = mean.val();
  stan::math::grad(mean.vi_);
  gradient->setZero(points.rows(), n);
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    // Operations that overflowed say that 0 times infinity is NaN.
    if (!nodes[p]) continue;
    for (int i = 0; i < n; ++i) (*gradient)(p, i) = unknown[p * n + i].adj();
  }
  return std::isfinite(*loss) && gradient->allFinite();
}

TapeUse LastTapeUse() { return Tape::Use(); }

}  // namespace sysid
