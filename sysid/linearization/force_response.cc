#include "sysid/linearization/force_response.h"

#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

constexpr double kSamplesPerKnot = 4.0;
constexpr double kMostKnots = 400.0;  // of a run
// Of a segment, over all degrees of freedom: what their products cost grows
// with the square.
constexpr double kMostColumns = 160.0;

std::vector<ForceKnots> PlaceKnots(const LinearizedFit& fit) {
  const ShootingProblem& problem = fit.problem();
  double longest = 0.0;
  for (const auto& segment : fit.segments()) {
    const std::vector<double>& t = problem.runs()[segment->run]->run.t;
    longest = std::max(
        longest, t[segment->rollout->last()] - t[segment->rollout->first()]);
  }
  longest = MaxOver(problem.processes(), longest);
  const double spacing =
      std::max({kSamplesPerKnot * problem.data().MedianSamplePeriod(),
                problem.data().LongestDuration() / kMostKnots,
                longest * problem.model().nv() / kMostColumns});
  std::vector<ForceKnots> all;
  for (const auto& data : problem.runs()) {
    const double duration = data->run.t.back() - data->run.t.front();
    ForceKnots knots;
    knots.start = data->run.t.front();
    knots.count =
        std::max(3, static_cast<int>(std::ceil(duration / spacing)) + 1);
    knots.spacing = duration / (knots.count - 1);
    all.push_back(knots);
  }
  return all;
}

// The columns that are not zero all along: what a measurement alone tells of
// moves nothing.
std::vector<int> ActingColumns(const ParameterForces& forces) {
  Eigen::RowVectorXd most = Eigen::RowVectorXd::Zero(forces.direct.cols());
  for (const RowMatrixXd& f : forces.f) {
    most = most.cwiseMax(f.cwiseAbs().colwise().maxCoeff());
  }
  std::vector<int> acting;
  for (int c = 0; c < most.size(); ++c) {
    if (most[c] != 0.0) acting.push_back(c);
  }
  return acting;
}

}  // namespace

ForceResponse::ForceResponse(const LinearizedFit& fit)
    : fit_(fit), tangents_(fit.segments().size()), knots_(PlaceKnots(fit)) {
  const bool mine = ParallelFor(
      static_cast<int>(tangents_.size()), fit.problem().options().threads,
      fit.problem().options().stop, [&](int s) {
        const LinearizedFit::Segment& segment = *fit.segments()[s];
        return LinearizeAlong(*segment.rollout, fit.StateOf(segment),
                              fit.point().theta.data(), &tangents_[s]);
      });
  valid_ = AllTrue(fit.problem().processes(), mine);
}

double ForceResponse::Middle(int s, int i) const {
  const double* t = &RunOf(s).t[fit_.segments()[s]->rollout->first() + i];
  return 0.5 * (t[0] + t[1]);
}

Eigen::MatrixXd ForceResponse::Respond(int s,
                                       const ParameterForces& forces) const {
  const LinearizedFit::Segment& segment = *fit_.segments()[s];
  const SegmentRollout& rollout = *segment.rollout;
  const SegmentTangent& tangent = tangents_[s];
  const std::vector<int> acting = ActingColumns(forces);
  const int columns = static_cast<int>(acting.size());
  const int n = fit_.problem().model().tangent_size();
  RowMatrixXd moved = RowMatrixXd::Zero(forces.direct.rows(), columns);
  RowMatrixXd dx = RowMatrixXd::Zero(n, columns), next(n, columns);
  const std::vector<SegmentRow>& rows = rollout.rows();
  size_t row = 0;
  for (int k = rollout.first(); k <= rollout.last(); ++k) {
    for (; row < rows.size() && rows[row].sample == k; ++row) {
      const int last = rows[row].first + rows[row].size;
      for (int e = rows[row].first; e < last; ++e) {
        // Of most sensors one joint's position is all that they see.
        for (int j = 0; j < n; ++j) {
          const double c = tangent.C(e, j);
          if (c != 0.0) moved.row(e) += c * dx.row(j);
        }
      }
    }
    if (k == rollout.last()) break;
    const int i = k - rollout.first();
    next.noalias() = tangent.A[i] * dx;
    next.noalias() += tangent.B[i] * forces.f[i](Eigen::all, acting);
    dx.swap(next);
  }
  RowMatrixXd out = forces.direct;
  out(Eigen::all, acting) += moved;
  return fit_.Whiten(segment, std::move(out));
}

}  // namespace sysid
