#include <gmock/gmock.h>

#include "models/effects/catalogue.h"
#include "models/urdf/load_urdf.h"
#include "models/urdf/write_urdf.h"
#include "sysid/exports/arrival.h"
#include "sysid/exports/write_mjcf.h"
#include "sysid/exports/write_sdf.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// The model with these effects at these values.
Model With(
    Model model,
    const std::vector<std::pair<std::string, std::vector<double>>>& effects) {
  for (const auto& [name, values] : effects) {
    const auto effect = Catalogue().Make(name, model.mechanism(), "test");
    model.AddEffect(effect);
    for (size_t k = 0; k < values.size(); ++k) {
      model.SetEffectParameter(effect->parameters()[k].name, values[k]);
    }
  }
  return model;
}

std::string Mjcf(const Model& model, const ExportData& data = {}) {
  return WriteMjcf(model, data, {}).text;
}

TEST(Arrival, EveryEffectOfTheCatalogueHasAPlaceOrAReasonInMjcf) {
  int count = 0;
  for (const char* const name : {"cartpole", "pendulum2"}) {
    const Model model = Shipped(name);
    for (const std::string& effect : Catalogue().Names(model.mechanism())) {
      const Model with = With(model, {{effect, {}}});
      for (const ArrivalRow& row : ArrivalRows(with, ExportFormat::kMjcf, {})) {
        EXPECT_TRUE(FindArrivalRule(ExportFormat::kMjcf,
                                    effect.substr(0, effect.find('@')),
                                    row.name) != nullptr)
            << row.name << " of " << effect;
        if (row.arrival == Arrival::kLost) {
          EXPECT_THAT(row.remark, Not(IsEmpty())) << row.name;
        } else {
          EXPECT_THAT(row.where, Not(IsEmpty())) << row.name;
        }
        ++count;
      }
    }
  }
  EXPECT_GT(count, 100);
  EXPECT_NE(FindArrivalRule(ExportFormat::kMjcf, "custom", "j.k"), nullptr);
}

TEST(Arrival, SaysWhatIsLost) {
  const Model model =
      With(Shipped("cartpole"), {{"stribeck_friction@hinge", {0.1, 0.2, 0.3}}});
  const auto rows = ArrivalRows(model, ExportFormat::kMjcf, {"pole.mass"});
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(rows[0].name, "hinge.friction");
  EXPECT_EQ(rows[0].arrival, Arrival::kArrived);
  EXPECT_EQ(rows[0].where, "joint 'hinge' frictionloss");
  EXPECT_EQ(rows[1].name, "hinge.static_friction");
  EXPECT_EQ(rows[1].value, 0.2);
  EXPECT_EQ(rows[1].arrival, Arrival::kLost);
  EXPECT_THAT(rows[1].remark, HasSubstr("frictionloss has one level"));
  EXPECT_EQ(rows[3].where, "body 'pole' inertial");
}

TEST(Arrival, FrictionOfBallsIsAnotherLaw) {
  const Model model = With(
      Shipped("pendulum1"),
      {{"coulomb_friction@joint1", {0.1}}, {"viscous_damping@joint1", {0.2}}});
  const auto mjcf = ArrivalRows(model, ExportFormat::kMjcf, {});
  EXPECT_EQ(mjcf[0].arrival, Arrival::kPartly);
  EXPECT_EQ(mjcf[1].arrival, Arrival::kArrived);
  const auto sdf = ArrivalRows(model, ExportFormat::kSdf, {});
  EXPECT_EQ(sdf[1].arrival, Arrival::kLost);
}

TEST(WriteMjcf, HasTheLawsOfAJoint) {
  const std::string text =
      Mjcf(With(Shipped("cartpole"), {{"viscous_damping@hinge", {0.25}},
                                      {"quadratic_drag@hinge", {0.5}},
                                      {"coulomb_friction@hinge", {0.125}},
                                      {"armature@hinge", {0.0625}},
                                      {"spring@hinge", {2.0, 0.375}},
                                      {"sensor_offset@hinge", {0.25}}}));
  EXPECT_THAT(text, HasSubstr("damping=\"0.25 0.5 0\""));
  EXPECT_THAT(text, HasSubstr("frictionloss=\"0.125\" "
                              "solreffriction=\"0.002 1\" "
                              "solimpfriction=\"0.9999 0.9999 0.001 0.5 2\""));
  EXPECT_THAT(text, HasSubstr("armature=\"0.0625\""));
  // qpos is what the sensor measures.
  EXPECT_THAT(text, HasSubstr("ref=\"0.25\""));
  EXPECT_THAT(text, HasSubstr("stiffness=\"2\" springref=\"0.625\""));
}

