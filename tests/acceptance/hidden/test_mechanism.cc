#include "tests/acceptance/hidden/test_mechanism.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

#include "glog/logging.h"
#include "models/find_model.h"
#include "models/math/rotation.h"
#include "models/parameters.h"
#include "models/urdf/load_urdf.h"
#include "sysid/parameters/fit_specification.h"

namespace sysid {
namespace {

constexpr char kArm3[] = R"(<?xml version="1.0"?>
<!-- A light arm that hangs from a stand: it turns about the vertical, at the
     shoulder and at the elbow. -->
<robot name="arm3">
  <link name="stand"/>
  <joint name="yaw" type="continuous">
    <origin xyz="0 0 0.8" rpy="0 0 0"/>
    <parent link="stand"/>
    <child link="turret"/>
    <axis xyz="0 0 1"/>
  </joint>
  <link name="turret">
    <inertial>
      <origin xyz="0.02 0 -0.02" rpy="0 0 0"/>
      <mass value="0.8"/>
      <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.003"/>
    </inertial>
  </link>
  <joint name="shoulder" type="continuous">
    <origin xyz="0.05 0 -0.05" rpy="0 0 0"/>
    <parent link="turret"/>
    <child link="upper"/>
    <axis xyz="0 1 0"/>
  </joint>
  <link name="upper">
    <inertial>
      <origin xyz="0 0.01 -0.14" rpy="0 0 0"/>
      <mass value="0.9"/>
      <inertia ixx="0.008" ixy="0" ixz="0" iyy="0.008" iyz="0" izz="0.0012"/>
    </inertial>
  </link>
  <joint name="elbow" type="continuous">
    <origin xyz="0 0.03 -0.32" rpy="0 0 0"/>
    <parent link="upper"/>
    <child link="fore"/>
    <axis xyz="0 1 0"/>
  </joint>
  <link name="fore">
    <inertial>
      <origin xyz="0.01 0 -0.12" rpy="0 0 0"/>
      <mass value="0.6"/>
      <inertia ixx="0.005" ixy="0" ixz="0" iyy="0.005" iyz="0" izz="0.0008"/>
    </inertial>
  </link>
  <joint name="tool_joint" type="fixed">
    <origin xyz="0 0 -0.28" rpy="0 0 0"/>
    <parent link="fore"/>
    <child link="tool"/>
  </joint>
  <link name="tool"/>
</robot>
)";

FreeParameter MakeFree(const Model& model, const std::string& name,
                       double lower, double upper) {
  FreeParameter free;
  free.parameter = FindParameters(model, {name}, "test").front();
  free.initial = free.parameter.nominal;
  free.lower = std::max(lower, free.parameter.lower);
  free.upper = std::min(upper, free.parameter.upper);
  return free;
}

TestMechanism Shipped(const std::string& robot) {
  const std::filesystem::path urdf = FindModel(robot);
  TestMechanism mechanism(MakeModel(LoadUrdf(urdf), Catalogue()));
  std::filesystem::path spec = urdf;
  spec.replace_extension(".sysid.yaml");
  for (const auto& free : ReadFitSpecification(spec).free) {
    mechanism.free.push_back(
        MakeFree(mechanism.plain, free.name, *free.lower, *free.upper));
  }
  mechanism.name = robot;
  return mechanism;
}

TestMechanism Arm3() {
  TestMechanism mechanism(
      MakeModel(LoadUrdfText(kArm3, "arm3.urdf"), Catalogue()));
  mechanism.name = "arm3";
  mechanism.free = {MakeFree(mechanism.plain, "upper.mass", 0.05, 20.0),
                    MakeFree(mechanism.plain, "fore.length", 0.02, 5.0)};
  mechanism.drive = Drive::kTracking;
  mechanism.driven = {mechanism.plain.mechanism().FindJoint("yaw"),
                      mechanism.plain.mechanism().FindJoint("shoulder"),
                      mechanism.plain.mechanism().FindJoint("elbow")};
  mechanism.middle = {0.0, 0.5, -0.8};
  mechanism.sweep = 0.8;
  mechanism.window = 0.25;
  return mechanism;
}

// Balls of 1 kg and 0.15 m: 2/5 m r^2 about every axis.
void MakeBobsBalls(Model* model) {
  for (const char* link : {"link1", "link2"}) {
    std::vector<std::string> names;
    for (const char* entry : {"ixx", "iyy", "izz"}) {
      names.push_back(std::string(link) + "." + entry);
    }
    SetParameters(FindParameters(*model, names, "test"), {9e-3, 9e-3, 9e-3},
                  model);
  }
}

// Draws within +-[half, all] of `size`.
double Away(double size, std::mt19937_64* random) {
  std::uniform_real_distribution<double> part(0.5, 1.0), side(-1.0, 1.0);
  const double sign = side(*random) < 0 ? -1.0 : 1.0;
  return sign * size * part(*random);
}

}  // namespace

std::vector<std::string> TestMechanismNames() {
  return {"pendulum2_planar",
          "pendulum3_planar",
          "pendulum1",
          "pendulum2",
          "pendulum2_balls",
          "cartpole",
          "rail",
          "arm3",
          "arm7"};
}

