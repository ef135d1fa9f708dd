#pragma once

#include <optional>
#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// A run as a point predicts it: the states at its samples (samples x
// state_size), and each channel as PredictChannels gives it.
struct Prediction {
  RowMatrixXd states;
  std::vector<RowMatrixXd> channels;
};
// Nothing where the dynamics fail.
std::optional<Prediction> Predict(const ShootingProblem& problem,
                                  const Solution& point, int run);

// The measurement as near to the prediction as its meaning allows: angles of
// the same turn, quaternions of the same sign.
Eigen::RowVectorXd Nearest(const Channel& channel, const Mechanism& mechanism,
                           int sample, const Eigen::RowVectorXd& predicted);

}  // namespace sysid
