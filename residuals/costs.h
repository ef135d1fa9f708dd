#pragma once

#include <memory>
#include <vector>

#include "ceres/ceres.h"
#include "residuals/segment.h"

namespace sysid {

// (3.1) and (3.2) for Ceres: a whole state x as one parameter block.
class StateManifold final : public ceres::Manifold {
 public:
  // The model must outlive it.
  explicit StateManifold(const Model* model) : model_(model) {}

  int AmbientSize() const override { return model_->state_size(); }
  int TangentSize() const override { return model_->tangent_size(); }
  bool Plus(const double* x, const double* delta,
            double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x,
             double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;

 private:
  const Model* model_;
};

// The defect x_end [-] x_next of two states, tangent_size numbers, and, where
// J_end is not null, its derivatives by both tangents.
void StateDefect(const Model& model, const double* x_end, const double* x_next,
                 double* defect, RowMatrixXd* J_end, RowMatrixXd* J_next);

// J_tangent MinusJacobian(x): what Ceres multiplies by PlusJacobian again. J
// has the rows of J_tangent and state_size columns.
void LiftToAmbient(const Model& model, const double* x,
                   const Eigen::Ref<const RowMatrixXd>& J_tangent,
                   Eigen::Ref<RowMatrixXd> J);

// Losses on a whitened measurement s = |r|^2 / sigma^2; rho(s) ~ s near 0.
enum class RobustLoss { kNone, kHuber, kCauchy };

// rho(s) and its derivative, at scale c (in standard deviations):
//   Huber: s, or 2 c sqrt(s) - c^2 beyond s > c^2;  Cauchy: c^2 log(1 + s/c^2).
void EvaluateLoss(RobustLoss loss, double scale, double s, double* rho,
                  double* rho_prime);

// The one place where errors are divided by their standard deviations, so that
// chi-square and covariance mean something. Rows in `groups` are also bent by
// the loss, group by group (Ceres' own losses would bend a whole segment):
// r -> sqrt(rho(s)/s) r with s = |r|^2, exactly differentiated.       (5.3)
class Whitening {
 public:
  struct Group {
    int first;
    int size;
  };
  explicit Whitening(std::vector<double> sigmas,
                     RobustLoss loss = RobustLoss::kNone,
                     double loss_scale = 1.0, std::vector<Group> groups = {});

  int rows() const { return static_cast<int>(inverse_sigmas_.size()); }
  // r and the blocks J of its derivatives, in place.
  void Apply(double* r, const std::vector<Eigen::Map<RowMatrixXd>>& J) const;

 private:
  std::vector<double> inverse_sigmas_;
  RobustLoss loss_;
  double loss_scale_;
  std::vector<Group> groups_;
};

// (theta_i - mean_i) / sigma_i of components of one block.
class PriorCost final : public ceres::CostFunction {
 public:
  // Component `places[i]` of a block of the given size.
  PriorCost(int block_size, std::vector<int> places, std::vector<double> means,
            std::vector<double> sigmas);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  std::vector<int> places_;
  std::vector<double> means_;
  Whitening whitening_;
};

// x [-] x_prior of a state, whitened.
class StatePriorCost final : public ceres::CostFunction {
 public:
  StatePriorCost(const Model* model, std::vector<double> x_prior,
                 std::vector<double> sigmas);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const Model* model_;
  std::vector<double> x_prior_;
  Whitening whitening_;
};

}  // namespace sysid
