#include "sysid/stochastic/rollout_gradient.h"

namespace sysid {

const char* StanMathHint() {
  return "it needs Stan Math: apt-get install --no-install-recommends "
         "r-cran-stanheaders libboost-dev, then configure and build again";
}

}  // namespace sysid
