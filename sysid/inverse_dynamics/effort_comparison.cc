#include "sysid/inverse_dynamics/effort_comparison.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "sysid/estimation/parallel.h"
#include "sysid/inverse_dynamics/motion.h"
#include "sysid/inverse_dynamics/regression.h"

namespace sysid {

bool MeasuresAllJoints(const ShootingProblem& problem) {
  const bool mine = std::all_of(
      problem.runs().begin(), problem.runs().end(), [&](const auto& data) {
        return UnmeasuredJoints(problem.model(), data->run).empty();
      });
  return AllTrue(problem.processes(), mine);
}

EffortComparison CompareEfforts(const ShootingProblem& problem,
                                const Eigen::VectorXd& theta) {
  const Model& model = problem.model();
  if (model.layout().nz() > 0) return {};  // not carried
  if (!MeasuresAllJoints(problem)) return {};
  MechanismParameters<double> values;
  problem.map().Apply<double>(theta.data(), &values);
  const EquationFilter filter = ChooseFilter(problem, values);
  const int threads = ThreadsOfEach(static_cast<int>(problem.runs().size()),
                                    problem.options().threads);
  EffortComparison comparison = CompareEffortsBy(problem, [&](int r) {
    return EvaluateEquations(
        model, SampleMotion(model, problem.runs()[r]->run, filter, threads),
        values, {}, threads);
  });
  comparison.cut_off_hz = CutOff(filter.average);
  return comparison;
}

EffortComparison CompareEffortsBy(
    const ShootingProblem& problem,
    const std::function<EquationRows(int run)>& equations) {
  const Model& model = problem.model();
  const int nv = model.nv(), runs = static_cast<int>(problem.runs().size());
  // Of a run, times x nv: r of (11.2), and the efforts.
  struct Series {
    std::vector<double> t;
    RowMatrixXd r, effort;
  };
  std::vector<Series> series(runs);
  ParallelFor(runs, problem.options().threads, [&](int i) {
    EquationRows rows = equations(i);
    series[i] = {
        std::move(rows.t),
        Eigen::Map<const RowMatrixXd>(rows.rows.data(), rows.effort.rows(), nv),
        std::move(rows.effort)};
    return true;
  });
  Totals totals(2 * nv + 1);  // what is left, efforts, times
  for (const Series& one : series) {
    totals.Add(0, one.r.colwise().squaredNorm());
    totals.Add(nv, one.effort.colwise().squaredNorm());
    totals.Add(2 * nv, static_cast<double>(one.t.size()));
  }
  const Eigen::VectorXd sums = totals.Over(problem.processes());
  const auto left = sums.head(nv), efforts = sums.segment(nv, nv);
  const double times = sums[2 * nv];
  const std::vector<std::string> names = VelocityNames(model);
  EffortComparison comparison;
  for (const Body& body : model.movers()) {
    for (int k = 0; k < VelocitySize(body); ++k) {
      const int v = body.v_index + k;
      if (!(efforts[v] > 0.0)) continue;
      const std::string unit = body.type == JointType::kPrismatic ? "N" : "N m";
      comparison.errors.push_back({names[v], std::sqrt(left[v] / times),
                                   100.0 * std::sqrt(left[v] / efforts[v])});
      for (int i = 0; i < runs; ++i) {
        const Eigen::VectorXd measured = series[i].effort.col(v);
        const Eigen::VectorXd predicted = measured - series[i].r.col(v);
        comparison.series.push_back({problem.runs()[i]->run.name,
                                     names[v],
                                     unit,
                                     series[i].t,
                                     {measured.begin(), measured.end()},
                                     {predicted.begin(), predicted.end()}});
      }
    }
  }
  return comparison;
}

}  // namespace sysid
