#include "sysid/inverse_dynamics/effort_comparison.h"

#include <algorithm>
#include <cmath>

#include "sysid/inverse_dynamics/filter_choice.h"
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
  const Processes& all = problem.processes();
  if (!MeasuresAllJoints(problem)) return {};
  std::vector<const Run*> runs;
  for (const auto& data : problem.runs()) runs.push_back(&data->run);
  MechanismParameters<double> values;
  problem.map().Apply<double>(theta.data(), &values);
  const EquationFilter filter =
      ChooseFilter(model, values, runs, FirstFilter(runs, all),
                   problem.options().threads, all);
  EffortComparison comparison =
      CompareEfforts(model, runs, SampleRuns(problem, filter), values, all);
  comparison.cut_off_hz = CutOff(filter.average);
  return comparison;
}

EffortComparison CompareEfforts(const Model& model,
                                const std::vector<const Run*>& runs,
                                const std::vector<SampledMotion>& sampled,
                                const MechanismParameters<double>& values,
                                const Processes& all) {
  EffortComparison comparison;
  const int nv = model.nv();
  Totals totals(2 * nv + 1);  // what is left, efforts, times
  std::vector<EquationRows> rows;
  for (const SampledMotion& motion : sampled) {
    rows.push_back(EvaluateEquations(model, motion, values));
    const Eigen::Map<const RowMatrixXd> r(rows.back().rows.data(),
                                          rows.back().times(), nv);
    totals.Add(0, r.colwise().squaredNorm());
    totals.Add(nv, rows.back().effort.colwise().squaredNorm());
    totals.Add(2 * nv, rows.back().times());
  }
  const Eigen::VectorXd sums = totals.Over(all);
  const auto left = sums.head(nv), efforts = sums.segment(nv, nv);
  const double times = sums[2 * nv];
  const std::vector<std::string> names = VelocityNames(model);
  for (const Body& body : model.movers()) {
    for (int k = 0; k < VelocitySize(body); ++k) {
      const int v = body.v_index + k;
      if (!(efforts[v] > 0.0)) continue;
      const std::string& name = names[v];
      comparison.errors.push_back({name, std::sqrt(left[v] / times),
                                   100.0 * std::sqrt(left[v] / efforts[v])});
      for (size_t i = 0; i < runs.size(); ++i) {
        EffortSeries series{runs[i]->name,
                            name,
                            body.type == JointType::kPrismatic ? "N" : "N m",
                            rows[i].t,
                            {},
                            {}};
        for (int n = 0; n < rows[i].times(); ++n) {
          const double u = rows[i].effort(n, v);
          series.measured.push_back(u);
          series.predicted.push_back(u - rows[i].rows(n * nv + v, 0));
        }
        comparison.series.push_back(std::move(series));
      }
    }
  }
  return comparison;
}

}  // namespace sysid
