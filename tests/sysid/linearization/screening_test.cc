#include "sysid/linearization/screening.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "sysid/linearization/candidate_columns.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

using testing::Contains;
using testing::Not;

const std::vector<Value> kLengths{{"link1.length", 0.5}, {"link2.length", 0.5}};

// A fit of the training runs, and its screening.
struct Screened {
  EvaluatedModel base;
  Screening screening;

  explicit Screened(const DiagnosisProblem& problem) : base(problem.model) {
    base.problem = std::make_shared<const ShootingProblem>(
        problem.model, problem.free, problem.train, problem.options);
    base.fit = FitIndependentSegments(*base.problem);
    EXPECT_TRUE(base.fit.converged);
    const LinearizedFit linearized(*base.problem, base.fit.point);
    EXPECT_TRUE(linearized.Valid());
    screening = ScreenEffects(linearized, base.fit.model,
                              AllCandidates(problem.model), problem.known);
  }

  int Find(const std::string& name) const {
    for (size_t i = 0; i < screening.effects.size(); ++i) {
      if (screening.effects[i].name() == name) return static_cast<int>(i);
    }
    return -1;
  }
  const ScreenedEffect& Effect(const std::string& name) const {
    EXPECT_GE(Find(name), 0) << name;
    return screening.effects[std::max(0, Find(name))];
  }
  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const auto& effect : screening.effects) names.push_back(effect.name());
    return names;
  }
};

const ExpectedParameter& Expected(const ScreenedEffect& effect,
                                  const std::string& name) {
  for (const ExpectedParameter& parameter : effect.parameters) {
    if (parameter.name == name) return parameter;
  }
  ADD_FAILURE() << effect.name() << " has no " << name;
  static const ExpectedParameter none;
  return none;
}

std::vector<CandidateSet> AllSets(const std::vector<Candidate>& candidates) {
  std::vector<CandidateSet> sets;
  for (int i = 0; i < static_cast<int>(candidates.size()); ++i) {
    for (int s = 0; s < static_cast<int>(candidates[i].sets.size()); ++s) {
      sets.push_back({i, s});
    }
  }
  return sets;
}

// Every candidate's columns are its own, whoever else is asked: those that are
// taken from one model together do not see each other.
// But for the error of the steps: a dry friction that is off still cuts them
// where its joint turns back.
TEST(CandidateColumns, DoNotDependOnTheOthers) {
  const Model truth =
      Shipped("cartpole", {"viscous_damping@hinge"}, {{"hinge.damping", 0.02}});
  const DiagnosisProblem problem =
      MakeProblem(Shipped("cartpole"), {{"pole.length", 0.5}},
                  {Record(truth, 1, {.duration = 1.0, .level = 0.5}),
                   Record(truth, 2, {.duration = 1.0, .level = 0.5})});
  ShootingProblem shooting(problem.model, problem.free, problem.train,
                           problem.options);
  const Fit fit = FitIndependentSegments(shooting);
  const LinearizedFit linearized(shooting, fit.point);
  ASSERT_TRUE(linearized.Valid());
  const auto effects = AllCandidates(problem.model);
  const std::vector<Candidate> all = MakeCandidates(fit.model, effects, {});
  const auto together =
      RespondToCandidates(linearized, fit.model, all, AllSets(all));
  int asked = 0;
  for (const Candidate& candidate : all) {
    SCOPED_TRACE(candidate.effect->name());
    const auto one = MakeCandidates(fit.model, {candidate.effect}, {});
    ASSERT_EQ(one.size(), 1u);
    const auto alone =
        RespondToCandidates(linearized, fit.model, one, AllSets(one));
    for (size_t s = 0; s < alone.size(); ++s) {
      const auto columns = together[s].middleCols(asked, alone[s].cols());
      EXPECT_LE((columns - alone[s]).norm(), 1e-5 * alone[s].norm());
    }
    asked += static_cast<int>(alone.front().cols());
  }
  EXPECT_EQ(asked, together.front().cols());
}

