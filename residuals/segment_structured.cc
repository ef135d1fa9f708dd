#include <algorithm>
#include <memory>

#include "models/step_tangent.h"
#include "residuals/segment-impl.h"

// SegmentRollout::Linearize with the tangent of each step beside the step.

namespace sysid {
namespace {

using Vector3d = Eigen::Vector3d;

// What eight columns [dx0 | theta], from `first` on, need of the parameters and
// the sensors.
class ColumnSensors {
 public:
  ColumnSensors(const SegmentRollout& rollout, const double* theta, int first,
                int columns)
      : rollout_(rollout),
        first_(first),
        columns_(columns),
        ws_(rollout.model()),
        sensors_(rollout, &ws_),
        x_(rollout.model().state_size()),
        tau_(rollout.model().nv()),
        errors_(rollout.num_residuals()) {
    const int tangent = rollout.model().tangent_size();
    std::vector<Jet8> seeded(theta, theta + rollout.parameters().size());
    for (int c = 0; c < columns; ++c) {
      if (first + c >= tangent) seeded[first + c - tangent].v[c] = 1.0;
    }
    MechanismParameters<Jet8> values;
    rollout.parameters().Apply<Jet8>(seeded.data(), &values);
    ws_.SetParameters(values);
  }

  // The columns of the state x0: (3.1) at dx = 0.
  StateColumns Start(const double* x0) const {
    const Model& model = rollout_.model();
    const int nq = model.nq(), nv = model.nv();
    StateColumns start(model, ParameterColumns(ws_));
    for (int c = 0; c < columns_; ++c) {
      const int column = first_ + c;
      if (column < nv) start.dq[column][c] = 1.0;
      if (column >= nv && column < 2 * nv) start.dqd[column - nv][c] = 1.0;
    }
    for (const Body& body : model.bodies()) {
      if (body.type != JointType::kSpherical) continue;
      const int v = body.v_index;
      const Vector3d w = Eigen::Map<const Vector3d>(x0 + nq + v);
      Store3(Load3(&start.dqd[v]) + Cross(w, Load3(&start.dq[v])),
             &start.dqd[v]);
    }
    const EffectSet& effects = model.effects();
    for (int i = 0; i < effects.size(); ++i) {
      const Effect& effect = effects.effect(i);
      if (!(effect.hooks() & (kInputHook | kInputDelayHook))) continue;
      for (size_t k = 0; k < effect.parameters().size(); ++k) {
        start.tau_moves |= start.theta.effects[effects.offset(i) + k].moves;
      }
    }
    return start;
  }

  // The columns of the efforts from t to t + h.
  void SetEfforts(int sample, double t, double h, StateColumns* columns) {
    if (!columns->tau_moves) return;
    const Run& run = *rollout_.measurements().run;
    ActingEffort<Jet8>(run, ws_, sample, t, h, tau_.data());
    for (size_t i = 0; i < tau_.size(); ++i) {
      columns->dtau[i] = LanesOf(tau_[i]);
    }
  }

  // The errors at sample k with the state x.
  void Measure(int k, const double* x, const StateColumns& columns) {
    const Model& model = rollout_.model();
    const int nq = model.nq(), nv = model.nv();
    for (const Body& body : model.bodies()) {
      const double* q = x + body.q_index;
      Jet8* out = x_.data() + body.q_index;
      const Lanes* dq = &columns.dq[body.v_index];
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
    for (int i = 0; i < nv; ++i) {
      x_[nq + i] = JetOf(x[nq + i], columns.dqd[i]);
    }
    sensors_.Measure(k, x_.data(), errors_.data());
  }

  // The errors, their columns of J, and those of the tangent (3.2) at the end.
  void Write(const double* x_end, const StateColumns& columns, double* errors,
             RowMatrixXd* J, RowMatrixXd* J_end) const {
    const Model& model = rollout_.model();
    const int nq = model.nq(), nv = model.nv();
    for (size_t i = 0; i < errors_.size(); ++i) {
      errors[i] = errors_[i].a;
      J->row(i).segment(first_, columns_) =
          errors_[i].v.head(columns_).transpose();
    }
    std::vector<Lanes> dqd = columns.dqd;
    for (const Body& body : model.bodies()) {
      if (body.type != JointType::kSpherical) continue;
      const int v = body.v_index;
      const Vector3d w = Eigen::Map<const Vector3d>(x_end + nq + v);
      Store3(Load3(&dqd[v]) - Cross(w, Load3(&columns.dq[v])), &dqd[v]);
    }
    for (int i = 0; i < nv; ++i) {
      for (int c = 0; c < columns_; ++c) {
        (*J_end)(i, first_ + c) = columns.dq[i][c];
        (*J_end)(nv + i, first_ + c) = dqd[i][c];
      }
    }
  }

 private:
  const SegmentRollout& rollout_;
  int first_;
  int columns_;
  Workspace<Jet8> ws_;
  internal::Sensors<Jet8> sensors_;
  std::vector<Jet8> x_, tau_, errors_;
};

}  // namespace

bool SegmentRollout::LinearizeStructured(const double* x0, const double* theta,
                                         double* errors, double* x_end,
                                         RowMatrixXd* J,
                                         RowMatrixXd* J_end) const {
  const Run& run = *measurements_->run;
  Workspace<double> ws(*model_);
  MechanismParameters<double> values;
  parameters_->Apply<double>(theta, &values);
  ws.SetParameters(values);
  StepTangent stepper(options_.integrator, &ws);
  const int total = static_cast<int>(J->cols());
  std::vector<std::unique_ptr<ColumnSensors>> sensors;
  std::vector<StateColumns> columns;
  for (int first = 0; first < total; first += kLanes) {
    sensors.push_back(std::make_unique<ColumnSensors>(
        *this, theta, first, std::min(kLanes, total - first)));
    columns.push_back(sensors.back()->Start(x0));
  }
  std::vector<double> tau(model_->nv());
  std::copy(x0, x0 + model_->state_size(), x_end);
  for (int k = first_;; ++k) {
    for (size_t b = 0; b < columns.size(); ++b) {
      sensors[b]->Measure(k, x_end, columns[b]);
    }
    if (k == last_) break;
    const int steps = StepsAfter(k);
    const double span = run.t[k + 1] - run.t[k], h = span / steps;
    for (int s = 0; s < steps; ++s) {
      const double t = run.t[k] + span * s / steps;
      ActingEffort<double>(run, ws, k, t, h, tau.data());
      for (size_t b = 0; b < columns.size(); ++b) {
        sensors[b]->SetEfforts(k, t, h, &columns[b]);
      }
      if (!stepper.Step(h, tau.data(), x_end, &columns)) return false;
    }
  }
  for (size_t b = 0; b < columns.size(); ++b) {
    sensors[b]->Write(x_end, columns[b], errors, J, J_end);
  }
  return true;
}

}  // namespace sysid
