#include "sysid/diagnosis/diagnose.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "models/error.h"
#include "sysid/diagnosis/candidate_forces.h"
#include "sysid/diagnosis/effect_search.h"
#include "sysid/diagnosis/formula_proposals.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/diagnosis/longer_segments.h"
#include "sysid/estimation/cancelled.h"

namespace sysid {
namespace {

constexpr int kMostCompared = 12;  // candidates whose forces are shown

using Answer = EffectSearch::Answer;

// Why the fit of the model as given is not to be trusted.
void AddDoubts(Diagnosis* diagnosis) {
  const Fit& fit = diagnosis->base.fit;
  std::vector<std::string>& doubts = diagnosis->doubts;
  if (!fit.converged) {
    doubts.push_back("the fit did not converge: " + fit.termination);
  }
  for (const ParameterEstimate& p : fit.parameters) {
    if (p.at_bound) doubts.push_back(p.name + " ended at its bound");
  }
  // Another model, or motion unlike that of the fit.
  constexpr double kForeign = 5.0;
  const double train = std::max(1.0, diagnosis->base.train_error());
  if (diagnosis->base.holdout_error() > kForeign * train) {
    doubts.push_back(
        "the held-out runs are predicted much worse than the fitted ones: are "
        "they of the same machine?");
  }
  for (const std::vector<std::string>& group : fit.not_identifiable) {
    doubts.push_back(NotIdentifiable(group));
  }
}

// Writes an answer down as a diagnosis.
class Writer {
 public:
  Writer(const DiagnosisProblem& problem, const Candidates& candidates,
         const Answer& answer)
      : problem_(problem),
        candidates_(candidates),
        answer_(answer),
        base_(*answer.base),
        found_(*answer.found) {}

  // Of a search that was stopped nothing is fitted or linearised any more.
  Diagnosis Write(bool add, bool stopped) const {
    Diagnosis diagnosis(problem_.model);
    diagnosis.base = base_.model;
    diagnosis.usable = answer_.usable;
    AddDoubts(&diagnosis);
    if (const Fit& fit = found_.model.fit;
        !found_.effects.empty() && !answer_.at_noise && !fit.converged) {
      diagnosis.doubts.push_back("the fit with " +
                                 Join(Names(found_), " and ") +
                                 " did not converge: " + fit.termination);
    }
    if (!stopped && !answer_.by_equations) FillStability(&diagnosis);
    diagnosis.verdict = VerdictOfGiven();
    if (!diagnosis.stand_ins.empty()) {
      diagnosis.verdict = Verdict::kUnexplained;
    }
    diagnosis.final_verdict =
        answer_.at_noise ? Verdict::kAdequate : Verdict::kUnexplained;
    for (const int e : answer_.order) {
      diagnosis.proposed.push_back(candidates_[e]->name());
    }
    FillRivals(&diagnosis);
    if (add && !found_.effects.empty()) FillSteps(&diagnosis);
    diagnosis.by_equations = answer_.by_equations;
    diagnosis.look = answer_.look;
    diagnosis.where.followed = answer_.look.followed;
    diagnosis.where.rejected_efforts = answer_.look.rejected;
    // Nothing of an arm was rolled out that could be linearised.
    if (stopped || !diagnosis.usable || answer_.by_equations) {
      List(Screening(), &diagnosis);
      if (answer_.by_equations) diagnosis.tests = answer_.look.tests;
      diagnosis.where.channels = base_.model.fit.train.channels;
      diagnosis.where.segments = base_.model.fit.train.segments;
      diagnosis.comparison.path = {ErrorsOf(base_.model)};
      for (const DiagnosisStep& step : diagnosis.steps) {
        diagnosis.comparison.path.push_back(ErrorsOf(*step.after));
      }
      return diagnosis;
    }
    List(ScreenEffects(
             LinearizedFit(*base_.model.problem, base_.model.fit.point),
             base_.model.fit.model, candidates_, problem_.known),
         &diagnosis);
    FillComparison(add, &diagnosis);
    diagnosis.where = FindWhere(*base_.model.problem, base_.model.fit);
    diagnosis.where.followed = answer_.look.followed;
    AddForcesToCompare(base_.model, kMostCompared, &diagnosis.where.force,
                       &diagnosis.candidates);
    return diagnosis;
  }