// Of a drive with states of its own forces along the motion say nothing: the
// spring gives what its bend says, whatever the effort.
TEST(Screening, SeesWhatActsThroughAnElasticDrive) {
  const std::string drive = "joint_elasticity@joint1";
  const std::vector<Value> soft{{"joint1.drive_stiffness", 30.0},
                                {"joint1.drive_damping", 0.3},
                                {"joint1.motor_inertia", 0.03}};
  std::vector<Value> values = soft;
  values.push_back({"joint1.effort_gain", 0.3});
  const Model truth =
      Shipped("pendulum2_planar", {drive, "effort_gain@joint1"}, values);
  const Screened screened(
      MakeProblem(Shipped("pendulum2_planar", {drive}, soft), kLengths,
                  {Record(truth, 1, {.duration = 2.0, .level = 0.5}),
                   Record(truth, 2, {.duration = 2.0, .level = 0.5})}));
  const ScreenedEffect& gain = screened.Effect("effort_gain@joint1");
  EXPECT_LE(screened.Find("effort_gain@joint1"), 2);
  EXPECT_LT(gain.predicted_error, 0.8 * screened.screening.error);
}

// One hidden effect of a machine, small enough that first order holds.
struct Planted {
  std::string robot, effect, parameter;
  double value;
  double level = 0.0;  // of the efforts
  // By how much a score may miss. More for balls: what turns a thin rod about
  // its own axis saturates within a segment.
  double tolerance = 0.03;
};

void PrintTo(const Planted& planted, std::ostream* out) {
  *out << planted.parameter << " = " << planted.value;
}

DiagnosisProblem Plant(const Planted& planted, int runs = 2) {
  const bool corrects = planted.effect.empty();
  const Model truth = corrects ? Shipped(planted.robot, {},
                                         {{planted.parameter, planted.value}})
                               : Shipped(planted.robot, {planted.effect},
                                         {{planted.parameter, planted.value}});
  std::vector<Run> recorded;
  for (int seed = 1; seed <= runs; ++seed) {
    recorded.push_back(
        Record(truth, seed, {.duration = 4.0, .level = planted.level}));
  }
  const Model plain = Shipped(planted.robot);
  return MakeProblem(plain,
                     planted.robot == "cartpole"
                         ? std::vector<Value>{{"pole.length", 0.5}}
                         : kLengths,
                     recorded);
}

class SmallEffects : public testing::TestWithParam<Planted> {};

// The score is a promise: that much would the sum of squares fall. And the
// expected parameter is where it would end.
TEST_P(SmallEffects, ScoreWhatARefitGains) {
  const DiagnosisProblem problem = Plant(GetParam());
  const double tolerance = GetParam().tolerance;
  const Screened screened(problem);
  EXPECT_LT(screened.base.fit.train.total.normalized_rms, 4.0);
  const std::string name =
      GetParam().effect.empty()
          ? "mass@" +
                GetParam().parameter.substr(0, GetParam().parameter.find('.'))
          : GetParam().effect;
  const ScreenedEffect& effect = screened.Effect(name);
  std::map<std::string, double> start = ValuesOf(screened.base);
  for (const ExpectedParameter& expected : effect.parameters) {
    start[expected.name] = expected.value;
  }
  const EvaluatedModel after = EvaluateFrom(
      problem, screened.base, {effect.effect},
      {effect.without_influence.begin(), effect.without_influence.end()},
      {start}, 0.0, problem.options);
  const double drop = screened.base.fit.train.squares - after.fit.train.squares;
  EXPECT_GT(drop, 50.0);
  EXPECT_NEAR(effect.score, drop, tolerance * drop + 5.0);
  EXPECT_NEAR(effect.predicted_error, after.train_error(),
              (tolerance + 2 * tolerance * drop / after.fit.train.squares) *
                  after.train_error());
  EXPECT_LT(effect.p_value, 1e-4);
  const ExpectedParameter& expected = Expected(effect, GetParam().parameter);
  EXPECT_GT(expected.std_error, 0.0);
  EXPECT_NEAR(expected.value, GetParam().value,
              4 * expected.std_error + tolerance * GetParam().value);
  const ParameterEstimate& refitted =
      EstimateOf(after.fit, GetParam().parameter);
  EXPECT_NEAR(expected.value, refitted.value,
              expected.std_error + tolerance * GetParam().value);
}

