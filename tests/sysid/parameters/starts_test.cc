#include "sysid/parameters/starts.h"

#include <gmock/gmock.h>

#include "models/dynamics.h"
#include "models/find_model.h"
#include "models/physical.h"
#include "models/urdf/load_urdf.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

Model Pendulum() { return Model(LoadUrdf(FindModel("pendulum2_planar"))); }

// Of its last link.
const Inertial<double>& Last(const Model& model) {
  return model.nominal().links[model.mechanism().joints[1].child_link];
}

// That link without inertia.
Model WithoutInertia(double mass) {
  Model model = Pendulum();
  MechanismParameters<double> values = model.nominal();
  Inertial<double> body;
  body.mass = mass;
  values.links[model.mechanism().joints[1].child_link] = body;
  model.SetNominal(values);
  return model;
}

TEST(AssumeInertia, GivesWhatLeavesAJointNothingToMoveThatOfABall) {
  Model model = WithoutInertia(0.5);
  ASSERT_FALSE(SingularJoints(model).empty());
  std::vector<std::string> notices, assumed;
  const Model start = AssumeInertia({}, &model, &assumed, &notices);
  EXPECT_THAT(SingularJoints(start), IsEmpty());
  EXPECT_THAT(SingularJoints(model), IsEmpty());
  EXPECT_EQ(Last(model).mass, 0.5);
  EXPECT_TRUE(CanStart(Last(model).inertia));
  EXPECT_THAT(notices, ElementsAre(HasSubstr("link2 has no inertia")));
  EXPECT_THAT(assumed,
              ElementsAre(StartsWith("link2.ixx="), StartsWith("link2.iyy="),
                          StartsWith("link2.izz=")));
}

TEST(AssumeInertia, GivesALinkWithoutMassTheLightestOne) {
  Model model = WithoutInertia(0.0);
  std::vector<std::string> notices, assumed;
  AssumeInertia({}, &model, &assumed, &notices);
  EXPECT_EQ(Last(model).mass,
            StartingMass(model.mechanism(), WithoutInertia(0.0).nominal()));
  EXPECT_THAT(SingularJoints(model), IsEmpty());
}

TEST(AssumeInertia, LeavesAModelThatCanMove) {
  Model model = Pendulum();
  const Eigen::Matrix3d before = Last(model).inertia;
  std::vector<std::string> notices, assumed;
  AssumeInertia({}, &model, &assumed, &notices);
  EXPECT_EQ(Last(model).inertia, before);
  EXPECT_THAT(notices, IsEmpty());
}

}  // namespace
}  // namespace sysid
