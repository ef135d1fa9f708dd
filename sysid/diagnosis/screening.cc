#include "sysid/diagnosis/screening.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "sysid/diagnosis/candidate_columns.h"
#include "sysid/diagnosis/statistics.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

constexpr double kSignificance = 0.01;  // of `detectable`
constexpr double kPower = 0.8;
constexpr int kMostPairs = 10;  // that are kept

// The weights of some columns of a candidate that its bounds allow.
struct Weights {
  int set = 0;
  std::vector<int> identifiable;  // columns of the set, given the data
  std::vector<int> active;        // those that the bounds leave
  Eigen::VectorXd alpha;          // of those
  double score = 0.0;
};

// Values of the candidate's parameters.
std::vector<double> Values(const Candidate& candidate, const Weights& weights) {
  const ProbeSet& probes = candidate.sets[weights.set];
  std::vector<double> alpha(candidate.columns(weights.set), 0.0);
  for (size_t i = 0; i < weights.active.size(); ++i) {
    alpha[weights.active[i]] = weights.alpha[i];
  }
  std::vector<double> values;
  if (!probes.empty()) {
    const std::vector<double> none(probes.size(), 0.0);
    const std::vector<double> from = candidate.effect->FromProbes(probes, none);
    values = candidate.effect->FromProbes(
        probes, {alpha.begin(), alpha.begin() + probes.size()});
    for (size_t p = 0; p < values.size(); ++p) {
      if (candidate.IsSearched(p)) continue;
      values[p] += candidate.parameters[p].nominal - from[p];
    }
  }
  for (size_t i = probes.size(); i < alpha.size(); ++i) {
    values.push_back(candidate.parameters[values.size()].nominal + alpha[i]);
  }
  return values;
}

bool Feasible(const Candidate& candidate, const Weights& weights) {
  const std::vector<double> values = Values(candidate, weights);
  for (size_t i = 0; i < values.size(); ++i) {
    const Parameter& parameter = candidate.parameters[i];
    if (values[i] < parameter.lower || values[i] > parameter.upper) {
      return false;
    }
  }
  return candidate.effect
      ->Implausible({values.begin(), values.begin() + candidate.own()})
      .empty();
}

// The active columns among those of all candidates.
std::vector<int> Global(const Candidate& candidate, const Weights& weights) {
  std::vector<int> columns;
  for (const int i : weights.active) {
    columns.push_back(candidate.first[weights.set] + i);
  }
  return columns;
}

class Screener {
 public:
  Screener(const LinearizedFit& fit, const Model& fitted,
           const std::vector<std::shared_ptr<const Effect>>& effects,
           const std::set<std::string>& known);
  Screening Run();

 private:
  void ComputeColumns();
  Weights Best(const Candidate& candidate) const;
  Eigen::MatrixXd Gram(const std::vector<int>& columns) const;
  ScreenedEffect Describe(const Candidate& candidate, const Weights& weights,
                          int tests) const;
  void Compare(const std::vector<Weights>& weights, Screening* screening) const;
  int Threads() const { return fit_.problem().options().threads; }
  const std::stop_token& Stop() const { return fit_.problem().options().stop; }
  double PredictedError(double score, int dof) const;
  double Criterion(double score, int dof) const;

