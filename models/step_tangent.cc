#include "models/step_tangent.h"

#include <algorithm>
#include <cmath>

#include "models/math/rosenbrock.h"
#include "models/stepper-impl.h"

// Equation numbers: docs/theory.md.

namespace sysid {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// a 1 + b [u] + c u u^T.
Matrix3d OfAxis(double a, double b, double c, const Vector3d& u) {
  const Vector3d cu = c * u, bu = b * u;
  Matrix3d m;
  m << a + cu[0] * u[0], cu[0] * u[1] - bu[2], cu[0] * u[2] + bu[1],  //
      cu[1] * u[0] + bu[2], a + cu[1] * u[1], cu[1] * u[2] - bu[0],   //
      cu[2] * u[0] - bu[1], cu[2] * u[1] + bu[0], a + cu[2] * u[2];
  return m;
}

}  // namespace

StateColumns::StateColumns(const Model& model,
                           const ParameterColumns& parameters)
    : theta(parameters) {
  dheld.assign(model.held_size(), ZeroLanes());
  for (std::vector<Lanes>* rows : {&dq, &dqd, &stage_q, &stage_qd, &qdd, &du,
                                   &rate, &sum_u, &sum_v, &beside}) {
    rows->assign(model.nv(), ZeroLanes());
  }
  for (std::vector<Lanes>* rows : {&dz, &stage_z, &z_rate, &sum_z}) {
    rows->assign(model.layout().nz(), ZeroLanes());
  }
}

StepTangent::StepTangent(Integrator integrator, Workspace<double>* workspace)
    : ws_(workspace),
      stepper_(integrator, workspace),
      dynamics_(workspace->model()),
      moves_(workspace->model().bodies().size()) {
  const Model& model = workspace->model();
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    if (!(effect.hooks() & kMoveStateHook)) continue;
    const int child = model.mechanism().joints[effect.joint()].child_link;
    const Body& body = model.bodies()[model.placement(child).body];
    const int states = static_cast<int>(effect.states().size());
    const int parameters = static_cast<int>(effect.parameters().size());
    Way way{&HooksFor(effect, ScalarTag<Jet8>()),
            body.type,
            body.q_index,
            body.v_index,
            model.z_index(i),
            states,
            model.effects().offset(i),
            parameters,
            {},
            {},
            {},
            {}};
    way.last.resize(1 + states);
    way.start = way.last;
    way.arguments.resize(2 + states + parameters);
    way.by.assign(way.arguments.size(), Eigen::VectorXd::Zero(states));
    ways_.push_back(std::move(way));
  }
}

bool StepTangent::Step(double h, const double* held, double* x,
                       const std::vector<StateColumns*>& columns) {
  columns_ = &columns;
  return stepper_.StepWith(h, held, x, this);
}

void StepTangent::Accelerated(const double* q, const double* qd,
                              const double* qdd) {
  dynamics_.SetPoint(*ws_, q, qd, qdd);
  for (Way& way : ways_) {
    way.last[0] = q[way.q_index];
    std::copy_n(ws_->z + way.first_z, way.states, way.last.begin() + 1);
  }
}

// The derivatives of (3.6) by its arguments, eight at a time. `from_last`: the
// last evaluation was where the way starts.
void StepTangent::SetWays(bool from_last, const double* u) {
  for (Way& way : ways_) {
    if (from_last) way.start = way.last;
    const int count = static_cast<int>(way.arguments.size());
    const auto value = [&](int s) {
      if (s == 0) return way.start[0];
      if (s == 1) return u[way.v];
      if (s < 2 + way.states) return way.start[s - 1];
      return ws_->parameters().effects[way.first + s - 2 - way.states];
    };
    for (int begin = 0; begin < count; begin += kLanes) {
      for (int s = 0; s < count; ++s) {
        way.arguments[s] = JetOf(value(s), UnitLanes(s - begin));
      }
      const Jet8& from_q = way.arguments[0];
      const Jet8 to_q = from_q + way.arguments[1];
      const JointState<Jet8> from{way.type, 1, &from_q, nullptr};
      const JointState<Jet8> to{way.type, 1, &to_q, nullptr};
      std::vector<Jet8> z(way.arguments.begin() + 2,
                          way.arguments.begin() + 2 + way.states);
      way.hooks->MoveState(from, to, way.arguments.data() + 2 + way.states,
                           z.data());
      for (int s = begin; s < std::min(begin + kLanes, count); ++s) {
        for (int k = 0; k < way.states; ++k) way.by[s][k] = z[k].v[s - begin];
      }
    }
  }
}

