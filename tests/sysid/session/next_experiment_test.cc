#include "sysid/session/next_experiment.h"

#include <gmock/gmock.h>

#include <cmath>

#include "sysid/session/free_choice.h"
#include "sysid/session/named_values.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

// Half a second of slow swings, which does not tell what damps it.
class NextExperimentTest : public testing::Test {
 protected:
  NextExperimentTest()
      : problem_(Shipped("pendulum2_planar")),
        session_(problem_.model),
        diagnosis_(problem_.model) {
    const Model truth =
        Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                {{"link1.length", 0.52}, {"joint1.damping", 0.03}});
    Recording recording;
    recording.duration = 0.5;
    recording.amplitude = 0.4;
    problem_ =
        MakeProblem(problem_.model, {{"link1.length", 0.5}},
                    {Record(truth, 1, recording), Record(truth, 2, recording),
                     Record(truth, 3, recording)});
    session_.model_name = "pendulum2_planar";
    session_.free = problem_.free;
    session_.runs = RunsOf(*problem_.train);
    session_.holdout = RunsOf(*problem_.holdout);
    diagnosis_.base = EvaluateGiven(problem_);
    diagnosis_.verdict = Verdict::kUndecided;
  }

  std::optional<NextExperiment> Between(
      const std::vector<std::string>& effects) {
    diagnosis_.rivals.clear();
    for (const std::string& name : effects) {
      const auto effect =
          catalogue_.Make(name, problem_.model.mechanism(), "test");
      EvaluatedModel model = diagnosis_.base;
      if (effect->inputs().empty()) {
        model =
            EvaluateFrom(problem_, diagnosis_.base, {effect}, {},
                         {ValuesOf(diagnosis_.base)}, 0.0, problem_.options);
      } else {
        model.added = {effect};  // that no recording has the columns of
      }
      diagnosis_.rivals.push_back(
          {{name}, "", false, std::make_shared<const EvaluatedModel>(model)});
    }
    return ChooseExperiment(catalogue_, session_, problem_, diagnosis_);
  }

  // "" where it is not there.
  static std::string Flag(const NextExperiment& experiment,
                          const std::string& name) {
    for (const auto& [flag, value] : experiment.flags) {
      if (flag == name) return value;
    }
    return "";
  }

  const Catalogue catalogue_;
  DiagnosisProblem problem_;
  Session session_;
  Diagnosis diagnosis_;
};

TEST_F(NextExperimentTest, MakesAMotionThatDecides) {
  const auto found =
      Between({"viscous_damping@joint1", "quadratic_drag@joint1"});
  ASSERT_TRUE(found);
  EXPECT_GT(found->probability, 0.99);
  EXPECT_TRUE(found->one_fits);
  EXPECT_EQ(Flag(*found, "add"), "viscous_damping@joint1");
  EXPECT_EQ(Flag(*found, "excite"), "");  // nothing drives it

  // Of the motion that the flags make, recorded on the true machine, the right
  // law is found with all recordings; of those alone it was not clear.
  const double duration = std::stod(Flag(*found, "duration"));
  EXPECT_GE(duration, 0.5);
  Model truth = Shipped("pendulum2_planar", {Flag(*found, "add")});
  std::string faults =
      SetValues(SplitAssignments(Flag(*found, "set"), "test"), &truth);
  EXPECT_EQ(faults, "");
  SimulationOptions options;
  options.duration = duration;
  options.rate = std::stod(Flag(*found, "rate"));
  options.noise = std::stod(Flag(*found, "noise"));
  const sysid::Run run = Simulate(
      truth, RandomState(truth, std::stod(Flag(*found, "tilt")), 1), options);
  const auto error = [&](const std::string& effect,
                         const std::string& parameter) {
    const Model model = Shipped("pendulum2_planar", {effect});
    return FitRuns(model,
                   FreeFrom(model, {{"link1.length", 0.5}, {parameter, 0.01}}),
                   {run}, problem_.options)
        .train.squares;
  };
  // The likelihood ratio that 0.99 stands for is 21.6 +- 9.3.
  EXPECT_GT(error("quadratic_drag@joint1", "joint1.quadratic_drag"),
            error("viscous_damping@joint1", "joint1.damping") + 3.0);
}

TEST_F(NextExperimentTest, IsNoneWhereNothingTellsThemApart) {
  const auto found =
      Between({"viscous_damping@joint1", "custom@joint1: -k*qd"});
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->flags.empty());
  EXPECT_THAT(found->why_none, testing::HasSubstr("tells the rivals apart"));
}

// What no motion tells apart does not keep it from deciding the rest.
TEST_F(NextExperimentTest, DecidesBetweenThoseThatDiffer) {
  const auto found = Between({"viscous_damping@joint1", "custom@joint1: -k*qd",
                              "quadratic_drag@joint1"});
  ASSERT_TRUE(found);
  EXPECT_GT(found->probability, 0.99);
  EXPECT_EQ(found->alike,
            (std::vector<std::vector<std::string>>{
                {"viscous_damping@joint1", "custom@joint1: -k*qd"}}));
}

TEST_F(NextExperimentTest, IsNoneWithoutRivals) {
  EXPECT_FALSE(Between({}));
  EXPECT_FALSE(Between({"viscous_damping@joint1"}));
}

// The other one would have to be simulated with a command that nobody gave.
TEST_F(NextExperimentTest, IsNoneWhereOneReadsAnInput) {
  const auto found =
      Between({"viscous_damping@joint1", "thermal_friction@joint1"});
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->flags.empty());
  EXPECT_THAT(found->why_none, testing::HasSubstr("reads inputs"));
}

TEST_F(NextExperimentTest, DrivesWhatTheRecordingsDrive) {
  for (sysid::Run& run : session_.runs) run.effort.setConstant(0.1);
  const auto found =
      Between({"viscous_damping@joint1", "quadratic_drag@joint1"});
  ASSERT_TRUE(found);
  EXPECT_EQ(Flag(*found, "excite"), "multisine");
  EXPECT_NE(Flag(*found, "band"), "");
}

}  // namespace
}  // namespace sysid
