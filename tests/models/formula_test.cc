#include "models/formula/formula.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "models/scalars.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;

const std::vector<KnownName>& Known() {
  static const auto& known =
      *new std::vector<KnownName>{{"q", "rad"},
                                  {"qd", "rad/s"},
                                  {"t", "s"},
                                  {"joint2.q", "rad"},
                                  {"joint2.qd", "rad/s"},
                                  {"my joint.q", "rad"},
                                  {"arm-1.q", "rad"},
                                  {"temperature", "degC"},
                                  {"joint1.cmd", ""},
                                  {"min", "A"},
                                  {"1e3", "A"},
                                  {"ratio", "-"}};
  return known;
}

Formula Parsed(const std::string& text) {
  Formula formula;
  FormulaFault fault;
  EXPECT_TRUE(ParseFormula(text, Known(), "N m", &formula, &fault))
      << text << ": " << fault.what;
  return formula;
}

// Of a formula of q and then of the parameters a and b, in this order.
template <typename T>
T Value(const Formula& formula, T q, T a, T b) {
  std::vector<T> names(formula.known.size(), q);
  for (const std::string& name : formula.parameters) {
    names.push_back(name == "a" ? a : b);
  }
  std::vector<T> scratch(formula.tree.size());
  return formula.tree.Evaluate(names.data(), scratch.data());
}

// A formula of q, a and b, and the same in C++ for any scalar.
struct Law {
  std::string text;
  double (*value)(double, double, double);
  Jet8 (*jet)(Jet8, Jet8, Jet8);
};
#define LAW(text, ...)                               \
  Law {                                              \
    text,                                            \
        [](double q, double a, double b) -> double { \
          (void)q, (void)a, (void)b;                 \
          return __VA_ARGS__;                        \
        },                                           \
        [](Jet8 q, Jet8 a, Jet8 b) -> Jet8 {         \
          (void)q, (void)a, (void)b;                 \
          return __VA_ARGS__;                        \
        }                                            \
  }

const std::vector<Law>& Laws() {
  using std::abs, std::acos, std::asin, std::atan, std::atan2, std::cos,
      std::cosh, std::exp, std::hypot, std::log, std::pow, std::sin, std::sinh,
      std::sqrt, std::tan, std::tanh;
  static const auto& laws = *new std::vector<Law>{
      LAW("-a*q^3 - b*abs(q)*q", -a * q * q * q - b * abs(q) * q),
      LAW("-q^2*a", -(q * q) * a),
      LAW("(-q)^2*a", q * q * a),
      LAW("a*2^3^2", a * 512.0),
      LAW("q/a/b", q / a / b),
      LAW("q - a - b", q - a - b),
      LAW("a*q^-2", a / (q * q)),
      LAW("a*q^13", a * pow(q, 13.0)),
      LAW("a*q^0", a),
      LAW("a*q^1", a * q),
      LAW("a*abs(q)^1.5", a * pow(abs(q), 1.5)),
      LAW("a*abs(q)^b", a * pow(abs(q), b)),
      LAW("2^(a*q)", exp(a * q * log(2.0))),
      LAW("a*sqrt(q^2+1)", a * sqrt(q * q + 1.0)),
      LAW("a*exp(-q^2)+b*log(2+q/9)", a * exp(-q * q) + b * log(2.0 + q / 9.0)),
      LAW("a*sin(q+b)+cos(q)+tan(b*q)", a * sin(q + b) + cos(q) + tan(b * q)),
      LAW("a*asin(q/9)-acos(q/9)+atan(b*q)",
          a * asin(q / 9.0) - acos(q / 9.0) + atan(b * q)),
      LAW("sinh(a*q)+cosh(b*q)+tanh(q/a)",
          sinh(a * q) + cosh(b * q) + tanh(q / a)),
      LAW("min(a, q)+max(b, q)", (q < a ? q : a) + (q > b ? q : b)),
      LAW("atan2(a, q)+hypot(q, b)", atan2(a, q) + hypot(q, b)),
      LAW("a*sign(q)", q > 0.0 ? a : -a),
      LAW("a*pi/180*1e1", a * M_PI / 180.0 * 10.0),
  };
  return laws;
}

Jet8 Variable(double value, int i) { return Jet8(value, i); }

