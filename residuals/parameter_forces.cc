#include "residuals/parameter_forces.h"

#include <algorithm>

#include "residuals/acting_effort.h"
#include "residuals/segment-impl.h"

namespace sysid {
namespace {

constexpr int kWidth = 8;  // of the Jets

// u - ID of each interval (nv numbers each), and the errors of the segment.
template <typename T>
struct Imbalance {
  std::vector<T> force, errors;
};

template <typename T>
Imbalance<T> Evaluate(const Model& model, const ParameterMap& map,
                      const T* theta, const SegmentRollout& rollout,
                      const SegmentTangent& tangent) {
  const int nq = model.nq(), nv = model.nv();
  const Run& run = *rollout.measurements().run;
  MechanismParameters<T> values;
  map.Apply<T>(theta, &values);
  Workspace<T> ws(model);
  ws.SetParameters(values);
  const int count = static_cast<int>(tangent.A.size());
  Imbalance<T> out;
  out.force.resize(static_cast<size_t>(count) * nv);
  std::vector<T> x(model.state_size()), qdd(nv), needed(nv);
  for (int i = 0; i < count; ++i) {
    const int k = rollout.first() + i;
    for (int s = 0; s < model.state_size(); ++s) x[s] = T(tangent.middle(i, s));
    for (int s = 0; s < nv; ++s) qdd[s] = T(tangent.acceleration(i, s));
    T* f = &out.force[static_cast<size_t>(i) * nv];
    ActingEffort<T>(run, ws, k, run.t[k], run.t[k + 1] - run.t[k], f);
    InverseDynamics<T>(&ws, x.data(), x.data() + nq, qdd.data(), needed.data());
    for (int s = 0; s < nv; ++s) f[s] -= needed[s];
  }
  if (ws.measurement_effects.empty() && !rollout.needs_kinematics()) return out;
  out.errors.resize(rollout.num_residuals());
  internal::Sensors<T> sensors(rollout, &ws);
  for (int k = rollout.first(); k <= rollout.last(); ++k) {
    for (int s = 0; s < model.state_size(); ++s) {
      x[s] = T(tangent.states(k - rollout.first(), s));
    }
    sensors.Measure(k, x.data(), out.errors.data());
  }
  return out;
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

void AddParameterForces(const Model& model, const ParameterMap& map,
                        const Eigen::VectorXd& theta,
                        const SegmentRollout& rollout,
                        const SegmentTangent& tangent, int first,
                        ParameterForces* out) {
  const int nv = model.nv();
  for (int begin = 0; begin < map.size(); begin += kWidth) {
    const int columns = std::min(kWidth, map.size() - begin);
    std::vector<Jet8> seeded(map.size());
    for (int i = 0; i < map.size(); ++i) seeded[i] = Jet8(theta[i]);
    for (int c = 0; c < columns; ++c) seeded[begin + c].v[c] = 1.0;
    const Imbalance<Jet8> by =
        Evaluate<Jet8>(model, map, seeded.data(), rollout, tangent);
    for (size_t i = 0; i < out->f.size(); ++i) {
      for (int s = 0; s < nv; ++s) {
        for (int c = 0; c < columns; ++c) {
          out->f[i](s, first + begin + c) += by.force[i * nv + s].v[c];
        }
      }
    }
    for (size_t e = 0; e < by.errors.size(); ++e) {
      for (int c = 0; c < columns; ++c) {
        out->direct(e, first + begin + c) += by.errors[e].v[c];
      }
    }
  }
}

void AddSecantForces(const Model& model, const ParameterMap& map,
                     const Eigen::VectorXd& theta, int along, double step,
                     const SegmentRollout& rollout,
                     const SegmentTangent& tangent, int column,
                     ParameterForces* out) {
  Eigen::VectorXd moved = theta;
  moved[along] += step;
  const auto at = Evaluate<double>(model, map, theta.data(), rollout, tangent);
  const auto by = Evaluate<double>(model, map, moved.data(), rollout, tangent);
  const int nv = model.nv();
  for (size_t i = 0; i < out->f.size(); ++i) {
    for (int s = 0; s < nv; ++s) {
      out->f[i](s, column) +=
          (by.force[i * nv + s] - at.force[i * nv + s]) / step;
    }
  }
  for (size_t e = 0; e < by.errors.size(); ++e) {
    out->direct(e, column) += (by.errors[e] - at.errors[e]) / step;
  }
}

void AddEffortForces(const Model& model, const Effect& effect,
                     const Probe& probe, const SegmentTangent& tangent,
                     int column, ParameterForces* out) {
  const int child = model.mechanism().joints[effect.joint()].child_link;
  const Body& body = model.bodies()[model.placement(child).body];
  const int nv = VelocitySize(body.type), nq = ConfigurationSize(body.type);
  const EffectHooks<Jet8>& hooks = effect.HooksFor(ScalarTag<Jet8>());
  std::vector<Jet8> p;
  for (const double value : probe.at) p.emplace_back(value);
  p[probe.along].v[0] = 1.0;
  Jet8 q[4], qd[3], tau[3];
  for (size_t i = 0; i < out->f.size(); ++i) {
    const auto x = tangent.middle.row(static_cast<int>(i));
    for (int s = 0; s < nq; ++s) q[s] = Jet8(x[body.q_index + s]);
    for (int s = 0; s < nv; ++s) {
      qd[s] = Jet8(x[model.nq() + body.v_index + s]);
      tau[s] = Jet8(0.0);
    }
    hooks.AddEffort({body.type, nv, q, qd}, p.data(), tau);
    for (int s = 0; s < nv; ++s) {
      out->f[i](body.v_index + s, column) += tau[s].v[0];
    }
  }
}

}  // namespace sysid
