#include "models/parameters.h"

#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <functional>
#include <map>

#include "tests/models/skew_model.h"
#include "tests/support/error_text.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::ElementsAre;
using ::testing::UnorderedElementsAreArray;

using Values = MechanismParameters<double>;

// The values of `model` with one parameter set.
Values With(const Model& model, const std::string& name, double value) {
  Model changed = model;
  SetParameters(FindParameters(model, {name}, "test"), {value}, &changed);
  return changed.nominal();
}

TEST(AllParameters, AreThoseOfTheContract) {
  const Model model = SkewModel();
  std::vector<std::string> expected = {"gravity", "hinge.damping",
                                       "slide.friction", "hinge.effort_bias"};
  for (const std::string link :
       {"stand", "car", "upper", "lower", "rim", "payload", "tip"}) {
    // A massless frame without children has no length.
    if (link != "tip") expected.push_back(link + ".length");
    for (const char* value : {"mass", "com_x", "com_y", "com_z", "ixx", "iyy",
                              "izz", "ixy", "ixz", "iyz", "inertia_scale"}) {
      expected.push_back(link + "." + value);
    }
  }
  for (const std::string joint :
       {"bolt", "slide", "ball", "hinge", "wheel", "mount", "end"}) {
    for (const char* axis : {"x", "y", "z"}) {
      expected.push_back(joint + "." + axis);
    }
  }
  std::vector<std::string> names;
  for (const Parameter& parameter : AllParameters(model)) {
    names.push_back(parameter.name);
    EXPECT_GT(parameter.typical_scale, 0.0) << parameter.name;
    EXPECT_LE(parameter.lower, parameter.nominal) << parameter.name;
    EXPECT_GE(parameter.upper, parameter.nominal) << parameter.name;
  }
  EXPECT_THAT(names, UnorderedElementsAreArray(expected));
}

TEST(AllParameters, SayTheirUnits) {
  std::map<std::string, std::string> units;
  for (const Parameter& parameter : AllParameters(SkewModel())) {
    units[parameter.name] = parameter.unit;
  }
  EXPECT_EQ(units["car.length"], "m");
  EXPECT_EQ(units["car.mass"], "kg");
  EXPECT_EQ(units["car.com_y"], "m");
  EXPECT_EQ(units["car.ixy"], "kg m^2");
  EXPECT_EQ(units["car.inertia_scale"], "-");
  EXPECT_EQ(units["ball.z"], "m");
  EXPECT_EQ(units["gravity"], "m/s^2");
  EXPECT_EQ(units["hinge.damping"], "N m s/rad");
  EXPECT_EQ(units["slide.friction"], "N");
}

TEST(AllParameters, LeaveTheModelAsItIsAtTheirNominalValues) {
  const Model model = SkewModel();
  for (const Parameter& parameter : AllParameters(model)) {
    EXPECT_LT((AllNumbers(With(model, parameter.name, parameter.nominal)) -
               AllNumbers(model.nominal()))
                  .norm(),
              1e-15)
        << parameter.name;
  }
}

TEST(Length, ScalesEveryPositionInTheLinksFrameAndTheInertiaByTheSquare) {
  const Model model = SkewModel();
  const Mechanism& mechanism = model.mechanism();
  // "lower" carries a payload and a tip; its length is to the first, payload.
  const int link = mechanism.FindLink("lower");
  const int mount = mechanism.FindJoint("mount");
  const int end = mechanism.FindJoint("end");
  const double length = model.nominal().joint_p[mount].norm();
  EXPECT_EQ(FindParameters(model, {"lower.length"}, "")[0].nominal, length);
  const Values values = With(model, "lower.length", 1.5 * length);
  Values expected = model.nominal();
  expected.joint_p[mount] *= 1.5;
  expected.joint_p[end] *= 1.5;
  expected.links[link].com *= 1.5;
  expected.links[link].inertia *= 2.25;
  EXPECT_LT((AllNumbers(values) - AllNumbers(expected)).norm(), 1e-14);
  EXPECT_NEAR(LinkLength(mechanism, values, link), 1.5 * length, 1e-14);
}

TEST(Length, OfALastLinkIsTwiceTheDistanceOfItsCentreOfMass) {
  const Model model = SkewModel();
  const int link = model.mechanism().FindLink("rim");
  const Vector3d com = model.nominal().links[link].com;
  EXPECT_EQ(FindParameters(model, {"rim.length"}, "")[0].nominal,
            2.0 * com.norm());
  const Values values = With(model, "rim.length", 0.5);
  EXPECT_NEAR(values.links[link].com.norm(), 0.25, 1e-15);
  EXPECT_LT(values.links[link].com.cross(com).norm(), 1e-15);
  const double ratio = 0.25 / com.norm();
  EXPECT_LT((values.links[link].inertia -
             ratio * ratio * model.nominal().links[link].inertia)
                .norm(),
            1e-15);
  EXPECT_EQ(values.links[link].mass, model.nominal().links[link].mass);
}

// One number of the mechanism that a name stands for.
using Number = std::function<double&(Values*)>;

