#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "models/formula/functions.h"

namespace sysid {

// Arithmetic over names, as a parser (syntax_parser.h) reads it: operations,
// each on nodes before it; the last node is the value. What the names are is
// the matter of who evaluates it.
class SyntaxTree {
 public:
  enum class Op {
    kName,
    kNumber,
    kAdd,
    kSubtract,
    kMultiply,
    kDivide,
    kNegate,
    kPower,
    kWholePower,  // by a constant whole number
    kAbsolute,
    kSign,
    kSquareRoot,
    kExponential,
    kLogarithm,
    kSine,
    kCosine,
    kTangent,
    kArcSine,
    kArcCosine,
    kArcTangent,
    kHyperbolicSine,
    kHyperbolicCosine,
    kHyperbolicTangent,
    kSmaller,
    kGreater,
    kArcTangent2,
    kHypotenuse
  };
  struct Node {
    Op op = Op::kNumber;
    int left = 0;   // index of a node; of a name, its index
    int right = 0;  // index of a node; the exponent of kWholePower
    double number = 0.0;
    bool of_pi = false;  // a number in which pi is a factor
  };
  // A function by its name in formulas.
  struct Function {
    std::string_view name;
    Op op;
    int arguments;  // 1 or 2
  };

  static constexpr int kMostNodes = 1000;
  // The greatest exponent of a kWholePower, of either sign.
  static constexpr int kMostPower = 1000;

  static SyntaxTree OfName(int name);
  static std::span<const Function> Functions();

  const std::vector<Node>& nodes() const { return nodes_; }
  int size() const { return static_cast<int>(nodes_.size()); }
  // Whether it is one name as it stands.
  bool is_name() const { return size() == 1 && nodes_[0].op == Op::kName; }

  // For parsers: appends a node, drops the last one, changes one.
  int Add(const Node& node);
  void DropLast() { nodes_.pop_back(); }
  Node& node(int i) { return nodes_[i]; }
  // The name i becomes the name to[i].
  void Rename(const std::vector<int>& to);

  // The value where the name i has names[i]; NaN or infinite where there is
  // none. `scratch` has room for size() scalars. Not of an empty tree.
  template <typename T>
  T Evaluate(const T* names, T* scratch) const;

  // One operation; of one operand where it takes one. Not kName, kNumber or
  // kWholePower.
  template <typename T>
  static T Apply(Op op, const T& left, const T& right);

 private:
  std::vector<Node> nodes_;
};

template <typename T>
T SyntaxTree::Evaluate(const T* names, T* scratch) const {
  const int n = size();
  for (int i = 0; i < n; ++i) {
    const Node& node = nodes_[i];
    switch (node.op) {
      case Op::kName:
        scratch[i] = names[node.left];
        break;
      case Op::kNumber:
        scratch[i] = T(node.number);
        break;
      case Op::kWholePower:
        scratch[i] = formula::WholePower(scratch[node.left], node.right);
        break;
      default:
        scratch[i] = Apply(node.op, scratch[node.left], scratch[node.right]);
    }
  }
  return scratch[n - 1];
}

template <typename T>
T SyntaxTree::Apply(Op op, const T& left, const T& right) {
  using std::atan, std::cos, std::cosh, std::exp, std::log, std::sin, std::sinh,
      std::tan, std::tanh;
  switch (op) {
    case Op::kAdd:
      return left + right;
    case Op::kSubtract:
      return left - right;
    case Op::kMultiply:
      return left * right;
    case Op::kDivide:
      return left / right;
    case Op::kPower:
      return formula::Power(left, right);
    case Op::kAbsolute:
      return formula::Absolute(left);
    case Op::kSign:
      return formula::Sign(left);
    case Op::kSquareRoot:
      return formula::SquareRoot(left);
    case Op::kExponential:
      return exp(left);
    case Op::kLogarithm:
      return log(left);
    case Op::kSine:
      return sin(left);
    case Op::kCosine:
      return cos(left);
    case Op::kTangent:
      return tan(left);
    case Op::kArcSine:
      return formula::ArcSine(left);
    case Op::kArcCosine:
      return formula::ArcCosine(left);
    case Op::kArcTangent:
      return atan(left);
    case Op::kHyperbolicSine:
      return sinh(left);
    case Op::kHyperbolicCosine:
      return cosh(left);
    case Op::kHyperbolicTangent:
      return tanh(left);
    case Op::kSmaller:
      return formula::Smaller(left, right);
    case Op::kGreater:
      return formula::Greater(left, right);
    case Op::kArcTangent2:
      return formula::ArcTangent2(left, right);
    case Op::kHypotenuse:
      return formula::Hypotenuse(left, right);
    default:
      return -left;
  }
}

}  // namespace sysid
