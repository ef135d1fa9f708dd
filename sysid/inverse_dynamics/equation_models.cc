#include "sysid/inverse_dynamics/equation_models.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

#include "models/math/decompositions.h"
#include "sysid/linearization/statistics.h"

namespace sysid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Stretches of time for cross-validation. Means of so many have a standard
// error that serial correlation does not spoil (batch means; Schmeiser 1982: 10
// to 30).
constexpr int kStretches = 20;
// By so much the error of a joint must fall: what matters of a model's error,
// (J.2) of docs/judgement.md.
constexpr double kMatters = 0.05;
// Nats: sums of squares are weighted again until the posterior has settled.
constexpr double kSettled = 0.05;
// Of what the given model leaves: so little in equations that are trusted.
constexpr double kTrusted = 0.02;

// Of an estimate, from those without each of the stretches.
double JackknifeError(const Eigen::Ref<const VectorXd>& without) {
  const auto n = static_cast<double>(without.size());
  return std::sqrt((n - 1.0) / n *
                   (without.array() - without.mean()).square().sum());
}

}  // namespace

bool IsPlainLaw(const Effect& effect) {
  constexpr std::array kPlain = {"viscous_damping", "coulomb_friction",
                                 "armature", "effort_bias"};
  return std::find(kPlain.begin(), kPlain.end(), effect.kind()) != kPlain.end();
}

EquationModels::EquationModels(const EquationColumns& columns,
                               const std::vector<FreeParameter>& free,
                               const std::vector<int>& gains,
                               const std::vector<EquationRows>& rows,
                               Bodies bodies, const std::vector<int>& silent,
                               bool bodies_are_free)
    : columns_(columns),
      gains_(gains),
      bodies_(std::move(bodies)),
      bodies_are_free_(bodies_are_free) {
  const int all = columns.size() + bodies_.columns;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  bounds_.lower.setConstant(all, -kNone);
  bounds_.upper.setConstant(all, kNone);
  for (int i = 0; i < columns.free; ++i) {
    bounds_.lower[i] = free[i].lower - columns.at[i];
    bounds_.upper[i] = free[i].upper - columns.at[i];
  }
  for (const EquationColumns::Candidate& candidate : columns.candidates) {
    if (!candidate.is_linear) continue;
    for (size_t i = 0; i < candidate.probes.size(); ++i) {
      const Probe& probe = candidate.probes[i];
      const double before =
          probe.at[probe.along] + candidate.taken_over[probe.along];
      const Parameter& parameter = candidate.parameters[probe.along];
      const Index column = candidate.first + static_cast<Index>(i);
      bounds_.lower[column] = parameter.lower - before;
      bounds_.upper[column] = parameter.upper - before;
    }
  }
  P_ = MatrixXd::Zero(all, all);
  P_.bottomRightCorner(bodies_.columns, bodies_.columns) = bodies_.belief;
  const std::vector<std::vector<int>> acting = ColumnsOfJoints(rows);
  int times = 0;
  for (const EquationRows& run : rows) times += run.times();
  for (const EquationRows& run : rows) {
    const double share = run.times() / std::max(1.0, 1.0 * times);
    const int count =
        std::clamp(static_cast<int>(std::lround(kStretches * share)), 1,
                   std::max(1, run.times()));
    for (int k = 0; k < count; ++k) {
      stretches_.push_back(MultiplyRows(run, k * run.times() / count,
                                        (k + 1) * run.times() / count, acting));
      for (const int v : silent) {
        stretches_.back().of[v].G.setZero();
        stretches_.back().times[v] = 0.0;
      }
      AddProducts(stretches_.back(), &all_);
    }
  }
  given_.resize(static_cast<Index>(all_.of.size()));
  for (int v = 0; v < given_.size(); ++v) {
    given_[v] =
        std::max(all_.Left(v, {}, VectorXd()) / std::max(1.0, all_.times[v]),
                 std::numeric_limits<double>::min());
  }
  trusted_ = kTrusted * kTrusted * given_;
}

bool EquationModels::IsPlain(int candidate) const {
  return columns_of(candidate) == 1 && IsPlainLaw(effect(candidate));
}

std::vector<int> EquationModels::With(const std::vector<int>& chosen) const {
  std::set<int> replaced;
  for (const int k : chosen) {
    const std::vector<int>& by = columns_.candidates[k].replaces;
    replaced.insert(by.begin(), by.end());
  }
  std::vector<int> at;
  for (int i = 0; i < columns_.free; ++i) {
    if (!replaced.contains(i)) at.push_back(i);
  }
  for (const int k : chosen) {
    const EquationColumns::Candidate& candidate = columns_.candidates[k];
    for (int i = 0; i < candidate.count; ++i) {
      at.push_back(candidate.first + i);
    }
  }
  for (int i = 0; bodies_are_free_ && i < bodies_.columns; ++i) {
    at.push_back(columns_.size() + i);
  }
  return at;
}

