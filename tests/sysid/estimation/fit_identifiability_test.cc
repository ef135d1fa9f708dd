// What a fit says of parameters that the data does not determine.

#include <gmock/gmock.h>

#include <cmath>

#include "tests/support/fit_setup.h"
#include "tests/sysid/estimation/simulated.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

TEST(FitIdentifiability, NamesOnlyTheMomentThatTheDataLeavesOpen) {
  // The moment about the rod hardly shows in headings; those across it do, and
  // all three are one log-Cholesky factor.
  const sysid::Model rod =
      Shipped("pendulum1", {},
              {{"link1.ixx", 0.02}, {"link1.iyy", 0.02}, {"link1.izz", 2e-4}});
  const Fit fit = FitRuns(
      rod,
      FreeFrom(rod,
               {{"link1.ixx", 0.02}, {"link1.iyy", 0.02}, {"link1.izz", 2e-4}}),
      {Simulated(rod, 6.0, 5)});
  EXPECT_TRUE(fit.converged) << fit.termination;
  EXPECT_TRUE(fit.parameters[0].identifiable);
  EXPECT_TRUE(fit.parameters[1].identifiable);
  EXPECT_NEAR(fit.parameters[0].value, 0.02, 1e-4);
  EXPECT_FALSE(fit.parameters[2].identifiable);
  EXPECT_TRUE(std::isnan(fit.parameters[2].std_error));
  EXPECT_THAT(fit.not_identifiable,
              testing::ElementsAre(testing::ElementsAre("link1.izz")));
}

// About y the moment about x does nothing: it stays where it is, and is named.
TEST(FitIdentifiability, NamesAParameterWithoutInfluence) {
  const Model start = Shipped("pendulum2_planar");
  const sysid::Run run = Simulated(start, 0.6, 13, 2.0);
  const double ixx = FindParameters(start, {"link2.ixx"}, "").front().nominal;
  const Fit fit = FitRuns(
      start, FreeFrom(start, {{"link1.length", 0.55}, {"link2.ixx", ixx}}),
      {run});
  EXPECT_TRUE(fit.converged) << fit.termination;
  const double length =
      FindParameters(start, {"link1.length"}, "").front().nominal;
  EXPECT_NEAR(EstimateOf(fit, "link1.length").value, length, 0.01);
  EXPECT_EQ(EstimateOf(fit, "link2.ixx").value, ixx);
  EXPECT_THAT(fit.not_identifiable, ElementsAre(ElementsAre("link2.ixx")));
}

TEST(FitIdentifiability, RefusesWhereNothingHasInfluence) {
  const Model start = Shipped("pendulum2_planar");
  const sysid::Run run = Simulated(start, 0.6, 13, 2.0);
  const double ixx = FindParameters(start, {"link2.ixx"}, "").front().nominal;
  const Fit one = FitRuns(start, FreeFrom(start, {{"link2.ixx", ixx}}), {run});
  EXPECT_FALSE(one.converged);
  EXPECT_EQ(one.termination,
            "parameter 'link2.ixx' without any influence on what was measured; "
            "fix it");
  const Fit two = FitRuns(
      start, FreeFrom(start, {{"link1.com_y", 0.0}, {"link2.ixx", ixx}}),
      {run});
  EXPECT_FALSE(two.converged);
  EXPECT_EQ(two.termination,
            "parameters 'link1.com_y', 'link2.ixx' without any influence on "
            "what was measured; fix them");
}

// A body of 1 kg on a hinge about an axis, with these moments.
Mechanism Rod(const Eigen::Vector3d& axis, const Eigen::Vector3d& moments) {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  Joint joint;
  joint.name = "hinge";
  joint.type = JointType::kRevolute;
  joint.parent_link = 0;
  joint.axis = axis;
  Inertial<double> body;
  body.mass = 1.0;
  body.com = Eigen::Vector3d(0, 0, -0.3);
  body.inertia = moments.asDiagonal();
  mechanism.AddJoint(joint, "rod", Eigen::Vector3d::Zero(), body);
  return mechanism;
}

// m g c / (m c^2 + I) and the sensor's offset show.
Model CompoundPendulum() {
  const Mechanism mechanism =
      Rod(Eigen::Vector3d::UnitY(), Eigen::Vector3d(0.05, 0.05, 0.01));
  Model model(mechanism);
  model.AddEffect(Catalogue().Make("sensor_offset@hinge", mechanism, ""));
  return model;
}

