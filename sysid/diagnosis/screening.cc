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
constexpr int kFewestBlocks = 20;  // of time, for clusters
constexpr int kMostPairs = 10;     // that are kept

// The weights of some columns of a candidate that its bounds allow.
struct Weights {
  int set = 0;
  std::vector<int> identifiable;  // columns of the set, given the data
  std::vector<int> active;        // those that the bounds leave
  Eigen::VectorXd alpha;          // of those
  double score = 0.0;
};

class Screener {
 public:
  Screener(const LinearizedFit& fit, const Model& fitted,
           const std::vector<std::shared_ptr<const Effect>>& effects,
           const std::set<std::string>& known);
  Screening Run();

 private:
  void ComputeColumns();
  Weights Best(const Candidate& candidate) const;
  bool Feasible(const Candidate& candidate, const Weights& weights) const;
  std::vector<double> Values(const Candidate& candidate,
                             const Weights& weights) const;
  Eigen::MatrixXd Gram(const std::vector<int>& columns) const;
  std::vector<int> Global(const Candidate& candidate,
                          const Weights& weights) const;
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

std::vector<int> Screener::Global(const Candidate& candidate,
                                  const Weights& weights) const {
  std::vector<int> columns;
  for (const int i : weights.active) {
    columns.push_back(candidate.first[weights.set] + i);
  }
  return columns;
}

// Values of the effect's own parameters, then of those that it corrects.
std::vector<double> Screener::Values(const Candidate& candidate,
                                     const Weights& weights) const {
  const ProbeSet& probes = candidate.sets[weights.set];
  std::vector<double> alpha(probes.size() + candidate.adjusted.size(), 0.0);
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
      if (!candidate.IsSearched(p)) values[p] += candidate.off[p] - from[p];
    }
  }
  for (size_t i = 0; i < candidate.adjusted.size(); ++i) {
    values.push_back(candidate.adjusted[i].nominal + alpha[probes.size() + i]);
  }
  return values;
}