INSTANTIATE_TEST_SUITE_P(
    All, SmallEffects,
    testing::Values(Planted{"pendulum2_planar", "viscous_damping@joint1",
                            "joint1.damping", 0.005},
                    Planted{"pendulum2_planar", "coulomb_friction@joint2",
                            "joint2.friction", 0.002},
                    Planted{"pendulum2_planar", "quadratic_drag@joint2",
                            "joint2.quadratic_drag", 0.001},
                    Planted{"pendulum2_planar", "effort_bias@joint1",
                            "joint1.effort_bias", 0.02},
                    Planted{"pendulum2_planar", "armature@joint2",
                            "joint2.armature", 0.0005},
                    Planted{"pendulum2_planar", "aerodynamic_drag@link2",
                            "link2.drag", 0.002},
                    Planted{"pendulum2_planar", "sensor_offset@joint2",
                            "joint2.sensor_offset", 0.003},
                    Planted{"pendulum2_planar", "gravity_tilt@base",
                            "gravity_tilt_y", 0.003},
                    Planted{"pendulum2_planar", "", "link2.mass", 1.02},
                    Planted{"pendulum2", "viscous_damping@joint2",
                            "joint2.damping", 0.0005, 0.0, 0.35},
                    // Its refit is at the noise and lets go of the spins, which
                    // gains a little more.
                    Planted{"pendulum2", "gravity_tilt@base", "gravity_tilt_x",
                            0.01, 0.0, 0.15},
                    Planted{"cartpole", "effort_gain@slider",
                            "slider.effort_gain", 0.01, 0.3},
                    Planted{"cartpole", "effort_delay@base", "effort_delay",
                            0.001, 0.3},
                    Planted{"cartpole", "viscous_damping@slider",
                            "slider.damping", 0.02, 0.3}),
    [](const auto& info) {
      std::string name = info.param.parameter;
      std::replace(name.begin(), name.end(), '.', '_');
      return info.param.robot + "_" + name;
    });

// A model that brakes too much lacks no friction, and a friction that drives is
// none: bounds are physics.
TEST(Screening, ScoresNothingBeyondABound) {
  const Model truth = Shipped("pendulum2_planar");
  const Model braked = Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                               {{"joint1.damping", 0.01}});
  const Screened screened(
      MakeProblem(braked, kLengths, {Record(truth, 1), Record(truth, 2)}));
  EXPECT_GT(screened.screening.error, 1.5);
  for (const char* name :
       {"coulomb_friction@joint1", "quadratic_drag@joint1"}) {
    SCOPED_TRACE(name);
    const ScreenedEffect& effect = screened.Effect(name);
    EXPECT_EQ(effect.score, 0.0);
    EXPECT_EQ(effect.p_value, 1.0);
    EXPECT_EQ(effect.parameters.front().value, 0.0);
    EXPECT_GE(effect.predicted_error, screened.screening.error);
  }
  // It is in the model already.
  EXPECT_THAT(screened.Names(), Not(Contains("viscous_damping@joint1")));
}

// What a free parameter can do as well is not missing, and must not look so by
// what rounding leaves of it: in a plane, a sensor that is off beside a world
// that may lean.
TEST(Screening, LeavesOutWhatFreeParametersUndo) {
  const Model truth = Shipped("pendulum2_planar");
  const std::vector<sysid::Run> runs{Record(truth, 1), Record(truth, 2)};
  const Screened held(MakeProblem(truth, kLengths, runs));
  EXPECT_THAT(held.Names(), Contains("sensor_offset@joint1"));
  std::vector<Value> free = kLengths;
  free.push_back({"gravity_tilt_y", 0.0});
  const Screened leaning(MakeProblem(
      Shipped("pendulum2_planar", {"gravity_tilt@base"}), free, runs));
  EXPECT_THAT(leaning.Names(), Not(Contains("sensor_offset@joint1")));
  EXPECT_THAT(leaning.Names(), Contains("sensor_offset@joint2"));
}

