#include "sysid/session/table_range.h"

#include <gmock/gmock.h>

#include <cmath>

#include "models/effects/catalogue.h"
#include "models/effects/force_table.h"
#include "sysid/session/diagnosis_session.h"
#include "tests/support/error_text.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;

// joint1 swings by 0.5 rad about 1 rad at 1 Hz, under efforts of 2 N m.
Session Swinging(const std::string& effect) {
  Session session(Shipped("pendulum2_planar", {effect}));
  Run run;
  run.name = "swing.csv";
  Channel joint1;
  joint1.target = 0;
  joint1.name = "joint1";
  joint1.values.resize(400, 1);
  for (int k = 0; k < 400; ++k) {
    run.t.push_back(0.01 * k);
    joint1.values(k, 0) = 1.0 + 0.5 * std::sin(2 * M_PI * run.t[k]);
  }
  run.channels = {joint1};
  run.effort.setZero(400, 2);
  run.effort.col(0).setConstant(2.0);
  session.runs = {run};
  session.free = FreeFrom(session.model, {{"link1.length", 0.5}});
  for (const EffectParameter& p :
       session.model.effects().effect(0).parameters()) {
    if (IsGiven(p)) continue;
    for (FreeParameter& f : FreeFrom(session.model, {{p.name, 0.0}})) {
      session.free.push_back(std::move(f));
    }
  }
  return session;
}

double ValueOf(const Session& session, const std::string& name) {
  return FindParameters(session.model, {name}, "test").front().nominal;
}

TEST(CoverTables, ReachOverTheRunsPositionsAndSpeeds) {
  Session session = Swinging("force_table@joint1");
  CoverTables(&session);
  // 0.5 rad to 1.5 rad and a fortieth of that; pi rad/s.
  EXPECT_NEAR(ValueOf(session, "joint1.table_below"), -0.475, 0.01);
  EXPECT_NEAR(ValueOf(session, "joint1.table_above"), 1.525, 0.01);
  EXPECT_NEAR(ValueOf(session, "joint1.table_speed"), 1.025 * M_PI, 0.1);
}

TEST(CoverTables, LeaveARangeThatSomebodyFixed) {
  Session session = Swinging("force_table@joint1");
  session.fixed = {"joint1.table_speed"};
  const double before = ValueOf(session, "joint1.table_speed");
  CoverTables(&session);
  EXPECT_EQ(ValueOf(session, "joint1.table_speed"), before);
  EXPECT_NEAR(ValueOf(session, "joint1.table_above"), 1.525, 0.01);
}

TEST(CoverTables, BelieveInWeightsThatAreSmallBesideTheEfforts) {
  Session session = Swinging("force_table@joint1");
  session.free[1].prior = FreeParameter::Prior{0.5, 0.1};
  CoverTables(&session);
  ASSERT_EQ(session.free.size(), 1u + ForceTable::kWeights);
  EXPECT_FALSE(session.free[0].prior);
  EXPECT_EQ(session.free[1].prior->mean, 0.5);
  for (int k = 2; k <= ForceTable::kWeights; ++k) {
    ASSERT_TRUE(session.free[k].prior) << k;
    EXPECT_EQ(session.free[k].prior->mean, 0.0);
    EXPECT_DOUBLE_EQ(session.free[k].prior->std, 2.0 / 30.0);
  }
}

TEST(CoverTables, TakeTheOtherJointsEffortsForAJointWithoutOne) {
  Session session = Swinging("force_table@joint2");
  CoverTables(&session);
  EXPECT_NEAR(session.free[1].prior->std, std::sqrt(2.0) / 30.0, 1e-12);
  // Not measured: as it comes.
  EXPECT_EQ(ValueOf(session, "joint2.table_speed"), 10.0);
}

TEST(ChooseCandidates, NeverHaveATable) {
  const Session session = Swinging("viscous_damping@joint1");
  const Catalogue catalogue;
  for (const auto& effect :
       ChooseCandidates(catalogue, session, {}, "--candidates")) {
    EXPECT_NE(effect->kind(), "force_table");
  }
  EXPECT_THAT(ErrorText([&] {
                ChooseCandidates(catalogue, session, {"force_table@joint1"},
                                 "--candidates");
              }),
              HasSubstr("a table explains nothing"));
}

}  // namespace
}  // namespace sysid
