#include "sysid/inverse_dynamics/equation_look.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "models/parameters.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/inverse_dynamics/equation_columns.h"
#include "sysid/inverse_dynamics/equation_products.h"
#include "sysid/inverse_dynamics/equation_rows.h"
#include "sysid/inverse_dynamics/filter_choice.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "sysid/inverse_dynamics/motion.h"
#include "sysid/inverse_dynamics/regression.h"
#include "sysid/linearization/statistics.h"

namespace sysid {
namespace {

// Stretches of time for cross-validation. Means of so many have a standard
// error that serial correlation does not spoil (batch means; Schmeiser 1982: 10
// to 30).
constexpr int kFolds = 20;

// The least squares of some columns.
struct Trial {
  std::vector<int> at;  // columns
  Eigen::VectorXd d;
  Eigen::VectorXd variance;  // by joint, of what is left
  double likelihood = -std::numeric_limits<double>::infinity();  // (11.14)
  // Of each fold, by the least squares of the others.
  std::vector<double> predicted;
};

class EquationSearch {
 public:
  EquationSearch(const ShootingProblem& problem, const EquationColumns& columns,
                 const EquationFilter& filter, std::vector<int> undriven);

  void Run();
  EquationLook Look() const;
  MechanismParameters<double> Values() const;

 private:
  EquationRows Rows(const sysid::Run& run) const;
  Trial Solve(std::vector<int> at, Eigen::VectorXd variance) const;
  std::vector<int> With(const std::vector<int>& chosen) const;
  // The changes of theta, in the order of trial.at.
  Eigen::VectorXd Changes(const Trial& trial) const;
  bool ActsOnAlone(int column, const std::vector<int>& joints) const;
  bool IsPossible(const Trial& trial, const std::vector<int>& chosen) const;
  void Predict(Trial* trial) const;  // `predicted`
  // Whether a predicts the folds better than b by more than a standard error.
  bool IsBetter(Trial* a, Trial* b) const { return Advantage(a, b) > 1.0; }
  // How much more likely, in standard errors of the difference.
  double Advantage(Trial* a, Trial* b) const;
  bool AddOne();
  bool TakeOutOne();
  std::vector<FollowedMotion> Followed() const;

