#include "models/joint_part.h"

#include "models/motion-impl.h"
#include "models/pairs-impl.h"
#include "models/scalars.h"

namespace sysid {

template <typename T>
void JointPart(Workspace<T>* ws, const T* q, const T* qd, const T* qdd,
               const T* held, T* tau) {
  for (T& effort : ws->tau) effort = T(0.0);
  internal::AddEffectEfforts<T>(ws, q, qd, held, ws->tau.data());
  const std::vector<Body>& bodies = ws->model().bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    const int first = bodies[i].v_index;
    for (int v = first; v < first + VelocitySize(bodies[i]); ++v) {
      tau[v] = ws->bodies[i].armature * qdd[v] - ws->tau[v];
    }
  }
  internal::AddPairs<T>(*ws, qd, qdd, tau);
}

template <typename T>
bool OnlyJointPartVaries(const Workspace<T>& ws) {
  if (!ws.model().followers().empty() || !ws.link_force_effects.empty() ||
      !ws.measurement_effects.empty() || !ws.motor_sensor_effects.empty() ||
      !ws.gravity_effects.empty()) {
    return false;
  }
  if constexpr (!std::is_same_v<T, double>) {
    const auto constant = [](const auto& values) {
      for (const T& value : values.reshaped()) {
        if (!value.v.isZero(0.0)) return false;
      }
      return true;
    };
    if (!constant(ws.gravity)) return false;
    for (const BodyData<T>& b : ws.bodies) {
      if (!b.mass.v.isZero(0.0) || !constant(b.h_B) || !constant(b.I_B) ||
          !constant(b.p_PB)) {
        return false;
      }
    }
  }
  return true;
}

#define SYSID_INSTANTIATE(T)                                              \
  template void JointPart<T>(Workspace<T>*, const T*, const T*, const T*, \
                             const T*, T*);                               \
  template bool OnlyJointPartVaries<T>(const Workspace<T>&);
SYSID_FOR_EACH_SCALAR(SYSID_INSTANTIATE)
#undef SYSID_INSTANTIATE

}  // namespace sysid
