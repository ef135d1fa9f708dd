// Issue 19: of right recordings of six-axis arms, whose models lack an effect,
// the check said that the efforts of the wrist were "not what moved the
// mechanism", and advised to take them times 1e-9.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>

#include "models/stepper.h"
#include "models/urdf/load_urdf.h"
#include "sysid/session/check_session.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kJoints = 6;

struct Part {
  const char* axis;
  double offset;  // of the joint from the one before, along z, m
  double length;  // m
  double mass;    // kg
  double start;   // of the joint, rad
};

// The last three are a wrist.
constexpr Part kArm[kJoints] = {
    {"0 0 1", 0.0, 0.30, 8.0, 0.0},   {"0 1 0", 0.30, 0.40, 6.0, 0.4},
    {"0 1 0", 0.40, 0.20, 3.0, 0.8},  {"0 0 1", 0.20, 0.20, 1.0, 0.2},
    {"0 1 0", 0.20, 0.08, 0.5, -0.6}, {"0 0 1", 0.08, 0.06, 0.15, 0.1}};

std::string JointName(int j) { return "joint" + std::to_string(j + 1); }

// Uniform cylinders, their centres beside the axes by a tenth of their length,
// so that each joint carries weight.
Mechanism SixAxes() {
  std::ostringstream urdf;
  urdf << "<robot name=\"arm6\"><link name=\"base\"/>";
  for (int j = 0; j < kJoints; ++j) {
    const auto& [axis, offset, l, m, start] = kArm[j];
    const double r = std::max(0.03, l / 6.0);
    const double across = m * (3.0 * r * r + l * l) / 12.0;
    const std::string parent = j == 0 ? "base" : "link" + std::to_string(j);
    const std::string link = "link" + std::to_string(j + 1);
    urdf << "<joint name=\"" << JointName(j) << "\" type=\"continuous\">"
         << "<origin xyz=\"0 0 " << offset << "\"/><parent link=\"" << parent
         << "\"/><child link=\"" << link << "\"/><axis xyz=\"" << axis
         << "\"/></joint><link name=\"" << link << "\"><inertial><origin xyz=\""
         << 0.1 * l << " 0 " << 0.5 * l << "\"/><mass value=\"" << m
         << "\"/><inertia ixx=\"" << across << "\" ixy=\"0\" ixz=\"0\" iyy=\""
         << across << "\" iyz=\"0\" izz=\"" << 0.5 * m * r * r
         << "\"/></inertial></link>";
  }
  urdf << "</robot>";
  return LoadUrdfText(urdf.str(), "arm6.urdf");
}

// An effect on every joint: so much (of its first parameter) on the first, and
// on each further joint 0.6 of that on the one before.
struct OnEveryJoint {
  std::string kind;
  double size;
};

Model Arm(const std::vector<OnEveryJoint>& effects) {
  const Catalogue catalogue;
  Model model = MakeModel(SixAxes(), catalogue);
  for (const OnEveryJoint& effect : effects) {
    for (int j = 0; j < kJoints; ++j) {
      const auto made = catalogue.Make(effect.kind + "@" + JointName(j),
                                       model.mechanism(), "test");
      model.AddEffect(made);
      model.SetEffectParameter(made->parameters().front().name,
                               effect.size * std::pow(0.6, j));
    }
  }
  return model;
}

// Three sines of 0.2 to 1.6 Hz about the start, whose value begins there.
class Reference {
 public:
  Reference(double start, std::mt19937_64* random) : start_(start) {
    std::uniform_real_distribution<double> within(0.0, 1.0);
    for (int s = 0; s < 3; ++s) {
      rate_[s] = 2.0 * M_PI * 0.2 * std::pow(8.0, within(*random));
      phase_[s] = 2.0 * M_PI * within(*random);
    }
  }

  // Position, velocity and acceleration.
  Eigen::Vector3d At(double t) const {
    constexpr double kAmplitude = 0.3;  // rad
    Eigen::Vector3d all(start_, 0.0, 0.0);
    for (int s = 0; s < 3; ++s) {
      const double w = rate_[s], angle = w * t + phase_[s];
      all += kAmplitude * Eigen::Vector3d(std::sin(angle) - std::sin(phase_[s]),
                                          w * std::cos(angle),
                                          -w * w * std::sin(angle));
    }
    return all;
  }

