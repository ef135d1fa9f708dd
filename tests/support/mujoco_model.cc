#include "tests/support/mujoco_model.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cstdio>
#include <cstring>
#include <memory>
#include <mutex>
#include <sstream>

#include "glog/logging.h"
#include "mujoco/mujoco.h"

namespace sysid {
namespace {

// Every digit, so that the text carries the numbers themselves.
template <class V>
std::string Numbers(const V& values) {
  std::string text;
  for (int i = 0; i < values.size(); ++i) {
    char number[32];
    std::snprintf(number, sizeof(number), i == 0 ? "%.17g" : " %.17g",
                  static_cast<double>(values[i]));
    text += number;
  }
  return text;
}

std::string QuaternionOf(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return Numbers(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
}

// Principal moments and axes: MuJoCo's own diagonalisation of `fullinertia`
// stops at 1e-12.
std::string InertialElement(const Inertial<double>& body) {
  if (body.mass == 0.0) return "";
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(body.inertia);
  Eigen::Matrix3d axes = eigen.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1.0;
  std::ostringstream out;
  out << "<inertial mass=\"" << Numbers(Eigen::Matrix<double, 1, 1>(body.mass))
      << "\" pos=\"" << Numbers(body.com) << "\" quat=\"" << QuaternionOf(axes)
      << "\" diaginertia=\"" << Numbers(eigen.eigenvalues()) << "\"/>";
  return out.str();
}

const char* MujocoType(JointType type) {
  if (IsRotation1(type)) return "hinge";
  return type == JointType::kPrismatic ? "slide" : "ball";
}

void WriteBody(const Mechanism& mechanism, const std::vector<double>& armature,
               int index, std::ostream* out) {
  const Joint& joint = mechanism.joints[index];
  const int link = joint.child_link;
  Eigen::Vector3d p = mechanism.nominal.joint_p[index];
  if (joint.held) p += joint.held->slide;
  *out << "<body name=\"l" << link << "\" pos=\"" << Numbers(p) << "\" quat=\""
       << QuaternionOf(joint.R_PJ) << "\">"
       << InertialElement(mechanism.nominal.links[link]);
  if (joint.type != JointType::kFixed) {
    const double rotor = armature.empty() ? 0.0 : armature[index];
    *out << "<joint name=\"j" << link << "\" type=\"" << MujocoType(joint.type)
         << "\" pos=\"0 0 0\" axis=\"" << Numbers(joint.axis) << "\" damping=\""
         << Numbers(Eigen::Matrix<double, 1, 1>(joint.damping))
         << "\" armature=\"" << Numbers(Eigen::Matrix<double, 1, 1>(rotor))
         << "\" limited=\"false\"";
    // As hard as MuJoCo's softened constraints can be.
    if (joint.friction > 0.0) {
      *out << " frictionloss=\""
           << Numbers(Eigen::Matrix<double, 1, 1>(joint.friction))
           << "\" solimpfriction=\"0.9999 0.9999 0.001\"";
    }
    *out << "/>";
  }
  *out << "\n";
  for (const int child : mechanism.links[link].child_joints) {
    WriteBody(mechanism, armature, child, out);
  }
  *out << "</body>\n";
}

}  // namespace

std::string ToMjcf(const Mechanism& mechanism,
                   const std::vector<double>& armature) {
  std::ostringstream out;
  out << "<mujoco>\n<compiler angle=\"radian\" inertiafromgeom=\"false\" "
         "balanceinertia=\"false\" boundmass=\"0\" boundinertia=\"0\"/>\n"
      << "<option gravity=\""
      << Numbers(Eigen::Vector3d(0.0, 0.0, -mechanism.nominal.gravity))
      << "\"><flag contact=\"disable\"/></option>\n<worldbody>\n";
  for (const int child : mechanism.links[0].child_joints) {
    WriteBody(mechanism, armature, child, &out);
  }
  out << "</worldbody>\n</mujoco>\n";
  return out.str();
}

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
