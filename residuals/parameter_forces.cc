#include "residuals/parameter_forces.h"

#include <algorithm>

#include "models/internal_state.h"
#include "residuals/acting_inputs.h"
#include "residuals/segment-impl.h"

namespace sysid {
namespace {

constexpr int kWidth = 8;  // of the Jets

// What is unbalanced along a segment, for one theta after the other.
template <typename T>
class Balance {
 public:
  Balance(const Model& model, const ParameterMap& map,
          const SegmentRollout& rollout, const SegmentTangent& tangent)
      : model_(model),
        map_(map),
        rollout_(rollout),
        tangent_(tangent),
        ws_(model),
        force_(tangent.A.size() * model.nv()),
        x_(model.state_size()),
        qdd_(model.nv()),
        needed_(model.nv()),
        held_(model.held_size()),
        same_states_(SameStates(model, rollout.model())) {}

  void Evaluate(const T* theta) {
    map_.Apply<T>(theta, &values_);
    ws_.SetParameters(values_);
    const StateLayout& at = model_.layout();
    const Run& run = *rollout_.measurements().run;
    for (size_t i = 0; i < tangent_.A.size(); ++i) {
      const int k = rollout_.first() + static_cast<int>(i);
      SetState(tangent_.middle.row(i));
      Set(tangent_.acceleration.row(i), &qdd_);
      T* f = &force_[i * at.nv()];
      ActingInputs<T>(run, ws_, k, run.t[k], run.t[k + 1] - run.t[k],
                      held_.data());
      InverseDynamics<T>(&ws_, x_.data() + at.q(), x_.data() + at.qd(),
                         qdd_.data(), held_.data(), needed_.data());
      for (int s = 0; s < at.nv(); ++s) f[s] = held_[s] - needed_[s];
    }
    if (ws_.measurement_effects.empty() && !rollout_.needs_kinematics() &&
        (ws_.motor_sensor_effects.empty() || !rollout_.needs_motors())) {
      return;
    }
    errors_.resize(rollout_.num_residuals());
    internal::Sensors<T> sensors(rollout_, &ws_);
    for (int k = rollout_.first(); k <= rollout_.last(); ++k) {
      SetState(tangent_.states.row(k - rollout_.first()));
      sensors.Measure(k, x_.data(), errors_.data());
    }
  }

  // u - ID of each interval: nv numbers each.
  const std::vector<T>& force() const { return force_; }
  // Of the segment; empty where they do not depend on theta but by the state.
  const std::vector<T>& errors() const { return errors_; }

 private:
  template <typename Row>
  static void Set(const Row& from, std::vector<T>* to) {
    for (size_t s = 0; s < to->size(); ++s) (*to)[s] = T(from[s]);
  }
  // A state of the rollout's model, which may have fewer effects.
  template <typename Row>
  void SetState(const Row& from) {
    if (same_states_) {
      Set(from, &x_);
    } else {
      Set(AdoptState(rollout_.model(), Eigen::RowVectorXd(from).data(), model_),
          &x_);
    }
    const StateLayout& at = model_.layout();
    ws_.z = at.nz() > 0 ? x_.data() + at.z() : nullptr;
  }

  const Model& model_;
  const ParameterMap& map_;
  const SegmentRollout& rollout_;
  const SegmentTangent& tangent_;
  MechanismParameters<T> values_;
  Workspace<T> ws_;
  std::vector<T> force_, errors_, x_, qdd_, needed_, held_;
  bool same_states_;
};

}  // namespace

ParameterForces ParameterForces::Zero(const SegmentRollout& rollout,
                                      int columns) {
  ParameterForces zero;
  zero.f.assign(rollout.last() - rollout.first(),
                RowMatrixXd::Zero(rollout.model().nv(), columns));
  zero.direct.setZero(rollout.num_residuals(), columns);
  return zero;
}

ParameterForces ForcesOfParameters(const Model& model, const ParameterMap& map,
                                   const Eigen::VectorXd& theta,
                                   const SegmentRollout& rollout,
                                   const SegmentTangent& tangent) {
  const int nv = model.nv();
  ParameterForces out = ParameterForces::Zero(rollout, map.size());
  Balance<Jet8> balance(model, map, rollout, tangent);
  std::vector<Jet8> seeded(theta.begin(), theta.end());
  for (int begin = 0; begin < map.size(); begin += kWidth) {
    const int count = std::min(kWidth, map.size() - begin);
    for (int c = 0; c < count; ++c) {
      seeded[begin + c] = Jet8(theta[begin + c], c);
    }
    balance.Evaluate(seeded.data());
    for (int c = 0; c < count; ++c) {
      seeded[begin + c] = Jet8(theta[begin + c]);
    }
    for (size_t i = 0; i < out.f.size(); ++i) {
      for (int s = 0; s < nv; ++s) {
        for (int c = 0; c < count; ++c) {
          out.f[i](s, begin + c) = balance.force()[i * nv + s].v[c];
        }
      }
    }
    for (size_t e = 0; e < balance.errors().size(); ++e) {
      for (int c = 0; c < count; ++c) {
        out.direct(e, begin + c) = balance.errors()[e].v[c];
      }
    }
  }
  return out;
}

ParameterForces DifferenceOfForces(const Model& model, const ParameterMap& map,
                                   const Eigen::VectorXd& theta,
                                   const Eigen::VectorXd& to,
                                   const SegmentRollout& rollout,
                                   const SegmentTangent& tangent) {
  const int nv = model.nv();
  Balance<double> at(model, map, rollout, tangent);
  Balance<double> by(model, map, rollout, tangent);
  at.Evaluate(theta.data());
  by.Evaluate(to.data());
  ParameterForces change = ParameterForces::Zero(rollout, 1);
  for (size_t i = 0; i < change.f.size(); ++i) {
    for (int s = 0; s < nv; ++s) {
      change.f[i](s, 0) = by.force()[i * nv + s] - at.force()[i * nv + s];
    }
  }
  for (size_t e = 0; e < by.errors().size(); ++e) {
    change.direct(e, 0) = by.errors()[e] - at.errors()[e];
  }
  return change;
}

}  // namespace sysid
