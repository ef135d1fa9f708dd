#include "sysid/diagnosis/unexplained_force.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "sysid/diagnosis/force_knots.h"
#include "sysid/diagnosis/force_regression.h"
#include "sysid/diagnosis/smooth_force.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSignificant = 0.01;

// Blocks that hold whole knots, at least two each, so that every segment lies
// in two neighbours.
std::vector<int> CutBlocks(const std::vector<KnotRange>& segments, int knots,
                           int nv) {
  std::vector<int> cuts = {0};
  const auto cut = [&](int at) {
    if (at >= cuts.back() + 2 && at + 2 <= knots) cuts.push_back(at);
  };
  for (const KnotRange& range : segments) {
    cut(range.first);  // after a gap
    cut(range.last + 1);
  }
  cuts.push_back(knots);
  for (int& at : cuts) at *= nv;
  return cuts;
}

// The forces of a hat function at each knot, on each degree of freedom.
ParameterForces Hats(const ForceKnots& knots, const KnotRange& range,
                     const Run& run, const LinearizedFit::Segment& segment,
                     int nv) {
  ParameterForces forces =
      ParameterForces::Zero(*segment.rollout, range.size() * nv);
  for (size_t i = 0; i < forces.f.size(); ++i) {
    const double t =
        Middle(run, segment.rollout->first() + static_cast<int>(i));
    for (int k = range.first; k <= range.last; ++k) {
      const double weight = knots.Weight(k, t);
      for (int d = 0; d < nv && weight > 0; ++d) {
        forces.f[i](d, (k - range.first) * nv + d) = weight;
      }
    }
  }
  return forces;
}

ForceEquations Assemble(const LinearizedFit& fit,
                        const std::vector<ForceKnots>& knots) {
  const ShootingProblem& problem = fit.problem();
  const int nv = problem.model().nv();
  const auto& segments = fit.segments();
  const int count = static_cast<int>(segments.size());
  std::vector<KnotRange> ranges(count);
  std::vector<MatrixXd> products(count);
  std::vector<VectorXd> gradients(count);
  std::vector<double> squares(count);
  ParallelFor(count, problem.options().threads, [&](int s) {
    const LinearizedFit::Segment& at = *segments[s];
    const Run& run = problem.runs()[at.run]->run;
    ranges[s] = RangeOf(knots[at.run], run, at);
    const MatrixXd A = fit.WithoutStates(
        at, fit.Respond(at, Hats(knots[at.run], ranges[s], run, at, nv)));
    // Theta is held: a force that it could stand for is still to be shown.
    const VectorXd r =
        fit.WithoutStates(at, at.weight.asDiagonal() * at.tangent.r);
    products[s].setZero(A.cols(), A.cols());
    products[s].selfadjointView<Eigen::Lower>().rankUpdate(A.transpose());
    products[s] = products[s].selfadjointView<Eigen::Lower>();
    gradients[s] = A.transpose() * r;
    squares[s] = r.squaredNorm();
    return true;
  });
  ForceEquations equations;
  equations.dof = fit.DegreesOfFreedom();
  for (const Body& body : problem.model().bodies()) {
    const int size = VelocitySize(body.type);
    equations.group.insert(equations.group.end(), size, equations.groups);
    ++equations.groups;
  }
  for (size_t r = 0; r < knots.size(); ++r) {
    ForceEquations::Run run;
    run.knots = knots[r].count;
    std::vector<KnotRange> own;
    for (int s = 0; s < count; ++s) {
      if (segments[s]->run == static_cast<int>(r)) own.push_back(ranges[s]);
    }
    run.G = BlockTridiagonal::Zero(CutBlocks(own, run.knots, nv));
    run.g = VectorXd::Zero(run.G.size());
    equations.runs.push_back(std::move(run));
  }
  for (int s = 0; s < count; ++s) {
    ForceEquations::Run& run = equations.runs[segments[s]->run];
    const int row = ranges[s].first * nv;
    run.G.Add(row, products[s]);
    run.g.segment(row, gradients[s].size()) += gradients[s];
    equations.squares += squares[s];
  }
  return equations;
}

std::vector<ForceCurve> CurvesOf(const LinearizedFit& fit,
                                 const std::vector<ForceKnots>& knots,
                                 const SmoothForce& force, const Body& body) {
  const ShootingProblem& problem = fit.problem();
  std::vector<ForceCurve> curves;
  for (int c = 0; c < VelocitySize(body.type); ++c) {
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
  const auto& bodies = fit.problem().model().bodies();
  const std::vector<ForceKnots> knots = PlaceKnots(fit);
  const ForceEquations equations = Assemble(fit, knots);
  const SmoothForce force(equations);
  for (size_t b = 0; b < bodies.size(); ++b) {
    const int group = static_cast<int>(b);
    if (!force.Seen(group)) continue;
    std::vector<ForceCurve> curves = CurvesOf(fit, knots, force, bodies[b]);
    JointForce joint = Summarize(curves);
    joint.p_value = std::min(1.0, force.PValue(group) * bodies.size());
    joint.significant = joint.p_value < kSignificant;
    out.joints.push_back(joint);
    std::move(curves.begin(), curves.end(), std::back_inserter(out.curves));
    if (!joint.significant) continue;
    for (ForceRegression& law : RegressForce(fit, knots, force, group)) {
      out.regression.push_back(std::move(law));
    }
  }
  return out;
}

}  // namespace sysid
