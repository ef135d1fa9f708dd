#include "sysid/report/prediction.h"

#include <cmath>

#include "sysid/estimation/evaluation.h"

namespace sysid {

std::optional<Prediction> Predict(const ShootingProblem& problem,
                                  const Solution& point, int run) {
  Prediction prediction;
  if (!SampleStates(problem, point, run, &prediction.states)) {
    return std::nullopt;
  }
  prediction.channels =
      PredictChannels(problem, point.theta, run, prediction.states);
  return prediction;
}

Eigen::RowVectorXd Nearest(const Channel& channel, const Mechanism& mechanism,
                           int sample, const Eigen::RowVectorXd& predicted) {
  Eigen::RowVectorXd measured = channel.values.row(sample);
  if (channel.kind == ChannelKind::kOrientation &&
      measured.dot(predicted) < 0) {
    return -measured;
  }
  if (channel.kind == ChannelKind::kPosition &&
      IsRotation1(mechanism.joints[channel.target].type)) {
    measured[0] -=
        2 * M_PI * std::round((measured[0] - predicted[0]) / (2 * M_PI));
  }
  return measured;
}

}  // namespace sysid