TEST(SetParameters, SetsTheNumberThatTheNameSaysAndNoOther) {
  const Model model = SkewModel();
  const Mechanism& mechanism = model.mechanism();
  const int car = mechanism.FindLink("car");
  const int ball = mechanism.FindJoint("ball");
  const std::map<std::string, Number> numbers = {
      {"car.mass", [=](Values* v) -> double& { return v->links[car].mass; }},
      {"car.com_x", [=](Values* v) -> double& { return v->links[car].com[0]; }},
      {"car.com_y", [=](Values* v) -> double& { return v->links[car].com[1]; }},
      {"car.com_z", [=](Values* v) -> double& { return v->links[car].com[2]; }},
      {"ball.x", [=](Values* v) -> double& { return v->joint_p[ball][0]; }},
      {"ball.y", [=](Values* v) -> double& { return v->joint_p[ball][1]; }},
      {"ball.z", [=](Values* v) -> double& { return v->joint_p[ball][2]; }},
      {"gravity", [](Values* v) -> double& { return v->gravity; }},
      {"hinge.damping", [](Values* v) -> double& { return v->effects[0]; }},
      {"slide.friction", [](Values* v) -> double& { return v->effects[1]; }},
      {"hinge.effort_bias", [](Values* v) -> double& { return v->effects[2]; }},
  };
  for (const auto& [name, number] : numbers) {
    Values expected = model.nominal();
    number(&expected) = 0.77;
    EXPECT_EQ(AllNumbers(With(model, name, 0.77)), AllNumbers(expected))
        << name;
  }
}

TEST(SetParameters, SetsBothHalvesOfTheInertia) {
  const Model model = SkewModel();
  const int car = model.mechanism().FindLink("car");
  const std::map<std::string, std::pair<int, int>> entries = {
      {"ixx", {0, 0}}, {"iyy", {1, 1}}, {"izz", {2, 2}},
      {"ixy", {0, 1}}, {"ixz", {0, 2}}, {"iyz", {1, 2}}};
  for (const auto& [name, at] : entries) {
    Values expected = model.nominal();
    expected.links[car].inertia(at.first, at.second) = 0.77;
    expected.links[car].inertia(at.second, at.first) = 0.77;
    EXPECT_EQ(AllNumbers(With(model, "car." + name, 0.77)),
              AllNumbers(expected))
        << name;
  }
  Values expected = model.nominal();
  expected.links[car].inertia *= 1.7;
  EXPECT_LT(
      (AllNumbers(With(model, "car.inertia_scale", 1.7)) - AllNumbers(expected))
          .norm(),
      1e-15);
}

TEST(SetParameters, LetsLengthsActFirstInWhateverOrderTheyAreNamed) {
  const Model model = SkewModel();
  const int lower = model.mechanism().FindLink("lower");
  const int mount = model.mechanism().FindJoint("mount");
  const double length = LinkLength(model.mechanism(), model.nominal(), lower);
  Values expected = model.nominal();
  expected.joint_p[mount] *= 2.0;
  expected.joint_p[mount][0] = 0.123;
  expected.joint_p[model.mechanism().FindJoint("end")] *= 2.0;
  expected.links[lower].com *= 2.0;
  expected.links[lower].com[2] = -0.456;
  expected.links[lower].mass = 3.0;
  expected.links[lower].inertia *= 4.0;
  expected.links[lower].inertia(0, 0) = 0.9;
  expected.links[lower].inertia *= 1.1;
  const std::vector<std::pair<std::string, double>> set = {
      {"mount.x", 0.123},      {"lower.inertia_scale", 1.1}, {"lower.ixx", 0.9},
      {"lower.com_z", -0.456}, {"lower.length", 2 * length}, {"lower.mass", 3}};
  for (size_t turn = 0; turn < set.size(); ++turn) {
    std::vector<std::string> names;
    std::vector<double> values;
    for (size_t i = 0; i < set.size(); ++i) {
      names.push_back(set[(i + turn) % set.size()].first);
      values.push_back(set[(i + turn) % set.size()].second);
    }
    Model changed = model;
    const std::vector<Parameter> found = FindParameters(model, names, "");
    SetParameters(found, values, &changed);
    EXPECT_LT((AllNumbers(changed.nominal()) - AllNumbers(expected)).norm(),
              1e-14);
    // The map of an estimator does the same.
    const ParameterMap map(model, found);
    Values mapped;
    map.Apply<double>(values.data(), &mapped);
    EXPECT_LT((AllNumbers(mapped) - AllNumbers(expected)).norm(), 1e-14);
  }
}

TEST(FindParameters, KeepsTheOrderOfTheNames) {
  const Model model = SkewModel();
  const ParameterMap map(
      model, FindParameters(model, {"gravity", "car.mass", "ball.x"}, ""));
  EXPECT_THAT(map.names(), ElementsAre("gravity", "car.mass", "ball.x"));
}

TEST(FindParameters, NamesTheNearestOfAnUnknownOne) {
  const Model model = SkewModel();
  EXPECT_EQ(ErrorText([&] {
              FindParameters(model, {"gravity", "car.mas"}, "--free");
            }),
            "--free: unknown parameter 'car.mas'\n"
            "  hint: did you mean 'car.mass'?");
}

TEST(FindParameters, ListsWhatThereIsWhereNothingIsNear) {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  AddSomeJoint("j", JointType::kRevolute, 0, "l", SomeBody(), &mechanism);
  EXPECT_EQ(ErrorText([&] {
              FindParameters(Model(mechanism), {"everything"}, "--free");
            }),
            "--free: unknown parameter 'everything'\n"
            "  hint: known: l.length, l.mass, l.com_x, l.com_y, l.com_z, "
            "l.ixx, l.iyy, l.izz, l.ixy, l.ixz, l.iyz, l.inertia_scale, j.x, "
            "j.y, j.z, gravity");
}

TEST(FindParameters, RefusesANameThatComesTwice) {
  const Model model = SkewModel();
  EXPECT_EQ(ErrorText([&] {
              FindParameters(model, {"gravity", "car.mass", "gravity"},
                             "fit.yaml:3:1");
            }),
            "fit.yaml:3:1: parameter 'gravity' is named twice\n"
            "  hint: name it once");
}

}  // namespace
}  // namespace sysid
