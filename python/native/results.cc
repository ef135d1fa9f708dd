#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>

#include "models/error.h"
#include "python/native/functions.h"
#include "sysid/estimation/clock.h"
#include "sysid/estimation/holdout.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/export_files.h"
#include "sysid/report/fit_report.h"
#include "sysid/report/page_data.h"
#include "sysid/report/sampled_models.h"
#include "sysid/session/edit_run.h"

namespace sysid::python {
namespace {

const FitHandle& FitIn(const Call& call) {
  const std::shared_ptr<const FitHandle>& fit = call.objects.at(0)->fit;
  if (fit == nullptr) throw std::logic_error("no fit");
  return *fit;
}

// What the programs say of a run as they read it stands first.
void AddNotices(const std::vector<std::string>& notices, Session* session,
                size_t* when_ready) {
  session->notices.insert(session->notices.begin(), notices.begin(),
                          notices.end());
  *when_ready += notices.size();
}

// "[a, b]" as a table's columns and rows say it.
std::vector<std::string> EstimateNames(const Fit& fit) {
  std::vector<std::string> names;
  for (const ParameterEstimate& estimate : fit.parameters) {
    names.push_back(estimate.name);
  }
  return names;
}

// A run, measured and predicted: arrays "t", and of each channel
// "joint1/measured" (as near to the prediction as its meaning allows) and
// "joint1/predicted"; and "states", the whole state at each sample: q, qd and
// the effects' own.
Result PredictionResult(const ShootingProblem& problem, const Solution& point,
                        int run, Json text) {
  const std::optional<Prediction> prediction = Predict(problem, point, run);
  if (!prediction) {
    throw InputError(problem.runs()[run]->run.name,
                     "cannot be predicted: the dynamics fail at the fit",
                     "fit fewer parameters, or with bounds (a specification)");
  }
  const Run& of = problem.runs()[run]->run;
  const Mechanism& mechanism = problem.model().mechanism();
  Result result;
  text["name"] = of.name;
  text["channels"] = Json::array();
  result.arrays.push_back(
      {"t", Eigen::Map<const Eigen::VectorXd>(of.t.data(), of.size())});
  for (size_t c = 0; c < of.channels.size(); ++c) {
    const Channel& channel = of.channels[c];
    const RowMatrixXd& predicted = prediction->channels[c];
    RowMatrixXd measured(channel.values.rows(), channel.values.cols());
    for (int k = 0; k < measured.rows(); ++k) {
      measured.row(k) = Nearest(channel, mechanism, k, predicted.row(k));
    }
    text["channels"].push_back(channel.name);
    result.arrays.push_back({channel.name + "/measured", std::move(measured)});
    result.arrays.push_back({channel.name + "/predicted", predicted});
  }
  // What simulators start from: q and qd of the joints, by their places.
  text["joints"] = Json::array();
  for (const Joint& joint : mechanism.joints) {
    if (VelocitySize(joint) == 0) continue;
    text["joints"].push_back({{"name", joint.name},
                              {"q", joint.q_index},
                              {"nq", ConfigurationSize(joint)},
                              {"v", mechanism.nq + joint.v_index},
                              {"nv", VelocitySize(joint)},
                              {"ball", joint.type == JointType::kSpherical}});
  }
  result.arrays.push_back({"states", prediction->states});
  result.text = Compact(text);
  return result;
}

// The segments of a prediction from one start each, as one from its first.
Solution AsOneSegment(Solution point, int run) {
  Solution::Nodes& nodes = point.runs[run];
  nodes.samples = {nodes.samples.front(), nodes.samples.back()};
  nodes.states = RowMatrixXd(nodes.states.topRows(1));
  return point;
}

PageSource PageOf(const std::string& function, const Session& session,
                  const PythonCall& call) {
  PageSource source;
  source.program = function;
  source.command = Command(function, call, "", "");
  source.session = &session;
  source.fit_command = [call](const std::string& add, const std::string& fix) {
    return Command("sysid.fit", call, add, fix);
  };
  return source;
}

// What sysid_diagnose proposes to type, in Python.
NextCommands NextOf(const DiagnosisHandle& handle) {
  const DiagnoseResult& result = handle.result;
  NextCommands next;
  next.fit = Command("sysid.fit", handle.call, AddText(result.next),
                     FixText(result.next));
  if (!result.next.solver.empty()) {
    next.fit.insert(next.fit.size() - 1,
                    ", solver=" + Quoted(result.next.solver));
  }
  if (!result.diagnosis.proposals.empty()) {
    next.formula =
        Command("sysid.fit", handle.call,
                Join(result.diagnosis.proposals.front().effects(), ","), "");
  }
  if (!result.experiment) return next;
  next.experiment_words = ExperimentWords(*result.experiment);
  if (result.experiment->flags.empty()) return next;
  next.experiment = "sysid.simulate(model";
  for (const auto& [name, value] : result.experiment->flags) {
    next.experiment += ", " + name + "=" + Quoted(value);
  }
  next.experiment += ")";
  return next;
}

Json NoteJson(const Session& session) { return session.notices; }

}  // namespace

Result FitRuns(const Call& call) {
  const double before_s = CpuSeconds();
  IdentifyRequest request;
  std::vector<std::string> notices;
  FillRequest(call, {}, &request, &notices);
  request.callbacks = call.MakeCallbacks();
  IdentifyResult found = Identify(request);
  AddNotices(notices, &found.session, &found.notices_when_ready);
  found.solved.fit.cpu_time_s -= before_s;  // of this call
  Result result;
  result.fit = std::make_shared<const FitHandle>(
      FitHandle{std::move(found), CallIn(call.request)});
  const Fit& fit = result.fit->result.fit();
  result.text = Compact({{"json", FitJson(result.fit->result)},
                         {"names", EstimateNames(fit)},
                         {"answer", result.fit->result.IsAnswer()},
                         {"notices", NoteJson(result.fit->result.session)}});
  result.arrays.push_back({"covariance", RowMatrixXd(fit.covariance)});
  return result;
}

Result DiagnoseRuns(const Call& call) {
  DiagnoseRequest request;
  std::vector<std::string> notices;
  FillRequest(call, {"auto", "whole_runs"}, &request, &notices);
  const Json& options = call.request.at("options");
  const auto is_set = [&](const char* name) {
    return options.contains(name) &&
           Truth(options[name], std::string("--") + name);
  };
  request.add_found = is_set("auto");
  request.fit_whole_runs = is_set("whole_runs");
  request.callbacks = call.MakeCallbacks();
  DiagnoseResult found = Diagnose(request);
  AddNotices(notices, &found.session, &found.notices_when_ready);
  Result result;
  result.diagnosis = std::make_shared<const DiagnosisHandle>(
      DiagnosisHandle{std::move(found), CallIn(call.request)});
  const DiagnosisHandle& handle = *result.diagnosis;
  const NextStep& next = handle.result.next;
  Json fix = Json::object();
  for (const NamedValue& value : next.fix) {
    fix[value.name] = value.value ? Json(*value.value) : Json(nullptr);
  }
  result.text = Compact(
      {{"json", DiagnosisJson(handle.result, NextOf(handle))},
       {"next", {{"add", next.add}, {"fix", fix}, {"solver", next.solver}}},
       {"notices", NoteJson(handle.result.session)}});
  return result;
}

Result PredictRun(const Call& call) {
  const IdentifyResult& found = FitIn(call).result;
  const Session& session = found.session;
  std::vector<std::string> notices;
  const Json& json = call.request.at("run");
  Run run;
  if (json.contains("file")) {
    run = ReadGoodRun(session, json["file"], &notices);
  } else {
    run = RunIn(call, json, session.model.mechanism(), {}, &notices);
    EditRun(session, &run, &notices);
  }
  const auto data = MakeDataSetLike(session.model, {std::move(run)},
                                    session.options, found.problem->data());
  EstimationOptions options = session.options;
  options.stop = {};  // of the fit
  if (call.control != nullptr) options.stop = call.control->stop.get_token();
  const Fit& fit = found.fit();
  const Holdout holdout = PredictHoldout(
      OpenHoldout(fit.model, data, options, fit.point.rollout, fit.segment_s));
  Json text = {{"notices", notices},
               {"error", holdout.errors.total},
               {"channel_errors", holdout.errors.channels},
               {"open", OpenJson(holdout.open, true)[0]}};
  return PredictionResult(*holdout.problem,
                          call.request.at("open").get<bool>()
                              ? AsOneSegment(holdout.point, 0)
                              : holdout.point,
                          0, text);
}

Result Predictions(const Call& call) {
  const IdentifyResult& found = FitIn(call).result;
  const bool held_out = call.request.at("held_out");
  const int run = call.request.at("run");
  if (held_out && !found.holdout) return {"null"};
  const ShootingProblem& problem =
      held_out ? *found.holdout->problem : *found.problem;
  const Solution& point = held_out ? found.holdout->point : found.fit().point;
  if (run >= static_cast<int>(problem.runs().size())) return {"null"};
  return PredictionResult(problem, point, run, Json::object());
}

Result SampleFit(const Call& call) {
  const IdentifyResult& found = FitIn(call).result;
  const int count = call.request.at("count");
  if (count < 1 || count > 100000) {
    throw InputError("--sample", "cannot be " + std::to_string(count),
                     "it lies between 1 and 100000");
  }
  CheckSampling(found.session, count);
  const SampledModels samples =
      SampleModels(found.session, *found.problem, found.solved, count,
                   call.request.at("seed").get<std::uint64_t>());
  if (!samples.failure.empty()) {
    throw InputError("--sample", "there are no samples: " + samples.failure);
  }
  return {Compact({{"urdfs", samples.urdfs},
                   {"csv", samples.csv},
                   {"remarks", samples.remarks}})};
}

namespace {

void AddModelFiles(const PageFit& shown, Json* files) {
  for (const ModelFile& file : ModelFiles()) {
    (*files)[file.name] = ModelFileText(shown, file.name);
  }
  for (const NamedText& file : FilesBeside(shown)) {
    (*files)[file.name] = file.text;
  }
}

void AddPage(const std::function<Json()>& page, Json* files) {
  if (WhyNoPage().empty()) (*files)["report.html"] = ReportHtml(page());
}

}  // namespace

Result FilesOf(const Call& call) {
  Json files = Json::object();
  if (const auto& handle = call.objects.at(0)->diagnosis) {
    const DiagnoseResult& result = handle->result;
    const NextCommands next = NextOf(*handle);
    files["diagnosis.json"] = DiagnosisJson(result, next);
    if (result.final) AddModelFiles(ShowFinal(*result.final, 0), &files);
    PageSource source = PageOf("sysid.diagnose", result.session, handle->call);
    source.train = result.problem.train.get();
    source.holdout = result.problem.holdout.get();
    source.experiment = next.experiment;
    source.experiment_words = next.experiment_words;
    AddPage([&] { return DiagnosisPage(source, result); }, &files);
  } else {
    const FitHandle& fit = FitIn(call);
    PageFit shown = ShowIdentified(fit.result);
    shown.next_command = Command("sysid.diagnose", fit.call, "", "");
    AddModelFiles(shown, &files);
    PageSource source = PageOf("sysid.fit", fit.result.session, fit.call);
    source.train = &fit.result.problem->data();
    source.holdout =
        fit.result.holdout ? &fit.result.holdout->problem->data() : nullptr;
    AddPage([&] { return FitPage(source, shown); }, &files);
  }
  return {Compact({{"files", files}, {"no_page", WhyNoPage()}})};
}

Result TextOf(const Call& call) {
  const bool colour = call.request.at("colour");
  if (const auto& handle = call.objects.at(0)->diagnosis) {
    return {Compact(
        {{"text", DiagnosisText(handle->result, NextOf(*handle), colour)},
         {"sentence", DiagnosisSentence(handle->result.diagnosis)}})};
  }
  const IdentifyResult& found = FitIn(call).result;
  return {Compact(
      {{"text", FitText(found, colour)},
       {"sentence", FitSentence(*found.problem, found.fit(),
                                found.holdout ? &*found.holdout : nullptr)},
       {"good", ReachesNoise(*found.problem, found.fit())}})};
}

Result ModelOf(const Call& call) {
  const IdentifyResult& found = FitIn(call).result;
  const auto model = std::make_shared<const Model>(found.fit().model);
  return DescribeModel(
      std::make_shared<const ModelHandle>(
          ModelHandle{found.session.model_name, model, model->mechanism()}),
      *model, {});
}

}  // namespace sysid::python
