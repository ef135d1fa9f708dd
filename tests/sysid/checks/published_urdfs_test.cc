// URDFs as they are published: four robots in the manner of public collections,
// each with every fault of theirs. Each loads, is said to have the fault in one
// line, moves as an independent mass matrix says, and is written back.

#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <sstream>

#include "models/dynamics.h"
#include "models/physical.h"
#include "models/urdf/load_urdf.h"
#include "models/urdf/write_urdf.h"
#include "sysid/checks/model_findings.h"
#include "tests/support/conditioning.h"
#include "tests/support/dynamics_calls.h"
#include "tests/support/link_poses.h"
#include "tests/support/random_mechanism.h"
#ifdef SYSID_HAVE_MUJOCO
#include "tests/support/mujoco_model.h"
#endif

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::HasSubstr;

// A part of a robot: a link with the joint that carries it.
struct Part {
  std::string name, parent;
  std::string type = "revolute";
  Vector3d origin, axis;
  double mass = 1.0;
  Vector3d com = {0.01, 0.02, 0.1};
  double I[6] = {4e-3, 1e-4, 0, 4e-3, 0, 3e-3};  // ixx ixy ixz iyy iyz izz
  bool inertial = true;
  std::string more;  // in the joint
};

using Robot = std::vector<Part>;

std::string Text(const Robot& robot) {
  std::ostringstream out;
  const auto vector = [](const Vector3d& v) {
    std::ostringstream text;
    text << v[0] << " " << v[1] << " " << v[2];
    return text.str();
  };
  out << "<robot name='published'><material name='grey'/>\n"
         "<link name='base_link'><visual><geometry><mesh filename='base.dae'/>"
         "</geometry></visual></link>\n";
  for (const Part& part : robot) {
    out << "<link name='" << part.name << "'>";
    if (part.inertial) {
      out << "<inertial><origin xyz='" << vector(part.com)
          << "' rpy='0.1 -0.2 0.3'/><mass value='" << part.mass
          << "'/><inertia ixx='" << part.I[0] << "' ixy='" << part.I[1]
          << "' ixz='" << part.I[2] << "' iyy='" << part.I[3] << "' iyz='"
          << part.I[4] << "' izz='" << part.I[5] << "'/></inertial>";
    }
    out << "<visual><geometry><mesh filename='" << part.name
        << ".stl'/></geometry><material name='grey'/></visual></link>\n"
        << "<joint name='" << part.name << "_joint' type='" << part.type
        << "'><origin xyz='" << vector(part.origin)
        << "' rpy='0.2 0 0.1'/><parent link='" << part.parent
        << "'/><child link='" << part.name << "'/><axis xyz='"
        << vector(part.axis) << "'/>" << part.more << "</joint>\n";
  }
  out << "<transmission name='t'><type>SimpleTransmission</type>"
         "</transmission></robot>\n";
  return out.str();
}

Part Make(const std::string& name, const std::string& parent,
          const Vector3d& origin, int axis, double mass,
          const std::string& type = "revolute") {
  Part part;
  part.name = name;
  part.parent = parent;
  part.origin = origin;
  part.axis = Vector3d::Unit(axis);
  part.mass = mass;
  part.type = type;
  for (double& entry : part.I) entry *= mass;
  return part;
}

Robot Arm() {
  return {Make("shoulder", "base_link", {0, 0, 0.3}, 2, 8),
          Make("upper_arm", "shoulder", {0, 0.1, 0}, 1, 6),
          Make("forearm", "upper_arm", {0.4, 0, 0}, 1, 4),
          Make("wrist_1", "forearm", {0.3, 0, 0}, 0, 1.5),
          Make("wrist_2", "wrist_1", {0.1, 0, 0}, 1, 1),
          Make("flange", "wrist_2", {0.05, 0, 0}, 0, 0.4)};
}

