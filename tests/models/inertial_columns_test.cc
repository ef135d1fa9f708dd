#include "models/inertial_columns.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/dynamics_calls.h"
#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

// (2.29) of a body.
Eigen::VectorXd CoordinatesOf(const Inertial<double>& body) {
  const Eigen::Matrix3d J =
      body.inertia +
      body.mass * (body.com.squaredNorm() * Eigen::Matrix3d::Identity() -
                   body.com * body.com.transpose());
  Eigen::VectorXd xi(10);
  xi << body.mass, body.mass * body.com, J(0, 0), J(1, 1), J(2, 2), J(0, 1),
      J(0, 2), J(1, 2);
  return xi;
}

Inertial<double> BodyOf(const Eigen::VectorXd& xi) {
  Inertial<double> body;
  body.mass = xi[0];
  body.com = xi.segment(1, 3) / xi[0];
  Eigen::Matrix3d J;
  J << xi[4], xi[7], xi[8], xi[7], xi[5], xi[9], xi[8], xi[9], xi[6];
  body.inertia =
      J - body.mass * (body.com.squaredNorm() * Eigen::Matrix3d::Identity() -
                       body.com * body.com.transpose());
  return body;
}

// The inverse dynamics are linear in (2.29): a change of any size says the
// column, but for rounding.
TEST(InertialColumns, AreWhatAChangeOfACoordinateChanges) {
  Random random(7);
  for (int number = 0; number < 40; ++number) {
    const Mechanism tree = RandomMechanism(2 + number % 6, &random);
    const Model model(tree);
    const RandomState state(tree, &random);
    const Eigen::VectorXd qdd = random.NormalVector(model.nv());
    Workspace<double> ws(model);
    ASSERT_TRUE(HasInertialColumns(ws));
    const MechanismParameters<double> nominal = model.nominal();
    const Eigen::VectorXd tau = Inverse(&ws, state.q, state.qd, qdd);
    for (size_t link = 0; link < tree.links.size(); ++link) {
      SCOPED_TRACE(tree.links[link].name);
      ws.SetParameters(nominal);
      Inverse(&ws, state.q, state.qd, qdd);
      RowMatrixXd columns(model.nv(), 10);
      InertialColumns(ws, static_cast<int>(link), columns);
      if (!(nominal.links[link].mass > 0.0)) continue;
      for (int c = 0; c < 10; ++c) {
        MechanismParameters<double> changed = nominal;
        Eigen::VectorXd xi = CoordinatesOf(nominal.links[link]);
        xi[c] += 1.0;
        changed.links[link] = BodyOf(xi);
        ws.SetParameters(changed);
        const Eigen::VectorXd after = Inverse(&ws, state.q, state.qd, qdd);
        const double size =
            1.0 + tau.norm() + columns.col(c).norm() + state.qd.squaredNorm();
        EXPECT_LT((after - tau - columns.col(c)).norm(), 1e-10 * size)
            << "coordinate " << c;
      }
    }
  }
}

}  // namespace
}  // namespace sysid
