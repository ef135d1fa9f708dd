#pragma once

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sysid/diagnosis/candidate_refits.h"
#include "sysid/diagnosis/diagnose.h"
#include "sysid/diagnosis/longer_segments.h"
#include "sysid/diagnosis/screening.h"

namespace sysid {

// The search for what is missing. To the model as given it adds what the
// equations of motion show, or what the best refit of the screening's proposals
// finds, one step at a time; after each it looks whether what was added before
// is still needed, and at the end whether chance may have made it up.
class Search {
 public:
  // What it is made from must outlive it.
  Search(const DiagnosisProblem& problem, const Candidates& candidates,
         const DiagnosisOptions& options)
      : problem_(problem),
        candidates_(candidates),
        options_(options),
        refits_(problem, candidates),
        diagnosis_(problem.model) {}

  Diagnosis Run();

 private:
  // What may be added next: every refit, and which of them is the best (-1:
  // none helps), with the screening that proposed them.
  struct Found {
    Screening screening;
    std::vector<CandidateRefit> refits;
    int best = -1;

    CandidateRefit* get() { return best >= 0 ? &refits[best] : nullptr; }
  };

  void Report(const std::string& doing, double error);
  ReportDoing Reporting();
  // The model so far: as given, in longer segments, or with what was added.
  EvaluatedModel& now() { return model_ ? *model_ : diagnosis_.base; }

  // In add_together.cc.
  // Takes together what the equations of motion show, where that is more than a
  // search adds one by one, which would judge each while the others are still
  // missing; no fit would follow the motion of a model that misses so much.
  // Segments judge fewer better than differentiated positions do: false, and
  // there is no base yet.
  bool BeginByEquations();
  void RunFromBase();
  // Adds the drives of joints that are commanded and whose efforts nobody
  // recorded, together: without them such a machine would not move at all, and
  // whatever else moves it would be taken for them.
  void AddDrives();
  // Adds the few effects that the equations of motion show where together they
  // explain most of the error: one by one each would be judged while the others
  // are missing, and a joint that rests may predict better than one that swings
  // too far.
  void AddTogether();
  // Lists what was kept of them first, and then all that the model as given
  // was screened for: a reader wants to see what else was looked at.
  void ListTogether();
  // Lists what stayed in the model first, in the order in which it was added,
  // with what could stand in its place, and refuses what was taken out again:
  // the ranks of the first look come of a model that may miss several effects.
  void ListWhatStayed();
  // Effects that were found together, and the model that has them, as a step.
  void Take(std::vector<ScreenedEffect> effects,
            std::shared_ptr<EvaluatedModel> model);

  void AddOneByOne();
  Found Find();
  void Note(Found* found, const std::vector<CandidateEffect>& listed);
  // Where nothing is found: the same model from whole runs, or in longer
  // segments. False where there is no more to see.
  bool LookFarther(bool* joined);
  void Add(CandidateRefit* chosen, const std::vector<CandidateEffect>& listed);
  void Conclude();
  // The models of the way and the neighbours of the last one beside each other.
  void CompareModels();
  void Keep();  // what a search that was stopped may still say

  // In look_back.cc.
  // Takes out the effects without which the model, fitted again, is not worse:
  // the newest was judged by the fit before it, which may have been stuck in a
  // local minimum. Of an effect that is needed, what a part of it does as well:
  // the whole may have been found while another effect was missing. True where
  // it took any.
  bool TakeOutUnneeded();
  bool TakeOutIfUnneeded(const std::string& name);
  bool TakePartOf(const Effect& whole);
  // A model with `part`, or nothing where that is null, in the place of `name`
  // becomes the model, by a step.
  void TakeSimpler(const std::string& name, const Effect* part,
                   EvaluatedModel simpler);
  // A model without one of its effects, fitted again; and whether that was
  // tried over a model's segments.
  EvaluatedModel Without(const std::string& name, const EvaluatedModel& model);
  bool WasTriedWithout(const std::string& name,
                       const EvaluatedModel& model) const;
  // Takes out what the newest effects made useless, or exchanges what another
  // candidate does better. True where it made another model. Nothing is
  // exchanged while there is something to add: over the first, short segments
  // effects look alike, and would take turns.
  bool LookBack(const std::vector<std::string>& newest, bool exchange);
  // True where the model without `name` took the place of the one with it, or
  // one with another effect instead.
  bool LookBackAt(const std::string& name, bool exchange);
  // What the look back took out of the effects that came together, before
  // anything else was done, was never a step: nor is its going.
  void FoldRemovals();
  // Judges once more, by the final model, what was as good as its effects on
  // the way there: two laws that are alike over short segments, or while others
  // are missing, may differ now; and the other way round. What is better takes
  // the place of the effect: true then, and the rest is to be asked again.
  bool AskAlternativesAgain();
  std::string Chance(const EvaluatedModel& evaluated);
  // Takes out, one after another, what may be no more than chance beside what
  // is still missing. The search itself adds it all the same: until all that is
  // missing is in the model, that is no random force. True where it took any.
  bool TakeOutChance();