Robot Hand() {
  Robot hand{Make("palm", "base_link", {0, 0, 0.1}, 2, 1)};
  for (const std::string finger : {"index", "thumb"}) {
    const double side = finger == "index" ? 0.03 : -0.03;
    hand.push_back(Make(finger + "_1", "palm", {side, 0, 0.1}, 1, 0.1));
    hand.push_back(Make(finger + "_2", finger + "_1", {0, 0, 0.05}, 1, 0.05));
    hand.push_back(Make(finger + "_3", finger + "_2", {0, 0, 0.04}, 1, 0.03));
  }
  return hand;
}

Robot MobileManipulator() {
  return {Make("wheel_left", "base_link", {0, 0.2, 0}, 1, 2, "continuous"),
          Make("wheel_right", "base_link", {0, -0.2, 0}, 1, 2, "continuous"),
          Make("torso", "base_link", {0, 0, 0.3}, 2, 20, "prismatic"),
          Make("head", "torso", {0, 0, 0.5}, 2, 2),
          Make("camera_mount", "head", {0, 0, 0.1}, 1, 0.5, "fixed"),
          Make("elbow", "torso", {0.2, 0, 0.2}, 1, 3),
          Make("hand", "elbow", {0.3, 0, 0}, 0, 1)};
}

Robot Leg() {
  return {Make("pelvis", "base_link", {0, 0, 1}, 2, 10, "fixed"),
          Make("hip_yaw", "pelvis", {0, 0.1, 0}, 2, 2),
          Make("hip_roll", "hip_yaw", {0, 0, -0.1}, 0, 2),
          Make("thigh", "hip_roll", {0, 0, -0.05}, 1, 6),
          Make("shin", "thigh", {0, 0, -0.4}, 1, 3),
          Make("foot", "shin", {0, 0, -0.4}, 1, 1)};
}

void Inertia(const std::vector<double>& I, Part* part) {
  std::copy(I.begin(), I.end(), part->I);
}

struct Fault {
  std::string name;
  std::function<void(Robot*)> make;
  std::vector<std::string> findings;
};

const std::vector<Fault>& Faults() {
  static const auto& faults = *new std::vector<Fault>{
      {"None", [](Robot*) {}, {}},
      {"RoundedMoments",  // of a thin body, to three digits
       [](Robot* r) {
         for (Part& part : *r) Inertia({0.001, 0, 0, 0.003, 0, 0.001}, &part);
       },
       {"inertia_not_physical"}},
      {"MirroredMoments",  // the sign went over to a moment
       [](Robot* r) { r->back().I[3] *= -0.3; },
       {"inertia_not_physical"}},
      {"GuessedMoments",
       [](Robot* r) {
         for (Part& part : *r) Inertia({1, 0, 0, 1, 0, 10}, &part);
       },
       {"inertia_not_physical"}},
      {"ProductsBeyondMoments",
       [](Robot* r) { (*r)[1].I[1] = 1.5 * (*r)[1].I[0]; },
       {"inertia_not_physical"}},
      {"ANegativeMass",
       [](Robot* r) { r->back().mass *= -0.01; },
       {"inertia_not_physical"}},
      {"MomentsWithoutAMass",
       [](Robot* r) { r->back().mass = 0; },
       {"inertia_not_physical"}},
      {"APointMass",  // its moments forgotten, off its axis
       [](Robot* r) {
         Inertia({0, 0, 0, 0, 0, 0}, &r->back());
       },
       {}},
      {"AMassOnItsAxis",
       [](Robot* r) {
         Inertia({0, 0, 0, 0, 0, 0}, &r->back());
         r->back().com = 0.1 * r->back().axis;
       },
       {"no_inertia"}},
      {"AnEmptyTip",
       [](Robot* r) { r->back().inertial = false; },
       {"no_inertia"}},
      {"AnEmptyMiddle",  // what it carries makes it regular
       [](Robot* r) { (*r)[r->size() - 2].inertial = false; },
       {}},
      {"AMimic",
       [](Robot* r) {
         r->back().more = "<mimic joint='" + (*r)[1].name +
                          "_joint' multiplier='-1.5' offset='0.2'/>";
       },
       {}},
      {"LimitsReversed",
       [](Robot* r) {
         r->back().more = "<limit lower='1' upper='-1' effort='9'/>";
       },
       {"limits_reversed"}},
      {"AnAxisOfLengthTwo",
       [](Robot* r) { r->back().axis *= 2.0; },
       {"axis_not_unit"}},
      {"FrictionThatDrives",
       [](Robot* r) {
         r->back().more = "<dynamics damping='-0.1' friction='0'/>";
       },
       {"dynamics_negative"}},
      {"EveryFault",
       [](Robot* r) {
         Inertia({0.001, 0, 0, 0.003, 0, 0.001}, &(*r)[1]);
         (*r)[r->size() - 2].more =
             "<mimic joint='" + (*r)[1].name + "_joint'/>";
         r->back().inertial = false;
       },
       {"inertia_not_physical", "no_inertia"}},
  };
  return faults;
}

