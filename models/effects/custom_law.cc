#include "models/effects/custom_law.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "models/error.h"

namespace sysid {
namespace {

std::string WithoutBlanks(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t\n");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t\n") - first + 1);
}

// Of any order from 0.05 to 20.
double DrawSize(std::mt19937_64* random) {
  return std::exp(std::uniform_real_distribution<double>(-3.0, 3.0)(*random));
}

// Evaluates a formula at any values.
class Law {
 public:
  explicit Law(const Formula& formula)
      : formula_(formula),
        names_(formula.known.size() + formula.parameters.size()),
        scratch_(formula.tree.size()) {}

  // Draws what the law reads, of either sign.
  void Draw(std::mt19937_64* random) {
    for (size_t i = 0; i < formula_.known.size(); ++i) {
      names_[i] = (*random)() % 2 == 0 ? DrawSize(random) : -DrawSize(random);
    }
  }
  double At(const std::vector<double>& p) {
    std::copy(p.begin(), p.end(), names_.begin() + formula_.known.size());
    return formula_.tree.Evaluate<double>(names_.data(), scratch_.data());
  }

 private:
  const Formula& formula_;
  std::vector<double> names_, scratch_;
};

// Whether the law is linear in these of its parameters, the others held:
// f(a + b) = f(a) + f(b) at drawn values. Where it has no value, as asin(q)
// beyond 1, or is zero on all three sides, as max(0, q - g), a draw says
// nothing.
bool IsLinear(const Formula& formula, const std::vector<bool>& in) {
  constexpr int kDraws = 200, kEnough = 8;
  std::mt19937_64 random(1);
  Law law(formula);
  int said = 0;
  for (int draw = 0; draw < kDraws && said < kEnough; ++draw) {
    law.Draw(&random);
    std::vector<double> a(in.size()), b(in.size()), sum(in.size());
    for (size_t i = 0; i < in.size(); ++i) {
      a[i] = b[i] = sum[i] = DrawSize(&random);
      if (!in[i]) continue;
      b[i] = DrawSize(&random);
      sum[i] = a[i] + b[i];
    }
    const double f_a = law.At(a), f_b = law.At(b), f_sum = law.At(sum);
    const double size = std::abs(f_a) + std::abs(f_b) + std::abs(f_sum);
    if (!std::isfinite(size) || size == 0.0) continue;
    ++said;
    if (!(std::abs(f_sum - f_a - f_b) <= 1e-9 * size)) return false;
  }
  return said > 0;
}

// Whether a parameter is a size that divides, as v of c*tanh(qd/v) or of
// c*qd/(abs(qd)+v): whatever is read, a divisor grows with it from zero or
// more. Of the other sign the law would be another, or have a pole. (One that
// is a place, as q0 of a/(q-q0)^2, may have either sign.)
bool Divides(const Formula& formula, size_t parameter) {
  constexpr int kDraws = 16;
  const size_t known = formula.known.size();
  std::mt19937_64 random(1);
  std::vector<double> names(known + formula.parameters.size(), 1.0);
  std::vector<double> at_zero(formula.tree.size()), at_one(at_zero);
  std::vector<bool> grows(formula.tree.size(), true);
  for (int draw = 0; draw < kDraws; ++draw) {
    for (size_t i = 0; i < known; ++i) {
      names[i] = random() % 2 == 0 ? DrawSize(&random) : -DrawSize(&random);
    }
    names[known + parameter] = 1.0;
    formula.tree.Evaluate<double>(names.data(), at_one.data());
    names[known + parameter] = 0.0;
    formula.tree.Evaluate<double>(names.data(), at_zero.data());
    for (size_t i = 0; i < grows.size(); ++i) {
      grows[i] = grows[i] && at_zero[i] >= 0.0 && at_one[i] > at_zero[i];
    }
  }
  for (const SyntaxTree::Node& node : formula.tree.nodes()) {
    const bool inverts =
        node.op == SyntaxTree::Op::kWholePower && node.right < 0;
    if (inverts ? grows[node.left]
                : node.op == SyntaxTree::Op::kDivide && grows[node.right]) {
      return true;
    }
  }
  return false;
}

// The largest set of parameters in which the law is linear, of equals that with
// the first names; empty where there is none.
std::vector<bool> LinearOnes(const Formula& formula) {
  const size_t count = formula.parameters.size();
  std::vector<bool> best;
  size_t most = 0;
  for (unsigned mask = (1u << count) - 1; mask > 0; --mask) {
    std::vector<bool> in(count);
    size_t size = 0;
    for (size_t i = 0; i < count; ++i) {
      in[i] = (mask >> (count - 1 - i)) & 1u;
      size += in[i];
    }
    if (size <= most || !IsLinear(formula, in)) continue;
    best = in;
    most = size;
  }
  return best;
}

}  // namespace

// What a law on a joint may read.
struct CustomLaw::Vocabulary {
  std::vector<KnownName> names;
  std::vector<Source> sources;      // of each name
  std::vector<EffectInput> inputs;  // by Source::index

