#include "sysid/simulation/rollout.h"

#include <gmock/gmock.h>

#include <cmath>

#include "models/find_model.h"
#include "models/parameters.h"
#include "models/state.h"
#include "models/urdf/load_urdf.h"
#include "sysid/simulation/simulate.h"
#include "tests/support/error_text.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;

Model RobotWith(const std::string& robot,
                const std::vector<std::string>& effects) {
  const Catalogue catalogue;
  Model model = MakeModel(LoadUrdf(FindModel(robot)), catalogue);
  for (const std::string& effect : effects) {
    model.AddEffect(catalogue.Make(effect, model.mechanism(), "test"));
  }
  return model;
}

// Efforts over 12 samples, no measurement.
Run Drive(const Model& model) {
  Run drive;
  drive.effort.resize(12, model.nv());
  for (int k = 0; k < 12; ++k) {
    drive.t.push_back(0.02 * k);
    for (int v = 0; v < model.nv(); ++v) {
      drive.effort(k, v) = 0.05 * std::sin(1.0 + 0.7 * k + v);
    }
  }
  return drive;
}

RolloutOptions Steps(double step) {
  RolloutOptions options;
  options.step = step;
  return options;
}

// The tangent from one state to another.
Eigen::VectorXd Change(const Model& model, const RowMatrixXd& to,
                       const RowMatrixXd& from, int k) {
  Eigen::VectorXd dx(model.tangent_size());
  BoxMinus<double>(model, to.row(k).data(), from.row(k).data(), dx.data());
  return dx;
}

// Of the central differences, and how near they are to the derivatives.
constexpr double kStep = 1e-5, kTolerance = 1e-5;

// All derivatives of a model against central differences of its rollouts.
void ExpectDerivatives(const Model& model,
                       const std::vector<std::string>& parameters) {
  const RolloutOptions options = Steps(0.01);
  const Run drive = Drive(model);
  Eigen::VectorXd x0 = RandomState(model, 0.6, 3);
  for (int v = 0; v < model.nv(); ++v) x0[model.layout().qd() + v] = 0.4 - v;
  const LinearizedRollout linear =
      LinearizeRollout(model, parameters, x0, drive, options);
  const RowMatrixXd states = RollOut(model, x0, drive, options);
  EXPECT_LT((linear.states - states).cwiseAbs().maxCoeff(), 1e-10);
  const auto expect = [&](const RowMatrixXd& plus, const RowMatrixXd& minus,
                          const auto& column, const std::string& what,
                          double step = kStep) {
    for (const int k : {1, 6, 11}) {
      const Eigen::VectorXd secant =
          (Change(model, plus, states, k) - Change(model, minus, states, k)) /
          (2 * step);
      EXPECT_LT((secant - column(k)).norm(), kTolerance * (1 + secant.norm()))
          << what << " at " << k;
    }
  };
  for (int i = 0; i < model.tangent_size(); ++i) {
    const auto at = [&](double step) {
      Eigen::VectorXd dx = Eigen::VectorXd::Zero(model.tangent_size());
      Eigen::VectorXd x(model.state_size());
      dx[i] = step;
      BoxPlus<double>(model, x0.data(), dx.data(), x.data());
      return RollOut(model, x, drive, options);
    };
    expect(
        at(kStep), at(-kStep),
        [&](int k) { return linear.by_start[k].col(i).eval(); },
        "start " + std::to_string(i));
  }
  for (size_t p = 0; p < parameters.size(); ++p) {
    // Inertias of some 1e-5 kg m^2.
    const bool is_inertia = parameters[p].find(".i") != std::string::npos;
    const double parameter_step = is_inertia ? 1e-8 : 1e-6;
    const auto at = [&](double step) {
      Model changed = model;
      const auto found = FindParameters(model, parameters, "test");
      std::vector<double> values;
      for (const Parameter& own : found) values.push_back(own.nominal);
      values[p] += step;
      SetParameters(found, values, &changed);
      return RollOut(changed, x0, drive, options);
    };
    expect(
        at(parameter_step), at(-parameter_step),
        [&](int k) { return linear.by_parameters[k].col(p).eval(); },
        parameters[p], parameter_step);
  }
  for (const int j : {0, 4}) {
    for (int v = 0; v < model.nv(); ++v) {
      const auto at = [&](double step) {
        Run driven = drive;
        driven.effort(j, v) += step;
        return RollOut(model, x0, driven, options);
      };
      expect(
          at(kStep), at(-kStep),
          [&](int k) { return linear.ByEffort(k, j).col(v).eval(); },
          "effort " + std::to_string(v) + " of sample " + std::to_string(j));
    }
  }
}

TEST(LinearizeRollout, IsThatOfHinges) {
  ExpectDerivatives(
      RobotWith("pendulum2_planar", {"viscous_damping@joint1"}),
      {"link1.length", "link2.mass", "link2.iyy", "joint1.damping", "gravity"});
}

TEST(LinearizeRollout, IsThatOfSphericalJoints) {
  ExpectDerivatives(RobotWith("pendulum2", {}),
                    {"link1.length", "link1.ixx", "link1.iyy", "link1.izz",
                     "link1.ixy", "link1.ixz", "link1.iyz"});
}

TEST(LinearizeRollout, IsThatOfSlides) {
  ExpectDerivatives(RobotWith("cartpole", {"viscous_damping@slider"}), {});
}

TEST(LinearizeRollout, SaysWhatIsWrong) {
  const Model model = RobotWith("pendulum2_planar", {"viscous_damping@joint1"});
  const Eigen::VectorXd x0 = NeutralState(model);
  const sysid::Run drive = Drive(model);
  EXPECT_THAT(
      ErrorText([&] { LinearizeRollout(model, {"link9.mass"}, x0, drive); }),
      HasSubstr("rollout: unknown parameter 'link9.mass'"));
  EXPECT_THAT(ErrorText([&] { RollOut(model, x0.head(3), drive); }),
              HasSubstr("rollout: the start has 3 numbers, not 4 finite ones"));
  sysid::Run wrong = drive;
  wrong.effort.conservativeResize(5, 2);
  EXPECT_THAT(ErrorText([&] { RollOut(model, x0, wrong); }),
              HasSubstr("the efforts are 5 x 2, not 12 x 2 finite numbers"));
  wrong = drive;
  wrong.t[3] = wrong.t[2];
  EXPECT_THAT(ErrorText([&] { RollOut(model, x0, wrong); }),
              HasSubstr("the time does not rise at sample 3"));
  wrong = drive;
  wrong.effort *= 1e300;
  EXPECT_THAT(ErrorText([&] { RollOut(model, x0, wrong); }),
              HasSubstr("the motion does not stay finite"));
}

}  // namespace
}  // namespace sysid
