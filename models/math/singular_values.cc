#include <Eigen/SVD>

#include "models/math/decompositions.h"

namespace sysid {

SingularValues SingularValuesOf(const Eigen::MatrixXd& A, bool full_v) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(
      A, Eigen::ComputeThinU |
             (full_v ? Eigen::ComputeFullV : Eigen::ComputeThinV));
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

}  // namespace sysid
