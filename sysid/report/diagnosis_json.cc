#include "sysid/io/cell.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/findings.h"
#include "sysid/report/json.h"
#include "sysid/report/page_parts.h"

namespace sysid {

SYSID_JSON(ForceCurve, joint, component, unit, trajectory, t, value, std)
SYSID_JSON(MotionBin, joint, over, unit, from, to, samples, normalized_rms)
SYSID_JSON(InputCorrelation, channel, input, correlation, lag_s, p_value,
           significant, over_lags)
SYSID_JSON(JointForce, joint, unit, rms, std, p_value, significant)
SYSID_JSON(FollowedMotion, joint, of, share)
SYSID_JSON(ForceRegression, joint, regressor, label, r2, coefficients)

inline void to_json(Json& json, const Whiteness& white) {
  json = {{"channel", white.channel},
          {"lag1", Finite(white.lag1)},
          {"correlation_samples", Finite(white.time)},
          {"lags", white.lags},
          {"lags_out", white.lags_out},
          {"p_value", Finite(white.p_value)},
          {"autocorrelation", white.autocorrelation}};
}

SYSID_JSON(RejectedEffort, joint, explained)

SYSID_JSON(Where, channels, segments, horizon, bins, whiteness, inputs, force,
           joints, regression, followed, rejected_efforts)

namespace {

Json NameAndTarget(const std::string& name) {
  const size_t at = name.find('@');
  return {{"effect", name.substr(0, at)}, {"target", name.substr(at + 1)}};
}

Json Values(const std::vector<ParameterEstimate>& parameters) {
  Json object = Json::object();
  for (const ParameterEstimate& p : parameters) {
    object[p.name] = Finite(p.value);
  }
  return object;
}

Json Candidate(const CandidateEffect& candidate) {
  const ScreenedEffect& screened = candidate.screened;
  Json json = NameAndTarget(screened.name());
  json["score"] = Finite(screened.score);
  json["dof"] = screened.dof;
  json["p_value"] = Finite(screened.p_value);
  json["predicted_error"] = Finite(screened.predicted_error);
  Json expected = Json::object(), errors = Json::object(),
       detectable = Json::object();
  for (const ExpectedParameter& p : screened.parameters) {
    expected[p.name] = Finite(p.value);
    if (p.searched) continue;
    errors[p.name] = Finite(p.std_error);
    detectable[p.name] = Finite(p.detectable);
  }
  json["expected_parameters"] = expected;
  json["expected_std_errors"] = errors;
  json["detectable"] = detectable;
  json["not_told"] = screened.without_influence;
  json["confirmed"] = nullptr;
  if (candidate.confirmed) {
    const Confirmation& c = *candidate.confirmed;
    json["confirmed"] = {{"train", Finite(c.train)},
                         {"holdout", Finite(c.holdout)},
                         {"parameters", Values(c.parameters)},
                         {"segment_s", Finite(c.segment_s)},
                         {"together_with", Join(c.together_with, ",")},
                         {"accepted", c.accepted},
                         {"refused", c.refused}};
  }
  json["indistinguishable_from"] = candidate.indistinguishable_from;
  json["told_apart_by"] = candidate.told_apart_by;
  return json;
}

// The errors before and after.
Json Errors(const DiagnosisStep& step) {
  return {{"segment_s", Finite(step.segment_s)},
          {"predicted", Finite(step.predicted)},
          {"train_before", Finite(step.train_before)},
          {"train_after", Finite(step.train_after)},
          {"holdout_before", Finite(step.holdout_before)},
          {"holdout_after", Finite(step.holdout_after)}};
}

std::vector<std::string> Extended(std::vector<std::string> given,
                                  const std::vector<std::string>& added) {
  given.insert(given.end(), added.begin(), added.end());
  return given;
}

// A model of the search: its error where it was not fitted decides.
Json ModelEntry(const ModelErrors& model,
                const std::vector<std::string>& given) {
  return {{"effects", Extended(given, model.effects)},
          {"segment_s", Finite(model.segment_s)},
          {"cv_error", Finite(model.cv.error())},
          {"cv_error_se", Finite(model.cv.std_error())},
          {"train", Finite(model.train.normalized_rms)},
          {"holdout", Finite(model.holdout.normalized_rms)}};
}

Json Proposal(const FormulaProposal& proposal) {
  return {{"custom", Join(proposal.laws, ",")},
          {"with", proposal.beside},
          {"parameters", Values(proposal.parameters)},
          {"segment_s", Finite(proposal.segment_s)},
          {"cv_error", Finite(proposal.cv_error)},
          {"holdout", Finite(proposal.holdout)}};
}

}  // namespace

std::string DiagnosisJson(const Session& session, const Diagnosis& diagnosis,
                          const FinalFit* final, const NextCommands& next) {
  Json json;
  json["schema"] = "sysid.diagnosis/1";
  json["model"] = session.model_name;
  json["noise"] = Finite(diagnosis.base.fit.noise);
  json["segment_s"] = Finite(diagnosis.base.fit.segment_s);
  json["verdict"] = ToString(diagnosis.verdict);
  json["sentence"] = DiagnosisSentence(diagnosis);
  json["stopped"] = StoppedJson(diagnosis.stopped_by);
  json["interrupted"] = nullptr;
  if (!diagnosis.interrupted.empty()) {
    json["interrupted"] = diagnosis.interrupted;
  }
  json["doubts"] = diagnosis.doubts;
  json["baseline"] = {{"train", diagnosis.base.fit.train.total},
                      {"holdout", diagnosis.base.holdout.total},
                      {"effort", diagnosis.base.fit.effort},
                      {"parameters", Values(diagnosis.base.fit.parameters)},
                      {"effects", session.effects}};
  json["where"] = diagnosis.where;
  json["tests"] = diagnosis.tests;
  json["candidates"] = List(diagnosis.candidates, Candidate);
  json["proposals"] = List(diagnosis.proposals, Proposal);
  json["added"] = Json::array();
  json["steps"] = Json::array();
  const std::vector<std::string> kept = diagnosis.added();
  // What was taken out and added again was added by the last step that did.
  const auto added_last_by = [&](const std::string& name) {
    const DiagnosisStep* last = nullptr;
    for (const DiagnosisStep& step : diagnosis.steps) {
      if (Contains(step.effects, name)) last = &step;
    }
    return last;
  };
  for (const DiagnosisStep& step : diagnosis.steps) {
    Json entry = {{"added", step.effects}, {"removed", step.removed}};
    entry.update(Errors(step));
    entry["parameters"] = Values(step.parameters);
    json["steps"].push_back(entry);
    for (size_t k = 0; k < step.effects.size(); ++k) {
      const std::string& name = step.effects[k];
      if (!Contains(kept, name) || added_last_by(name) != &step) continue;
      Json added = NameAndTarget(name);
      added.update(Errors(step));
      added["indistinguishable_from"] = step.indistinguishable_from[k];
      json["added"].push_back(added);
    }
  }
  const auto entries = [&](const std::vector<ModelErrors>& models) {
    return List(models, [&](const ModelErrors& model) {
      Json entry = ModelEntry(model, session.effects);
      if (!model.change.empty()) entry["effect"] = model.change;
      return entry;
    });
  };
  json["models"] = entries(diagnosis.comparison.path);
  json["left_out"] = entries(diagnosis.comparison.left_out);
  json["one_more"] = entries(diagnosis.comparison.added);
  const auto evaluated = [&](const std::vector<std::string>& added,
                             const EvaluatedModel& model) {
    return Json{{"effects", Extended(session.effects, added)},
                {"cv_error", Finite(model.cv.error())},
                {"cv_error_se", Finite(model.cv.std_error())},
                {"train", Finite(model.train_error())},
                {"holdout", Finite(model.holdout_error())}};
  };
  json["rivals"] = List(diagnosis.rivals, [&](const RivalModel& rival) {
    Json entry = evaluated(rival.effects, *rival.model);
    entry["told_apart_by"] = rival.told_apart_by;
    entry["same_force"] = rival.same_force;
    return entry;
  });
  json["final"] = evaluated(diagnosis.added(), diagnosis.last());
  json["stability"] = StabilityJson(diagnosis.stability);
  json["stand_ins"] = StandInsJson(diagnosis.stand_ins);
  json["next_experiment"] =
      next.experiment.empty() ? Json(nullptr) : Json(next.experiment);
  json["final_fit"] = nullptr;
  if (final != nullptr) {
    json["final_fit"] = {{"verdict", ToString(diagnosis.final_verdict)},
                         {"train", diagnosis.last().fit.train.total},
                         {"holdout", diagnosis.last().holdout.total},
                         {"effort", final->fit.effort},
                         {"effects", final->session.effects},
                         {"parameters", Values(final->fit.parameters)},
                         {"converged", final->fit.converged},
                         {"open", OpenJson(final->fit.open, false)}};
  }
  json["next_command"] = next.fit;
  json["confirmed_by"] = diagnosis.ConfirmedBy();
  json["measurement"] = List(session.undone, [](const UndoneFault& fault) {
    return Json{
        {"hypothesis", fault.hypothesis},
        {"where", fault.where},
        {"columns", fault.flag == "columns" ? Json(fault.text) : Json(nullptr)},
        {"flag", fault.text},
        {"gain", fault.gain}};
  });
  json["findings"] = session.findings;
  json["skipped_runs"] = session.skipped_runs;
  json["notices"] = session.notices;
  return Dump(json);
}

std::string DiagnosisJson(const DiagnoseResult& result,
                          const NextCommands& next) {
  return DiagnosisJson(result.session, result.diagnosis,
                       result.final ? &*result.final : nullptr, next);
}

}  // namespace sysid
