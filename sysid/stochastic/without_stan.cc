// Takes the place of the files that see Stan where its headers are missing.

#include "glog/logging.h"
#include "sysid/stochastic/rollout_gradient.h"

namespace sysid {

bool HaveStanMath() { return false; }

bool LossGradient(const Rollouts&, const std::vector<int>&,
                  const Transformation&, const LossOptions&,
                  const Eigen::VectorXd&, double*, Eigen::VectorXd*,
                  RolloutSums*) {
  LOG(FATAL) << "built without Stan Math";
}

bool MixtureLossGradient(const Rollouts&, const std::vector<int>&,
                         const Transformation&, const LossOptions&,
                         const SoftDraws&, double*, int*, Eigen::VectorXd*,
                         RolloutSums*) {
  LOG(FATAL) << "built without Stan Math";
}

TapeUse LastTapeUse() { return {}; }

}  // namespace sysid
