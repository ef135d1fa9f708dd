#include "residuals/structured_walk.h"

#include <algorithm>

namespace sysid {
namespace internal {
namespace {

using Eigen::Vector3d;

bool MovesHeld(const EffectSet& effects, const ParameterColumns& theta) {
  for (int i = 0; i < effects.size(); ++i) {
    const Effect& effect = effects.effect(i);
    if (!(effect.hooks() & kActingHooks)) continue;
    for (size_t k = 0; k < effect.parameters().size(); ++k) {
      if (theta.effects[effects.offset(i) + k].moves) return true;
    }
  }
  return false;
}

int CountColumns(const Model& model, const ParameterMap& map,
                 const ColumnLayout& layout) {
  return (layout.state ? model.tangent_size() : 0) +
         (layout.theta ? map.size() : 0) + (layout.efforts ? model.nv() : 0);
}

}  // namespace

ColumnBlock::ColumnBlock(const Model& model, const ParameterMap& map,
                         const ColumnLayout& layout, int first)
    : model_(model),
      map_(map),
      layout_(layout),
      first_(first),
      count_(std::min(kLanes, CountColumns(model, map, layout) - first)),
      ws_(model),
      columns_(model, ParameterColumns(model)),
      theta_(map.size()),
      x_(model.state_size()),
      held_(model.held_size()) {}

void ColumnBlock::SetTheta(const double* theta) {
  const int begin = layout_.state ? model_.tangent_size() : 0;
  for (int i = 0; i < map_.size(); ++i) {
    theta_[i] = layout_.theta ? JetOf(theta[i], UnitLanes(begin + i - first_))
                              : Jet8(theta[i]);
  }
  MechanismParameters<Jet8> values;
  map_.Apply<Jet8>(theta_.data(), &values);
  ws_.SetParameters(values);
  columns_.theta = ParameterColumns(ws_);
  moves_held_ = MovesHeld(model_.effects(), columns_.theta);
}

void ColumnBlock::Start(const SegmentRollout& rollout) {
  sensors_.emplace(rollout, &ws_);
  errors_.resize(rollout.num_residuals());
}

void ColumnBlock::SeedState(const double* x) {
  const StateLayout& at = model_.layout();
  const int efforts = CountColumns(model_, map_, layout_) - at.nv();
  std::fill(columns_.dheld.begin(), columns_.dheld.end(), ZeroLanes());
  for (int i = 0; i < at.nv(); ++i) {
    columns_.dq[i] = columns_.dqd[i] = ZeroLanes();
    if (layout_.state) {
      columns_.dq[i] = UnitLanes(at.dq() + i - first_);
      columns_.dqd[i] = UnitLanes(at.dqd() + i - first_);
    }
    if (layout_.efforts) columns_.dheld[i] = UnitLanes(efforts + i - first_);
  }
  for (int i = 0; i < at.nz(); ++i) {
    columns_.dz[i] =
        layout_.state ? UnitLanes(at.dz() + i - first_) : ZeroLanes();
  }
  for (const Body& body : model_.bodies()) {
    if (body.type != JointType::kSpherical) continue;
    const int v = body.v_index;
    const Vector3d w = Eigen::Map<const Vector3d>(x + at.qd(body));
    Store3(Load3(&columns_.dqd[v]) + Cross(w, Load3(&columns_.dq[v])),
           &columns_.dqd[v]);
  }
  columns_.held_moves = layout_.efforts || moves_held_;
}

void ColumnBlock::SetHeld(const Run& run, int sample, double t, double h) {
  if (!moves_held_) return;
  ActingInputs<Jet8>(run, ws_, sample, t, h, held_.data());
  for (size_t i = 0; i < held_.size(); ++i) {
    columns_.dheld[i] = LanesOf(held_[i]);
  }
}

void ColumnBlock::Measure(int k, const double* x) {
  const StateLayout& at = model_.layout();
  for (const Body& body : model_.bodies()) {
    const double* q = x + at.q(body);
    Jet8* out = x_.data() + at.q(body);
    const Lanes* dq = &columns_.dq[body.v_index];
    if (body.type == JointType::kSpherical) {
      // q (dq / 2, 0).
      const Vector3d v = 0.5 * Eigen::Map<const Vector3d>(q);
      const Lanes3 d = Load3(dq);
      const Lanes3 dv = d * (0.5 * q[3]) + Cross(v, d);
      out[0] = JetOf(q[0], dv.x);
      out[1] = JetOf(q[1], dv.y);
      out[2] = JetOf(q[2], dv.z);
      out[3] = JetOf(q[3], -Dot(v, d));
    } else {
      out[0] = JetOf(q[0], dq[0]);
    }
  }
  for (int i = 0; i < at.nv(); ++i) {
    x_[at.qd() + i] = JetOf(x[at.qd() + i], columns_.dqd[i]);
  }
  for (int i = 0; i < at.nz(); ++i) {
    x_[at.z() + i] = JetOf(x[at.z() + i], columns_.dz[i]);
  }
  sensors_->Measure(k, x_.data(), errors_.data());
}

void ColumnBlock::ReadError(int e, RowMatrixXd* J) const {
  for (int c = 0; c < count_; ++c) (*J)(e, first_ + c) = errors_[e].v[c];
}

void ColumnBlock::ReadState(const double* x, RowMatrixXd* J) const {
  const StateLayout& at = model_.layout();
  for (const Body& body : model_.bodies()) {
    Lanes dqd[3];
    const int v = body.v_index, size = VelocitySize(body);
    for (int i = 0; i < size; ++i) dqd[i] = columns_.dqd[v + i];
    if (body.type == JointType::kSpherical) {
      const Vector3d w = Eigen::Map<const Vector3d>(x + at.qd(body));
      Store3(Load3(dqd) - Cross(w, Load3(&columns_.dq[v])), dqd);
    }
    for (int i = 0; i < size; ++i) {
      double by_q[kLanes], by_qd[kLanes];
      StoreLanes(columns_.dq[v + i], by_q);
      StoreLanes(dqd[i], by_qd);
      for (int c = 0; c < count_; ++c) {
        (*J)(at.dq(body) + i, first_ + c) = by_q[c];
        (*J)(at.dqd(body) + i, first_ + c) = by_qd[c];
      }
    }
  }
  for (int i = 0; i < at.nz(); ++i) {
    double by_z[kLanes];
    StoreLanes(columns_.dz[i], by_z);
    for (int c = 0; c < count_; ++c) (*J)(at.dz() + i, first_ + c) = by_z[c];
  }
}

StructuredWalk::StructuredWalk(const Model& model, const ParameterMap& map,
                               Integrator integrator,
                               const ColumnLayout& layout)
    : map_(map),
      ws_(model),
      stepper_(integrator, &ws_),
      held_(model.held_size()) {
  // At least one, which also says the errors. Sensors point into their block,
  // so it must stay where it is.
  const int columns = CountColumns(model, map, layout);
  const int count = std::max(1, (columns + kLanes - 1) / kLanes);
  blocks_.reserve(count);
  for (int i = 0; i < count; ++i) {
    blocks_.emplace_back(model, map, layout, i * kLanes);
  }
  for (ColumnBlock& block : blocks_) columns_.push_back(&block.columns());
}

void StructuredWalk::SetTheta(const double* theta) {
  MechanismParameters<double> values;
  map_.Apply<double>(theta, &values);
  ws_.SetParameters(values);
  for (ColumnBlock& block : blocks_) block.SetTheta(theta);
}

void StructuredWalk::Start(const SegmentRollout& rollout) {
  rollout_ = &rollout;
  for (ColumnBlock& block : blocks_) block.Start(rollout);
}

void StructuredWalk::SeedState(const double* x) {
  for (ColumnBlock& block : blocks_) block.SeedState(x);
}

void StructuredWalk::Measure(int k, const double* x) {
  for (ColumnBlock& block : blocks_) block.Measure(k, x);
}

bool StructuredWalk::Advance(int k, double* x, double* middle) {
  const Run& run = *rollout_->measurements().run;
  const int steps = rollout_->StepsAfter(k);
  const double span = run.t[k + 1] - run.t[k], h = span / steps;
  for (int s = 0; s < steps; ++s) {
    const double t = run.t[k] + span * s / steps;
    ActingInputs<double>(run, ws_, k, t, h, held_.data());
    for (ColumnBlock& block : blocks_) block.SetHeld(run, k, t, h);
    if (!stepper_.Step(h, held_.data(), x, columns_)) return false;
    if (middle != nullptr && 2 * (s + 1) == steps) {
      std::copy_n(x, ws_.model().state_size(), middle);
    }
  }
  return true;
}

void StructuredWalk::ReadErrors(double* errors, RowMatrixXd* J) const {
  for (int e = 0; e < static_cast<int>(J->rows()); ++e) {
    errors[e] = blocks_.front().Error(e);
    for (const ColumnBlock& block : blocks_) block.ReadError(e, J);
  }
}

void StructuredWalk::ReadState(const double* x, RowMatrixXd* J) const {
  for (const ColumnBlock& block : blocks_) block.ReadState(x, J);
}

}  // namespace internal

struct SegmentScratch::Kept {
  internal::StructuredWalk walk;
  const Model* model;
  const ParameterMap* map;
  Integrator integrator;
  internal::ColumnLayout columns;
  std::vector<double> theta;
};

SegmentScratch::SegmentScratch() = default;
SegmentScratch::~SegmentScratch() = default;
SegmentScratch::SegmentScratch(SegmentScratch&&) noexcept = default;
SegmentScratch& SegmentScratch::operator=(SegmentScratch&&) noexcept = default;

bool SegmentRollout::LinearizeStructured(const double* x0, const double* theta,
                                         bool by_state, bool by_theta,
                                         double* errors, double* x_end,
                                         RowMatrixXd* J, RowMatrixXd* J_end,
                                         SegmentScratch* scratch) const {
  const internal::ColumnLayout columns{by_state, by_theta, false};
  std::unique_ptr<SegmentScratch::Kept>& kept = scratch->kept_;
  if (kept == nullptr || kept->model != model_ || kept->map != parameters_ ||
      kept->integrator != options_.integrator || kept->columns != columns) {
    kept.reset(new SegmentScratch::Kept{
        {*model_, *parameters_, options_.integrator, columns},
        model_,
        parameters_,
        options_.integrator,
        columns,
        {}});
    kept->walk.SetTheta(theta);
    kept->theta.assign(theta, theta + parameters_->size());
  } else if (!std::equal(kept->theta.begin(), kept->theta.end(), theta)) {
    kept->walk.SetTheta(theta);
    kept->theta.assign(theta, theta + parameters_->size());
  }
  internal::StructuredWalk& walk = kept->walk;
  walk.Start(*this);
  walk.SeedState(x0);
  std::copy(x0, x0 + model_->state_size(), x_end);
  for (int k = first_;; ++k) {
    walk.Measure(k, x_end);
    if (k == last_) break;
    if (!walk.Advance(k, x_end)) return false;
  }
  walk.ReadErrors(errors, J);
  walk.ReadState(x_end, J_end);
  return true;
}

}  // namespace sysid
