#include "residuals/parameter_forces.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "models/joint_part.h"
#include "residuals/acting_inputs.h"
#include "residuals/carried_states.h"
#include "residuals/segment-impl.h"

namespace sysid {
namespace internal {

// What of a model its parameters change.
struct Reach {
  bool bodies = false;        // their forces
  bool joints = false;        // efforts and inertias of joints
  bool measurements = false;  // by other ways than the state
};

// What is unbalanced along segments, for one theta.
template <typename T>
class Balance {
 public:
  // Where no body's forces change, they are left out of what is unbalanced: it
  // is to be compared.
  Balance(const Model& model, const ParameterMap& map, const T* theta,
          const Reach& reach)
      : model_(model),
        reach_(reach),
        ws_(model),
        x_(model.state_size()),
        middle_(model.state_size()),
        next_(model.state_size()),
        qdd_(model.nv()),
        needed_(model.nv()),
        held_(model.held_size()) {
    MechanismParameters<T> values;
    map.Apply<T>(theta, &values);
    ws_.SetParameters(values);
  }

  void Evaluate(const SegmentRollout& rollout, const SegmentTangent& tangent) {
    const bool act = reach_.bodies || reach_.joints;
    force_.resize(act ? tangent.A.size() * model_.nv() : 0);
    errors_.clear();
    std::optional<Sensors<T>> sensors;
    if (ws_.sensors_read_rates ||
        (reach_.measurements &&
         (!ws_.measurement_effects.empty() || rollout.needs_kinematics() ||
          (!ws_.motor_sensor_effects.empty() && rollout.needs_motors())))) {
      errors_.resize(rollout.num_residuals());
      sensors.emplace(rollout, &ws_);
    }
    const Run& run = *rollout.measurements().run;
    if (!carried_) carried_.emplace(rollout.model(), &ws_);
    CarriedStates<T>& carried = *carried_;
    carried.Start(tangent.states.row(0).data(), x_.data());
    for (size_t i = 0; i < tangent.A.size(); ++i) {
      const int k = rollout.first() + static_cast<int>(i);
      const double span = run.t[k + 1] - run.t[k];
      if (sensors) Measure(k, &*sensors);
      ActingInputs<T>(run, ws_, k, run.t[k], span, held_.data());
      carried.Carry(x_.data(), tangent.middle.row(i).data(),
                    tangent.states.row(i + 1).data(), span, held_.data(),
                    middle_.data(), next_.data());
      if (act) {
        SetUnbalanced(tangent.acceleration.row(i).data(),
                      &force_[i * model_.nv()]);
      }
      x_.swap(next_);
    }
    if (sensors) Measure(rollout.last(), &*sensors);
  }

  // u - ID of each interval: nv numbers each; empty where it does not depend
  // on theta.
  const std::vector<T>& force() const { return force_; }
  // Of the segment; empty where they do not depend on theta but by the state.
  const std::vector<T>& errors() const { return errors_; }

 private:
  void UseStates(const std::vector<T>& x) {
    const StateLayout& at = model_.layout();
    ws_.z = at.nz() > 0 ? x.data() + at.z() : nullptr;
  }
  void Measure(int k, Sensors<T>* sensors) {
    UseStates(x_);
    sensors->Measure(k, x_.data(), errors_.data());
  }
  void SetUnbalanced(const double* acceleration, T* f) {
    const StateLayout& at = model_.layout();
    for (int s = 0; s < at.nv(); ++s) qdd_[s] = T(acceleration[s]);
    UseStates(middle_);
    const T *q = middle_.data() + at.q(), *qd = middle_.data() + at.qd();
    if (reach_.bodies) {
      InverseDynamics<T>(&ws_, q, qd, qdd_.data(), held_.data(),
                         needed_.data());
    } else {
      JointPart<T>(&ws_, q, qd, qdd_.data(), held_.data(), needed_.data());
    }
    for (int s = 0; s < at.nv(); ++s) f[s] = held_[s] - needed_[s];
  }