EquationModels::Fit EquationModels::Given() const {
  Fit fit;
  fit.variance = given_;
  fit.scales = {VectorXd::Ones(given_.size()), gains_};
  return fit;
}

EquationModels::Fit EquationModels::Solve(const std::vector<int>& chosen,
                                          const VectorXd& variance) const {
  // What the bodies believe holds a joint of which much was left, and more
  // where its equations are trusted to begin with.
  Fit fit = SolveFrom(chosen, variance);
  if (!bodies_are_free_) return fit;
  Fit trusted = SolveFrom(chosen, trusted_);
  return trusted.posterior() > fit.posterior() + kSettled ? trusted : fit;
}

EquationModels::Fit EquationModels::SolveFrom(const std::vector<int>& chosen,
                                              VectorXd variance) const {
  constexpr int kMostReweighed = 20, kFewestReweighed = 3;
  Fit fit;
  fit.chosen = chosen;
  fit.at = With(chosen);
  fit.free = static_cast<int>(
      std::count_if(fit.at.begin(), fit.at.end(),
                    [this](int column) { return column < columns_.free; }));
  fit.scales = {VectorXd::Ones(variance.size()), gains_};
  // Every round raises the posterior, but for those that change scales.
  double before = -std::numeric_limits<double>::infinity();
  for (int round = 0; round < kMostReweighed; ++round) {
    fit.d = SolveWeighted(Weigh(all_, fit.at, variance, P_, &fit.scales),
                          fit.at, bounds_);
    fit.likelihood = 0.0;
    for (int v = 0; v < variance.size(); ++v) {
      // A joint of which nothing is left says nothing.
      variance[v] =
          std::max(all_.Left(v, fit.at, fit.scales.Times(v, fit.at, fit.d)) /
                       std::max(1.0, all_.times[v]),
                   std::numeric_limits<double>::min());
      fit.likelihood -= 0.5 * all_.times[v] * std::log(variance[v]);
    }
    fit.cost_of_bodies = 0.5 * fit.d.dot(P_(fit.at, fit.at) * fit.d);
    const bool settled = fit.posterior() < before + kSettled;
    before = fit.posterior();
    if (settled && round + 1 >= kFewestReweighed) break;
    if (round + 1 < kMostReweighed) Rescale(&fit);
  }
  fit.variance = std::move(variance);
  return fit;
}

void EquationModels::Rescale(Fit* fit) const {
  // Beyond this the effort is none of the joint.
  constexpr double kMost = 10.0;
  for (size_t v = 0; v < gains_.size(); ++v) {
    const auto at = std::find(fit->at.begin(), fit->at.end(), gains_[v]);
    if (gains_[v] < 0 || at == fit->at.end()) continue;
    const double scale =
        1.0 - fit->d[at - fit->at.begin()] / (1.0 + columns_.at[gains_[v]]);
    fit->scales.of[static_cast<Index>(v)] =
        std::clamp(scale, 1.0 / kMost, kMost);
  }
}

EquationModels::Fit EquationModels::SolvePossible(
    std::vector<int> chosen, const VectorXd& variance) const {
  for (;;) {
    Fit fit = Solve(chosen, variance);
    const std::vector<int> impossible = Impossible(fit);
    const auto plain = std::find_if(impossible.begin(), impossible.end(),
                                    [this](int k) { return IsPlain(k); });
    if (plain == impossible.end()) return fit;
    std::erase(chosen, *plain);
  }
}

Index EquationModels::FirstOf(const Fit& fit, int candidate) const {
  Index at = fit.free;
  for (const int k : fit.chosen) {
    if (k == candidate) break;
    at += columns_of(k);
  }
  return at;
}

std::vector<int> EquationModels::Impossible(const Fit& fit) const {
  const VectorXd changes = Changes(fit);
  std::vector<int> impossible;
  for (const int k : fit.chosen) {
    const EquationColumns::Candidate& candidate = columns_.candidates[k];
    std::vector<double> values = columns_.Values(
        candidate, changes.segment(FirstOf(fit, k), candidate.count));
    bool possible = true;
    for (size_t i = 0; i < values.size(); ++i) {
      const Parameter& parameter = candidate.parameters[i];
      possible &= values[i] >= parameter.lower && values[i] <= parameter.upper;
    }
    values.resize(candidate.effect->parameters().size());
    if (!possible || !candidate.effect->Implausible(values).empty()) {
      impossible.push_back(k);
    }
  }
  return impossible;
}

