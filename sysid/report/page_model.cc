#include <algorithm>
#include <cmath>

#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/horizon.h"
#include "sysid/io/cell.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/fit_report.h"
#include "sysid/report/page_data.h"
#include "sysid/report/page_parts.h"

namespace sysid {
namespace {

// The effect that brought a parameter into the fit; null: it was free without.
Json OwnerOf(const std::string& parameter, const PageSource& source,
             const Model& model) {
  const bool given =
      std::any_of(source.session->free.begin(), source.session->free.end(),
                  [&](const FreeParameter& free) {
                    return free.parameter.name == parameter;
                  });
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    if (Contains(effect.ParameterNames(), parameter) ||
        (!given && Contains(effect.adjusts_nominal(), parameter))) {
      return effect.name();
    }
  }
  return nullptr;
}

// The errors against the horizon beside those that noise alone would make. A
// evaluated's fit has none of its own: they are evaluated here.
Json HorizonJson(const PageSource& source, const PageFit& fit,
                 const Diagnosis* diagnosis) {
  std::vector<HorizonError> horizon =
      diagnosis ? diagnosis->where.horizon : fit.fit->horizon;
  std::vector<HorizonError> noise;
  try {
    if (horizon.empty()) {
      horizon = EvaluateHorizon(*fit.problem, fit.fit->point);
    }
    if (!horizon.empty()) {
      noise = EstimateNoiseHorizon(*fit.problem, fit.fit->point);
    }
  } catch (const Cancelled&) {
    // Of a program that is interrupted the report has what there was.
    if (source.live) throw;
  }
  Json list = horizon;
  for (Json& entry : list) {
    entry["noise_rms"] = nullptr;
    for (const HorizonError& h : noise) {
      if (entry["horizon_s"] == h.horizon_s) entry["noise_rms"] = Finite(h.rms);
    }
  }
  return list;
}

Json ParametersJson(const PageSource& source, const PageFit& fit) {
  const auto shown = [&](const ParameterEstimate& p) -> Json {
    return {{"name", p.name},
            {"unit", p.unit},
            {"initial", Finite(p.initial)},
            {"value", Finite(p.value)},
            {"stdError", Finite(p.std_error)},
            {"ci95", {Finite(p.ci95[0]), Finite(p.ci95[1])}},
            {"lower", Finite(p.lower)},
            {"upper", Finite(p.upper)},
            {"atBound", p.at_bound},
            {"identifiable", p.identifiable},
            {"ofEffect", OwnerOf(p.name, source, fit.fit->model)}};
  };
  return List(ReportedParameters(*fit.session, *fit.fit), shown);
}

// Of those that the data determines: their places in the covariance.
std::vector<int> Determined(const Fit& fit) {
  std::vector<int> places;
  const int known = static_cast<int>(fit.covariance.rows());
  for (int i = 0; i < static_cast<int>(fit.parameters.size()); ++i) {
    if (i < known && fit.parameters[i].identifiable) places.push_back(i);
  }
  return places;
}

// One prediction over each whole run, fitted and held out.
Json OpenErrorsJson(const Fit& fit, const Holdout* holdout) {
  Json list = OpenJson(fit.open, false);
  if (holdout != nullptr) {
    for (const Json& open : OpenJson(holdout->open, true)) list.push_back(open);
  }
  return list;
}

Json FilesJson(const PageSource& source, const PageFit& fit) {
  // A table that is larger would be most of the page; it lies beside it.
  constexpr size_t kLargest = 512 << 10;
  Json list = Json::array();
  for (const ModelFile& file : ModelFiles()) {
    const bool is_table = file.name == "prediction.csv";
    Json text = nullptr;
    if (!source.live && (!is_table || fit.with_prediction_csv)) {
      text = ModelFileText(fit, file.name);
      if (is_table && text.get_ref<const std::string&>().size() > kLargest) {
        text = nullptr;
      }
    }
    list.push_back({{"name", file.name}, {"type", file.type}, {"text", text}});
  }
  return list;
}

}  // namespace

std::vector<ModelFile> ModelFiles() {
  return {{"fit.json", "application/json"},
          {"prediction.csv", "text/csv"},
          {"identified.urdf", "application/xml"},
          {"identified.sysid.yaml", "application/yaml"}};
}

std::string ModelFileText(const PageFit& fit, const std::string& name) {
  if (name == "fit.json") {
    return FitJson(*fit.session, *fit.problem, *fit.fit, fit.holdout, fit.added,
                   fit.mixture);
  }
  if (name == "prediction.csv") {
    return PredictionCsv(*fit.problem, *fit.fit, fit.holdout);
  }
  if (name == "identified.urdf") return IdentifiedUrdf(*fit.session, *fit.fit);
  if (name == "identified.sysid.yaml") {
    return IdentifiedSpecification(*fit.session, *fit.fit);
  }
  return "";
}

