#include "sysid/diagnosis/screening.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "models/math/decompositions.h"
#include "sysid/diagnosis/candidate_columns.h"
#include "sysid/diagnosis/candidate_weights.h"
#include "sysid/diagnosis/columns_by_forces.h"
#include "sysid/diagnosis/grid_choice.h"
#include "sysid/diagnosis/statistics.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

constexpr double kSignificance = 0.01;  // of `detectable`
constexpr double kPower = 0.8;
// So many columns of the best sets are made exact, and of all sets twice as
// many: about a dozen candidates, more than a search refits.
constexpr int kExactColumns = 24;

class Screener {
 public:
  Screener(const LinearizedFit& fit, const Model& fitted,
           const std::vector<std::shared_ptr<const Effect>>& effects,
           const std::set<std::string>& known);
  Screening Run();

 private:
  // Columns of some sets, one after the other, without states and Theta.
  struct Columns {
    std::vector<CandidateSet> sets;
    std::vector<int> first;          // of each set
    std::vector<Eigen::MatrixXd> A;  // per segment
    Eigen::VectorXd own, b;          // as in ColumnProducts
  };
  Columns Project(const std::vector<CandidateSet>& sets,
                  std::vector<Eigen::MatrixXd> responses,
                  const ThetaBasis& theta) const;
  ColumnProducts ProductsOf(const Columns& columns, size_t set) const;
  void Take(const Columns& columns, size_t set, Weights weights);
  void TakeBest(const Columns& columns);
  void TakeExactly(const std::vector<CandidateSet>& sets) {
    if (sets.empty()) return;
    for (const CandidateSet& at : sets) exact_[at.candidate] = true;
    TakeBest(Project(sets,
                     RespondToCandidates(fit_, fitted_, candidates_, sets),
                     fit_.theta_basis()));
  }
  void ChooseColumns();
  std::vector<int> Order() const;
  std::vector<CandidateSet> Leaders(
      const std::vector<std::vector<int>>& sets) const;
  // The active columns of a candidate, among those in A.
  std::vector<int> Global(int candidate, const Weights& weights) const {
    std::vector<int> columns = weights.active;
    for (int& column : columns) column += first_[candidate];
    return columns;
  }
  Eigen::MatrixXd Gram(const std::vector<int>& columns) const;
  ScreenedEffect Describe(int i, const Weights& weights, int tests) const;
  int Threads() const { return fit_.problem().options().threads; }
  const std::stop_token& Stop() const { return fit_.problem().options().stop; }
  double PredictedError(double score, int dof) const;
  double Criterion(double score, int dof) const;
  double CriterionOf(const Weights& weights) const {
    return Criterion(weights.score, static_cast<int>(weights.active.size()));
  }

  const LinearizedFit& fit_;
  const Model& fitted_;
  std::set<std::string> free_;  // names of parameters
  std::vector<Candidate> candidates_;
  std::vector<Weights> best_;         // of each
  std::vector<bool> exact_;           // whether its columns are
  std::vector<int> first_;            // column of its set in A
  std::vector<Eigen::MatrixXd> A_;    // per segment, projected
  Eigen::VectorXd b_;                 // A' r
  double squares_ = 0.0, dof_ = 0.0;  // of r
  double independent_ = 0.0;
};

Screener::Screener(const LinearizedFit& fit, const Model& fitted,
                   const std::vector<std::shared_ptr<const Effect>>& effects,
                   const std::set<std::string>& known)
    : fit_(fit), fitted_(fitted) {
  for (const FreeParameter& f : fit.problem().free()) {
    free_.insert(f.parameter.name);
  }
  std::set<std::string> taken = known;
  taken.insert(free_.begin(), free_.end());
  candidates_ = MakeCandidates(fitted, effects, taken);
  squares_ = fit.SumOfSquares();
  dof_ = fit.DegreesOfFreedom();
  independent_ = std::max(10.0, dof_ / fit.AutocorrelationTime());
}

Screener::Columns Screener::Project(const std::vector<CandidateSet>& sets,
                                    std::vector<Eigen::MatrixXd> responses,
                                    const ThetaBasis& theta) const {
  const auto& segments = fit_.segments();
  const int count = static_cast<int>(segments.size());
  Columns out;
  out.sets = sets;
  int total = 0;
  for (const CandidateSet& at : sets) {
    out.first.push_back(total);
    total += candidates_[at.candidate].columns(at.set);
  }
  out.own = out.b = Eigen::VectorXd::Zero(total);
  for (const Eigen::MatrixXd& response : responses) {
    out.own += response.colwise().squaredNorm().transpose();
  }
  out.A = std::move(responses);
  ParallelFor(count, Threads(), Stop(), [&](int s) {
    out.A[s] = fit_.WithoutStates(*segments[s], out.A[s]);
    return true;
  });
  theta.ProjectOut(fit_.problem().processes(), Threads(), &out.A);
  for (int s = 0; s < count; ++s) {
    out.b.noalias() += out.A[s].transpose() * segments[s]->r;
  }
  return out;
}

