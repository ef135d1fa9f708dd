#include "tests/acceptance/hidden/hidden_case.h"

#include <cstdio>

#include "glog/logging.h"

namespace sysid {
namespace {

struct Sites {
  std::string mechanism;
  std::vector<std::string> singles;
  std::vector<std::vector<std::string>> pairs;
};

// Left out is what no data of the mechanism can show: what its free parameters
// or its symmetries undo (an offset of a slider, the mass of a single pendulum,
// the inertia of a pole whose mass and length are free beside the cart's mass).
std::vector<Sites> AllSites() {
  return {
      {"pendulum2_planar",
       {"viscous_damping@joint1",
        "viscous_damping@joint2",
        "coulomb_friction@joint1",
        "coulomb_friction@joint2",
        "stribeck_friction@joint1",
        "quadratic_drag@joint2",
        "spring@joint1",
        "spring@joint2",
        "armature@joint1",
        "armature@joint2",
        "effort_bias@joint1",
        "effort_bias@joint2",
        "cogging@joint1",
        "gravity_tilt@base",
        "sensor_offset@joint1",
        "sensor_offset@joint2",
        "aerodynamic_drag@link2",
        "mass@link2",
        "com@link2",
        "inertia@link2"},
       {{"viscous_damping@joint1", "coulomb_friction@joint2"},
        {"spring@joint2", "viscous_damping@joint1"},
        {"effort_bias@joint1", "armature@joint2"},
        {"gravity_tilt@base", "coulomb_friction@joint1"}}},
      {"pendulum3_planar",
       {"viscous_damping@joint3", "coulomb_friction@joint2",
        "quadratic_drag@joint1", "spring@joint3", "armature@joint2",
        "effort_bias@joint3", "aerodynamic_drag@link3", "mass@link3",
        "sensor_offset@joint2"},
       {{"viscous_damping@joint1", "spring@joint3"},
        {"coulomb_friction@joint2", "effort_bias@joint1"}}},
      {"pendulum1",
       {"viscous_damping@joint1", "quadratic_drag@joint1", "spring@joint1",
        "gravity_tilt@base", "aerodynamic_drag@link1", "com@link1"},
       {{"viscous_damping@joint1", "gravity_tilt@base"}}},
      {"pendulum2",
       {"viscous_damping@joint1", "viscous_damping@joint2", "spring@joint2",
        "gravity_tilt@base", "aerodynamic_drag@link2", "armature@joint1",
        "mass@link2"},
       {{"viscous_damping@joint2", "gravity_tilt@base"},
        {"spring@joint2", "aerodynamic_drag@link1"}}},
      {"pendulum2_balls",
       {"coulomb_friction@joint1", "coulomb_friction@joint2",
        "quadratic_drag@joint2", "inertia@link2"},
       {{"coulomb_friction@joint1", "spring@joint2"}}},
      {"cartpole",
       {"viscous_damping@slider", "viscous_damping@hinge",
        "coulomb_friction@slider", "coulomb_friction@hinge",
        "stribeck_friction@slider", "quadratic_drag@slider", "spring@slider",
        "effort_bias@slider", "effort_gain@slider", "effort_gain@hinge",
        "effort_delay@base", "cogging@hinge", "gravity_tilt@base",
        "sensor_offset@hinge", "aerodynamic_drag@pole", "com@pole"},
       {{"coulomb_friction@slider", "viscous_damping@hinge"},
        {"effort_delay@base", "coulomb_friction@slider"},
        {"gravity_tilt@base", "effort_gain@hinge"}}},
      {"rail",
       {"viscous_damping@slider", "coulomb_friction@slider",
        "coulomb_friction@hinge", "effort_bias@slider", "effort_delay@base",
        "sensor_offset@hinge"},
       {{"coulomb_friction@slider", "viscous_damping@hinge"}}},
      {"arm3",
       {"viscous_damping@yaw",
        "viscous_damping@elbow",
        "coulomb_friction@shoulder",
        "coulomb_friction@yaw",
        "stribeck_friction@elbow",
        "quadratic_drag@shoulder",
        "spring@elbow",
        "armature@yaw",
        "armature@elbow",
        "effort_bias@shoulder",
        "effort_gain@shoulder",
        "effort_gain@elbow",
        "effort_delay@base",
        "cogging@elbow",
        "gravity_tilt@base",
        "sensor_offset@shoulder",
        "aerodynamic_drag@fore",
        "mass@fore",
        "com@fore",
        "inertia@upper"},
       {{"coulomb_friction@yaw", "armature@elbow"},
        {"effort_gain@shoulder", "viscous_damping@elbow"},
        {"effort_delay@base", "coulomb_friction@elbow"},
        {"sensor_offset@shoulder", "viscous_damping@yaw"}}},
      {"arm7",
       {"viscous_damping@joint4", "coulomb_friction@joint2",
        "coulomb_friction@joint6", "armature@joint4", "effort_bias@joint4",
        "effort_gain@joint2", "effort_delay@base", "gravity_tilt@base",
        "sensor_offset@joint4", "com@link5"},
       {{"coulomb_friction@joint2", "effort_bias@joint4"}}},
      // Of drives and their sensors; behind the others, since noise and
      // strength go by the turn.
      {"pendulum2_planar",
       {"cubic_damping@joint2", "asymmetric_friction@joint1"},
       {{"cubic_damping@joint2", "coulomb_friction@joint1"}}},
      {"cartpole",
       {"load_friction@slider", "actuator_lag@slider", "effort_limit@slider",
        "asymmetric_friction@slider"},
       {{"actuator_lag@slider", "coulomb_friction@slider"}}},
      {"arm3",
       {"load_friction@shoulder", "actuator_lag@elbow", "effort_limit@shoulder",
        "transmission_error@elbow", "sensor_gain@elbow", "sensor_delay@elbow",
        "gear_coupling@shoulder,elbow"},
       {{"load_friction@shoulder", "coulomb_friction@yaw"},
        {"transmission_error@elbow", "viscous_damping@shoulder"},
        {"gear_coupling@shoulder,elbow", "coulomb_friction@yaw"}}},
      // With states of their own.
      {"cartpole", {"presliding_friction@slider"}, {}},
      {"arm3",
       {"presliding_friction@elbow", "joint_elasticity@elbow",
        "joint_elasticity@shoulder", "backlash@elbow", "backlash@shoulder"},
       {}},
      // A chain of three balls, which a tenth of a second shows little of.
      {"pendulum3",
       {"viscous_damping@joint1", "viscous_damping@joint3",
        "coulomb_friction@joint2", "quadratic_drag@joint1", "spring@joint2",
        "gravity_tilt@base", "aerodynamic_drag@link3", "armature@joint1"},
       {{"viscous_damping@joint1", "spring@joint3"},
        {"spring@joint2", "aerodynamic_drag@link1"}}},
  };
}

// Whether MuJoCo has no such law.
bool IsOfOurEngineAlone(const std::vector<std::string>& planted) {
  for (const char* kind :
       {"presliding_friction@", "joint_elasticity@", "backlash@"}) {
    for (const std::string& effect : planted) {
      if (effect.starts_with(kind)) return true;
    }
  }
  return false;
}

std::string Joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "" : "+") + name;
  }
  return text.empty() ? "complete" : text;
}

