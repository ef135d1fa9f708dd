#include "sysid/inverse_dynamics/coordinates.h"

#include <gtest/gtest.h>

#include "models/dynamics.h"
#include "tests/support/all_joints.h"
#include "tests/support/fit_setup.h"
#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

const std::vector<std::string>& Ten() {
  static const auto& ten =
      *new std::vector<std::string>{"mass", "com_x", "com_y", "com_z", "ixx",
                                    "iyy",  "izz",   "ixy",   "ixz",   "iyz"};
  return ten;
}

std::vector<Parameter> InertialOf(const Model& model,
                                  const std::vector<std::string>& links) {
  std::vector<std::string> names;
  for (const std::string& link : links) {
    for (const std::string& name : Ten()) names.push_back(link + "." + name);
  }
  return FindParameters(model, names, "test");
}

TEST(EquationCoordinates, BodyAtIsTheInverseOfRead) {
  const Model model(AllJoints());
  const EquationCoordinates coordinates(model, InertialOf(model, {"upper"}));
  ASSERT_EQ(coordinates.size(), 10);
  Eigen::VectorXd xi(10);
  coordinates.Read<double>(model.nominal(), xi.data());
  const Inertial<double> body = EquationCoordinates::BodyAt(xi.data());
  const Inertial<double> wanted = SomeBody();
  EXPECT_NEAR(body.mass, wanted.mass, 1e-14);
  EXPECT_LT((body.com - wanted.com).norm(), 1e-14);
  EXPECT_LT((body.inertia - wanted.inertia).norm(), 1e-14);
  // (11.1): I_xx about the origin is that about the centre and m (y^2 + z^2).
  EXPECT_NEAR(xi[4], 0.02 + 1.2 * (0.05 * 0.05 + 0.3 * 0.3), 1e-14);
}

// The efforts that a motion needs, by a change of the coordinates, for every
// kind of joint: exactly linear.
TEST(EquationCoordinates, TheInverseDynamicsAreLinearInThem) {
  Model model(AllJoints());
  const std::vector<std::string> links = {"car", "upper", "lower", "rim"};
  const EquationCoordinates coordinates(model, InertialOf(model, links));
  const int n = coordinates.size(), nv = model.nv();
  Random random(3);
  const struct RandomState at(model.mechanism(), &random);
  const auto efforts = [&](const MechanismParameters<double>& values) {
    Workspace<double> ws(model);
    ws.SetParameters(values);
    Eigen::VectorXd tau(nv);
    InverseDynamics<double>(&ws, at.q.data(), at.qd.data(), at.qdd.data(),
                            tau.data());
    return tau;
  };
  Eigen::MatrixXd J(nv, n);
  for (int begin = 0; begin < n; begin += EquationCoordinates::kWidth) {
    MechanismParameters<Jet24> values;
    coordinates.Seed(model.nominal(), begin, &values);
    Workspace<Jet24> ws(model);
    ws.SetParameters(values);
    std::vector<Jet24> q(at.q.begin(), at.q.end()),
        qd(at.qd.begin(), at.qd.end()), qdd(at.qdd.begin(), at.qdd.end()),
        tau(nv);
    InverseDynamics<Jet24>(&ws, q.data(), qd.data(), qdd.data(), tau.data());
    for (int v = 0; v < nv; ++v) {
      for (int c = 0; c < EquationCoordinates::kWidth && begin + c < n; ++c) {
        J(v, begin + c) = tau[v].v[c];
      }
    }
  }
  Eigen::VectorXd xi(n);
  coordinates.Read<double>(model.nominal(), xi.data());
  MechanismParameters<double> other = model.nominal();
  Eigen::VectorXd xi_other(n);
  for (const std::string& link : links) {
    other.links[model.mechanism().FindLink(link)] = RandomInertial(&random);
  }
  coordinates.Read<double>(other, xi_other.data());
  const Eigen::VectorXd before = efforts(model.nominal());
  const Eigen::VectorXd after = efforts(other);
  EXPECT_LT((before + J * (xi_other - xi) - after).norm(),
            1e-12 * after.norm());
}

TEST(EquationCoordinates, ALinkWithoutMassIsDifferentiatedToo) {
  Mechanism mechanism = AllJoints();
  const int link = mechanism.FindLink("lower");
  mechanism.nominal.links[link] = {};
  const Model model(mechanism);
  const EquationCoordinates coordinates(model, InertialOf(model, {"lower"}));
  MechanismParameters<Jet24> values;
  coordinates.Seed(model.nominal(), 0, &values);
  Eigen::VectorXd xi(10);
  std::vector<Jet24> read(10);
  coordinates.Read<Jet24>(values, read.data());
  for (int i = 0; i < 10; ++i) {
    for (int c = 0; c < 10; ++c) {
      EXPECT_NEAR(read[i].v[c], i == c ? 1.0 : 0.0, 1e-14) << i << " " << c;
    }
  }
}

TEST(EquationCoordinates, ALengthTouchesTheBodyAndTheNextJoint) {
  const Model model = Shipped("pendulum2_planar");
  const EquationCoordinates coordinates(
      model, FindParameters(model, {"link1.length", "gravity"}, "test"));
  ASSERT_EQ(coordinates.size(), 10 + 3 + 1);
  EXPECT_EQ(coordinates.Name(0), "link1.m");
  EXPECT_EQ(coordinates.Name(4), "link1.Jxx");
  EXPECT_EQ(coordinates.Unit(1), "kg m");
  EXPECT_EQ(coordinates.Name(13), "gravity");
  EXPECT_EQ(coordinates.PlaceOf(model.mechanism().FindLink("link1")), 0);
  EXPECT_EQ(coordinates.PlaceOf(model.mechanism().FindLink("link2")), -1);
}

}  // namespace
}  // namespace sysid
