#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// A solution between processes, and between a program and the next:
//
//   {"theta": [...], "step": s, "runs": [{"samples": [...], "states": [...]}]}
//
// States row by row. In CBOR all numbers keep their last bit.
nlohmann::json ToJson(const Solution& solution);
// Throws nlohmann's exceptions or std::out_of_range where it is not whole.
Solution SolutionFrom(const nlohmann::json& json,
                      const RolloutOptions& rollout);

std::vector<double> NumbersOf(const Eigen::VectorXd& values);
Eigen::VectorXd VectorFrom(const nlohmann::json& json);

}  // namespace sysid