bool HasBallJoint(const std::string& mechanism) {
  return mechanism == "pendulum1" || mechanism == "pendulum2" ||
         mechanism == "pendulum3" || mechanism == "pendulum2_balls";
}

// Number `turn` of the cases of one experiment.
HiddenCase MakeCase(const std::string& mechanism, const std::string& engine,
                    const std::vector<std::string>& planted, int turn,
                    std::uint64_t seed) {
  constexpr double kNoise[] = {1e-3, 3e-4, 3e-3};
  constexpr double kStrength[] = {30.0, 10.0};
  HiddenCase c;
  c.mechanism = mechanism;
  c.engine = engine;
  c.planted = planted;
  c.noise = kNoise[turn % 3];
  c.strength = planted.empty() ? 0.0 : kStrength[(turn / 3 + turn) % 2];
  c.seed = seed;
  for (const std::string& effect : planted) {
    if (engine == "mujoco" && !HasBallJoint(mechanism) &&
        effect.starts_with("coulomb_friction@")) {
      c.friction_time = 0.002;
    }
  }
  char noise[16];
  std::snprintf(noise, sizeof(noise), "%.0e", c.noise);
  c.name = mechanism + "/" + Joined(planted) + "/" + engine + "/" + noise +
           "/" + std::to_string(seed);
  return c;
}

}  // namespace

std::vector<HiddenCase> HiddenCases(int seeds) {
  std::vector<HiddenCase> cases;
  int turn = 0;
  for (const Sites& sites : AllSites()) {
    std::vector<std::vector<std::string>> experiments;
    for (const std::string& single : sites.singles) {
      experiments.push_back({single});
    }
    experiments.insert(experiments.end(), sites.pairs.begin(),
                       sites.pairs.end());
    for (const std::vector<std::string>& planted : experiments) {
      for (int seed = 1; seed <= seeds; ++seed) {
        for (const char* engine : {"sysid", "mujoco"}) {
          if (std::string(engine) == "mujoco" && IsOfOurEngineAlone(planted)) {
            continue;
          }
          cases.push_back(
              MakeCase(sites.mechanism, engine, planted, turn++, seed));
        }
      }
    }
  }
  return cases;
}

std::vector<HiddenCase> CompleteCases(int seeds) {
  std::vector<HiddenCase> cases;
  for (int seed = 1; seed <= seeds; ++seed) {
    for (const std::string& mechanism : TestMechanismNames()) {
      cases.push_back(MakeCase(mechanism, "sysid", {}, seed, seed));
      cases.push_back(MakeCase(mechanism, "mujoco", {}, seed + 1, seed));
    }
  }
  return cases;
}

}  // namespace sysid