ColumnProducts Screener::ProductsOf(const Columns& columns, size_t set) const {
  const CandidateSet& at = columns.sets[set];
  const int first = columns.first[set];
  const int size = candidates_[at.candidate].columns(at.set);
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(size, size);
  for (const Eigen::MatrixXd& A : columns.A) {
    const auto part = A.middleCols(first, size);
    C.noalias() += part.transpose() * part;
  }
  return {C, columns.b.segment(first, size), columns.own.segment(first, size)};
}

// Puts a set's columns to the place of its candidate.
void Screener::Take(const Columns& columns, size_t set, Weights weights) {
  const CandidateSet& at = columns.sets[set];
  const int from = columns.first[set], to = first_[at.candidate];
  const int size = candidates_[at.candidate].columns(at.set);
  for (size_t s = 0; s < A_.size(); ++s) {
    A_[s].middleCols(to, size) = columns.A[s].middleCols(from, size);
  }
  b_.segment(to, size) = columns.b.segment(from, size);
  best_[at.candidate] = std::move(weights);
}

// Of each candidate the set that gains most.
void Screener::TakeBest(const Columns& columns) {
  std::vector<Weights> weights(columns.sets.size());
  std::vector<double> gains(columns.sets.size());
  ParallelFor(static_cast<int>(columns.sets.size()), Threads(), [&](int i) {
    const CandidateSet& at = columns.sets[i];
    const Candidate& candidate = candidates_[at.candidate];
    const ColumnProducts products = ProductsOf(columns, i);
    weights[i] = BestWeights(candidate, at.set, products, squares_ / dof_);
    gains[i] = weights[i].active.empty()
                   ? -std::numeric_limits<double>::infinity()
                   : GainOf(candidate, weights[i], products);
    return true;
  });
  std::map<int, size_t> best;  // of a candidate, among the sets
  for (size_t i = 0; i < columns.sets.size(); ++i) {
    const auto [at, first] = best.try_emplace(columns.sets[i].candidate, i);
    if (!first && gains[i] > gains[at->second]) at->second = i;
  }
  for (const auto& [candidate, set] : best) Take(columns, set, weights[set]);
}

Eigen::MatrixXd Screener::Gram(const std::vector<int>& columns) const {
  const int k = static_cast<int>(columns.size());
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(k, k);
  for (const Eigen::MatrixXd& A : A_) {
    const Eigen::MatrixXd part = A(Eigen::all, columns);
    C.selfadjointView<Eigen::Lower>().rankUpdate(part.transpose());
  }
  return C.selfadjointView<Eigen::Lower>();
}

double Screener::PredictedError(double score, int dof) const {
  return std::sqrt(std::max(0.0, squares_ - score) / std::max(1.0, dof_ - dof));
}

double Screener::Criterion(double score, int dof) const {
  const double left = std::max(1e-12, 1.0 - score / squares_);
  return independent_ * std::log(left) + dof * std::log(independent_);
}

ScreenedEffect Screener::Describe(int i, const Weights& weights,
                                  int tests) const {
  const Candidate& candidate = candidates_[i];
  ScreenedEffect out;
  out.effect = candidate.effect;
  out.dof = static_cast<int>(weights.active.size());
  out.score = weights.score;
  out.predicted_error = PredictedError(weights.score, out.dof);
  out.criterion = Criterion(weights.score, out.dof);
  const std::vector<int> columns = Global(i, weights);
  const auto& segments = fit_.segments();
  BlockScores left(segments.size(), out.dof);
  for (size_t s = 0; s < segments.size(); ++s) {
    const Eigen::MatrixXd part = A_[s](Eigen::all, columns);
    left.Add(part, segments[s]->r + part * weights.alpha);
  }
  const WaldTest test =
      TestWeights(Gram(columns), weights.alpha, left.scores(), left.squares(),
                  std::max(1.0, dof_ - out.dof));
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

// Candidates of which something shows, best first.
std::vector<int> Screener::Order() const {
  std::vector<int> order(best_.size());
  std::iota(order.begin(), order.end(), 0);
  std::erase_if(order, [&](int i) { return best_[i].active.empty(); });
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return CriterionOf(best_[a]) < CriterionOf(best_[b]);
  });
  return order;
}