  const Model& model_;
  const Reach reach_;
  Workspace<T> ws_;
  std::optional<CarriedStates<T>> carried_;
  // States at a sample, halfway to the next, and there.
  std::vector<T> x_, middle_, next_;
  std::vector<T> force_, errors_, qdd_, needed_, held_;
};

}  // namespace internal

namespace {

using internal::Balance;
using internal::Reach;

constexpr int kWidth = 8;  // of the Jets

Reach ReachOf(const Model& model, const ParameterMap& map) {
  constexpr unsigned kMeasures = kMeasurementHook | kRatesHook;
  Reach reach;
  const EffectSet& effects = model.effects();
  for (const Parameter& parameter : map.parameters()) {
    if (parameter.kind != ParameterKind::kEffect) {
      reach.bodies = reach.measurements = true;
      continue;
    }
    for (int i = 0; i < effects.size(); ++i) {
      const std::vector<EffectParameter>& own = effects.effect(i).parameters();
      if (std::none_of(own.begin(), own.end(), [&](const EffectParameter& p) {
            return p.name == parameter.name;
          })) {
        continue;
      }
      const unsigned hooks = effects.effect(i).hooks();
      reach.bodies |= (hooks & (kGravityHook | kLinkForceHook)) != 0;
      reach.joints |= (hooks & ~kMeasures) != 0;
      reach.measurements |= (hooks & (kMeasures | kMotorHook)) != 0;
    }
  }
  // The efforts of joints that follow others are projected with the rest.
  reach.bodies |= reach.joints && !model.followers().empty();
  return reach;
}

// Writes force(i, s) of all intervals and error(e) of all rows into a column:
// those of one joint and its sensors, or of all (-1).
template <typename Force, typename Error>
void WriteColumn(const SegmentRollout& rollout, int joint, bool act,
                 bool measure, const Force& force, const Error& error,
                 int column, ParameterForces* out) {
  const int v =
      joint < 0 ? -1 : rollout.model().mechanism().joints[joint].v_index;
  const int from = std::max(0, v);
  const int to = v < 0 ? rollout.model().nv() : v + 1;
  for (size_t i = 0; act && i < out->f.size(); ++i) {
    for (int s = from; s < to; ++s) out->f[i](s, column) = force(i, s);
  }
  if (!measure) return;
  const std::vector<Channel>& channels = rollout.measurements().run->channels;
  for (const SegmentRow& row : rollout.rows()) {
    const Channel& channel = channels[row.channel];
    if (joint >= 0 && (channel.target != joint ||
                       channel.kind == ChannelKind::kFramePosition)) {
      continue;
    }
    for (int e = row.first; e < row.first + row.size; ++e) {
      out->direct(e, column) = error(e);
    }
  }
}

// Of each parameter the lane of a Jet, if there were enough: those that change
// different joints alone share one.
std::vector<int> AssignLanes(const std::vector<int>& alone) {
  std::vector<int> lanes(alone.size()), next;
  int most = 0;
  for (size_t c = 0; c < alone.size(); ++c) {
    if (alone[c] < 0) continue;
    next.resize(std::max<size_t>(next.size(), alone[c] + 1));
    lanes[c] = next[alone[c]]++;
    most = std::max(most, lanes[c] + 1);
  }
  for (size_t c = 0; c < alone.size(); ++c) {
    if (alone[c] < 0) lanes[c] = most++;
  }
  return lanes;
}

}  // namespace

ParameterForces ParameterForces::Zero(const SegmentRollout& rollout,
                                      int columns) {
  ParameterForces zero;
  zero.f.assign(rollout.last() - rollout.first(),
                RowMatrixXd::Zero(rollout.model().nv(), columns));
  zero.direct.setZero(rollout.num_residuals(), columns);
  return zero;
}

ForceDerivatives::ForceDerivatives(const Model& model, const ParameterMap& map,
                                   const Eigen::VectorXd& theta,
                                   const std::vector<int>& alone)
    : alone_(alone.empty() ? std::vector<int>(map.size(), -1) : alone),
      lanes_(AssignLanes(alone_)) {
  if (map.size() == 0) return;
  const Reach reach = ReachOf(model, map);
  const int total = *std::max_element(lanes_.begin(), lanes_.end()) + 1;
  for (int begin = 0; begin < total; begin += kWidth) {
    std::vector<Jet8> seeded(theta.begin(), theta.end());
    for (int c = 0; c < map.size(); ++c) {
      const int lane = lanes_[c] - begin;
      if (lane >= 0 && lane < kWidth) seeded[c] = Jet8(theta[c], lane);
    }
    passes_.push_back(
        std::make_unique<Balance<Jet8>>(model, map, seeded.data(), reach));
  }
}

ForceDerivatives::~ForceDerivatives() = default;

ParameterForces ForceDerivatives::Along(const SegmentRollout& rollout,
                                        const SegmentTangent& tangent) {
  const int count = static_cast<int>(lanes_.size());
  ParameterForces out = ParameterForces::Zero(rollout, count);
  std::vector<int> columns(count);
  std::iota(columns.begin(), columns.end(), 0);
  Write(rollout, tangent, columns, &out);
  return out;
}

void ForceDerivatives::Write(const SegmentRollout& rollout,
                             const SegmentTangent& tangent,
                             const std::vector<int>& columns,
                             ParameterForces* out) {
  const int nv = rollout.model().nv();
  for (const auto& pass : passes_) pass->Evaluate(rollout, tangent);
  for (size_t c = 0; c < lanes_.size(); ++c) {
    const Balance<Jet8>& pass = *passes_[lanes_[c] / kWidth];
    const int lane = lanes_[c] % kWidth;
    WriteColumn(
        rollout, alone_[c], !pass.force().empty(), !pass.errors().empty(),
        [&](size_t i, int s) { return pass.force()[i * nv + s].v[lane]; },
        [&](int e) { return pass.errors()[e].v[lane]; }, columns[c], out);
  }
}

ForceDifference::ForceDifference(const Model& plain, const Model& model,
                                 const ParameterMap& map,
                                 const Eigen::VectorXd& to)
    : nothing_(plain, {}) {
  const Reach reach = ReachOf(model, map);
  plain_ = std::make_unique<Balance<double>>(plain, nothing_, nullptr, reach);
  with_ = std::make_unique<Balance<double>>(model, map, to.data(), reach);
}

ForceDifference::~ForceDifference() = default;

ParameterForces ForceDifference::Along(const SegmentRollout& rollout,
                                       const SegmentTangent& tangent) {
  ParameterForces out = ParameterForces::Zero(rollout, 1);
  Write(rollout, tangent, {-1}, {0}, Eigen::VectorXd::Ones(1), &out);
  return out;
}

void ForceDifference::Write(const SegmentRollout& rollout,
                            const SegmentTangent& tangent,
                            const std::vector<int>& alone,
                            const std::vector<int>& columns,
                            const Eigen::VectorXd& per, ParameterForces* out) {
  const int nv = rollout.model().nv();
  plain_->Evaluate(rollout, tangent);
  with_->Evaluate(rollout, tangent);
  const std::vector<double>& force = with_->force();
  const std::vector<double>& errors = with_->errors();
  for (size_t c = 0; c < columns.size(); ++c) {
    WriteColumn(
        rollout, alone[c], !force.empty(), !errors.empty(),
        [&](size_t i, int s) {
          return (force[i * nv + s] - plain_->force()[i * nv + s]) / per[c];
        },
        [&](int e) {
          const double plain =
              plain_->errors().empty() ? tangent.r[e] : plain_->errors()[e];
          return (errors[e] - plain) / per[c];
        },
        columns[c], out);
  }
}

}  // namespace sysid
