#pragma once

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "sysid/diagnosis/candidate_list.h"
#include "sysid/diagnosis/evaluated_model.h"
#include "sysid/diagnosis/formula_proposal.h"
#include "sysid/diagnosis/model_comparison.h"
#include "sysid/diagnosis/stability.h"
#include "sysid/diagnosis/verdict.h"
#include "sysid/inverse_dynamics/equation_look.h"
#include "sysid/unexplained_force/where.h"

namespace sysid {

// Where a fitted model fails and which effects are missing: docs/judgement.md.

// One change of the model on the way to one that explains the data.
struct DiagnosisStep {
  std::vector<std::string> effects;  // added
  std::string removed;               // of the studio; or empty
  double segment_s = 0.0;            // over which the errors are
  double predicted = 0.0;            // normalised error of the training runs
  double train_before = 0.0, train_after = 0.0;
  double holdout_before = 0.0, holdout_after = 0.0;
  CrossValidation cv_before;                  // over those segments
  std::vector<ParameterEstimate> parameters;  // of the effects, after
  // For each of the effects: others that explain the data as well in its place.
  std::vector<std::vector<std::string>> indistinguishable_from;
  std::shared_ptr<const EvaluatedModel> after;  // the model that it led to
};

// One of several answers that predict as well.
struct RivalModel {
  std::vector<std::string> effects;  // that are added
  // What motion tells it from the first; "" of the first, and where they differ
  // in more than one effect.
  std::string told_apart_by;
  // The same force as the first in this data: its laws under other names.
  bool same_force = false;
  std::shared_ptr<const EvaluatedModel> model;
};

struct Diagnosis {
  Verdict verdict = Verdict::kAdequate;  // of the model as it was given
  // False where the model could not be fitted at all; the doubts say why.
  bool usable = true;
  // Why the fit is not to be trusted, first things first; empty where it is.
  std::vector<std::string> doubts;
  // What was being done when the search was stopped (keep_evaluated): what it
  // had judged by then stands, the verdict says nothing of the rest. Else
  // empty.
  std::string interrupted;
  // Who stopped it, or what was to follow. Out of time, what was judged by then
  // is the answer.
  StoppedBy stopped_by = StoppedBy::kNobody;
  EvaluatedModel base;
  Where where;                              // of the base
  std::vector<CandidateEffect> candidates;  // best first
  // What is to be added to the model as it was given: an effect, or two that
  // only together explain it; the first of the candidates. Empty: none.
  std::vector<std::string> proposed;
  int tests = 0;  // that the p-values corrected for
  // Whether the user chose the candidates: not all laws of the catalogue.
  bool narrowed = false;
  // Where others with no more parameters predict as well: the answer, and then
  // each other model within one standard error of it. Else empty. Undecided,
  // unless all are the same force as the answer.
  std::vector<RivalModel> rivals;
  // Of what is proposed, and of what of it is not constant where that varies
  // most: it stands in for another law (docs/judgement.md, section 6).
  std::vector<ParameterByStrata> stability, stand_ins;

  // Formulas for what no effect explains; of the search by sets, where its
  // answer is not at the noise.
  std::vector<FormulaProposal> proposals;

  // What was added (with `add`), and the model that came of it.
  std::vector<DiagnosisStep> steps;
  // Null where nothing was added.
  std::shared_ptr<const EvaluatedModel> final;
  // All over the segments of the last model; of an interrupted search the path
  // alone, each over its own.
  ModelComparison comparison;
  Verdict final_verdict = Verdict::kAdequate;
  // An arm: the answer is that of the equations of motion, with their values.
  bool by_equations = false;
  EquationLook look;  // what they show

  explicit Diagnosis(const Model& m) : base(m) {}
  const EvaluatedModel& last() const { return final ? *final : base; }
  std::vector<std::string> added() const;  // names
  // What shows the effects of the answer: "equations_of_motion", where those
  // show them all; "segments" that were not fitted, which the last model
  // predicts better than the model as given; "whole_runs", where those segments
  // are as long. Empty where nothing is missing, or nothing explains it.
  std::vector<std::string> ConfirmedBy() const;
};

struct DiagnosisOptions {
  bool add = false;  // add effects until nothing is missing
  // Where EstimationOptions::stop asks to end: what was judged so far instead
  // of Cancelled, once the model as given was.
  bool keep_evaluated = false;
  // Then asks to end the verdict on that, too. Not set: there is none, and what
  // is above the noise is unexplained.
  std::stop_token judges_until = {};
  // What the equations of motion show, where that is known (LookAtEquations).
  std::shared_ptr<const EquationLook> look = nullptr;
};

// Throws InputError where the runs are too short or too still to decide
// anything; says in `doubts` where the fit is not to be trusted.
Diagnosis Diagnose(const DiagnosisProblem& problem,
                   const std::vector<std::shared_ptr<const Effect>>& candidates,
                   const DiagnosisOptions& options);

}  // namespace sysid
