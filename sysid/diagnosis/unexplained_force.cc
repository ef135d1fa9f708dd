#include "sysid/diagnosis/unexplained_force.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "sysid/diagnosis/force_knots.h"
#include "sysid/diagnosis/force_regression.h"
#include "sysid/diagnosis/force_response.h"
#include "sysid/diagnosis/smooth_force.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of a p-value: the noise is never quite what the likelihood takes it for.
constexpr double kSignificant = 1e-3;
// A force that does less than this part of what all do is what is left of
// another's.
constexpr double kMaterial = 0.05;

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

// What a segment says of its knots and of the parameters.
struct SegmentProducts {
  KnotRange range;
  MatrixXd G, C, N;
  VectorXd g, t;
  double squares = 0.0;
};

SegmentProducts ProductsOf(const ForceResponse& response, int s,
                           const ForceKnots& knots) {
  const LinearizedFit& fit = response.fit();
  const LinearizedFit::Segment& at = *fit.segments()[s];
  const Run& run = fit.problem().runs()[at.run]->run;
  SegmentProducts out;
  out.range = RangeOf(knots, run, at);
  const MatrixXd A = fit.WithoutStates(
      at, response.Respond(
              s, Hats(knots, out.range, run, at, fit.problem().model().nv())));
  const VectorXd r = fit.WithoutStates(at, at.whitened);
  out.G.setZero(A.cols(), A.cols());
  out.G.selfadjointView<Eigen::Lower>().rankUpdate(A.transpose());
  out.G = out.G.selfadjointView<Eigen::Lower>();
  out.C.noalias() = A.transpose() * at.theta;
  out.N.noalias() = at.theta.transpose() * at.theta;
  out.g.noalias() = A.transpose() * r;
  out.t.noalias() = at.theta.transpose() * r;
  out.squares = r.squaredNorm();
  return out;
}

ForceEquations Assemble(const ForceResponse& response,
                        const std::vector<ForceKnots>& knots) {
  // Keeps parameters where they are that the data does not tell of.
  constexpr double kHold = 1e-10;
  const LinearizedFit& fit = response.fit();
  const ShootingProblem& problem = fit.problem();
  const int nv = problem.model().nv(), free = problem.map().size();
  const auto& segments = fit.segments();
  const int count = static_cast<int>(segments.size());
  std::vector<SegmentProducts> products(count);
  ParallelFor(count, problem.options().threads, problem.options().stop,
              [&](int s) {
                products[s] = ProductsOf(response, s, knots[segments[s]->run]);
                return true;
              });
  ForceEquations equations;
  equations.dof = fit.DegreesOfFreedom();
  equations.N = MatrixXd::Zero(free, free);
  equations.t = VectorXd::Zero(free);
  equations.nv = nv;
  for (size_t r = 0; r < knots.size(); ++r) {
    ForceEquations::Run run;
    run.knots = knots[r].count;
    std::vector<KnotRange> own;
    for (int s = 0; s < count; ++s) {
      if (segments[s]->run == static_cast<int>(r)) {
        own.push_back(products[s].range);
      }
    }
    run.G = BlockTridiagonal::Zero(CutBlocks(own, run.knots, nv));
    run.C = MatrixXd::Zero(run.G.size(), free);
    run.g = VectorXd::Zero(run.G.size());
    equations.runs.push_back(std::move(run));
  }
  for (int s = 0; s < count; ++s) {
    const SegmentProducts& product = products[s];
    ForceEquations::Run& run = equations.runs[segments[s]->run];
    const int row = product.range.first * nv;
    run.G.Add(row, product.G);
    run.C.middleRows(row, product.C.rows()) += product.C;
    run.g.segment(row, product.g.size()) += product.g;
    equations.N += product.N;
    equations.t += product.t;
    equations.squares += product.squares;
  }
  for (int i = 0; i < free; ++i) {
    double& own = equations.N(i, i);
    const auto& prior = problem.free()[i].prior;
    if (prior) own += 1.0 / (prior->std * prior->std);
    own = own > 0 ? own * (1.0 + kHold) : 1.0;
  }
  return equations;
}

std::vector<ForceCurve> CurvesOf(const LinearizedFit& fit,
                                 const std::vector<ForceKnots>& knots,
                                 const SmoothForce& force, const Body& body) {
  const ShootingProblem& problem = fit.problem();
  std::vector<ForceCurve> curves;
  for (int c = 0; c < VelocitySize(body.type); ++c) {
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
  const auto& bodies = fit.problem().model().bodies();
  const ForceResponse response(fit);
  if (!response.Valid()) return out;
  const std::vector<ForceKnots> knots = PlaceKnots(fit);
  const ForceEquations equations = Assemble(response, knots);
  const SmoothForce force(equations);
  out.variance = force.variance();
  std::vector<ForcedMotion> motions;
  for (const Body& body : bodies) {
    std::vector<ForceCurve> curves = CurvesOf(fit, knots, force, body);
    if (curves.empty()) continue;
    JointForce joint = Summarize(curves);
    const SmoothForce::Weight weight =
        force.WeightOf(body.v_index, VelocitySize(body.type));
    joint.p_value = std::min(1.0, weight.p_value * bodies.size());
    joint.share = weight.share;
    joint.significant = joint.p_value < kSignificant && joint.share > kMaterial;
    out.joints.push_back(joint);
    std::move(curves.begin(), curves.end(), std::back_inserter(out.curves));
    if (!joint.significant) continue;
    if (motions.empty()) motions = MoveWith(response, knots, force);
    for (ForceRegression& law :
         RegressForce(fit, knots, force, motions, body)) {
      out.regression.push_back(std::move(law));
    }
  }
  return out;
}

}  // namespace sysid
