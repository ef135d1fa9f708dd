#include "sysid/linearization/candidate_weights.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "models/math/decompositions.h"

namespace sysid {

std::vector<double> ValuesOf(const Candidate& candidate,
                             const Weights& weights) {
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
  const std::vector<double> values = ValuesOf(candidate, weights);
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

Weights BestWeights(const Candidate& candidate, int set,
                    const ColumnProducts& products, double variance) {
  // A column of which projecting leaves less than this (squared) is what
  // states, free parameters or the columns before it explain already.
  constexpr double kAlias = 1e-7;
  constexpr double kClear = 9.0;     // of the variance that remains
  constexpr double kMostSize = 1e4;  // times the typical one
  const int count = candidate.columns(set);
  const Eigen::MatrixXd& C = products.C;
  Weights best;
  best.set = set;
  // Pivoted: the column that is clearest goes first.
  std::vector<int> kept;
  Eigen::VectorXd left(count);
  const int probes = static_cast<int>(candidate.sets[set].size());
  for (int i = 0; i < count; ++i) {
    const double own = products.own[i];
    left[i] = own > 0 ? C(i, i) / own : 0.0;
    // A probe's parameter would not show at any size, nor its law at its
    // secant; a nominal value the data knows worse than by its own size,
    // unless it asks for many times that (the inertia of what was taken for a
    // point).
    const bool probe = i < probes;
    const double most = std::max(
        candidate.parameters[candidate.ParameterOf(set, i)].typical_scale *
            (probe ? kMostSize : 1.0),
        probe ? std::abs(candidate.sets[set][i].secant) : 0.0);
    const double gain = std::pow(products.b[i], 2) / C(i, i);
    const bool asked = !probe && gain > kClear * variance;
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
    const Cholesky factor(scaled);
    if (!factor.Valid()) continue;
    const double pivot = factor.L()(with.size() - 1, with.size() - 1);
    if (pivot * pivot > 1e-4) kept = with;
  }
  // A parameter that comes out of several probes (a reference) needs them
  // all: with one of them it would be some other effect in disguise.
  const int identifiable_probes = static_cast<int>(std::count_if(
      kept.begin(), kept.end(), [&](int i) { return i < probes; }));
  if (candidate.ComesOfAllProbes() && identifiable_probes < probes) return best;
  // All subsets, the whole first.
  const int n = static_cast<int>(kept.size());
  for (int mask = (1 << n) - 1; mask > 0; --mask) {
    Weights weights;
    weights.set = set;
    weights.identifiable = kept;
    for (int i = 0; i < n; ++i) {
      if (mask & (1 << i)) weights.active.push_back(kept[i]);
    }
    const Eigen::VectorXd b = products.b(weights.active);
    weights.alpha = -SolveSymmetric(C(weights.active, weights.active), b);
    weights.score = -weights.alpha.dot(b);
    if (!Feasible(candidate, weights)) continue;
    if (weights.score > best.score) best = weights;
    if (mask == (1 << n) - 1) break;  // nothing gains more than all
  }
  if (best.score < 0 && n > 0) {  // the bounds leave nothing but null
    best.identifiable = best.active = kept;
    best.alpha = Eigen::VectorXd::Zero(n);
    best.score = 0.0;
  }
  return best;
}

double GainOf(const Candidate& candidate, const Weights& weights,
              const ColumnProducts& products) {
  const std::vector<double> values = ValuesOf(candidate, weights);
  const ProbeSet& probes = candidate.sets[weights.set];
  Eigen::VectorXd alpha = weights.alpha;
  for (size_t i = 0; i < weights.active.size(); ++i) {
    const int column = weights.active[i];
    if (column >= static_cast<int>(probes.size()) ||
        probes[column].secant == 0.0) {
      continue;
    }
    const size_t along = probes[column].along;
    alpha[i] = values[along] - candidate.At(probes[column])[along];
  }
  // |r|^2 - |r + A alpha|^2.
  const Eigen::MatrixXd C = products.C(weights.active, weights.active);
  return -alpha.dot(2.0 * products.b(weights.active) + C * alpha);
}

}  // namespace sysid