 private:
  double start_, rate_[3], phase_[3];
};

// 4 s at 100 Hz under a computed torque, held from sample to sample, and an
// encoder's noise.
sysid::Run Driven(const Model& truth, std::uint64_t seed) {
  constexpr int kSamples = 401, kSteps = 20;
  constexpr double kPeriod = 0.01, kNoise = 2e-4;        // s, rad
  constexpr double kStiffness = 100.0, kDamping = 15.0;  // 1/s^2, 1/s
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, kNoise);
  sysid::Run run;
  run.name = "arm.csv";
  run.effort.setZero(kSamples, kJoints);
  std::vector<Reference> references;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(2 * kJoints);
  for (int j = 0; j < kJoints; ++j) {
    x[j] = kArm[j].start;
    references.emplace_back(x[j], &random);
    Channel channel;
    channel.target = j;
    channel.name = JointName(j);
    channel.values.resize(kSamples, 1);
    run.channels.push_back(channel);
  }
  Workspace<double> ws(truth);
  Stepper<double> stepper(Integrator::kRungeKutta4, &ws);
  Eigen::VectorXd qdd(kJoints), tau(kJoints);
  for (int k = 0; k < kSamples; ++k) {
    run.t.push_back(kPeriod * k);
    for (int j = 0; j < kJoints; ++j) {
      run.channels[j].values(k, 0) = x[j] + noise(random);
      const Eigen::Vector3d wanted = references[j].At(run.t[k]);
      qdd[j] = wanted[2] + kDamping * (wanted[1] - x[kJoints + j]) +
               kStiffness * (wanted[0] - x[j]);
    }
    InverseDynamics(&ws, x.data(), x.data() + kJoints, qdd.data(), tau.data());
    run.effort.row(k) = tau;
    for (int s = 0; s < kSteps; ++s) {
      EXPECT_TRUE(stepper.Step(kPeriod / kSteps, tau.data(), x.data()));
    }
  }
  return run;
}

// A recording of the arm with effects, checked with a model that has others.
// Returns the error of that model, with the frictions that the check frees in
// every model that it compares (docs/checks.md).
double ExpectNoFinding(const std::vector<OnEveryJoint>& truth,
                       const std::vector<OnEveryJoint>& known) {
  Session session{Arm(known)};
  session.model_name = "arm6";
  session.model_file = "arm6.urdf";
  std::vector<Value> masses;
  for (int j = 1; j < kJoints; ++j) {
    masses.push_back({"link" + std::to_string(j + 1) + ".mass", kArm[j].mass});
  }
  session.free = FreeFrom(session.model, masses);
  session.runs = {Driven(Arm(truth), 1)};
  const RowMatrixXd& effort = session.runs[0].effort;
  // Small beside the others, yet what moves the wrist.
  EXPECT_LT(effort.col(5).norm(), 0.1 * effort.col(1).norm());
  const CheckResult result = CheckSession(&session);
  for (const Finding& finding : session.findings) {
    EXPECT_NE(finding.fault, "effort_idle");
    EXPECT_THAT(FullText(finding), Not(HasSubstr("1e-9")));
  }
  return result.error;
}

constexpr double kLacks = 5.0;  // times the noise, or more

TEST(SixAxesTest, AMissingFrictionIsNoFindingOfTheWrist) {
  // Friction is what the check frees: it finds it, and the rest is noise.
  EXPECT_LT(ExpectNoFinding({{"armature", 0.4}, {"coulomb_friction", 5.0}},
                            {{"armature", 0.4}}),
            1.5);
}

// The model's wrist weighs a hundredth of what its motors turn: its efforts
// throw it off, and without them the model is nearer, and far away still.
TEST(SixAxesTest, MissingRotorsAreNoFindingOfTheWrist) {
  EXPECT_GT(ExpectNoFinding({{"armature", 0.02}}, {}), kLacks);
}

TEST(SixAxesTest, MissingRotorsAndFrictionAreNoFindingOfTheWrist) {
  EXPECT_GT(ExpectNoFinding({{"armature", 0.4}, {"coulomb_friction", 5.0}}, {}),
            kLacks);
}

}  // namespace
}  // namespace sysid
