#include "sysid/session/added_effects.h"

#include <gtest/gtest.h>

#include <optional>

#include "sysid/diagnosis/judgement_constants.h"
#include "tests/support/tracked_arm.h"

namespace sysid {
namespace {

// Nine effects of three drives, which --add puts into a model that knows the
// bodies: by the equations of motion, without a fit of either model.
TEST(TryAddedEffects, OfManyFindsTheirValuesAndWhatTheyGain) {
  TrackedArmOptions options;
  options.joints = 3;
  options.duration = 10.0;
  options.noise = 1e-5;
  const TrackedArm arm = MakeTrackedArm(options);
  Session session(arm.truth);
  session.runs = {arm.run};
  std::vector<Value> start;
  for (int i = 0; i < options.joints; ++i) {
    for (const Value& value : DriveValues(i, 0.0)) start.push_back(value);
    for (const char* effect :
         {"viscous_damping@", "coulomb_friction@", "armature@"}) {
      session.added.push_back(effect + JointName(i));
    }
  }
  Set(start, &session.model);
  for (const Value& value : start) session.freed_by_added.insert(value.name);
  // And a mass, which the values without the effects may move.
  start.push_back(
      {"link3.mass",
       FindParameters(session.model, {"link3.mass"}, "test").front().nominal});
  session.free = FreeFrom(session.model, start);
  start.pop_back();
  ASSERT_GT(session.added.size(), size_t{kMostEffectsBySegments});

  const std::optional<AddedEffects> added =
      TryAddedEffects(Catalogue(), session);
  ASSERT_TRUE(added);
  EXPECT_EQ(added->effects, session.added);
  EXPECT_GT(added->train_before, 20.0 * added->train_after);
  EXPECT_LT(added->train_after, 10.0);
  for (const Value& value : start) {
    const auto found = added->found.find(value.name);
    ASSERT_NE(found, added->found.end()) << value.name;
    const double truth =
        FindParameters(arm.truth, {value.name}, "test").front().nominal;
    EXPECT_NEAR(found->second, truth, 0.1 * truth) << value.name;
  }
}

}  // namespace
}  // namespace sysid
