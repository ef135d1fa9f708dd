#include "models/effects/custom_law.h"

#include <gmock/gmock.h>

#include <cmath>

#include "models/effects/catalogue.h"
#include "models/error.h"
#include "models/model.h"
#include "tests/support/all_joints.h"
#include "tests/support/error_text.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::shared_ptr<const Effect> Typed(const std::string& name) {
  Mechanism mechanism = AllJoints();
  mechanism.inputs = {"wind"};
  return Catalogue().Make(name, mechanism, "--add");
}

std::string Fault(const std::string& name) {
  return ErrorText([&] { Typed(name); });
}

// What of its parameters starts at zero, and what is searched.
TEST(CustomLaw, IsOffByTheParametersInWhichItIsLinear) {
  struct Case {
    const char* law;
    std::vector<std::string> linear, searched;
  };
  for (const Case& c : std::vector<Case>{
           {"-k*q^3 - b*abs(qd)*qd", {"hinge.k", "hinge.b"}, {}},
           {"-c*tanh(qd/v)", {"hinge.c"}, {"hinge.v"}},
           {"k*(q0 - q)", {"hinge.k"}, {"hinge.q0"}},
           {"-(c + (s - c)*exp(-(qd/v)^2))*tanh(qd/0.01)",
            {"hinge.c", "hinge.s"},
            {"hinge.v"}},
           {"a*sin(n*q + phi)", {"hinge.a"}, {"hinge.n", "hinge.phi"}},
           {"k*asin(q)", {"hinge.k"}, {}},
           {"-c*qd/(abs(qd) + v)", {"hinge.c"}, {"hinge.v"}},
           {"a/(q - q0)^2", {"hinge.a"}, {"hinge.q0"}},
           {"k*sqrt(r^2 - q^2)", {"hinge.k"}, {"hinge.r"}},
           {"-k*max(0, q - g)", {"hinge.k"}, {"hinge.g"}},
           {"k*max(0, -q - g)", {"hinge.k"}, {"hinge.g"}}}) {
    SCOPED_TRACE(c.law);
    const auto effect = Typed(std::string("custom@hinge: ") + c.law);
    std::vector<std::string> linear, searched;
    for (const EffectParameter& p : effect->parameters()) {
      (p.grid.empty() ? linear : searched).push_back(p.name);
      EXPECT_EQ(p.null_value, p.grid.empty() ? 0.0 : 1.0);
      EXPECT_EQ(p.lower, p.name == "hinge.v" ? 1e-3 : -INFINITY) << p.name;
    }
    EXPECT_EQ(linear, c.linear);
    EXPECT_EQ(searched, c.searched);
    EXPECT_EQ(effect->name(), std::string("custom@hinge: ") + c.law);
  }
}

TEST(CustomLaw, SaysWhatItReads) {
  const auto effect = Typed(
      "custom@hinge: a*tau + b*slide.q*wheel.qd + c*t + d*hinge.cmd + "
      "e*wind*hinge.q");
  EXPECT_NE(effect->hooks() & kReadsEffort, 0u);
  EXPECT_TRUE(effect->NeedsDrive());
  std::vector<std::string> inputs;
  for (const EffectInput& input : effect->inputs()) {
    inputs.push_back(input.name);
  }
  EXPECT_THAT(inputs, ElementsAre("t", "hinge.cmd", "wind"));
  EXPECT_EQ(effect->other_joints().size(), 2u);
  EXPECT_FALSE(Typed("custom@hinge: -k*q")->ReadsMore());
}

TEST(CustomLaw, HasUnitsThatFollowFromTheLaw) {
  const auto effect = Typed("custom@hinge: -k*q^3 - b*abs(qd)*qd");
  EXPECT_EQ(effect->parameters()[0].unit, "N m/rad^3");
  EXPECT_EQ(effect->parameters()[1].unit, "N m s^2/rad^2");
}

TEST(CustomLaw, IsTheValueOfItsFormula) {
  const auto effect =
      Typed("custom@hinge: -k*q*tau + b*slide.qd^2*wind - c*wheel.q");
  const Mechanism mechanism = AllJoints();
  std::vector<double> q(mechanism.nq, 0.0), qd(mechanism.nv, 0.0);
  const auto joint = [&](const char* name) {
    return mechanism.joints[mechanism.FindJoint(name)];
  };
  q[joint("hinge").q_index] = 2.0;
  q[joint("wheel").q_index] = 7.0;
  qd[joint("slide").v_index] = 3.0;
  const double effort = 5.0, wind = 11.0;
  const double p[3] = {0.1, 0.01, 0.001};
  double tau = 1.0;
  effect->HooksFor(ScalarTag<double>())
      .AddEffort(
          {JointType::kRevolute, 1, &q[joint("hinge").q_index],
           &qd[joint("hinge").v_index], &effort, &wind, q.data(), qd.data()},
          p, &tau);
  EXPECT_NEAR(tau, 1.0 - 0.1 * 10 + 0.01 * 9 * 11 - 0.001 * 7, 1e-15);
}

