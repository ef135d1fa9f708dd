#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "models/dynamics_tangent.h"
#include "residuals/segment.h"
#include "tests/support/all_joints.h"
#include "tests/support/measured_run.h"
#include "tests/support/test_effects.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Every effect of the catalogue that the tangent covers, and those that show an
// effect all that there is to see.
Model WithEveryEffect(const Mechanism& mechanism, Random* random) {
  Catalogue catalogue = WithDynamicsEffects();
  catalogue.Add<TestInput>();
  catalogue.Add<TestMeasurement>();
  Model model(mechanism);
  AddEveryEffect(catalogue, random, &model);
  return model;
}

// Laws that read and write what simple ones do not.
Model WithWideEffects(const Mechanism& mechanism, Random* random) {
  Model model(mechanism);
  const Catalogue catalogue;
  for (const char* name :
       {"position_drive@hinge", "effort_limit@hinge", "load_friction@hinge",
        "thermal_friction@slide", "gear_efficiency@wheel", "actuator_lag@wheel",
        "asymmetric_friction@wheel", "base_motion@base", "effort_delay@base",
        "sensor_delay@hinge", "effort_limit@slide",
        "custom@slide: -k*slide.cmd*hinge.q*tanh(wheel.qd/v) + g*tau*t",
        "custom@hinge: -a*slide.qd^2*tau"}) {
    model.AddEffect(catalogue.Make(name, mechanism, "test"));
  }
  MechanismParameters<double> values = model.nominal();
  for (size_t i = 0; i < values.effects.size(); ++i) {
    const EffectParameter& parameter = model.effects().parameters()[i];
    values.effects[i] = parameter.null_value +
                        parameter.typical_scale * random->Uniform(0.5, 1.5);
    if (parameter.name.ends_with(".effort_limit")) values.effects[i] = 0.3;
  }
  model.SetNominal(values);
  return model;
}

struct Linearization {
  VectorXd errors, x_end;
  RowMatrixXd J, J_end;
};

// A segment with odd times between its samples, some of them missing.
class Segment {
 public:
  Segment(const Model& model, std::vector<Parameter> parameters, Random* random,
          bool at_rest = false)
      : model_(model), map_(model_, std::move(parameters), false) {
    VectorXd values(map_.size());
    for (int i = 0; i < map_.size(); ++i) {
      values[i] = map_.parameters()[i].nominal;
    }
    EXPECT_TRUE(map_.ThetaOf(values, &theta_));
    const RandomState at(model_.mechanism(), random);
    x0_.resize(model_.state_size());
    if (at_rest) {
      x0_ << model_.mechanism().NeutralConfiguration(),
          VectorXd::Zero(model_.nv());
    } else {
      x0_ << at.q, at.qd;
    }
    // Measured without effects: what the numbers are does not matter.
    run_ = MeasureEverything(Model(model_.mechanism()), x0_, 6, 0.004, 0.05,
                             random);
    double t = 0.5;
    for (double& time : run_.t) {
      time = t;
      t += random->Uniform(0.002, 0.006);
    }
    // What effects read, each other one held.
    for (int i = 0; i < model_.effects().size(); ++i) {
      for (const EffectInput& input : model_.effects().effect(i).inputs()) {
        if (HasInput(run_, input.name)) continue;
        run_.inputs.push_back(
            {input.name, run_.inputs.size() % 2 == 0, std::vector<double>()});
        for (int k = 0; k < run_.size(); ++k) {
          run_.inputs.back().values.push_back(random->Uniform(0.5, 2.0));
        }
      }
    }
    run_.channels.front().values.row(2).setConstant(std::nan(""));
    measurements_ = MeasurementsOf(model_.mechanism(), run_,
                                   OrientationResidual::kRotation);
  }

  Linearization By(LinearizationPath path, Integrator integrator, double step,
                   bool with_theta) const {
    const SegmentRollout rollout = Rollout({integrator, step, path});
    EXPECT_EQ(rollout.linearization(), path);
    Linearization out;
    out.errors.resize(rollout.num_residuals());
    out.x_end.resize(model_.state_size());
    EXPECT_TRUE(rollout.Linearize(x0_.data(), theta_.data(), with_theta,
                                  out.errors.data(), out.x_end.data(), &out.J,
                                  &out.J_end));
    return out;
  }

  SegmentRollout Rollout(const RolloutOptions& options, int last = 5) const {
    return SegmentRollout(&model_, &map_, &measurements_, 0, last, options);
  }
  const ParameterMap& map() const { return map_; }
  const VectorXd& x0() const { return x0_; }
  const VectorXd& theta() const { return theta_; }

 private:
  Model model_;
  ParameterMap map_;
  VectorXd theta_, x0_;
  sysid::Run run_;
  Measurements measurements_;
};

