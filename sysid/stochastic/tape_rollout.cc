#include "sysid/stochastic/tape_rollout.h"

// Stan first: its traits must be known before the templates are instantiated.
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
#include "models/integrator-impl.h"
#include "models/parameters-impl.h"
#include "residuals/segment-impl.h"

namespace sysid {

bool RollOutOnTape(const SegmentRollout& rollout, const double* x0,
                   const var* theta, var* errors) {
  const int size = rollout.model().state_size();
  const std::vector<var> start(x0, x0 + size);
  std::vector<var> end(size);
  return rollout(start.data(), theta, errors, end.data());
}

}  // namespace sysid