  const ShootingProblem& problem_;
  const EquationColumns& columns_;
  const EquationFilter filter_;
  const ParameterMap map_;
  const std::vector<int> undriven_;
  std::vector<int> gains_;  // EffortGains
  Eigen::VectorXd theta_;
  ChangeBounds bounds_;             // of the free parameters; none of effects
  std::vector<EquationRows> rows_;  // by run
  std::vector<EquationProducts> folds_;
  EquationProducts all_;
  std::vector<int> chosen_;        // candidates
  std::map<int, double> p_value_;  // of the chosen, when they came
  Trial now_;
};

EquationSearch::EquationSearch(const ShootingProblem& problem,
                               const EquationColumns& columns,
                               const EquationFilter& filter,
                               std::vector<int> undriven)
    : problem_(problem),
      columns_(columns),
      filter_(filter),
      map_(columns.model, columns.parameters, false),
      undriven_(std::move(undriven)) {
  theta_.resize(map_.size());
  for (int i = 0; i < map_.size(); ++i) {
    theta_[i] = map_.parameters()[i].nominal;
  }
  constexpr double kNone = std::numeric_limits<double>::infinity();
  bounds_.lower.setConstant(map_.size(), -kNone);
  bounds_.upper.setConstant(map_.size(), kNone);
  for (int i = 0; i < columns.free; ++i) {
    bounds_.lower[i] = problem.free()[i].lower - theta_[i];
    bounds_.upper[i] = problem.free()[i].upper - theta_[i];
  }
  std::vector<std::string> names;
  for (const Parameter& p : columns.parameters) names.push_back(p.name);
  gains_ = EffortGains(columns.model, undriven_, names);
  int times = 0;
  for (const auto& data : problem.runs()) {
    rows_.push_back(Rows(data->run));
    times += rows_.back().times();
  }
  for (const EquationRows& rows : rows_) {
    const double share = rows.times() / std::max(1.0, 1.0 * times);
    const int folds = std::clamp(static_cast<int>(std::lround(kFolds * share)),
                                 1, std::max(1, rows.times()));
    for (int k = 0; k < folds; ++k) {
      folds_.push_back(MultiplyRows(rows, k * rows.times() / folds,
                                    (k + 1) * rows.times() / folds));
      AddProducts(folds_.back(), 1.0, &all_);
    }
  }
}

EquationRows EquationSearch::Rows(const sysid::Run& run) const {
  ThrowIfCancelled(problem_.options().stop);
  const Seeding<Jet24> seeding = [&](int begin, MechanismParameters<Jet24>* s) {
    std::vector<Jet24> seeded(theta_.data(), theta_.data() + theta_.size());
    const int end = std::min<int>(begin + Jet24::DIMENSION, map_.size());
    for (int i = begin; i < end; ++i) seeded[i] = Jet24(theta_[i], i - begin);
    map_.Apply<Jet24>(seeded.data(), s);
  };
  const int threads = problem_.options().threads;
  EquationRows rows = MakeEquationRows<Jet24>(
      columns_.model, SampleMotion(columns_.model, run, filter_, threads),
      map_.size(), seeding, {columns_.model.nominal(), {}, undriven_}, threads);
  NormaliseByGain(gains_, theta_, &rows);
  return rows;
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
  return at;
}

Trial EquationSearch::Solve(std::vector<int> at,
                            Eigen::VectorXd variance) const {
  constexpr int kReweighed = 3;  // sizes settle to some per cent
  Trial trial;
  trial.at = std::move(at);
  for (int round = 0; round < kReweighed; ++round) {
    trial.d = SolveWeighted(all_, trial.at, variance, bounds_);
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
  return trial;
}

void EquationSearch::Predict(Trial* trial) const {
  if (!trial->predicted.empty()) return;
  for (const EquationProducts& fold : folds_) {
    EquationProducts others = all_;
    AddProducts(fold, -1.0, &others);
    const Eigen::VectorXd d =
        SolveWeighted(others, trial->at, trial->variance, bounds_);
    double sum = 0.0;
    for (int v = 0; v < trial->variance.size(); ++v) {
      sum -= 0.5 * (fold.Left(v, trial->at, d) / trial->variance[v] +
                    fold.times[v] * std::log(trial->variance[v]));
    }
    trial->predicted.push_back(sum);
  }
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

bool EquationSearch::IsPossible(const Trial& trial,
                                const std::vector<int>& chosen) const {
  const Eigen::VectorXd changes = Changes(trial);
  int i = columns_.free;
  for (const int k : chosen) {
    const EquationColumns::Candidate& candidate = columns_.candidates[k];
    for (int c = 0; c < candidate.count; ++c, ++i) {
      const Parameter& parameter = columns_.parameters[candidate.first + c];
      const double value = theta_[candidate.first + c] + changes[i];
      if (!(value >= parameter.lower && value <= parameter.upper)) {
        return false;
      }
    }
  }
  return true;
}

double EquationSearch::Advantage(Trial* a, Trial* b) const {
  Predict(a);
  Predict(b);
  const int n = static_cast<int>(folds_.size());
  std::vector<double> gains;
  double mean = 0.0, squares = 0.0;
  for (int k = 0; k < n; ++k) {
    gains.push_back(a->predicted[k] - b->predicted[k]);
    mean += gains.back() / n;
  }
  for (const double gain : gains) squares += (gain - mean) * (gain - mean);
  return n * mean / std::sqrt(squares * n / std::max(1, n - 1));
}

bool EquationSearch::AddOne() {
  std::vector<std::pair<double, int>> order;
  std::map<int, Trial> trials;
  for (size_t k = 0; k < columns_.candidates.size(); ++k) {
    const int candidate = static_cast<int>(k);
    if (std::find(chosen_.begin(), chosen_.end(), candidate) != chosen_.end() ||
        columns_.candidates[k].changes_effort) {
      continue;
    }
    std::vector<int> chosen = chosen_;
    chosen.push_back(candidate);
    Trial trial = Solve(With(chosen), now_.variance);
    // By the Bayesian information criterion, or not worth a look.
    const double penalty =
        0.5 * columns_.candidates[k].count * std::log(all_.times.maxCoeff());
    const double gain = trial.likelihood - now_.likelihood - penalty;
    if (!(gain > 0.0) || !IsPossible(trial, chosen)) continue;
    order.emplace_back(gain / columns_.candidates[k].count, candidate);
    trials[candidate] = std::move(trial);
  }
  std::sort(order.rbegin(), order.rend());
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
  for (const auto& [gain, candidate] : order) {
    Trial& trial = trials[candidate];
    const double advantage = Advantage(&trial, &now_);
    if (!(advantage > Deviations(static_cast<int>(order.size())))) {
      continue;
    }
    chosen_.push_back(candidate);
    const double tests = static_cast<double>(columns_.candidates.size());
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
    if (IsBetter(&now_, &without) || !IsPossible(without, chosen)) continue;
    chosen_ = std::move(chosen);
    now_ = std::move(without);
    return true;
  }
  return false;
}

void EquationSearch::Run() {
  Eigen::VectorXd variance(all_.of.size());
  for (int v = 0; v < variance.size(); ++v) {
    variance[v] = std::max(all_.Left(v, {}, {}) / std::max(1.0, all_.times[v]),
                           std::numeric_limits<double>::min());
  }
  now_ = Solve(With({}), variance);
  while (AddOne()) {
    ThrowIfCancelled(problem_.options().stop);
    while (TakeOutOne()) {
    }
  }
}

MechanismParameters<double> EquationSearch::Values() const {
  const Eigen::VectorXd changes = Changes(now_);
  Eigen::VectorXd theta = theta_;
  for (size_t i = 0; i < now_.at.size(); ++i) theta[now_.at[i]] += changes[i];
  MechanismParameters<double> values;
  map_.Apply<double>(theta.data(), &values);
  return values;
}

// What is left of each joint, on the velocity of each other one, its sign and
// its acceleration: how much of what the joint's own three leave they explain.
std::vector<FollowedMotion> EquationSearch::Followed() const {
  constexpr double kMost = 0.5;  // of what is left
  const int nv = static_cast<int>(all_.of.size());
  const auto left = [&](const EquationRows& rows, int time, int v) {
    const auto row = rows.rows.row(time * nv + v);
    double r = row[rows.rows.cols() - 1];
    for (size_t i = 0; i < now_.at.size(); ++i) {
      r += row[now_.at[i]] * now_.d[i];
    }
    return r;
  };
  const auto motion = [&](const EquationRows& rows, int time, int w) {
    const double speed = rows.qd(time, w);
    return Eigen::Vector3d(speed, std::copysign(1.0, speed), rows.qdd(time, w));
  };
  // The squares of joint v that the motion of some joints leaves.
  const auto squares = [&](int v, const std::vector<int>& joints) {
    const int n = 3 * static_cast<int>(joints.size());
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(n), a(n);
    double sum = 0.0;
    for (const EquationRows& rows : rows_) {
      for (int t = 0; t < rows.times(); ++t) {
        for (size_t k = 0; k < joints.size(); ++k) {
          a.segment<3>(static_cast<Eigen::Index>(3 * k)) =
              motion(rows, t, joints[k]);
        }
        const double r = left(rows, t, v);
        G += a * a.transpose();
        g += a * r;
        sum += r * r;
      }
    }
    return sum - g.dot(SolveScaled(G, g));
  };
  const std::vector<std::string> names = VelocityNames(columns_.model);
  std::vector<FollowedMotion> followed;
  for (int v = 0; v < nv; ++v) {
    const double own = squares(v, {v});
    FollowedMotion best;
    for (int w = 0; w < nv; ++w) {
      if (w == v) continue;
      const double share = own > 0.0 ? 1.0 - squares(v, {v, w}) / own : 0.0;
      if (share > best.share) best = {names[v], names[w], share};
    }
    if (best.share > kMost) followed.push_back(best);
  }
  return followed;
}

EquationLook EquationSearch::Look() const {
  EquationLook look;
  const Eigen::VectorXd changes = Changes(now_);
  int i = columns_.free;
  for (const int k : chosen_) {
    const EquationColumns::Candidate& candidate = columns_.candidates[k];
    ScreenedEffect effect;
    effect.effect = candidate.effect;
    effect.dof = candidate.count;
    effect.p_value = p_value_.at(k);
    for (int c = 0; c < candidate.count; ++c, ++i) {
      const Parameter& parameter = columns_.parameters[candidate.first + c];
      ExpectedParameter expected;
      expected.name = parameter.name;
      expected.unit = parameter.unit;
      expected.null_value = theta_[candidate.first + c];
      expected.value = expected.null_value + changes[i];
      effect.parameters.push_back(expected);
    }
    look.effects.push_back(std::move(effect));
  }
  look.tests = static_cast<int>(columns_.candidates.size());
  look.followed = Followed();
  return look;
}

bool IsMeasured(const Model& model, const DataSet& data) {
  return std::all_of(data.runs().begin(), data.runs().end(),
                     [&](const auto& one) {
                       return UnmeasuredJoints(model, one->run).empty() &&
                              one->run.effort.size() > 0 &&
                              (one->run.effort.array() != 0.0).any();
                     });
}

}  // namespace

EquationLook LookByEquations(
    const ShootingProblem& problem,
    const std::vector<std::shared_ptr<const Effect>>& candidates,
    const std::set<std::string>& known) {
  // Internal states are no part of the equations of one instant.
  if (!IsMeasured(problem.model(), problem.data()) ||
      problem.model().layout().nz() > 0) {
    return {};
  }
  const ShootingProblem started = StartByInverseDynamics(problem);
  MechanismParameters<double> values;
  started.map().Apply<double>(started.InitialTheta().data(), &values);
  Model start = started.model();
  start.SetNominal(values);
  std::vector<const Run*> runs;
  for (const auto& data : problem.runs()) runs.push_back(&data->run);
  const EquationColumns columns =
      MakeEquationColumns(start, problem.free(), candidates, known);
  const EquationFilter first = FirstFilter(runs);
  const std::vector<int> undriven = UndrivenJoints(started);
  EquationSearch slow(problem, columns, first, undriven);
  slow.Run();
  EquationSearch search(problem, columns,
                        ChooseFilter(columns.model, slow.Values(), runs, first,
                                     problem.options().threads),
                        undriven);
  search.Run();
  return search.Look();
}

}  // namespace sysid