 private:
  Verdict VerdictOfGiven() const {
    // An arm of which only given values are wrong lacks no effect.
    if (!answer_.explains || (answer_.by_equations && found_.effects.empty())) {
      return Verdict::kUnexplained;
    }
    if (found_.effects.empty()) return Verdict::kAdequate;
    return std::all_of(answer_.rivals.begin(), answer_.rivals.end(),
                       [&](const auto& rival) { return IsSame(*rival); })
               ? Verdict::kMissingEffect
               : Verdict::kUndecided;
  }
  // Whether it is the answer's force, under another name.
  bool IsSame(const FittedSet& rival) const {
    return answer_.same_force.contains(rival.effects);
  }
  bool IsRival(const FittedSet& fitted) const {
    return std::any_of(
        answer_.rivals.begin(), answer_.rivals.end(),
        [&](const auto& rival) { return rival->effects == fitted.effects; });
  }
  std::vector<std::string> Names(const FittedSet& fitted) const {
    std::vector<std::string> names;
    for (const int e : fitted.effects) names.push_back(candidates_[e]->name());
    return names;
  }

  // Where a rival differs from the answer by one effect: that one, and what
  // stands in its place. -1, -1 elsewhere.
  std::pair<int, int> Exchange(const FittedSet& rival) const {
    std::vector<int> gone, come;
    std::set_difference(found_.effects.begin(), found_.effects.end(),
                        rival.effects.begin(), rival.effects.end(),
                        std::back_inserter(gone));
    std::set_difference(rival.effects.begin(), rival.effects.end(),
                        found_.effects.begin(), found_.effects.end(),
                        std::back_inserter(come));
    if (gone.size() != 1 || come.size() != 1) return {-1, -1};
    return {gone[0], come[0]};
  }
  std::vector<std::string> InPlaceOf(int effect) const {
    std::vector<std::string> others;
    for (const auto& rival : answer_.rivals) {
      const auto [gone, come] = Exchange(*rival);
      if (gone == effect) others.push_back(candidates_[come]->name());
    }
    return others;
  }
  std::string ToldApart(int a, int b) const {
    return ToldApartBy(*candidates_[a], *candidates_[b]);
  }

  Confirmation Confirm(const FittedSet& fitted, int effect) const {
    const EvaluatedModel& model = fitted.model;
    Confirmation confirmed;
    confirmed.train = model.train_error();
    confirmed.holdout = model.holdout_error();
    confirmed.cv = model.cv;
    confirmed.segment_s = model.fit.segment_s;
    for (const int other : fitted.effects) {
      if (other == effect) continue;
      confirmed.together_with.push_back(candidates_[other]->name());
    }
    confirmed.parameters = EstimatesOf(model, {candidates_[effect].get()});
    return confirmed;
  }

  // The effects of the answer first, then all others as the model as given was
  // screened for them.
  void List(const Screening& screening, Diagnosis* diagnosis) const {
    diagnosis->tests = screening.tests;
    std::set<std::string> listed;
    for (const int e : answer_.order) {
      ScreenedEffect screened;
      screened.effect = candidates_[e];
      screened.p_value = std::nan("");
      screened.predicted_error = found_.model.train_error();
      const int at = screening.IndexOf(candidates_[e]->name());
      const bool tested =
          std::find(answer_.assumed.begin(), answer_.assumed.end(), e) ==
          answer_.assumed.end();
      if (at >= 0 && tested) screened = screening.effects[at];
      for (const ScreenedEffect& shown : answer_.look.effects) {
        if (answer_.by_equations && shown.name() == screened.name()) {
          screened.p_value = shown.p_value;
          screened.dof = shown.dof;
          screened.without_influence = shown.without_influence;
          screened.parameters = shown.parameters;
        }
      }
      CandidateEffect one{screened, Confirm(found_, e), InPlaceOf(e), "", {}};
      one.confirmed->accepted = true;
      for (const auto& rival : answer_.rivals) {
        const auto [gone, come] = Exchange(*rival);
        if (gone != e || !one.told_apart_by.empty()) continue;
        one.told_apart_by = ToldApart(gone, come);
      }
      listed.insert(candidates_[e]->name());
      diagnosis->candidates.push_back(std::move(one));
    }
    for (const ScreenedEffect& screened : screening.effects) {
      if (!listed.insert(screened.name()).second) continue;
      CandidateEffect other{screened, std::nullopt, {}, "", {}};
      for (const auto& fitted : answer_.fitted) {
        if (fitted->effects.size() != 1 ||
            candidates_[fitted->effects[0]]->name() != other.screened.name()) {
          continue;
        }
        other.confirmed = Confirm(*fitted, fitted->effects[0]);
        other.confirmed->refused =
            !fitted->refused.empty() ? fitted->refused
            : found_.effects.empty()
                ? "it does not improve the prediction of held-out data"
            : IsSame(*fitted)  ? "another name of the same force"
            : IsRival(*fitted) ? "others explain the data as well"
                               : "others predict held-out data better";
      }
      diagnosis->candidates.push_back(std::move(other));
    }
  }

