#include "tests/support/mujoco_model.h"

#include <cstring>
#include <memory>
#include <mutex>

#include "glog/logging.h"
#include "mujoco/mujoco.h"
#include "tests/support/mjcf.h"

namespace sysid {

mjModel_* LoadMjcf(const std::string& text) {
  // MuJoCo's compiler keeps a model of its own, for all threads.
  static std::mutex one_at_a_time;
  const std::lock_guard<std::mutex> lock(one_at_a_time);
  const char kFile[] = "mechanism.xml";
  auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  CHECK_EQ(mj_makeEmptyFileVFS(files.get(), kFile, text.size()), 0);
  const int file = mj_findFileVFS(files.get(), kFile);
  std::memcpy(files->filedata[file], text.data(), text.size());
  char error[1000] = "";
  mjModel* model = mj_loadXML(kFile, files.get(), error, sizeof(error));
  mj_deleteVFS(files.get());
  CHECK(model != nullptr) << error << "\n" << text;
  return model;
}

MujocoModel::MujocoModel(const Mechanism& mechanism,
                         const std::vector<double>& armature)
    : mechanism_(mechanism), model_(LoadMjcf(ToMjcf(mechanism, armature))) {
  data_ = mj_makeData(model_);
  CHECK_EQ(model_->nq, mechanism.nq);
  CHECK_EQ(model_->nv, mechanism.nv);
  body_.push_back(0);
  for (const Joint& joint : mechanism.joints) {
    const std::string number = std::to_string(joint.child_link);
    body_.push_back(mj_name2id(model_, mjOBJ_BODY, ("l" + number).c_str()));
    const int id = mj_name2id(model_, mjOBJ_JOINT, ("j" + number).c_str());
    q_address_.push_back(id < 0 ? -1 : model_->jnt_qposadr[id]);
    v_address_.push_back(id < 0 ? -1 : model_->jnt_dofadr[id]);
    for (int k = 0; k < VelocitySize(joint.type); ++k) {
      dof_.push_back(v_address_.back() + k);
    }
  }
}

MujocoModel::~MujocoModel() {
  mj_deleteData(data_);
  mj_deleteModel(model_);
}

void MujocoModel::Forward(const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
                          const Eigen::VectorXd& tau) {
  for (size_t i = 0; i < mechanism_.joints.size(); ++i) {
    const Joint& joint = mechanism_.joints[i];
    if (joint.type == JointType::kFixed) continue;
    double* qpos = data_->qpos + q_address_[i];
    if (joint.type == JointType::kSpherical) {
      qpos[0] = q[joint.q_index + 3];
      for (int k = 0; k < 3; ++k) qpos[k + 1] = q[joint.q_index + k];
    } else {
      qpos[0] = q[joint.q_index];
    }
  }
  for (int i = 0; i < mechanism_.nv; ++i) {
    data_->qvel[dof_[i]] = qd[i];
    data_->qfrc_applied[dof_[i]] = tau[i];
  }
  mj_forward(model_, data_);
}

Eigen::VectorXd MujocoModel::FromMujoco(const double* v) const {
  Eigen::VectorXd out(mechanism_.nv);
  for (int i = 0; i < mechanism_.nv; ++i) out[i] = v[dof_[i]];
  return out;
}

Eigen::VectorXd MujocoModel::Acceleration() const {
  return FromMujoco(data_->qacc);
}

Eigen::VectorXd MujocoModel::Bias() const {
  return FromMujoco(data_->qfrc_bias);
}

Eigen::MatrixXd MujocoModel::MassMatrix() const {
  const int nv = mechanism_.nv;
  std::vector<double> full(static_cast<size_t>(nv) * nv);
  mj_fullM(model_, full.data(), data_->qM);
  Eigen::MatrixXd M(nv, nv);
  for (int i = 0; i < nv; ++i) {
    for (int j = 0; j < nv; ++j) M(i, j) = full[dof_[i] * nv + dof_[j]];
  }
  return M;
}

Eigen::Vector3d MujocoModel::LinkPosition(int link) const {
  return Eigen::Map<const Eigen::Vector3d>(data_->xpos + 3 * body_[link]);
}

}  // namespace sysid