TEST(CustomLaw, HasParametersOfItsOwn) {
  Model model(AllJoints());
  const auto add = [&](const std::string& name) {
    return ErrorText([&] {
      model.AddEffect(Catalogue().Make(name, model.mechanism(), ""), "--add");
    });
  };
  EXPECT_EQ(add("custom@hinge: -x*q"),
            "--add: custom@hinge: -x*q: hinge.x is a parameter of the "
            "mechanism already\n  hint: call it otherwise, such as x1");
  model.AddEffect(
      Catalogue().Make("coulomb_friction@hinge", model.mechanism(), ""));
  // Another law, though one of its names is friction's.
  const std::string law = "custom@hinge: -friction*q - k*q^3";
  EXPECT_EQ(add(law), "--add: " + law +
                          " shares parameters with coulomb_friction@hinge, "
                          "which is in the model already\n"
                          "  hint: leave one of them out");
}

TEST(CustomLaw, IsRefusedWithTheCharacterAndAHint) {
  EXPECT_EQ(Fault("custom@hinge"),
            "--add: effect 'custom@hinge' has no law\n"
            "  hint: write it behind a colon: 'custom@hinge: -k*q^3'");
  EXPECT_THAT(Fault("custom@hinge: "), ::testing::HasSubstr("has no law"));
  EXPECT_EQ(
      Fault("custom@hinge: -k*q +"),
      "--add: effect 'custom@hinge: -k*q +': character 7: a name, a "
      "number or '(' is expected at its end\n"
      "  -k*q +\n"
      "        ^\n"
      "  hint: write a law such as -k*q^3 or -c*tanh(qd/v); put odd names "
      "in quotes");
  EXPECT_EQ(
      Fault("custom@hinge: -k*ghost.q"),
      "--add: effect 'custom@hinge: -k*ghost.q': character 4: no input or "
      "joint 'ghost.q'\n"
      "  -k*ghost.q\n"
      "     ^\n"
      "  hint: known: q, qd, tau, t, slide.q, slide.qd, slide.cmd, "
      "slide.temperature, hinge.q, hinge.qd, hinge.cmd, "
      "hinge.temperature, wheel.q, wheel.qd, wheel.cmd, "
      "wheel.temperature, base.ax, base.px, base.ay, base.py, base.az, "
      "base.pz, wind");
  EXPECT_EQ(
      Fault("custom@hinge: -k*sine(q)"),
      "--add: effect 'custom@hinge: -k*sine(q)': character 4: no function "
      "'sine'\n"
      "  -k*sine(q)\n"
      "     ^\n"
      "  hint: did you mean 'sin'?");
  EXPECT_EQ(
      Fault("custom@hinge: q^2"),
      "--add: effect 'custom@hinge: q^2': character 1: nothing to "
      "estimate: 'q^2' has no parameter\n"
      "  q^2\n"
      "  ^\n"
      "  hint: a name that is not known is a parameter, such as k in k*q");
  EXPECT_EQ(Fault("custom@hinge: -I*qdd"),
            "--add: effect 'custom@hinge: -I*qdd': a law may not read qdd, the "
            "acceleration that it makes\n"
            "  hint: an inertia on the joint is armature@hinge");
  EXPECT_EQ(
      Fault("custom@hinge: exp(k*q)"),
      "--add: effect 'custom@hinge: exp(k*q)': no value of its parameters "
      "makes the law zero\n"
      "  hint: give it a factor, as a in a*(exp(k*q))");
  EXPECT_THAT(Fault("custom@hinge: max(0, -50*q - g)"),
              ::testing::HasSubstr("no value of its parameters makes"));
  EXPECT_EQ(
      Fault("custom@hinge: a*b*c*d*e*f*g*h*i*j*l*m*n"),
      "--add: effect 'custom@hinge: a*b*c*d*e*f*g*h*i*j*l*m*n': more than "
      "12 parameters\n"
      "  hint: leave terms out");
  EXPECT_EQ(Fault("custom@ball: -k*q"),
            "--add: effect 'custom' has no meaning on the spherical joint "
            "'ball'\n"
            "  hint: it acts on: slide, hinge, wheel");
  EXPECT_EQ(Fault("custom@hinges: -k*q"),
            "--add: effect 'custom': unknown target 'hinges'\n"
            "  hint: did you mean 'hinge'?");
}

}  // namespace
}  // namespace sysid