TEST(FormulaTest, HasTheValueAndDerivativesOfTheSameCode) {
  for (const Law& law : Laws()) {
    const Formula formula = Parsed(law.text);
    for (const double q : {-2.5, -1.0, -0.3, 0.7, 2.0}) {
      const double a = 1.3, b = 0.4;
      const double value = law.value(q, a, b);
      EXPECT_NEAR(Value(formula, q, a, b), value, 1e-14 * std::abs(value))
          << law.text << " at " << q;
      const Jet8 want = law.jet(Variable(q, 0), Variable(a, 1), Variable(b, 2));
      const Jet8 jet =
          Value(formula, Variable(q, 0), Variable(a, 1), Variable(b, 2));
      EXPECT_NEAR(jet.a, value, 1e-14 * std::abs(value)) << law.text;
      for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(jet.v[i], want.v[i], 1e-13 * (1 + std::abs(want.v[i])))
            << law.text << " at " << q << " by " << i;
      }
    }
  }
}

TEST(FormulaTest, HasFiniteDerivativesWhereTheValueIsFinite) {
  const struct {
    std::string text;
    double q, value, by_q, by_a, by_b;  // at a = 1, b = 2
  } cases[] = {
      {"a*q^2", 0, 0, 0, 0, 0},
      {"a*q^3", 0, 0, 0, 0, 0},
      {"a*q^1", 0, 0, 1, 0, 0},
      {"a*q^0", 0, 1, 0, 1, 0},
      {"a*q^3", -1, -1, 3, -1, 0},
      {"a*q^-3", -1, -1, -3, -1, 0},
      {"a*q^b", 0, 0, 0, 0, 0},
      {"b*q^a", 0, 0, 2, 0, 0},
      {"a*q^0.5", 0, 0, 0, 0, 0},
      {"a*q^(b-b+2)", 0, 0, 0, 0, 0},
      {"a*abs(q)", 0, 0, 1, 0, 0},
      {"a*sign(q)", 0, 0, 0, 0, 0},
      {"a*abs(q)*q", 0, 0, 0, 0, 0},
      {"a*sqrt(q)", 0, 0, 0, 0, 0},
      {"a*hypot(q, q)", 0, 0, 0, 0, 0},
      {"a*hypot(q, b)", 0, 2, 0, 2, 1},
      {"a*atan2(q, q)", 0, 0, 0, 0, 0},
      {"a*asin(q)", 1, M_PI / 2, 0, M_PI / 2, 0},
      {"a*acos(q)", -1, M_PI, 0, M_PI, 0},
      {"a*min(q, q)", 0, 0, 1, 0, 0},
      {"a*tanh(q/b)", 0, 0, 0.5, 0, 0},
  };
  for (const auto& c : cases) {
    const Jet8 jet = Value(Parsed(c.text), Variable(c.q, 0), Variable(1.0, 1),
                           Variable(2.0, 2));
    EXPECT_DOUBLE_EQ(jet.a, c.value) << c.text;
    EXPECT_DOUBLE_EQ(jet.v[0], c.by_q) << c.text;
    EXPECT_DOUBLE_EQ(jet.v[1], c.by_a) << c.text;
    EXPECT_DOUBLE_EQ(jet.v[2], c.by_b) << c.text;
  }
  for (const std::string text :
       {"a*sqrt(q)", "a*log(q)", "a*q^0.5", "a*min(sqrt(q), 1)",
        "a*max(1, sqrt(q))", "a*sign(sqrt(q))"}) {
    EXPECT_TRUE(std::isnan(Value(Parsed(text), -1.0, 1.0, 2.0))) << text;
  }
}

TEST(FormulaTest, NamesAreKnownOrParameters) {
  const struct {
    std::string text;
    std::vector<int> known;
    std::vector<std::string> parameters;
  } cases[] = {
      {"k*qd + c*q + k*qd", {1, 0}, {"k", "c"}},
      {"k*(q-joint2.q)", {0, 3}, {"k"}},
      {"k*'my joint.q' - \"joint2.qd\"", {5, 4}, {"k"}},
      {"k*my joint.q", {5}, {"k"}},
      {"k*arm-1.q", {6}, {"k"}},
      {"k*q2+qdd", {}, {"k", "q2", "qdd"}},
      {"k*min - min(q, k2)", {9, 0}, {"k", "k2"}},
      {"k*'1e3' + 1e3", {10}, {"k"}},
      {"_a1*pi + e", {}, {"_a1", "e"}},
      {"phi - pi", {}, {"phi"}},
  };
  for (const auto& c : cases) {
    const Formula formula = Parsed(c.text);
    EXPECT_EQ(formula.known, c.known) << c.text;
    EXPECT_EQ(formula.parameters, c.parameters) << c.text;
  }
  // The names of the tree are the known ones, then the parameters.
  const Formula formula = Parsed("k*qd - c*q");
  std::vector<double> names = {2, 3, 5, 7}, scratch(formula.tree.size());
  EXPECT_EQ(formula.tree.Evaluate(names.data(), scratch.data()),
            5.0 * 2 - 7.0 * 3);
}

