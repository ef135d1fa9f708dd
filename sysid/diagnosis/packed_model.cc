#include "sysid/diagnosis/packed_model.h"

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "sysid/estimation/solution_json.h"

namespace nlohmann {

template <>
struct adl_serializer<Eigen::MatrixXd> {
  static void to_json(json& out, const Eigen::MatrixXd& matrix) {
    out = {matrix.rows(), matrix.cols(),
           std::vector<double>(matrix.data(), matrix.data() + matrix.size())};
  }
  static void from_json(const json& in, Eigen::MatrixXd& matrix) {
    const auto values = in.at(2).get<std::vector<double>>();
    matrix =
        Eigen::Map<const Eigen::MatrixXd>(values.data(), in.at(0), in.at(1));
  }
};

}  // namespace nlohmann

namespace sysid {

// The fields that a model of a search has.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ErrorSummary, rms, normalized_rms,
                                   fit_percent)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ChannelError, name, unit, position_like, rms,
                                   normalized_rms, noise, fit_percent, dof)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SegmentError, trajectory, t_start, t_end,
                                   normalized_rms, squares, dof)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunErrors, total, squares, dof, channels,
                                   segments)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CrossValidation::Stretch, squares, dof,
                                   trajectory, t_start, t_end)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CrossValidation, stretches)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ParameterEstimate, name, unit, initial,
                                   value, lower, upper, std_error, ci95,
                                   at_bound, identifiable)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Estimates, parameters, not_identifiable,
                                   covariance, theta_covariance, undetermined)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ExpectedParameter, name, unit, value,
                                   null_value, searched, std_error, detectable)

namespace {

using Json = nlohmann::json;

std::string Bytes(const Json& json) {
  std::string bytes;
  Json::to_cbor(json, bytes);
  return bytes;
}

std::shared_ptr<const Effect> Named(const std::string& name,
                                    const Candidates& candidates) {
  for (const auto& effect : candidates) {
    if (effect->name() == name) return effect;
  }
  throw std::out_of_range("effect " + name);
}

Json ToJson(const Fit& fit) {
  return {{"estimates", static_cast<const Estimates&>(fit)},
          {"converged", fit.converged},
          {"termination", fit.termination},
          {"iterations", fit.iterations},
          {"evaluations", fit.evaluations},
          {"step", fit.step_s},
          {"segment", fit.segment_s},
          {"defect", fit.defect},
          {"samples", fit.samples},
          {"noise", fit.noise},
          {"train", fit.train},
          {"misfit", fit.misfit},
          {"point", sysid::ToJson(fit.point)}};
}

void FromJson(const Json& json, const ShootingProblem& problem, Fit* fit) {
  json.at("estimates").get_to(static_cast<Estimates&>(*fit));
  json.at("converged").get_to(fit->converged);
  json.at("termination").get_to(fit->termination);
  json.at("iterations").get_to(fit->iterations);
  json.at("evaluations").get_to(fit->evaluations);
  json.at("step").get_to(fit->step_s);
  json.at("segment").get_to(fit->segment_s);
  json.at("defect").get_to(fit->defect);
  json.at("samples").get_to(fit->samples);
  json.at("noise").get_to(fit->noise);
  json.at("train").get_to(fit->train);
  json.at("misfit").get_to(fit->misfit);
  fit->point = SolutionFrom(json.at("point"), problem.options().rollout);
  MechanismParameters<double> values;
  problem.map().Apply<double>(fit->point.theta.data(), &values);
  fit->model.SetNominal(values);
}

}  // namespace

std::string Pack(const EvaluatedModel& model) {
  const EstimationOptions& options = model.problem->options();
  Json json = {{"without_influence", model.without_influence},
               {"start", StartingValues(model)},
               {"step_error", options.step_error},
               {"given_segment", options.segment},
               {"fit", ToJson(model.fit)},
               {"holdout", model.holdout},
               {"holdout_point", sysid::ToJson(model.holdout_point)},
               {"cv", model.cv}};
  for (const auto& effect : model.added) {
    json["added"].push_back(effect->name());
  }
  return Bytes(json);
}

EvaluatedModel UnpackModel(const std::string& bytes,
                           const DiagnosisProblem& problem,
                           const Candidates& candidates) {
  const Json json = Json::from_cbor(bytes);
  std::vector<std::shared_ptr<const Effect>> added;
  for (const std::string name : json.value("added", Json::array())) {
    added.push_back(Named(name, candidates));
  }
  EstimationOptions options = problem.options;
  options.step_error = json.at("step_error");
  options.segment = json.at("given_segment");
  EvaluatedModel model =
      OpenModel(problem, std::move(added), json.at("without_influence"),
                json.at("start"), options);
  FromJson(json.at("fit"), *model.problem, &model.fit);
  json.at("holdout").get_to(model.holdout);
  model.holdout_point = SolutionFrom(json.at("holdout_point"), options.rollout);
  json.at("cv").get_to(model.cv);
  return model;
}

std::string Pack(const std::vector<CandidateRefit>& refits) {
  Json all = Json::array();
  for (const CandidateRefit& refit : refits) {
    Json effects = Json::array();
    for (const ScreenedEffect& effect : refit.expected) {
      effects.push_back({{"name", effect.name()},
                         {"parameters", effect.parameters},
                         {"without_influence", effect.without_influence}});
    }
    all.push_back({{"effects", effects}, {"predicted", refit.predicted}});
  }
  return Bytes(all);
}

std::vector<CandidateRefit> UnpackRefits(const std::string& bytes,
                                         const Candidates& candidates) {
  std::vector<CandidateRefit> refits;
  for (const Json& json : Json::from_cbor(bytes)) {
    CandidateRefit& refit = refits.emplace_back();
    refit.predicted = json.at("predicted");
    for (const Json& of : json.at("effects")) {
      ScreenedEffect& effect = refit.expected.emplace_back();
      effect.effect = Named(of.at("name"), candidates);
      of.at("parameters").get_to(effect.parameters);
      of.at("without_influence").get_to(effect.without_influence);
    }
  }
  return refits;
}

}  // namespace sysid
