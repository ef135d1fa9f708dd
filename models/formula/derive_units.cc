#include "models/formula/derive_units.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>

namespace sysid {
namespace {

using Op = SyntaxTree::Op;
using Node = SyntaxTree::Node;

// Elimination is cubic; no formula that a person wrote has so many unknowns.
constexpr int kMostUnknowns = 100;
constexpr double kZero = 1e-9;  // of exponents and their factors

// A unit by the exponents of symbols.
using Unit = std::vector<std::pair<std::string, double>>;

Unit ParseUnit(std::string_view text) {
  Unit unit;
  bool below = false, in_brackets = false;
  for (size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (c == '/') below = true;
    if (c == '(') in_brackets = true;
    if (c == ')') below = in_brackets = false;
    const size_t end = std::min(text.find_first_of(" */()", i), text.size());
    if (end == i) {
      ++i;
      continue;
    }
    const std::string_view factor = text.substr(i, end - i);
    const size_t caret = factor.find('^');
    const std::string symbol(factor.substr(0, caret));
    const double power =
        caret == std::string_view::npos
            ? 1.0
            : std::atof(std::string(factor.substr(caret + 1)).c_str());
    if (symbol != "1" && symbol != "-") {
      unit.emplace_back(symbol, below ? -power : power);
    }
    if (!in_brackets) below = false;
    i = end;
  }
  return unit;
}

std::string UnitText(const Unit& unit) {
  std::string above, below;
  int many = 0;
  for (const auto& [symbol, exponent] : unit) {
    if (std::abs(exponent) < kZero) continue;
    std::string& side = exponent > 0.0 ? above : below;
    if (!side.empty()) side += ' ';
    many += exponent < 0.0;
    side += symbol;
    const double power = std::abs(exponent);
    if (std::abs(power - 1.0) < kZero) continue;
    char text[32];
    std::snprintf(text, sizeof(text), "^%.4g", power);
    side += text;
  }
  if (below.empty()) return above.empty() ? "-" : above;
  if (many > 1) below = "(" + below + ")";
  return (above.empty() ? "1" : above) + "/" + below;
}

// Equations a x = b in reduced echelon form.
class LinearSystem {
 public:
  explicit LinearSystem(int unknowns) : unknowns_(unknowns) {}

  // False, and nothing added, where it contradicts those before.
  bool Add(Eigen::VectorXd a, double b) {
    for (const Row& row : rows_) {
      const double factor = a[row.pivot];
      if (factor == 0.0) continue;
      a -= factor * row.a;
      b -= factor * row.b;
      a[row.pivot] = 0.0;
    }
    int pivot = 0;
    if (unknowns_ == 0 || a.cwiseAbs().maxCoeff(&pivot) < kZero) {
      return std::abs(b) < kZero;
    }
    const double scale = a[pivot];
    a /= scale;
    b /= scale;
    for (Row& row : rows_) {
      const double factor = row.a[pivot];
      if (factor == 0.0) continue;
      row.a -= factor * a;
      row.b -= factor * b;
      row.a[pivot] = 0.0;
    }
    rows_.push_back({std::move(a), b, pivot});
    return true;
  }

  // The value of one unknown, where it follows.
  bool Solve(int unknown, double* value) const {
    for (const Row& row : rows_) {
      if (row.pivot != unknown) continue;
      *value = row.b;
      return std::abs(row.a.cwiseAbs().sum() - 1.0) < kZero;
    }
    return false;
  }

 private:
  struct Row {
    Eigen::VectorXd a;
    double b = 0.0;
    int pivot = 0;  // where a is 1, and that of the other rows 0
  };
  int unknowns_;
  std::vector<Row> rows_;
};

// The unit of a node: exponents of each symbol, by unknowns and a constant.
struct Form {
  Eigen::VectorXd unknowns;
  Eigen::VectorXd symbols;
};

Form Scaled(const Form& a, double factor) {
  return {factor * a.unknowns, factor * a.symbols};
}
Form Sum(const Form& a, const Form& b, double factor) {
  return {a.unknowns + factor * b.unknowns, a.symbols + factor * b.symbols};
}

bool IsTrigonometric(Op op) {
  return op == Op::kSine || op == Op::kCosine || op == Op::kTangent;
}

class UnitSolver {
 public:
  UnitSolver(const SyntaxTree& tree, const std::vector<std::string>& units,
             int parameters, const std::string& whole)
      : nodes_(tree.nodes()),
        units_(units),
        parameters_(parameters),
        whole_(whole) {}