Json PageWholeRuns(const FinalFit& final) {
  const Fit& fit = final.fit;
  const Holdout* holdout = final.holdout ? &*final.holdout : nullptr;
  const auto estimate = [](const ParameterEstimate& p) -> Json {
    return {{"name", p.name},
            {"unit", p.unit},
            {"value", Finite(p.value)},
            {"ci95", {Finite(p.ci95[0]), Finite(p.ci95[1])}}};
  };
  return {
      {"sentence", FitSentence(*final.problem, fit, holdout)},
      {"good", ReachesNoise(*final.problem, fit)},
      {"trainError", Finite(fit.train.total.normalized_rms)},
      {"holdoutError",
       holdout ? Finite(holdout->errors.total.normalized_rms) : Json(nullptr)},
      {"open", OpenErrorsJson(fit, holdout)},
      {"parameters", List(ReportedParameters(final.session, fit), estimate)}};
}

Json PageModel(const PageSource& source, const PageFit& fit,
               const Diagnosis* diagnosis) {
  const Fit& found = *fit.fit;
  const std::vector<int> determined = Determined(found);
  const ModelEfforts efforts = CompareModelEfforts(fit);
  Json model;
  model["id"] = fit.id;
  model["title"] = fit.title;
  std::vector<std::string> beyond = fit.session->effects;
  std::erase_if(beyond, [&](const std::string& name) {
    return Contains(source.session->effects, name);
  });
  model["effects"] = beyond;
  model["converged"] = found.converged;
  model["termination"] = found.termination;
  model["trainError"] = Finite(found.train.total.normalized_rms);
  model["holdoutError"] = fit.holdout
                              ? Finite(fit.holdout->errors.total.normalized_rms)
                              : Json(nullptr);
  model["trainFitPercent"] = Finite(found.train.total.fit_percent);
  model["holdoutFitPercent"] =
      fit.holdout ? Finite(fit.holdout->errors.total.fit_percent)
                  : Json(nullptr);
  model["verdict"] =
      diagnosis ? Json(ToString(diagnosis->verdict)) : Json(nullptr);
  model["sentence"] = diagnosis ? DiagnosisSentence(*diagnosis)
                                : FitSentence(*fit.problem, found, fit.holdout);
  model["doubts"] = diagnosis ? diagnosis->doubts : std::vector<std::string>();
  model["segment_s"] = Finite(found.segment_s);
  model["joined"] = std::isfinite(found.defect);
  model["wholeRuns"] = nullptr;
  model["open"] = OpenErrorsJson(found, fit.holdout);
  model["crossValidation"] =
      fit.cv ? CrossValidationJson(*fit.cv) : Json(nullptr);
  model["rivals"] = diagnosis ? RivalsJson(*diagnosis) : Json::array();
  model["stability"] =
      diagnosis ? StabilityJson(diagnosis->stability) : Json::array();
  model["standIns"] =
      diagnosis ? StandInsJson(diagnosis->stand_ins) : Json::array();
  model["proposals"] =
      diagnosis ? ProposalsJson(source, *diagnosis) : Json::array();
  model["nextExperiment"] = nullptr;
  if (diagnosis != nullptr && !source.experiment_words.empty()) {
    model["nextExperiment"] = {{"words", source.experiment_words},
                               {"command", source.experiment}};
  }
  model["predictions"] = PredictionsJson(source, fit, efforts);
  model["efforts"] = EffortErrorsJson(efforts.fitted);
  model["holdoutEfforts"] = EffortErrorsJson(efforts.held_out);
  model["discrepancy"] = found.discrepancy;
  model["channels"] = found.train.channels;
  model["segments"] = found.train.segments;
  model["horizon"] = HorizonJson(source, fit, diagnosis);
  model["residuals"] = ResidualsJson(source, fit);
  model["parameters"] = ParametersJson(source, fit);
  model["correlation"] = Correlation(found.covariance(determined, determined));
  model["correlationNames"] =
      List(determined, [&](int i) { return found.parameters[i].name; });
  model["notIdentifiable"] = found.not_identifiable;
  model["histories"] = {{{"solver", found.solver}, {"points", found.history}}};
  model["candidates"] =
      diagnosis ? CandidatesJson(source, *diagnosis) : Json::array();
  model["force"] = diagnosis ? ForcesJson(diagnosis->where) : Json::array();
  model["files"] = FilesJson(source, fit);
  model["nextCommand"] = fit.next_command;
  return model;
}

}  // namespace sysid
