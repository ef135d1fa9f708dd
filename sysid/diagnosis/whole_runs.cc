// The part of the search that looks at whole runs, where models that segments
// do not tell apart may differ.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "sysid/diagnosis/rivals.h"
#include "sysid/diagnosis/search.h"
#include "sysid/diagnosis/shared_refits.h"
#include "sysid/estimation/segmentation.h"

namespace sysid {

bool Search::AsksWholeRuns(const EvaluatedModel& evaluated) const {
  return !IsAtNoiseFloor(evaluated) && problem_.options.segment <= 0;
}

std::optional<Fit> Search::FitToWholeRuns(const EvaluatedModel& evaluated,
                                          double wanted) {
  // The models so far, and what is compared with them: each takes seconds.
  constexpr size_t kKept = 8;
  std::set<std::string> effects = EffectsOf(evaluated);
  const Eigen::VectorXd& theta = evaluated.fit.point.theta;
  std::erase_if(whole_fits_, [&](const WholeFit& kept) {
    // One that ended early says only that its error is above what was wanted.
    return kept.effects == effects && kept.wanted < wanted &&
           !(kept.fit && kept.fit->train.total.normalized_rms <= kept.wanted);
  });
  for (const WholeFit& kept : whole_fits_) {
    if (kept.effects == effects && kept.theta.size() == theta.size() &&
        kept.theta == theta) {
      return kept.fit;
    }
  }
  if (whole_fits_.size() == kKept) whole_fits_.erase(whole_fits_.begin());
  whole_fits_.push_back(
      {std::move(effects), theta, wanted,
       FitWholeRuns(WithAllRuns(problem_, evaluated), evaluated, wanted)});
  return whole_fits_.back().fit;
}

double Search::WholeRunsError(const EvaluatedModel& evaluated, double wanted) {
  const std::optional<Fit> whole = FitToWholeRuns(evaluated, wanted);
  return whole ? whole->train.total.normalized_rms
               : std::numeric_limits<double>::infinity();
}

double Search::HeldOutWholeRunsError(const EvaluatedModel& evaluated) {
  const EstimationOptions quiet = QuietOptions(problem_, evaluated);
  const std::optional<Fit> whole = FitWholeRuns(
      evaluated.problem->With(quiet).StartingAt(evaluated.fit.point.theta),
      evaluated);
  if (!whole || problem_.holdout == nullptr) {
    return std::numeric_limits<double>::infinity();
  }
  return EvaluateHoldout(OpenHoldout(whole->model, problem_.holdout, quiet,
                                     whole->point.rollout,
                                     problem_.holdout->LongestDuration()),
                         nullptr)
      .errors.total.normalized_rms;
}

bool Search::TakesThePlaceOf(const EvaluatedModel& other,
                             const EvaluatedModel& with) {
  if (other.fit.parameters.size() == with.fit.parameters.size() &&
      AreAsGood(other, with) && AsksWholeRuns(with)) {
    Report("comparing over whole runs", with.train_error());
    // NaN where neither is followed.
    const double error = WholeRunsError(with);
    const double ratio =
        WholeRunsError(other, error * (1.0 + kMatters)) / error;
    if (ratio < 1.0 / (1.0 + kMatters)) return true;
    if (ratio > 1.0 + kMatters) return false;
  }
  return refits_.IsBetter(other, with);
}

std::vector<std::string> Search::NamesOf(const std::vector<Instead>& instead) {
  std::vector<std::string> names;
  for (const Instead& one : instead) names.push_back(one.effect.name());
  return names;
}

std::vector<Search::Instead> Search::AsGoodInstead(
    const EvaluatedModel& model, const std::string& name,
    std::vector<std::string> others, bool alike) {
  std::vector<Instead> as_good;
  std::erase_if(others, [&](const std::string& other) {
    return EffectsOf(model).contains(other);
  });
  if (others.empty() && !alike) return as_good;
  const double whole = AsksWholeRuns(model)
                           ? WholeRunsError(model)
                           : std::numeric_limits<double>::infinity();
  const bool longer = std::isfinite(whole);
  const EstimationOptions options =
      TrialOptions(problem_.options, model.train_error());
  const EvaluatedModel without = Without(name, model);
  const Screening screening = Screen(without);
  if (alike) AddNames(AlikeTo(screening, name), &others);
  for (const std::string& other : others) {
    const int effect = screening.IndexOf(other);
    if (effect < 0) continue;
    Report("alternatives to " + name, model.train_error());
    Instead instead{
        screening.effects[effect],
        EvaluateWith(problem_, without, {&screening.effects[effect]}, options)};
    if (!WhyImplausible(instead.model).empty()) continue;
    if (longer) {
      instead.whole_before = whole;
      const double wanted = (1.0 + kMatters) * whole;
      instead.error = WholeRunsError(instead.model, wanted);
      if (!(instead.error < wanted)) continue;
      instead.better = instead.error * (1.0 + kMatters) < whole;
    } else {
      instead.error = instead.model.cv.error();
      instead.better = IsWorse(model.cv, instead.model.cv);
      if (!instead.better && !(instead.error < model.cv.error()) &&
          !AreAsGood(instead.model, model)) {
        continue;
      }
    }
    as_good.push_back(std::move(instead));
  }
  return as_good;
}

bool Search::AddOverWholeRuns() {
  constexpr size_t kMostTried = 3;
  if (!AsksWholeRuns(now())) return false;
  Report("effects over whole runs", now().train_error());
  const std::optional<Fit> whole = FitToWholeRuns(now());
  if (!whole) return false;
  const ShootingProblem all = WithAllRuns(problem_, now());
  const double before = whole->train.total.normalized_rms;
  const Solution cut =
      Recut(all, whole->point, std::numeric_limits<double>::infinity());
  const LinearizedFit linearized(all, cut);
  if (!linearized.Valid()) return false;
  std::vector<CandidateRefit> refits = ProposeEffects(
      ScreenEffects(linearized, whole->model, candidates_, problem_.known));
  std::erase_if(refits, [&](const CandidateRefit& refit) {
    return refit.predicted * (1.0 + kMatters) > before;
  });
  if (refits.size() > kMostTried) refits.resize(kMostTried);
  if (refits.empty()) return false;
  RefitProposals(problem_, candidates_, now(), &refits);
  double least = before / (1.0 + kMatters), held_out = -1.0;
  CandidateRefit* best = nullptr;
  std::vector<std::string> tried;
  for (CandidateRefit& refit : refits) {
    const EvaluatedModel& after = *refit.after;
    tried.push_back(refit.expected[0].name());
    // What takes least time first.
    if (!WhyImplausible(after).empty() || IsWorse(after.cv, now().cv)) continue;
    const double error = WholeRunsError(after, least);
    if (!(error < least)) continue;
    if (held_out < 0.0) held_out = HeldOutWholeRunsError(now());
    if (!ExplainsEnough(held_out, HeldOutWholeRunsError(after)) ||
        !Chance(after).empty()) {
      continue;
    }
    least = error;
    best = &refit;
  }
  if (best == nullptr) return false;
  const ScreenedEffect& effect = best->expected[0];
  explain_the_same_[effect.name()] = std::move(tried);
  DiagnosisStep step = StepFrom(now());
  step.effects = {effect.name()};
  step.indistinguishable_from = {{}};
  step.whole_before = before;
  step.whole_after = least;
  step.predicted = best->predicted;
  model_ = std::make_shared<EvaluatedModel>(
      EvaluateAgain(problem_, std::move(*best->after)));
  step.parameters = EstimatesOf(*model_, {effect.effect.get()});
  EndAt(model_, &step);
  diagnosis_.steps.push_back(std::move(step));
  return true;
}

}  // namespace sysid
