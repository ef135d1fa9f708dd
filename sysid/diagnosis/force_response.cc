#include "sysid/diagnosis/force_response.h"

#include "sysid/estimation/parallel.h"

namespace sysid {

ForceResponse::ForceResponse(const LinearizedFit& fit)
    : fit_(fit), tangents_(fit.segments().size()) {
  valid_ = ParallelFor(
      static_cast<int>(tangents_.size()), fit.problem().options().threads,
      fit.problem().options().stop, [&](int s) {
        const LinearizedFit::Segment& segment = *fit.segments()[s];
        return LinearizeAlong(*segment.rollout, fit.StateOf(segment),
                              fit.point().theta.data(), &tangents_[s]);
      });
}

Eigen::MatrixXd ForceResponse::Respond(int s,
                                       const ParameterForces& forces) const {
  const LinearizedFit::Segment& segment = *fit_.segments()[s];
  const SegmentRollout& rollout = *segment.rollout;
  const SegmentTangent& tangent = tangents_[s];
  const int columns = static_cast<int>(forces.direct.cols());
  const int n = fit_.problem().model().tangent_size();
  RowMatrixXd out = forces.direct;
  RowMatrixXd dx = RowMatrixXd::Zero(n, columns), next(n, columns);
  const std::vector<SegmentRow>& rows = rollout.rows();
  size_t row = 0;
  int first = 0;
  for (int k = rollout.first(); k <= rollout.last(); ++k) {
    int size = 0;  // errors at this sample
    for (; row < rows.size() && rows[row].sample == k; ++row) {
      size += rows[row].size;
    }
    out.middleRows(first, size).noalias() +=
        tangent.C.middleRows(first, size) * dx;
    first += size;
    if (k == rollout.last()) break;
    const int i = k - rollout.first();
    next.noalias() = tangent.A[i] * dx;
    next.noalias() += tangent.B[i] * forces.f[i];
    dx.swap(next);
  }
  return fit_.Whiten(segment, std::move(out));
}

}  // namespace sysid