  Vocabulary(const Mechanism& mechanism, const Joint& own) {
    const auto position = [](const Joint& joint) {
      return std::string(joint.type == JointType::kPrismatic ? "m" : "rad");
    };
    Add("q", position(own), Source::Of::kQ);
    Add("qd", position(own) + "/s", Source::Of::kQd);
    Add("tau", own.type == JointType::kPrismatic ? "N" : "N m",
        Source::Of::kEffort);
    AddInput("t", "s");
    for (const Joint& joint : mechanism.joints) {
      if (VelocitySize(joint) != 1) continue;
      const bool is_own = &joint == &own;
      Add(joint.name + ".q", position(joint),
          is_own ? Source::Of::kQ : Source::Of::kOtherQ, joint.q_index);
      Add(joint.name + ".qd", position(joint) + "/s",
          is_own ? Source::Of::kQd : Source::Of::kOtherQd, joint.v_index);
      AddInput(joint.name + ".cmd", position(joint));
      AddInput(joint.name + ".temperature", "K");
    }
    for (const std::string axis : {"x", "y", "z"}) {
      AddInput("base.a" + axis, "m/s^2");
      AddInput("base.p" + axis, "m");
    }
    for (const std::string& name : mechanism.inputs) AddInput(name, "");
  }

 private:
  void Add(const std::string& name, const std::string& unit, Source::Of of,
           int index = 0) {
    names.push_back({name, unit});
    sources.push_back({of, index});
  }
  void AddInput(const std::string& name, const std::string& unit) {
    Add(name, unit, Source::Of::kInput, static_cast<int>(inputs.size()));
    inputs.push_back({name, unit});
  }
};

struct CustomLaw::Parsed {
  std::string joint, text;
  Formula formula;
  std::vector<Source> sources;
  std::vector<EffectInput> inputs;
  std::vector<int> others;
  unsigned hooks = kEffortHook;
};

CustomLaw::Parsed CustomLaw::Parse(const Mechanism& mechanism,
                                   const std::string& target) {
  // A number of parameters whose subsets can be tried.
  constexpr size_t kMostParameters = 12;
  Parsed parsed;
  const size_t colon = target.find(':');
  parsed.joint = target.substr(0, colon);
  parsed.text = WithoutBlanks(target.substr(colon + 1));
  const Vocabulary vocabulary(
      mechanism, mechanism.joints[mechanism.FindJoint(parsed.joint)]);
  FormulaFault fault;
  if (!ParseFormula(parsed.text, vocabulary.names, vocabulary.names[2].unit,
                    &parsed.formula, &fault)) {
    throw LawFault("character " + std::to_string(fault.at + 1) + ": " +
                       fault.what + "\n" + PointedAt(parsed.text, fault.at),
                   fault.hint);
  }
  if (parsed.formula.parameters.size() > kMostParameters) {
    throw LawFault(
        "more than " + std::to_string(kMostParameters) + " parameters",
        "leave terms out");
  }
  // Would make the equations implicit, and is no name for a parameter.
  const std::vector<std::string>& parameters = parsed.formula.parameters;
  if (std::find(parameters.begin(), parameters.end(), "qdd") !=
      parameters.end()) {
    throw LawFault("a law may not read qdd, the acceleration that it makes",
                   "an inertia on the joint is armature@" + parsed.joint);
  }
  for (const int i : parsed.formula.known) {
    const std::string& name = vocabulary.names[i].name;
    Source source = vocabulary.sources[i];
    if (source.of == Source::Of::kEffort) parsed.hooks |= kReadsEffort;
    if (source.of == Source::Of::kInput) {
      parsed.inputs.push_back(vocabulary.inputs[source.index]);
      source.index = static_cast<int>(parsed.inputs.size()) - 1;
    }
    if (source.of == Source::Of::kOtherQ || source.of == Source::Of::kOtherQd) {
      const int joint = mechanism.FindJoint(name.substr(0, name.rfind('.')));
      if (std::find(parsed.others.begin(), parsed.others.end(), joint) ==
          parsed.others.end()) {
        parsed.others.push_back(joint);
      }
    }
    parsed.sources.push_back(source);
  }
  return parsed;
}

CustomLaw::CustomLaw(const Mechanism& mechanism, const std::string& target)
    : CustomLaw(mechanism, Parse(mechanism, target)) {}

CustomLaw::CustomLaw(const Mechanism& mechanism, Parsed parsed)
    : EffectOf(kName, parsed.hooks, mechanism, parsed.joint),
      text_(std::move(parsed.text)),
      formula_(std::move(parsed.formula)),
      sources_(std::move(parsed.sources)) {
  const std::vector<bool> linear = LinearOnes(formula_);
  if (linear.empty()) {
    throw LawFault("no value of its parameters makes the law zero",
                   "give it a factor, as a in a*(" + text_ + ")");
  }
  SetRestOfName(": " + text_);
  const size_t searched = std::count(linear.begin(), linear.end(), false);
  // Each four orders of size, or two where there are many.
  const std::vector<double> grid =
      searched > 2 ? std::vector<double>{0.1, 1.0}
                   : std::vector<double>{0.01, 0.1, 1.0, 10.0};
  for (size_t i = 0; i < formula_.parameters.size(); ++i) {
    const std::string name = parsed.joint + "." + formula_.parameters[i];
    const std::string& unit = formula_.units[i];
    if (linear[i]) {
      AddParameter(name, unit, 0.01);
    } else if (Divides(formula_, i)) {
      // Three orders of size to either side of one.
      AddSearchedParameter(name, unit, 1.0, grid, 1e-3, 1e3);
    } else {
      AddSearchedParameter(name, unit, 1.0, grid, -kUnbounded, kUnbounded);
    }
  }
  for (const EffectInput& input : parsed.inputs) {
    ReadsInput(input.name, input.unit);
  }
  for (const int joint : parsed.others) ReadsJoint(joint);
}

}  // namespace sysid
