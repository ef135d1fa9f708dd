// Angles from the world's vertical where those from the link before are meant.

#include <cmath>

#include "sysid/hypotheses/families/families.h"

namespace sysid {
namespace {

// A hinge and the hinge about the same axis that carries its parent link;
// `sign` is -1 where the axes are opposed.
struct Pair {
  int joint = -1, before = -1;
  double sign = 1.0;
};

Pair PairOf(const Model& model, int joint) {
  constexpr double kParallel = 1.0 - 1e-6;  // cosine: a URDF's digits
  for (const Body& body : model.bodies()) {
    if (body.joint != joint || body.parent < 0) continue;
    const Body& parent = model.bodies()[body.parent];
    if (parent.leader >= 0) return {};
    if (!IsRotation1(body.type) || !IsRotation1(parent.type)) return {};
    const Eigen::Vector3d axis =
        body.turned ? Eigen::Vector3d(body.R_PJ * body.axis) : body.axis;
    const double cosine = axis.dot(parent.axis);
    if (std::abs(cosine) < kParallel) return {};
    return {joint, parent.joint, cosine > 0 ? 1.0 : -1.0};
  }
  return {};
}

}  // namespace

void AbsoluteHypotheses(const CheckInput& input,
                        std::vector<DataHypothesis>* all) {
  const Mechanism* mechanism = &input.model->mechanism();
  std::vector<Pair> pairs;
  for (const int j : MeasuredJoints(input)) {
    const Pair pair = PairOf(*input.model, j);
    if (pair.before >= 0 &&
        Measures(input, ChannelKind::kPosition, pair.before)) {
      pairs.push_back(pair);
    }
  }
  const auto add = [&](const std::vector<Pair>& which) {
    DataHypothesis hypothesis;
    hypothesis.fault = DataFault::kAbsoluteAngle;
    for (const Pair& pair : which) {
      hypothesis.subjects.push_back(mechanism->joints[pair.joint].name + ".q");
    }
    hypothesis.says =
        Words("with " + hypothesis.subject() +
              " measured relative to the world instead of the parent link");
    hypothesis.consequence =
        "a URDF's joint angle is that between its two links";
    hypothesis.corrected = [which, mechanism](double) {
      std::vector<CorrectedColumn> columns;
      for (const Pair& pair : which) {
        for (const char* suffix : {".q", ".qd"}) {
          const std::string column =
              mechanism->joints[pair.joint].name + suffix;
          const std::string before =
              mechanism->joints[pair.before].name + suffix;
          columns.push_back({column, {{1.0, column}, {-pair.sign, before}}});
        }
      }
      return columns;
    };
    all->push_back(hypothesis);
  };
  for (const Pair& pair : pairs) add({pair});
  if (pairs.size() > 1) add(pairs);
}

}  // namespace sysid