  std::vector<std::string> Solve() {
    std::vector<std::string> none(parameters_);
    FindSymbols();
    unknowns_ = CountUnknowns();
    if (unknowns_ > kMostUnknowns) return none;
    systems_.assign(symbols_.size(), LinearSystem(unknowns_));
    for (const Node& node : nodes_) forms_.push_back(FormOf(node));
    if (!whole_.empty()) Equal(forms_.back(), Known(whole_));
    if (contradicts_) return none;
    MarkAngles();
    AssumePlain();
    AssumeAngles();
    AssumeConstants();
    std::vector<std::string> texts;
    for (int i = 0; i < parameters_; ++i) texts.push_back(TextOf(i));
    return texts;
  }

 private:
  int symbol(const std::string& name) {
    const auto found = std::find(symbols_.begin(), symbols_.end(), name);
    if (found == symbols_.end()) {
      symbols_.push_back(name);
      return static_cast<int>(symbols_.size()) - 1;
    }
    return static_cast<int>(found - symbols_.begin());
  }

  // In the order in which they are printed: the whole's first.
  void FindSymbols() {
    for (const auto& factor : ParseUnit(whole_)) symbol(factor.first);
    for (const std::string& unit : units_) {
      for (const auto& factor : ParseUnit(unit)) symbol(factor.first);
    }
    rad_ = symbol("rad");
  }

  bool IsUnknownName(const Node& node) const {
    return node.op == Op::kName &&
           node.left < static_cast<int>(units_.size()) &&
           units_[node.left].empty();
  }
  bool HasFreePower(const Node& node) const {
    return node.op == Op::kPower && nodes_[node.right].op != Op::kNumber;
  }
  static bool GivesAngle(Op op) {
    return op == Op::kArcSine || op == Op::kArcCosine ||
           op == Op::kArcTangent || op == Op::kArcTangent2;
  }

  // The parameters, then what nodes have of their own (a name that is not known
  // one for all of its uses).
  int CountUnknowns() {
    int count = parameters_ + static_cast<int>(units_.size());
    for (const Node& node : nodes_) {
      count +=
          node.op == Op::kNumber || HasFreePower(node) || GivesAngle(node.op);
    }
    return count;
  }

  Form Plain() const {
    return {Eigen::VectorXd::Zero(unknowns_),
            Eigen::VectorXd::Zero(static_cast<int>(symbols_.size()))};
  }
  Form Unknown(int i) const {
    Form form = Plain();
    form.unknowns[i] = 1.0;
    return form;
  }
  Form Known(const std::string& unit) {
    Form form = Plain();
    for (const auto& [name, power] : ParseUnit(unit)) {
      form.symbols[symbol(name)] += power;
    }
    return form;
  }

  void Equal(const Form& a, const Form& b) {
    const Form difference = Sum(a, b, -1.0);
    for (size_t s = 0; s < systems_.size(); ++s) {
      contradicts_ |= !Assume(difference, static_cast<int>(s), 0.0);
    }
  }

  // That the exponent of a symbol is this; false where it cannot.
  bool Assume(const Form& form, int symbol, double exponent) {
    return systems_[symbol].Add(form.unknowns, exponent - form.symbols[symbol]);
  }
  bool AssumePlain(const Form& form) {
    bool all = true;
    for (size_t s = 0; s < systems_.size(); ++s) {
      all &= Assume(form, static_cast<int>(s), 0.0);
    }
    return all;
  }

  Form FormOf(const Node& node) {
    const int known = static_cast<int>(units_.size());
    if (node.op == Op::kName) {
      if (node.left >= known) return Unknown(node.left - known);
      if (IsUnknownName(node)) return Unknown(parameters_ + node.left);
      return Known(units_[node.left]);
    }
    if (node.op == Op::kNumber || HasFreePower(node) || GivesAngle(node.op)) {
      if (node.op == Op::kArcTangent2) {
        Equal(forms_[node.left], forms_[node.right]);
      }
      return Unknown(parameters_ + known + own_++);
    }
    const Form& left = forms_[node.left];
    switch (node.op) {
      case Op::kAdd:
      case Op::kSubtract:
      case Op::kSmaller:
      case Op::kGreater:
      case Op::kHypotenuse:
        Equal(left, forms_[node.right]);
        return left;
      case Op::kMultiply:
        return Sum(left, forms_[node.right], 1.0);
      case Op::kDivide:
        return Sum(left, forms_[node.right], -1.0);
      case Op::kPower:
        return Scaled(left, nodes_[node.right].number);
      case Op::kWholePower:
        return Scaled(left, node.right);
      case Op::kSquareRoot:
        return Scaled(left, 0.5);
      case Op::kNegate:
      case Op::kAbsolute:
        return left;
      default:
        return Plain();
    }
  }

