// ParameterMap: what an estimator moves in place of the values.

#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <memory>

#include "models/parameters.h"
#include "tests/models/skew_model.h"
#include "tests/support/error_text.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::ElementsAre;

using Values = MechanismParameters<double>;

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