void StepTangent::MoveStates(const StateColumns& c,
                             const std::vector<Lanes>& rate, double h,
                             const std::vector<Lanes>& du,
                             std::vector<Lanes>* out) const {
  for (size_t i = 0; i < c.dz.size(); ++i) (*out)[i] = c.dz[i] + rate[i] * h;
  for (const Way& way : ways_) {
    for (int k = 0; k < way.states; ++k) {
      Lanes d = c.dq[way.v] * way.by[0][k] + du[way.v] * way.by[1][k];
      for (int s = 0; s < way.states; ++s) {
        d += c.dz[way.first_z + s] * way.by[2 + s][k];
      }
      for (int j = 0; j < way.parameters; ++j) {
        const ParameterColumns::OfNumber& by = c.theta.effects[way.first + j];
        if (by.moves) d += by.d * way.by[2 + way.states + j][k];
      }
      (*out)[way.first_z + k] = d;
    }
  }
}

// (3.4), with [u]^2 = u u^T - |u|^2 1; Exp(u) = 1 + sin|u|/|u| [u] + b [u]^2.
void StepTangent::SetMoves(const double* u) {
  const std::vector<Body>& bodies = ws_->model().bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].type != JointType::kSpherical) continue;
    const Vector3d u_i = Eigen::Map<const Vector3d>(u + bodies[i].v_index);
    const double x = u_i.squaredNorm();
    double b, c;  // (1 - cos|u|) / |u|^2, (|u| - sin|u|) / |u|^3
    if (x < 1e-2) {
      // Next terms: |u|^12 / 12! and / 13!, below rounding for |u| < 0.1.
      b = 1.0 / 2 -
          x * (1.0 / 24 -
               x * (1.0 / 720 - x * (1.0 / 40320 - x * (1.0 / 3628800))));
      c = 1.0 / 6 -
          x * (1.0 / 120 -
               x * (1.0 / 5040 - x * (1.0 / 362880 - x * (1.0 / 39916800))));
    } else {
      const double angle = std::sqrt(x);
      b = (1.0 - std::cos(angle)) / x;
      c = (angle - std::sin(angle)) / (x * angle);
    }
    moves_[i].turn = OfAxis(1.0 - b * x, c * x - 1.0, b, u_i);
    moves_[i].J = OfAxis(1.0 - c * x, -b, c, u_i);
  }
}

// (3.5): of k = w + u x w / 2 + u x (u x w) / 12.
void StepTangent::SetRates(const double* u, const double* qd) {
  const std::vector<Body>& bodies = ws_->model().bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].type != JointType::kSpherical) continue;
    const Vector3d u_i = Eigen::Map<const Vector3d>(u + bodies[i].v_index);
    const Vector3d w = Eigen::Map<const Vector3d>(qd + bodies[i].v_index);
    moves_[i].k_qd =
        OfAxis(1.0 - u_i.squaredNorm() / 12.0, 0.5, 1.0 / 12.0, u_i);
    moves_[i].k_u =
        CentripetalByVelocity(u_i, w) * (1.0 / 12.0) - 0.5 * Skew<double>(w);
  }
}

// q Exp(u): dq -> Exp(u)^T dq + J_r(u) du.                             (3.4)
void StepTangent::Advance(const std::vector<Lanes>& dq,
                          const std::vector<Lanes>& du,
                          std::vector<Lanes>* out) const {
  const std::vector<Body>& bodies = ws_->model().bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    const int v = bodies[i].v_index;
    if (bodies[i].type == JointType::kSpherical) {
      Store3(moves_[i].turn * Load3(&dq[v]) + moves_[i].J * Load3(&du[v]),
             &(*out)[v]);
    } else {
      (*out)[v] = dq[v] + du[v];
    }
  }
}

void StepTangent::Moved(double h, const double* u) {
  SetMoves(u);
  SetWays(true, u);
  for (StateColumns* eight : *columns_) {
    StateColumns& c = *eight;
    Evaluate(true, false, &c);
    for (size_t i = 0; i < c.dqd.size(); ++i) {
      c.dqd[i] += c.qdd[i] * h;
      c.du[i] = c.dqd[i] * h;
    }
    MoveStates(c, c.z_rate, h, c.du, &c.stage_z);
    Advance(c.dq, c.du, &c.dq);
    c.dz.swap(c.stage_z);
  }
}

// (3.3), line by line, and of each line its columns.
void StepTangent::MovedStage(int stage, double h, const double* u,
                             const double* qd) {
  if (stage < 3) SetRates(u, qd);
  SetMoves(u);
  SetWays(stage == 0, u);
  for (StateColumns* eight : *columns_) {
    StageColumns(stage, h * internal::kAhead[stage],
                 h * internal::kWeight[stage], eight);
  }
}

void StepTangent::MovedBraked(int stage, double h, const double* u,
                              const double* qd) {
  if (stage == 0) SetRates(u, qd);
  SetMoves(u);
  SetWays(stage == 0, u);
  for (StateColumns* eight : *columns_) BrakedColumns(stage, h, eight);
}

bool StepTangent::Moves(int v) const {
  return std::any_of(
      columns_->begin(), columns_->end(), [&](const StateColumns* c) {
        double by[kLanes];
        StoreLanes(c->dqd[v], by);
        return std::any_of(by, by + kLanes, [](double d) { return d != 0.0; });
      });
}

