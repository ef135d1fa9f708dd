#include "sysid/stochastic/rollout_gradient.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <stan/math/rev/core.hpp>
#include <stan/math/rev/scal.hpp>

#include "sysid/estimation/parallel.h"
#include "sysid/stochastic/tape_rollout.h"

// What SoftDraw() asks of a scalar.
namespace stan {
namespace math {
inline double ValueOf(const var& x) { return x.val(); }
}  // namespace math
}  // namespace stan

namespace sysid {
namespace {

using stan::math::ChainableStack;
using stan::math::var;
using stan::math::vari;

// The process has one tape (Stan is compiled without STAN_THREADS, which would
// need TBB linked): one gradient at a time. What is put on it is recovered.
class Tape {
 public:
  Tape() : lock_(Mutex()) { stan::math::start_nested(); }
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

  // d y / d x for all x.
  static void Gradient(const var& y, const std::vector<var>& x,
                       Eigen::VectorXd* gradient) {
    stan::math::grad(y.vi_);
    gradient->resize(x.size());
    for (size_t i = 0; i < x.size(); ++i) (*gradient)[i] = x[i].adj();
  }

 private:
  static std::mutex& Mutex() {
    static std::mutex mutex;
    return mutex;
  }
  std::lock_guard<std::mutex> lock_;
};

// What Stan's precomputed_gradients_vari is to one number, for the errors of a
// rollout: one node, its outputs beside it, J = dr/dtheta stored.
class RolloutNode final : public vari {
 public:
  // The outputs are written to `errors`.
  RolloutNode(const std::vector<double>& values, const RowMatrixXd& J,
              const std::vector<var>& theta, var* errors)
      : vari(0.0),
        rows_(J.rows()),
        columns_(J.cols()),
        theta_(Allocate<vari*>(columns_)),
        errors_(Allocate<vari*>(rows_)),
        J_(Allocate<double>(rows_ * columns_)) {
    for (Eigen::Index i = 0; i < columns_; ++i) theta_[i] = theta[i].vi_;
    for (Eigen::Index i = 0; i < rows_; ++i) {
      errors_[i] = new vari(values[i], false);
      errors[i] = var(errors_[i]);
    }
    std::copy(J.data(), J.data() + J.size(), J_);
  }

  // (9.7): adjoint(theta) += J^T adjoint(r).
  void chain() override {
    for (Eigen::Index i = 0; i < rows_; ++i) {
      const double adjoint = errors_[i]->adj_;
      if (adjoint == 0.0) continue;
      const double* row = J_ + i * columns_;
      for (Eigen::Index c = 0; c < columns_; ++c) {
        theta_[c]->adj_ += adjoint * row[c];
      }
    }
  }

 private:
  template <typename T>
  static T* Allocate(Eigen::Index count) {
    return ChainableStack::instance_->memalloc_.alloc_array<T>(count);
  }

  const Eigen::Index rows_, columns_;
  vari** theta_;
  vari** errors_;
  double* J_;
};

// (9.1) of rollouts whose errors are on the tape.
class LossOnTape {
 public:
  LossOnTape(const Rollouts& rollouts, const std::vector<int>& which,
             const LossOptions& options)
      : rollouts_(rollouts),
        which_(which),
        options_(options),
        samples_(rollouts.Samples(which)) {}

  // For each theta (on the tape) its loss; nothing where the dynamics fail.
  std::vector<std::optional<var>> operator()(
      const std::vector<std::vector<var>>& thetas) const {
    return options_.way == GradientWay::kTape ? ByTape(thetas) : ByJets(thetas);
  }

 private:
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

  std::vector<std::optional<var>> ByTape(
      const std::vector<std::vector<var>>& thetas) const {
    std::vector<std::optional<var>> losses(thetas.size());
    for (size_t t = 0; t < thetas.size(); ++t) {
      var sum = rollouts_.Prior(thetas[t].data());
      bool ok = true;
      for (const int i : which_) {
        std::vector<var> errors(rollouts_.num_errors(i));
        ok = ok && RollOutOnTape(rollouts_.functor(i), rollouts_.first_state(i),
                                 thetas[t].data(), errors.data());
        if (ok) Add(i, errors, &sum);
      }
      if (ok && std::isfinite(sum.val())) losses[t] = sum / double(samples_);
    }
    return losses;
  }

