#include "models/error.h"
#include "sysid/report/page_parts.h"

namespace sysid {
namespace {

// What was searched has no derivative to say its uncertainty from.
Json ExpectedJson(const ExpectedParameter& p) {
  return {{"name", p.name},
          {"unit", p.unit},
          {"value", Finite(p.value)},
          {"stdError", p.searched ? Json(nullptr) : Finite(p.std_error)},
          {"detectable", p.searched ? Json(nullptr) : Finite(p.detectable)}};
}

Json Confirmed(const Confirmation& confirmed) {
  const auto estimate = [](const ParameterEstimate& p) -> Json {
    return {{"name", p.name}, {"unit", p.unit}, {"value", Finite(p.value)}};
  };
  return {{"segment_s", Finite(confirmed.segment_s)},
          {"train", Finite(confirmed.train)},
          {"holdout", Finite(confirmed.holdout)},
          {"crossValidation", CrossValidationJson(confirmed.cv)},
          {"togetherWith", confirmed.together_with},
          {"parameters", List(confirmed.parameters, estimate)}};
}

// Why a linearisation's prediction is none: a candidate that is added can only
// lower the error, so one that clearly raises it is predicted from too far
// away; and a fall that three digits do not show is none.
std::string WhyNoPrediction(const ScreenedEffect& screened, double error) {
  constexpr double kClose = 1.01, kSeen = 1 - 1e-3;
  if (screened.predicted_error < kSeen * error) return "";
  return screened.predicted_error < kClose * error
             ? "to first order it gains nothing"
             : "the model is too far from this data for a prediction";
}

// The effect, with those that were added with it.
std::string ToAdd(const CandidateEffect& candidate) {
  const std::string name = candidate.screened.name();
  if (!candidate.confirmed || candidate.confirmed->together_with.empty()) {
    return name;
  }
  return name + "," + Join(candidate.confirmed->together_with, ",");
}

}  // namespace

std::string ChangeTitle(const DiagnosisStep& step) {
  constexpr size_t kMost = 3;  // more do not fit
  std::string title;
  if (!step.removed.empty()) title = "- " + step.removed;
  if (step.effects.size() > kMost) {
    return title + (title.empty() ? "+ " : " + ") +
           std::to_string(step.effects.size()) + " effects";
  }
  for (const std::string& name : step.effects) {
    title += (title.empty() ? "+ " : " + ") + name;
  }
  return title;
}

Json CandidatesJson(const PageSource& source, const Diagnosis& diagnosis) {
  const auto shown = [&](const CandidateEffect& candidate) -> Json {
    const ScreenedEffect& screened = candidate.screened;
    const Confirmation* confirmed =
        candidate.confirmed ? &*candidate.confirmed : nullptr;
    const std::string why =
        WhyNoPrediction(screened, diagnosis.base.train_error());
    return {
        {"effect", screened.effect->kind()},
        {"target", screened.effect->target()},
        {"law", screened.effect->Law()},
        {"score", Finite(screened.score)},
        {"dof", screened.dof},
        {"pValue", Finite(screened.p_value)},
        {"predictedError",
         why.empty() ? Finite(screened.predicted_error) : Json(nullptr)},
        {"noPrediction", why},
        {"expected", List(screened.parameters, ExpectedJson)},
        {"confirmed", confirmed ? Confirmed(*confirmed) : Json(nullptr)},
        {"accepted", confirmed != nullptr && confirmed->accepted},
        {"refused", confirmed ? confirmed->refused : ""},
        {"indistinguishableFrom", candidate.indistinguishable_from},
        {"separatedBy", candidate.told_apart_by},
        {"force", List(candidate.force, Series)},
        {"command", source.fit_command(ToAdd(candidate),
                                       Join(screened.without_influence, ","))}};
  };
  return List(diagnosis.candidates, shown);
}

Json ForcesJson(const Where& where) {
  return List(where.force, [](const ForceCurve& curve) -> Json {
    return {{"joint", curve.joint},
            {"component", curve.component},
            {"unit", curve.unit},
            {"trajectory", curve.trajectory},
            {"t", TimeSeries(curve.t)},
            {"value", Series(curve.value)},
            {"std", Series(curve.std)},
            {"position", Series(curve.position)},
            {"velocity", Series(curve.velocity)},
            {"effort", Series(curve.effort)}};
  });
}

}  // namespace sysid
