#include "sysid/diagnosis/forced_motion.h"

#include <algorithm>

#include "models/state.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

using Eigen::VectorXd;

// The force over each interval of a segment, and what the parameters change.
ParameterForces ForcesOf(const ForceResponse& response, int s,
                         const ForceKnots& knots, const RowMatrixXd& values,
                         const VectorXd& dtheta) {
  const LinearizedFit& fit = response.fit();
  const LinearizedFit::Segment& segment = *fit.segments()[s];
  const ShootingProblem& problem = fit.problem();
  const Run& run = problem.runs()[segment.run]->run;
  const ParameterForces by_theta =
      ForcesOfParameters(problem.model(), problem.map(), fit.point().theta,
                         *segment.rollout, response.tangent(s));
  ParameterForces forces = ParameterForces::Zero(*segment.rollout, 1);
  forces.direct = by_theta.direct * dtheta;
  for (size_t i = 0; i < forces.f.size(); ++i) {
    forces.f[i] = by_theta.f[i] * dtheta;
    const double t =
        Middle(run, segment.rollout->first() + static_cast<int>(i));
    const int below = static_cast<int>(knots.Place(t));
    for (int k = below; k <= std::min(below + 1, knots.count - 1); ++k) {
      forces.f[i].col(0) += knots.Weight(k, t) * values.row(k).transpose();
    }
  }
  return forces;
}

ForcedMotion MoveSegment(const ForceResponse& response, int s,
                         const ParameterForces& forces) {
  const LinearizedFit& fit = response.fit();
  const LinearizedFit::Segment& segment = *fit.segments()[s];
  const Model& model = fit.problem().model();
  const SegmentTangent& tangent = response.tangent(s);
  const Run& run = fit.problem().runs()[segment.run]->run;
  const StateLayout& at = model.layout();
  VectorXd dx = fit.StateAgainst(
      segment, segment.whitened + response.Respond(s, forces).col(0));
  ForcedMotion motion{tangent.middle, tangent.acceleration};
  for (int i = 0; i < tangent.middle.rows(); ++i) {
    const int k = segment.rollout->first() + i;
    const VectorXd next = tangent.A[i] * dx + tangent.B[i] * forces.f[i];
    const VectorXd middle = 0.5 * (dx + next);
    BoxPlus<double>(model, tangent.middle.row(i).data(), middle.data(),
                    motion.middle.row(i).data());
    motion.acceleration.row(i) +=
        (next - dx).segment(at.dqd(), at.nv()).transpose() /
        (run.t[k + 1] - run.t[k]);
    dx = next;
  }
  return motion;
}

}  // namespace

std::vector<ForcedMotion> MoveWith(const ForceResponse& response,
                                   const std::vector<ForceKnots>& knots,
                                   const SmoothForce& force) {
  std::vector<RowMatrixXd> values;
  for (size_t r = 0; r < knots.size(); ++r) {
    values.push_back(force.Values(static_cast<int>(r)));
  }
  const LinearizedFit& fit = response.fit();
  const auto& segments = fit.segments();
  std::vector<ForcedMotion> motions(segments.size());
  ParallelFor(static_cast<int>(segments.size()),
              fit.problem().options().threads, [&](int s) {
                const int run = segments[s]->run;
                motions[s] =
                    MoveSegment(response, s,
                                ForcesOf(response, s, knots[run], values[run],
                                         force.ParameterChange()));
                return true;
              });
  return motions;
}

}  // namespace sysid
