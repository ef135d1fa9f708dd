#include <algorithm>
#include <cmath>

#include "sysid/report/diagnosis_report.h"
#include "sysid/report/findings.h"
#include "sysid/report/json.h"

namespace sysid {
namespace {

Json NameAndTarget(const std::string& name) {
  const size_t at = name.find('@');
  return {{"effect", name.substr(0, at)}, {"target", name.substr(at + 1)}};
}

Json Numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(Finite(value));
  return list;
}

Json Values(const std::vector<ParameterEstimate>& parameters) {
  Json object = Json::object();
  for (const ParameterEstimate& p : parameters)
    object[p.name] = Finite(p.value);
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
                         {"together_with", c.together_with},
                         {"accepted", c.accepted},
                         {"refused", c.refused}};
  }
  json["indistinguishable_from"] = candidate.indistinguishable_from;
  json["told_apart_by"] = candidate.told_apart_by;
  return json;
}

Json Force(const Where& where) {
  Json list = Json::array();
  for (const ForceCurve& curve : where.force) {
    list.push_back({{"joint", curve.joint},
                    {"component", curve.component},
                    {"unit", curve.unit},
                    {"trajectory", curve.trajectory},
                    {"t", Numbers(curve.t)},
                    {"value", Numbers(curve.value)},
                    {"std", Numbers(curve.std)}});
  }
  return list;
}

Json ToJson(const Where& where) {
  Json json;
  json["channels"] = ToJson(where.channels);
  json["segments"] = ToJson(where.segments);
  json["horizon"] = ToJson(where.horizon);
  json["bins"] = Json::array();
  for (const MotionBin& bin : where.bins) {
    json["bins"].push_back({{"joint", bin.joint},
                            {"over", bin.over},
                            {"unit", bin.unit},
                            {"from", Finite(bin.from)},
                            {"to", Finite(bin.to)},
                            {"samples", bin.samples},
                            {"normalized_rms", Finite(bin.normalized_rms)}});
  }
  json["whiteness"] = Json::array();
  for (const Whiteness& w : where.whiteness) {
    json["whiteness"].push_back({{"channel", w.channel},
                                 {"lag1", Finite(w.lag1)},
                                 {"correlation_samples", Finite(w.time)},
                                 {"lags", w.lags},
                                 {"lags_out", w.lags_out},
                                 {"p_value", Finite(w.p_value)}});
  }
  json["inputs"] = Json::array();
  for (const InputCorrelation& c : where.inputs) {
    json["inputs"].push_back({{"channel", c.channel},
                              {"input", c.input},
                              {"correlation", Finite(c.correlation)},
                              {"lag_s", Finite(c.lag_s)},
                              {"p_value", Finite(c.p_value)},
                              {"significant", c.significant}});
  }
  json["force"] = Force(where);
  json["joints"] = Json::array();
  for (const JointForce& j : where.joints) {
    json["joints"].push_back({{"joint", j.joint},
                              {"unit", j.unit},
                              {"rms", Finite(j.rms)},
                              {"std", Finite(j.std)},
                              {"p_value", Finite(j.p_value)},
                              {"significant", j.significant}});
  }
  json["regression"] = Json::array();
  for (const ForceRegression& r : where.regression) {
    json["regression"].push_back({{"joint", r.joint},
                                  {"regressor", r.regressor},
                                  {"label", r.label},
                                  {"r2", Finite(r.r2)},
                                  {"coefficients", Numbers(r.coefficients)}});
  }
  return json;
}

Json Before(const DiagnosisStep& step) {
  return {{"segment_s", Finite(step.segment_s)},
          {"predicted", Finite(step.predicted)},
          {"train_before", Finite(step.train_before)},
          {"train_after", Finite(step.train_after)},
          {"holdout_before", Finite(step.holdout_before)},
          {"holdout_after", Finite(step.holdout_after)}};
}

}  // namespace

std::string DiagnosisJson(const Session& session, const Diagnosis& diagnosis,
                          const FinalFit* final, const std::string& next) {
  Json json;
  json["schema"] = "sysid.diagnosis/1";
  json["model"] = session.model_name;
  json["noise"] = Finite(diagnosis.base.fit.noise);
  json["segment_s"] = Finite(diagnosis.base.fit.segment_s);
  json["verdict"] = ToString(diagnosis.verdict);
  json["sentence"] = DiagnosisSentence(diagnosis);
  json["interrupted"] = nullptr;
  if (!diagnosis.interrupted.empty()) {
    json["interrupted"] = diagnosis.interrupted;
  }
  json["doubts"] = diagnosis.doubts;
  json["baseline"] = {{"train", ToJson(diagnosis.base.fit.train.total)},
                      {"holdout", ToJson(diagnosis.base.holdout.total)},
                      {"parameters", Values(diagnosis.base.fit.parameters)},
                      {"effects", session.effects}};
  json["where"] = ToJson(diagnosis.where);
  json["tests"] = diagnosis.tests;
  json["candidates"] = Json::array();
  for (const CandidateEffect& candidate : diagnosis.candidates) {
    json["candidates"].push_back(Candidate(candidate));
  }
  json["added"] = Json::array();
  json["steps"] = Json::array();
  const std::vector<std::string> kept = diagnosis.added();
  for (const DiagnosisStep& step : diagnosis.steps) {
    Json entry = {{"added", step.effects}, {"removed", step.removed}};
    entry.update(Before(step));
    entry["parameters"] = Values(step.parameters);
    json["steps"].push_back(entry);
    for (size_t k = 0; k < step.effects.size(); ++k) {
      const std::string& name = step.effects[k];
      if (std::find(kept.begin(), kept.end(), name) == kept.end()) continue;
      Json added = NameAndTarget(name);
      added.update(Before(step));
      added["indistinguishable_from"] = step.indistinguishable_from[k];
      json["added"].push_back(added);
    }
  }
  json["final"] = nullptr;
  if (final != nullptr) {
    json["final"] = {{"verdict", ToString(diagnosis.final_verdict)},
                     {"train", ToJson(diagnosis.last().fit.train.total)},
                     {"holdout", ToJson(diagnosis.last().holdout.total)},
                     {"effects", final->session.effects},
                     {"denied", final->denied},
                     {"parameters", Values(final->fit.parameters)},
                     {"converged", final->fit.converged},
                     {"open", ToJson(final->fit.open, false)}};
  }
  json["next_command"] = next;
  json["findings"] = ToJson(session.findings);
  json["notices"] = session.notices;
  return Dump(json);
}

}  // namespace sysid