  const LinearizedFit& fit_;
  const Model& fitted_;
  std::set<std::string> free_;  // names of parameters
  std::vector<Candidate> candidates_;
  std::vector<Eigen::MatrixXd> A_;    // per segment, projected
  Eigen::VectorXd unprojected_;       // squared lengths of the columns before
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

void Screener::ComputeColumns() {
  const auto& segments = fit_.segments();
  const int count = static_cast<int>(segments.size());
  std::vector<Eigen::MatrixXd> responses =
      RespondToCandidates(fit_, fitted_, candidates_);
  const int total = static_cast<int>(responses.front().cols());
  A_.resize(count);
  unprojected_ = Eigen::VectorXd::Zero(total);
  for (const Eigen::MatrixXd& response : responses) {
    unprojected_ += response.colwise().squaredNorm().transpose();
  }
  ParallelFor(count, Threads(), Stop(), [&](int s) {
    A_[s] = fit_.WithoutStates(*segments[s], responses[s]);
    responses[s].resize(0, 0);
    return true;
  });
  fit_.ProjectOutTheta(&A_);
  b_ = Eigen::VectorXd::Zero(total);
  for (int s = 0; s < count; ++s) {
    b_.noalias() += A_[s].transpose() * segments[s]->r;
  }
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

// The weights of the set that gains most within the bounds: of all columns that
// the data tells of, or of fewer where those leave the bounds.
Weights Screener::Best(const Candidate& candidate) const {
  // A column of which projecting leaves less than this (squared) is what
  // states, free parameters or the columns before it explain already.
  constexpr double kAlias = 1e-7;
  constexpr double kClear = 9.0;     // of the variance that remains
  constexpr double kMostSize = 1e4;  // times the typical one
  Weights best;
  best.score = -1.0;
  for (int s = 0; s < static_cast<int>(candidate.sets.size()); ++s) {
    const int count = candidate.columns(s);
    std::vector<int> all(count);
    std::iota(all.begin(), all.end(), candidate.first[s]);
    const Eigen::MatrixXd C = Gram(all);
    // Pivoted: the column that is clearest goes first.
    std::vector<int> kept;
    Eigen::VectorXd left(count);
    const int probes = static_cast<int>(candidate.sets[s].size());
    for (int i = 0; i < count; ++i) {
      const double own = unprojected_[candidate.first[s] + i];
      left[i] = own > 0 ? C(i, i) / own : 0.0;
      // A probe's parameter would not show at any size, nor its law at its
      // secant; a nominal value the data knows worse than by its own size,
      // unless it asks for many times that (the inertia of what was taken for a
      // point).
      const bool probe = i < probes;
      const double most = std::max(
          candidate.parameters[candidate.ParameterOf(s, i)].typical_scale *
              (probe ? kMostSize : 1.0),
          probe ? std::abs(candidate.sets[s][i].secant) : 0.0);
      const double gain = std::pow(b_[candidate.first[s] + i], 2) / C(i, i);
      const bool asked = !probe && gain > kClear * squares_ / dof_;
      if (!(C(i, i) * most * most > 1.0) && !asked) left[i] = 0.0;
    }
    std::vector<int> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return left[a] > left[b]; });
    for (const int i : order) {
      if (!(left[i] > kAlias)) continue;
      std::vector<int> with = kept;
      with.push_back(i);
      const Eigen::MatrixXd part = C(with, with);
      const Eigen::VectorXd scale = part.diagonal().cwiseSqrt().cwiseInverse();
      const Eigen::MatrixXd scaled =
          scale.asDiagonal() * part * scale.asDiagonal();
      const Eigen::LLT<Eigen::MatrixXd> llt(scaled);
      if (llt.info() != Eigen::Success) continue;
      const double pivot = llt.matrixL()(with.size() - 1, with.size() - 1);
      if (pivot * pivot > 1e-4) kept = with;
    }
    // A parameter that comes out of several probes (a reference) needs them
    // all: with one of them it would be some other effect in disguise.
    const int identifiable_probes = static_cast<int>(std::count_if(
        kept.begin(), kept.end(), [&](int i) { return i < probes; }));
    if (candidate.ComesOfAllProbes() && identifiable_probes < probes) continue;
    // All subsets, the whole first.
    const int n = static_cast<int>(kept.size());
    for (int mask = (1 << n) - 1; mask > 0; --mask) {
      Weights weights;
      weights.set = s;
      weights.identifiable = kept;
      for (int i = 0; i < n; ++i) {
        if (mask & (1 << i)) weights.active.push_back(kept[i]);
      }
      const std::vector<int> global = Global(candidate, weights);
      const Eigen::VectorXd b = b_(global);
      weights.alpha = -C(weights.active, weights.active).ldlt().solve(b);
      weights.score = -weights.alpha.dot(b);
      if (!Feasible(candidate, weights)) continue;
      if (weights.score > best.score) best = weights;
      if (mask == (1 << n) - 1) break;  // nothing gains more than all
    }
    if (best.score < 0 && n > 0) {  // the bounds leave nothing but null
      best.set = s;
      best.identifiable = best.active = kept;
      best.alpha = Eigen::VectorXd::Zero(n);
      best.score = 0.0;
    }
  }
  return best;
}

double Screener::PredictedError(double score, int dof) const {
  return std::sqrt(std::max(0.0, squares_ - score) / std::max(1.0, dof_ - dof));
}

double Screener::Criterion(double score, int dof) const {
  const double left = std::max(1e-12, 1.0 - score / squares_);
  return independent_ * std::log(left) + dof * std::log(independent_);
}