  // A model at the noise leaves nothing that another law would explain; and of
  // one that is at no minimum the strata tell how far that is.
  void FillStability(Diagnosis* diagnosis) const {
    if (!found_.model.fit.converged) return;
    diagnosis->stability = ParametersByStrata(found_.model);
    if (!answer_.at_noise)
      diagnosis->stand_ins = StandIns(diagnosis->stability);
  }

  void FillRivals(Diagnosis* diagnosis) const {
    if (answer_.rivals.empty()) return;
    diagnosis->rivals = {
        {diagnosis->proposed, "", true, {answer_.found, &found_.model}}};
    for (const auto& rival : answer_.rivals) {
      const auto [gone, come] = Exchange(*rival);
      diagnosis->rivals.push_back({Names(*rival),
                                   gone < 0 ? "" : ToldApart(gone, come),
                                   IsSame(*rival),
                                   {rival, &rival->model}});
    }
  }

  // Of the fitted sets those that lead to the answer, each a part of the next.
  std::vector<std::shared_ptr<const FittedSet>> Path() const {
    std::vector<std::shared_ptr<const FittedSet>> path = {answer_.found};
    while (path.front()->effects.size() > 1) {
      std::shared_ptr<const FittedSet> before;
      const std::vector<int>& all = path.front()->effects;
      for (const auto& fitted : answer_.fitted) {
        const std::vector<int>& some = fitted->effects;
        if (some.empty() || some.size() >= all.size() || !fitted->IsAnswer() ||
            !std::includes(all.begin(), all.end(), some.begin(), some.end())) {
          continue;
        }
        if (before == nullptr || some.size() > before->effects.size() ||
            (some.size() == before->effects.size() &&
             fitted->error() < before->error())) {
          before = fitted;
        }
      }
      if (before == nullptr) break;
      path.insert(path.begin(), before);
    }
    return path;
  }

  void FillSteps(Diagnosis* diagnosis) const {
    std::vector<int> have;
    const EvaluatedModel* before = &base_.model;
    for (const auto& fitted : Path()) {
      DiagnosisStep step;
      step.segment_s = before->fit.segment_s;
      step.train_before = before->train_error();
      step.holdout_before = before->holdout_error();
      step.cv_before = before->cv;
      step.predicted = step.train_after = fitted->model.train_error();
      step.holdout_after = fitted->model.holdout_error();
      for (const int e : answer_.order) {
        if (std::find(have.begin(), have.end(), e) != have.end() ||
            std::find(fitted->effects.begin(), fitted->effects.end(), e) ==
                fitted->effects.end()) {
          continue;
        }
        have.push_back(e);
        step.effects.push_back(candidates_[e]->name());
        step.indistinguishable_from.push_back(fitted == answer_.found
                                                  ? InPlaceOf(e)
                                                  : std::vector<std::string>{});
        for (const ParameterEstimate& p :
             EstimatesOf(fitted->model, {candidates_[e].get()})) {
          step.parameters.push_back(p);
        }
      }
      step.after = {fitted, &fitted->model};
      before = &fitted->model;
      diagnosis->steps.push_back(std::move(step));
    }
    diagnosis->final = diagnosis->steps.back().after;
  }

  void FillComparison(bool add, Diagnosis* diagnosis) const {
    const EvaluatedModel& last = add ? found_.model : base_.model;
    ModelComparison& comparison = diagnosis->comparison;
    comparison.path = {ErrorsOver(problem_, base_.model, last)};
    for (const DiagnosisStep& step : diagnosis->steps) {
      comparison.path.push_back(ErrorsOver(problem_, *step.after, last));
    }
    std::vector<ModelErrors> tried;
    for (const auto& fitted : answer_.fitted) {
      tried.push_back(ErrorsOf(fitted->model));
    }
    SetNeighbours(tried, last, &comparison);
  }