// The joint-space inertia, and what gravity does at rest, from the motion of
// each link by itself.
void FromLinks(const Mechanism& mechanism, const VectorXd& q, MatrixXd* M,
               VectorXd* bias) {
  const int nv = mechanism.nv;
  M->setZero(nv, nv);
  bias->setZero(nv);
  const std::vector<Eigen::Isometry3d> X = LinkPoses(mechanism, q);
  for (size_t link = 1; link < mechanism.links.size(); ++link) {
    const Inertial<double>& body = mechanism.nominal.links[link];
    MatrixXd Jv(3, nv), Jw(3, nv);
    for (int k = 0; k < nv; ++k) {
      const LinkRates rates = RatesByDifferences(
          mechanism, q, VectorXd::Unit(nv, k), static_cast<int>(link));
      Jv.col(k) = rates.v_com;
      Jw.col(k) = rates.w;
    }
    const Eigen::Matrix3d R = X[link].linear();
    *M += body.mass * Jv.transpose() * Jv +
          Jw.transpose() * R * body.inertia * R.transpose() * Jw;
    *bias += body.mass * mechanism.nominal.gravity * Jv.row(2).transpose();
  }
}

#ifdef SYSID_HAVE_MUJOCO
bool MujocoTakes(const Mechanism& mechanism) {
  if (!PhysicalFaults(mechanism, mechanism.nominal).empty()) return false;
  if (!Model(mechanism).followers().empty()) return false;
  // It takes negative damping as it stands.
  for (const Joint& joint : mechanism.joints) {
    if (joint.damping < 0) return false;
  }
  return std::all_of(mechanism.nominal.links.begin() + 1,
                     mechanism.nominal.links.end(),
                     [](const Inertial<double>& body) {
                       return body.mass > 0 && CanStart(body.inertia);
                     });
}
#endif

struct Case {
  std::string robot;
  Robot parts;
  Fault fault;
};

std::vector<Case> Cases() {
  std::vector<Case> cases;
  const std::map<std::string, Robot> robots = {
      {"Arm", Arm()},
      {"Hand", Hand()},
      {"Leg", Leg()},
      {"MobileManipulator", MobileManipulator()}};
  for (const auto& [name, robot] : robots) {
    for (const Fault& fault : Faults()) {
      cases.push_back({name, robot, fault});
      fault.make(&cases.back().parts);
    }
  }
  return cases;
}

class PublishedUrdfs : public ::testing::TestWithParam<Case> {
 protected:
  PublishedUrdfs()
      : text_(Text(GetParam().parts)),
        mechanism_(LoadUrdfText(text_, "published.urdf")) {}

  // With rotors where nothing else has inertia.
  Model Regular(std::vector<double>* rotors) const {
    constexpr double kRotor = 0.02;
    Model model(mechanism_);
    rotors->assign(mechanism_.joints.size(), 0.0);
    for (const SingularJoint& singular : SingularJoints(model)) {
      const std::string& name = mechanism_.joints[singular.joint].name;
      model.AddEffect(Catalogue().Make("armature@" + name, mechanism_, "test"));
      model.SetEffectParameter(name + ".armature", kRotor);
      (*rotors)[singular.joint] = kRotor;
    }
    return model;
  }

  const std::string text_;
  const Mechanism mechanism_;
};