TEST(FormulaTest, UnitsFollowFromTheFormula) {
  const struct {
    std::string text;
    std::vector<std::string> units;
  } cases[] = {
      {"-k*q^3", {"N m/rad^3"}},
      {"-b*qd", {"N m s/rad"}},
      {"-c*tanh(qd/v)", {"N m", "rad/s"}},
      {"-b*abs(qd)*qd", {"N m s^2/rad^2"}},
      {"a*sin(n*q+phi)", {"N m", "-", "rad"}},
      {"a*sin(q)", {"N m"}},
      {"a*sin(w*t)", {"N m", "rad/s"}},
      {"a*sin(2*pi*f*t)", {"N m", "1/s"}},
      {"a*sin(2*pi*t/T + phi)", {"N m", "s", "rad"}},
      {"a*sin(t)", {"N m"}},
      {"c*2/pi*atan(qd/v)", {"N m", "rad/s"}},
      {"k*(q-0.3)", {"N m/rad"}},
      {"k*(q-q0)", {"N m/rad", "rad"}},
      {"-2*k*q + 0.5*qd", {"N m/rad"}},
      {"k*min(0, q-gap)", {"N m/rad", "rad"}},
      {"c*(1-exp(-abs(qd)/v))", {"N m", "rad/s"}},
      {"c*exp(-(qd/v)^2)*sign(qd)", {"N m", "rad/s"}},
      {"b*abs(qd)^n", {"", "-"}},
      {"b*(abs(qd)/v)^n", {"N m", "rad/s", "-"}},
      {"b*abs(qd)^0.5", {"N m s^0.5/rad^0.5"}},
      {"b*sqrt(abs(qd))", {"N m s^0.5/rad^0.5"}},
      {"k*(q-atan(t/T))", {"N m/rad", "s"}},
      {"k*atan2(q, d)", {"N m", "rad"}},
      {"c*(temperature-20)", {"N m/degC"}},
      {"c*(temperature-20)*qd", {"N m s/(degC rad)"}},
      {"g*joint1.cmd", {""}},
      {"g*ratio", {"N m"}},
      {"a*b*q", {"", ""}},
      {"a*q + qd", {""}},
  };
  for (const auto& c : cases) {
    EXPECT_EQ(Parsed(c.text).units, c.units) << c.text;
  }
  Formula formula;
  FormulaFault fault;
  ASSERT_TRUE(ParseFormula(
      "k*x + m*x/(u*w) + k*z^2/z",
      {{"x", "m"}, {"u", "N m/(rad s)"}, {"w", "m/s^2"}, {"z", "m"}}, "N",
      &formula, &fault));
  EXPECT_THAT(formula.units, ElementsAre("N/m", "N^2 m/(rad s^3)"));
  // More unknowns than a person would write.
  std::string text = "k";
  for (int i = 0; i < 120; ++i) text += "+1";
  EXPECT_THAT(Parsed("(" + text + ")*q").units, ElementsAre(""));
}