TestMechanism MakeTestMechanism(const std::string& name) {
  if (name == "arm3") return Arm3();
  if (name == "cartpole") {
    TestMechanism mechanism = Shipped(name);
    mechanism.drive = Drive::kMultisine;
    mechanism.tilt = 0.6;
    mechanism.window = 0.5;
    return mechanism;
  }
  if (name == "rail") {
    TestMechanism mechanism = Shipped("cartpole");
    mechanism.name = name;
    mechanism.drive = Drive::kTracking;
    mechanism.tilt = 0.6;
    mechanism.driven = {mechanism.plain.mechanism().FindJoint("slider")};
    mechanism.middle = {0.0};
    mechanism.sweep = 0.25;
    return mechanism;
  }
  if (name == "arm7") {
    TestMechanism mechanism = Shipped(name);
    mechanism.drive = Drive::kTracking;
    mechanism.driven = {0, 1, 2, 3, 4, 5, 6};
    // Amid the joints' limits.
    mechanism.middle = {0.0, 0.3, 0.0, -1.5, 0.0, 1.8, 0.0};
    mechanism.sweep = 0.7;
    mechanism.window = 0.15;
    return mechanism;
  }
  if (name == "pendulum2_balls") {
    TestMechanism mechanism = Shipped("pendulum2");
    mechanism.name = name;
    MakeBobsBalls(&mechanism.plain);
    mechanism.tilt = 0.9;
    mechanism.push = 1.0;
    return mechanism;
  }
  CHECK(name == "pendulum1" || name == "pendulum2" ||
        name == "pendulum2_planar" || name == "pendulum3_planar" ||
        name == "pendulum3")
      << name;
  TestMechanism mechanism = Shipped(name);
  mechanism.tilt = name.starts_with("pendulum3") ? 0.6 : 0.9;
  mechanism.push = 1.0;
  return mechanism;
}

Model TrueModel(const TestMechanism& mechanism, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> off(0.9, 1.1);
  std::vector<Parameter> parameters;
  std::vector<double> values;
  for (const FreeParameter& free : mechanism.free) {
    parameters.push_back(free.parameter);
    values.push_back(off(random) * free.initial);
  }
  Model truth = mechanism.plain;
  SetParameters(parameters, values, &truth);
  return truth;
}

Eigen::VectorXd StartOf(const TestMechanism& mechanism, std::uint64_t seed) {
  const Model& model = mechanism.plain;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> turn(0.0, 2 * M_PI);
  Eigen::VectorXd x(model.state_size());
  x << model.mechanism().NeutralConfiguration(),
      Eigen::VectorXd::Zero(model.nv());
  for (const Body& body : model.bodies()) {
    double* q = &x[body.q_index];
    double* qd = &x[model.nq() + body.v_index];
    if (body.type == JointType::kSpherical) {
      const double direction = turn(random), other = turn(random);
      const double tilt = Away(mechanism.tilt, &random);
      const double push = Away(mechanism.push, &random);
      const Eigen::Vector3d phi(tilt * std::cos(direction),
                                tilt * std::sin(direction), 0.0);
      x.segment<4>(body.q_index) = Exp<double>(phi).coeffs();
      // About a horizontal axis of the link: it does not spin.
      qd[0] = push * std::cos(other);
      qd[1] = push * std::sin(other);
    } else if (body.type != JointType::kPrismatic) {
      *q = Away(mechanism.tilt, &random);
      *qd = Away(mechanism.push, &random);
    }
  }
  if (mechanism.drive == Drive::kTracking) {
    const Reference reference(mechanism, seed);
    for (size_t i = 0; i < mechanism.driven.size(); ++i) {
      const Joint& joint = model.mechanism().joints[mechanism.driven[i]];
      double qdd;
      reference.At(static_cast<int>(i), 0.0, &x[joint.q_index],
                   &x[model.nq() + joint.v_index], &qdd);
    }
  }
  return x;
}

Reference::Reference(const TestMechanism& mechanism, std::uint64_t seed)
    : middle_(mechanism.middle) {
  constexpr int kSines = 3;
  constexpr double kLowest = 0.1, kHighest = 0.9;  // Hz
  std::mt19937_64 random(seed ^ 0x5eed);
  std::uniform_real_distribution<double> within(0.0, 1.0);
  for (size_t i = 0; i < mechanism.driven.size(); ++i) {
    std::vector<Sine> sines;
    for (int s = 0; s < kSines; ++s) {
      const double f =
          kLowest * std::pow(kHighest / kLowest, (s + within(random)) / kSines);
      sines.push_back({mechanism.sweep / (s + 1.0), 2 * M_PI * f,
                       2 * M_PI * within(random)});
    }
    sines_.push_back(sines);
  }
}

void Reference::At(int i, double t, double* q, double* qd, double* qdd) const {
  *q = middle_[i];
  *qd = *qdd = 0.0;
  for (const Sine& sine : sines_[i]) {
    const double angle = sine.rate * t + sine.phase;
    *q += sine.amplitude * std::sin(angle);
    *qd += sine.amplitude * sine.rate * std::cos(angle);
    *qdd -= sine.amplitude * sine.rate * sine.rate * std::sin(angle);
  }
}

}  // namespace sysid
