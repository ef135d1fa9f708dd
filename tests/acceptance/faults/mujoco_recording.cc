// A recording by MuJoCo alone: nothing of sysid is linked, so that the suite of
// faults has data of an engine that the toolkit does not share.
//
//   mujoco_recording MODEL.xml < INPUT > STATES
//
// INPUT is numbers: nv, rows, period (s), substeps; q (nq), qd (nv), kp (nv),
// kd (nv), limit (nv; the largest effort); then per row the feed-forward
// efforts (nv) and the reference (nv; hinges and slides alone). A row's effort
//
//   tau = clip(feed_forward + kp (reference - q) - kd qd, limit)
//
// is held until the next, as a digital controller holds it. STATES has per row
// q (nq), qd (nv), tau (nv) at its time, with every digit.

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <vector>

#include "mujoco/mujoco.h"

namespace {

std::vector<double> ReadNumbers(int count) {
  std::vector<double> numbers(count);
  for (double& number : numbers) std::cin >> number;
  return numbers;
}

void Print(const double* values, int count) {
  for (int i = 0; i < count; ++i) std::printf("%.17g ", values[i]);
}

int Record(mjModel* model) {
  int nv = 0, rows = 0, substeps = 0;
  double period = 0.0;
  std::cin >> nv >> rows >> period >> substeps;
  if (!std::cin || nv != model->nv || rows < 1 || substeps < 1) {
    std::fprintf(stderr,
                 "mujoco_recording: the model has %d velocities, "
                 "the input %d\n",
                 model->nv, nv);
    return 2;
  }
  mjData* data = mj_makeData(model);
  model->opt.timestep = period / substeps;
  const std::vector<double> q = ReadNumbers(model->nq), qd = ReadNumbers(nv),
                            kp = ReadNumbers(nv), kd = ReadNumbers(nv),
                            limit = ReadNumbers(nv);
  std::copy(q.begin(), q.end(), data->qpos);
  std::copy(qd.begin(), qd.end(), data->qvel);
  // Where each hinge or slide has its position.
  std::vector<int> at(nv, -1);
  for (int j = 0; j < model->njnt; ++j) {
    if (model->jnt_type[j] == mjJNT_BALL) continue;
    at[model->jnt_dofadr[j]] = model->jnt_qposadr[j];
  }
  for (int row = 0; row < rows && std::cin; ++row) {
    const std::vector<double> tau = ReadNumbers(nv),
                              reference = ReadNumbers(nv);
    for (int i = 0; i < nv; ++i) {
      double effort = tau[i] - kd[i] * data->qvel[i];
      if (at[i] >= 0) effort += kp[i] * (reference[i] - data->qpos[at[i]]);
      data->qfrc_applied[i] = std::clamp(effort, -limit[i], limit[i]);
    }
    Print(data->qpos, model->nq);
    Print(data->qvel, nv);
    Print(data->qfrc_applied, nv);
    std::printf("\n");
    for (int step = 0; step < substeps; ++step) mj_step(model, data);
  }
  const bool read = static_cast<bool>(std::cin);
  mj_deleteData(data);
  if (!read) std::fprintf(stderr, "mujoco_recording: the input ends early\n");
  return read ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: mujoco_recording MODEL.xml < INPUT\n");
    return 2;
  }
  char error[1000] = "";
  mjModel* model = mj_loadXML(argv[1], nullptr, error, sizeof(error));
  if (model == nullptr) {
    std::fprintf(stderr, "mujoco_recording: %s\n", error);
    return 2;
  }
  const int code = Record(model);
  mj_deleteModel(model);
  return code;
}
