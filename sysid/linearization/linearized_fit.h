#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sysid/estimation/shooting_segment.h"

namespace sysid {

// Columns that span those of Theta, orthonormal over all segments of all
// processes.
class ThetaBasis {
 public:
  // Of columns without the states, one matrix a segment; a column's prior is
  // 1 / sigma^2, 0 where it has none.
  void Span(const std::vector<Eigen::MatrixXd>& theta,
            const Eigen::VectorXd& prior, const Processes& all);
  // Takes it out of columns of the segments.
  void ProjectOut(const Processes& all, int threads,
                  std::vector<Eigen::MatrixXd>* columns) const;
  int rank() const { return rank_; }
  const Eigen::MatrixXd& of(int segment) const { return columns_[segment]; }

 private:
  std::vector<Eigen::MatrixXd> columns_;
  int rank_ = 0;
};

// A fit of independent segments, linearised once: all that a diagnosis asks of
// it (candidates, unexplained forces) are further columns of the same least
// squares
//
//   min | r + S dx + Theta dtheta + A alpha |^2                          (7.3)
//
// whitened, S by the states of the segments (block by block), Theta by the free
// parameters, A by whatever is asked. States and free parameters are projected
// out, r and A that remain are orthogonal to them. S and Theta are exact
// derivatives (SegmentRollout::Linearize).
class LinearizedFit {
 public:
  // The problem and the point must outlive it. Valid() is false where the
  // dynamics fail. Parameters that are `taken_back`, by name, are no part of
  // Theta: to first order they are back at the values given.
  LinearizedFit(const ShootingProblem& problem, const Solution& point,
                const std::map<std::string, double>& taken_back = {});
  bool Valid() const { return valid_; }

  struct Segment {
    int run = 0, index = 0;
    std::unique_ptr<SegmentRollout> rollout;
    Eigen::VectorXd errors;    // SI
    Eigen::VectorXd whitened;  // the same over sigma, bent by the robust loss
    // Orthonormal basis of the columns of S; below the rows of the segment
    // those of the belief about its state.
    Eigen::MatrixXd basis;
    Eigen::MatrixXd R;      // S = basis R
    Eigen::MatrixXd theta;  // Theta without the states
    Eigen::VectorXd r;      // without states and Theta
    int rows() const { return static_cast<int>(errors.size()); }
    double numbers() const;  // measured, that are independent
  };
  const std::vector<std::unique_ptr<Segment>>& segments() const {
    return segments_;
  }
  const ShootingProblem& problem() const { return problem_; }
  const Solution& point() const { return point_; }
  const double* StateOf(const Segment& segment) const {
    const RowMatrixXd& states = point_.runs[segment.run].states;
    return states.data() + segment.index * states.cols();
  }
  // At its samples, samples x state_size.
  RowMatrixXd StatesAlong(const Segment& segment) const;

  // Derivatives of a segment's errors, SI, as (7.3) has them: whitened like
  // them.
  Eigen::MatrixXd Whiten(const Segment& segment, RowMatrixXd columns) const;

  // Columns of a segment as (7.3) has them, with the states projected out;
  // below its rows those of the belief about its state.
  Eigen::MatrixXd WithoutStates(const Segment& segment,
                                const Eigen::MatrixXd& columns) const;

  // The change of the segment's state that goes with whitened errors: the best
  // that it can do against them.
  Eigen::VectorXd StateAgainst(const Segment& segment,
                               const Eigen::VectorXd& errors) const;

  // Takes Theta out of columns, one matrix a segment.
  void ProjectOutTheta(std::vector<Eigen::MatrixXd>* columns) const {
    theta_.ProjectOut(problem_.processes(), problem_.options().threads,
                      columns);
  }
  const ThetaBasis& theta_basis() const { return theta_; }
  // Of other columns of the parameters that Theta has, without the states: what
  // spans them and what is believed.
  ThetaBasis Span(const std::vector<Eigen::MatrixXd>& theta) const;
  // Places of these parameters in theta.
  const std::vector<int>& kept() const { return kept_; }

  // Numbers measured, less those fitted.
  double DegreesOfFreedom() const;
  double SumOfSquares() const;         // of r
  double AutocorrelationTime() const;  // of the errors of the fit: (6.3)

 private:
  bool TakeBack(const std::map<std::string, double>& taken_back);
  bool Linearize(Segment* segment, ScratchPool* pool) const;
  void ProjectResiduals();

  const ShootingProblem& problem_;
  const Solution& point_;
  bool valid_ = false;
  std::vector<std::unique_ptr<Segment>> segments_;
  std::vector<int> kept_;  // places in theta that Theta has
  Eigen::VectorXd moved_;  // of theta, by what is taken back
  ThetaBasis theta_;
};

}  // namespace sysid
