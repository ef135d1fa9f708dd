#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "mujoco/mujoco.h"
#include "tests/benchmarks/engine.h"

namespace sysid {
namespace {

class MujocoEngine final : public Engine {
 public:
  MujocoEngine(const Mechanism& mechanism, const std::string& mjcf) {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() /
        ("sysid_engine_" + std::to_string(getpid()) + ".xml");
    std::ofstream(file) << mjcf;
    char error[1000] = "";
    model_ = mj_loadXML(file.c_str(), nullptr, error, sizeof(error));
    std::filesystem::remove(file);
    if (model_ == nullptr) {
      std::fprintf(stderr, "MuJoCo: %s\n", error);
      std::abort();
    }
    data_ = mj_makeData(model_);
    for (const Joint& joint : mechanism.joints) {
      if (joint.type == JointType::kFixed) continue;
      const std::string name = "j" + std::to_string(joint.child_link);
      const int id = mj_name2id(model_, mjOBJ_JOINT, name.c_str());
      const bool ball = joint.type == JointType::kSpherical;
      joints_.push_back({ball, joint.q_index, model_->jnt_qposadr[id]});
      for (int k = 0; k < (ball ? 3 : 1); ++k) {
        dof_.push_back(model_->jnt_dofadr[id] + k);
      }
    }
  }
  ~MujocoEngine() override {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }

  std::string Version() const override { return mj_versionString(); }

  // mj_forward, with the copies into it and out of it (about 1 %).
  void ForwardDynamics(const double* q, const double* qd, const double* tau,
                       double* qdd) override {
    for (const OfJoint& joint : joints_) {
      mjtNum* qpos = data_->qpos + joint.theirs;
      if (joint.ball) {
        qpos[0] = q[joint.ours + 3];
        for (int k = 0; k < 3; ++k) qpos[k + 1] = q[joint.ours + k];
      } else {
        qpos[0] = q[joint.ours];
      }
    }
    for (size_t i = 0; i < dof_.size(); ++i) {
      data_->qvel[dof_[i]] = qd[i];
      data_->qfrc_applied[dof_[i]] = tau[i];
    }
    mj_forward(model_, data_);
    for (size_t i = 0; i < dof_.size(); ++i) qdd[i] = data_->qacc[dof_[i]];
  }

 private:
  struct OfJoint {
    bool ball;
    int ours, theirs;  // first number in q and in qpos
  };
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
  std::vector<OfJoint> joints_;
  std::vector<int> dof_;
};

}  // namespace
}  // namespace sysid

extern "C" sysid::Engine* MakeEngine(const sysid::Mechanism& mechanism,
                                     const std::string& mjcf) {
  return new sysid::MujocoEngine(mechanism, mjcf);
}
