#include "tests/support/tape_gradient.h"

// Stan first: its traits must be known before the templates are instantiated.
#include <cmath>
#include <map>
#include <memory>
#include <stan/math/rev/core.hpp>
#include <stan/math/rev/mat/fun/Eigen_NumTraits.hpp>
#include <stan/math/rev/scal.hpp>
#include <typeindex>
#include <vector>

#include "glog/logging.h"
#include "models/effects/shipped_effects.h"

// What the physics ask of a scalar that is not in models/scalars.h, found by
// argument-dependent lookup (docs/decisions/0008-tape-scalar.md).
namespace stan {
namespace math {
inline double ValueOf(const var& x) { return x.val(); }
}  // namespace math
}  // namespace stan

namespace sysid {

using stan::math::var;

// The hooks of an effect, which its class does not hold for this scalar. They
// refer to an effect by its address, so they are right for whatever effect of
// that class is there.
const EffectHooks<var>& HooksFor(const Effect& effect, ScalarTag<var>) {
  using Key = std::pair<const Effect*, std::type_index>;
  static thread_local std::map<Key, std::unique_ptr<EffectHooks<var>>> known;
  auto& hooks = known[{&effect, typeid(effect)}];
  if (hooks == nullptr) {
    const auto try_class = [&]<class E>(const E*) {
      using Forward = typename EffectOf<E>::template Forward<var>;
      if (const auto* is = dynamic_cast<const E*>(&effect)) {
        hooks = std::make_unique<Forward>(*is);
      }
    };
    [&]<class... Effects>(EffectList<Effects...>) {
      (try_class(static_cast<const Effects*>(nullptr)), ...);
    }(ShippedEffects());
    CHECK(hooks != nullptr) << "the tape does not know " << effect.name();
  }
  return *hooks;
}

}  // namespace sysid

#include "models/dynamics-impl.h"
#include "models/parameters-impl.h"
#include "models/stepper-impl.h"
#include "residuals/segment-impl.h"

namespace sysid {
namespace {

// The sum in (9.1) over a rollout; false where the dynamics fail.
bool AddErrors(const Rollouts& rollouts, int i, const var* theta, double huber,
               var* sum) {
  const SegmentRollout rollout = rollouts.functor(i);
  const double* const x0 = rollouts.first_state(i);
  const std::vector<var> start(x0, x0 + rollout.model().state_size());
  std::vector<var> end(start.size()), errors(rollouts.num_errors(i));
  if (!rollout(start.data(), theta, errors.data(), end.data())) return false;
  for (const Rollouts::Group& group : rollouts.groups(i)) {
    var s(0.0);
    for (int k = 0; k < group.size; ++k) {
      const var e = group.weight * errors[group.first + k];
      s += e * e;
    }
    *sum += HuberLoss(s, huber);
  }
  return true;
}

}  // namespace

bool LossGradientByTape(const Rollouts& rollouts,
                        const Transformation& transformation, double huber,
                        const Eigen::VectorXd& v, double* loss,
                        Eigen::VectorXd* gradient, std::size_t* bytes) {
  // RStan's headers have a tape for each thread, but make the main thread's
  // only.
  using stan::math::ChainableStack;
  static thread_local const ChainableStack of_this_thread;
  stan::math::start_nested();
  const std::vector<var> unknown(v.data(), v.data() + v.size());
  std::vector<var> theta(v.size());
  transformation.Theta<var>(unknown.data(), theta.data());
  var sum = rollouts.Prior(theta.data());
  bool ok = true;
  for (int i = 0; ok && i < rollouts.size(); ++i) {
    ok = AddErrors(rollouts, i, theta.data(), huber, &sum);
  }
  const var mean = sum / double(rollouts.Samples(rollouts.size()));
  ok = ok && std::isfinite(mean.val());
  if (ok) {
    *loss = mean.val();
    stan::math::grad(mean.vi_);
    gradient->resize(v.size());
    for (int i = 0; i < v.size(); ++i) (*gradient)[i] = unknown[i].adj();
    ok = gradient->allFinite();
  }
  if (bytes != nullptr) {
    *bytes = ChainableStack::instance_->memalloc_.bytes_allocated();
  }
  stan::math::recover_memory_nested();
  return ok;
}

}  // namespace sysid
