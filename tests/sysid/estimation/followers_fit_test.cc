#include <gmock/gmock.h>

#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

// An arm that swings, and at its end a gripper: the right finger follows the
// left one the other way, with a knuckle that follows the right.
constexpr char kArm[] = R"(<robot name="arm">
  <link name="base"/>
  <link name="forearm"><inertial><mass value="1"/><origin xyz="0 0 -0.2"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.002" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
  <link name="left"><inertial><mass value="0.2"/><origin xyz="0 0.02 -0.1"/>
    <inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
  <link name="right"><inertial><mass value="0.2"/><origin xyz="0 -0.02 -0.1"/>
    <inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
  <link name="tip"><inertial><mass value="0.1"/><origin xyz="0 0 -0.05"/>
    <inertia ixx="2e-4" iyy="2e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
  <joint name="elbow" type="continuous">
    <parent link="base"/><child link="forearm"/><axis xyz="0 1 0"/>
    <dynamics damping="0.05"/>
  </joint>
  <joint name="right_finger" type="continuous">
    <parent link="forearm"/><child link="right"/><axis xyz="1 0 0"/>
    <origin xyz="0 -0.03 -0.4"/><dynamics damping="0.01"/>
    <mimic joint="left_finger" multiplier="-1" offset="0.1"/>
  </joint>
  <joint name="left_finger" type="continuous">
    <parent link="forearm"/><child link="left"/><axis xyz="1 0 0"/>
    <origin xyz="0 0.03 -0.4"/>
  </joint>
  <joint name="knuckle" type="continuous">
    <parent link="right"/><child link="tip"/><axis xyz="1 0 0"/>
    <origin xyz="0 0 -0.2"/>
    <mimic joint="right_finger" multiplier="2"/>
  </joint>
</robot>)";

TEST(FollowersFit, FindsAMassAndADampingOfAFinger) {
  const Model model = MakeModel(LoadUrdfText(kArm, "arm.urdf"), Catalogue());
  ASSERT_EQ(model.nv(), 2);
  Model truth = model;
  Set({{"right.mass", 0.35}, {"right_finger.damping", 0.03}}, &truth);
  SimulationOptions simulation;
  simulation.noise = 1e-3;
  simulation.duration = 2.0;
  simulation.rate = 50.0;
  simulation.excitation = Excitation::kMultisine;
  const sysid::Run run =
      Simulate(truth, RandomState(truth, 0.8, 1), simulation);
  ASSERT_EQ(run.channels.size(), 2u);
  EstimationOptions options;
  options.noise = 1e-3;
  const Fit fit = FitRuns(
      model,
      FreeFrom(model, {{"right.mass", 0.2}, {"right_finger.damping", 0.01}}),
      {run}, options);
  ASSERT_TRUE(fit.converged) << fit.termination;
  EXPECT_NEAR(fit.train.total.normalized_rms, 1.0, 0.1);
  EXPECT_NEAR(EstimateOf(fit, "right.mass").value, 0.35, 0.01);
  EXPECT_NEAR(EstimateOf(fit, "right_finger.damping").value, 0.03, 0.002);
}

}  // namespace
}  // namespace sysid
