#include <cmath>

#include "models/error.h"
#include "sysid/report/page_parts.h"

namespace sysid {

Json CrossValidationJson(const CrossValidation& cv) {
  if (!std::isfinite(cv.error())) return nullptr;
  const auto stretch = [](const CrossValidation::Stretch& one) -> Json {
    return {{"trajectory", one.trajectory},
            {"t_start", Finite(one.t_start)},
            {"t_end", Finite(one.t_end)},
            {"error", Finite(one.error())}};
  };
  return {{"error", Finite(cv.error())},
          {"stdError", Finite(cv.std_error())},
          {"stretches", List(cv.stretches, stretch)}};
}

Json LeftOutJson(const ModelComparison& comparison) {
  if (comparison.path.empty() || comparison.left_out.empty()) return nullptr;
  const ModelErrors& final = comparison.path.back();
  const auto without = [](const ModelErrors& model) -> Json {
    return {{"effect", model.change},
            {"crossValidation", CrossValidationJson(model.cv)}};
  };
  return {{"effects", final.effects},
          {"with", CrossValidationJson(final.cv)},
          {"without", List(comparison.left_out, without)}};
}

Json RivalsJson(const Diagnosis& diagnosis) {
  return List(diagnosis.rivals, [](const RivalModel& rival) -> Json {
    return {{"effects", rival.effects},
            {"separatedBy", rival.told_apart_by},
            {"sameForce", rival.same_force},
            {"crossValidation", CrossValidationJson(rival.model->cv)},
            {"holdoutError", Finite(rival.model->holdout_error())}};
  });
}

Json ProposalsJson(const PageSource& source, const Diagnosis& diagnosis) {
  const auto estimate = [](const ParameterEstimate& p) -> Json {
    return {{"name", p.name},
            {"unit", p.unit},
            {"value", Finite(p.value)},
            {"stdError", Finite(p.std_error)}};
  };
  return List(diagnosis.proposals, [&](const FormulaProposal& one) -> Json {
    return {{"effects", one.effects()},
            {"parameters", List(one.parameters, estimate)},
            {"crossValidatedError", Finite(one.cv_error)},
            {"holdoutError", Finite(one.holdout)},
            {"segment_s", Finite(one.segment_s)},
            {"command", source.fit_command(Join(one.effects(), ","), "")}};
  });
}

Json StabilityJson(const std::vector<ParameterByStrata>& all) {
  return List(all, [](const ParameterByStrata& one) -> Json {
    return {{"effect", one.effect},
            {"parameter", one.parameter},
            {"unit", one.unit},
            {"joint", one.joint},
            {"strata", NameOf(one.strata)},
            {"estimates", List(one.estimates,
                               [](const StratumEstimate& at) -> Json {
                                 return {{"from", Finite(at.from)},
                                         {"to", Finite(at.to)},
                                         {"value", Finite(at.value)},
                                         {"std_error", Finite(at.std_error)}};
                               })},
            {"spread", Finite(one.spread)},
            {"least_spread", Finite(one.least_spread)},
            {"trend", NameOf(one.trend)},
            {"constant", one.IsConstant()}};
  });
}

Json StandInsJson(const std::vector<ParameterByStrata>& stand_ins) {
  return List(stand_ins, [](const ParameterByStrata& one) -> Json {
    return {{"effect", one.effect},
            {"parameter", one.parameter},
            {"strata", NameOf(one.strata)},
            {"spread", Finite(one.spread)},
            {"trend", NameOf(one.trend)}};
  });
}

}  // namespace sysid
