// Rollouts through MuJoCo's mj_forward for tests/benchmarks/scipy_reference.py,
// which calls them by ctypes: a chain of ball joints whose links are scaled by
// factors s (a child's origin and the centre of mass by s, the inertia by s^2;
// docs/theory.md, section 4). Test-only.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "mujoco/mujoco.h"

namespace {

struct Chain {
  mjModel* model;
  mjData* data;
  std::vector<mjtNum> body_pos, body_ipos, body_inertia;  // of the file
  // Fourth-order Runge-Kutta on the group: (q Exp(u), qd + du).
  std::vector<mjtNum> q0, qd0, u, rate[4], qdd[4];
};

// u' = J_r^-1(u) w of one ball joint.
void BallRate(const mjtNum u[3], const mjtNum w[3], mjtNum rate[3]) {
  const mjtNum angle2 = mju_dot3(u, u);
  mjtNum c = 1.0 / 12.0;
  if (angle2 > 1e-6) {
    const mjtNum angle = std::sqrt(angle2);
    c = 1.0 / angle2 -
        (1.0 + std::cos(angle)) / (2.0 * angle * std::sin(angle));
  }
  mjtNum a[3], b[3];
  mju_cross(a, u, w);
  mju_cross(b, u, a);
  for (int i = 0; i < 3; ++i) rate[i] = w[i] + 0.5 * a[i] + c * b[i];
}

// Sets qpos to q0 Exp(h * part) and qvel to qd0 + h * qdd.
void Stage(Chain* chain, mjtNum h, const std::vector<mjtNum>* rate,
           const std::vector<mjtNum>* qdd) {
  const int nv = chain->model->nv;
  mju_copy(chain->data->qpos, chain->q0.data(), chain->model->nq);
  mju_copy(chain->data->qvel, chain->qd0.data(), nv);
  mju_zero(chain->u.data(), nv);
  if (rate == nullptr) return;
  mju_addToScl(chain->u.data(), rate->data(), h, nv);
  mju_addToScl(chain->data->qvel, qdd->data(), h, nv);
  for (int j = 0; j < nv / 3; ++j) {
    mju_quatIntegrate(chain->data->qpos + 4 * j, &chain->u[3 * j], 1.0);
  }
}

void Step(Chain* chain, mjtNum h) {
  const int nv = chain->model->nv;
  mjData* d = chain->data;
  mju_copy(chain->q0.data(), d->qpos, chain->model->nq);
  mju_copy(chain->qd0.data(), d->qvel, nv);
  const mjtNum part[4] = {0.0, 0.5 * h, 0.5 * h, h};
  for (int s = 0; s < 4; ++s) {
    Stage(chain, part[s], s == 0 ? nullptr : &chain->rate[s - 1],
          s == 0 ? nullptr : &chain->qdd[s - 1]);
    mj_forward(chain->model, d);
    for (int j = 0; j < nv / 3; ++j) {
      BallRate(&chain->u[3 * j], d->qvel + 3 * j, &chain->rate[s][3 * j]);
    }
    mju_copy(chain->qdd[s].data(), d->qacc, nv);
  }
  for (int i = 0; i < nv; ++i) {
    for (auto* k : {chain->rate, chain->qdd}) {
      k[0][i] = (k[0][i] + 2.0 * (k[1][i] + k[2][i]) + k[3][i]) / 6.0;
    }
  }
  Stage(chain, h, &chain->rate[0], &chain->qdd[0]);
}

}  // namespace

extern "C" {

void* chain_load(const char* file) {
  char error[1000] = "";
  auto* chain = new Chain;
  chain->model = mj_loadXML(file, nullptr, error, sizeof(error));
  if (chain->model == nullptr) return nullptr;
  const mjModel& m = *chain->model;
  chain->data = mj_makeData(chain->model);
  chain->body_pos.assign(m.body_pos, m.body_pos + 3 * m.nbody);
  chain->body_ipos.assign(m.body_ipos, m.body_ipos + 3 * m.nbody);
  chain->body_inertia.assign(m.body_inertia, m.body_inertia + 3 * m.nbody);
  chain->q0.resize(m.nq);
  chain->qd0.resize(m.nv);
  chain->u.resize(m.nv);
  for (auto& k : chain->rate) k.resize(m.nv);
  for (auto& k : chain->qdd) k.resize(m.nv);
  return chain;
}

// Rolls `count` segments out. Segment k starts from node k (nq + nv numbers,
// quaternions w first) moved by dx (2 nv numbers a segment, or null) and has
// `samples` samples, `steps` steps of h each apart. Writes to `headings` of
// each sample each joint's axis in the parent's axes, and where `defects` is
// not null how far the end misses the next node (count - 1 times 2 nv numbers).
void chain_roll(void* handle, const double* scales, int count,
                const double* nodes, const double* dx, int samples, int steps,
                double h, const double* axis, double* headings,
                double* defects) {
  Chain* chain = static_cast<Chain*>(handle);
  mjModel* m = chain->model;
  mjData* d = chain->data;
  const int nq = m->nq, nv = m->nv, joints = nv / 3;
  for (int body = 1; body < m->nbody; ++body) {
    // Body b is link b - 1 and hangs on link b - 2.
    const double s = body <= joints ? scales[body - 1] : 1.0;
    const double parent = body >= 2 ? scales[body - 2] : 1.0;
    for (int i = 0; i < 3; ++i) {
      m->body_pos[3 * body + i] = parent * chain->body_pos[3 * body + i];
      m->body_ipos[3 * body + i] = s * chain->body_ipos[3 * body + i];
      m->body_inertia[3 * body + i] = s * s * chain->body_inertia[3 * body + i];
    }
  }
  std::vector<double> start(static_cast<size_t>(count) * (nq + nv));
  std::memcpy(start.data(), nodes, sizeof(double) * start.size());
  for (int k = 0; dx != nullptr && k < count; ++k) {
    double* x = &start[static_cast<size_t>(k) * (nq + nv)];
    const double* move = dx + static_cast<size_t>(k) * 2 * nv;
    for (int j = 0; j < joints; ++j) {
      mju_quatIntegrate(x + 4 * j, move + 3 * j, 1.0);
    }
    mju_addTo(x + nq, move + nv, nv);
  }
  for (int k = 0; k < count; ++k) {
    const double* x = &start[static_cast<size_t>(k) * (nq + nv)];
    mju_copy(d->qpos, x, nq);
    mju_copy(d->qvel, x + nq, nv);
    const bool last = k + 1 == count;
    for (int sample = 0;; ++sample) {
      if (sample < samples || last) {
        for (int j = 0; j < joints; ++j, headings += 3) {
          mju_rotVecQuat(headings, axis, d->qpos + 4 * j);
        }
      }
      if (sample == samples) break;
      for (int s = 0; s < steps; ++s) Step(chain, h);
    }
    if (last || defects == nullptr) continue;
    const double* next = x + nq + nv;
    for (int j = 0; j < joints; ++j, defects += 3) {
      mju_subQuat(defects, d->qpos + 4 * j, next + 4 * j);
    }
    for (int i = 0; i < nv; ++i) *defects++ = d->qvel[i] - next[nq + i];
  }
}

}  // extern "C"