void EquationModels::LeaveStretchesOut(Fit* fit) const {
  if (fit->squares.size() > 0) return;
  fit->without.resize(stretches_.size(), fit->at.size());
  fit->squares.resize(stretches_.size(), fit->variance.size());
  const WeightedProducts all =
      Weigh(all_, fit->at, fit->variance, P_, &fit->scales);
  for (size_t k = 0; k < stretches_.size(); ++k) {
    WeightedProducts others =
        Weigh(stretches_[k], fit->at, fit->variance, {}, &fit->scales);
    others.G = all.G - others.G;
    others.g = all.g - others.g;
    const VectorXd d = SolveWeighted(others, fit->at, bounds_);
    fit->without.row(k) = d.transpose();
    for (int v = 0; v < fit->variance.size(); ++v) {
      fit->squares(k, v) =
          stretches_[k].Left(v, fit->at, fit->scales.Times(v, fit->at, d));
    }
  }
}

double EquationModels::Advantage(Fit* a, Fit* b) const {
  LeaveStretchesOut(a);
  LeaveStretchesOut(b);
  // The columns of both, and by how much their changes differ.
  std::vector<int> at = a->at;
  std::vector<Index> places_of_b;
  for (const int column : b->at) {
    const auto known = std::find(at.begin(), at.end(), column);
    places_of_b.push_back(known - at.begin());
    if (known == at.end()) at.push_back(column);
  }
  // g_k and D_k of (11.20).
  double gains = 0.0, expected = 0.0;
  std::vector<std::pair<double, double>> of_stretches;
  for (size_t k = 0; k < stretches_.size(); ++k) {
    const auto row = static_cast<Index>(k);
    const VectorXd of_a = a->without.row(row), of_b = b->without.row(row);
    double gain = 0.0, difference = 0.0;
    for (int v = 0; v < a->variance.size(); ++v) {
      VectorXd differ = VectorXd::Zero(static_cast<Index>(at.size()));
      differ.head(of_a.size()) = a->scales.Times(v, a->at, of_a);
      differ(places_of_b) -= b->scales.Times(v, b->at, of_b);
      const double s2 = 2.0 * std::max(a->variance[v], b->variance[v]);
      gain += (b->squares(row, v) - a->squares(row, v)) / s2;
      difference += stretches_[k].Moved(v, at, differ) / s2;
    }
    of_stretches.emplace_back(gain, difference);
    gains += gain;
    expected += difference;
  }
  if (!(expected > 0.0)) return 0.0;
  const double slope = gains / expected;
  double squares = 0.0;
  for (const auto& [gain, difference] : of_stretches) {
    // Half a nat is what any two models may differ by.
    squares += std::pow(gain - slope * difference, 2) / (difference + 0.5);
  }
  const auto n = static_cast<double>(stretches_.size());
  return slope / std::sqrt(squares / std::max(1.0, n - 1.0) / expected);
}

double EquationModels::Significant(int compared) const {
  const double p = 0.5 * std::erfc(Deviations(compared) / std::sqrt(2.0));
  return StudentQuantile(
      1.0 - p, std::max(1.0, static_cast<double>(stretches_.size()) - 1.0));
}

bool EquationModels::Matters(Fit* a, Fit* b) const {
  LeaveStretchesOut(a);
  LeaveStretchesOut(b);
  return ((b->squares.colwise().sum().array() /
           a->squares.colwise().sum().array()) > std::pow(1.0 + kMatters, 2))
      .any();
}

double EquationModels::IndependentBodyColumns(const Fit& fit) const {
  if (!bodies_are_free_) return 0.0;
  const MatrixXd G = Weigh(all_, fit.at, fit.variance, P_, &fit.scales).G;
  const MatrixXd one = MatrixXd::Identity(G.rows(), G.cols());
  const MatrixXd inverse = SolveSymmetric(G, one);
  return bodies_.columns - (P_(fit.at, fit.at) * inverse).trace();
}

bool EquationModels::Unbends(const Fit& with, const Fit& without) const {
  return bodies_are_free_ &&
         without.cost_of_bodies - with.cost_of_bodies >
             std::log(static_cast<double>(size())) + 2.0 &&
         with.cost_of_bodies < 0.5 * IndependentBodyColumns(with);
}

