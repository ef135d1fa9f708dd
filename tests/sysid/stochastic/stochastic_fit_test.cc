#include "sysid/stochastic/stochastic_fit.h"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/fit_setup.h"

namespace sysid {
namespace {
TEST(Placeholder, Builds) {}
}  // namespace
}  // namespace sysid