  const DiagnosisProblem& problem_;
  const Candidates& candidates_;
  const Answer& answer_;
  const FittedSet &base_, &found_;
};

// Joints on which a force is missing, from the model as given or from the
// answer: what is in the answer in place of a law may move it to others.
std::set<std::string> JointsThatMissForce(const Where& given,
                                          const EvaluatedModel& found) {
  std::set<std::string> joints;
  const auto add = [&](const Where& where) {
    for (const JointForce& force : where.joints) {
      if (force.significant) joints.insert(force.joint);
    }
  };
  add(given);
  if (!found.added.empty()) add(FindWhere(*found.problem, found.fit));
  return joints;
}

// Whether a formula could be the better answer: above the noise by what matters
// (J.2), of a model that can be followed.
bool MayLackALaw(const Diagnosis& diagnosis, const Answer& answer) {
  return diagnosis.usable && !diagnosis.by_equations &&
         diagnosis.verdict != Verdict::kAdequate &&
         answer.found->error() > 1.0 + kMatters;
}

// The verdict on what a search found that was stopped, where there is time for
// it.
bool ExplainsSoFar(const DiagnosisProblem& problem, const Answer& answer,
                   const std::stop_token& until) {
  if (!until.stop_possible() || until.stop_requested()) return answer.explains;
  DiagnosisProblem judged = problem;
  judged.options.stop = until;
  try {
    return EffectSearch::Explains(judged, answer);
  } catch (const Cancelled&) {
    return answer.explains;
  }
}

}  // namespace

std::vector<std::string> Diagnosis::added() const {
  std::vector<std::string> names;
  for (const auto& effect : last().added) names.push_back(effect->name());
  return names;
}

std::vector<std::string> Diagnosis::ConfirmedBy() const {
  std::vector<std::string> by;
  if (verdict != Verdict::kMissingEffect && verdict != Verdict::kUndecided) {
    return by;
  }
  const auto is_shown = [&](const std::string& name) {
    return std::any_of(
        look.effects.begin(), look.effects.end(),
        [&](const ScreenedEffect& effect) { return effect.name() == name; });
  };
  if (by_equations || std::all_of(proposed.begin(), proposed.end(), is_shown)) {
    by.push_back("equations_of_motion");
  }
  // Of an arm short predictions are all that there is.
  const bool predicts =
      final == nullptr || (final->train_error() < base.train_error() &&
                           !(final->holdout_error() > base.holdout_error()));
  if (!by_equations || predicts) by.push_back("segments");
  double longest = 0.0;
  for (const auto& data : last().problem->data().runs()) {
    longest = std::max(longest, data->run.t.back() - data->run.t.front());
  }
  if (!by_equations && IsAsLong(last().fit.segment_s, longest)) {
    by.push_back("whole_runs");
  }
  return by;
}

Diagnosis Diagnose(const DiagnosisProblem& problem,
                   const Candidates& candidates,
                   const DiagnosisOptions& options) {
  std::string doing;
  const ReportDoing report = [&](const std::string& what, double error) {
    ThrowIfCancelled(problem.options.stop);
    doing = what;
    if (!problem.options.progress) return;
    problem.options.progress({what, 0, 0, error});
  };
  EffectSearch search(problem, candidates, report);
  if (options.look != nullptr) search.UseLook(*options.look);
  Answer answer;
  bool interrupted = false;
  try {
    answer = search.Run();
  } catch (const Cancelled&) {
    if (!options.keep_evaluated || !search.HasBase()) throw;
    interrupted = true;
    answer = search.SoFar();
    answer.explains = ExplainsSoFar(problem, answer, options.judges_until);
  }
  Diagnosis diagnosis =
      Writer(problem, candidates, answer).Write(options.add, interrupted);
  if (!interrupted && MayLackALaw(diagnosis, answer)) {
    try {
      const EvaluatedModel& found = answer.found->model;
      report("looking for a formula", found.train_error());
      std::vector<FormulaProposal> formulas = ProposeFormulas(
          problem, found, JointsThatMissForce(diagnosis.where, found),
          static_cast<int>(candidates.size()), report);
      if (!formulas.empty() && !formulas.front().replaces.empty()) {
        diagnosis.verdict = Verdict::kUnexplained;
      }
      if (diagnosis.verdict == Verdict::kUnexplained) {
        diagnosis.proposals = std::move(formulas);
      }
    } catch (const Cancelled&) {
      if (!options.keep_evaluated) throw;
      interrupted = true;
    }
  }
  if (interrupted) diagnosis.interrupted = doing;
  return diagnosis;
}

}  // namespace sysid
