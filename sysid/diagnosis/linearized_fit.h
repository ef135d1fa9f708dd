#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "residuals/parameter_forces.h"
#include "residuals/segment_tangent.h"
#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// A fit of independent segments, linearised once: all that a diagnosis asks of
// it (candidates, unexplained forces) are further columns of the same least
// squares
//
//   min | r + S dx + Theta dtheta + A alpha |^2                          (7.3)
//
// whitened, S by the states of the segments (block by block), Theta by the free
// parameters, A by whatever is asked. States and free parameters are projected
// out, r and A that remain are orthogonal to them.
class LinearizedFit {
 public:
  // The problem and the point must outlive it. Valid() is false where the
  // dynamics fail. Parameters that are `taken_back`, by name, are no part of
  // Theta: to first order they are back at the values given.
  LinearizedFit(const ShootingProblem& problem, const ShootingPoint& point,
                const std::map<std::string, double>& taken_back = {});
  bool Valid() const { return valid_; }

  struct Segment {
    int run = 0, index = 0;
    std::unique_ptr<SegmentRollout> rollout;
    SegmentTangent tangent;
    Eigen::VectorXd weight;  // per row: 1 / sigma, bent by the robust loss
    // Orthonormal basis of the columns of S; below the rows of the segment
    // those of the belief about its state.
    Eigen::MatrixXd basis;
    Eigen::MatrixXd R;      // S = basis R
    Eigen::MatrixXd theta;  // Theta without the states
    // Columns that span it, orthonormal over all segments.
    Eigen::MatrixXd theta_basis;
    Eigen::VectorXd r;  // without states and Theta
    int rows() const { return static_cast<int>(weight.size()); }
  };
  const std::vector<std::unique_ptr<Segment>>& segments() const {
    return segments_;
  }
  const ShootingProblem& problem() const { return problem_; }
  const ShootingPoint& point() const { return point_; }

  // What a force would do to the whitened errors of a segment: (7.1) rolled
  // along it; rows x columns.
  Eigen::MatrixXd Respond(const Segment& segment,
                          const ParameterForces& forces) const;

  // Columns of a segment as (7.3) has them, with the states projected out;
  // below its rows those of the belief about its state.
  Eigen::MatrixXd WithoutStates(const Segment& segment,
                                const Eigen::MatrixXd& columns) const;

  // The change of the segment's state that goes with whitened errors: the best
  // that it can do against them.
  Eigen::VectorXd StateAgainst(const Segment& segment,
                               const Eigen::VectorXd& errors) const;

  // Takes Theta out of columns, one matrix a segment.
  void ProjectOutTheta(std::vector<Eigen::MatrixXd>* columns) const;

  // Numbers measured, less those fitted.
  double DegreesOfFreedom() const;
  double SumOfSquares() const;         // of r
  double AutocorrelationTime() const;  // of the errors of the fit: (6.3)

 private:
  bool TakeBack(const std::map<std::string, double>& taken_back);
  bool Linearize(Segment* segment) const;
  void ProjectResiduals();

  const ShootingProblem& problem_;
  const ShootingPoint& point_;
  bool valid_ = false;
  std::vector<std::unique_ptr<Segment>> segments_;
  std::vector<int> kept_;  // places in theta that Theta has
  Eigen::VectorXd moved_;  // of theta, by what is taken back
  int theta_rank_ = 0;
};

}  // namespace sysid
