// A recording by MuJoCo alone: nothing of sysid is linked, so that the suite of
// faults has data of an engine that the toolkit does not share.
//
//   mujoco_recording MODEL.xml < INPUT > STATES
//
// INPUT is numbers: nv, rows, period (s), substeps; q (nq), qd (nv), kp (nv,
// 1/s^2), kd (nv, 1/s); then per row the feed-forward efforts (nv) and the
// reference (nv; hinges and slides alone). A row's effort on a joint with gains
//
//   tau = feed_forward + (M a + bias)_i,  a = kp (reference - q) - kd qd
//
// (computed torque, so that one pair of gains does for all joints of an arm) is
// held until the next, as a digital controller holds it. STATES has per row
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
                            kp = ReadNumbers(nv), kd = ReadNumbers(nv);
  std::copy(q.begin(), q.end(), data->qpos);
  std::copy(qd.begin(), qd.end(), data->qvel);
  // Where each hinge or slide has its position.
  std::vector<int> at(nv, -1);
  for (int j = 0; j < model->njnt; ++j) {
    if (model->jnt_type[j] == mjJNT_BALL) continue;
    at[model->jnt_dofadr[j]] = model->jnt_qposadr[j];
  }
  std::vector<double> a(nv), force(nv);
  for (int row = 0; row < rows && std::cin; ++row) {
    const std::vector<double> tau = ReadNumbers(nv),
                              reference = ReadNumbers(nv);
    mj_forward(model, data);
    for (int i = 0; i < nv; ++i) {
      a[i] = -kd[i] * data->qvel[i];
      if (at[i] >= 0) a[i] += kp[i] * (reference[i] - data->qpos[at[i]]);
    }
    mj_mulM(model, data, force.data(), a.data());
    for (int i = 0; i < nv; ++i) {
      const bool driven = kp[i] != 0.0 || kd[i] != 0.0;
      data->qfrc_applied[i] =
          tau[i] + (driven ? force[i] + data->qfrc_bias[i] : 0.0);
    }
    Print(data->qpos, model->nq);
    Print(data->qvel, nv);
    Print(data->qfrc_applied, nv);
    std::printf("\n");
    for (int step = 0; step < substeps; ++step) mj_step(model, data);
  }
  const bool read = static_cast<bool>(std::cin);
  const bool unstable = std::any_of(
      data->warning, data->warning + mjNWARNING,
      [](const mjWarningStat& warning) { return warning.number > 0; });
  mj_deleteData(data);
  if (!read) std::fprintf(stderr, "mujoco_recording: the input ends early\n");
  if (unstable) std::fprintf(stderr, "mujoco_recording: it flies apart\n");
  return read && !unstable ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: mujoco_recording MODEL.xml < INPUT\n");
    return 2;
  }
  // Record says what is lost; else it would go into a file of MuJoCo's.
  mju_user_warning = [](const char*) {};
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
