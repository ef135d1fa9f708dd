#include "sysid/estimation/elimination.h"

#include <Eigen/QR>
#include <algorithm>

#include "sysid/estimation/parallel.h"

namespace sysid {

RowMatrixXd TriangularFactor(const RowMatrixXd& rows) {
  if (rows.rows() == 0) return rows;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(rows);
  const int keep = static_cast<int>(std::min(rows.rows(), rows.cols()));
  return qr.matrixQR().topRows(keep).triangularView<Eigen::Upper>();
}

namespace {

RowMatrixXd EliminateRun(const RunLinearization& run, int n_theta) {
  const int tangent = static_cast<int>(run.J_prior.cols());
  // Rows [x_k | theta | r] of what is known of the state so far.
  RowMatrixXd past = RowMatrixXd::Zero(tangent, tangent + n_theta + 1);
  past.leftCols(tangent) = run.J_prior;
  past.col(tangent + n_theta) = run.r_prior;
  RowMatrixXd collected(0, n_theta + 1);
  const auto collect = [&](const RowMatrixXd& rows) {
    RowMatrixXd both(collected.rows() + rows.rows(), n_theta + 1);
    both << collected, rows;
    collected = TriangularFactor(both);
  };
  for (const SegmentLinearization& segment : run.segments) {
    const bool last = segment.J_next.size() == 0;
    const int next = last ? 0 : tangent;
    const int rows = static_cast<int>(segment.J_x.rows());
    const int width = tangent + next + n_theta + 1;
    RowMatrixXd stack = RowMatrixXd::Zero(past.rows() + rows, width);
    stack.topLeftCorner(past.rows(), tangent) = past.leftCols(tangent);
    stack.topRightCorner(past.rows(), n_theta + 1) =
        past.rightCols(n_theta + 1);
    if (rows > 0) {
      stack.bottomLeftCorner(rows, tangent) = segment.J_x;
      if (!last) stack.block(past.rows(), tangent, rows, next) = segment.J_next;
      stack.block(past.rows(), tangent + next, rows, n_theta) = segment.J_theta;
      stack.bottomRightCorner(rows, 1) = segment.r;
    }
    const RowMatrixXd R = TriangularFactor(stack);
    const int below = std::min<int>(tangent, R.rows());
    if (last) {
      collect(R.bottomRightCorner(R.rows() - below, n_theta + 1));
      // Independent segments: the next starts from nothing but its own data.
      past.setZero(0, tangent + n_theta + 1);
      continue;
    }
    const int carried = std::min<int>(2 * tangent, R.rows()) - below;
    past = R.block(below, tangent, carried, width - tangent);
    collect(R.bottomRightCorner(R.rows() - below - carried, n_theta + 1));
  }
  return collected;
}

}  // namespace

RowMatrixXd EliminateStates(const std::vector<RunLinearization>& runs,
                            const RowMatrixXd& J_prior,
                            const Eigen::VectorXd& r_prior, int threads) {
  const int n_theta = static_cast<int>(J_prior.cols());
  std::vector<RowMatrixXd> factors(runs.size());
  ParallelFor(static_cast<int>(runs.size()), threads, [&](int r) {
    factors[r] = EliminateRun(runs[r], n_theta);
    return true;
  });
  int total = static_cast<int>(J_prior.rows());
  for (const RowMatrixXd& factor : factors) {
    total += static_cast<int>(factor.rows());
  }
  RowMatrixXd stack = RowMatrixXd::Zero(std::max(total, n_theta), n_theta + 1);
  int row = static_cast<int>(J_prior.rows());
  stack.topLeftCorner(row, n_theta) = J_prior;
  stack.topRightCorner(row, 1) = r_prior;
  for (const RowMatrixXd& factor : factors) {
    stack.middleRows(row, factor.rows()) = factor;
    row += static_cast<int>(factor.rows());
  }
  return TriangularFactor(stack).topRows(n_theta);
}

}  // namespace sysid
