#include "sysid/inverse_dynamics/equation_columns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "models/effects/catalogue.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Effects = std::vector<std::shared_ptr<const Effect>>;

Effects Make(const Model& model, const std::vector<std::string>& names) {
  const Catalogue catalogue;
  Effects effects;
  for (const std::string& name : names) {
    effects.push_back(catalogue.Make(name, model.mechanism(), "test"));
  }
  return effects;
}

// A law whose order is searched is a candidate for each order, all of which
// exclude each other, in passes of their own.
TEST(EquationColumns, HaveACandidateForEachValueThatIsSearched) {
  const Model model = Shipped("pendulum2_planar");
  const EquationColumns columns = MakeEquationColumns(
      model, {}, Make(model, {"cogging@joint1", "viscous_damping@joint1"}), {},
      true);
  ASSERT_EQ(columns.candidates.size(), 24u);
  EXPECT_EQ(columns.passes.size(), 23u);
  EXPECT_EQ(columns.size(), 1 + 2 * 23);
  const EquationColumns::Candidate& second = columns.candidates[2];
  EXPECT_EQ(second.effect->name(), "cogging@joint1");
  EXPECT_TRUE(EquationColumns::Exclude(second, columns.candidates[1]));
  EXPECT_FALSE(EquationColumns::Exclude(second, columns.candidates[0]));
  EXPECT_THAT(columns.Values(second, Eigen::Vector2d(0.3, -0.1)),
              ElementsAre(0.3, -0.1, 3.0));
  EXPECT_THAT(
      MakeEquationColumns(model, {}, Make(model, {"cogging@joint1"}), {}, false)
          .candidates,
      IsEmpty());
}

// -a q - b (q - 1) is a spring of a + b about b / (a + b): its weights are no
// changes of its parameters.
TEST(EquationColumns, SpringFromTwoReferences) {
  const Model model = Shipped("pendulum2_planar");
  const EquationColumns columns =
      MakeEquationColumns(model, {}, Make(model, {"spring@joint1"}), {}, true);
  ASSERT_EQ(columns.candidates.size(), 1u);
  EXPECT_FALSE(columns.candidates[0].is_linear);
  EXPECT_THAT(columns.Values(columns.candidates[0], Eigen::Vector2d(3.0, -1.0)),
              ElementsAre(2.0, -0.5));
}

// Stribeck friction has the place of the Coulomb friction of the model, and its
// values: what is found is beside them.
TEST(EquationColumns, TakeOverWhatALawOfTheModelHas) {
  Model model = Shipped("pendulum2_planar");
  model.AddEffect(Make(model, {"coulomb_friction@joint1"})[0]);
  model.SetEffectParameter("joint1.friction", 0.2);
  FreeParameter free;
  free.parameter = FindParameters(model, {"joint1.friction"}, "test").front();
  const Effects stribeck = Make(model, {"stribeck_friction@joint1"});
  const EquationColumns columns =
      MakeEquationColumns(model, {free}, stribeck, {}, true);
  ASSERT_EQ(columns.candidates.size(), 4u);
  EXPECT_THAT(columns.candidates[0].replaces, ElementsAre(0));
  EXPECT_THAT(
      columns.Values(columns.candidates[0], Eigen::Vector2d(0.1, 0.4)),
      ElementsAre(DoubleNear(0.3, 1e-12), DoubleNear(0.6, 1e-12), 0.03));
  EXPECT_THAT(
      MakeEquationColumns(model, {}, stribeck, {"joint1.friction"}, true)
          .candidates,
      IsEmpty());
}

// What is late by little cannot be told from what the filters bend.
TEST(EquationColumns, HaveNoDelays) {
  const Model model = Shipped("pendulum2_planar");
  EXPECT_THAT(MakeEquationColumns(
                  model, {},
                  Make(model, {"effort_delay@base", "actuator_lag@joint1",
                               "joint_elasticity@joint1"}),
                  {}, true)
                  .candidates,
              IsEmpty());
}

}  // namespace
}  // namespace sysid
