#include "sysid/linearization/screening.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/math/decompositions.h"
#include "sysid/estimation/parallel.h"
#include "sysid/linearization/candidate_batch.h"
#include "sysid/linearization/candidate_columns.h"
#include "sysid/linearization/candidate_weights.h"
#include "sysid/linearization/probe_choice.h"
#include "sysid/linearization/statistics.h"

namespace sysid {
namespace {

constexpr double kSignificance = 0.01;  // of `detectable`
constexpr double kPower = 0.8;
// So many columns are few: every point of every grid gets its own.
constexpr int kFewColumns = 48;

std::vector<CandidateSet> SetsToCompare(
    const LinearizedFit& fit, const Model& fitted,
    const std::vector<Candidate>& candidates) {
  std::vector<CandidateSet> all;
  for (int i = 0; i < static_cast<int>(candidates.size()); ++i) {
    for (int s = 0; s < static_cast<int>(candidates[i].sets.size()); ++s) {
      all.push_back({i, s});
    }
  }
  return CountColumns(candidates, all) <= kFewColumns
             ? all
             : ChooseProbeSets(fit, fitted, candidates);
}

class Screener {
 public:
  Screener(const LinearizedFit& fit, const Model& fitted,
           const std::vector<std::shared_ptr<const Effect>>& effects,
           const std::set<std::string>& known);
  Screening Run();

 private:
  // A candidate with those of its columns that gain most.
  struct Best {
    int candidate, first;  // column of the set in A_
    Weights weights;
    double gain, criterion;
  };
  ColumnProducts ProductsOf(int first, int size) const;
  std::vector<Best> BestSets() const;  // the best candidate first
  ScreenedEffect Describe(const Best& best, int tests) const;
  // Less is better: log-likelihood with a penalty for degrees of freedom (BIC)
  // of as many samples as are independent.
  double Criterion(double score, size_t dof) const;