TEST(Screening, NeverMovesWhatIsKnown) {
  const Model truth = Shipped("pendulum2_planar");
  DiagnosisProblem problem =
      MakeProblem(truth, kLengths, {Record(truth, 1), Record(truth, 2)});
  problem.known = {"link2.mass", "link2.com_x", "link2.com_z"};
  const Screened screened(problem);
  EXPECT_THAT(screened.Names(), Not(Contains("mass@link2")));
  EXPECT_THAT(screened.Names(), Contains("mass@link1"));
  EXPECT_THAT(screened.Names(), Contains("inertia@link2"));
  for (const ScreenedEffect& effect : screened.screening.effects) {
    for (const ExpectedParameter& expected : effect.parameters) {
      EXPECT_EQ(problem.known.count(expected.name), 0u) << expected.name;
    }
  }
}

// In a plane a world that leans is a first sensor that is off: no data of it
// tells which, and whoever reads the list must learn that.
TEST(Screening, KnowsWhatNoDataOfThisMechanismTellsApart) {
  const Screened screened(
      Plant({"pendulum2_planar", "gravity_tilt@base", "gravity_tilt_y", 0.01}));
  const int tilt = screened.Find("gravity_tilt@base");
  const int offset = screened.Find("sensor_offset@joint1");
  ASSERT_GE(tilt, 0);
  ASSERT_GE(offset, 0);
  EXPECT_NEAR(screened.Effect("gravity_tilt@base").score,
              screened.Effect("sensor_offset@joint1").score,
              1e-3 * screened.Effect("gravity_tilt@base").score);
  // The other lean is out of the plane.
  EXPECT_THAT(screened.Effect("gravity_tilt@base").without_influence,
              testing::ElementsAre("gravity_tilt_x"));
  EXPECT_EQ(screened.Effect("gravity_tilt@base").dof, 1);
}

// Over many complete models a p-value, which pays for all candidates, is small
// no more often than it says; and what is told as detectable is found as often
// as is told, in the same motion with other noise.
TEST(Screening, KeepsItsPromisesOverManyRecordings) {
  constexpr int kSeeds = 60;
  const Model plain = Shipped("pendulum2_planar");
  const auto screen = [&](const Model& truth, int start, int seed) {
    const sysid::Run run = Record(truth, seed, {.start = start});
    return Screened(MakeProblem(plain, kLengths, {run, run}));
  };
  int below_5 = 0, below_1 = 0;
  std::vector<double> detectable;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const Screened screened = screen(plain, seed, seed);
    double least = 1.0;
    for (const ScreenedEffect& effect : screened.screening.effects) {
      EXPECT_GE(effect.p_value, 0.0);
      EXPECT_LE(effect.p_value, 1.0);
      least = std::min(least, effect.p_value);
    }
    below_5 += least < 0.05;
    below_1 += least < 0.01;
    detectable.push_back(
        screened.Effect("viscous_damping@joint1").parameters[0].detectable);
  }
  EXPECT_LE(below_5, 9);  // of 3; more by chance once in 1000
  EXPECT_LE(below_1, 4);  // of 0.6
  int found = 0, third = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const auto is_found = [&](double part) {
      const Model truth =
          Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                  {{"joint1.damping", part * detectable[seed - 1]}});
      return screen(truth, seed, seed + kSeeds)
                 .Effect("viscous_damping@joint1")
                 .p_value < 0.01;
    };
    found += is_found(1.0);
    third += is_found(0.3);
  }
  EXPECT_NEAR(found, 0.8 * kSeeds, 9);  // three standard deviations
  EXPECT_LE(third, 0.1 * kSeeds);
}

}  // namespace
}  // namespace sysid
