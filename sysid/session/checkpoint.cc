#include "sysid/session/checkpoint.h"

#include <boost/crc.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>
#include <vector>

#include "models/error.h"
#include "sysid/estimation/solution_json.h"
#include "sysid/io/write_file.h"
#include "sysid/session/shared_runs.h"

namespace sysid {
namespace {

using Json = nlohmann::json;

constexpr char kFound[] = "+";  // before the bytes of a file that is there

// Numbers and words by their bytes.
class Checksum {
 public:
  void Add(const void* bytes, size_t size) { crc_.process_bytes(bytes, size); }
  void Add(double value) { Add(&value, sizeof(value)); }
  void Add(const std::string& text) { Add(text.c_str(), text.size() + 1); }
  void Add(const std::vector<double>& values) {
    Add(static_cast<double>(values.size()));
    Add(values.data(), values.size() * sizeof(double));
  }
  void Add(const RowMatrixXd& values) {
    Add(static_cast<double>(values.rows()));
    Add(values.data(), values.size() * sizeof(double));
  }
  std::uint64_t value() const { return crc_.checksum(); }

 private:
  // ECMA-182.
  boost::crc_optimal<64, 0x42F0E1EBA9EA3693, 0, 0, false, false> crc_;
};

std::string RunChecksum(const RunData& data) {
  Checksum sum;
  sum.Add(data.run.t);
  sum.Add(static_cast<double>(data.run.start));
  for (const Channel& channel : data.run.channels) {
    sum.Add(channel.name);
    sum.Add(static_cast<double>(channel.kind));
    sum.Add(static_cast<double>(channel.target));
    for (const int axis : channel.axes) sum.Add(static_cast<double>(axis));
    sum.Add(channel.values);
  }
  sum.Add(data.run.effort);
  for (const Input& input : data.run.inputs) {
    sum.Add(input.name);
    sum.Add(static_cast<double>(input.held));
    sum.Add(input.values);
  }
  sum.Add(data.sigma);
  return std::to_string(sum.value());
}

// Of all processes.
void AddRuns(const ShootingProblem& problem, Checksum* sum) {
  std::vector<std::string> own;
  for (const auto& data : problem.runs()) own.push_back(RunChecksum(*data));
  for (const std::string& run : JoinLists(problem.processes(), own)) {
    sum->Add(run);
  }
}

// Its topology, the values at which it stands, and its effects.
void AddModel(const Model& model, Checksum* sum) {
  for (const Joint& joint : model.mechanism().joints) {
    sum->Add(joint.name);
    sum->Add(ToString(joint.type));
    sum->Add(static_cast<double>(joint.parent_link));
    sum->Add(joint.axis.data(), sizeof(double) * 3);
    sum->Add(joint.R_PJ.data(), sizeof(double) * 9);
    for (const double limit :
         {joint.lower, joint.upper, joint.effort_limit, joint.velocity_limit}) {
      sum->Add(limit);
    }
    if (!joint.mimic) continue;
    sum->Add(joint.mimic->joint);
    sum->Add(joint.mimic->multiplier);
    sum->Add(joint.mimic->offset);
  }
  for (const Parameter& parameter : AllParameters(model)) {
    sum->Add(parameter.name);
    sum->Add(parameter.nominal);
  }
  for (const std::string& effect : model.effects().names()) sum->Add(effect);
}

void AddFree(const FreeParameter& free, Checksum* sum) {
  sum->Add(free.parameter.name);
  sum->Add(free.initial);
  sum->Add(free.lower);
  sum->Add(free.upper);
  if (!free.prior) return;
  sum->Add(free.prior->mean);
  sum->Add(free.prior->std);
}

Json ToJson(const StageOutcome& outcome) {
  Json history = Json::array();
  for (const HistoryEntry& entry : outcome.history) {
    history.push_back({{"iteration", entry.iteration},
                       {"cost", entry.cost},
                       {"time_s", entry.time_s},
                       {"theta", NumbersOf(entry.theta)}});
  }
  const StageSummary& summary = outcome.summary;
  return {{"doing", outcome.doing},
          {"solution", ToJson(outcome.solution)},
          {"converged", summary.converged},
          {"message", summary.message},
          {"stage_iterations", summary.iterations},
          {"stage_evaluations", summary.evaluations},
          {"cost", summary.cost},
          {"iterations", outcome.iterations},
          {"evaluations", outcome.evaluations},
          {"history", std::move(history)}};
}

StageOutcome ReadOutcome(const Json& json, const RolloutOptions& rollout) {
  StageOutcome outcome;
  outcome.doing = json.at("doing");
  outcome.solution = SolutionFrom(json.at("solution"), rollout);
  outcome.summary.converged = json.at("converged");
  outcome.summary.message = json.at("message");
  outcome.summary.iterations = json.at("stage_iterations");
  outcome.summary.evaluations = json.at("stage_evaluations");
  outcome.summary.cost = json.at("cost");
  outcome.iterations = json.at("iterations");
  outcome.evaluations = json.at("evaluations");
  for (const Json& entry : json.at("history")) {
    outcome.history.push_back({entry.at("iteration"), entry.at("cost"),
                               entry.at("time_s"),
                               VectorFrom(entry.at("theta"))});
  }
  return outcome;
}

}  // namespace

std::uint64_t ProblemChecksum(const ShootingProblem& problem) {
  Checksum sum;
  AddRuns(problem, &sum);
  AddModel(problem.model(), &sum);
  for (const FreeParameter& free : problem.free()) AddFree(free, &sum);
  sum.Add(NumbersOf(problem.InitialTheta()));
  const EstimationOptions& options = problem.options();
  for (const double value :
       {static_cast<double>(options.orientation), options.noise,
        static_cast<double>(options.rollout.integrator),
        static_cast<double>(options.rollout.may_change), options.rollout.step,
        static_cast<double>(options.rollout.linearization), options.segment,
        static_cast<double>(options.loss), options.loss_scale,
        static_cast<double>(options.max_iterations), options.step_error}) {
    sum.Add(value);
  }
  return sum.value();
}

Checkpoint::Checkpoint(std::string file, const ShootingProblem& problem,
                       bool resume)
    : file_(std::move(file)),
      all_(problem.processes()),
      rollout_(problem.options().rollout),
      all_runs_(problem.data().run_count()),
      first_run_(problem.data().first_run()),
      own_runs_(static_cast<int>(problem.runs().size())) {
  content_ = {{"sysid", SYSID_VERSION},
              {"problem", ProblemChecksum(problem)},
              {"stages", Json::array()}};
  if (!resume) return;
  // Not empty where there is a file.
  std::string bytes;
  if (all_.rank() == 0 && std::filesystem::exists(file_)) {
    bytes = kFound;
    if (!std::filesystem::is_directory(file_)) {
      std::ifstream in(file_, std::ios::binary);
      bytes.append(std::istreambuf_iterator<char>(in), {});
    }
  }
  bytes = all_.Share(bytes);
  if (!bytes.empty()) Take(bytes.substr(1));
}

// All processes come to the same, for each looks at the states of all.
void Checkpoint::Take(const std::string& bytes) {
  Json read = Json::from_cbor(bytes, true, false);
  const InputError damaged(file_, "is no checkpoint of sysid_fit, or damaged",
                           "remove it, or leave --resume out");
  if (!read.is_object()) throw damaged;
  for (const char* const key : {"sysid", "problem"}) {
    if (!read.contains(key) || read[key] != content_[key]) {
      throw InputError(file_,
                       "is the checkpoint of another fit: data, model, flags "
                       "or version are not the same, or with --add it is of "
                       "one process and this fit of several, or vice versa",
                       "remove it, or leave --resume out");
    }
  }
  try {
    for (const Json& stage : read.at("stages")) {
      const StageOutcome outcome = ReadOutcome(stage, rollout_);
      if (outcome.solution.runs.size() != static_cast<size_t>(all_runs_)) {
        throw damaged;
      }
    }
  } catch (const std::exception&) {
    throw damaged;
  }
  content_ = std::move(read);
  resumed_ = content_["stages"].size();
}

std::optional<StageOutcome> Checkpoint::Next(const std::string& doing) {
  Json& stages = content_["stages"];
  if (next_ >= stages.size()) return std::nullopt;
  StageOutcome outcome = ReadOutcome(stages[next_], rollout_);
  if (outcome.doing != doing) {
    // Of another way of the same fit: it goes on from here by itself.
    stages.erase(stages.begin() + next_, stages.end());
    return std::nullopt;
  }
  ++next_;
  std::vector<Solution::Nodes>& runs = outcome.solution.runs;
  runs = {runs.begin() + first_run_, runs.begin() + first_run_ + own_runs_};
  return outcome;
}

void Checkpoint::Keep(const StageOutcome& outcome) {
  ++next_;
  Json stage = ToJson(outcome);
  Json& runs = stage["solution"]["runs"];
  const std::vector<std::uint8_t> own = Json::to_cbor(runs);
  const std::vector<std::string> parts =
      all_.Gather(std::string(own.begin(), own.end()));
  DoAlike(all_, [&] {
    if (all_.rank() > 0) return;
    runs = Json::array();
    for (const std::string& part : parts) {
      for (Json& run : Json::from_cbor(part)) runs.push_back(std::move(run));
    }
    content_["stages"].push_back(std::move(stage));
    if (!trouble_.empty()) return;
    const std::vector<std::uint8_t> bytes = Json::to_cbor(content_);
    // A full disk is no reason to lose the fit.
    try {
      WriteFileAtomically(file_, std::string(bytes.begin(), bytes.end()));
    } catch (const InputError& error) {
      trouble_ = error.what();
    }
  });
}

void Checkpoint::Remove() const {
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

}  // namespace sysid
