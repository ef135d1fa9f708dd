#include "sysid/exports/write_mjcf.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "models/error.h"
#include "models/math/rotation.h"
#include "models/urdf/urdf_xml.h"
#include "sysid/exports/arrival.h"
#include "sysid/exports/xml.h"

namespace sysid {
namespace {

// MuJoCo takes no moving body without a mass and an inertia, and none below
// 1e-15.
constexpr double kLeastMass = 1e-9, kLeastInertia = 1e-12;
constexpr char kHardImpedance[] = "0.9999 0.9999 0.001 0.5 2";

Eigen::VectorXd HardReference() {
  return Eigen::Vector2d(2.0 * kMjcfTimestep, 1.0);  // (E.4)
}

std::string QuaternionText(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return NumbersText(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
}

bool Has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

class MjcfWriter {
 public:
  MjcfWriter(const Model& model, const ExportData& data)
      : model_(model),
        mechanism_(model.mechanism()),
        values_(model),
        data_(data) {}

  ExportText Write(const std::vector<std::string>& comments) {
    ExportText out;
    root_ = AppendElement(&document_, "mujoco");
    SetText(root_, "model", mechanism_.name);
    AppendComments(root_, comments);
    WriteHeader();
    TiXmlElement* world = AppendElement(root_, "worldbody");
    TiXmlElement* base = world;
    if (mechanism_.links[0].name != "world") {  // MuJoCo's name of its own
      base = AppendElement(world, "body");
      SetText(base, "name", mechanism_.links[0].name);
      WriteInertial(0, base);
    }
    for (const int joint : mechanism_.links[0].child_joints) {
      WriteBody(joint, base);
    }
    WriteTendons();
    WriteEqualities();
    WriteActuators();
    WriteSensors();
    if (!why_not_.empty()) {
      out.why_not = why_not_;
      return out;
    }
    out.text = Printed(document_);
    out.notes = notes_;
    return out;
  }

 private:
  double Of(const Joint& joint, const char* parameter) const {
    return values_(joint.name + "." + parameter);
  }

  void WriteHeader() {
    TiXmlElement* compiler = AppendElement(root_, "compiler");
    SetText(compiler, "angle", "radian");
    SetText(compiler, "inertiafromgeom", "false");
    TiXmlElement* option = AppendElement(root_, "option");
    SetNumber(option, "timestep", kMjcfTimestep);
    SetText(option, "integrator", "RK4");
    Eigen::Vector3d gravity(0.0, 0.0, -model_.nominal().gravity);
    const Eigen::Vector3d tilt(values_("gravity_tilt_x"),
                               values_("gravity_tilt_y"), 0.0);
    if (tilt.norm() > 0.0) {
      gravity = Eigen::AngleAxisd(tilt.norm(), tilt.normalized()) * gravity;
    }
    SetNumbers(option, "gravity", gravity);
    SetText(option, "iterations", "100");
    SetText(option, "tolerance", "1e-12");
  }

  // Whether MuJoCo finds a mass and an inertia in what moves as one with the
  // link.
  bool HasInertia(int link) const {
    const Inertial<double>& body = model_.nominal().links[link];
    const Eigen::Vector3d moments =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(body.inertia)
            .eigenvalues();
    if (body.mass >= kLeastMass && moments[0] >= kLeastInertia) return true;
    for (const int child : mechanism_.links[link].child_joints) {
      const Joint& joint = mechanism_.joints[child];
      if (joint.type == JointType::kFixed && HasInertia(joint.child_link)) {
        return true;
      }
    }
    return false;
  }

  void WriteInertial(int link, TiXmlElement* element) {
    const Inertial<double>& body = model_.nominal().links[link];
    const std::string& name = mechanism_.links[link].name;
    const bool moves = model_.placement(link).body >= 0;
    const bool is_first =
        link > 0 && mechanism_.joints[link - 1].type != JointType::kFixed;
    if (body.mass < 0.0) {
      why_not_ = "the mass of " + name + " is negative";
      return;
    }
    Eigen::Vector3d moments = body.inertia.diagonal();
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
    if (!Eigen::Matrix3d(moments.asDiagonal()).isApprox(body.inertia, 0.0)) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(body.inertia);
      moments = eigen.eigenvalues();
      axes = eigen.eigenvectors();
      if (axes.determinant() < 0) axes.col(0) *= -1.0;
    }
    double mass = body.mass;
    if (is_first && !HasInertia(link)) {
      notes_.push_back("body '" + name +
                       "' has no mass or no inertia, which MuJoCo does not "
                       "take of what moves: at least 1e-9 kg and 1e-12 kg m^2 "
                       "are written");
      mass = std::max(mass, kLeastMass);
      moments = moments.cwiseMax(kLeastInertia);
    }
    if (mass == 0.0 && moments.isZero()) return;
    Triangle(name, moves, &moments);
    TiXmlElement* inertial = AppendElement(element, "inertial");
    SetNumber(inertial, "mass", mass);
    SetNumbers(inertial, "pos", body.com);
    if (!axes.isIdentity(0.0)) {
      SetText(inertial, "quat", QuaternionText(axes));
    }
    SetNumbers(inertial, "diaginertia", moments);
  }

  // A flat body's moments may miss A + B >= C by their last digit, which MuJoCo
  // does not forgive.
  void Triangle(const std::string& name, bool moves, Eigen::Vector3d* moments) {
    int largest = 0;
    moments->maxCoeff(&largest);
    const double others = moments->sum() - (*moments)[largest];
    const double excess = (*moments)[largest] - others;
    if (excess <= 0.0 && moments->minCoeff() >= 0.0) return;
    if (moments->minCoeff() >= 0.0 && excess <= 1e-9 * others) {
      (*moments)[largest] = others * (1.0 - 1e-15);
      return;
    }
    if (!moves) {  // its inertia has no influence
      moments->setConstant(moments->cwiseAbs().maxCoeff());
      return;
    }
    why_not_ = "the inertia of " + name +
               " is that of no body (principal moments " +
               NumbersText(*moments) +
               " kg m^2): MuJoCo does not load it. Fit the inertia of the link "
               "as a whole (--free inertial), or with bounds";
  }

  void WriteBody(int index, TiXmlElement* parent) {
    const Joint& joint = mechanism_.joints[index];
    Eigen::Vector3d p = model_.nominal().joint_p[index];
    if (joint.held) {
      p += joint.held->slide;
      notes_.push_back("joint '" + joint.name + "' is held at " +
                       ExactText(joint.held->position) +
                       ": its body is welded to its parent there");
    }
    TiXmlElement* body = AppendElement(parent, "body");
    SetText(body, "name", mechanism_.links[joint.child_link].name);
    SetNumbers(body, "pos", p);
    if (!joint.R_PJ.isIdentity(0.0)) {
      SetText(body, "quat", QuaternionText(joint.R_PJ));
    }
    WriteInertial(joint.child_link, body);
    if (joint.type != JointType::kFixed) WriteJoint(joint, body);
    for (const int child : mechanism_.links[joint.child_link].child_joints) {
      WriteBody(child, body);
    }
  }

  void WriteJoint(const Joint& joint, TiXmlElement* body) {
    TiXmlElement* element = AppendElement(body, "joint");
    SetText(element, "name", joint.name);
    const bool ball = joint.type == JointType::kSpherical;
    SetText(element, "type",
            ball                      ? "ball"
            : IsRotation1(joint.type) ? "hinge"
                                      : "slide");
    const double offset = Of(joint, "sensor_offset");
    if (!ball) {
      SetNumbers(element, "axis", joint.axis);
      if (offset != 0.0) SetNumber(element, "ref", offset);  // (E.1)
    }
    WriteDamping(joint, element);
    const double friction = Of(joint, "friction");
    if (friction > 0.0) {
      SetNumber(element, "frictionloss", friction);
      SetNumbers(element, "solreffriction", HardReference());
      SetText(element, "solimpfriction", kHardImpedance);
    }
    const auto put = [&](const char* attribute, double value) {
      if (value != 0.0) SetNumber(element, attribute, value);
    };
    put("armature", Of(joint, "armature"));
    const double stiffness = Of(joint, "stiffness");
    put("stiffness", stiffness);
    if (stiffness != 0.0 && !ball) {
      SetNumber(element, "springref", Of(joint, "spring_reference") + offset);
    }
    if (joint.has_limits && joint.lower < joint.upper && !ball &&
        joint.type != JointType::kContinuous) {
      const bool beyond = Has(data_.beyond_limits, joint.name);
      SetNumbers(element, "range",
                 Eigen::Vector2d(joint.lower + offset, joint.upper + offset));
      SetText(element, "limited", beyond ? "false" : "true");
      if (beyond) {
        notes_.push_back("joint '" + joint.name +
                         "' was recorded beyond its limits: its range is "
                         "written with limited=\"false\"");
      }
    } else {
      SetText(element, "limited", "false");
    }
  }

  void WriteDamping(const Joint& joint, TiXmlElement* element) {
    const double linear = Of(joint, "damping");
    const double square = Of(joint, "quadratic_drag");
    const double cube = Of(joint, "cubic_damping");
    if (square != 0.0 || cube != 0.0) {
      SetNumbers(element, "damping", Eigen::Vector3d(linear, square, cube));
    } else if (linear != 0.0) {
      SetNumber(element, "damping", linear);
    }
  }

  // The element that all of a kind share.
  TiXmlElement* Section(const char* name) {
    TiXmlElement* section = root_->FirstChildElement(name);
    return section ? section : AppendElement(root_, name);
  }

  // Rotor and friction on z = q_1 + s q_2.
  void WriteTendons() {
    const EffectSet& effects = model_.effects();
    for (int i = 0; i < effects.size(); ++i) {
      const Effect& effect = effects.effect(i);
      if (effect.kind() != "gear_coupling") continue;
      const double* p = &model_.nominal().effects[effects.offset(i)];
      TiXmlElement* fixed = AppendElement(Section("tendon"), "fixed");
      SetText(fixed, "name", effect.target());
      SetNumber(fixed, "armature", p[0]);
      SetNumber(fixed, "damping", p[1]);
      if (p[2] > 0.0) {
        SetNumber(fixed, "frictionloss", p[2]);
        SetNumbers(fixed, "solreffriction", HardReference());
        SetText(fixed, "solimpfriction", kHardImpedance);
      }
      const double coefficients[] = {1.0, p[3]};
      const int joints[] = {effect.joint(), effect.second_joint()};
      for (int k = 0; k < 2; ++k) {
        TiXmlElement* of = AppendElement(fixed, "joint");
        SetText(of, "joint", mechanism_.joints[joints[k]].name);
        SetNumber(of, "coef", coefficients[k]);
      }
    }
  }

  // Joints that follow others, (2.26) of docs/theory.md.
  void WriteEqualities() {
    for (const Joint& joint : mechanism_.joints) {
      if (!joint.mimic || joint.held || joint.type == JointType::kFixed) {
        continue;
      }
      TiXmlElement* equality = AppendElement(Section("equality"), "joint");
      SetText(equality, "name", joint.name + ".mimic");
      SetText(equality, "joint1", joint.name);
      SetText(equality, "joint2", joint.mimic->joint);
      Eigen::VectorXd polynomial = Eigen::VectorXd::Zero(5);
      polynomial[0] = joint.mimic->offset;
      polynomial[1] = joint.mimic->multiplier;
      SetNumbers(equality, "polycoef", polynomial);
      SetNumbers(equality, "solref", HardReference());
      SetText(equality, "solimp", kHardImpedance);
      notes_.push_back("joint '" + joint.name + "' follows '" +
                       joint.mimic->joint +
                       "' by an equality, which is soft in MuJoCo: set its "
                       "qpos where a simulation starts");
    }
  }

  void WriteDelay(double delay, TiXmlElement* element) {
    if (delay <= 0.0) return;
    SetNumber(element, "delay", delay);
    const int samples =
        static_cast<int>(std::ceil(delay / kMjcfTimestep - 1e-9)) + 1;
    SetText(element, "nsample", std::to_string(samples));
  }

  TiXmlElement* Actuator(const std::string& name, const Joint& joint) {
    TiXmlElement* element = AppendElement(Section("actuator"), "general");
    SetText(element, "name", name);
    SetText(element, "joint", joint.name);
    return element;
  }

  void WriteActuators() {
    for (const Joint& joint : mechanism_.joints) {
      if (joint.type == JointType::kFixed) continue;
      WriteDrives(joint);
      if (joint.type != JointType::kSpherical) WritePassive(joint);
    }
  }

  void WriteDrives(const Joint& joint) {
    const std::string name = joint.name + ".";
    double bias = Of(joint, "effort_bias");
    const bool has_drive = values_.Has(name + "kp");
    const bool has_motor = Has(data_.driven, joint.name) ||
                           values_.Has(name + "effort_gain") ||
                           values_.Has(name + "actuator_lag") ||
                           (values_.Has(name + "effort_limit") && !has_drive);
    const double limit =
        values_.Has(name + "effort_limit") ? Of(joint, "effort_limit") : 0.0;
    if (joint.type == JointType::kSpherical) {
      if (has_motor) WriteBallMotors(joint);
      return;
    }
    if (has_drive && has_motor && limit > 0.0) {
      notes_.push_back("joint '" + joint.name +
                       "': effort_limit acts on its two actuators one by one");
    }
    if (has_motor) {
      TiXmlElement* motor = Actuator(name + "tau", joint);
      SetNumber(motor, "gainprm", 1.0 + Of(joint, "effort_gain"));
      const double lag = Of(joint, "actuator_lag");
      if (lag > 0.0) {
        SetText(motor, "dyntype", "filterexact");
        SetNumber(motor, "dynprm", lag);
      }
      if (limit > 0.0) {
        SetNumbers(motor, "forcerange", Eigen::Vector2d(-limit, limit));
      } else if (bias != 0.0) {  // what limits would limit, too
        SetText(motor, "biastype", "affine");
        SetNumbers(motor, "biasprm", Eigen::Vector3d(bias, 0.0, 0.0));
        bias = 0.0;
      }
      WriteDelay(values_("effort_delay"), motor);
    }
    if (has_drive) WritePositionDrive(joint, limit);
    if (bias != 0.0) {
      TiXmlElement* constant = Actuator(name + "effort_bias", joint);
      SetNumber(constant, "gainprm", 0.0);
      SetText(constant, "biastype", "affine");
      SetNumbers(constant, "biasprm", Eigen::Vector3d(bias, 0.0, 0.0));
    }
  }

  void WritePositionDrive(const Joint& joint, double limit) {
    TiXmlElement* drive = Actuator(joint.name + ".cmd", joint);
    const double kp = Of(joint, "kp"), kd = Of(joint, "kd");
    SetNumber(drive, "gainprm", kp);
    SetText(drive, "biastype", "affine");
    SetNumbers(drive, "biasprm",
               Eigen::Vector3d(kp * Of(joint, "sensor_offset"), -kp, -kd));
    if (joint.effort_limit > 0.0 && std::isfinite(joint.effort_limit)) {
      limit = limit > 0.0 ? std::min(limit, joint.effort_limit)
                          : joint.effort_limit;
    }
    if (limit > 0.0) {
      SetNumbers(drive, "forcerange", Eigen::Vector2d(-limit, limit));
    }
    WriteDelay(Of(joint, "drive_delay"), drive);
  }

  void WriteBallMotors(const Joint& joint) {
    const char* const axes[] = {"x", "y", "z"};
    for (int k = 0; k < 3; ++k) {
      TiXmlElement* motor = Actuator(joint.name + ".tau" + axes[k], joint);
      Eigen::VectorXd gear = Eigen::VectorXd::Zero(6);
      gear[k] = 1.0;
      SetNumbers(motor, "gear", gear);
      SetNumber(motor, "gainprm", 1.0 + Of(joint, "effort_gain"));
      WriteDelay(values_("effort_delay"), motor);
    }
  }

  // Laws that MuJoCo has in motors without inputs, of which all else is off.
  void WritePassive(const Joint& joint) {
    const auto motor = [&](const char* name) {
      TiXmlElement* element = AppendElement(Section("actuator"), "dcmotor");
      SetText(element, "name", joint.name + "." + name);
      SetText(element, "joint", joint.name);
      SetText(element, "input", "none");
      SetText(element, "motorconst", "0 0");
      SetText(element, "resistance", "1");
      return element;
    };
    const double a = Of(joint, "cogging_sin"), b = Of(joint, "cogging_cos");
    if (a != 0.0 || b != 0.0) {
      // a sin(n q) + b cos(n q) = A sin(n qpos + phase), by (E.1).
      const double n = std::round(Of(joint, "cogging_order"));
      SetNumbers(
          motor("cogging"), "cogging",
          Eigen::Vector3d(std::hypot(a, b), n,
                          std::atan2(b, a) - n * Of(joint, "sensor_offset")));
    }
    // With the bend l z as LuGre's bristle of the stiffness c / l: -c z,
    // l z' = qd - |qd| z.
    const double c = Of(joint, "presliding_friction");
    const double length = Of(joint, "presliding_length");
    if (c > 0.0 && length > 0.0) {
      Eigen::VectorXd lugre = Eigen::VectorXd::Zero(5);
      lugre << c / length, 0.0, c, c, 1.0;
      SetNumbers(motor("presliding"), "lugre", lugre);
    }
  }

  void WriteSensors() {
    for (const Joint& joint : mechanism_.joints) {
      if (joint.type == JointType::kFixed ||
          joint.type == JointType::kSpherical) {
        continue;
      }
      TiXmlElement* sensor = AppendElement(Section("sensor"), "jointpos");
      SetText(sensor, "name", joint.name + ".q");
      SetText(sensor, "joint", joint.name);
      WriteDelay(Of(joint, "sensor_delay"), sensor);
    }
  }

  const Model& model_;
  const Mechanism& mechanism_;
  const EffectValues values_;
  const ExportData& data_;
  TiXmlDocument document_;
  TiXmlElement* root_ = nullptr;
  std::string why_not_;
  std::vector<std::string> notes_;
};

}  // namespace

ExportText WriteMjcf(const Model& model, const ExportData& data,
                     const std::vector<std::string>& comments) {
  return MjcfWriter(model, data).Write(comments);
}

}  // namespace sysid