// (5) of docs/dry_friction.md.
void StepTangent::Jumped(int v, const double* ratio, bool rests) {
  for (StateColumns* c : *columns_) {
    const Lanes moved = c->dqd[v];
    for (size_t i = 0; i < c->dqd.size(); ++i) c->dqd[i] += moved * ratio[i];
    if (rests) c->dqd[v] = ZeroLanes();
  }
}

// A stage's columns, and those of the state of the next stage, which is `ahead`
// seconds after the start of the step; `weight` is the stage's in the sums.
void StepTangent::StageColumns(int stage, double ahead, double weight,
                               StateColumns* columns) {
  StateColumns& c = *columns;
  const bool first = stage == 0, last = stage == 3;
  const std::vector<Lanes>& rate = first ? c.dqd : c.rate;
  Evaluate(first, false, &c);
  const int nv = ws_->model().nv();
  for (size_t i = 0; i < c.dz.size(); ++i) {
    const Lanes z = c.z_rate[i] * weight;
    c.sum_z[i] = first ? z : c.sum_z[i] + z;
  }
  for (int i = 0; i < nv; ++i) {
    const Lanes u = rate[i] * weight, v = c.qdd[i] * weight;
    c.sum_u[i] = first ? u : c.sum_u[i] + u;
    c.sum_v[i] = first ? v : c.sum_v[i] + v;
  }
  if (last) {
    End(&c);
    return;
  }
  for (int i = 0; i < nv; ++i) {
    c.du[i] = rate[i] * ahead;
    c.stage_qd[i] = c.dqd[i] + c.qdd[i] * ahead;
  }
  MoveStates(c, c.z_rate, ahead, c.du, &c.stage_z);
  Advance(c.dq, c.du, &c.stage_q);
  StageRate(&c);
}

// (3.8), line by line; D is held.
void StepTangent::BrakedColumns(int stage, double h, StateColumns* columns) {
  StateColumns& c = *columns;
  const bool first = stage == 0;
  Evaluate(first, !first, &c);
  const int nv = ws_->model().nv();
  const double gh = kRosenbrockGamma * h;
  if (!first) {
    for (size_t i = 0; i < c.dz.size(); ++i) {
      c.sum_z[i] = (c.sum_z[i] + c.z_rate[i]) * (0.5 * h);
    }
    for (int i = 0; i < nv; ++i) {
      c.sum_u[i] =
          (c.sum_u[i] + c.rate[i] + (c.qdd[i] - c.sum_v[i] * 2.0) * gh) *
          (0.5 * h);
      c.sum_v[i] = (c.sum_v[i] + c.qdd[i]) * (0.5 * h);
    }
    End(&c);
    return;
  }
  for (int i = 0; i < nv; ++i) {
    c.sum_u[i] = c.dqd[i] + c.qdd[i] * gh;
    c.sum_v[i] = c.qdd[i];
    c.beside[i] = c.qdd[i] * (2.0 * gh * stepper_.brake_[i]);
    c.du[i] = c.sum_u[i] * h;
    c.stage_qd[i] = c.dqd[i] + c.qdd[i] * h;
  }
  c.sum_z = c.z_rate;
  MoveStates(c, c.z_rate, h, c.du, &c.stage_z);
  Advance(c.dq, c.du, &c.stage_q);
  StageRate(&c);
}

void StepTangent::Evaluate(bool start, bool beside, StateColumns* columns) {
  StateColumns& c = *columns;
  const DynamicsTangent::Moved by{start ? c.dq.data() : c.stage_q.data(),
                                  start ? c.dqd.data() : c.stage_qd.data(),
                                  c.held_moves ? c.dheld.data() : nullptr,
                                  start ? c.dz.data() : c.stage_z.data(),
                                  beside ? c.beside.data() : nullptr};
  dynamics_.Columns(c.theta, by, c.qdd.data());
  if (!c.dz.empty()) dynamics_.RateColumns(c.theta, by, c.z_rate.data());
}

void StepTangent::End(StateColumns* columns) const {
  StateColumns& c = *columns;
  MoveStates(c, c.sum_z, 1.0, c.sum_u, &c.stage_z);
  c.dz.swap(c.stage_z);
  Advance(c.dq, c.sum_u, &c.dq);
  for (size_t i = 0; i < c.dqd.size(); ++i) c.dqd[i] += c.sum_v[i];
}

void StepTangent::StageRate(StateColumns* columns) const {
  StateColumns& c = *columns;
  const std::vector<Body>& bodies = ws_->model().bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    const int v = bodies[i].v_index;
    if (bodies[i].type == JointType::kSpherical) {
      Store3(moves_[i].k_qd * Load3(&c.stage_qd[v]) +
                 moves_[i].k_u * Load3(&c.du[v]),
             &c.rate[v]);
    } else {
      c.rate[v] = c.stage_qd[v];
    }
  }
}

}  // namespace sysid