// The sets of the first candidates, of which more is expected than what their
// parameters cost, to be compared exactly: their best ones first.
std::vector<CandidateSet> Screener::Leaders(
    const std::vector<std::vector<int>>& sets) const {
  std::vector<CandidateSet> leaders;
  int columns = 0;
  for (const int i : Order()) {
    if (!(CriterionOf(best_[i]) < 0.0)) break;
    if (exact_[i]) continue;
    columns += candidates_[i].columns(sets[i].front());
    if (columns > kExactColumns) break;
    leaders.push_back({i, sets[i].front()});
  }
  columns = 0;
  const size_t count = leaders.size();
  for (size_t l = 0; l < count; ++l) {
    const int i = leaders[l].candidate;
    for (size_t k = 1; k < sets[i].size(); ++k) {
      columns += candidates_[i].columns(sets[i][k]);
      if (columns > kExactColumns) return leaders;
      leaders.push_back({i, sets[i][k]});
    }
  }
  return leaders;
}

// Sets best_, and what the best sets of the candidates are to the errors.
void Screener::ChooseColumns() {
  const int count = static_cast<int>(candidates_.size());
  std::vector<std::vector<int>> sets(count);
  int points = 0;  // columns of all sets
  for (int i = 0; i < count; ++i) {
    sets[i].resize(candidates_[i].sets.size());
    std::iota(sets[i].begin(), sets[i].end(), 0);
    for (const int set : sets[i]) points += candidates_[i].columns(set);
  }
  std::optional<ColumnsByForces> by_forces;  // none: all are exact
  if (points > 2 * kExactColumns) {
    by_forces.emplace(fit_, fitted_);
    sets = ChooseSets(fit_, *by_forces, candidates_, squares_ / dof_);
  }
  int columns = 0;
  std::vector<CandidateSet> plain, exact;
  for (int i = 0; i < count; ++i) {
    first_.push_back(columns);
    int most = 0;
    for (const int set : sets[i]) {
      most = std::max(most, candidates_[i].columns(set));
    }
    columns += most;
    if (by_forces && by_forces->Says(candidates_[i])) {
      plain.push_back({i, sets[i].front()});
    } else {
      for (const int set : sets[i]) exact.push_back({i, set});
    }
  }
  best_.resize(count);
  exact_.resize(count, false);
  b_ = Eigen::VectorXd::Zero(columns);
  for (const auto& segment : fit_.segments()) {
    A_.push_back(Eigen::MatrixXd::Zero(segment->basis.rows(), columns));
  }
  if (!plain.empty()) {
    std::vector<Eigen::MatrixXd> responses(fit_.segments().size());
    by_forces->ForEachSegment(
        candidates_, plain,
        [&](int s, const Eigen::MatrixXd& A) { responses[s] = A; });
    TakeBest(Project(plain, std::move(responses), by_forces->theta_basis()));
  }
  TakeExactly(exact);
  TakeExactly(Leaders(sets));
  // One that leads since others have lost by being exact.
  for (std::vector<int> order = Order();
       !order.empty() && !exact_[order.front()] &&
       CriterionOf(best_[order.front()]) < 0.0;
       order = Order()) {
    std::vector<CandidateSet> first;
    for (const int set : sets[order.front()]) {
      first.push_back({order.front(), set});
    }
    TakeExactly(first);
  }
}

Screening Screener::Run() {
  Screening screening;
  screening.error = std::sqrt(squares_ / dof_);
  for (const Candidate& candidate : candidates_) {
    screening.tests += static_cast<int>(candidate.sets.size());
  }
  if (candidates_.empty() || fit_.segments().empty()) return screening;
  ChooseColumns();
  std::vector<Weights> weights;
  std::vector<Candidate> identifiable;
  std::vector<int> first;
  for (const int i : Order()) {
    weights.push_back(std::move(best_[i]));
    identifiable.push_back(std::move(candidates_[i]));
    first.push_back(first_[i]);
  }
  candidates_ = std::move(identifiable);
  first_ = std::move(first);
  screening.effects.resize(candidates_.size());
  ParallelFor(static_cast<int>(candidates_.size()), Threads(), Stop(),
              [&](int i) {
                screening.effects[i] = Describe(i, weights[i], screening.tests);
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
