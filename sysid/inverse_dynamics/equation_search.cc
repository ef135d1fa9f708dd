#include "sysid/inverse_dynamics/equation_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "models/math/decompositions.h"
#include "sysid/linearization/statistics.h"

namespace sysid {
namespace {

// Stretches of time for cross-validation. Means of so many have a standard
// error that serial correlation does not spoil (batch means; Schmeiser 1982: 10
// to 30).
constexpr int kStretches = 20;
// By so much the error of a joint must fall: what matters of a model's error,
// (J.2) of docs/judgement.md.
constexpr double kMatters = 0.05;

}  // namespace

bool IsPlainLaw(const Effect& effect) {
  constexpr std::array kPlain = {"viscous_damping", "coulomb_friction",
                                 "armature", "effort_bias"};
  return std::find(kPlain.begin(), kPlain.end(), effect.kind()) != kPlain.end();
}

EquationSearch::EquationSearch(const EquationColumns& columns,
                               const std::vector<FreeParameter>& free,
                               const Eigen::VectorXd& theta,
                               const std::vector<int>& gains,
                               const std::vector<EquationRows>& rows,
                               Bodies bodies, const std::vector<int>& silent,
                               std::function<void()> throw_if_cancelled)
    : columns_(columns),
      theta_(theta),
      gains_(gains),
      throw_if_cancelled_(std::move(throw_if_cancelled)),
      bodies_(std::move(bodies)) {
  const auto n = static_cast<int>(theta.size());
  const int all = n + bodies_.columns;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  bounds_.lower.setConstant(all, -kNone);
  bounds_.upper.setConstant(all, kNone);
  for (int i = 0; i < columns.free; ++i) {
    bounds_.lower[i] = free[i].lower - theta[i];
    bounds_.upper[i] = free[i].upper - theta[i];
  }
  P_ = Eigen::MatrixXd::Zero(all, all);
  P_.bottomRightCorner(bodies_.columns, bodies_.columns) = bodies_.belief;
  int times = 0;
  for (const EquationRows& run : rows) times += run.times();
  for (const EquationRows& run : rows) {
    const double share = run.times() / std::max(1.0, 1.0 * times);
    const int count =
        std::clamp(static_cast<int>(std::lround(kStretches * share)), 1,
                   std::max(1, run.times()));
    for (int k = 0; k < count; ++k) {
      stretches_.push_back(MultiplyRows(run, k * run.times() / count,
                                        (k + 1) * run.times() / count));
      for (const int v : silent) {
        stretches_.back().of[v].setZero();
        stretches_.back().times[v] = 0.0;
      }
      AddProducts(stretches_.back(), 1.0, &all_);
    }
  }
}

std::vector<int> EquationSearch::With(const std::vector<int>& chosen) const {
  std::vector<int> at;
  for (int i = 0; i < columns_.free; ++i) at.push_back(i);
  for (const int k : chosen) {
    const EquationColumns::Candidate& candidate = columns_.candidates[k];
    for (int i = 0; i < candidate.count; ++i) {
      at.push_back(candidate.first + i);
    }
  }
  for (int i = 0; bodies_are_free_ && i < bodies_.columns; ++i) {
    at.push_back(static_cast<int>(theta_.size()) + i);
  }
  return at;
}

EquationSearch::Trial EquationSearch::Solve(std::vector<int> at,
                                            Eigen::VectorXd variance) const {
  constexpr int kReweighed = 3;  // sizes settle to some per cent
  Trial trial;
  trial.at = std::move(at);
  for (int round = 0; round < kReweighed; ++round) {
    trial.d =
        SolveWeighted(Weigh(all_, trial.at, variance, P_), trial.at, bounds_);
    trial.likelihood = 0.0;
    for (int v = 0; v < variance.size(); ++v) {
      // A joint of which nothing is left says nothing.
      variance[v] = std::max(
          all_.Left(v, trial.at, trial.d) / std::max(1.0, all_.times[v]),
          std::numeric_limits<double>::min());
      trial.likelihood -= 0.5 * all_.times[v] * std::log(variance[v]);
    }
  }
  trial.variance = std::move(variance);
  trial.cost_of_bodies = 0.5 * trial.d.dot(P_(trial.at, trial.at) * trial.d);
  return trial;
}

void EquationSearch::LeaveStretchesOut(Trial* trial) const {
  if (trial->squares.size() > 0) return;
  trial->without.resize(stretches_.size(), trial->at.size());
  trial->squares.resize(stretches_.size(), trial->variance.size());
  for (size_t k = 0; k < stretches_.size(); ++k) {
    EquationProducts others = all_;
    AddProducts(stretches_[k], -1.0, &others);
    const Eigen::VectorXd d = SolveWeighted(
        Weigh(others, trial->at, trial->variance, P_), trial->at, bounds_);
    trial->without.row(k) = d.transpose();
    for (int v = 0; v < trial->variance.size(); ++v) {
      trial->squares(k, v) = stretches_[k].Left(v, trial->at, d);
    }
  }
}

double EquationSearch::Advantage(Trial* a, Trial* b) const {
  LeaveStretchesOut(a);
  LeaveStretchesOut(b);
  const auto predicted = [&](const Trial& trial, size_t k) {
    double sum = 0.0;
    for (int v = 0; v < trial.variance.size(); ++v) {
      sum -= 0.5 * (trial.squares(k, v) / trial.variance[v] +
                    stretches_[k].times[v] * std::log(trial.variance[v]));
    }
    return sum;
  };
  const auto n = static_cast<double>(stretches_.size());
  std::vector<double> gains;
  double mean = 0.0, squares = 0.0;
  for (size_t k = 0; k < stretches_.size(); ++k) {
    gains.push_back(predicted(*a, k) - predicted(*b, k));
    mean += gains.back() / n;
  }
  for (const double gain : gains) squares += (gain - mean) * (gain - mean);
  return n * mean / std::sqrt(squares * n / std::max(1.0, n - 1.0));
}

bool EquationSearch::Matters(const Trial& a, const Trial& b) {
  return ((b.squares.colwise().sum().array() /
           a.squares.colwise().sum().array()) > std::pow(1.0 + kMatters, 2))
      .any();
}

double EquationSearch::IndependentBodyColumns() const {
  if (!bodies_are_free_) return 0.0;
  const Eigen::MatrixXd G = Weigh(all_, now_.at, now_.variance, P_).G;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(G.rows(), G.cols());
  const Eigen::MatrixXd inverse = SolveSymmetric(G, one);
  return bodies_.columns - (P_(now_.at, now_.at) * inverse).trace();
}

bool EquationSearch::Unbends(const Trial& with, const Trial& without) const {
  const double tests = static_cast<double>(columns_.candidates.size());
  return bodies_are_free_ &&
         without.cost_of_bodies - with.cost_of_bodies > std::log(tests) + 2.0 &&
         with.cost_of_bodies < 0.5 * IndependentBodyColumns();
}

bool EquationSearch::ActsOnAlone(int column,
                                 const std::vector<int>& joints) const {
  for (int v = 0; v < static_cast<int>(all_.of.size()); ++v) {
    if (all_.of[v](column, column) != 0.0 &&
        std::find(joints.begin(), joints.end(), v) == joints.end()) {
      return false;
    }
  }
  return true;
}

Eigen::VectorXd EquationSearch::Changes(const Trial& trial) const {
  Eigen::VectorXd changes = trial.d;
  for (size_t i = 0; i < trial.at.size(); ++i) {
    std::vector<int> joints;
    for (size_t v = 0; v < gains_.size(); ++v) {
      if (gains_[v] == trial.at[i]) joints.push_back(static_cast<int>(v));
    }
    if (joints.empty()) continue;
    const double before = 1.0 + theta_[trial.at[i]];
    const double after = before * before / (before - trial.d[i]);
    changes[i] = after - before;
    for (size_t k = 0; k < trial.at.size(); ++k) {
      if (k != i && ActsOnAlone(trial.at[k], joints)) {
        changes[k] *= after / before;
      }
    }
  }
  return changes;
}

std::vector<int> EquationSearch::Impossible(
    const Trial& trial, const std::vector<int>& chosen) const {
  const Eigen::VectorXd changes = Changes(trial);
  std::vector<int> impossible;
  int i = columns_.free;
  for (const int k : chosen) {
    const EquationColumns::Candidate& candidate = columns_.candidates[k];
    bool possible = true;
    for (int c = 0; c < candidate.count; ++c, ++i) {
      const Parameter& parameter = columns_.parameters[candidate.first + c];
      const double value = theta_[candidate.first + c] + changes[i];
      possible &= value >= parameter.lower && value <= parameter.upper;
    }
    if (!possible) impossible.push_back(k);
  }
  return impossible;
}

EquationSearch::Trial EquationSearch::SolvePossible(
    std::vector<int>* chosen) const {
  for (;;) {
    Trial trial = Solve(With(*chosen), now_.variance);
    const std::vector<int> impossible = Impossible(trial, *chosen);
    const auto plain = std::find_if(impossible.begin(), impossible.end(),
                                    [this](int k) { return IsPlain(k); });
    if (plain == impossible.end()) return trial;
    std::erase(*chosen, *plain);
  }
}

bool EquationSearch::IsChosen(int candidate) const {
  return std::find(chosen_.begin(), chosen_.end(), candidate) != chosen_.end();
}

bool EquationSearch::IsPlain(int candidate) const {
  const EquationColumns::Candidate& one = columns_.candidates[candidate];
  return !one.changes_effort && one.count == 1 && IsPlainLaw(*one.effect);
}

int EquationSearch::special_laws() const {
  return static_cast<int>(std::count_if(chosen_.begin(), chosen_.end(),
                                        [this](int k) { return !IsPlain(k); }));
}

double EquationSearch::Deviation(const Trial& trial, Eigen::Index at) const {
  const auto n = static_cast<double>(stretches_.size());
  const Eigen::ArrayXd d = trial.without.col(at).array();
  return std::sqrt((n - 1.0) / n * (d - d.mean()).square().sum());
}

void EquationSearch::SettlePlainLaws() {
  // Standard errors: every joint has friction, so that chance is asked of each
  // law alone (of a normal deviate 1 in 20), not of the best of all.
  constexpr double kLeast = 2.0;
  const double tests = static_cast<double>(columns_.candidates.size());
  for (int k = 0; k < static_cast<int>(columns_.candidates.size()); ++k) {
    if (IsPlain(k) && !IsChosen(k)) chosen_.push_back(k);
  }
  std::set<int> needed;  // by the bodies
  for (;;) {
    throw_if_cancelled_();
    now_ = Solve(With(chosen_), now_.variance);
    LeaveStretchesOut(&now_);
    const Eigen::VectorXd changes = Changes(now_);
    // Of each its size in standard errors, below zero where no such law is
    // possible.
    int least = -1;
    double t_least = kLeast;
    Eigen::Index at = columns_.free;
    for (const int k : chosen_) {
      const Eigen::Index own = at;
      at += columns_.candidates[k].count;
      if (!IsPlain(k) || needed.contains(k)) continue;
      const double error = Deviation(now_, own);
      const Parameter& parameter = columns_.parameters[now_.at[own]];
      const double value = theta_[now_.at[own]] + changes[own];
      double t = error > 0.0 ? std::abs(now_.d[own]) / error : 0.0;
      if (!(value >= parameter.lower && value <= parameter.upper)) t = -t;
      p_value_[k] = std::min(1.0, tests * 0.5 * std::erfc(t / std::sqrt(2.0)));
      if (t < t_least) {
        t_least = t;
        least = k;
      }
    }
    if (least < 0) return;
    std::vector<int> rest = chosen_;
    std::erase(rest, least);
    if (bodies_are_free_ && t_least >= 0.0 &&
        Unbends(now_, Solve(With(rest), now_.variance))) {
      needed.insert(least);
      continue;
    }
    chosen_ = std::move(rest);
  }
}

std::vector<double> EquationSearch::FirstOrderGains() const {
  std::vector<int> every(P_.rows());
  for (size_t i = 0; i < every.size(); ++i) every[i] = static_cast<int>(i);
  const auto [G, g] = Weigh(all_, every, now_.variance, P_);
  Eigen::VectorXd slope = g;
  for (size_t i = 0; i < now_.at.size(); ++i) {
    slope += G.col(now_.at[i]) * now_.d[i];
  }
  Eigen::MatrixXd cross = G(now_.at, Eigen::all);
  const Eigen::MatrixXd solved = SolveSymmetric(G(now_.at, now_.at), cross);
  std::vector<double> gains;
  for (const EquationColumns::Candidate& candidate : columns_.candidates) {
    std::vector<int> own;
    for (int c = 0; c < candidate.count; ++c) {
      const int column = candidate.first + c;
      const double left =
          G(column, column) - cross.col(column).dot(solved.col(column));
      constexpr double kTold = 1e-9;  // of a column, by the others
      if (left > kTold * G(column, column)) own.push_back(column);
    }
    const Eigen::MatrixXd S = G(own, own) - cross(Eigen::all, own).transpose() *
                                                solved(Eigen::all, own);
    const Eigen::VectorXd along = slope(own);
    gains.push_back(0.5 * along.dot(SolveScaled(S, along)));
  }
  return gains;
}

bool EquationSearch::AddOne() {
  // By the order of their first-order gains: what is not among the first few
  // of those is not the best by cross-validation either.
  constexpr size_t kMostTried = 12;
  const std::vector<double> gains = FirstOrderGains();
  std::vector<std::pair<double, int>> order;
  for (size_t k = 0; k < columns_.candidates.size(); ++k) {
    const auto candidate = static_cast<int>(k);
    const int count = columns_.candidates[k].count;
    // By the Bayesian information criterion, or not worth a look.
    const double gain =
        gains[k] - 0.5 * count * std::log(all_.times.maxCoeff());
    if (!(gain > 0.0) || columns_.candidates[k].changes_effort ||
        IsChosen(candidate)) {
      continue;
    }
    order.emplace_back(gain / count, candidate);
  }
  std::sort(order.rbegin(), order.rend());
  const double tests = static_cast<double>(columns_.candidates.size());
  const double deviations = Deviations(static_cast<int>(order.size()));
  // Of those that are the same to these data the commonest, which the
  // catalogue lists first.
  constexpr double kSame = 1e-6;
  for (size_t i = 0; i < order.size(); ++i) {
    for (size_t k = i + 1;
         k < order.size() && order[k].first > (1 - kSame) * order[i].first;
         ++k) {
      if (order[k].second < order[i].second) std::swap(order[i], order[k]);
    }
  }
  if (order.size() > kMostTried) order.resize(kMostTried);
  for (const auto& [gain, candidate] : order) {
    std::vector<int> chosen = chosen_;
    chosen.push_back(candidate);
    // What it explains may have been what plain laws of its joints stood for.
    Trial trial = SolvePossible(&chosen);
    if (!IsPossible(trial, chosen) ||
        std::find(chosen.begin(), chosen.end(), candidate) == chosen.end()) {
      continue;
    }
    const double advantage = Advantage(&trial, &now_);
    const bool predicts = advantage > deviations && Matters(trial, now_);
    if (!predicts && !Unbends(trial, now_)) continue;
    chosen_ = std::move(chosen);
    p_value_[candidate] =
        std::min(1.0, tests * 0.5 * std::erfc(advantage / std::sqrt(2.0)));
    now_ = std::move(trial);
    return true;
  }
  return false;
}

bool EquationSearch::TakeOutOne() {
  for (size_t i = 0; i + 1 < chosen_.size(); ++i) {
    std::vector<int> chosen = chosen_;
    chosen.erase(chosen.begin() + static_cast<std::ptrdiff_t>(i));
    Trial without = Solve(With(chosen), now_.variance);
    if (Advantage(&now_, &without) > 1.0 || !IsPossible(without, chosen) ||
        Unbends(now_, without)) {
      continue;
    }
    chosen_ = std::move(chosen);
    now_ = std::move(without);
    return true;
  }
  return false;
}

bool EquationSearch::ExchangeOne() {
  for (size_t i = 0; i < chosen_.size(); ++i) {
    if (IsPlain(chosen_[i])) continue;
    const int joint = columns_.candidates[chosen_[i]].effect->joint();
    for (int k = 0; k < static_cast<int>(columns_.candidates.size()); ++k) {
      if (!IsPlain(k) || IsChosen(k) || joint < 0 ||
          columns_.candidates[k].effect->joint() != joint) {
        continue;
      }
      std::vector<int> chosen = chosen_;
      chosen[i] = k;
      Trial trial = Solve(With(chosen), now_.variance);
      if (!IsPossible(trial, chosen) || Advantage(&now_, &trial) > 1.0 ||
          Unbends(now_, trial)) {
        continue;
      }
      p_value_[k] = p_value_[chosen_[i]];
      chosen_ = std::move(chosen);
      now_ = std::move(trial);
      return true;
    }
  }
  return false;
}

void EquationSearch::Run(bool bodies_are_free) {
  bodies_are_free_ = bodies_are_free;
  now_.variance.resize(static_cast<Eigen::Index>(all_.of.size()));
  for (int v = 0; v < now_.variance.size(); ++v) {
    now_.variance[v] =
        std::max(all_.Left(v, {}, {}) / std::max(1.0, all_.times[v]),
                 std::numeric_limits<double>::min());
  }
  chosen_.clear();
  p_value_.clear();
  SettlePlainLaws();
  // What was found may have hidden plain laws of its joints.
  for (bool any = true; any;) {
    any = false;
    while (AddOne()) {
      any = true;
      throw_if_cancelled_();
      while (TakeOutOne() || ExchangeOne()) {
      }
    }
    const std::vector<int> before = chosen_;
    if (any) SettlePlainLaws();
    any = any && chosen_ != before;
  }
  LeaveStretchesOut(&now_);
}

}  // namespace sysid
