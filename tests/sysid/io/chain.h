#pragma once

#include <string>
#include <utility>
#include <vector>

#include "models/mechanism.h"
#include "sysid/io/read_run.h"
#include "tests/support/error_text.h"

namespace sysid {

// A chain of joints of these types with a link "<joint>_link" behind each, and
// a fixed frame "tip" at its end.
inline Mechanism Chain(
    const std::vector<std::pair<std::string, JointType>>& joints) {
  Mechanism mechanism;
  mechanism.name = "chain";
  int parent = mechanism.AddRoot("world");
  Inertial<double> inertial;
  inertial.mass = 1.0;
  inertial.inertia = Eigen::Matrix3d::Identity() * 0.01;
  const auto add = [&](const std::string& name, JointType type,
                       const std::string& link) {
    Joint joint;
    joint.name = name;
    joint.type = type;
    joint.parent_link = parent;
    const int index = mechanism.AddJoint(joint, link, {0, 0, -0.5}, inertial);
    parent = mechanism.joints[index].child_link;
  };
  for (const auto& [name, type] : joints) add(name, type, name + "_link");
  add("tip_joint", JointType::kFixed, "tip");
  return mechanism;
}

// Two hinges.
inline Mechanism Hinges() {
  return Chain(
      {{"joint1", JointType::kRevolute}, {"joint2", JointType::kContinuous}});
}

inline Mechanism Ball() { return Chain({{"ball", JointType::kSpherical}}); }

// The text of "run.csv", read for them.
inline Run Parse(const std::string& text, const std::string& columns = "",
                 std::vector<std::string>* notices = nullptr,
                 const Mechanism& mechanism = Hinges()) {
  return ParseRun("run.csv", text, ParseColumnMap(columns), mechanism, notices);
}

inline std::string ParseError(const std::string& text,
                              const std::string& columns = "",
                              const Mechanism& mechanism = Hinges()) {
  return ErrorText([&] { Parse(text, columns, nullptr, mechanism); });
}

}  // namespace sysid
