#include "models/parameters.h"

#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <functional>
#include <map>

#include "tests/support/all_joints.h"
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

// Off-axis bodies, so that no entry is zero by chance.
Mechanism SkewJoints() {
  Mechanism mechanism = AllJoints();
  Random random(1);
  for (size_t i = 1; i < mechanism.links.size(); ++i) {
    if (mechanism.nominal.links[i].mass == 0) continue;
    mechanism.nominal.links[i] = RandomInertial(&random);
  }
  return mechanism;
}

Model SkewModel() {
  const Mechanism mechanism = SkewJoints();
  Model model(mechanism);
  const Catalogue catalogue;
  for (const char* name : {"viscous_damping@hinge", "coulomb_friction@slide",
                           "effort_bias@hinge"}) {
    model.AddEffect(catalogue.Make(name, mechanism, "test"));
  }
  return model;
}

// The values of `model` with one parameter set.
Values With(const Model& model, const std::string& name, double value) {
  Model changed = model;
  SetParameters(FindParameters(model, {name}, "test"), {value}, &changed);
  return changed.nominal();
}

// Every number in one row, to see what else moved.
VectorXd AllNumbers(const Values& values) {
  std::vector<double> all;
  for (const Inertial<double>& link : values.links) {
    all.push_back(link.mass);
    all.insert(all.end(), link.com.begin(), link.com.end());
    all.insert(all.end(), link.inertia.data(), link.inertia.data() + 9);
  }
  for (const Vector3d& p : values.joint_p) {
    all.insert(all.end(), p.begin(), p.end());
  }
  all.push_back(values.gravity);
  all.insert(all.end(), values.effects.begin(), values.effects.end());
  return Eigen::Map<VectorXd>(all.data(), all.size());
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

// --- The log-Cholesky map (4.1) ---------------------------------------------

std::vector<std::string> InertiaNames(const std::string& link) {
  std::vector<std::string> names;
  for (const char* entry : {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}) {
    names.push_back(link + "." + entry);
  }
  return names;
}

// Six of one link, the diagonal of another (whose products are zero), one entry
// of a third, and others between them.
struct InertiaMap {
  InertiaMap() : model(SkewModel()) {
    Values values = model.nominal();
    values.links[model.mechanism().FindLink("upper")].inertia =
        Vector3d(0.02, 0.03, 0.04).asDiagonal();
    model.SetNominal(values);
    std::vector<std::string> names = InertiaNames("car");
    names.insert(names.begin() + 2, "car.mass");
    names.insert(names.begin() + 4, "upper.iyy");
    names.push_back("upper.izz");
    names.push_back("lower.ixx");
    names.push_back("upper.ixx");
    names.push_back("gravity");
    map =
        std::make_unique<ParameterMap>(model, FindParameters(model, names, ""));
    nominal.resize(map->size());
    for (int i = 0; i < map->size(); ++i) {
      nominal[i] = map->parameters()[i].nominal;
    }
  }
  Model model;
  std::unique_ptr<ParameterMap> map;
  VectorXd nominal;
};

TEST(ParameterMap, TransformsWhatItKeepsConsistentAndNothingElse) {
  const InertiaMap at;
  for (int i = 0; i < at.map->size(); ++i) {
    const std::string name = at.map->names()[i];
    const bool inertia =
        name.starts_with("car.i") || name.starts_with("upper.i");
    EXPECT_EQ(at.map->IsTransformed(i), inertia) << name;
  }
}

TEST(ParameterMap, TransformsNoDiagonalBesideFixedProducts) {
  const Model model = SkewModel();  // its products of inertia are not zero
  const ParameterMap map(
      model, FindParameters(model, {"car.ixx", "car.iyy", "car.izz"}, ""));
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(map.IsTransformed(i));
}

TEST(ParameterMap, GoesFromValuesToThetaAndBack) {
  const InertiaMap at;
  VectorXd theta, values(at.map->size());
  ASSERT_TRUE(at.map->ThetaOf(at.nominal, &theta));
  at.map->ValuesOf<double>(theta.data(), values.data());
  // The shift that lets a thin rod start: 1e-9 of the inertia.
  EXPECT_LT((values - at.nominal).cwiseAbs().maxCoeff(), 1e-8);
  Values mechanism;
  at.map->Apply<double>(theta.data(), &mechanism);
  EXPECT_LT((AllNumbers(mechanism) - AllNumbers(at.model.nominal())).norm(),
            1e-8);
}

TEST(ParameterMap, StartsAThinRod) {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  Inertial<double> rod = SomeBody();
  rod.inertia = Vector3d(0.1, 0.1, 0.0).asDiagonal();
  AddSomeJoint("j", JointType::kSpherical, 0, "l", rod, &mechanism);
  const Model model(mechanism);
  const ParameterMap map(model, FindParameters(model, InertiaNames("l"), ""));
  VectorXd values(6), theta, back(6);
  values << 0.1, 0.1, 0.0, 0.0, 0.0, 0.0;
  ASSERT_TRUE(map.ThetaOf(values, &theta));
  ASSERT_TRUE(theta.allFinite());
  map.ValuesOf<double>(theta.data(), back.data());
  EXPECT_LT((back - values).norm(), 1e-8);
}

TEST(ParameterMap, RefusesValuesThatAreNoBody) {
  const InertiaMap at;
  VectorXd values = at.nominal, theta;
  values[0] = 10.0 * (values[1] + values[3]);  // ixx > iyy + izz
  EXPECT_FALSE(at.map->ThetaOf(values, &theta));
}

TEST(ParameterMap, MakesAPossibleBodyOfEveryTheta) {
  const InertiaMap at;
  Random random(2);
  for (int draw = 0; draw < 1000; ++draw) {
    const VectorXd theta = random.NormalVector(at.map->size());
    Values mechanism;
    at.map->Apply<double>(theta.data(), &mechanism);
    for (const char* link : {"car", "upper"}) {
      const Matrix3d I =
          mechanism.links[at.model.mechanism().FindLink(link)].inertia;
      EXPECT_LT((I - I.transpose()).norm(), 1e-15 * I.norm());
      const Matrix3d S = SecondMoments<double>(I);
      const VectorXd moments =
          Eigen::SelfAdjointEigenSolver<Matrix3d>(S).eigenvalues();
      EXPECT_GT(moments.minCoeff(), -1e-15 * moments.maxCoeff()) << link;
      EXPECT_GT(S.determinant(), 0.0) << link;
    }
    // The diagonal of a diagonal inertia stays alone.
    const Matrix3d I =
        mechanism.links[at.model.mechanism().FindLink("upper")].inertia;
    EXPECT_TRUE(I.isDiagonal(0.0));
  }
}

TEST(ParameterMap, ReadsValuesAsApplyUsesThem) {
  const InertiaMap at;
  Random random(3);
  const VectorXd theta = random.NormalVector(at.map->size());
  VectorXd values(theta.size());
  at.map->ValuesOf<double>(theta.data(), values.data());
  Values mapped;
  at.map->Apply<double>(theta.data(), &mapped);
  Model set = at.model;
  SetParameters(at.map->parameters(),
                std::vector<double>(values.begin(), values.end()), &set);
  EXPECT_LT((AllNumbers(mapped) - AllNumbers(set.nominal())).norm(), 1e-14);
}

TEST(ParameterMap, DerivesItsValuesByTheta) {
  const InertiaMap at;
  Random random(4);
  const int n = at.map->size();
  const VectorXd theta = random.NormalVector(n);
  const Eigen::MatrixXd jacobian = at.map->ValueJacobian(theta);
  for (int column = 0; column < n; ++column) {
    const auto difference = RiddersDifference(
        [&](double h) {
          const VectorXd moved = theta + h * VectorXd::Unit(n, column);
          VectorXd values(n);
          at.map->ValuesOf<double>(moved.data(), values.data());
          return values;
        },
        0.1);
    EXPECT_LT((jacobian.col(column) - difference.value).norm(),
              1e-9 * (1.0 + jacobian.col(column).norm()));
  }
}

TEST(ParameterMap, DerivesTheMechanismByTheta) {
  const InertiaMap at;
  Random random(5);
  const int n = at.map->size();
  const VectorXd theta = random.NormalVector(n), along = random.NormalVector(n);
  std::vector<Jet8> theta_jet(theta.begin(), theta.end());
  for (int i = 0; i < n; ++i) theta_jet[i].v[0] = along[i];
  MechanismParameters<Jet8> jets;
  at.map->Apply<Jet8>(theta_jet.data(), &jets);
  const auto difference = RiddersDifference(
      [&](double h) {
        const VectorXd moved = theta + h * along;
        Values values;
        at.map->Apply<double>(moved.data(), &values);
        return AllNumbers(values);
      },
      0.1);
  Values slopes;
  for (const auto& link : jets.links) {
    Inertial<double> slope;
    slope.mass = link.mass.v[0];
    for (int k = 0; k < 3; ++k) slope.com[k] = link.com[k].v[0];
    for (int k = 0; k < 9; ++k) {
      slope.inertia.data()[k] = link.inertia.data()[k].v[0];
    }
    slopes.links.push_back(slope);
  }
  for (const auto& p : jets.joint_p) {
    slopes.joint_p.emplace_back(p[0].v[0], p[1].v[0], p[2].v[0]);
  }
  slopes.gravity = jets.gravity.v[0];
  for (const auto& e : jets.effects) slopes.effects.push_back(e.v[0]);
  EXPECT_LT((AllNumbers(slopes) - difference.value).norm(),
            1e-9 * difference.value.norm());
}

TEST(FirstImpossibleLink, IsNoneAtTheNominalValues) {
  const InertiaMap at;
  VectorXd theta;
  ASSERT_TRUE(at.map->ThetaOf(at.nominal, &theta));
  EXPECT_EQ(at.map->FirstImpossibleLink(theta.data()), "");
}

TEST(FirstImpossibleLink, NamesANegativeMass) {
  const Model model = SkewModel();
  const ParameterMap map(model,
                         FindParameters(model, {"upper.mass", "car.mass"}, ""));
  const double theta[] = {1.0, -0.1};
  EXPECT_EQ(map.FirstImpossibleLink(theta), "car");
}

TEST(FirstImpossibleLink, NamesABrokenTriangleInequality) {
  const Model model = SkewModel();
  const ParameterMap map(model,
                         FindParameters(model, {"gravity", "car.ixx"}, ""));
  const Matrix3d& I =
      model.nominal().links[model.mechanism().FindLink("car")].inertia;
  const double possible[] = {9.81, I(0, 0)};
  EXPECT_EQ(map.FirstImpossibleLink(possible), "");
  const double too_large[] = {9.81, 1.01 * (I(1, 1) + I(2, 2))};
  EXPECT_EQ(map.FirstImpossibleLink(too_large), "car");
  const double negative[] = {9.81, -0.01};
  EXPECT_EQ(map.FirstImpossibleLink(negative), "car");
}

}  // namespace
}  // namespace sysid
