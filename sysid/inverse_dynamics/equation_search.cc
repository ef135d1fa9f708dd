#include "sysid/inverse_dynamics/equation_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "glog/logging.h"
#include "sysid/linearization/statistics.h"

namespace sysid {
namespace {

using Fit = EquationModels::Fit;

// Of a deviate that is the best of so many, one-sided.
double PValue(double deviate, int tests) {
  return std::min(1.0, tests * 0.5 * std::erfc(deviate / std::sqrt(2.0)));
}

}  // namespace

EquationSearch::EquationSearch(std::unique_ptr<const EquationModels> models,
                               std::function<void()> throw_if_cancelled)
    : models_(std::move(models)),
      throw_if_cancelled_(std::move(throw_if_cancelled)),
      now_(models_->Given()) {}

bool EquationSearch::IsChosen(int candidate) const {
  return std::find(chosen().begin(), chosen().end(), candidate) !=
         chosen().end();
}

bool EquationSearch::IsExcluded(int candidate,
                                const std::vector<int>& by) const {
  return std::any_of(by.begin(), by.end(), [&](int k) {
    return k != candidate && models_->Exclude(candidate, k);
  });
}

int EquationSearch::special_laws() const {
  return static_cast<int>(
      std::count_if(chosen().begin(), chosen().end(),
                    [this](int k) { return !models_->IsPlain(k); }));
}

void EquationSearch::AskPlainLaws(const Effect* of,
                                  std::vector<int>* chosen) const {
  std::vector<int> plain;
  for (int k = 0; k < models_->size(); ++k) {
    const int joint = models_->effect(k).joint();
    if (models_->IsPlain(k) && (of == nullptr || joint == of->joint() ||
                                joint == of->second_joint())) {
      plain.push_back(k);
      std::erase(*chosen, k);
    }
  }
  std::erase_if(plain, [&](int k) { return IsExcluded(k, *chosen); });
  const std::vector<EquationModels::Promise> promises =
      models_->Promises(*chosen, now_, plain);
  for (size_t i = 0; i < plain.size(); ++i) {
    if (promises[i].dof > 0) chosen->push_back(plain[i]);
  }
}

void EquationSearch::SettlePlainLaws() {
  // Standard errors: every driven joint has friction and a rotor, so that
  // chance is asked of each law alone (of a normal deviate 1 in 20); of a bias,
  // which many do not have, as of the best of all.
  constexpr double kLeast = 2.0;
  const double least_of_bias = models_->Significant(models_->size());
  std::vector<int> chosen = now_.chosen;
  AskPlainLaws(nullptr, &chosen);
  std::set<int> needed;  // by the bodies
  for (;;) {
    throw_if_cancelled_();
    now_ = models_->Solve(chosen, now_.variance);
    const std::vector<int> impossible = models_->Impossible(now_);
    // Of each its size beside what it must be, below zero where no such law is
    // possible.
    int least = -1;
    double t_least = 1.0;
    for (const int k : chosen) {
      if (!models_->IsPlain(k) || needed.contains(k)) continue;
      double t = models_->SizeOf(&now_, k);
      if (std::find(impossible.begin(), impossible.end(), k) !=
          impossible.end()) {
        t = -t;
      }
      p_value_[k] = PValue(t, models_->size());
      t /= models_->effect(k).kind() == "effort_bias" ? least_of_bias : kLeast;
      if (t < t_least) {
        t_least = t;
        least = k;
      }
    }
    if (least < 0) return;
    std::vector<int> rest = chosen;
    std::erase(rest, least);
    if (models_->bodies_are_free() && t_least >= 0.0 &&
        models_->Unbends(now_, models_->Solve(rest, now_.variance))) {
      needed.insert(least);
      continue;
    }
    chosen = std::move(rest);
  }
}

bool EquationSearch::AddOne() {
  // By the order of their first-order gains: what is not among the first few
  // of those is not the best by cross-validation either. Of a law that is
  // searched two values.
  constexpr size_t kMostTried = 12;
  constexpr int kMostValues = 2;
  std::vector<int> every(models_->size());
  std::iota(every.begin(), every.end(), 0);
  // Beside what is chosen, and beside all plain laws, some of which may have
  // become impossible for want of it.
  std::vector<EquationModels::Promise> promises =
      models_->Promises(chosen(), now_, every);
  std::vector<int> beside = chosen();
  AskPlainLaws(nullptr, &beside);
  const std::vector<EquationModels::Promise> beside_all =
      models_->Promises(beside, now_, every);
  for (const int k : every) {
    if (beside_all[k].gain > promises[k].gain) promises[k] = beside_all[k];
  }
  std::vector<std::pair<double, int>> order;
  for (const int k : every) {
    const auto [promised, dof] = promises[k];
    // By the Bayesian information criterion, or not worth a look.
    const double gain = promised - 0.5 * dof * std::log(models_->most_times());
    if (gain > 0.0 && !IsChosen(k)) order.emplace_back(gain / dof, k);
  }
  std::sort(order.rbegin(), order.rend());
  const double deviations = models_->Significant(models_->size());
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
  std::map<std::string, int> values;
  std::erase_if(order, [&](const auto& one) {
    return ++values[models_->effect(one.second).name()] > kMostValues;
  });
  if (order.size() > kMostTried) order.resize(kMostTried);
  struct Found {
    int candidate;
    Fit fit;
    double advantage;
  };
  std::optional<Found> best;
  for (const auto& [gain, candidate] : order) {
    // Once one was found, those that may say the same: of fewer directions, or
    // commoner.
    if (best && std::pair(promises[candidate].dof, candidate) >
                    std::pair(promises[best->candidate].dof, best->candidate)) {
      continue;
    }
    std::vector<int> with = chosen();
    std::erase_if(with, [this, added = candidate](int k) {
      return models_->Exclude(k, added);
    });
    with.push_back(candidate);
    // What it explains may have been what plain laws of its joints stood for,
    // or what made others of them impossible.
    AskPlainLaws(&models_->effect(candidate), &with);
    Fit fit = models_->SolvePossible(std::move(with), now_.variance);
    if (!models_->IsPossible(fit) ||
        std::find(fit.chosen.begin(), fit.chosen.end(), candidate) ==
            fit.chosen.end()) {
      continue;
    }
    const double advantage = models_->Advantage(&fit, &now_);
    const bool predicts =
        advantage > deviations && models_->Matters(&fit, &now_);
    VLOG(2) << "tried " << models_->effect(candidate).name() << ": gain "
            << gain << ", advantage " << advantage << " of " << deviations
            << ", bodies " << now_.cost_of_bodies << " to "
            << fit.cost_of_bodies;
    if (!predicts && !models_->Unbends(fit, now_)) continue;
    if (best && IsWorthMore(&best->fit, &fit)) continue;
    best = {candidate, std::move(fit), advantage};
  }
  if (!best) return false;
  VLOG(1) << "added " << models_->effect(best->candidate).name()
          << ", advantage " << best->advantage;
  p_value_[best->candidate] = PValue(best->advantage, models_->size());
  now_ = std::move(best->fit);
  return true;
}

bool EquationSearch::TakeOutOne() {
  for (const int k : std::vector<int>(chosen())) {
    // Of plain laws SettlePlainLaws decides.
    if (models_->IsPlain(k)) continue;
    std::vector<int> rest = chosen();
    std::erase(rest, k);
    AskPlainLaws(&models_->effect(k), &rest);
    Fit without = models_->SolvePossible(std::move(rest), now_.variance);
    if (models_->Advantage(&now_, &without) > 1.0 ||
        !models_->IsPossible(without) || models_->Unbends(now_, without)) {
      continue;
    }
    VLOG(1) << "took out " << models_->effect(k).name();
    now_ = std::move(without);
    return true;
  }
  return false;
}

void EquationSearch::Replace(int of, int by, Fit fit) {
  VLOG(1) << models_->effect(of).name() << " became "
          << models_->effect(by).name();
  p_value_[by] = p_value_[of];
  now_ = std::move(fit);
}

bool EquationSearch::MoveOne() {
  constexpr double kLikelier = 1e-6;  // of the likelihood, or rounding
  for (const int of : std::vector<int>(chosen())) {
    if (models_->IsPlain(of)) continue;
    const Effect& now = models_->effect(of);
    for (int k = 0; k < models_->size(); ++k) {
      const Effect& other = models_->effect(k);
      if (models_->IsPlain(k) || IsChosen(k) || other.joint() < 0 ||
          other.joint() != now.joint() ||
          other.second_joint() != now.second_joint()) {
        continue;
      }
      std::vector<int> with = chosen();
      std::erase_if(with,
                    [&](int c) { return c == of || models_->Exclude(c, k); });
      with.push_back(k);
      const bool is_same = other.name() == now.name();
      if (!is_same) AskPlainLaws(&other, &with);
      Fit fit = models_->Solve(with, now_.variance);
      const double more = models_->columns_of(k) > models_->columns_of(of)
                              ? models_->Significant(models_->size())
                              : 1.0;
      if (!(fit.likelihood >
            now_.likelihood + kLikelier * std::abs(now_.likelihood)) ||
          !models_->IsPossible(fit) ||
          (!is_same && !IsWorthMore(&fit, &now_, more))) {
        continue;
      }
      Replace(of, k, std::move(fit));
      return true;
    }
  }
  return false;
}

bool EquationSearch::SimplifyOne() {
  for (const int of : std::vector<int>(chosen())) {
    if (models_->IsPlain(of)) continue;
    const Effect& now = models_->effect(of);
    for (int k = 0; k < models_->size(); ++k) {
      const int joint = models_->effect(k).joint();
      if (!(models_->IsPlain(k) ||
            models_->columns_of(k) < models_->columns_of(of)) ||
          IsChosen(k) || joint < 0 || joint != now.joint()) {
        continue;
      }
      std::vector<int> with = chosen();
      std::erase(with, of);
      if (IsExcluded(k, with)) continue;
      with.push_back(k);
      AskPlainLaws(&now, &with);
      Fit fit = models_->Solve(with, now_.variance);
      if (!models_->IsPossible(fit) || IsWorthMore(&now_, &fit) ||
          models_->Unbends(now_, fit)) {
        continue;
      }
      Replace(of, k, std::move(fit));
      return true;
    }
  }
  return false;
}

void EquationSearch::Run(int most_special_laws) {
  SettlePlainLaws();
  // What is added, moved and simplified may go round: from every set once.
  std::set<std::set<int>> began, moved;
  const auto is_new = [this](std::set<std::set<int>>* sets) {
    return sets->emplace(chosen().begin(), chosen().end()).second;
  };
  // What was found may have hidden plain laws of its joints.
  for (bool any = true; any;) {
    any = false;
    while (special_laws() <= most_special_laws && is_new(&began) && AddOne()) {
      any = true;
      while (is_new(&moved) && (MoveOne() || TakeOutOne() || SimplifyOne())) {
        throw_if_cancelled_();
      }
    }
    const std::vector<int> before = chosen();
    if (any) SettlePlainLaws();
    any = any && chosen() != before;
  }
  models_->LeaveStretchesOut(&now_);
  VLOG(1) << "left by joint: " << now_.variance.cwiseSqrt().transpose();
}

}  // namespace sysid