// The largest error of a column over its length. A column that is zero but for
// rounding (a moment about an axis that a force meets) has none.
double WorstColumn(const MatrixXd& a, const MatrixXd& b) {
  constexpr double kZero = 1e-15;
  EXPECT_EQ(a.cols(), b.cols());
  const double longest = b.colwise().norm().maxCoeff();
  double worst = 0.0;
  for (int c = 0; c < a.cols(); ++c) {
    const double length = b.col(c).norm();
    if (length <= kZero * longest && a.col(c).norm() <= kZero * longest) {
      continue;
    }
    worst = std::max(worst, (a.col(c) - b.col(c)).norm() / length);
  }
  return worst;
}

void ExpectEqual(const Segment& segment, Integrator integrator, double step,
                 bool with_theta, double* worst) {
  const Linearization jets =
      segment.By(LinearizationPath::kJets, integrator, step, with_theta);
  const Linearization structured =
      segment.By(LinearizationPath::kStructured, integrator, step, with_theta);
  EXPECT_LT((structured.errors - jets.errors).norm(),
            1e-12 * jets.errors.norm());
  EXPECT_LT((structured.x_end - jets.x_end).norm(), 1e-12 * jets.x_end.norm());
  MatrixXd a(jets.J.rows() + jets.J_end.rows(), jets.J.cols()), b = a;
  a << structured.J, structured.J_end;
  b << jets.J, jets.J_end;
  *worst = std::max(*worst, WorstColumn(a, b));
}

TEST(SegmentStructured, EqualsJetsOnRandomTreesWithEveryEffect) {
  double worst = 0.0;
  for (int tree = 0; tree < 24; ++tree) {
    SCOPED_TRACE(tree);
    Random random(tree);
    const Mechanism mechanism = RandomTree(tree, &random);
    const Model model = WithEveryEffect(mechanism, &random);
    const Segment segment(model, AllParameters(model), &random);
    ExpectEqual(segment, Integrator::kRungeKutta4, 0.003, true, &worst);
    ExpectEqual(segment, Integrator::kSemiImplicitEuler, 0.003, true, &worst);
    ExpectEqual(segment, Integrator::kRosenbrock2, 0.003, true, &worst);
  }
  std::printf("worst column: %.2g of its length\n", worst);
  EXPECT_LT(worst, 1e-10);
}

// Laws that read efforts, inputs and other joints, that drive and limit.
TEST(SegmentStructured, EqualsJetsWithWideEffects) {
  double worst = 0.0;
  for (int seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(seed);
    Random random(200 + seed);
    const Model model = WithWideEffects(AllJoints(), &random);
    EXPECT_TRUE(DynamicsTangent::Covers(model));
    const Segment segment(model, AllParameters(model), &random);
    ExpectEqual(segment, Integrator::kRungeKutta4, 0.003, true, &worst);
    ExpectEqual(segment, Integrator::kSemiImplicitEuler, 0.003, true, &worst);
    ExpectEqual(segment, Integrator::kRosenbrock2, 0.003, true, &worst);
  }
  std::printf("worst column: %.2g of its length\n", worst);
  EXPECT_LT(worst, 1e-9);
}

TEST(SegmentStructured, EqualsJetsWithoutEffects) {
  double worst = 0.0;
  for (int tree = 0; tree < 24; ++tree) {
    SCOPED_TRACE(tree);
    Random random(100 + tree);
    const Model model(RandomTree(tree, &random));
    const Segment segment(model, AllParameters(model), &random);
    ExpectEqual(segment, Integrator::kRungeKutta4, 0.0, true, &worst);
    ExpectEqual(segment, Integrator::kRungeKutta4, 0.0, false, &worst);
  }
  std::printf("worst column: %.2g of its length\n", worst);
  EXPECT_LT(worst, 1e-10);
}

// At rest with the joints at zero, where angles and speeds have no direction.
TEST(SegmentStructured, EqualsJetsAtRest) {
  double worst = 0.0;
  Random random(1);
  const Model model = WithEveryEffect(AllJoints(), &random);
  const Segment segment(model, AllParameters(model), &random, true);
  ExpectEqual(segment, Integrator::kRungeKutta4, 0.003, true, &worst);
  EXPECT_LT(worst, 1e-10);
}

TEST(SegmentStructured, GivesTheColumnsOfThetaAlone) {
  Random random(2);
  const Model model = WithEveryEffect(AllJoints(), &random);
  const Segment segment(model, AllParameters(model), &random);
  for (const LinearizationPath path :
       {LinearizationPath::kStructured, LinearizationPath::kJets}) {
    SCOPED_TRACE(ToString(path));
    const Linearization all =
        segment.By(path, Integrator::kRungeKutta4, 0.003, true);
    const SegmentRollout rollout =
        segment.Rollout({Integrator::kRungeKutta4, 0.003, path});
    VectorXd errors(rollout.num_residuals()), x_end(model.state_size());
    RowMatrixXd J, J_end;
    ASSERT_TRUE(rollout.LinearizeByTheta(segment.x0().data(),
                                         segment.theta().data(), errors.data(),
                                         x_end.data(), &J, &J_end));
    const int count = segment.map().size();
    ASSERT_EQ(J.cols(), count);
    ASSERT_EQ(J_end.cols(), count);
    EXPECT_LT((errors - all.errors).norm(), 1e-12 * errors.norm());
    EXPECT_LT((x_end - all.x_end).norm(), 1e-12 * x_end.norm());
    EXPECT_LT(WorstColumn(J, all.J.rightCols(count)), 1e-10);
    EXPECT_LT(WorstColumn(J_end, all.J_end.rightCols(count)), 1e-10);
  }
}

