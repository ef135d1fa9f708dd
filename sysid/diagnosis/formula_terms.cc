#include "sysid/diagnosis/formula_terms.h"

#include <algorithm>
#include <cctype>

namespace sysid {
namespace {

using Words = std::vector<std::string>;

// A name as a formula has it: in quotes where it is no plain word.
std::string AsWord(const std::string& name) {
  const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '.';
  });
  const bool digit =
      !name.empty() && std::isdigit(static_cast<unsigned char>(name[0])) != 0;
  return plain && !digit ? name : "'" + name + "'";
}

std::string Times(const std::string& a, const std::string& b) {
  return a.empty() || b.empty() ? a + b : a + "*" + b;
}
std::string ToPower(const std::string& x, int power) {
  if (power == 0) return "";
  return power == 1 ? x : x + "^" + std::to_string(power);
}

// Products of powers of x, from the first on, of a degree up to `most`.
void AddPowers(const Words& x, size_t first, const std::string& product,
               int most, Words* out) {
  if (first == x.size()) {
    if (!product.empty()) out->push_back(product);
    return;
  }
  for (int power = 0; power <= most; ++power) {
    AddPowers(x, first + 1, Times(product, ToPower(x[first], power)),
              most - power, out);
  }
}
Words PowersOf(const Words& x, int most) {
  Words all;
  AddPowers(x, 0, "", most, &all);
  return all;
}

// What other joints and inputs add, by the rules of the header.
void AddOthers(const Words& own, const Words& others, Words* out) {
  for (const std::string& y : others) {
    for (const int power : {1, 2, 3}) out->push_back(ToPower(y, power));
    for (const std::string& product : PowersOf(own, 2)) {
      out->push_back(Times(product, y));
    }
    const std::string size = "abs(" + y + ")";
    out->push_back(size);
    out->push_back(Times(size, y));
    out->push_back(y + "/({s}+" + size + ")");
    for (const std::string& x : own) {
      out->push_back(Times(x, y + "^2"));
      out->push_back(Times(size, x));
      out->push_back(Times("abs(" + x + ")", y));
    }
  }
}

// Of hinges.
void AddTurns(const Words& own, const Words& other_angles, Words* out) {
  Words angles = {"q", "2*q"};
  for (const std::string& other : other_angles) {
    angles.push_back(other);
    angles.push_back("q+" + other);
  }
  for (const std::string& angle : angles) {
    for (const std::string function : {"sin", "cos"}) {
      const std::string turn = function + "(" + angle + ")";
      out->push_back(turn);
      for (const std::string& x : own) out->push_back(Times(turn, x));
    }
  }
}

void AddShapes(const Words& own, bool turns, const Words& others, Words* out) {
  for (const std::string& x : own) {
    const std::string size = "abs(" + x + ")";
    out->push_back(size);
    for (const std::string& by : own) out->push_back(Times(size, by));
    out->push_back(x + "/({s}+" + size + ")");
    if (x == "qd") continue;
    for (const int power : {1, 2, 3}) {
      out->push_back("sign(" + x + ")*" +
                     ToPower("max(0,abs(" + x + ")-{s})", power));
    }
  }
  const std::string side = "tanh(qd/{s})";
  Words levels = {"", "q", "q^2", "abs(q)"};
  if (own.size() > 2) levels.push_back("abs(tau)");
  for (const std::string& y : others) levels.push_back("abs(" + y + ")");
  if (turns) levels.insert(levels.end(), {"sin(q)", "cos(q)"});
  for (const std::string& level : levels) out->push_back(Times(side, level));
  out->push_back("(q-{s})*exp(-((q-{s})/{w})^2)");
  out->push_back("exp(-(q/{w})^2)*qd");
  out->push_back("exp(-abs(qd)/{s})*qd");
}

std::string Replaced(std::string text, const std::string& from,
                     const std::string& to) {
  for (size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

}  // namespace

std::string TextOf(const FormulaTerm& term, const std::string& number) {
  return "c" + number + "*" +
         Replaced(Replaced(term.shape, "{s}", "s" + number), "{w}",
                  "w" + number);
}

bool IsSmoothSign(const FormulaTerm& term) {
  return term.shape == "qd/({s}+abs(qd))" || term.shape == "tanh(qd/{s})";
}

namespace {

// The joint that carries another, past those that do not move; -1: none.
int CarrierOf(const Mechanism& mechanism, int joint) {
  int link = mechanism.joints[joint].parent_link;
  for (;;) {
    const auto up = std::find_if(
        mechanism.joints.begin(), mechanism.joints.end(),
        [&](const Joint& other) { return other.child_link == link; });
    if (up == mechanism.joints.end()) return -1;
    if (VelocitySize(*up) > 0) {
      return static_cast<int>(up - mechanism.joints.begin());
    }
    link = up->parent_link;
  }
}

}  // namespace

std::vector<FormulaTerm> TermsOf(const Mechanism& mechanism, int joint,
                                 bool driven,
                                 const std::vector<std::string>& inputs) {
  const Joint& of = mechanism.joints[joint];
  Words own = {"q", "qd"};
  if (driven) own.push_back("tau");
  Words others, angles;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& other = mechanism.joints[j];
    const int at = static_cast<int>(j);
    if (VelocitySize(other) != 1 || (CarrierOf(mechanism, at) != joint &&
                                     CarrierOf(mechanism, joint) != at)) {
      continue;
    }
    const std::string position = AsWord(other.name + ".q");
    others.push_back(position);
    others.push_back(AsWord(other.name + ".qd"));
    if (IsRotation1(other.type)) angles.push_back(position);
  }
  for (const std::string& input : inputs) others.push_back(AsWord(input));
  Words shapes = PowersOf(own, 3);
  AddOthers(own, others, &shapes);
  if (IsRotation1(of.type)) AddTurns(own, angles, &shapes);
  AddShapes(own, IsRotation1(of.type), others, &shapes);
  std::vector<FormulaTerm> terms;
  for (std::string& shape : shapes) terms.push_back({of.name, shape});
  return terms;
}

std::vector<FormulaTerm> TermsOf(const DiagnosisProblem& problem, int joint) {
  const Mechanism& mechanism = problem.model.mechanism();
  std::vector<const Run*> runs;
  for (const auto& data : problem.train->runs()) runs.push_back(&data->run);
  if (problem.holdout != nullptr) {
    for (const auto& data : problem.holdout->runs()) {
      runs.push_back(&data->run);
    }
  }
  const int v = mechanism.joints[joint].v_index;
  const bool driven = std::any_of(
      runs.begin(), runs.end(),
      [&](const Run* run) { return !run->effort.col(v).isZero(0.0); });
  std::vector<std::string> inputs;
  for (const Input& input : runs.front()->inputs) {
    if (std::all_of(runs.begin(), runs.end(), [&](const Run* run) {
          return FindInput(*run, input.name) != nullptr;
        })) {
      inputs.push_back(input.name);
    }
  }
  return TermsOf(mechanism, joint, driven, inputs);
}

}  // namespace sysid
