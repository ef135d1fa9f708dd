#include <gtest/gtest.h>

#include <cstdio>
#include <set>
#include <string>

#include "sysid/simulation/simulate.h"
#include "tests/acceptance/hidden/hidden_case.h"
#include "tests/acceptance/hidden/outcome.h"
#include "tests/acceptance/hidden/plant.h"

// Both ways of hiding an effect, against each other: the library's simulation
// and MuJoCo, which share no line of the dynamics or the effects.

namespace sysid {
namespace {

HiddenCase Case(const std::string& mechanism, const std::string& engine) {
  HiddenCase c;
  c.mechanism = mechanism;
  c.engine = engine;
  return c;
}

// The largest difference of what is measured.
double LargestDifference(const sysid::Run& a, const sysid::Run& b) {
  double largest = (a.effort - b.effort).cwiseAbs().maxCoeff();
  for (size_t c = 0; c < a.channels.size(); ++c) {
    largest = std::max(
        largest,
        (a.channels[c].values - b.channels[c].values).cwiseAbs().maxCoeff());
  }
  return largest;
}

TEST(Engines, MoveEveryMechanismAlikeWithoutEffects) {
  for (const std::string& name : TestMechanismNames()) {
    const TestMechanism mechanism = MakeTestMechanism(name);
    const Model truth = TrueModel(mechanism, 1);
    const sysid::Run ours =
        Record(mechanism, truth, {}, Case(name, "sysid"), 2.0, 1);
    const sysid::Run theirs =
        Record(mechanism, truth, {}, Case(name, "mujoco"), 2.0, 1);
    const double difference = LargestDifference(ours, theirs);
    std::printf("%-18s %.1e\n", name.c_str(), difference);
    EXPECT_LT(difference, 1e-5) << name;
  }
}

// Every experiment of the suite with one effect, once.
std::vector<HiddenCase> Singles() {
  std::vector<HiddenCase> cases;
  for (HiddenCase c : HiddenCases(1)) {
    if (c.planted.size() == 1 && c.engine == "mujoco") cases.push_back(c);
  }
  return cases;
}

TEST(Engines, MoveEveryMechanismAlikeWithEveryEffect) {
  for (HiddenCase c : Singles()) {
    const TestMechanism mechanism = MakeTestMechanism(c.mechanism);
    const Model truth = TrueModel(mechanism, 1);
    const PlantedEffect shape = PlantEffect(truth, c.planted[0], 1.0);
    const PlantedEffect effect =
        PlantEffect(truth, c.planted[0], RangeOf(shape.kind()).start);
    c.noise = 0.0;
    c.friction_time = 0.0;
    const sysid::Run theirs = Record(mechanism, truth, {effect}, c, 2.0, 1);
    c.engine = "sysid";
    const sysid::Run ours = Record(mechanism, truth, {effect}, c, 2.0, 1);
    const sysid::Run plain = Record(mechanism, truth, {}, c, 2.0, 1);
    const double difference = LargestDifference(ours, theirs);
    const double size = LargestDifference(ours, plain);
    std::printf("%-18s %-26s %.1e of %.1e\n", c.mechanism.c_str(),
                c.planted[0].c_str(), difference, size);
    // Our drags have a root that is smooth at rest, MuJoCo's here have not. Dry
    // friction it is given as a law smoothed over 5 mrad/s, which creeps where
    // ours rests: apart by a few parts in a hundred of what friction does.
    const bool dry = effect.kind().ends_with("_friction");
    EXPECT_LT(difference, dry ? 0.05 * size : 3e-5) << c.name;
    EXPECT_GT(size, 5e-4) << c.name;
  }
}

// MuJoCo's frictionloss is softened, and saturates at a speed of its own: the
// motions agree to a few parts in a hundred of what friction does.
TEST(Engines, AgreeRoughlyOnFrictionThatSticks) {
  for (HiddenCase c : Singles()) {
    if (c.friction_time == 0.0) continue;
    const TestMechanism mechanism = MakeTestMechanism(c.mechanism);
    const Model truth = TrueModel(mechanism, 1);
    const PlantedEffect effect =
        PlantEffect(truth, c.planted[0], RangeOf("coulomb_friction").start);
    c.noise = 0.0;
    const sysid::Run theirs = Record(mechanism, truth, {effect}, c, 1.0, 1);
    c.engine = "sysid";
    const sysid::Run ours = Record(mechanism, truth, {effect}, c, 1.0, 1);
    const sysid::Run plain = Record(mechanism, truth, {}, c, 1.0, 1);
    const double difference = LargestDifference(ours, theirs);
    const double size = LargestDifference(ours, plain);
    std::printf("%-18s %-26s %.1e of %.1e\n", c.mechanism.c_str(),
                c.planted[0].c_str(), difference, size);
    EXPECT_LT(difference, 0.1 * size) << c.name;
  }
}

// Its steps are of first order there; those that the suite takes are within the
// noise.
TEST(Engines, AreAccurateWhereFrictionSticks) {
  for (const HiddenCase& c : Singles()) {
    if (c.friction_time == 0.0) continue;
    const TestMechanism mechanism = MakeTestMechanism(c.mechanism);
    if (mechanism.drive != Drive::kNone) continue;
    const Model truth = TrueModel(mechanism, 1);
    const PlantedEffect effect =
        PlantEffect(truth, c.planted[0], RangeOf("coulomb_friction").start);
    sysid::Run run =
        Record(mechanism, truth, {effect}, Case(c.mechanism, "sysid"), 2.0, 1);
    const Eigen::VectorXd x0 = StartOf(mechanism, 1);
    RowMatrixXd states[2];
    for (int i = 0; i < 2; ++i) {
      const auto plant = MakeMujocoPlant(
          truth, {effect}, {i == 0 ? 5e-4 : 5e-5, c.friction_time});
      states[i] = Move(plant.get(), x0, {}, &run);
    }
    const double error =
        (states[0] - states[1]).leftCols(truth.nq()).cwiseAbs().maxCoeff();
    std::printf("%-18s %-26s %.1e\n", c.mechanism.c_str(), c.planted[0].c_str(),
                error);
    EXPECT_LT(error, 1e-4) << c.name;
  }
}

// What the suite promises of its cases: what is planted makes about the
// difference that was asked for, or less where even its largest value does not
// (a delay has a most, and some runs are slow); everything comes from the seed.
TEST(HiddenCases, MakeTheDifferenceThatIsAskedFor) {
  int cases = 0, at_most = 0;
  for (const char* name :
       {"pendulum2_planar/viscous_damping@joint2", "cartpole/effort_delay@base",
        "pendulum1/gravity_tilt@base", "rail/coulomb_friction@slider"}) {
    for (const HiddenCase& c : HiddenCases(1)) {
      if (c.name.find(name) != 0) continue;
      const HiddenData data = MakeHiddenData(c);
      ASSERT_EQ(data.train.size(), 2u);
      EXPECT_EQ(data.train[0].size(), 801);
      ++cases;
      if (data.at_most) ++at_most;
      ASSERT_EQ(data.strengths.size(), c.planted.size());
      for (const double strength : data.strengths) {
        EXPECT_LT(strength, 1.2 * c.strength) << c.name;
        if (data.at_most) continue;
        EXPECT_GT(strength, 0.8 * c.strength) << c.name;
      }
      const HiddenData again = MakeHiddenData(c);
      EXPECT_EQ(LargestDifference(data.holdout, again.holdout), 0.0);
      EXPECT_GT(LargestDifference(data.train[0], data.train[1]), 0.1);
    }
  }
  EXPECT_LT(4 * at_most, cases);
}

Outcome DiagnoseNamed(const std::string& name, bool withheld = false) {
  for (const HiddenCase& c : HiddenCases(1)) {
    if (c.name == name) return DiagnoseCase(MakeHiddenData(c), withheld);
  }
  ADD_FAILURE() << "the suite has no " << name;
  return {};
}

// Coulomb friction alone comes near enough to the noise here to be kept for its
// simplicity, and still leaves what Stribeck friction explains: the search must
// not go from one to the other and back.
TEST(HiddenCases, AreNotSearchedInCircles) {
  const Outcome outcome =
      DiagnoseNamed("arm3/stribeck_friction@elbow/sysid/3e-04/1");
  std::set<std::string> names;
  for (const Outcome::Step& step : outcome.added) {
    EXPECT_TRUE(names.insert(step.added.name).second) << step.added.name;
  }
  EXPECT_FALSE(names.empty());
  EXPECT_LT(outcome.train_after, 1.1);
}

// MuJoCo's frictionloss is softer than ours: Stribeck friction always gains
// something there, but Coulomb friction has reached the noise.
TEST(HiddenCases, KeepTheLawThatReachesTheNoise) {
  const Outcome outcome = DiagnoseNamed(
      "pendulum2_planar/gravity_tilt@base+coulomb_friction@joint1/mujoco/"
      "3e-03/1");
  ASSERT_EQ(outcome.added.size(), 2u);
  EXPECT_TRUE(outcome.added[0].added.name == "coulomb_friction@joint1" ||
              outcome.added[1].added.name == "coulomb_friction@joint1");
  EXPECT_LT(outcome.train_after, 1.1);
}

// Friction that gives way before it slips stands in for a spring and leaves
// twice the noise: it is constant, but no formula of the joint needs it.
TEST(HiddenCases, AreUnexplainedWhereAFormulaDoesWithoutWhatWasFound) {
  const Outcome outcome =
      DiagnoseNamed("pendulum2_planar/spring@joint1/sysid/1e-03/1", true);
  EXPECT_EQ(outcome.verdict, "unexplained");
}

// Internal states of what is planted start with the motion.
TEST(HiddenCases, HaveEffectsWithInternalStates) {
  const Outcome outcome =
      DiagnoseNamed("cartpole/presliding_friction@slider/sysid/1e-03/1");
  ASSERT_EQ(outcome.added.size(), 1u);
  EXPECT_EQ(outcome.added[0].added.name, "presliding_friction@slider");
}

// Where its segments became independent, one of the base fit's ended in another
// minimum, and with it that of every candidate: 122 times the noise and
// "unexplained" where the drag leaves 1.
TEST(HiddenCases, StartEachSegmentInTheMinimumThatTheJoinedOnesFound) {
  const Outcome outcome =
      DiagnoseNamed("pendulum2_planar/quadratic_drag@joint2/mujoco/3e-03/1");
  ASSERT_FALSE(outcome.added.empty());
  EXPECT_EQ(outcome.added[0].added.name, "quadratic_drag@joint2");
  EXPECT_LT(outcome.train_after, 1.1);
}

// Stribeck's law is found while the other joint's friction is missing; beside
// that its part, Coulomb's, does as well.
TEST(HiddenCases, KeepThePartOfALawThatDoesAsWell) {
  const Outcome outcome = DiagnoseNamed(
      "pendulum2_planar/viscous_damping@joint1+coulomb_friction@joint2/mujoco/"
      "3e-03/1");
  ASSERT_FALSE(outcome.added.empty());
  std::set<std::string> names;
  for (const Outcome::Step& step : outcome.added) names.insert(step.added.name);
  EXPECT_EQ(names, (std::set<std::string>{"viscous_damping@joint1",
                                          "coulomb_friction@joint2"}));
  EXPECT_LT(outcome.train_after, 1.1);
}

}  // namespace
}  // namespace sysid
