#pragma once

#include <string>
#include <vector>

#include "models/math/types.h"

namespace sysid {

// What the data determines of theta, from the triangular factor R of its
// information (EliminateStates), R^T R = covariance^-1.
struct Identifiability {
  // Per parameter; where not identifiable its std_error means nothing.
  std::vector<bool> identifiable;
  // Parameters (indices) that a direction of theta moves together without
  // the data noticing, each group in the order of theta; those without any
  // influence at all are groups of one.
  std::vector<std::vector<int>> groups;
  std::vector<int> without_influence;
  // Of the directions that the data determines; theta x theta.
  Eigen::MatrixXd covariance;
  // Those that it does not, each as long as its standard deviation (or 1e6
  // scales, where that is more): theta x (their number). What is computed from
  // theta is undetermined as far as it moves along these.
  Eigen::MatrixXd undetermined;
};

// A direction of the scaled parameters theta_i / scale_i is undetermined where
// its standard deviation exceeds kUndetermined: a combination that is known to
// no better than 20 % (95 %) of its size is not told by the data. Parameters
// take part in an undetermined direction with at least a tenth of its largest
// component.
inline constexpr double kUndetermined = 0.1;

Identifiability AnalyseIdentifiability(const RowMatrixXd& R,
                                       const Eigen::VectorXd& scale);

}  // namespace sysid