  const LinearizedFit& fit_;
  std::set<std::string> free_;  // names of parameters
  std::vector<Candidate> candidates_;
  std::vector<CandidateSet> sets_;
  std::vector<Eigen::MatrixXd> A_;  // their columns, without states and Theta
  Eigen::VectorXd own_;             // squared lengths as they were with them
  double squares_, dof_;            // of r
  double independent_;              // samples
};

Screener::Screener(const LinearizedFit& fit, const Model& fitted,
                   const std::vector<std::shared_ptr<const Effect>>& effects,
                   const std::set<std::string>& known)
    : fit_(fit),
      squares_(fit.SumOfSquares()),
      dof_(fit.DegreesOfFreedom()),
      independent_(std::max(10.0, dof_ / fit.AutocorrelationTime())) {
  for (const FreeParameter& f : fit.problem().free()) {
    free_.insert(f.parameter.name);
  }
  std::set<std::string> taken = known;
  taken.insert(free_.begin(), free_.end());
  candidates_ = MakeCandidates(fitted, effects, taken);
  if (candidates_.empty() || fit.segments().empty()) return;
  sets_ = SetsToCompare(fit, fitted, candidates_);
  A_ = RespondToCandidates(fit, fitted, candidates_, sets_);
  own_ = Eigen::VectorXd::Zero(A_.front().cols());
  for (size_t s = 0; s < A_.size(); ++s) {
    own_ += A_[s].colwise().squaredNorm().transpose();
    A_[s] = fit.WithoutStates(*fit.segments()[s], A_[s]);
  }
  fit.ProjectOutTheta(&A_);
}

ColumnProducts Screener::ProductsOf(int first, int size) const {
  ColumnProducts products{Eigen::MatrixXd::Zero(size, size),
                          Eigen::VectorXd::Zero(size),
                          own_.segment(first, size)};
  for (size_t s = 0; s < A_.size(); ++s) {
    const auto part = A_[s].middleCols(first, size);
    products.C.noalias() += part.transpose() * part;
    products.b.noalias() += part.transpose() * fit_.segments()[s]->r;
  }
  return products;
}

double Screener::Criterion(double score, size_t dof) const {
  const double left = std::max(1e-12, 1.0 - score / squares_);
  return independent_ * std::log(left) +
         static_cast<double>(dof) * std::log(independent_);
}

std::vector<Screener::Best> Screener::BestSets() const {
  std::vector<Best> best;
  int next = 0;
  for (const CandidateSet& at : sets_) {
    const Candidate& candidate = candidates_[at.candidate];
    const int first = next, size = candidate.columns(at.set);
    next += size;
    const ColumnProducts products = ProductsOf(first, size);
    const Weights weights =
        BestWeights(candidate, at.set, products, squares_ / dof_);
    if (weights.active.empty()) continue;
    const double gain = GainOf(candidate, weights, products);
    const bool is_other = best.empty() || best.back().candidate != at.candidate;
    if (is_other) best.emplace_back();
    if (!is_other && gain <= best.back().gain) continue;
    best.back() = {at.candidate, first, weights, gain,
                   Criterion(weights.score, weights.active.size())};
  }
  std::stable_sort(best.begin(), best.end(), [](const Best& a, const Best& b) {
    return a.criterion < b.criterion;
  });
  return best;
}

ScreenedEffect Screener::Describe(const Best& best, int tests) const {
  const Candidate& candidate = candidates_[best.candidate];
  const Weights& weights = best.weights;
  ScreenedEffect out;
  out.effect = candidate.effect;
  out.dof = static_cast<int>(weights.active.size());
  out.score = weights.score;
  const double dof = std::max(1.0, dof_ - out.dof);
  out.predicted_error =
      std::sqrt(std::max(0.0, squares_ - weights.score) / dof);
  const auto& segments = fit_.segments();
  BlockScores left(segments.size(), out.dof);
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(out.dof, out.dof);
  std::vector<int> columns = weights.active;
  for (int& column : columns) column += best.first;
  for (size_t s = 0; s < segments.size(); ++s) {
    const Eigen::MatrixXd part = A_[s](Eigen::all, columns);
    C.noalias() += part.transpose() * part;
    left.Add(part, segments[s]->r + part * weights.alpha);
  }
  const WaldTest test =
      TestWeights(C, weights.alpha, left.scores(), left.squares(), dof);
  out.p_value = std::min(1.0, test.p_value * tests);
  // To the parameters: covariance through the derivative of the values.
  const std::vector<double> values = ValuesOf(candidate, weights);
  Eigen::MatrixXd D(values.size(), out.dof);
  for (int i = 0; i < out.dof; ++i) {
    Weights moved = weights;
    const double step =
        1e-3 * std::max(std::sqrt(test.covariance(i, i)), 1e-12);
    moved.alpha[i] += step;
    const std::vector<double> there = ValuesOf(candidate, moved);
    for (size_t v = 0; v < values.size(); ++v) {
      D(v, i) = (there[v] - values[v]) / step;
    }
  }
  const Eigen::MatrixXd covariance = D * test.covariance * D.transpose();
  const double reach =
      NormalQuantile(0.5 * kSignificance / tests) + NormalQuantile(1 - kPower);
  // One that has no column that changes the residuals has none, unless it is
  // found by other means.
  const auto has_influence = [&](size_t p) {
    return candidate.IsSearched(p) ||
           (p < candidate.own() &&
            !candidate.effect->parameters()[p].grid.empty()) ||
           std::any_of(weights.identifiable.begin(), weights.identifiable.end(),
                       [&](int column) {
                         return candidate.ParameterOf(weights.set, column) == p;
                       });
  };
  for (size_t p = 0; p < values.size(); ++p) {
    const Parameter& parameter = candidate.parameters[p];
    if (free_.contains(parameter.name)) {
      continue;  // of an effect that this one replaces
    }
    if (!has_influence(p)) {
      out.without_influence.push_back(parameter.name);
      continue;
    }
    ExpectedParameter expected;
    expected.name = parameter.name;
    expected.unit = parameter.unit;
    expected.value = values[p];
    expected.null_value = parameter.nominal;
    expected.searched = candidate.IsSearched(p);
    // A value that a bound holds has none.
    expected.std_error = covariance(p, p) > 0
                             ? std::sqrt(covariance(p, p))
                             : std::numeric_limits<double>::quiet_NaN();
    expected.detectable = reach * expected.std_error;
    out.parameters.push_back(expected);
  }
  return out;
}

Screening Screener::Run() {
  Screening screening;
  screening.error = std::sqrt(squares_ / dof_);
  for (const Candidate& candidate : candidates_) {
    screening.tests += static_cast<int>(candidate.sets.size());
  }
  const std::vector<Best> best = BestSets();
  screening.effects.resize(best.size());
  ParallelFor(static_cast<int>(best.size()), fit_.problem().options().threads,
              fit_.problem().options().stop, [&](int i) {
                screening.effects[i] = Describe(best[i], screening.tests);
                return true;
              });
  return screening;
}

}  // namespace

int Screening::IndexOf(const std::string& effect) const {
  const auto at =
      std::find_if(effects.begin(), effects.end(),
                   [&](const ScreenedEffect& e) { return e.name() == effect; });
  return at == effects.end() ? -1 : static_cast<int>(at - effects.begin());
}

Screening ScreenEffects(
    const LinearizedFit& fit, const Model& fitted,
    const std::vector<std::shared_ptr<const Effect>>& candidates,
    const std::set<std::string>& known) {
  return Screener(fit, fitted, candidates, known).Run();
}

}  // namespace sysid