TEST(FormulaTest, SaysWhatIsWrongAndWhere) {
  const std::string law =
      "write a law such as -k*q^3 or -c*tanh(qd/v); put odd names in quotes";
  const std::string known =
      "known: q, qd, t, joint2.q, joint2.qd, my joint.q, arm-1.q, "
      "temperature, joint1.cmd, min, 1e3, ratio";
  const struct {
    std::string text;
    size_t at;
    std::string what, hint;
  } cases[] = {
      {"", 0, "a name, a number or '(' is expected at its end", law},
      {"k*", 2, "a name, a number or '(' is expected at its end", law},
      {"k*/q", 2, "a name, a number or '(' is expected before '/'", law},
      {"k*$q", 2, "a name, a number or '(' is expected before '$q'", law},
      {"k*#", 2, "a name, a number or '(' is expected before '#'", law},
      {"k q", 2, "an operator (+ - * / ^) is expected before 'q'", law},
      {"2q", 1, "an operator (+ - * / ^) is expected before 'q'", law},
      {"k*1.2.3", 5, "an operator (+ - * / ^) is expected before '.3'", law},
      {"k, q", 1, "an operator (+ - * / ^) is expected before ', q'", law},
      {"q(k)", 1, "an operator (+ - * / ^) is expected before '(k)'", law},
      {"k*1e999", 2, "a number that is too large or too small", law},
      {"k*.", 2, "'.' is no number", law},
      {"(k q)", 3, "an operator (+ - * / ^) or ')' is expected before 'q)'",
       law},
      {"-(k*q", 1, "a '(' that is not closed", law},
      {"k*q)", 3, "a ')' that closes nothing", law},
      {"k*'q", 2, "a quotation mark that is not closed", law},
      {"k*0", 1, "a factor that is zero", "leave the term out"},
      {"k/(1-1)", 1, "a division by zero", law},
      {"k*log(0)", 2, "a number that is not finite", law},
      {"k*sin(q", 5, "a '(' that is not closed", law},
      {"k*sin(q, t)", 2, "sin takes one argument, and not 2", law},
      {"k*atan2(q)", 2,
       "atan2 takes two arguments, such as atan2(a, b), and not 1", law},
      {"k*min(q t)", 8,
       "an operator (+ - * / ^), ',' or ')' is expected before 't)'", law},
      {"k*tanhh(q)", 2, "no function 'tanhh'", "did you mean 'tanh'?"},
      {"k (q-1)", 0, "no function 'k'",
       "write '*' before '(' for a product; functions: abs, sign, sqrt, exp, "
       "log, sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, min, max, "
       "atan2, hypot"},
      {"k*sin", 2, "'sin' is a function, and has no argument",
       "write sin(...), or give the parameter another name"},
      {"k*joint9.q", 2, "no input or joint 'joint9.q'",
       "did you mean 'joint2.q'?"},
      {"k*'elbow.qd'", 2, "no input or joint 'elbow.qd'", known},
      {"-q^3", 0, "nothing to estimate: '-q^3' has no parameter",
       "a name that is not known is a parameter, such as k in k*q"},
      {"k*" + std::string(51, '('), 52,
       "more than 50 signs and parentheses in each other", law},
  };
  for (const auto& c : cases) {
    Formula formula;
    FormulaFault fault;
    ASSERT_FALSE(ParseFormula(c.text, Known(), "N m", &formula, &fault))
        << c.text;
    EXPECT_EQ(fault.what, c.what) << c.text;
    EXPECT_EQ(fault.hint, c.hint) << c.text;
    EXPECT_EQ(fault.at, c.at) << c.text;
  }
  Formula formula;
  FormulaFault fault;
  ASSERT_FALSE(ParseFormula("2", {}, "N m", &formula, &fault));
  EXPECT_EQ(fault.hint, "a name is a parameter, such as k in k*2");
  std::string powers = "k", sum = "k";
  for (int i = 0; i < 51; ++i) powers += "^q";
  for (int i = 0; i < 1000; ++i) sum += "+k";
  ASSERT_FALSE(ParseFormula(powers, Known(), "N m", &formula, &fault));
  EXPECT_EQ(fault.what,
            "more than 50 powers, signs and parentheses in each other");
  ASSERT_FALSE(ParseFormula(sum, Known(), "N m", &formula, &fault));
  EXPECT_EQ(fault.what, "more than 1000 operations");
}

TEST(FormulaTest, PointsAtTheCharacter) {
  EXPECT_EQ(PointedAt("-c*tanhh(qd/v)", 3), "  -c*tanhh(qd/v)\n     ^");
  EXPECT_EQ(PointedAt("k*", 2), "  k*\n    ^");
  EXPECT_EQ(PointedAt("k\t*\n\x1b'\xC3\xBC' $", 10),
            "  k * ?'\xC3\xBC' $\n           ^");
  EXPECT_EQ(PointedAt(std::string(60, 'a') + "$" + std::string(60, 'b'), 60),
            "  ..." + std::string(48, 'a') + "$" + std::string(23, 'b') +
                "...\n  " + std::string(51, ' ') + "^");
}

}  // namespace
}  // namespace sysid
