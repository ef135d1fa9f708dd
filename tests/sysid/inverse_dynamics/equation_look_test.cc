#include "sysid/inverse_dynamics/equation_look.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string>

#include "sysid/diagnosis/diagnose.h"
#include "tests/support/tracked_arm.h"

namespace sysid {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr int kFew = 8;  // effects that are no arm's

// An arm of three axes that is tracked, of which the model knows the bodies and
// not the drives.
struct HiddenDrives {
  explicit HiddenDrives(double noise, int joints = 3, int seed = 1) {
    TrackedArmOptions options;
    options.joints = joints;
    options.seed = seed;
    if (joints < 3) options.rate = 100.0;
    options.duration = 10.0;
    options.noise = noise;
    arm = MakeTrackedArm(options);
    model.emplace(arm->truth.mechanism());
    MechanismParameters<double> nominal = arm->truth.nominal();
    nominal.effects.clear();
    model->SetNominal(nominal);
    const Catalogue catalogue;
    for (const std::string& name : catalogue.Candidates(model->mechanism())) {
      candidates.push_back(catalogue.Make(name, model->mechanism(), "test"));
    }
  }
  EquationLook Look() const { return LookFrom(*model); }
  EquationLook LookFrom(const Model& start) const {
    const EstimationOptions options;
    return LookByEquations(ShootingProblem(start, {}, {arm->run}, options),
                           candidates, {}, kFew);
  }

