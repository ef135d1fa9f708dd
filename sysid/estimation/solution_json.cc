#include "sysid/estimation/solution_json.h"

#include <stdexcept>
#include <string>
#include <utility>

namespace sysid {

using Json = nlohmann::json;

std::vector<double> NumbersOf(const Eigen::VectorXd& values) {
  return {values.begin(), values.end()};
}

Eigen::VectorXd VectorFrom(const Json& json) {
  const auto values = json.get<std::vector<double>>();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), values.size());
}

Json ToJson(const Solution& solution) {
  Json runs = Json::array();
  for (const Solution::Nodes& nodes : solution.runs) {
    runs.push_back({{"samples", nodes.samples},
                    {"states", std::vector<double>(nodes.states.data(),
                                                   nodes.states.data() +
                                                       nodes.states.size())}});
  }
  return {{"theta", NumbersOf(solution.theta)},
          {"step", solution.rollout.step},
          {"integrator", ToString(solution.rollout.integrator)},
          {"runs", std::move(runs)}};
}

Solution SolutionFrom(const Json& json, const RolloutOptions& rollout) {
  Solution solution;
  solution.theta = VectorFrom(json.at("theta"));
  solution.rollout = rollout;
  solution.rollout.step = json.at("step").get<double>();
  solution.rollout.integrator =
      ParseIntegrator(json.at("integrator").get<std::string>(), "integrator");
  for (const Json& run : json.at("runs")) {
    Solution::Nodes nodes;
    nodes.samples = run.at("samples").get<std::vector<int>>();
    const auto states = run.at("states").get<std::vector<double>>();
    const int segments = nodes.segments();
    if (segments < 1 || states.size() % segments != 0) {
      throw std::out_of_range("states of segments");
    }
    nodes.states = Eigen::Map<const RowMatrixXd>(states.data(), segments,
                                                 states.size() / segments);
    solution.runs.push_back(std::move(nodes));
  }
  return solution;
}

}  // namespace sysid
