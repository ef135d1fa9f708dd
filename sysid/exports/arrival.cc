#include "sysid/exports/arrival.h"

#include <algorithm>
#include <iterator>

#include "models/parameters.h"

namespace sysid {
namespace {

constexpr Arrival kArrived = Arrival::kArrived;
constexpr Arrival kPartly = Arrival::kPartly;
constexpr Arrival kLost = Arrival::kLost;

constexpr char kSoft[] =
    "a joint that rests creeps in MuJoCo: solreffriction and solimpfriction "
    "are written as hard as two time steps allow; at MuJoCo's own settings "
    "(solreffriction 0.02 1) friction turns some 10 ms before the velocity";

// MJCF of MuJoCo 4.0 (doc/XMLreference). Higher coefficients of `damping` came
// with 3.7, delays with 3.5, passive dcmotors with 4.0.
constexpr ArrivalRule kMjcf[] = {
    {"viscous_damping", "", kArrived, "joint '{J}' damping", ""},
    {"coulomb_friction", "", kArrived, "joint '{J}' frictionloss", kSoft},
    {"stribeck_friction", ".friction", kArrived, "joint '{J}' frictionloss",
     kSoft},
    {"stribeck_friction", "", kLost, "",
     "frictionloss has one level: joints do not stick more than they slide"},
    {"asymmetric_friction", ".friction", kArrived, "joint '{J}' frictionloss",
     kSoft},
    {"asymmetric_friction", ".damping", kArrived, "joint '{J}' damping", ""},
    {"asymmetric_friction", "", kLost, "",
     "friction and damping are the same in both directions"},
    {"thermal_friction", ".friction", kPartly, "joint '{J}' frictionloss",
     "that of 20 deg C"},
    {"thermal_friction", ".damping", kPartly, "joint '{J}' damping",
     "that of 20 deg C"},
    {"thermal_friction", "", kLost, "", "there are no temperatures"},
    {"quadratic_drag", "", kArrived, "joint '{J}' damping, second number",
     "needs MuJoCo 3.7"},
    {"cubic_damping", "", kArrived, "joint '{J}' damping, third number",
     "needs MuJoCo 3.7"},
    {"presliding_friction", "", kArrived,
     "actuator '{J}.presliding', a dcmotor without inputs, lugre",
     "needs MuJoCo 4.0"},
    {"cogging", "", kArrived,
     "actuator '{J}.cogging', a dcmotor without inputs, cogging",
     "needs MuJoCo 4.0"},
    {"spring", ".spring_reference", kArrived, "joint '{J}' springref", ""},
    {"spring", "", kArrived, "joint '{J}' stiffness", ""},
    {"armature", "", kArrived, "joint '{J}' armature", ""},
    {"effort_bias", "", kArrived, "biasprm of an actuator of joint '{J}'", ""},
    {"effort_gain", "", kArrived, "actuator '{J}.tau' gainprm, 1 + g",
     "for efforts by ctrl; qfrc_applied passes it by"},
    {"effort_delay", "", kArrived, "actuators delay",
     "needs MuJoCo 3.5; for efforts by ctrl. With RK4 the last stage of a step "
     "reads the next sample"},
    {"actuator_lag", "", kArrived,
     "actuator '{J}.tau' dyntype filterexact, dynprm",
     "for efforts by ctrl; the activation starts at zero"},
    {"effort_limit", ".effort_limit", kArrived, "actuator forcerange",
     "for efforts by ctrl"},
    {"effort_limit", "", kLost, "",
     "forcerange does not fall with speed: the line of the motor is lost"},
    {"position_drive", ".kp", kArrived,
     "actuator '{J}.cmd' gainprm and biasprm, second number", ""},
    {"position_drive", ".kd", kArrived, "actuator '{J}.cmd' biasprm, third",
     ""},
    {"position_drive", "", kArrived, "actuator '{J}.cmd' delay",
     "needs MuJoCo 3.5, where it is not zero"},
    {"gear_coupling", ".coupling_armature", kArrived,
     "fixed tendon '{J}' armature", "needs MuJoCo 3.2.7"},
    {"gear_coupling", ".coupling_damping", kArrived,
     "fixed tendon '{J}' damping", ""},
    {"gear_coupling", ".coupling_friction", kArrived,
     "fixed tendon '{J}' frictionloss", kSoft},
    {"gear_coupling", "", kArrived, "fixed tendon '{J}', coef", ""},
    {"gravity_tilt", "", kArrived, "option gravity", ""},
    {"sensor_offset", "", kArrived, "joint '{J}' ref",
     "qpos is what the sensor measures; springref, range and drives are moved "
     "with it"},
    {"sensor_delay", "", kArrived, "sensor '{J}.q' delay",
     "needs MuJoCo 3.5; qpos is not delayed"},
    {"sensor_gain", "", kLost, "",
     "sensors have no gain: multiply the position by 1 + g"},
    {"transmission_error", "", kLost, "", "sensors have no ripple"},
    {"aerodynamic_drag", "", kLost, "",
     "MuJoCo's fluid acts by the shape of a body, with another law"},
    {"base_motion", "", kLost, "", "the base stands still"},
    {"load_friction", "", kLost, "", "frictionloss does not follow the load"},
    {"load_stribeck_friction", "", kLost, "",
     "frictionloss does not follow the load"},
    {"gear_efficiency", "", kLost, "", "frictionloss does not follow the load"},
    {"joint_elasticity", "", kLost, "",
     "a motor behind a spring is a body of its own, which is not written"},
    {"backlash", "", kLost, "",
     "a motor behind a spring is a body of its own, which is not written"},
    {"force_table", "", kLost, "",
     "no force follows a table: J.force_table.csv has it for a callback"},
    {"custom", "", kLost, "", "no formulas: a callback (mjcb_passive) can"},
    {"mass", "", kArrived, "body '{J}' inertial", ""},
    {"com", "", kArrived, "body '{J}' inertial", ""},
    {"inertia", "", kArrived, "body '{J}' inertial", ""},
};

constexpr char kNotIn[] = "the format has no such law";
constexpr char kSensor[] = "a description of sensors is the simulator's own";
constexpr char kDrive[] = "a description of drives is the simulator's own";

// SDFormat 1.9 and Drake's extensions.
constexpr ArrivalRule kSdf[] = {
    {"viscous_damping", "", kArrived, "joint '{J}' dynamics damping", ""},
    {"coulomb_friction", "", kArrived, "joint '{J}' dynamics friction",
     "Gazebo (DART, ODE) has it; Drake has no friction of joints"},
    {"stribeck_friction", ".friction", kArrived,
     "joint '{J}' dynamics friction", "Drake has no friction of joints"},
    {"asymmetric_friction", ".friction", kArrived,
     "joint '{J}' dynamics friction", "Drake has no friction of joints"},
    {"asymmetric_friction", ".damping", kArrived,
     "joint '{J}' dynamics damping", ""},
    {"thermal_friction", ".friction", kPartly, "joint '{J}' dynamics friction",
     "that of 20 deg C; Drake has no friction of joints"},
    {"thermal_friction", ".damping", kPartly, "joint '{J}' dynamics damping",
     "that of 20 deg C"},
    {"spring", ".spring_reference", kArrived,
     "joint '{J}' dynamics spring_reference", ""},
    {"spring", "", kArrived, "joint '{J}' dynamics spring_stiffness", ""},
    {"armature", "", kArrived, "joint '{J}' drake:rotor_inertia",
     "Drake's; Gazebo passes it by"},
    {"effort_limit", ".effort_limit", kArrived, "joint '{J}' limit effort", ""},
    {"mass", "", kArrived, "link '{J}' inertial", ""},
    {"com", "", kArrived, "link '{J}' inertial", ""},
    {"inertia", "", kArrived, "link '{J}' inertial", ""},
    {"gravity_tilt", "", kLost, "", "gravity is the world's, not the model's"},
    {"sensor_offset", "", kLost, "", kSensor},
    {"sensor_gain", "", kLost, "", kSensor},
    {"sensor_delay", "", kLost, "", kSensor},
    {"transmission_error", "", kLost, "", kSensor},
    {"effort_gain", "", kLost, "", kDrive},
    {"effort_delay", "", kLost, "", kDrive},
    {"actuator_lag", "", kLost, "", kDrive},
    {"position_drive", "", kLost, "", kDrive},
};

constexpr char kBeside[] =
    "URDF has no such element: it is in the comments, and "
    "identified.sysid.yaml has it for sysid";

constexpr ArrivalRule kUrdf[] = {
    {"viscous_damping", "", kArrived, "joint '{J}' dynamics damping", ""},
    {"coulomb_friction", "", kArrived, "joint '{J}' dynamics friction",
     "Drake passes it by"},
    {"armature", "", kArrived, "transmission of '{J}' drake:rotor_inertia",
     "Drake's; others pass it by"},
    {"mass", "", kArrived, "link '{J}' inertial", ""},
    {"com", "", kArrived, "link '{J}' inertial", ""},
    {"inertia", "", kArrived, "link '{J}' inertial", ""},
};

template <size_t N>
const ArrivalRule* FindIn(const ArrivalRule (&rules)[N],
                          const std::string& kind,
                          const std::string& parameter) {
  for (const ArrivalRule& rule : rules) {
    const std::string suffix = rule.suffix;
    if (kind == rule.kind && parameter.ends_with(suffix)) return &rule;
  }
  return nullptr;
}

std::string Filled(std::string text, const std::string& target) {
  for (size_t at = text.find("{J}"); at != std::string::npos;
       at = text.find("{J}")) {
    text.replace(at, 3, target);
  }
  return text;
}

// What a format without friction of balls makes of a ball's law.
void JudgeBall(ExportFormat format, const std::string& kind, ArrivalRow* row) {
  if (format == ExportFormat::kMjcf) {
    if (kind == "coulomb_friction" || kind == "stribeck_friction") {
      if (row->arrival == Arrival::kArrived) row->arrival = Arrival::kPartly;
      row->remark =
          "on each of the ball's axes alone, not along its velocity; " +
          row->remark;
    }
    if (kind == "quadratic_drag" || kind == "cubic_damping") {
      if (row->arrival == Arrival::kArrived) row->arrival = Arrival::kPartly;
      row->remark = "on each of the ball's axes alone; " + row->remark;
    }
    return;
  }
  const bool drake_damps =
      format == ExportFormat::kSdf && kind == "viscous_damping";
  if (format == ExportFormat::kUrdf || row->arrival == Arrival::kLost) return;
  row->arrival = Arrival::kLost;
  row->where = "";
  row->remark = drake_damps ? "SDF has no <dynamics> of ball joints"
                            : "SDF has no such number of ball joints";
}

// A parameter of the mechanism itself.
ArrivalRow MechanismRow(const Model& model, ExportFormat format,
                        const Parameter& p) {
  ArrivalRow row;
  row.name = p.name;
  row.unit = p.unit;
  row.value = p.nominal;
  row.arrival = Arrival::kArrived;
  const std::string body = format == ExportFormat::kMjcf ? "body '" : "link '";
  const auto& mechanism = model.mechanism();
  switch (p.kind) {
    case ParameterKind::kMass:
    case ParameterKind::kCom:
    case ParameterKind::kInertia:
    case ParameterKind::kInertiaScale:
      row.where = body + mechanism.links[p.index].name + "' inertial";
      break;
    case ParameterKind::kLength:
      row.where = "origins of the joints on " + body +
                  mechanism.links[p.index].name + "' and its inertial";
      break;
    case ParameterKind::kJointOrigin:
      row.where = "origin of joint '" + mechanism.joints[p.index].name + "'";
      break;
    case ParameterKind::kGravity:
      if (format == ExportFormat::kMjcf) {
        row.where = "option gravity";
      } else {
        row.arrival = Arrival::kLost;
        row.remark = "gravity is the world's, not the model's";
      }
      break;
    case ParameterKind::kEffect:
      break;
  }
  return row;
}

}  // namespace

std::string ToString(ExportFormat format) {
  switch (format) {
    case ExportFormat::kUrdf:
      return "URDF";
    case ExportFormat::kMjcf:
      return "MJCF";
    default:
      return "SDF";
  }
}

const ArrivalRule* FindArrivalRule(ExportFormat format, const std::string& kind,
                                   const std::string& parameter) {
  switch (format) {
    case ExportFormat::kUrdf:
      return FindIn(kUrdf, kind, parameter);
    case ExportFormat::kMjcf:
      return FindIn(kMjcf, kind, parameter);
    default:
      return FindIn(kSdf, kind, parameter);
  }
}

std::vector<ArrivalRow> ArrivalRows(const Model& model, ExportFormat format,
                                    const std::vector<std::string>& fitted) {
  std::vector<ArrivalRow> rows;
  const EffectSet& effects = model.effects();
  for (int i = 0; i < effects.size(); ++i) {
    const Effect& effect = effects.effect(i);
    const bool ball =
        effect.joint() >= 0 &&
        model.mechanism().joints[effect.joint()].type == JointType::kSpherical;
    for (size_t k = 0; k < effect.parameters().size(); ++k) {
      const EffectParameter& parameter = effect.parameters()[k];
      ArrivalRow row;
      row.name = parameter.name;
      row.unit = parameter.unit;
      row.effect = effect.name();
      row.value = model.nominal().effects[effects.offset(i) + k];
      const ArrivalRule* rule =
          FindArrivalRule(format, effect.kind(), parameter.name);
      if (rule != nullptr && !effect.on_motor()) {
        row.arrival = rule->arrival;
        row.where = Filled(rule->where, effect.target());
        row.remark = Filled(rule->remark, effect.target());
      } else {
        row.remark = format == ExportFormat::kUrdf ? kBeside : kNotIn;
      }
      if (ball) JudgeBall(format, effect.kind(), &row);
      rows.push_back(std::move(row));
    }
  }
  for (const Parameter& p : AllParameters(model)) {
    if (p.kind == ParameterKind::kEffect ||
        std::find(fitted.begin(), fitted.end(), p.name) == fitted.end()) {
      continue;
    }
    rows.push_back(MechanismRow(model, format, p));
  }
  return rows;
}

}  // namespace sysid
