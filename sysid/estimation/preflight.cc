#include "sysid/estimation/preflight.h"

#include <cmath>

#include "models/dynamics.h"
#include "models/error.h"
#include "sysid/estimation/linearization.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/state_weights.h"

namespace sysid {
namespace {

// theta moved a little inside its bounds: what has no influence there either
// has none.
Eigen::VectorXd Nudged(const ShootingProblem& problem,
                       const Eigen::VectorXd& theta) {
  Eigen::VectorXd nudged = theta;
  for (size_t i = 0; i < problem.free().size(); ++i) {
    const FreeParameter& free = problem.free()[i];
    const double delta = problem.map().IsTransformed(i)
                             ? 0.01
                             : 0.01 * free.parameter.typical_scale;
    nudged[i] += nudged[i] + delta <= free.upper ? delta : -delta;
  }
  return nudged;
}

// A full change of its own size that moves all residuals together by less than
// a millionth of the noise is none.
bool HasInfluence(const ShootingProblem& problem, int i, double square) {
  return std::sqrt(square) * problem.free()[i].parameter.typical_scale > 1e-6;
}

// Whether every parameter changes a measured residual at theta: all but always,
// and the cheaper question.
bool AllHaveInfluence(const ShootingProblem& problem, const Solution& point,
                      ShootingSegments* segments) {
  const std::vector<SegmentPlace> all = AllSegments(point);
  const bool ok =
      ParallelFor(all.size(), problem.options().threads, [&](int i) {
        const auto [run, k] = all[i];
        return segments->at(run, k)->Linearize(
            point.runs[run].states.row(k).data(), point.theta.data(),
            ShootingSegment::Columns::kBoth);
      });
  if (!AllTrue(problem.processes(), ok)) return false;
  const int n = problem.map().size();
  Totals totals(n);
  for (const auto& [run, k] : all) {
    const RowMatrixXd& R = segments->at(run, k)->R();
    totals.Add(0, R.rightCols(n).colwise().squaredNorm());
  }
  const Eigen::VectorXd squares = totals.Over(problem.processes());
  for (int i = 0; i < n; ++i) {
    if (!HasInfluence(problem, i, squares[i])) return false;
  }
  return true;
}

// Names of the parameters that change no residual, at theta or beside it.
std::vector<std::string> WithoutInfluence(const ShootingProblem& problem,
                                          const Solution& point,
                                          ShootingSegments* segments) {
  if (AllHaveInfluence(problem, point, segments)) return {};
  const int n = problem.map().size();
  Totals totals(n);
  bool known = false;
  for (const bool nudge : {false, true}) {
    Solution at = point;
    if (nudge) at.theta = Nudged(problem, point.theta);
    std::vector<RunLinearization> runs;
    if (!Linearize(problem, at, {.defect = kLooseDefect}, &runs)) continue;
    known = true;
    for (const RunLinearization& run : runs) {
      for (const SegmentLinearization& segment : run.segments) {
        if (segment.J_theta.rows() == 0) continue;
        totals.Add(0, segment.J_theta.colwise().squaredNorm());
      }
    }
  }
  const Eigen::VectorXd norms = totals.Over(problem.processes());
  std::vector<std::string> names;
  for (int i = 0; known && i < n; ++i) {
    if (!HasInfluence(problem, i, norms[i])) {
      names.push_back(problem.free()[i].parameter.name);
    }
  }
  return names;
}

// Why the model cannot be rolled out at theta, else "".
std::string WhyImmobile(const ShootingProblem& problem,
                        const Eigen::VectorXd& theta) {
  const std::string link = problem.map().FirstImpossibleLink(theta.data());
  if (!link.empty()) {
    return "link '" + link +
           "' is no possible body at the start: check its "
           "mass and its moments of inertia";
  }
  MechanismParameters<double> values;
  problem.map().Apply<double>(theta.data(), &values);
  Model start = problem.model();
  start.SetNominal(values);
  return Join(TextsOf(SingularJoints(start)), "; ");
}

}  // namespace

std::string WhyHopeless(const ShootingProblem& problem, const Solution& point,
                        ShootingSegments* segments) {
  const std::string immobile = WhyImmobile(problem, point.theta);
  if (!immobile.empty()) return immobile;
  const std::vector<std::string> without_influence =
      WithoutInfluence(problem, point, segments);
  // Some of many stay where they are, and are listed as not determined.
  if (without_influence.empty() ||
      without_influence.size() < problem.free().size()) {
    return "";
  }
  const bool one = without_influence.size() == 1;
  return std::string(one ? "parameter '" : "parameters '") +
         Join(without_influence, "', '") +
         "' without any influence on what was measured; fix " +
         (one ? "it" : "them");
}

}  // namespace sysid
