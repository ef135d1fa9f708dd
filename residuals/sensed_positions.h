#pragma once

#include <algorithm>
#include <vector>

#include "models/dry_friction.h"
#include "models/dynamics.h"
#include "models/integrator.h"
#include "models/internal_state-impl.h"
#include "residuals/acting_inputs.h"

namespace sysid {

// What the sensors of joints and of their motors say of states, by the model's
// effects: scratch of one thread.
template <typename T>
class SensedPositions {
 public:
  SensedPositions(Integrator integrator, Workspace<T>* ws)
      : smoothed_(integrator != Integrator::kRungeKutta4),
        ws_(ws),
        q_(ws->model().nq()),
        motor_q_(ws->model().nq()),
        qdd_(ws->model().nv(), T(0.0)),
        motor_qd_(ws->model().nv()),
        motor_qdd_(ws->model().nv()),
        z_rate_(ws->model().layout().nz(), T(0.0)),
        held_(ws->model().held_size()) {}

  // Of the joints in the state x at a sample of the run, nq numbers. Overwrites
  // the workspace's evaluation where a sensor sees rates. Sensors look back, so
  // what acts is what acted until the sample, and a joint that rests stays.
  const T* operator()(const Run& run, int sample, const T* x) {
    const StateLayout& at = ws_->model().layout();
    std::copy_n(x + at.q(), at.nq(), q_.begin());
    if (ws_->sensors_read_rates) {
      const int row = std::max(sample - 1, 0);
      ActingInputs<T>(run, *ws_, row, run.t[row], run.t[row + 1] - run.t[row],
                      held_.data());
      ws_->z = at.nz() > 0 ? x + at.z() : nullptr;
      // As the steps do, dry friction included.
      const auto accelerations = smoothed_ ? ForwardDynamics<T> : RestOrSlip<T>;
      // Where there are none the rollout fails there, too.
      if (!accelerations(ws_, x + at.q(), x + at.qd(), held_.data(),
                         qdd_.data())) {
        std::fill(qdd_.begin(), qdd_.end(), T(0.0));
      }
    }
    ws_->ModifyMeasurement(x + at.qd(), qdd_.data(), q_.data());
    return q_.data();
  }

  // Of the motors in the same state, right after that.
  const T* OfMotors(const T* x) {
    const StateLayout& at = ws_->model().layout();
    std::copy_n(x + at.q(), at.nq(), motor_q_.begin());
    std::copy_n(x + at.qd(), at.nv(), motor_qd_.begin());
    motor_qdd_ = qdd_;
    internal::ToMotors<T>(*ws_, x, z_rate_.data(), motor_q_.data(),
                          motor_qd_.data(), motor_qdd_.data());
    ws_->ModifyMotorMeasurement(motor_qd_.data(), motor_qdd_.data(),
                                motor_q_.data());
    return motor_q_.data();
  }

 private:
  bool smoothed_;
  Workspace<T>* ws_;
  std::vector<T> q_, motor_q_, qdd_, motor_qd_, motor_qdd_, z_rate_, held_;
};

}  // namespace sysid
