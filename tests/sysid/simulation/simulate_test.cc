#include "sysid/simulation/simulate.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "models/dynamics.h"
#include "models/find_model.h"
#include "models/math/rotation.h"
#include "models/state.h"
#include "models/urdf/load_urdf.h"
#include "tests/support/error_text.h"

namespace sysid {
namespace {

using Eigen::VectorXd;

Model Shipped(const std::string& name) {
  return MakeModel(LoadUrdf(FindModel(name)), Catalogue());
}

TEST(Simulate, MeasuresThePositionOfEveryJointAtTheRate) {
  const Model model = Shipped("cartpole");
  SimulationOptions options;
  options.duration = 2.0;
  options.rate = 50.0;
  const sysid::Run run = Simulate(model, RandomState(model, 0.5, 1), options);
  ASSERT_EQ(run.size(), 101);
  EXPECT_EQ(run.t.front(), 0.0);
  EXPECT_DOUBLE_EQ(run.t.back(), 2.0);
  ASSERT_EQ(run.channels.size(), 2u);
  EXPECT_EQ(run.channels[0].name, "slider");
  EXPECT_EQ(run.channels[1].name, "hinge");
  EXPECT_EQ(run.channels[1].kind, ChannelKind::kPosition);
  EXPECT_EQ(run.effort, RowMatrixXd::Zero(101, 2));
}

TEST(Simulate, RefusesTheStateOfAnotherModel) {
  Model model = MakeModel(LoadUrdf(FindModel("pendulum2_planar")), Catalogue());
  const Eigen::VectorXd x0 = RandomState(model, 0.5, 1);
  model.AddEffect(Catalogue().Make("presliding_friction@joint1",
                                   model.mechanism(), "here"));
  EXPECT_THROW(Simulate(model, x0, SimulationOptions()), std::invalid_argument);
}

TEST(Simulate, StartsAtTheStateAndSwingsAsAPendulumDoes) {
  // A pole on a heavy cart: small swings of sqrt(m g c / (m c^2 + I)).
  Model model = Shipped("cartpole");
  MechanismParameters<double> values = model.nominal();
  values.links[model.mechanism().FindLink("cart")].mass = 1e9;
  model.SetNominal(values);
  const Inertial<double>& pole =
      values.links[model.mechanism().FindLink("pole")];
  const double c = pole.com.norm();
  const double w = std::sqrt(pole.mass * 9.81 * c /
                             (pole.mass * c * c + pole.inertia(1, 1)));
  const VectorXd x0 = Eigen::Vector4d(0.0, 1e-4, 0.0, 0.0);
  const sysid::Run run = Simulate(model, x0, {});
  for (int k = 0; k < run.size(); ++k) {
    EXPECT_NEAR(run.channels[1].values(k, 0), 1e-4 * std::cos(w * run.t[k]),
                1e-9);
  }
}

TEST(Simulate, DoesNotDependOnHowTheTimeIsDivided) {
  const Model model = Shipped("pendulum2");
  SimulationOptions coarse, fine;
  coarse.duration = fine.duration = 2.0;
  fine.step = 1e-4;
  const VectorXd x0 = RandomState(model, 0.5, 2);
  const sysid::Run a = Simulate(model, x0, coarse),
                   b = Simulate(model, x0, fine);
  for (size_t c = 0; c < a.channels.size(); ++c) {
    EXPECT_LT(
        (a.channels[c].values - b.channels[c].values).cwiseAbs().maxCoeff(),
        1e-8);
  }
}

TEST(Simulate, AddsNoiseOfTheStandardDeviation) {
  for (const char* name : {"cartpole", "pendulum2"}) {
    const Model model = Shipped(name);
    SimulationOptions options;
    options.duration = 20.0;
    const VectorXd x0 = RandomState(model, 0.3, 1);
    const sysid::Run exact = Simulate(model, x0, options);
    options.noise = 0.01;
    options.step = 0.0025;
    const sysid::Run noisy = Simulate(model, x0, options);
    double squares = 0.0;
    int count = 0;
    for (size_t c = 0; c < exact.channels.size(); ++c) {
      for (int k = 0; k < exact.size(); ++k) {
        const auto a = exact.channels[c].values.row(k);
        const auto b = noisy.channels[c].values.row(k);
        if (a.size() == 1) {
          squares += (a - b).squaredNorm();
          count += 1;
          continue;
        }
        EXPECT_NEAR(b.norm(), 1.0, 1e-12);
        const Eigen::Quaterniond p(Eigen::Vector4d(a.transpose()));
        const Eigen::Quaterniond q(Eigen::Vector4d(b.transpose()));
        squares += Log(p.conjugate() * q).squaredNorm();
        count += 3;
      }
    }
    EXPECT_NEAR(std::sqrt(squares / count), 0.01, 0.0005) << name;
  }
}

TEST(Simulate, DrawsTheSameFromTheSameSeedOnly) {
  const Model model = Shipped("cartpole");
  SimulationOptions options;
  options.noise = 0.01;
  options.duration = 1.0;
  options.excitation = Excitation::kMultisine;
  const VectorXd x0 = RandomState(model, 0.3, 1);
  const sysid::Run a = Simulate(model, x0, options),
                   b = Simulate(model, x0, options);
  options.seed = 2;
  const sysid::Run c = Simulate(model, x0, options);
  EXPECT_EQ(a.channels[0].values, b.channels[0].values);
  EXPECT_EQ(a.effort, b.effort);
  EXPECT_NE(a.channels[0].values, c.channels[0].values);
  EXPECT_NE(a.effort, c.effort);
}

TEST(Simulate, MeasuresWithTheSensorsOffset) {
  Model model = Shipped("cartpole");
  const VectorXd x0 = RandomState(model, 0.3, 1);
  const sysid::Run plain = Simulate(model, x0, {});
  model.AddEffect(
      Catalogue().Make("sensor_offset@hinge", model.mechanism(), "test"));
  model.SetEffectParameter("hinge.sensor_offset", 0.2);
  const sysid::Run offset = Simulate(model, x0, {});
  EXPECT_LT((offset.channels[1].values.array() - 0.2 -
             plain.channels[1].values.array())
                .abs()
                .maxCoeff(),
            1e-12);
  EXPECT_EQ(offset.channels[0].values, plain.channels[0].values);
}

TEST(Simulate, ExcitesWithAMultisineOfThePartOfTheWeight) {
  const Model model = Shipped("cartpole");
  SimulationOptions options;
  options.duration = 60.0;
  options.excitation = Excitation::kMultisine;
  options.excitation_level = 0.3;
  const sysid::Run run = Simulate(model, RandomState(model, 0.1, 1), options);
  const double weight = (1.0 + 0.2) * 9.81;
  const double rms = std::sqrt(run.effort.col(0).squaredNorm() / run.size());
  EXPECT_NEAR(rms, 0.3 * weight, 0.1 * weight);
  const double moment = 0.2 * 9.81 * 0.3;
  const double hinge = std::sqrt(run.effort.col(1).squaredNorm() / run.size());
  EXPECT_NEAR(hinge, 0.3 * moment, 0.1 * moment);
}

TEST(Simulate, SaysWhereTheMotionDoesNotStayFinite) {
  const Model model = Shipped("cartpole");
  const VectorXd x0 = Eigen::Vector4d(0.0, 0.1, 0.0, 1e200);
  EXPECT_EQ(ErrorText([&] { Simulate(model, x0, {}); }),
            "simulation: the motion does not stay finite\n"
            "  hint: check masses and efforts, or give a smaller --step");
}

TEST(RandomState, IsAtRestWithinTheAmplitude) {
  for (const char* name : {"cartpole", "pendulum3"}) {
    const Model model = Shipped(name);
    for (int seed = 0; seed < 20; ++seed) {
      const VectorXd x = RandomState(model, 0.4, seed);
      EXPECT_EQ(x.tail(model.nv()), VectorXd::Zero(model.nv()));
      for (const Body& body : model.bodies()) {
        if (body.type != JointType::kSpherical) {
          EXPECT_LE(std::abs(x[body.q_index]), 0.4);
          continue;
        }
        const Eigen::Quaterniond q(Eigen::Vector4d(x.segment<4>(body.q_index)));
        const Eigen::Vector3d phi = Log(q);
        EXPECT_LE(phi.norm(), 0.4 + 1e-12);
        EXPECT_NEAR(phi.z(), 0.0, 1e-15);  // about a horizontal axis
      }
    }
    EXPECT_EQ(RandomState(model, 0.4, 1), RandomState(model, 0.4, 1));
    EXPECT_NE(RandomState(model, 0.4, 1), RandomState(model, 0.4, 2));
  }
}

TEST(FirstState, IsWhatTheFirstSampleMeasured) {
  const Model model = Shipped("cartpole");
  sysid::Run run;
  run.t = {0.0, 0.1};
  Channel position, velocity;
  position.target = velocity.target = model.mechanism().FindJoint("hinge");
  position.values = Eigen::Vector2d(0.3, 0.4);
  velocity.kind = ChannelKind::kVelocity;
  velocity.values = Eigen::Vector2d(-1.5, 2.0);
  run.channels = {position, velocity};
  EXPECT_EQ(FirstState(model, run), Eigen::Vector4d(0.0, 0.3, 0.0, -1.5));
  run.channels[1].values(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(FirstState(model, run), Eigen::Vector4d(0.0, 0.3, 0.0, 0.0));
}

// I theta'' = u - f by differences of what the two sensors say.
TEST(Simulate, ReadsMotorsAheadOfTheirSprings) {
  constexpr double k = 400.0, d = 3.0, inertia = 0.5, rate = 2000.0;
  Model model = Shipped("cartpole");
  model.AddEffect(
      Catalogue().Make("joint_elasticity@slider", model.mechanism(), "test"));
  model.SetEffectParameter("slider.drive_stiffness", k);
  model.SetEffectParameter("slider.drive_damping", d);
  model.SetEffectParameter("slider.motor_inertia", inertia);
  SimulationOptions options;
  options.duration = 1.0;
  options.rate = rate;
  options.motor_sensors = true;
  options.excitation = Excitation::kMultisine;
  const sysid::Run run = Simulate(model, NeutralState(model), options);
  ASSERT_EQ(run.channels.size(), 4u);
  const auto q = run.channels[0].values.col(0);
  const Channel& motor = run.channels[2];
  EXPECT_EQ(motor.kind, ChannelKind::kMotorPosition);
  EXPECT_EQ(motor.name, "slider.motor_q");
  const auto theta = motor.values.col(0);
  const double most = run.effort.col(0).cwiseAbs().maxCoeff();
  ASSERT_GT(most, 0.0);
  for (int i = 1; i + 1 < run.size(); ++i) {
    const double bend = theta[i] - q[i];
    const double rate_of_bend =
        0.5 * rate * (theta[i + 1] - q[i + 1] - theta[i - 1] + q[i - 1]);
    const double f = k * bend + d * rate_of_bend;
    const double acceleration =
        rate * rate * (theta[i + 1] - 2.0 * theta[i] + theta[i - 1]);
    const double u = 0.5 * (run.effort(i - 1, 0) + run.effort(i, 0));
    ASSERT_NEAR(inertia * acceleration + f, u, 1e-3 * most) << i;
  }
  // A rigid drive's motor is where its joint is.
  EXPECT_EQ(run.channels[3].values, run.channels[1].values);
}

TEST(Simulate, ReadsMotorsByTheirOwnSensors) {
  Model model = Shipped("pendulum2_planar");
  for (const char* name : {"sensor_gain@joint1", "sensor_offset@joint1.motor",
                           "sensor_delay@joint2.motor"}) {
    model.AddEffect(Catalogue().Make(name, model.mechanism(), "test"));
  }
  model.SetEffectParameter("joint1.sensor_gain", 0.1);
  model.SetEffectParameter("joint1.motor.sensor_offset", 0.2);
  model.SetEffectParameter("joint2.motor.sensor_delay", 0.01);
  SimulationOptions options;
  options.rate = 100.0;
  options.motor_sensors = true;
  const sysid::Run run = Simulate(model, RandomState(model, 1.0, 3), options);
  for (int i = 1; i < run.size(); ++i) {
    ASSERT_NEAR(run.channels[2].values(i, 0),
                run.channels[0].values(i, 0) / 1.1 + 0.2, 1e-12);
    // Late by a sample; d^3 / 6 of the jerk.
    ASSERT_NEAR(run.channels[3].values(i, 0), run.channels[1].values(i - 1, 0),
                2e-4);
  }
}

// What a late sensor says of before is what was: a joint that dry friction
// holds stands still, and an effort has not acted before its row.
TEST(Simulate, SensorsLookBack) {
  Model model = Shipped("pendulum2_planar");
  for (const char* name : {"coulomb_friction@joint1", "coulomb_friction@joint2",
                           "sensor_delay@joint1", "sensor_delay@joint2"}) {
    model.AddEffect(Catalogue().Make(name, model.mechanism(), "test"));
  }
  for (const char* joint : {"joint1", "joint2"}) {
    model.SetEffectParameter(joint + std::string(".friction"), 100.0);
    model.SetEffectParameter(joint + std::string(".sensor_delay"), 0.1);
  }
  SimulationOptions options;
  options.rate = 100.0;
  VectorXd x = VectorXd::Zero(4);
  x[0] = 0.3;
  const sysid::Run held = Simulate(model, x, options);
  EXPECT_EQ(held.channels[0].values.minCoeff(), 0.3);
  EXPECT_EQ(held.channels[0].values.maxCoeff(), 0.3);

  Model cart = Shipped("cartpole");
  cart.AddEffect(Catalogue().Make("sensor_delay@slider", cart.mechanism(), ""));
  cart.SetEffectParameter("slider.sensor_delay", 0.01);
  const sysid::Run pushed = SimulateDriven(
      cart, VectorXd::Zero(4), options,
      [](int sample, double, const VectorXd&, Eigen::Ref<VectorXd> effort) {
        effort[0] = sample < 50 ? 0.0 : 10.0;
      });
  EXPECT_EQ(pushed.channels[0].values(50, 0), 0.0);
  EXPECT_GT(pushed.channels[0].values(52, 0), 0.0);
}

}  // namespace
}  // namespace sysid