  // The Jets by all threads, then onto the tape in order.
  std::vector<std::optional<var>> ByJets(
      const std::vector<std::vector<var>>& thetas) const {
    struct Rolled {
      bool ok = false;
      std::vector<double> errors;
      RowMatrixXd J;
    };
    const int count = static_cast<int>(which_.size());
    std::vector<std::vector<double>> values(thetas.size());
    for (size_t t = 0; t < thetas.size(); ++t) {
      for (const var& x : thetas[t]) values[t].push_back(x.val());
    }
    std::vector<Rolled> rolled(thetas.size() * count);
    // Starting threads costs as much as rolling out some hundred samples.
    constexpr int kWorthThreads = 1000;
    const int samples = samples_ * static_cast<int>(thetas.size());
    const int threads = samples < kWorthThreads ? 1 : options_.threads;
    ParallelFor(static_cast<int>(rolled.size()), threads, [&](int at) {
      const int i = which_[at % count];
      rolled[at].errors.resize(rollouts_.num_errors(i));
      rolled[at].ok =
          rollouts_.Linearize(i, values[at / count].data(),
                              rolled[at].errors.data(), &rolled[at].J);
      return true;
    });
    std::vector<std::optional<var>> losses(thetas.size());
    for (size_t t = 0; t < thetas.size(); ++t) {
      const auto first = rolled.begin() + t * count;
      if (!std::all_of(first, first + count,
                       [](const Rolled& one) { return one.ok; })) {
        continue;
      }
      var sum = rollouts_.Prior(thetas[t].data());
      for (int k = 0; k < count; ++k) {
        const Rolled& one = first[k];
        std::vector<var> errors(one.errors.size());
        new RolloutNode(one.errors, one.J, thetas[t], errors.data());
        Add(which_[k], errors, &sum);
      }
      losses[t] = sum / double(samples_);
    }
    return losses;
  }

  const Rollouts& rollouts_;
  const std::vector<int>& which_;
  const LossOptions& options_;
  int samples_;
};

std::vector<var> OnTape(const Eigen::VectorXd& values) {
  return std::vector<var>(values.data(), values.data() + values.size());
}

}  // namespace

bool HaveStanMath() { return true; }

bool LossGradient(const Rollouts& rollouts, const std::vector<int>& which,
                  const Transformation& transformation,
                  const LossOptions& options, const Eigen::VectorXd& v,
                  double* loss, Eigen::VectorXd* gradient) {
  const Tape tape;
  const std::vector<var> unknown = OnTape(v);
  std::vector<var> theta(v.size());
  transformation.Theta<var>(unknown.data(), theta.data());
  const auto losses = LossOnTape(rollouts, which, options)({theta});
  if (!losses[0]) return false;
  *loss = losses[0]->val();
  Tape::Gradient(*losses[0], unknown, gradient);
  return std::isfinite(*loss) && gradient->allFinite();
}

bool MixtureLossGradient(const Rollouts& rollouts,
                         const std::vector<int>& which,
                         const Transformation& transformation,
                         const LossOptions& options,
                         const GaussianMixture& mixture, double temperature,
                         const std::vector<MixtureDraw>& draws, double* loss,
                         int* failed, Eigen::VectorXd* gradient) {
  const Tape tape;
  const int K = mixture.kernels(), n = mixture.dimension();
  const std::vector<var> unknown = OnTape(mixture.Pack());
  const var* logits = unknown.data();
  std::vector<std::vector<var>> thetas;
  for (const MixtureDraw& draw : draws) {
    std::vector<var> v(n), theta(n);
    SoftDraw<var>(K, n, logits, logits + K, logits + K + K * n, draw,
                  temperature, v.data());
    transformation.Theta<var>(v.data(), theta.data());
    thetas.push_back(std::move(theta));
  }
  var sum(0.0);
  int count = 0;
  for (const auto& one : LossOnTape(rollouts, which, options)(thetas)) {
    if (!one) continue;
    sum += *one;
    ++count;
  }
  *failed = static_cast<int>(draws.size()) - count;
  if (count == 0) return false;
  const var mean = sum / double(count);
  *loss = mean.val();
  Tape::Gradient(mean, unknown, gradient);
  return std::isfinite(*loss) && gradient->allFinite();
}

TapeUse LastTapeUse() { return Tape::Use(); }

}  // namespace sysid