// Other parameters, columns, steps, lengths: with the scratch of what came
// before as without it.
TEST(SegmentStructured, KeepsNothingInItsScratchThatMatters) {
  Random random(3);
  const Model model = WithEveryEffect(AllJoints(), &random);
  const Segment segment(model, AllParameters(model), &random);
  const double* x0 = segment.x0().data();
  SegmentScratch scratch;
  for (int round = 0; round < 12; ++round) {
    SCOPED_TRACE(round);
    const SegmentRollout rollout = segment.Rollout(
        {round < 6 ? Integrator::kRungeKutta4 : Integrator::kSemiImplicitEuler,
         round % 2 == 0 ? 0.0 : 0.002},
        2 + round % 4);
    const VectorXd theta = segment.theta() * (1.0 + 1e-3 * (round / 2));
    Linearization kept, fresh;
    for (Linearization* out : {&kept, &fresh}) {
      SegmentScratch* used = out == &kept ? &scratch : nullptr;
      out->errors.resize(rollout.num_residuals());
      out->x_end.resize(model.state_size());
      EXPECT_TRUE(round % 3 == 2
                      ? rollout.LinearizeByTheta(
                            x0, theta.data(), out->errors.data(),
                            out->x_end.data(), &out->J, &out->J_end, used)
                      : rollout.Linearize(x0, theta.data(), round % 3 == 0,
                                          out->errors.data(), out->x_end.data(),
                                          &out->J, &out->J_end, used));
    }
    EXPECT_EQ(kept.errors, fresh.errors);
    EXPECT_EQ(kept.x_end, fresh.x_end);
    EXPECT_EQ(kept.J, fresh.J);
    EXPECT_EQ(kept.J_end, fresh.J_end);
  }
}

// An effect that acts where the tangent does not look.
class TestSecret : public EffectOf<TestSecret> {
 public:
  static constexpr char kName[] = "test_secret";
  static constexpr TargetKind kTarget = TargetKind::kBase;
  static constexpr unsigned kSecretHook = 1u << 31;
  TestSecret(const Mechanism& mechanism, const std::string& base)
      : EffectOf(kName, kSecretHook, mechanism, base) {}
};

// A material that relaxes with as many time constants as it is told.
template <int kStates>
class TestRelaxes : public EffectOf<TestRelaxes<kStates>> {
 public:
  static constexpr char kName[] = "test_relaxes";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  TestRelaxes(const Mechanism& mechanism, const std::string& joint)
      : EffectOf<TestRelaxes>(kName, kEffortHook | kStateRateHook, mechanism,
                              joint) {
    this->AddParameter(joint + ".stiffness", "{effort}/{position}", 0.1);
    for (int i = 0; i < kStates; ++i) {
      this->AddState(joint + ".relaxed" + std::to_string(i), "{position}", 0.5);
    }
  }
  static bool Applies(JointType type) { return type != JointType::kSpherical; }
  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    for (int i = 0; i < kStates; ++i) {
      tau[0] -= p[0] * (joint.q[0] - joint.z[i]);
    }
  }
  template <typename T>
  void StateRate(const JointState<T>& joint, const T*, T* rate) const {
    for (int i = 0; i < kStates; ++i) {
      rate[i] = (joint.q[0] - joint.z[i]) / (0.1 * (i + 1));
    }
  }
};

TEST(SegmentStructured, LeavesLawsOfManyStatesToJets) {
  Model three{AllJoints()}, four{AllJoints()};
  three.AddEffect(std::make_shared<TestRelaxes<3>>(three.mechanism(), "hinge"));
  four.AddEffect(std::make_shared<TestRelaxes<4>>(four.mechanism(), "hinge"));
  EXPECT_TRUE(DynamicsTangent::Covers(three));
  EXPECT_FALSE(DynamicsTangent::Covers(four));
  DynamicsTangent covered(three);
}

TEST(SegmentStructured, LeavesToJetsWhatItDoesNotCover) {
  Model model{AllJoints()};
  EXPECT_TRUE(DynamicsTangent::Covers(model));
  model.AddEffect(std::make_shared<TestSecret>(model.mechanism(), "base"));
  EXPECT_FALSE(DynamicsTangent::Covers(model));
  Random random(1);
  const Segment segment(model, {}, &random);
  const RolloutOptions structured;
  EXPECT_EQ(structured.linearization, LinearizationPath::kStructured);
  EXPECT_EQ(segment.Rollout(structured).linearization(),
            LinearizationPath::kJets);
  EXPECT_EQ(ToString(LinearizationPath::kJets), "jets");
  EXPECT_EQ(ToString(LinearizationPath::kStructured), "structured");
}

}  // namespace
}  // namespace sysid
