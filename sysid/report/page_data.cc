#include "sysid/report/page_data.h"

#include <cmath>

#include "models/urdf/write_urdf.h"
#include "sysid/estimation/holdout.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/page_parts.h"

namespace sysid {
namespace {

Json MechanismJson(const Model& model) {
  std::vector<Joint> moving = model.mechanism().joints;
  std::erase_if(moving, [](const Joint& j) { return VelocitySize(j) == 0; });
  const auto shown = [](const Joint& joint) -> Json {
    const bool slides = joint.type == JointType::kPrismatic;
    return {
        {"name", joint.name},           {"type", ToString(joint.type)},
        {"unit", slides ? "m" : "rad"}, {"effortUnit", slides ? "N" : "N m"},
        {"q", joint.q_index},           {"v", joint.v_index}};
  };
  return {{"urdf", WriteUrdf(model, {}, UrdfContent::kDynamics)},
          {"joints", List(moving, shown)}};
}

// An error of no runs at all is none.
Json ErrorOr(double error) { return error > 0 ? Finite(error) : Json(nullptr); }

PageFit ShowFit(int id, const std::string& title, const Session& session,
                const ShootingProblem& problem, const Fit& found,
                const std::optional<Holdout>& holdout) {
  PageFit fit;
  fit.id = id;
  fit.title = title;
  fit.session = &session;
  fit.problem = &problem;
  fit.fit = &found;
  fit.holdout = holdout ? &*holdout : nullptr;
  return fit;
}

// A step of a search with both errors over the segments of its last model. The
// search predicts sets of effects and no step.
DiagnosisStep OverLastSegments(const Diagnosis& diagnosis, size_t i) {
  DiagnosisStep step = diagnosis.steps[i];
  step.predicted = NAN;
  const std::vector<ModelErrors>& path = diagnosis.comparison.path;
  if (i + 1 >= path.size()) return step;
  const ModelErrors &before = path[i], &after = path[i + 1];
  step.segment_s = before.segment_s;
  step.train_before = before.train.normalized_rms;
  step.holdout_before = before.holdout.normalized_rms;
  step.cv_before = before.cv;
  step.train_after = after.train.normalized_rms;
  step.holdout_after = after.holdout.normalized_rms;
  return step;
}

}  // namespace

PageFit ShownModel::Show(int id, const std::string& title) const {
  PageFit fit =
      ShowFit(id, title, session, *evaluated->problem, evaluated->fit, holdout);
  fit.cv = &evaluated->cv;
  return fit;
}

ShownModel OpenEvaluatedModel(const Session& session,
                              const DiagnosisProblem& problem,
                              const EvaluatedModel& evaluated) {
  ShownModel judged{session, std::nullopt, &evaluated};
  judged.session.model = evaluated.problem->model();
  judged.session.free = evaluated.problem->free();
  judged.session.effects = judged.session.model.effects().names();
  judged.session.runs.clear();  // those of the problem count
  judged.session.holdout.clear();
  if (problem.holdout != nullptr && !evaluated.holdout_point.runs.empty()) {
    judged.holdout = OpenHoldout(
        evaluated.fit.model, problem.holdout, evaluated.problem->options(),
        evaluated.fit.point.rollout, evaluated.fit.segment_s);
    judged.holdout->errors = evaluated.holdout;
    judged.holdout->point = evaluated.holdout_point;
  }
  return judged;
}

PageFit ShowIdentified(const IdentifyResult& result) {
  PageFit fit = ShowFit(0, "the fit", result.session, *result.problem,
                        result.fit(), result.holdout);
  fit.added = result.added ? &*result.added : nullptr;
  const std::optional<MixtureFit>& mixture = result.solved.mixture;
  fit.mixture = mixture ? &*mixture : nullptr;
  fit.with_prediction_csv = true;
  return fit;
}

PageFit ShowFinal(const FinalFit& final, int id) {
  return ShowFit(id, "final fit, whole runs", final.session, *final.problem,
                 final.fit, final.holdout);
}

Json PageHeader(const PageSource& source) {
  Json page;
  page["schema"] = "sysid.page/1";
  page["program"] = source.program;
  page["version"] = SYSID_VERSION;
  page["live"] = source.live;
  page["model"] = source.session->model_name;
  page["command"] = source.command;
  page["notices"] = source.session->notices;
  page["noise"] = Finite(source.train->PooledNoise());
  page["mechanism"] = MechanismJson(source.session->model);
  page["runs"] = RunsJson(source);
  page["models"] = Json::array();
  page["current"] = 0;
  page["compared"] = nullptr;
  page["steps"] = Json::array();
  page["conclusion"] = nullptr;
  page["leftOut"] = nullptr;
  return page;
}

Json PageStep(const DiagnosisStep& step, int model, int from) {
  // A linearisation that promises no fall promises nothing.
  const bool falls = step.predicted < step.train_before;
  return {{"title", ChangeTitle(step)},
          {"model", model},
          {"from", from < 0 ? Json(nullptr) : Json(from)},
          {"predicted", falls ? ErrorOr(step.predicted) : Json(nullptr)},
          {"trainBefore", ErrorOr(step.train_before)},
          {"trainAfter", ErrorOr(step.train_after)},
          {"holdoutBefore", ErrorOr(step.holdout_before)},
          {"holdoutAfter", ErrorOr(step.holdout_after)},
          {"segment_s", Finite(step.segment_s)},
          {"crossValidationBefore", CrossValidationJson(step.cv_before)}};
}

Json FitPage(const PageSource& source, const PageFit& fit) {
  Json page = PageHeader(source);
  page["models"].push_back(PageModel(source, fit, nullptr));
  if (fit.added != nullptr) {
    page["steps"].push_back(PageStep(*fit.added, fit.id, -1));
  }
  return page;
}

Json DiagnosisPage(const PageSource& source, const DiagnosisProblem& problem,
                   const Diagnosis& diagnosis, const FinalFit* final) {
  Json page = PageHeader(source);
  page["leftOut"] = LeftOutJson(diagnosis.comparison);
  Json& models = page["models"];
  const NextStep next = ChooseNext(*source.session, diagnosis);
  const std::string command =
      source.fit_command(AddText(next), FixText(next)) + SolverText(next);
  const ShownModel base =
      OpenEvaluatedModel(*source.session, problem, diagnosis.base);
  PageFit given = base.Show(0, "as given");
  given.with_prediction_csv = final == nullptr && diagnosis.steps.empty();
  given.next_command = command;
  models.push_back(PageModel(source, given, &diagnosis));
  for (size_t i = 0; i < diagnosis.steps.size(); ++i) {
    const DiagnosisStep step = OverLastSegments(diagnosis, i);
    const int id = static_cast<int>(models.size());
    const ShownModel judged =
        OpenEvaluatedModel(*source.session, problem, *step.after);
    PageFit fit = judged.Show(id, ChangeTitle(step));
    fit.with_prediction_csv =
        final == nullptr && step.after == diagnosis.steps.back().after;
    fit.next_command = command;
    models.push_back(PageModel(source, fit, nullptr));
    page["steps"].push_back(PageStep(step, id, id - 1));
  }
  if (final != nullptr) {
    models.back()["wholeRuns"] = PageWholeRuns(*final);
    PageFit fit = ShowFinal(*final, static_cast<int>(models.size()));
    fit.next_command = command;
    fit.with_prediction_csv = true;  // the one that lies beside the page
    models.push_back(PageModel(source, fit, nullptr));
    page["conclusion"] = {{"sentence", EndSentence(diagnosis, *final)},
                          {"good", EndsWell(diagnosis, *final)}};
  }
  // The model as given says what was missing; beside it, what came of that.
  if (!diagnosis.steps.empty()) {
    page["compared"] = diagnosis.steps.size();
    Json& last = models[diagnosis.steps.size()];
    last["verdict"] = ToString(diagnosis.final_verdict);
    for (const char* key : {"stability", "standIns"})
      last[key] = models[0][key];
  }
  return page;
}

Json DiagnosisPage(const PageSource& source, const DiagnoseResult& result) {
  return DiagnosisPage(source, result.problem, result.diagnosis,
                       result.final ? &*result.final : nullptr);
}

}  // namespace sysid