  // In whole_runs.cc.
  // Not where the noise is reached, or segments of a length were asked for.
  bool AsksWholeRuns(const EvaluatedModel& evaluated) const;
  // The model fitted to all runs, one trajectory each; nothing where it does
  // not follow them. Several questions ask for the same fit: the last ones are
  // kept. `wanted` as FitWholeRuns has it.
  std::optional<Fit> FitToWholeRuns(
      const EvaluatedModel& evaluated,
      double wanted = std::numeric_limits<double>::infinity());
  // Its error; infinite where there is none.
  double WholeRunsError(
      const EvaluatedModel& evaluated,
      double wanted = std::numeric_limits<double>::infinity());
  // Of the held-out runs, or ends of runs, one trajectory each, by the model
  // fitted to the others alike; infinite alike.
  double HeldOutWholeRunsError(const EvaluatedModel& evaluated);
  // Whether the model with another effect is the better one. Where segments do
  // not decide between as many parameters, whole runs do.
  bool TakesThePlaceOf(const EvaluatedModel& other, const EvaluatedModel& with);
  // What predicts as well as an effect in its place, or better, fitted again.
  struct Instead {
    ScreenedEffect effect;
    EvaluatedModel model;
    double error = 0.0;   // of whole runs, or of the model's segments
    bool better = false;  // clearly
    // The effect's, of whole runs where those were asked.
    double whole_before = std::numeric_limits<double>::quiet_NaN();
  };
  static std::vector<std::string> NamesOf(const std::vector<Instead>& instead);
  // Which of `others`, and of what is alike where that is asked, predict as
  // well in the place of `name`: whole runs where those can be followed, else
  // the model's segments.
  std::vector<Instead> AsGoodInstead(const EvaluatedModel& model,
                                     const std::string& name,
                                     std::vector<std::string> others,
                                     bool alike);
  // Puts the best of them, of no more parameters, in the place of `name` if it
  // is better, and not worse over segments. True where it did: the error is
  // then lower by what matters.
  bool Exchange(const std::string& name, std::vector<Instead> instead);
  // Adds what whole runs miss, and held-out ones too, to a model that segments
  // call complete. True where it did.
  bool AddOverWholeRuns();

  Screening Screen(const EvaluatedModel& evaluated);
  bool WasHere(const EvaluatedModel& evaluated) const;

  const DiagnosisProblem& problem_;
  const Candidates& candidates_;
  const DiagnosisOptions& options_;
  const Refitter refits_;
  Diagnosis diagnosis_;
  // The base in longer segments, or with what was added; null: the base.
  std::shared_ptr<EvaluatedModel> model_;
  // Every model that the search has come from, by its effects: what led on from
  // there is no reason to go back, or it would go round.
  std::set<std::set<std::string>> been_;
  // Models that an exchange left: of two minima each would leave the other.
  std::set<std::set<std::string>> exchanged_;
  // What the equations of motion showed, and looked back at: by name.
  std::set<std::string> settled_;
  std::vector<FollowedMotion> followed_;
  bool by_equations_ = false;          // whether their values stay
  std::vector<ScreenedEffect> shown_;  // by them, where those are few
  std::vector<ModelErrors> tried_;     // every refit
  struct WholeFit {
    std::set<std::string> effects;
    Eigen::VectorXd theta;  // of the fit over segments
    double wanted;
    std::optional<Fit> fit;
  };
  std::vector<WholeFit> whole_fits_;  // the newest last
  // What explains the same as an effect that was found, by its name.
  std::map<std::string, std::vector<std::string>> explain_the_same_;
  bool exchange_due_ = false;  // since an effect was added
  std::string doing_;          // as Report() heard last
};

// The names of what was added.
std::set<std::string> EffectsOf(const EvaluatedModel& evaluated);
// A step from a model, and its end at another.
DiagnosisStep StepFrom(const EvaluatedModel& before);
void EndAt(std::shared_ptr<const EvaluatedModel> after, DiagnosisStep* step);

}  // namespace sysid