  // What stands in an argument of sin, cos or tan.
  void MarkAngles() {
    in_angle_.assign(nodes_.size(), false);
    for (size_t i = nodes_.size(); i-- > 0;) {
      const Node& node = nodes_[i];
      if (node.op == Op::kName || node.op == Op::kNumber) continue;
      if (!in_angle_[i] && !IsTrigonometric(node.op)) continue;
      in_angle_[node.left] = true;
      if (node.right > node.left && node.op != Op::kWholePower) {
        in_angle_[node.right] = true;
      }
    }
  }

  void AssumePlain() {
    for (size_t i = 0; i < nodes_.size(); ++i) {
      const Node& node = nodes_[i];
      if (node.op == Op::kName || node.op == Op::kNumber) continue;
      const Form& left = forms_[node.left];
      if (HasFreePower(node)) {
        AssumePlain(forms_[node.right]);
        // Of another base, the unit depends on the exponent's value.
        if (AssumePlain(left)) AssumePlain(forms_[i]);
      } else if (IsTrigonometric(node.op)) {
        for (size_t s = 0; s < systems_.size(); ++s) {
          if (static_cast<int>(s) != rad_) {
            Assume(left, static_cast<int>(s), 0.0);
          }
        }
      } else if (TakesPlain(node.op)) {
        AssumePlain(left);
      }
    }
  }
  static bool TakesPlain(Op op) {
    return op == Op::kExponential || op == Op::kLogarithm ||
           op == Op::kHyperbolicSine || op == Op::kHyperbolicCosine ||
           op == Op::kHyperbolicTangent || op == Op::kArcSine ||
           op == Op::kArcCosine || op == Op::kArcTangent;
  }

  void AssumeAngles() {
    for (const Node& node : nodes_) {
      if (!IsTrigonometric(node.op)) continue;
      const Form& angle = forms_[node.left];
      if (!Assume(angle, rad_, 1.0)) Assume(angle, rad_, 0.0);
    }
    for (size_t i = 0; i < nodes_.size(); ++i) {
      if (GivesAngle(nodes_[i].op)) AssumePlain(forms_[i]);
    }
  }

  void AssumeConstants() {
    bool pi_in_angle = false;
    for (size_t i = 0; i < nodes_.size(); ++i) {
      const Node& node = nodes_[i];
      if (node.op != Op::kNumber) continue;
      const bool may_turn = node.of_pi && in_angle_[i];
      pi_in_angle |= may_turn;
      for (size_t s = 0; s < systems_.size(); ++s) {
        const int symbol = static_cast<int>(s);
        if (!may_turn || symbol != rad_) Assume(forms_[i], symbol, 0.0);
      }
    }
    if (!pi_in_angle) return;
    const int known = static_cast<int>(units_.size());
    for (size_t i = 0; i < nodes_.size(); ++i) {
      if (in_angle_[i] && nodes_[i].op == Op::kName &&
          nodes_[i].left >= known) {
        Assume(forms_[i], rad_, 0.0);
      }
    }
  }

  std::string TextOf(int parameter) const {
    Unit unit;
    for (size_t s = 0; s < symbols_.size(); ++s) {
      double exponent;
      if (!systems_[s].Solve(parameter, &exponent)) return "";
      unit.emplace_back(symbols_[s], exponent);
    }
    return UnitText(unit);
  }

  const std::vector<Node>& nodes_;
  const std::vector<std::string>& units_;
  const int parameters_;
  const std::string& whole_;
  std::vector<std::string> symbols_;
  int rad_ = 0;  // a symbol
  int unknowns_ = 0;
  int own_ = 0;                        // unknowns that nodes have taken
  std::vector<LinearSystem> systems_;  // of each symbol
  std::vector<Form> forms_;            // of each node
  std::vector<bool> in_angle_;         // of each node
  bool contradicts_ = false;
};

}  // namespace

std::vector<std::string> DeriveUnits(const SyntaxTree& tree,
                                     const std::vector<std::string>& units,
                                     int parameters, const std::string& whole) {
  return UnitSolver(tree, units, parameters, whole).Solve();
}

}  // namespace sysid
