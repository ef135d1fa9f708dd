#include "sysid/inverse_dynamics/equation_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "models/math/decompositions.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

// Two joints, the plain laws of each as columns, and an effort that is viscous
// friction of the first and noise.
struct TwoJoints {
  TwoJoints() : columns(Columns()) {
    constexpr int kTimes = 300;
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    EquationRows rows;
    rows.nv = 2;
    rows.rows.setZero(kTimes * 2, kColumns + 1);
    rows.effort.resize(kTimes, 2);
    rows.rests.setConstant(kTimes, 2, false);
    for (int t = 0; t < kTimes; ++t) {
      rows.t.push_back(0.05 * t);
      for (int v = 0; v < 2; ++v) {
        const double phase = (1.0 + 0.4 * v) * 0.05 * t;
        const double qd = std::cos(phase);
        const double noise = 0.01 * normal(random);
        auto row = rows.rows.row(t * 2 + v);
        for (size_t k = 0; k < columns.candidates.size(); ++k) {
          const EquationColumns::Candidate& one = columns.candidates[k];
          if (one.effect->joint() != columns.passes[0].model.movers()[v].joint)
            continue;
          const std::string kind = one.effect->kind();
          row[one.first] = kind == "viscous_damping" ? -qd
                           : kind == "coulomb_friction"
                               ? -std::copysign(1.0, qd)
                           : kind == "armature" ? std::sin(phase)
                                                : 1.0;
        }
        row[kColumns] = rows.effort(t, v) = (v == 0 ? 0.2 * qd : 0.0) + noise;
      }
    }
    runs = {rows};
  }

  static EquationColumns Columns() {
    const Model model = Shipped("pendulum2_planar");
    const Catalogue catalogue;
    std::vector<std::shared_ptr<const Effect>> effects;
    for (const char* kind :
         {"viscous_damping", "coulomb_friction", "armature", "effort_bias"}) {
      for (const char* joint : {"@joint1", "@joint2"}) {
        effects.push_back(catalogue.Make(std::string(kind) + joint,
                                         model.mechanism(), "test"));
      }
    }
    return MakeEquationColumns(model, {}, effects, {}, false);
  }

  std::unique_ptr<EquationSearch> Search() const {
    auto search = std::make_unique<EquationSearch>(
        std::make_unique<EquationModels>(columns, std::vector<FreeParameter>(),
                                         gains, runs, EquationModels::Bodies(),
                                         std::vector<int>(), false),
        [] {});
    search->Run();
    return search;
  }

  static constexpr int kColumns = 8;
  const EquationColumns columns;
  const std::vector<int> gains = {-1, -1};
  std::vector<EquationRows> runs;
};

TEST(EquationSearch, KeepsOfThePlainLawsWhatIsMissed) {
  const TwoJoints two;
  const auto search = two.Search();
  double found = 0.0;
  for (const int k : search->chosen()) {
    const std::string name = two.columns.candidates[k].effect->name();
    const EquationModels::Estimate estimate = search->EstimateOf(k);
    if (name == "viscous_damping@joint1") {
      found = estimate.values[0];
      EXPECT_LT(estimate.std_errors[0], 0.005);
    } else {
      EXPECT_LT(std::abs(estimate.values[0]), 0.01) << name;
    }
  }
  EXPECT_NEAR(found, 0.2, 0.005);
  EXPECT_LE(search->chosen().size(), 2u);
}

// From the products of the stretches, what least squares of all other rows
// gives.
TEST(EquationSearch, LeavesStretchesOutAsLeastSquaresOfTheOthersDoes) {
  const TwoJoints two;
  const auto search = two.Search();
  const EquationModels::Fit& now = search->now();
  const EquationRows& rows = two.runs[0];
  const auto stretches = static_cast<int>(now.without.rows());
  ASSERT_EQ(stretches, 20);
  const auto n = static_cast<Eigen::Index>(now.at.size());
  for (int k = 0; k < stretches; ++k) {
    const int from = k * rows.times() / stretches;
    const int to = (k + 1) * rows.times() / stretches;
    Eigen::MatrixXd A(0, n);
    Eigen::VectorXd r(0);
    for (int i = 0; i < rows.rows.rows(); ++i) {
      if (i >= 2 * from && i < 2 * to) continue;
      A.conservativeResize(A.rows() + 1, n);
      r.conservativeResize(A.rows());
      const double s = std::sqrt(now.variance[i % 2]);
      A.bottomRows(1) = rows.rows.row(i)(now.at) / s;
      r[A.rows() - 1] = rows.rows(i, TwoJoints::kColumns) / s;
    }
    const Eigen::VectorXd d = -LeastSquares(A, r);
    EXPECT_LT((now.without.row(k).transpose() - d).norm(), 1e-6 * d.norm());
    Eigen::Vector2d left = Eigen::Vector2d::Zero();
    for (int i = 2 * from; i < 2 * to; ++i) {
      left[i % 2] += std::pow(
          rows.rows(i, TwoJoints::kColumns) + rows.rows.row(i)(now.at).dot(d),
          2);
    }
    EXPECT_LT((now.squares.row(k).transpose() - left).norm(),
              1e-6 * left.norm());
  }
}

}  // namespace
}  // namespace sysid
