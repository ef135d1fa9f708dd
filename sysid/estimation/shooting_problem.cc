#include "sysid/estimation/shooting_problem.h"

#include <algorithm>
#include <cmath>

#include "glog/logging.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

std::vector<Parameter> ParametersOf(const std::vector<FreeParameter>& free) {
  std::vector<Parameter> parameters;
  for (const FreeParameter& f : free) parameters.push_back(f.parameter);
  return parameters;
}

}  // namespace

Question::Question(const Model& m, std::vector<FreeParameter> f)
    : model(m), free(std::move(f)), map(model, ParametersOf(free)) {}

ShootingProblem::ShootingProblem(const Model& model,
                                 std::vector<FreeParameter> free,
                                 std::shared_ptr<const DataSet> data,
                                 const EstimationOptions& options)
    : question_(std::make_shared<const Question>(model, std::move(free))),
      data_(std::move(data)),
      options_(options) {}

ShootingProblem::ShootingProblem(const Model& model,
                                 std::vector<FreeParameter> free,
                                 std::vector<Run> runs,
                                 const EstimationOptions& options)
    : ShootingProblem(model, std::move(free),
                      MakeDataSet(model, std::move(runs), options), options) {}

ShootingProblem ShootingProblem::With(const EstimationOptions& options) const {
  ShootingProblem other = *this;
  other.options_ = options;
  return other;
}

ShootingProblem ShootingProblem::Apart() const {
  ShootingProblem other = *this;
  other.options_.processes = nullptr;
  return other;
}

ShootingProblem ShootingProblem::WithData(
    std::shared_ptr<const DataSet> data) const {
  ShootingProblem other = *this;
  other.data_ = std::move(data);
  return other;
}

ShootingProblem ShootingProblem::StartingAt(Eigen::VectorXd theta) const {
  ShootingProblem other = *this;
  other.start_ = std::move(theta);
  return other;
}

ShootingProblem ShootingProblem::WithEquations(
    std::shared_ptr<const ThetaEquations> equations) const {
  ShootingProblem other = *this;
  other.equations_ = std::move(equations);
  return other;
}

ShootingProblem ShootingProblem::Weighing(
    std::map<std::string, double> misfit) const {
  ShootingProblem other = *this;
  other.misfit_ = std::move(misfit);
  return other;
}

double ShootingProblem::Misfit(const std::string& channel) const {
  const auto found = misfit_.find(channel);
  return found == misfit_.end() ? 1.0 : found->second;
}

std::shared_ptr<const DataSet> MakeDataSet(const Model& model,
                                           std::vector<Run> runs,
                                           const EstimationOptions& options) {
  return std::make_shared<const DataSet>(model.mechanism(), std::move(runs),
                                         options);
}

std::shared_ptr<const DataSet> MakeDataSetLike(const Model& model,
                                               std::vector<Run> runs,
                                               const EstimationOptions& options,
                                               const DataSet& other) {
  return std::make_shared<const DataSet>(model.mechanism(), std::move(runs),
                                         options, &other);
}

Eigen::VectorXd ShootingProblem::InitialTheta() const {
  if (start_.size() > 0) return start_;
  const std::vector<FreeParameter>& free = question_->free;
  Eigen::VectorXd values(free.size()), theta;
  for (size_t i = 0; i < free.size(); ++i) values[i] = free[i].initial;
  if (map().ThetaOf(values, &theta)) return theta;
  // What a screening expects may be no possible body: the model's own, then. (A
  // start that a user gives is checked where it is read.)
  for (size_t i = 0; i < free.size(); ++i) {
    values[i] = free[i].parameter.nominal;
  }
  CHECK(map().ThetaOf(values, &theta)) << "the model is no possible body";
  return theta;
}

std::vector<SegmentPlace> AllSegments(const Solution& point) {
  std::vector<SegmentPlace> all;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    for (int k = 0; k < point.runs[r].segments(); ++k) {
      all.push_back({static_cast<int>(r), k});
    }
  }
  return all;
}

std::vector<int> CutRun(const std::vector<double>& t, double length,
                        int min_samples) {
  const int intervals = static_cast<int>(t.size()) - 1;
  const double duration = t.back() - t.front();
  int segments = std::max(1, static_cast<int>(std::lround(duration / length)));
  segments = std::min(segments, std::max(1, intervals / min_samples));
  std::vector<int> samples;
  for (int k = 0; k <= segments; ++k) {
    samples.push_back(
        static_cast<int>(std::lround(double(intervals) * k / segments)));
  }
  return samples;
}

bool SampleStates(const ShootingProblem& problem, const Solution& point,
                  int run, RowMatrixXd* states) {
  const RunData& data = *problem.runs()[run];
  const Solution::Nodes& nodes = point.runs[run];
  const int size = problem.model().state_size();
  states->resize(data.run.size(), size);
  const auto roll = [&](int k) {
    const SegmentRollout rollout(&problem.model(), &problem.map(),
                                 &data.measurements, nodes.samples[k],
                                 nodes.samples[k + 1], point.rollout);
    std::vector<double> errors(rollout.num_residuals()), x_end(size), visited;
    if (!rollout(nodes.states.row(k).data(), point.theta.data(), errors.data(),
                 x_end.data(), &visited)) {
      return false;
    }
    // The last is where the next begins, whose state counts.
    const bool last = k + 1 == nodes.segments();
    const int count = nodes.samples[k + 1] - nodes.samples[k] + (last ? 1 : 0);
    states->middleRows(nodes.samples[k], count) =
        Eigen::Map<const RowMatrixXd>(visited.data(), count, size);
    return true;
  };
  return ParallelFor(nodes.segments(), problem.options().threads, roll);
}

}  // namespace sysid
