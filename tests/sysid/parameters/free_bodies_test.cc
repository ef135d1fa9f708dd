#include "sysid/parameters/free_bodies.h"

#include <gmock/gmock.h>

#include <cmath>
#include <string>

#include "models/find_model.h"
#include "models/urdf/load_urdf.h"

namespace sysid {
namespace {

TEST(FreeBodies, FreesTheTenOfEachLinkFromItsValues) {
  const Model model(LoadUrdf(FindModel("pendulum2_planar")));
  std::vector<std::string> names;
  for (const FreeParameter& free : FreeBodies(model, {2})) {
    names.push_back(free.parameter.name);
    EXPECT_EQ(free.initial, free.parameter.nominal);
    const bool inertia = free.parameter.kind == ParameterKind::kInertia;
    EXPECT_EQ(std::isinf(free.lower),
              inertia || std::isinf(free.parameter.lower));
  }
  EXPECT_EQ(names.size(), 10u);
  EXPECT_THAT(names, ::testing::Each(::testing::StartsWith("link2.")));
}

}  // namespace
}  // namespace sysid
