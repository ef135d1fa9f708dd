#include "models/formula/syntax_tree.h"

#include <array>

namespace sysid {

SyntaxTree SyntaxTree::OfName(int name) {
  SyntaxTree tree;
  tree.Add({Op::kName, name, 0, 0.0});
  return tree;
}

std::span<const SyntaxTree::Function> SyntaxTree::Functions() {
  static constexpr std::array<Function, 18> kFunctions{{
      {"abs", Op::kAbsolute, 1},
      {"sign", Op::kSign, 1},
      {"sqrt", Op::kSquareRoot, 1},
      {"exp", Op::kExponential, 1},
      {"log", Op::kLogarithm, 1},
      {"sin", Op::kSine, 1},
      {"cos", Op::kCosine, 1},
      {"tan", Op::kTangent, 1},
      {"asin", Op::kArcSine, 1},
      {"acos", Op::kArcCosine, 1},
      {"atan", Op::kArcTangent, 1},
      {"sinh", Op::kHyperbolicSine, 1},
      {"cosh", Op::kHyperbolicCosine, 1},
      {"tanh", Op::kHyperbolicTangent, 1},
      {"min", Op::kSmaller, 2},
      {"max", Op::kGreater, 2},
      {"atan2", Op::kArcTangent2, 2},
      {"hypot", Op::kHypotenuse, 2},
  }};
  return kFunctions;
}

int SyntaxTree::Add(const Node& node) {
  nodes_.push_back(node);
  return size() - 1;
}

void SyntaxTree::Rename(const std::vector<int>& to) {
  for (Node& node : nodes_) {
    if (node.op == Op::kName) node.left = to[node.left];
  }
}

}  // namespace sysid
