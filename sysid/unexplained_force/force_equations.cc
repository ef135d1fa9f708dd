#include "sysid/unexplained_force/force_equations.h"

#include <algorithm>

#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct KnotRange {
  int first = 0, last = 0;
  int size() const { return last - first + 1; }
};

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

// The knots that the intervals of a segment see, [first, last].
KnotRange RangeOf(const ForceResponse& response, int s) {
  const ForceKnots& knots = response.KnotsOf(s);
  const int intervals = static_cast<int>(response.tangent(s).middle.rows());
  return {knots.Before(response.Middle(s, 0)),
          std::min(knots.count - 1,
                   knots.Before(response.Middle(s, intervals - 1)) + 1)};
}

// The forces of a hat function at each knot, on each degree of freedom.
ParameterForces Hats(const ForceResponse& response, int s,
                     const KnotRange& range) {
  const int nv = response.fit().problem().model().nv();
  ParameterForces forces = ParameterForces::Zero(
      *response.fit().segments()[s]->rollout, range.size() * nv);
  for (size_t i = 0; i < forces.f.size(); ++i) {
    response.KnotsOf(s).Around(
        response.Middle(s, static_cast<int>(i)), [&](int k, double weight) {
          forces.f[i].middleCols((k - range.first) * nv, nv) =
              weight * MatrixXd::Identity(nv, nv);
        });
  }
  return forces;
}

// The products [A Theta r]' [A Theta r] of a segment, of the forces at its
// knots.
MatrixXd ProductsOf(const ForceResponse& response, int s,
                    const KnotRange& range) {
  const LinearizedFit& fit = response.fit();
  const LinearizedFit::Segment& at = *fit.segments()[s];
  const MatrixXd A =
      fit.WithoutStates(at, response.Respond(s, Hats(response, s, range)));
  MatrixXd all(A.rows(), A.cols() + at.theta.cols() + 1);
  all << A, at.theta, fit.WithoutStates(at, at.whitened);
  MatrixXd products = MatrixXd::Zero(all.cols(), all.cols());
  products.selfadjointView<Eigen::Lower>().rankUpdate(all.transpose());
  return products.selfadjointView<Eigen::Lower>();
}

}  // namespace

ForceEquations MakeForceEquations(const ForceResponse& response) {
  // Keeps parameters where they are that the data does not tell of.
  constexpr double kHold = 1e-10;
  const LinearizedFit& fit = response.fit();
  const ShootingProblem& problem = fit.problem();
  const int nv = problem.model().nv(), free = problem.map().size();
  const auto& segments = fit.segments();
  const int count = static_cast<int>(segments.size());
  std::vector<KnotRange> ranges(count);
  std::vector<MatrixXd> products(count);
  ParallelFor(count, problem.options().threads, problem.options().stop,
              [&](int s) {
                ranges[s] = RangeOf(response, s);
                products[s] = ProductsOf(response, s, ranges[s]);
                return true;
              });
  ForceEquations equations;
  equations.dof = fit.DegreesOfFreedom();
  equations.processes = &problem.processes();
  Totals totals(free * free + free + 1);  // N, t, squares
  equations.nv = nv;
  for (size_t r = 0; r < response.knots().size(); ++r) {
    ForceEquations::Run run;
    run.knots = response.knots()[r].count;
    std::vector<KnotRange> own;
    for (int s = 0; s < count; ++s) {
      if (segments[s]->run == static_cast<int>(r)) own.push_back(ranges[s]);
    }
    run.G = BlockTridiagonal::Zero(CutBlocks(own, run.knots, nv));
    run.C = MatrixXd::Zero(run.G.size(), free);
    run.g = VectorXd::Zero(run.G.size());
    equations.runs.push_back(std::move(run));
  }
  for (int s = 0; s < count; ++s) {
    const MatrixXd& K = products[s];
    const int row = ranges[s].first * nv, size = ranges[s].size() * nv;
    ForceEquations::Run& run = equations.runs[segments[s]->run];
    run.G.Add(row, K.topLeftCorner(size, size));
    run.C.middleRows(row, size) += K.block(0, size, size, free);
    run.g.segment(row, size) += K.col(size + free).head(size);
    totals.Add(0, K.block(size, size, free, free));
    totals.Add(free * free, K.col(size + free).segment(size, free));
    totals.Add(free * free + free, K(size + free, size + free));
  }
  const VectorXd sums = totals.Over(problem.processes());
  equations.N = sums.head(free * free).reshaped(free, free);
  equations.t = sums.segment(free * free, free);
  equations.squares = sums[free * free + free];
  for (int i = 0; i < free; ++i) {
    double& own = equations.N(i, i);
    const auto& prior = problem.free()[i].prior;
    if (prior) own += 1.0 / (prior->std * prior->std);
    own = own > 0 ? own * (1.0 + kHold) : 1.0;
  }
  return equations;
}

}  // namespace sysid