ScreenedEffect Screener::Describe(const Candidate& candidate,
                                  const Weights& weights, int tests) const {
  ScreenedEffect out;
  out.effect = candidate.effect;
  out.dof = static_cast<int>(weights.active.size());
  out.score = weights.score;
  out.predicted_error = PredictedError(weights.score, out.dof);
  out.criterion = Criterion(weights.score, out.dof);
  const std::vector<int> columns = Global(candidate, weights);
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
  const std::vector<double> values = Values(candidate, weights);
  Eigen::MatrixXd D(values.size(), out.dof);
  for (int i = 0; i < out.dof; ++i) {
    Weights moved = weights;
    const double step =
        1e-3 * std::max(std::sqrt(test.covariance(i, i)), 1e-12);
    moved.alpha[i] += step;
    const std::vector<double> there = Values(candidate, moved);
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

// Pairs and confusability, of the candidates at their best.
void Screener::Compare(const std::vector<Weights>& weights,
                       Screening* screening) const {
  const int n = static_cast<int>(candidates_.size());
  std::vector<int> columns;
  std::vector<std::vector<int>> own(n);  // of a candidate, among `columns`
  for (int i = 0; i < n; ++i) {
    for (const int column : Global(candidates_[i], weights[i])) {
      own[i].push_back(static_cast<int>(columns.size()));
      columns.push_back(column);
    }
  }
  const Eigen::MatrixXd C = Gram(columns);
  const Eigen::VectorXd b = b_(columns);
  std::vector<Eigen::LDLT<Eigen::MatrixXd>> inverse(n);
  for (int i = 0; i < n; ++i) inverse[i].compute(C(own[i], own[i]));
  screening->confusability.setIdentity(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      if (i == j || !(weights[i].score > 0)) continue;
      const Eigen::VectorXd seen = C(own[j], own[i]) * weights[i].alpha;
      screening->confusability(i, j) = std::clamp(
          seen.dot(inverse[j].solve(seen)) / weights[i].score, 0.0, 1.0);
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) {
      std::vector<int> both = own[i];
      both.insert(both.end(), own[j].begin(), own[j].end());
      const int k = static_cast<int>(both.size());
      const Eigen::MatrixXd joint = C(both, both);
      const Eigen::VectorXd rhs = b(both);
      const Eigen::VectorXd scale = joint.diagonal().cwiseSqrt().cwiseInverse();
      const Eigen::LLT<Eigen::MatrixXd> llt(scale.asDiagonal() * joint *
                                            scale.asDiagonal());
      if (llt.info() != Eigen::Success ||
          !(llt.matrixLLT().diagonal().minCoeff() > 1e-3)) {
        continue;
      }
      const Eigen::VectorXd alpha =
          -(scale.asDiagonal() * llt.solve((scale.asDiagonal() * rhs).eval()));
      Weights wi = weights[i], wj = weights[j];
      wi.alpha = alpha.head(own[i].size());
      wj.alpha = alpha.tail(own[j].size());
      if (!Feasible(candidates_[i], wi) || !Feasible(candidates_[j], wj)) {
        continue;
      }
      const double score = -alpha.dot(rhs);
      screening->pairs.push_back(
          {j, i, PredictedError(score, k), Criterion(score, k)});
    }
  }
}

Screening Screener::Run() {
  Screening screening;
  screening.error = std::sqrt(squares_ / dof_);
  for (const Candidate& candidate : candidates_) {
    screening.tests += static_cast<int>(candidate.sets.size());
  }
  if (candidates_.empty()) return screening;
  ComputeColumns();
  std::vector<Weights> best(candidates_.size());
  ParallelFor(static_cast<int>(best.size()), Threads(), Stop(), [&](int i) {
    best[i] = Best(candidates_[i]);
    return true;
  });
  // Best first.
  const auto criterion = [&](int i) {
    return Criterion(best[i].score, static_cast<int>(best[i].active.size()));
  };
  std::vector<int> order(best.size());
  std::iota(order.begin(), order.end(), 0);
  std::erase_if(order, [&](int i) { return best[i].active.empty(); });
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return criterion(a) < criterion(b); });
  std::vector<Weights> weights;
  std::vector<Candidate> identifiable;
  for (const int i : order) {
    weights.push_back(std::move(best[i]));
    identifiable.push_back(std::move(candidates_[i]));
  }
  candidates_ = std::move(identifiable);
  screening.effects.resize(candidates_.size());
  ParallelFor(static_cast<int>(candidates_.size()), Threads(), Stop(),
              [&](int i) {
                screening.effects[i] =
                    Describe(candidates_[i], weights[i], screening.tests);
                return true;
              });
  Compare(weights, &screening);
  std::sort(
      screening.pairs.begin(), screening.pairs.end(),
      [](const auto& a, const auto& b) { return a.criterion < b.criterion; });
  if (screening.pairs.size() > kMostPairs) screening.pairs.resize(kMostPairs);
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