TEST(FitIdentifiability, NamesMassAndGravityOfASwingAndKeepsTheRestUsable) {
  Model planted = CompoundPendulum();
  planted.SetEffectParameter("hinge.sensor_offset", 0.03);
  const Fit fit = FitRuns(
      CompoundPendulum(),
      FreeFrom(
          CompoundPendulum(),
          {{"hinge.sensor_offset", 0.0}, {"rod.mass", 1.3}, {"gravity", 9.81}}),
      {Simulated(planted, 0.8, 14)});
  EXPECT_THAT(fit.not_identifiable,
              ElementsAre(UnorderedElementsAre("rod.mass", "gravity")));
  for (const char* name : {"rod.mass", "gravity"}) {
    EXPECT_FALSE(EstimateOf(fit, name).identifiable);
    EXPECT_TRUE(std::isnan(EstimateOf(fit, name).std_error));
    EXPECT_TRUE(std::isnan(EstimateOf(fit, name).ci95[0]));
  }
  const ParameterEstimate& offset = EstimateOf(fit, "hinge.sensor_offset");
  EXPECT_TRUE(offset.identifiable);
  EXPECT_LT(offset.std_error, 1e-3);
  EXPECT_LT(std::abs(Deviation(fit, {"hinge.sensor_offset", 0.03})), 4.0);
  EXPECT_NEAR(fit.train.total.normalized_rms, 1.0, 0.1);
}

TEST(FitIdentifiability, NamesTheMassesOfAPassiveDoublePendulum) {
  const Model start = Shipped("pendulum2_planar");
  const std::vector<Value> truth = {{"link1.length", 0.4}};
  const Fit fit = FitRuns(
      start,
      FreeFrom(
          start,
          {{"link1.mass", 1.2}, {"link2.mass", 0.9}, {"link1.length", 0.5}}),
      {Simulated(Shipped("pendulum2_planar", {}, truth), 0.6, 15)});
  EXPECT_THAT(fit.not_identifiable,
              ElementsAre(UnorderedElementsAre("link1.mass", "link2.mass")));
  EXPECT_LT(std::abs(Deviation(fit, truth[0])), 4.0);
  // Their ratio is known all the same.
  EXPECT_NEAR(
      EstimateOf(fit, "link1.mass").value / EstimateOf(fit, "link2.mass").value,
      1.0, 0.02);
}

TEST(FitIdentifiability, KnowsLessWhereTheModelMissesTheData) {
  const Model planted = Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                                {{"joint1.damping", 0.05}});
  const Model start = Shipped("pendulum2_planar");
  const Fit fit = FitRuns(start, FreeFrom(start, {{"link1.length", 0.55}}),
                          {Simulated(planted, 0.6, 16)});
  EXPECT_GT(fit.train.total.normalized_rms, 2.0);
  const Fit right = FitRuns(start, FreeFrom(start, {{"link1.length", 0.55}}),
                            {Simulated(start, 0.6, 16)});
  EXPECT_GT(EstimateOf(fit, "link1.length").std_error,
            1.5 * EstimateOf(right, "link1.length").std_error);
}

TEST(FitIdentifiability, NamesTheJointsThatCannotMove) {
  // Nothing has inertia about this hinge.
  const Model model(Rod(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Zero()));
  const sysid::Run run = Simulated(CompoundPendulum(), 0.5, 17, 2.0);
  const Fit fit = FitRuns(model, FreeFrom(model, {{"rod.mass", 1.0}}), {run});
  EXPECT_FALSE(fit.converged);
  EXPECT_THAT(TextsOf(SingularJoints(model)), ElementsAre(fit.termination));
}

TEST(FitIdentifiability, NamesALinkThatIsNoPossibleBody) {
  const Model model = CompoundPendulum();
  const sysid::Run run = Simulated(model, 0.5, 18, 2.0);
  const Fit fit = FitRuns(
      model, FreeFrom(model, {{"rod.iyy", 0.1}, {"gravity", 9.0}}), {run});
  EXPECT_FALSE(fit.converged);
  EXPECT_EQ(fit.termination,
            "link 'rod' is no possible body at the start: check its mass and "
            "its moments of inertia");
}

}  // namespace
}  // namespace sysid
