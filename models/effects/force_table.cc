#include "models/effects/force_table.h"

#include <algorithm>
#include <cmath>

#include "models/math/decompositions.h"

namespace sysid {
namespace {

// L of L L' = the correlation of forces at knots, its columns by their size.
Eigen::MatrixXd SmoothShapes(int knots, bool periodic) {
  constexpr double kReach = 2.0;  // knots
  Eigen::MatrixXd correlation(knots, knots);
  for (int i = 0; i < knots; ++i) {
    for (int j = 0; j < knots; ++j) {
      double apart = std::abs(i - j);
      // Of knots on a circle the chord, for which it is a correlation too.
      if (periodic) apart = knots / M_PI * std::sin(M_PI * apart / knots);
      const double x = std::sqrt(3.0) * apart / kReach;
      correlation(i, j) = (1.0 + x) * std::exp(-x);
    }
  }
  const SymmetricEigen eigen = EigenOfSymmetric(correlation);
  Eigen::MatrixXd shapes(knots, knots);
  for (int k = 0; k < knots; ++k) {
    const int at = knots - 1 - k;  // they come in rising order
    Eigen::VectorXd shape =
        std::sqrt(std::max(eigen.values[at], 0.0)) * eigen.vectors.col(at);
    // Of either sign by chance.
    if (shape[0] < 0.0) shape = -shape;
    shapes.col(k) = shape;
  }
  return shapes;
}

template <typename Shapes>
void Fill(const Eigen::MatrixXd& from, Shapes* to) {
  for (int i = 0; i < from.rows(); ++i) {
    for (int k = 0; k < from.cols(); ++k) (*to)[i][k] = from(i, k);
  }
}

}  // namespace

ForceTable::ForceTable(const Mechanism& mechanism, const std::string& joint)
    : EffectOf(kName, kEffortHook, mechanism, joint) {
  for (int i = 0; i < kKnots; ++i) {
    for (int j = 0; j < kKnots; ++j) {
      AddParameter(
          joint + ".table_" + std::to_string(i) + "_" + std::to_string(j),
          "{effort}", 0.01);
    }
  }
  // Where nobody says what a recording covers (sysid/session/table_range.h).
  const double reach = IsPrismatic() ? 1.0 : M_PI;
  const double fast = IsPrismatic() ? 1.0 : 10.0;
  AddSearchedParameter(joint + ".table_below", "{position}", reach, {reach},
                       -kUnbounded, kUnbounded);
  AddSearchedParameter(joint + ".table_above", "{position}", reach, {reach},
                       -kUnbounded, kUnbounded);
  AddSearchedParameter(joint + ".table_speed", "{position}/s", fast, {fast},
                       1e-6, 1e6);
  Fill(SmoothShapes(kKnots, false), &straight_);
  Fill(SmoothShapes(kKnots, true), &turning_);
}

bool ForceTable::IsTurn(double below, double above) {
  return above + below > 2 * M_PI - 1e-6;
}

}  // namespace sysid