TEST_P(PublishedUrdfs, AreSaidToHaveTheirFaultInOneLine) {
  std::vector<std::string> found;
  for (const Finding& finding : ModelFindings(Model(mechanism_), "p.urdf")) {
    found.push_back(finding.fault);
    EXPECT_EQ(finding.severity, Severity::kNote);
    EXPECT_LT(BriefText(finding).size(), 400u) << BriefText(finding);
  }
  EXPECT_EQ(found, GetParam().fault.findings);
}

TEST_P(PublishedUrdfs, MoveAsAnIndependentMassMatrixSays) {
  std::vector<double> rotors;
  const Model model = Regular(&rotors);
  ASSERT_THAT(TextsOf(SingularJoints(model)), ::testing::IsEmpty());
  Workspace<double> ws(model);
  Random random(3);
  for (int trial = 0; trial < 5; ++trial) {
    const RandomState x(mechanism_, &random);
    MatrixXd M;
    VectorXd bias;
    FromLinks(mechanism_, x.q, &M, &bias);
    for (size_t j = 0; j < rotors.size(); ++j) {
      if (rotors[j] == 0) continue;
      const int v = mechanism_.joints[j].v_index;
      M(v, v) += rotors[j];
    }
    EXPECT_LT((Inertia(&ws, x.q) - M).norm(), 1e-8 * M.norm());
    const Eigen::LLT<MatrixXd> llt(M);
    ASSERT_EQ(llt.info(), Eigen::Success) << "not positive definite";
    const VectorXd at_rest = VectorXd::Zero(mechanism_.nv);
    const VectorXd expected = llt.solve(x.tau - bias);
    EXPECT_LT((Forward(&ws, x.q, at_rest, x.tau) - expected).norm(),
              1e-6 * (1.0 + expected.norm()));
    // In motion: what inverse dynamics ask for gives the motion.
    const VectorXd tau = Inverse(&ws, x.q, x.qd, x.qdd);
    EXPECT_LT(
        Conditioning(M, tau, tau).Units(Forward(&ws, x.q, x.qd, tau), x.qdd),
        100 * Conditioning::kTolerance);
#ifdef SYSID_HAVE_MUJOCO
    if (!MujocoTakes(mechanism_)) continue;
    MujocoModel mujoco(mechanism_, rotors);
    mujoco.Forward(x.q, x.qd, x.tau);
    EXPECT_LT((Forward(&ws, x.q, x.qd, x.tau) - mujoco.Acceleration()).norm(),
              1e-6 * (1.0 + mujoco.Acceleration().norm()));
#endif
  }
}

TEST_P(PublishedUrdfs, AreWrittenBackWithAllThatTheyHave) {
  const std::string text = WriteUrdf(Model(mechanism_));
  for (const char* kept : {"base.dae", "<material name=\"grey\"",
                           "<type>SimpleTransmission</type>"}) {
    EXPECT_THAT(text, HasSubstr(kept));
  }
  for (const Part& part : GetParam().parts) {
    EXPECT_THAT(text, HasSubstr("filename=\"" + part.name + ".stl\""));
    EXPECT_THAT(text, HasSubstr("type=\"" + part.type + "\""));
  }
  const Mechanism back = LoadUrdfText(text, "written.urdf");
  ASSERT_EQ(back.LinkNames(), mechanism_.LinkNames());
  EXPECT_EQ(back.JointNames(), mechanism_.JointNames());
  for (size_t i = 0; i < back.links.size(); ++i) {
    EXPECT_EQ(back.nominal.links[i].mass, mechanism_.nominal.links[i].mass);
    EXPECT_EQ(back.nominal.links[i].com, mechanism_.nominal.links[i].com);
    EXPECT_EQ(back.nominal.links[i].inertia,
              mechanism_.nominal.links[i].inertia);
  }
}

INSTANTIATE_TEST_SUITE_P(Collections, PublishedUrdfs,
                         ::testing::ValuesIn(Cases()), [](const auto& info) {
                           return info.param.robot + info.param.fault.name;
                         });

}  // namespace
}  // namespace sysid
