#include "sysid/unexplained_force/unexplained_force.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "sysid/linearization/force_response.h"
#include "sysid/unexplained_force/force_equations.h"
#include "sysid/unexplained_force/force_regression.h"
#include "sysid/unexplained_force/smooth_force.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of a p-value: the noise is never quite what the likelihood takes it for.
constexpr double kSignificantForce = 1e-3;
// A force that does less than this part of what all do is what is left of
// another's.
constexpr double kMaterialShare = 0.05;

std::vector<ForceCurve> CurvesOf(const ForceResponse& response,
                                 const SmoothForce& force, const Body& body) {
  const ShootingProblem& problem = response.fit().problem();
  const std::vector<ForceKnots>& knots = response.knots();
  std::vector<ForceCurve> curves;
  for (int c = 0; c < VelocitySize(body); ++c) {
    if (!force.Seen(body.v_index + c)) continue;
    for (size_t r = 0; r < knots.size(); ++r) {
      const RowMatrixXd values = force.Values(static_cast<int>(r));
      const RowMatrixXd deviations = force.Deviations(static_cast<int>(r));
      ForceCurve curve;
      curve.joint = problem.model().mechanism().joints[body.joint].name;
      if (body.type == JointType::kSpherical) curve.component = "xyz"[c];
      curve.unit = body.type == JointType::kPrismatic ? "N" : "N m";
      curve.trajectory = problem.runs()[r]->run.name;
      for (int k = 0; k < knots[r].count; ++k) {
        curve.t.push_back(knots[r].Time(k));
        curve.value.push_back(values(k, body.v_index + c));
        curve.std.push_back(deviations(k, body.v_index + c));
      }
      curves.push_back(std::move(curve));
    }
  }
  return curves;
}

JointForce Summarize(const std::vector<ForceCurve>& curves) {
  JointForce joint;
  joint.joint = curves.front().joint;
  joint.unit = curves.front().unit;
  double count = 0.0;
  for (const ForceCurve& curve : curves) {
    for (size_t k = 0; k < curve.t.size(); ++k) {
      joint.rms += curve.value[k] * curve.value[k];
      joint.std += curve.std[k] * curve.std[k];
      count += 1.0;
    }
  }
  joint.rms = std::sqrt(joint.rms / count);
  joint.std = std::sqrt(joint.std / count);
  return joint;
}

}  // namespace

UnexplainedForce EstimateForce(const LinearizedFit& fit) {
  UnexplainedForce out;
  if (!fit.Valid() || fit.segments().empty()) return out;
  const auto& bodies = fit.problem().model().movers();
  const ForceResponse response(fit);
  if (!response.Valid()) return out;
  const ForceEquations equations = MakeForceEquations(response);
  const SmoothForce force(equations);
  if (!force.Valid()) return out;
  out.variance = force.variance();
  out.before = std::max(1.0, equations.squares / equations.dof);
  std::vector<const Body*> moved;  // by forces that are significant
  for (const Body& body : bodies) {
    std::vector<ForceCurve> curves = CurvesOf(response, force, body);
    if (curves.empty()) continue;
    JointForce joint = Summarize(curves);
    const SmoothForce::Weight weight =
        force.WeightOf(body.v_index, VelocitySize(body));
    joint.p_value = std::min(1.0, weight.p_value * bodies.size());
    joint.share = weight.share;
    joint.significant =
        joint.p_value < kSignificantForce && joint.share > kMaterialShare;
    out.joints.push_back(joint);
    std::move(curves.begin(), curves.end(), std::back_inserter(out.curves));
    if (joint.significant) moved.push_back(&body);
  }
  out.regression = RegressForces(response, force, moved);
  return out;
}

}  // namespace sysid
