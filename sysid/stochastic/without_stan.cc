// Takes the place of the file that sees Stan where its headers are missing.

#include "glog/logging.h"
#include "sysid/stochastic/rollout_gradient.h"

namespace sysid {

bool HaveStanMath() { return false; }

bool MeanLossGradient(const Rollouts&, int, const Transformation&, double,
                      const RowMatrixXd&, RolloutSums*, double*, int*,
                      Eigen::ArrayXXd*) {
  LOG(FATAL) << "built without Stan Math";
}

TapeUse LastTapeUse() { return {}; }

}  // namespace sysid
