#include "models/urdf/write_urdf.h"

#include <charconv>
#include <cmath>

namespace sysid {
namespace {

// The shortest text that reads back as the same number.
std::string Exact(double value) {
  char text[32];
  const auto result =
      std::to_chars(text, text + sizeof(text), value == 0 ? 0.0 : value);
  return std::string(text, result.ptr);
}

std::string Exact3(const Eigen::Vector3d& v) {
  return Exact(v[0]) + " " + Exact(v[1]) + " " + Exact(v[2]);
}

std::string Attribute(const std::string& name, const std::string& value) {
  std::string text = " " + name + "=\"";
  for (char c : value) {
    switch (c) {
      case '&':
        text += "&amp;";
        break;
      case '<':
        text += "&lt;";
        break;
      case '>':
        text += "&gt;";
        break;
      case '"':
        text += "&quot;";
        break;
      default:
        text += c;
    }
  }
  return text + "\"";
}

std::string Attribute(const std::string& name, double value) {
  return Attribute(name, Exact(value));
}

// XML allows no "--" in a comment, nor a '-' at its end.
std::string Comment(const std::string& text) {
  std::string safe;
  for (char c : text) {
    if (c == '-' && !safe.empty() && safe.back() == '-') safe += ' ';
    safe += c;
  }
  return "  <!-- " + safe + " -->\n";
}

// R = Rz(yaw) Ry(pitch) Rx(roll). Roll is taken after yaw is undone, so that
// the two agree where pitch is a quarter turn and only their sum shows.
Eigen::Vector3d RollPitchYaw(const Eigen::Matrix3d& R) {
  const double yaw = std::atan2(R(1, 0), R(0, 0));
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  const double s = std::sin(yaw), c = std::cos(yaw);
  const double roll =
      std::atan2(s * R(0, 2) - c * R(1, 2), c * R(1, 1) - s * R(0, 1));
  return {roll, pitch, yaw};
}

// Nominal value of a parameter of an effect, 0 where the model lacks it.
double EffectValue(const Model& model, const std::string& parameter) {
  const std::vector<EffectParameter>& parameters = model.effects().parameters();
  for (size_t i = 0; i < parameters.size(); ++i) {
    if (parameters[i].name == parameter) return model.nominal().effects[i];
  }
  return 0;
}

bool IsDynamics(const Effect& effect) {
  return effect.kind() == "viscous_damping" ||
         effect.kind() == "coulomb_friction";
}

// What <dynamics> cannot say.
std::string EffectComments(const Model& model) {
  std::string text;
  if (model.nominal().gravity != 9.81) {
    text +=
        Comment("sysid: gravity=" + Exact(model.nominal().gravity) + " m/s^2");
  }
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    if (IsDynamics(effect)) continue;
    for (size_t k = 0; k < effect.parameters().size(); ++k) {
      const double value =
          model.nominal().effects[model.effects().offset(i) + k];
      text += Comment("sysid: " + effect.name() + " " +
                      effect.parameters()[k].name + "=" + Exact(value) + " " +
                      effect.parameters()[k].unit);
    }
  }
  return text;
}

std::string DynamicsText(const Model& model, const Joint& joint) {
  double damping = 0, friction = 0;
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    if (effect.target() != joint.name) continue;
    if (effect.kind() == "viscous_damping") {
      damping = EffectValue(model, joint.name + ".damping");
    } else if (effect.kind() == "coulomb_friction") {
      friction = EffectValue(model, joint.name + ".friction");
    }
  }
  if (damping == 0 && friction == 0) return "";
  return "    <dynamics" + Attribute("damping", damping) +
         Attribute("friction", friction) + "/>\n";
}

std::string LimitText(const Joint& joint) {
  if (!joint.has_limits) return "";
  std::string text = "    <limit" + Attribute("lower", joint.lower) +
                     Attribute("upper", joint.upper);
  if (std::isfinite(joint.effort_limit)) {
    text += Attribute("effort", joint.effort_limit);
  }
  if (std::isfinite(joint.velocity_limit)) {
    text += Attribute("velocity", joint.velocity_limit);
  }
  return text + "/>\n";
}

std::string JointText(const Model& model, int index) {
  const Mechanism& mechanism = model.mechanism();
  const Joint& joint = mechanism.joints[index];
  std::string text = "\n  <joint" + Attribute("name", joint.name) +
                     Attribute("type", ToString(joint.type)) + ">\n";
  text += "    <origin" +
          Attribute("xyz", Exact3(model.nominal().joint_p[index])) +
          Attribute("rpy", Exact3(RollPitchYaw(joint.R_PJ))) + "/>\n";
  text += "    <parent" +
          Attribute("link", mechanism.links[joint.parent_link].name) + "/>\n";
  text += "    <child" +
          Attribute("link", mechanism.links[joint.child_link].name) + "/>\n";
  if (VelocitySize(joint.type) == 1) {
    text += "    <axis" + Attribute("xyz", Exact3(joint.axis)) + "/>\n";
  }
  return text + LimitText(joint) + DynamicsText(model, joint) + "  </joint>\n";
}

std::string LinkText(const Model& model, int index) {
  const std::string open =
      "  <link" + Attribute("name", model.mechanism().links[index].name);
  const Inertial<double>& body = model.nominal().links[index];
  const Eigen::Matrix3d& I = body.inertia;
  if (body.mass == 0 && I.isZero(0) && body.com.isZero(0)) {
    return open + "/>\n";
  }
  return open + ">\n    <inertial>\n      <origin" +
         Attribute("xyz", Exact3(body.com)) + " rpy=\"0 0 0\"/>\n      <mass" +
         Attribute("value", body.mass) + "/>\n      <inertia" +
         Attribute("ixx", I(0, 0)) + Attribute("ixy", I(0, 1)) +
         Attribute("ixz", I(0, 2)) + Attribute("iyy", I(1, 1)) +
         Attribute("iyz", I(1, 2)) + Attribute("izz", I(2, 2)) +
         "/>\n    </inertial>\n  </link>\n";
}

}  // namespace

std::string WriteUrdf(const Model& model,
                      const std::vector<std::string>& comments) {
  const Mechanism& mechanism = model.mechanism();
  std::string text = "<?xml version=\"1.0\"?>\n<robot" +
                     Attribute("name", mechanism.name) + ">\n";
  for (const std::string& comment : comments) text += Comment(comment);
  text += EffectComments(model);
  text += LinkText(model, 0);
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    text += JointText(model, static_cast<int>(i));
    text += LinkText(model, mechanism.joints[i].child_link);
  }
  return text + "</robot>\n";
}

}  // namespace sysid
