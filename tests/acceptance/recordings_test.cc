// Recordings that others measured: found through SYSID_REAL_DATA, by default in
// ../shared/data beside the repository; skipped where they are absent.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "sysid/inverse_dynamics/effort_comparison.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/session/named_values.h"
#include "sysid/session/session.h"

namespace sysid {
namespace {

using std::filesystem::path;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

path DataFolder() {
  const char* given = std::getenv("SYSID_REAL_DATA");
  return given != nullptr ? given : SYSID_REAL_DATA_DEFAULT;
}

#define SKIP_WITHOUT(folder)                                        \
  if (!std::filesystem::exists(DataFolder() / folder)) {            \
    GTEST_SKIP() << "no recordings in " << (DataFolder() / folder); \
  }

Fit FitOf(const FitRequest& request) {
  const Catalogue catalogue;
  const Session session = OpenSession(request, catalogue);
  ShootingProblem problem(session.model, session.free, session.runs,
                          session.options);
  return FitLevenbergMarquardt(problem);
}

double ValueOfParameter(const Fit& fit, const std::string& name) {
  for (const ParameterEstimate& p : fit.parameters) {
    if (p.name == name) return p.value;
  }
  ADD_FAILURE() << name << " was not fitted";
  return 0.0;
}

// Of all channels and runs, in their unit.
double OpenRms(const Fit& fit) {
  double squares = 0.0;
  int count = 0;
  for (const OpenError& run : fit.open) {
    for (const OpenError::Channel& channel : run.channels) {
      squares += channel.rms * channel.rms;
      ++count;
    }
  }
  return std::sqrt(squares / count);
}

// The rows of a recording up to a time (first column), in a file of its own.
std::string Cut(const path& file, double until,
                const path& folder = testing::TempDir()) {
  std::ifstream in(file);
  const path out = folder / ("cut_" + file.filename().string());
  std::ofstream cut(out);
  std::string line;
  for (bool header = true; std::getline(in, line); header = false) {
    if (!header && std::stod(line) > until) break;
    cut << line << "\n";
  }
  return out.string();
}

// Janot, Gautier, Brunot (2019): 95.1 kg, 203.5 N s/m, 20.4 N.
TEST(Emps, MassAndFrictionAreThoseThatWerePublished) {
  SKIP_WITHOUT("emps");
  FitRequest request;
  request.model = "emps";
  request.traj = {DataFolder() / "emps" / "emps.csv"};
  const Fit fit = FitOf(request);
  EXPECT_TRUE(fit.converged) << fit.termination;
  // 96.2 +- 5.6 kg; 96.0 while the friction was smoothed and the error larger.
  EXPECT_NEAR(ValueOfParameter(fit, "link1.mass"), 95.1, 0.015 * 95.1);
  EXPECT_NEAR(ValueOfParameter(fit, "joint1.damping"), 203.5, 0.10 * 203.5);
  EXPECT_NEAR(ValueOfParameter(fit, "joint1.friction"), 20.4, 0.12 * 20.4);
  EXPECT_LE(OpenRms(fit), 2.6e-3);
}

TEST(DoublePendulum, IsPredictedOverWholeRuns) {
  SKIP_WITHOUT("double_pendulum_dfki");
  FitRequest request;
  request.model = "double_pendulum_dfki";
  for (const auto& entry : std::filesystem::directory_iterator(
           DataFolder() / "double_pendulum_dfki")) {
    if (entry.path().extension() == ".csv") {
      request.traj.push_back(entry.path());
    }
  }
  std::sort(request.traj.begin(), request.traj.end());
  ASSERT_EQ(request.traj.size(), 6u);
  const Fit fit = FitOf(request);
  EXPECT_TRUE(fit.converged) << fit.termination;
  EXPECT_LE(OpenRms(fit), 0.06);
}

TEST(SimplePendulum, LoadsByItsColumnsAndFits) {
  SKIP_WITHOUT("simple_pendulum_dfki");
  const path folder = DataFolder() / "simple_pendulum_dfki";
  FitRequest request;
  request.model = "simple_pendulum_dfki";
  request.columns =
      ParseColumnMap("t=time,joint1.q=position,joint1.tau=torque");
  request.traj = {Cut(folder / "ddp.csv", 6.0),
                  Cut(folder / "direct_collocation.csv", 3.5),
                  Cut(folder / "energy_shaping.csv", 3.8)};
  const Fit fit = FitOf(request);
  EXPECT_TRUE(fit.converged) << fit.termination;
  EXPECT_GT(ValueOfParameter(fit, "joint1.friction"), 0.0);
}

FitRequest VideoPendulumRequest() {
  FitRequest request;
  request.model = "video_pendulum";
  request.columns = ParseColumnMap("t=t,joint1.q=theta");
  request.traj = {DataFolder() / "video_pendulum" / "pendulum.csv"};
  return request;
}

TEST(VideoPendulum, LoadsByItsColumnsAndItsStringIsAsLongAsMeasured) {
  SKIP_WITHOUT("video_pendulum");
  const Fit fit = FitOf(VideoPendulumRequest());
  EXPECT_TRUE(fit.converged) << fit.termination;
  // The string is 0.65 m to the cup's rim; the coins lie deeper.
  EXPECT_NEAR(ValueOfParameter(fit, "link1.length"), 0.66, 0.03);
}

// What no segment shows adds up over its 116 s.
TEST(VideoPendulum, WholeRunsShowAFrictionBesideTheDrag) {
  SKIP_WITHOUT("video_pendulum");
  FitRequest request = VideoPendulumRequest();
  request.free = SplitAssignments("link1.length", "--free");
  const Catalogue catalogue;
  const Session session = OpenSession(request, catalogue);
  std::vector<std::string> notices;
  DiagnosisOptions options;
  options.add = true;
  const DiagnosisProblem problem = OpenDiagnosis(session, &notices);
  const Diagnosis diagnosis = Diagnose(
      problem, ChooseCandidates(catalogue, session, {}, "test"), options);
  EXPECT_EQ(diagnosis.added().size(), 3u);
  const FinalFit final = FitFinal(session, problem, diagnosis);
  EXPECT_LT(final.fit.open.front().channels.front().rms, 8.5e-3);
}

// The first seconds of a free swing of one link, of which a ratio of inertial
// values shows.
Diagnosis DiagnoseSwing(double seconds) {
  // Tests run beside each other: a folder for each.
  const path folder =
      path(testing::TempDir()) / ("swing" + std::to_string(seconds));
  std::filesystem::create_directories(folder);
  // Away from its specification, which has the friction.
  const path model = folder / "swing.urdf";
  std::filesystem::copy_file(SYSID_FAULT_MODELS "/multiarm_single.urdf", model,
                             std::filesystem::copy_options::overwrite_existing);
  FitRequest request;
  request.model = model;
  request.traj = {
      Cut(DataFolder() / "multiarm_pendulum" / "single.csv", seconds, folder)};
  request.columns = ParseColumnMap("joint1.q=theta1-pi");
  request.free = SplitAssignments("link1.inertia_scale", "--free");
  const Catalogue catalogue;
  const Session session = OpenSession(request, catalogue);
  std::vector<std::string> notices;
  DiagnosisOptions options;
  options.add = true;
  return Diagnose(OpenDiagnosis(session, &notices),
                  ChooseCandidates(catalogue, session, {}, "test"), options);
}

TEST(MultiArmPendulum, ThreeSecondsShowAFriction) {
  SKIP_WITHOUT("multiarm_pendulum");
  const Diagnosis diagnosis = DiagnoseSwing(3.0);
  EXPECT_THAT(diagnosis.added(), ElementsAre("coulomb_friction@joint1"));
}

TEST(MultiArmPendulum, TenSecondsShowFriction) {
  SKIP_WITHOUT("multiarm_pendulum");
  const Diagnosis diagnosis = DiagnoseSwing(10.0);
  EXPECT_THAT(diagnosis.added(), Contains("coulomb_friction@joint1"));
  EXPECT_LE(diagnosis.added().size(), 4u);
}

// An arm under position control, at 250 Hz.
FitRequest Tx40At250Hz() {
  const path folder = DataFolder() / "staubli_tx40";
  const path thin =
      path(testing::TempDir()) /
      (std::string("tx40_") +
       testing::UnitTest::GetInstance()->current_test_info()->name() + ".csv");
  {
    std::ifstream in(folder / "motor_side_1kHz.csv");
    std::ofstream out(thin);
    std::string line;
    for (int row = 0; std::getline(in, line); ++row) {
      if (row == 0 || row % 4 == 1) out << line << "\n";
    }
  }
  FitRequest request;
  request.model = folder / "tx40.urdf";
  request.traj = {thin};
  request.columns = ParseColumnMap(
      "joint_1.q=qm1/32,joint_2.q=qm2/32-pi/2,joint_3.q=qm3/45+pi/2,"
      "joint_4.q=qm4/-48,joint_5.q=qm5/45,joint_6.q=qm6/32-qm5/45,"
      "joint_1.tau=cm1*32,joint_2.tau=cm2*32,joint_3.tau=cm3*45,"
      "joint_4.tau=cm4*-48,joint_5.tau=cm5*45+cm6*32,joint_6.tau=cm6*32");
  return request;
}

// Its wrist has a coupling that no
// effect here describes, so that rollouts lose the motion; the other axes are
// still what their efforts say.
TEST(StaubliTx40, SegmentsAreFittedTogetherWithTheEquationsOfMotion) {
  SKIP_WITHOUT("staubli_tx40");
  FitRequest request = Tx40At250Hz();
  request.free = SplitAssignments("inertial", "--free");
  request.add = SplitEffects(
      "viscous_damping@*,coulomb_friction@*,armature@*,effort_bias@*", "--add");
  const Catalogue catalogue;
  const Session session = OpenSession(request, catalogue);
  const ShootingProblem problem(session.model, session.free, session.runs,
                                session.options);
  const ShootingProblem started = StartByInverseDynamics(problem);
  ASSERT_NE(started.equations(), nullptr);
  const Fit fit = FitLevenbergMarquardt(started);
  EXPECT_TRUE(fit.converged) << fit.termination;
  EXPECT_EQ(fit.defect, std::numeric_limits<double>::infinity());
  // It moved, and predicts better than it began.
  EXPECT_GT((fit.point.theta - started.InitialTheta()).norm(), 1e-3);
  Solution begun = fit.point;
  begun.theta = started.InitialTheta();
  EXPECT_LT(fit.train.total.rms, EvaluateErrors(started, begun, 0.0).total.rms);
  const std::vector<EffortError> at_start =
      CompareEfforts(problem, started.InitialTheta()).errors;
  const std::vector<EffortError> at_end =
      CompareEfforts(problem, fit.point.theta).errors;
  ASSERT_EQ(at_end.size(), 6u);
  for (int axis = 0; axis < 6; ++axis) {
    EXPECT_LE(at_end[axis].percent, 1.1 * at_start[axis].percent) << axis + 1;
  }
}

// Of the plain URDF, whose link 6 has no inertia, with nothing free: what every
// drive has is missing, and the wrist's motors turn with two axes.
TEST(StaubliTx40, DiagnosisAddsFrictionRotorsAndTheCoupling) {
  SKIP_WITHOUT("staubli_tx40");
  FitRequest request = Tx40At250Hz();
  request.may_free_nothing = true;
  request.assumes_inertia = true;
  const Catalogue catalogue;
  const Session session = OpenSession(request, catalogue);
  EXPECT_THAT(session.notices, Contains(HasSubstr("link_6 has no inertia")));
  std::vector<std::string> notices;
  const DiagnosisProblem problem = OpenDiagnosis(session, &notices);
  DiagnosisOptions options;
  options.add = true;
  const Diagnosis diagnosis = Diagnose(
      problem, ChooseCandidates(catalogue, session, {}, "test"), options);
  EXPECT_EQ(diagnosis.verdict, Verdict::kMissingEffect);
  EXPECT_TRUE(diagnosis.by_equations);
  const std::vector<std::string> added = diagnosis.added();
  for (const char* axis : {"joint_1", "joint_2", "joint_3", "joint_4"}) {
    for (const char* effect :
         {"viscous_damping@", "coulomb_friction@", "armature@"}) {
      EXPECT_THAT(added, Contains(std::string(effect) + axis));
    }
  }
  EXPECT_THAT(added, Contains("gear_coupling@joint_5,joint_6"));
}

}  // namespace
}  // namespace sysid