std::vector<EquationModels::Promise> EquationModels::Promises(
    const std::vector<int>& beside, const Fit& now,
    const std::vector<int>& candidates) const {
  // Of what is fitted the columns that no bound holds; others as they would be
  // without bounds.
  const bool is_fitted = beside == now.chosen && !now.at.empty();
  std::vector<int> at = is_fitted ? std::vector<int>() : With(beside), held;
  std::vector<double> of_held, of_loose;
  for (size_t i = 0; is_fitted && i < now.at.size(); ++i) {
    const int column = now.at[i];
    const double d = now.d[static_cast<Index>(i)];
    const bool is_held =
        d == bounds_.lower[column] || d == bounds_.upper[column];
    (is_held ? held : at).push_back(column);
    (is_held ? of_held : of_loose).push_back(d);
  }
  const auto n = static_cast<Index>(at.size());
  std::vector<int> both = at;  // `at`, those of each candidate, what is held
  for (const int k : candidates) {
    for (int c = 0; c < columns_of(k); ++c) {
      both.push_back(columns_.candidates[k].first + c);
    }
  }
  const auto asked = static_cast<Index>(both.size());
  both.insert(both.end(), held.begin(), held.end());
  const auto [G, g] = Weigh(all_, both, now.variance, P_, &now.scales);
  VectorXd d = VectorXd::Zero(G.rows());
  if (is_fitted) {
    d.head(n) = Eigen::Map<const VectorXd>(of_loose.data(), n);
    d.tail(G.rows() - asked) =
        Eigen::Map<const VectorXd>(of_held.data(), G.rows() - asked);
  } else {
    d.head(n) = -SolveScaled(G.topLeftCorner(n, n), g.head(n));
  }
  const VectorXd slope = g + G * d;
  const MatrixXd cross = G.topRows(n);
  const MatrixXd solved = SolveSymmetric(G.topLeftCorner(n, n), cross);
  std::vector<Promise> promises;
  Index first = n;
  for (const int k : candidates) {
    const Index count = columns_of(k);
    // What the data tells of its columns beside the others, column by column.
    MatrixXd S = G.block(first, first, count, count) -
                 cross.middleCols(first, count).transpose() *
                     solved.middleCols(first, count);
    VectorXd along = slope.segment(first, count);
    Promise promise;
    for (Index c = 0; c < count; ++c) {
      constexpr double kTold = 1e-9;  // of a column, by the others
      if (!(S(c, c) > kTold * G(first + c, first + c))) continue;
      ++promise.dof;
      promise.gain += 0.5 * along[c] * along[c] / S(c, c);
      const VectorXd column = S.col(c) / S(c, c);
      along -= column * along[c];
      S -= column * S.row(c).eval();
    }
    promises.push_back(promise);
    first += count;
  }
  return promises;
}

bool EquationModels::IsZero(int column) const {
  return std::none_of(all_.of.begin(), all_.of.end(),
                      [&](const auto& own) { return own.Has(column); });
}

VectorXd EquationModels::Changes(const Fit& fit) const {
  VectorXd changes = fit.d;
  for (size_t i = 0; i < fit.at.size(); ++i) {
    if (std::find(gains_.begin(), gains_.end(), fit.at[i]) == gains_.end()) {
      continue;
    }
    const auto k = static_cast<Index>(i);
    const double before = 1.0 + columns_.at[fit.at[i]];
    changes[k] = before * before / (before - fit.d[k]) - before;
  }
  return changes;
}

EquationModels::Estimate EquationModels::EstimateOf(Fit* fit,
                                                    int candidate) const {
  LeaveStretchesOut(fit);
  const EquationColumns::Candidate& one = columns_.candidates[candidate];
  const Index at = FirstOf(*fit, candidate);
  Estimate estimate;
  estimate.values = columns_.Values(one, Changes(*fit).segment(at, one.count));
  MatrixXd without(fit->without.rows(), estimate.values.size());
  for (Index k = 0; k < without.rows(); ++k) {
    const std::vector<double> values = columns_.Values(
        one, fit->without.row(k).segment(at, one.count).transpose());
    without.row(k) = Eigen::Map<const Eigen::RowVectorXd>(
        values.data(), static_cast<Index>(values.size()));
  }
  for (const auto& of_parameter : without.colwise()) {
    estimate.std_errors.push_back(JackknifeError(of_parameter));
  }
  return estimate;
}

double EquationModels::SizeOf(Fit* fit, int candidate) const {
  LeaveStretchesOut(fit);
  const Index at = FirstOf(*fit, candidate);
  const double error = JackknifeError(fit->without.col(at));
  return error > 0.0 ? std::abs(fit->d[at]) / error : 0.0;
}

}  // namespace sysid