bool Screener::Feasible(const Candidate& candidate,
                        const Weights& weights) const {
  const std::vector<double> values = Values(candidate, weights);
  const std::vector<EffectParameter>& own = candidate.effect->parameters();
  for (size_t i = 0; i < own.size(); ++i) {
    if (values[i] < own[i].lower || values[i] > own[i].upper) return false;
  }
  for (size_t i = 0; i < candidate.adjusted.size(); ++i) {
    const double value = values[own.size() + i];
    if (value < candidate.adjusted[i].lower ||
        value > candidate.adjusted[i].upper) {
      return false;
    }
  }
  return candidate.effect
      ->Implausible({values.begin(), values.begin() + own.size()})
      .empty();
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
  for (size_t s = 0; s < candidate.sets.size(); ++s) {
    const int count = candidate.columns(static_cast<int>(s));
    std::vector<int> all(count);
    std::iota(all.begin(), all.end(), candidate.first[s]);
    const Eigen::MatrixXd C = Gram(all);
    // Pivoted: the column that is clearest goes first.
    std::vector<int> kept;
    Eigen::VectorXd left(count);
    for (int i = 0; i < count; ++i) {
      const double own = unprojected_[candidate.first[s] + i];
      left[i] = own > 0 ? C(i, i) / own : 0.0;
      const int probes = static_cast<int>(candidate.sets[s].size());
      if (i < probes) {
        // What would not show at any size.
        const double most =
            kMostSize *
            candidate.effect->parameters()[candidate.sets[s][i].along]
                .typical_scale;
        if (!(C(i, i) * most * most > 1.0)) left[i] = 0.0;
      } else {
        // A nominal value that the data knows worse than by its own size,
        // unless it asks for many times that (the inertia of what was taken
        // for a point).
        const double scale = candidate.adjusted[i - probes].typical_scale;
        const double gain = std::pow(b_[candidate.first[s] + i], 2) / C(i, i);
        if (!(C(i, i) * scale * scale > 1.0) &&
            !(gain > kClear * squares_ / dof_)) {
          left[i] = 0.0;
        }
      }
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
    const int probes = static_cast<int>(candidate.sets[s].size());
    const int identifiable_probes = static_cast<int>(std::count_if(
        kept.begin(), kept.end(), [&](int i) { return i < probes; }));
    if (candidate.ComesOfAllProbes() && identifiable_probes < probes) continue;
    // All subsets, the whole first.
    const int n = static_cast<int>(kept.size());
    for (int mask = (1 << n) - 1; mask > 0; --mask) {
      Weights weights;
      weights.set = static_cast<int>(s);
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
      best.set = static_cast<int>(s);
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
  // What remains, block by block.
  const auto& segments = fit_.segments();
  const int blocks =
      std::max<int>(1, (kFewestBlocks + static_cast<int>(segments.size()) - 1) /
                           static_cast<int>(segments.size()));
  Eigen::MatrixXd scores =
      Eigen::MatrixXd::Zero(blocks * segments.size(), out.dof);
  double squares = 0.0;
  for (size_t s = 0; s < segments.size(); ++s) {
    const Eigen::MatrixXd part = A_[s](Eigen::all, columns);
    const Eigen::VectorXd e = segments[s]->r + part * weights.alpha;
    squares += e.squaredNorm();
    const int rows = static_cast<int>(e.size());
    for (int g = 0; g < blocks; ++g) {
      const int begin = rows * g / blocks, end = rows * (g + 1) / blocks;
      scores.row(s * blocks + g) =
          (part.middleRows(begin, end - begin).transpose() *
           e.segment(begin, end - begin))
              .transpose();
    }
  }
  const WaldTest test = TestWeights(Gram(columns), weights.alpha, scores,
                                    squares, std::max(1.0, dof_ - out.dof));
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
  const std::vector<EffectParameter>& own = candidate.effect->parameters();
  const ProbeSet& probes = candidate.sets[weights.set];
  const auto is_identifiable = [&](int column) {
    return std::find(weights.identifiable.begin(), weights.identifiable.end(),
                     column) != weights.identifiable.end();
  };
  // An own parameter has no influence where no probe along it changes the
  // residuals.
  const auto has_no_influence = [&](size_t parameter) {
    if (!own[parameter].grid.empty()) return false;
    for (size_t i = 0; i < probes.size(); ++i) {
      if (probes[i].along == static_cast<int>(parameter) &&
          is_identifiable(static_cast<int>(i))) {
        return false;
      }
    }
    return !candidate.IsSearched(parameter);
  };
  for (size_t v = 0; v < values.size(); ++v) {
    const bool adjusted = v >= own.size();
    const Parameter* wrong =
        adjusted ? &candidate.adjusted[v - own.size()] : nullptr;
    ExpectedParameter expected;
    expected.name = adjusted ? wrong->name : own[v].name;
    if (free_.count(expected.name) > 0)
      continue;  // of an effect that this one replaces
    expected.unit = adjusted ? wrong->unit : own[v].unit;
    if (adjusted
            ? !is_identifiable(static_cast<int>(probes.size() + v - own.size()))
            : has_no_influence(v)) {
      out.without_influence.push_back(expected.name);
      continue;
    }
    expected.value = values[v];
    expected.null_value = adjusted ? wrong->nominal : candidate.off[v];
    expected.searched = !adjusted && candidate.IsSearched(v);
    // A value that a bound holds has none.
    expected.std_error = covariance(v, v) > 0
                             ? std::sqrt(covariance(v, v))
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
  std::vector<int> columns, first(n);
  for (int i = 0; i < n; ++i) {
    first[i] = static_cast<int>(columns.size());
    const std::vector<int> own = Global(candidates_[i], weights[i]);
    columns.insert(columns.end(), own.begin(), own.end());
  }
  const Eigen::MatrixXd C = Gram(columns);
  const Eigen::VectorXd b = b_(columns);
  const auto size = [&](int i) {
    return static_cast<int>(weights[i].active.size());
  };
  std::vector<Eigen::LDLT<Eigen::MatrixXd>> inverse(n);
  for (int i = 0; i < n; ++i) {
    inverse[i].compute(C.block(first[i], first[i], size(i), size(i)));
  }
  screening->confusability.setIdentity(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      if (i == j || !(weights[i].score > 0)) continue;
      const Eigen::VectorXd seen =
          C.block(first[j], first[i], size(j), size(i)) * weights[i].alpha;
      screening->confusability(i, j) = std::clamp(
          seen.dot(inverse[j].solve(seen)) / weights[i].score, 0.0, 1.0);
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) {
      const int k = size(i) + size(j);
      Eigen::MatrixXd joint(k, k);
      joint << C.block(first[i], first[i], size(i), size(i)),
          C.block(first[i], first[j], size(i), size(j)),
          C.block(first[j], first[i], size(j), size(i)),
          C.block(first[j], first[j], size(j), size(j));
      Eigen::VectorXd rhs(k);
      rhs << b.segment(first[i], size(i)), b.segment(first[j], size(j));
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
      wi.alpha = alpha.head(size(i));
      wj.alpha = alpha.tail(size(j));
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
  screening.independent_samples = independent_;
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
  std::vector<Weights> weights;
  std::vector<Candidate> identifiable;
  for (size_t i = 0; i < best.size(); ++i) {
    if (best[i].active.empty()) continue;
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
  // Best first.
  std::vector<int> order(screening.effects.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return screening.effects[a].criterion < screening.effects[b].criterion;
  });
  std::vector<ScreenedEffect> sorted;
  std::vector<int> place(order.size());
  for (size_t i = 0; i < order.size(); ++i) {
    sorted.push_back(std::move(screening.effects[order[i]]));
    place[order[i]] = static_cast<int>(i);
  }
  screening.effects = std::move(sorted);
  screening.confusability =
      Eigen::MatrixXd(screening.confusability(order, order));
  for (Screening::Pair& pair : screening.pairs) {
    pair.first = place[pair.first];
    pair.second = place[pair.second];
    if (pair.first > pair.second) std::swap(pair.first, pair.second);
  }
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
