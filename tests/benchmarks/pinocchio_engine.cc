#include <Eigen/Core>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "pinocchio/algorithm/aba-derivatives.hpp"
#include "pinocchio/algorithm/aba.hpp"
#include "pinocchio/algorithm/crba.hpp"
#include "pinocchio/algorithm/regressor.hpp"
#include "pinocchio/algorithm/rnea.hpp"
#include "pinocchio/multibody.hpp"
#include "tests/benchmarks/engine.h"

// Calls the functions of Pinocchio's library as it is installed, built for any
// processor of the architecture.

namespace sysid {
namespace {

using RowMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
// The types for which its library has its functions: others would be compiled
// here, for minutes.
using In = Eigen::Ref<const Eigen::VectorXd>;
using Out = Eigen::Map<Eigen::VectorXd>;

// As its reader of URDFs chooses them, but for continuous joints, whose angle
// it keeps as cosine and sine.
pinocchio::JointModel ModelOf(const Joint& joint) {
  const bool turns = joint.type != JointType::kPrismatic;
  if (joint.type == JointType::kSpherical) {
    return pinocchio::JointModelSpherical();
  }
  if (joint.axis == Eigen::Vector3d::UnitX()) {
    if (turns) return pinocchio::JointModelRX();
    return pinocchio::JointModelPX();
  }
  if (joint.axis == Eigen::Vector3d::UnitY()) {
    if (turns) return pinocchio::JointModelRY();
    return pinocchio::JointModelPY();
  }
  if (joint.axis == Eigen::Vector3d::UnitZ()) {
    if (turns) return pinocchio::JointModelRZ();
    return pinocchio::JointModelPZ();
  }
  if (turns) return pinocchio::JointModelRevoluteUnaligned(joint.axis);
  return pinocchio::JointModelPrismaticUnaligned(joint.axis);
}

class PinocchioEngine final : public Engine {
 public:
  explicit PinocchioEngine(const Mechanism& mechanism)
      : model_(ModelOf(mechanism)), data_(model_) {
    parameters_.resize(10 * (model_.njoints - 1));
    for (int i = 1; i < model_.njoints; ++i) {
      parameters_.segment<10>(10 * (i - 1)) =
          model_.inertias[i].toDynamicParameters();
    }
    for (auto* matrix : {&by_q_, &by_qd_, &by_tau_}) {
      matrix->setZero(model_.nv, model_.nv);
    }
  }

  std::string Version() const override { return PINOCCHIO_VERSION; }

  void ForwardDynamics(const double* q, const double* qd, const double* tau,
                       double* qdd) override {
    Velocities(qdd) = pinocchio::aba(model_, data_, Positions(q),
                                     Velocities(qd), Velocities(tau));
  }
  void InverseDynamics(const double* q, const double* qd, const double* qdd,
                       double* tau) override {
    Velocities(tau) = pinocchio::rnea(model_, data_, Positions(q),
                                      Velocities(qd), Velocities(qdd));
  }
  void MassMatrix(const double* q, double* M) override {
    pinocchio::crba(model_, data_, Positions(q));  // the upper triangle
    Eigen::Map<RowMatrix>(M, model_.nv, model_.nv) =
        data_.M.selfadjointView<Eigen::Upper>();
  }
  void Regressor(const double* q, const double* qd, const double* qdd,
                 double* tau) override {
    q_ = Positions(q);
    qd_ = Velocities(qd);
    qdd_ = Velocities(qdd);
    Velocities(tau).noalias() =
        pinocchio::computeJointTorqueRegressor(model_, data_, q_, qd_, qdd_) *
        parameters_;
  }
  void Derivatives(const double* q, const double* qd, const double* tau,
                   double* by_q, double* by_qd, double* by_tau) override {
    pinocchio::computeABADerivatives(
        model_, data_, Positions(q), Velocities(qd), Velocities(tau),
        Eigen::Ref<Eigen::MatrixXd>(by_q_), Eigen::Ref<Eigen::MatrixXd>(by_qd_),
        Eigen::Ref<Eigen::MatrixXd>(by_tau_));
    const int nv = model_.nv;
    Eigen::Map<RowMatrix>(by_q, nv, nv) = by_q_;
    Eigen::Map<RowMatrix>(by_qd, nv, nv) = by_qd_;
    Eigen::Map<RowMatrix>(by_tau, nv, nv) =
        by_tau_.selfadjointView<Eigen::Upper>();
  }

 private:
  static pinocchio::Model ModelOf(const Mechanism& mechanism) {
    pinocchio::Model model;
    model.gravity.linear() << 0.0, 0.0, -mechanism.nominal.gravity;
    std::vector<pinocchio::JointIndex> of_link(mechanism.links.size(), 0);
    for (size_t i = 0; i < mechanism.joints.size(); ++i) {
      const Joint& joint = mechanism.joints[i];
      const Inertial<double>& body = mechanism.nominal.links[i + 1];
      if (joint.type == JointType::kFixed) {
        if (body.mass == 0.0 && mechanism.links[i + 1].child_joints.empty()) {
          continue;  // a frame
        }
        std::fprintf(stderr, "Pinocchio: no bodies on fixed joints here\n");
        std::abort();
      }
      const pinocchio::JointIndex index = model.addJoint(
          of_link[joint.parent_link], sysid::ModelOf(joint),
          pinocchio::SE3(joint.R_PJ, mechanism.nominal.joint_p[i]), joint.name);
      model.appendBodyToJoint(
          index, pinocchio::Inertia(body.mass, body.com, body.inertia),
          pinocchio::SE3::Identity());
      of_link[i + 1] = index;
      if (model.joints[index].idx_q() != joint.q_index) {
        std::fprintf(stderr, "Pinocchio: numbers its joints otherwise\n");
        std::abort();
      }
    }
    return model;
  }
  In Positions(const double* q) const {
    return Eigen::Map<const Eigen::VectorXd>(q, model_.nq);
  }
  In Velocities(const double* v) const {
    return Eigen::Map<const Eigen::VectorXd>(v, model_.nv);
  }
  Out Velocities(double* v) const { return Out(v, model_.nv); }

  const pinocchio::Model model_;
  pinocchio::Data data_;
  Eigen::VectorXd parameters_, q_, qd_, qdd_;
  Eigen::MatrixXd by_q_, by_qd_, by_tau_;
};

}  // namespace
}  // namespace sysid

extern "C" sysid::Engine* MakeEngine(const sysid::Mechanism& mechanism,
                                     const std::string&) {
  return new sysid::PinocchioEngine(mechanism);
}
