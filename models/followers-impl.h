#pragma once

#include <algorithm>
#include <cmath>

#include "models/dynamics.h"

// Joints that follow others (<mimic>): the equations of motion of all joints of
// the tree, put into the coordinates of the state. Equation numbers:
// docs/theory.md.

namespace sysid {
namespace internal {

// (2.26): the positions of all joints. Without followers q itself.
template <typename T>
const T* AllPositions(Workspace<T>* ws, const T* q) {
  const Model& model = ws->model();
  if (model.followers().empty()) return q;
  std::copy_n(q, model.nq(), ws->y.begin());
  for (const Body& body : model.followers()) {
    const T& leader = q[model.bodies()[body.leader].q_index];
    ws->y[body.q_index] = leader * body.multiplier + body.offset;
  }
  return ws->y.data();
}

// (2.27): G qd, or G qdd; to `all`.
template <typename T>
const T* AllRates(Workspace<T>* ws, const T* rate, std::vector<T>* all) {
  const Model& model = ws->model();
  std::copy_n(rate, model.nv(), all->begin());
  for (const Body& body : model.followers()) {
    const T& leader = rate[model.bodies()[body.leader].v_index];
    (*all)[body.v_index] = leader * body.multiplier;
  }
  return all->data();
}

// G^T tau.
template <typename T>
void ProjectEffort(const Workspace<T>& ws, const T* all, T* tau) {
  const Model& model = ws.model();
  std::copy_n(all, model.nv(), tau);
  for (const Body& body : model.followers()) {
    tau[model.bodies()[body.leader].v_index] +=
        all[body.v_index] * body.multiplier;
  }
}

// G^T M_y G, of the workspace's M_y.
template <typename T>
void ProjectMass(Workspace<T>* ws, MatrixX<T>* M) {
  const Model& model = ws->model();
  MatrixX<T>& M_y = ws->M_y;
  const int size = static_cast<int>(M_y.rows());
  for (const Body& body : model.followers()) {
    const int from = body.v_index, to = model.bodies()[body.leader].v_index;
    for (int i = 0; i < size; ++i) M_y(i, to) += M_y(i, from) * body.multiplier;
  }
  for (const Body& body : model.followers()) {
    const int from = body.v_index, to = model.bodies()[body.leader].v_index;
    for (int i = 0; i < size; ++i) M_y(to, i) += M_y(from, i) * body.multiplier;
  }
  M->resize(model.nv(), model.nv());
  for (int j = 0; j < model.nv(); ++j) {
    for (int i = 0; i < model.nv(); ++i) (*M)(i, j) = M_y(i, j);
  }
}

// x = A^-1 x by A = L D L^T, of which the lower triangle of A is read and
// overwritten. False where A is not positive definite.
template <typename T>
bool SolveInPlace(MatrixX<T>* A, T* x) {
  MatrixX<T>& L = *A;
  const int size = static_cast<int>(L.rows());
  for (int j = 0; j < size; ++j) {
    for (int k = 0; k < j; ++k) L(j, j) -= L(j, k) * L(j, k) * L(k, k);
    if (!(ValueOf(L(j, j)) > 0.0)) return false;
    for (int i = j + 1; i < size; ++i) {
      for (int k = 0; k < j; ++k) L(i, j) -= L(i, k) * L(j, k) * L(k, k);
      L(i, j) /= L(j, j);
    }
  }
  for (int i = 0; i < size; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= L(i, k) * x[k];
  }
  for (int i = 0; i < size; ++i) x[i] /= L(i, i);
  for (int i = size - 1; i >= 0; --i) {
    for (int k = i + 1; k < size; ++k) x[i] -= L(k, i) * x[k];
  }
  return true;
}

// Forward dynamics by (2.28), with followers. Of a joint
// that its dry friction holds, qdd is 0 and the row gives what is held; D^-1 of
// the others is that of M.
template <typename T>
bool AccelerateByMassMatrix(Workspace<T>* ws, const T* q, const T* qd,
                            const T* held, T* qdd) {
  const Model& model = ws->model();
  const int nv = model.nv();
  MassMatrix<T>(ws, q, &ws->M);
  std::fill_n(qdd, nv, T(0.0));
  InverseDynamics<T>(ws, q, qd, qdd, held, ws->force.data());
  for (int i = 0; i < nv; ++i) {
    ws->force[i] = held[i] - ws->force[i];
    qdd[i] = ws->force[i];
  }
  ws->factor = ws->M;
  for (const int b : ws->dry_bodies) {
    if (ws->bodies[b].dry != DryMode::kRests) continue;
    const int v = model.bodies()[b].v_index;
    for (int i = 0; i < nv; ++i) ws->factor(i, v) = ws->factor(v, i) = T(0.0);
    ws->factor(v, v) = T(1.0);
    qdd[v] = T(0.0);
  }
  if (!SolveInPlace<T>(&ws->factor, qdd)) return false;
  for (int i = 0; i < nv; ++i) {
    if (!std::isfinite(ValueOf(qdd[i]))) return false;
  }
  for (const int b : ws->dry_bodies) {
    BodyData<T>& data = ws->bodies[b];
    const int v = model.bodies()[b].v_index;
    const bool rests = data.dry == DryMode::kRests;
    data.D_inverse = rests ? T(0.0) : T(1.0) / ws->M(v, v);
    data.u = ws->force[v];
    if (!rests) continue;
    for (int i = 0; i < nv; ++i) data.u -= ws->M(v, i) * qdd[i];
  }
  return true;
}

}  // namespace internal
}  // namespace sysid
