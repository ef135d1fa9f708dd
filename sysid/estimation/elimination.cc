#include "sysid/estimation/elimination.h"

#include <algorithm>

#include "models/math/decompositions.h"
#include "sysid/estimation/parallel.h"

namespace sysid {

RowMatrixXd TriangularFactor(const RowMatrixXd& rows) {
  return HouseholderTriangle(rows);
}

RunReduction::RunReduction(const RunLinearization& run,
                           const Eigen::VectorXd& state_damping) {
  const int tangent = static_cast<int>(run.J_prior.cols());
  const int n_theta = static_cast<int>(run.segments.front().J_theta.cols());
  const int damped = static_cast<int>(state_damping.size());
  // Rows [x_k | theta | r] of what is known of the state so far.
  RowMatrixXd past = RowMatrixXd::Zero(tangent, tangent + n_theta + 1);
  past.leftCols(tangent) = run.J_prior;
  past.col(tangent + n_theta) = run.r_prior;
  root_.resize(0, n_theta + 1);
  for (const SegmentLinearization& segment : run.segments) {
    const bool last = segment.J_next.size() == 0;
    const int next = last ? 0 : tangent;
    const int rows = static_cast<int>(segment.J_x.rows());
    const int width = tangent + next + n_theta + 1;
    const int before = static_cast<int>(past.rows());
    RowMatrixXd stack = RowMatrixXd::Zero(before + rows + damped, width);
    stack.topLeftCorner(before, tangent) = past.leftCols(tangent);
    stack.topRightCorner(before, n_theta + 1) = past.rightCols(n_theta + 1);
    if (rows > 0) {
      stack.block(before, 0, rows, tangent) = segment.J_x;
      if (!last) stack.block(before, tangent, rows, next) = segment.J_next;
      stack.block(before, tangent + next, rows, n_theta) = segment.J_theta;
      stack.block(before, width - 1, rows, 1) = segment.r;
    }
    if (damped > 0) {
      stack.block(before + rows, 0, damped, tangent) =
          state_damping.asDiagonal();
    }
    const RowMatrixXd R = TriangularFactor(stack);
    const int below = std::min<int>(tangent, R.rows());
    states_.push_back({R.topLeftCorner(below, tangent),
                       R.block(0, tangent, below, next),
                       R.block(0, tangent + next, below, n_theta),
                       R.topRightCorner(below, 1)});
    // Independent segments: the next starts from nothing but its own data.
    const int carried = last ? 0 : std::min<int>(2 * tangent, R.rows()) - below;
    past = R.block(below, tangent, carried, width - tangent);
    if (last) past.setZero(0, tangent + n_theta + 1);
    root_ = MergeRoots(
        {root_, R.bottomRightCorner(R.rows() - below - carried, n_theta + 1)});
  }
}

RowMatrixXd RunReduction::SubstituteBack(const Eigen::VectorXd& dtheta) const {
  const int tangent = static_cast<int>(states_.front().R.cols());
  RowMatrixXd dx(states_.size(), tangent);
  for (int k = static_cast<int>(states_.size()) - 1; k >= 0; --k) {
    const StateRows& state = states_[k];
    Eigen::VectorXd b = -(state.theta * dtheta + state.z);
    if (state.next.cols() > 0) b -= state.next * dx.row(k + 1).transpose();
    dx.row(k) = state.R.triangularView<Eigen::Upper>().solve(b).transpose();
  }
  return dx;
}

RowMatrixXd MergeRoots(const std::vector<RowMatrixXd>& roots) {
  int rows = 0;
  for (const RowMatrixXd& root : roots) rows += static_cast<int>(root.rows());
  RowMatrixXd stack(rows, roots.front().cols());
  int row = 0;
  for (const RowMatrixXd& root : roots) {
    stack.middleRows(row, root.rows()) = root;
    row += static_cast<int>(root.rows());
  }
  return TriangularFactor(stack);
}

RowMatrixXd MergeRoots(const Processes& all,
                       const std::vector<RowMatrixXd>& roots) {
  const RowMatrixXd own = MergeRoots(roots);
  if (all.size() == 1) return own;
  Packer packer;
  packer.Put(own);
  std::vector<RowMatrixXd> others;
  for (const std::string& bytes : all.Gather(packer.bytes())) {
    others.push_back(Unpacker(bytes).Matrix());
  }
  Packer merged;
  if (!others.empty()) merged.Put(MergeRoots(others));
  const std::string bytes = all.Share(merged.bytes());
  return Unpacker(bytes).Matrix();
}

RowMatrixXd EliminateStates(const std::vector<RunLinearization>& runs,
                            const RowMatrixXd& J_prior,
                            const Eigen::VectorXd& r_prior, int threads,
                            const Processes& all) {
  const int n_theta = static_cast<int>(J_prior.cols());
  std::vector<RowMatrixXd> roots(runs.size());
  ParallelFor(static_cast<int>(runs.size()), threads, [&](int r) {
    roots[r] = RunReduction(runs[r]).root();
    return true;
  });
  if (all.rank() == 0) {
    RowMatrixXd prior(J_prior.rows(), n_theta + 1);
    prior << J_prior, r_prior;
    roots.push_back(prior);
  }
  // Square, also where the data says little.
  roots.push_back(RowMatrixXd::Zero(n_theta, n_theta + 1));
  return MergeRoots(all, roots).topRows(n_theta);
}

}  // namespace sysid