  std::optional<TrackedArm> arm;
  std::optional<Model> model;
  std::vector<std::shared_ptr<const Effect>> candidates;
};

std::vector<std::string> NamesOf(const EquationLook& look) {
  std::vector<std::string> names;
  for (const ScreenedEffect& effect : look.effects) {
    names.push_back(effect.name());
  }
  return names;
}

TEST(LookByEquations, NamesTheFrictionOfADriveAndWhatItTurns) {
  const HiddenDrives hidden(1e-5);
  const EquationLook look = hidden.Look();
  EXPECT_THAT(look.followed, IsEmpty());
  for (int i = 0; i < 3; ++i) {
    for (const char* effect :
         {"viscous_damping@", "coulomb_friction@", "armature@"}) {
      EXPECT_THAT(NamesOf(look), Contains(effect + JointName(i)));
    }
  }
  // And what they are.
  for (const ScreenedEffect& effect : look.effects) {
    for (const ExpectedParameter& p : effect.parameters) {
      const auto names = hidden.arm->truth.effects().parameters();
      for (size_t k = 0; k < names.size(); ++k) {
        if (names[k].name != p.name) continue;
        const double truth = hidden.arm->truth.nominal().effects[k];
        EXPECT_NEAR(p.value, truth, 0.2 * truth) << p.name;
      }
    }
  }
}

TEST(LookByEquations, SaysWhichMotionAForceFollows) {
  HiddenDrives hidden(1e-5);
  // Gears that drag joint2 along with joint1.
  sysid::Run& run = hidden.arm->run;
  const Eigen::VectorXd q = run.channels[0].values.col(0);
  for (int k = 1; k + 1 < run.size(); ++k) {
    run.effort(k, 1) +=
        4.0 * (q[k + 1] - q[k - 1]) / (run.t[k + 1] - run.t[k - 1]);
  }
  const EquationLook look = hidden.Look();
  ASSERT_THAT(look.followed, SizeIs(1));
  EXPECT_EQ(look.followed[0].joint, "joint2");
  EXPECT_EQ(look.followed[0].of, "joint1");
  // The rest is kinks of the friction, which differentiated positions round.
  EXPECT_GT(look.followed[0].share, 0.6);
}

// By its law, not by the inverse in which the equations are linear.
TEST(LookByEquations, SaysHowLargeAGainIs) {
  for (const double gain : {-0.6, -0.2, 1.0, 3.0}) {
    HiddenDrives hidden(1e-5);
    hidden.arm->run.effort.col(1) /= 1.0 + gain;
    const EquationLook look = hidden.LookFrom(hidden.arm->truth);
    ASSERT_THAT(NamesOf(look), Contains("effort_gain@joint2")) << gain;
    for (const ScreenedEffect& effect : look.effects) {
      if (effect.name() != "effort_gain@joint2") continue;
      EXPECT_NEAR(1.0 + effect.parameters[0].value, 1.0 + gain,
                  0.05 * (1.0 + gain));
    }
  }
}

TEST(LookByEquations, NamesNothingOfACompleteModel) {
  HiddenDrives hidden(1e-5);
  const EquationLook look = hidden.LookFrom(hidden.arm->truth);
  EXPECT_THAT(NamesOf(look), SizeIs(::testing::Le(2)))
      << ::testing::PrintToString(NamesOf(look));
}

// Seven axes, bodies of the URDF that are up to a fifth off: what the drives
// have, and nothing else.
TEST(LookByEquations, AsksTheBodiesOfAnArm) {
  HiddenDrives hidden(1e-4, 7);
  Model start(hidden.arm->start.mechanism());
  MechanismParameters<double> nominal = hidden.arm->start.nominal();
  nominal.effects.clear();
  start.SetNominal(nominal);
  const EquationLook look = hidden.LookFrom(start);
  EXPECT_TRUE(look.is_arm);
  EXPECT_THAT(look.bodies, SizeIs(7));
  EXPECT_THAT(look.rejected, IsEmpty());
  for (int i = 0; i < 7; ++i) {
    for (const char* effect : {"viscous_damping@", "coulomb_friction@"}) {
      EXPECT_THAT(NamesOf(look), Contains(effect + JointName(i)));
    }
  }
  for (const std::string& name : NamesOf(look)) {
    const std::string kind = name.substr(0, name.find('@'));
    EXPECT_THAT(kind, ::testing::AnyOf("viscous_damping", "coulomb_friction",
                                       "armature", "effort_bias"));
  }
}

// Friction that a URDF gives is often a placeholder: it is free.
TEST(LookByEquations, FreesTheFrictionThatAnArmIsGiven) {
  HiddenDrives hidden(1e-5);
  Model start = hidden.arm->truth;
  for (int i = 0; i < 3; ++i) {
    start.SetEffectParameter(JointName(i) + ".damping", 7.0);
  }
  const EquationLook look = hidden.LookFrom(start);
  EXPECT_TRUE(look.is_arm);
  EXPECT_THAT(look.given_laws, SizeIs(9));
  EXPECT_THAT(NamesOf(look), SizeIs(::testing::Le(2)))
      << ::testing::PrintToString(NamesOf(look));
  std::vector<FreeParameter> free;
  EstimationOptions options;
  AddWhatArmsHave(look, start, &free, &options);
  EXPECT_THAT(free, SizeIs(9 + 10 * look.bodies.size()));
  EXPECT_THAT(options.no_efforts, IsEmpty());
}

// A tilt across the plane of the joints is no force; the reference of a spring
// is one only where the spring is there.
TEST(LookByEquations, LeavesOutParametersThatAreNoForce) {
  const Catalogue catalogue;
  for (const std::string planted : {"spring@joint2", "gravity_tilt@base"}) {
    const bool spring = planted == "spring@joint2";
    const Model truth = Shipped(
        "pendulum2_planar", {planted},
        {{spring ? "joint2.stiffness" : "gravity_tilt_x", spring ? 0.5 : 0.2},
         {spring ? "joint2.spring_reference" : "gravity_tilt_y", 0.2}});
    SimulationOptions options;
    options.noise = 1e-5;
    options.excitation = Excitation::kMultisine;
    options.excitation_level = 0.3;
    const sysid::Run run = Simulate(truth, RandomState(truth, 0.3, 1), options);
    const Model model = Shipped("pendulum2_planar");
    const EquationLook look = LookByEquations(
        ShootingProblem(model, {}, {run}, {}),
        {catalogue.Make(planted, model.mechanism(), "test")}, {}, kFew);
    ASSERT_THAT(look.effects, SizeIs(1)) << planted;
    EXPECT_THAT(look.effects[0].without_influence, SizeIs(spring ? 0 : 1));
    EXPECT_THAT(look.effects[0].parameters, SizeIs(spring ? 2 : 1));
  }
}

TEST(LookByEquations, RejectsAnEffortThatIsNone) {
  HiddenDrives hidden(1e-5);
  hidden.arm->run.effort.col(2) *= 0.003;
  const EquationLook look =
      LookByEquations(ShootingProblem(*hidden.model, {}, {hidden.arm->run}, {}),
                      hidden.candidates, {}, 5);
  ASSERT_THAT(look.rejected, SizeIs(1));
  EXPECT_EQ(look.rejected[0].joint, "joint3");
  EXPECT_EQ(look.rejected[0].v, 2);
  for (const std::string& name : NamesOf(look)) {
    EXPECT_EQ(name.find("@joint3"), std::string::npos) << name;
  }
  EXPECT_THAT(NamesOf(look), Contains("viscous_damping@joint1"));
}

TEST(LookByEquations, SaysNothingWithoutEfforts) {
  HiddenDrives hidden(1e-5);
  hidden.arm->run.effort.setZero();
  EXPECT_THAT(hidden.Look().effects, IsEmpty());
}

// Six effects of two drives. Together they begin the search; what segments of
// this recording do not ask for goes again.
TEST(Diagnose, BeginsWithWhatTheEquationsShow) {
  const HiddenDrives hidden(1e-4, 2), other(1e-4, 2, 2);
  DiagnosisProblem problem(*hidden.model);
  problem.SetRuns({hidden.arm->run}, {other.arm->run});
  DiagnosisOptions options;
  options.add = true;
  const Diagnosis diagnosis = Diagnose(problem, hidden.candidates, options);
  ASSERT_FALSE(diagnosis.steps.empty());
  for (const std::string& effect :
       {std::string("viscous_damping@") + JointName(0),
        std::string("coulomb_friction@") + JointName(0),
        std::string("coulomb_friction@") + JointName(1)}) {
    EXPECT_THAT(diagnosis.added(), Contains(effect));
  }
  // What was kept comes first of the candidates, and then all others, once.
  std::vector<std::string> listed;
  for (const CandidateEffect& candidate : diagnosis.candidates) {
    listed.push_back(candidate.screened.name());
  }
  ASSERT_FALSE(diagnosis.proposed.empty());
  EXPECT_EQ(listed.front(), diagnosis.proposed.front());
  EXPECT_GT(listed.size(), diagnosis.proposed.size());
  EXPECT_EQ(std::set<std::string>(listed.begin(), listed.end()).size(),
            listed.size());
}

}  // namespace
}  // namespace sysid