TEST(WriteMjcf, HasDrives) {
  ExportData data;
  data.driven = {"hinge"};
  const std::string text = Mjcf(
      With(Shipped("cartpole"), {{"position_drive@slider", {40.0, 3.0, 0.0105}},
                                 {"sensor_offset@slider", {0.5}},
                                 {"effort_gain@hinge", {0.25}},
                                 {"effort_bias@hinge", {0.75}},
                                 {"actuator_lag@hinge", {0.03}}}),
      data);
  EXPECT_THAT(text, HasSubstr("<general name=\"slider.cmd\" joint=\"slider\" "
                              "gainprm=\"40\" biastype=\"affine\" "
                              "biasprm=\"20 -40 -3\" forcerange=\"-50 50\" "
                              "delay=\"0.0105\" nsample=\"12\""));
  EXPECT_THAT(text, HasSubstr("<general name=\"hinge.tau\" joint=\"hinge\" "
                              "gainprm=\"1.25\" dyntype=\"filterexact\" "
                              "dynprm=\"0.03\" biastype=\"affine\" "
                              "biasprm=\"0.75 0 0\""));
  EXPECT_THAT(text, Not(HasSubstr("hinge.effort_bias")));
}

TEST(WriteMjcf, LimitsDoNotActWhereTheRecordingIsBeyondThem) {
  const Model model = Shipped("cartpole");
  EXPECT_THAT(Mjcf(model), HasSubstr("range=\"-2 2\" limited=\"true\""));
  ExportData data;
  data.beyond_limits = {"slider"};
  const ExportText text = WriteMjcf(model, data, {});
  EXPECT_THAT(text.text, HasSubstr("range=\"-2 2\" limited=\"false\""));
  EXPECT_THAT(text.notes,
              testing::Contains(HasSubstr("'slider' was recorded beyond")));
}

TEST(WriteMjcf, RefusesTheInertiaOfNoBody) {
  Model model = Shipped("cartpole");
  MechanismParameters<double> values = model.nominal();
  const int pole = model.mechanism().FindLink("pole");
  values.links[pole].inertia =
      Eigen::Vector3d(0.1, 0.1, 0.3).asDiagonal().toDenseMatrix();
  model.SetNominal(values);
  const ExportText text = WriteMjcf(model, {}, {});
  EXPECT_THAT(text.text, IsEmpty());
  EXPECT_THAT(text.why_not, HasSubstr("the inertia of pole is that of no body "
                                      "(principal moments 0.1 0.1 0.3 kg m^2"));
}

TEST(WriteSdf, HasDynamicsAndDrakesRotors) {
  const std::string text =
      WriteSdf(With(Shipped("cartpole"), {{"viscous_damping@hinge", {0.25}},
                                          {"coulomb_friction@hinge", {0.125}},
                                          {"spring@hinge", {2.0, 0.375}},
                                          {"armature@hinge", {0.0625}}}),
               {}, {"a comment -- with hyphens"})
          .text;
  EXPECT_THAT(text, HasSubstr("<damping>0.25</damping>"));
  EXPECT_THAT(text, HasSubstr("<friction>0.125</friction>"));
  EXPECT_THAT(text, HasSubstr("<spring_reference>0.375</spring_reference>"));
  EXPECT_THAT(text, HasSubstr("<spring_stiffness>2</spring_stiffness>"));
  EXPECT_THAT(text,
              HasSubstr("<drake:rotor_inertia>0.0625</drake:rotor_inertia>"));
  EXPECT_THAT(text, HasSubstr("<!-- sysid: a comment - - with hyphens -->"));
}

TEST(WriteUrdf, HasDrakesRotorsForTheGearThatIsThere) {
  const std::string urdf = WriteUrdf(Shipped("cartpole"));
  const size_t end = urdf.find("</robot>");
  const std::string with_gear =
      urdf.substr(0, end) +
      "<transmission name=\"t\"><joint name=\"hinge\"/><actuator name=\"m\">"
      "<drake:gear_ratio value=\"10\"/></actuator></transmission></robot>";
  const Model geared =
      With(Model(LoadUrdfText(with_gear, "test")), {{"armature@hinge", {2.0}}});
  const std::string text = WriteUrdf(geared);
  EXPECT_THAT(text, HasSubstr("<drake:rotor_inertia value=\"0.02\" />"));
  // Writing twice adds nothing.
  const Model again =
      With(Model(LoadUrdfText(text, "test")), {{"armature@hinge", {2.0}}});
  EXPECT_EQ(WriteUrdf(again), text);
  const Model plain = With(Shipped("cartpole"), {{"armature@slider", {2.0}}});
  EXPECT_THAT(WriteUrdf(plain),
              HasSubstr("<drake:rotor_inertia value=\"2\" />"));
}

}  // namespace
}  // namespace sysid
