#include "residuals/costs.h"

#include <algorithm>
#include <cmath>

#include "glog/logging.h"
#include "models/state.h"

namespace sysid {
namespace {

using Map = Eigen::Map<RowMatrixXd>;

using Matrix43 = Eigen::Matrix<double, 4, 3>;

// d(q Exp(dq))/d dq at 0, q = (v, w): (w 1 + [v]x) / 2 over -v^T / 2. Its
// pseudo-inverse is four times its transpose.
Matrix43 QuaternionJacobian(const double* q) {
  const Eigen::Vector3d v(q[0], q[1], q[2]);
  Matrix43 P;
  P.topRows<3>() = 0.5 * (q[3] * Eigen::Matrix3d::Identity() + Skew<double>(v));
  P.row(3) = -0.5 * v.transpose();
  return P;
}

// d(x [+] dx)/d dx at dx = 0, state_size x tangent_size. By (3.1) the angular
// velocity w changes by w x dq + dqd.
void PlusJacobianAt(const Model& model, const double* x,
                    Eigen::Ref<RowMatrixXd> J) {
  const StateLayout& at = model.layout();
  J.setZero();
  J.block(at.qd(), at.dqd(), at.nv(), at.nv()).setIdentity();
  J.block(at.z(), at.dz(), at.nz(), at.nz()).setIdentity();
  for (const Body& body : model.movers()) {
    const int q = at.q(body), dq = at.dq(body);
    if (body.type == JointType::kSpherical) {
      J.block<4, 3>(q, dq) = QuaternionJacobian(x + q);
      J.block<3, 3>(at.qd(body), dq) =
          Skew<double>(Eigen::Vector3d(x + at.qd(body)));
    } else {
      J(q, dq) = 1.0;
    }
  }
}

// J_r^-1(phi) = 1 + [phi]/2 + c [phi]^2 (Sola et al., eq. 144).
Eigen::Matrix3d RightJacobianInverseMatrix(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  double c = 1.0 / 12.0;
  if (angle > 1e-3) {
    c = 1.0 / (angle * angle) -
        (1.0 + std::cos(angle)) / (2.0 * angle * std::sin(angle));
  }
  const Eigen::Matrix3d K = Skew<double>(phi);
  return Eigen::Matrix3d::Identity() + 0.5 * K + c * K * K;
}

}  // namespace

void LiftToAmbient(const Model& model, const double* x,
                   const Eigen::Ref<const RowMatrixXd>& J_tangent,
                   Eigen::Ref<RowMatrixXd> J) {
  const StateLayout& at = model.layout();
  for (const Body& body : model.movers()) {
    const int q = at.q(body), dq = at.dq(body);
    if (body.type == JointType::kSpherical) {
      const Eigen::Vector3d w(x + at.qd(body));
      const RowMatrixXd by_rotation =
          J_tangent.middleCols<3>(dq) -
          J_tangent.middleCols<3>(at.dqd(body)) * Skew<double>(w);
      J.middleCols<4>(q) =
          by_rotation * (4.0 * QuaternionJacobian(x + q)).transpose();
    } else {
      J.col(q) = J_tangent.col(dq);
    }
  }
  J.middleCols(at.qd(), at.nv()) = J_tangent.middleCols(at.dqd(), at.nv());
  J.middleCols(at.z(), at.nz()) = J_tangent.middleCols(at.dz(), at.nz());
}

void StateDefect(const Model& model, const double* x_end, const double* x_next,
                 double* defect, RowMatrixXd* J_end, RowMatrixXd* J_next) {
  const StateLayout& at = model.layout();
  BoxMinus<double>(model, x_end, x_next, defect);
  if (J_end == nullptr) return;
  J_end->setIdentity(at.tangent_size(), at.tangent_size());
  *J_next = -*J_end;
  for (const Body& body : model.movers()) {
    if (body.type != JointType::kSpherical) continue;
    const int dq = at.dq(body), dqd = at.dqd(body);
    // Log(q0* q1) by q1's tangent: J_r^-1(phi); by q0's: -J_r^-1(-phi).
    const Eigen::Vector3d phi(defect + dq);
    J_end->block<3, 3>(dq, dq) = RightJacobianInverseMatrix(phi);
    J_next->block<3, 3>(dq, dq) = -RightJacobianInverseMatrix(-phi);
    // e = Exp(phi) w1 - w0: by (3.1) q1's tangent leaves it, dw1 acts through
    // Exp(phi); q0's turns it by -dq0 x e, dw0 acts as it is.
    const Eigen::Vector3d e(defect + dqd);
    J_end->block<3, 3>(dqd, dqd) = ToMatrix(Exp<double>(phi));
    J_next->block<3, 3>(dqd, dq) = Skew<double>(e);
  }
}

bool StateManifold::Plus(const double* x, const double* delta,
                         double* x_plus_delta) const {
  BoxPlus<double>(*model_, x, delta, x_plus_delta);
  return true;
}

bool StateManifold::PlusJacobian(const double* x, double* jacobian) const {
  Map J(jacobian, AmbientSize(), TangentSize());
  PlusJacobianAt(*model_, x, J);
  return true;
}

bool StateManifold::Minus(const double* y, const double* x,
                          double* y_minus_x) const {
  BoxMinus<double>(*model_, y, x, y_minus_x);
  return true;
}

bool StateManifold::MinusJacobian(const double* x, double* jacobian) const {
  Map J(jacobian, TangentSize(), AmbientSize());
  const RowMatrixXd identity =
      RowMatrixXd::Identity(TangentSize(), TangentSize());
  J.setZero();
  LiftToAmbient(*model_, x, identity, J);
  return true;
}

void EvaluateLoss(RobustLoss loss, double scale, double s, double* rho,
                  double* rho_prime) {
  const double c2 = scale * scale;
  if (loss == RobustLoss::kHuber && s > c2) {
    *rho = 2.0 * scale * std::sqrt(s) - c2;
    *rho_prime = scale / std::sqrt(s);
  } else if (loss == RobustLoss::kCauchy) {
    *rho = c2 * std::log1p(s / c2);
    *rho_prime = 1.0 / (1.0 + s / c2);
  } else {
    *rho = s;
    *rho_prime = 1.0;
  }
}

Whitening::Whitening(std::vector<double> sigmas, RobustLoss loss,
                     double loss_scale, std::vector<Group> groups)
    : inverse_sigmas_(std::move(sigmas)),
      loss_(loss),
      loss_scale_(loss_scale),
      groups_(std::move(groups)) {
  for (double& sigma : inverse_sigmas_) {
    CHECK_GT(sigma, 0.0);
    sigma = 1.0 / sigma;
  }
}

void Whitening::Apply(double* residuals, const std::vector<Map>& blocks) const {
  const Eigen::Map<const Eigen::VectorXd> weights(inverse_sigmas_.data(),
                                                  rows());
  Eigen::Map<Eigen::VectorXd> r(residuals, rows());
  r.array() *= weights.array();
  for (Map J : blocks) J.array().colwise() *= weights.array();
  if (loss_ == RobustLoss::kNone) return;
  for (const Group& group : groups_) {
    auto part = r.segment(group.first, group.size);
    const double s = part.squaredNorm();
    if (s < 1e-24) continue;  // rho(s)/s = 1 there
    double rho, rho_prime;
    EvaluateLoss(loss_, loss_scale_, s, &rho, &rho_prime);
    const double w = std::sqrt(rho / s);
    // dw/ds = (rho' s - rho) / (2 w s^2); dr' = w dr + 2 (dw/ds) r r^T dr.
    const double dw = (rho_prime * s - rho) / (2.0 * w * s * s);
    const Eigen::VectorXd before = part;
    part *= w;
    for (Map J : blocks) {
      auto rows_J = J.middleRows(group.first, group.size);
      const Eigen::RowVectorXd rJ = before.transpose() * rows_J;
      rows_J *= w;
      rows_J += 2.0 * dw * before * rJ;
    }
  }
}

PriorCost::PriorCost(int block_size, std::vector<int> places,
                     std::vector<double> means, std::vector<double> sigmas)
    : places_(std::move(places)),
      means_(std::move(means)),
      whitening_(std::move(sigmas)) {
  CHECK_EQ(places_.size(), means_.size());
  mutable_parameter_block_sizes()->push_back(block_size);
  set_num_residuals(whitening_.rows());
}

bool PriorCost::Evaluate(double const* const* parameters, double* residuals,
                         double** jacobians) const {
  for (size_t i = 0; i < places_.size(); ++i) {
    residuals[i] = parameters[0][places_[i]] - means_[i];
  }
  std::vector<Map> blocks;
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    blocks.emplace_back(jacobians[0], num_residuals(),
                        parameter_block_sizes()[0]);
    blocks[0].setZero();
    for (size_t i = 0; i < places_.size(); ++i) blocks[0](i, places_[i]) = 1.0;
  }
  whitening_.Apply(residuals, blocks);
  return true;
}

StatePriorCost::StatePriorCost(const Model* model, std::vector<double> x_prior,
                               std::vector<double> sigmas)
    : model_(model),
      x_prior_(std::move(x_prior)),
      whitening_(std::move(sigmas)) {
  mutable_parameter_block_sizes()->push_back(model->state_size());
  set_num_residuals(whitening_.rows());
}

bool StatePriorCost::Evaluate(double const* const* parameters,
                              double* residuals, double** jacobians) const {
  RowMatrixXd D_end, D_next;
  StateDefect(*model_, parameters[0], x_prior_.data(), residuals, &D_end,
              &D_next);
  std::vector<Map> blocks;
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    blocks.emplace_back(jacobians[0], num_residuals(), model_->state_size());
    LiftToAmbient(*model_, parameters[0], D_end, blocks[0]);
  }
  whitening_.Apply(residuals, blocks);
  return true;
}

}  // namespace sysid
