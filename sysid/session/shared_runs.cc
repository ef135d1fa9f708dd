#include "sysid/session/shared_runs.h"

#include <algorithm>
#include <filesystem>
#include <numeric>

#include "models/error.h"

namespace sysid {
namespace {

// How many processes it takes, each with no more than `most`.
int Needed(const std::vector<double>& weights, double most) {
  int needed = 1;
  double sum = 0.0;
  for (const double weight : weights) {
    if (sum > 0.0 && sum + weight > most) {
      ++needed;
      sum = 0.0;
    }
    sum += weight;
  }
  return needed;
}

Run OutlineOf(const Run& run) {
  Run outline;
  outline.name = run.name;
  if (run.size() > 0) outline.t = {run.t.front(), run.t.back()};
  outline.recorded_efforts = run.recorded_efforts;
  outline.effort.setZero(1, run.effort.cols());
  for (int v = 0; v < run.effort.cols(); ++v) {
    outline.effort(0, v) = run.effort.col(v).isZero(0.0) ? 0.0 : 1.0;
  }
  for (const Channel& channel : run.channels) {
    Channel& to = outline.channels.emplace_back(channel);
    to.values.resize(2, channel.values.cols());
    for (int c = 0; c < channel.values.cols(); ++c) {
      constexpr int kNumbers = Eigen::PropagateNumbers;  // not those missing
      to.values(0, c) = channel.values.col(c).minCoeff<kNumbers>();
      to.values(1, c) = channel.values.col(c).maxCoeff<kNumbers>();
    }
  }
  for (const Input& input : run.inputs) {
    outline.inputs.push_back({input.name, input.held, {}});
  }
  return outline;
}

void Pack(const Run& outline, Packer* packer) {
  packer->Put(outline.name);
  packer->Put(static_cast<double>(outline.t.size()));
  for (const double t : outline.t) packer->Put(t);
  packer->Put(outline.effort);
  packer->Put(static_cast<double>(outline.recorded_efforts.size()));
  for (const bool recorded : outline.recorded_efforts) {
    packer->Put(recorded ? 1.0 : 0.0);
  }
  packer->Put(static_cast<double>(outline.channels.size()));
  for (const Channel& channel : outline.channels) {
    packer->Put(static_cast<double>(channel.kind));
    packer->Put(channel.target);
    packer->Put(channel.name);
    packer->Put(static_cast<double>(channel.axes.size()));
    for (const int axis : channel.axes) packer->Put(axis);
    packer->Put(channel.values);
  }
  packer->Put(static_cast<double>(outline.inputs.size()));
  for (const Input& input : outline.inputs) {
    packer->Put(input.name);
    packer->Put(input.held ? 1.0 : 0.0);
  }
}

Run Unpack(Unpacker* unpacker) {
  Run run;
  run.name = unpacker->Text();
  run.t.resize(unpacker->Count());
  for (double& t : run.t) t = unpacker->Number();
  run.effort = unpacker->Matrix();
  run.recorded_efforts.resize(unpacker->Count());
  for (size_t v = 0; v < run.recorded_efforts.size(); ++v) {
    run.recorded_efforts[v] = unpacker->Number() > 0.0;
  }
  run.channels.resize(unpacker->Count());
  for (Channel& channel : run.channels) {
    channel.kind = static_cast<ChannelKind>(unpacker->Count());
    channel.target = unpacker->Count();
    channel.name = unpacker->Text();
    channel.axes.resize(unpacker->Count());
    for (int& axis : channel.axes) axis = unpacker->Count();
    channel.values = unpacker->Matrix();
  }
  run.inputs.resize(unpacker->Count());
  for (Input& input : run.inputs) {
    input.name = unpacker->Text();
    input.held = unpacker->Number() > 0.0;
  }
  return run;
}

void Pack(const Finding& finding, Packer* packer) {
  packer->Put(finding.fault);
  packer->Put(static_cast<double>(finding.severity));
  for (const double number :
       {finding.weight, finding.error_left, finding.t_start, finding.t_end}) {
    packer->Put(number);
  }
  for (const std::string& text :
       {finding.file, finding.subject, finding.evidence, finding.consequence}) {
    packer->Put(text);
  }
  packer->Put(static_cast<double>(finding.remedies.size()));
  for (const std::string& remedy : finding.remedies) packer->Put(remedy);
}

Finding UnpackFinding(Unpacker* unpacker) {
  Finding finding;
  finding.fault = unpacker->Text();
  finding.severity = static_cast<Severity>(unpacker->Count());
  for (double* number : {&finding.weight, &finding.error_left, &finding.t_start,
                         &finding.t_end}) {
    *number = unpacker->Number();
  }
  for (std::string* text : {&finding.file, &finding.subject, &finding.evidence,
                            &finding.consequence}) {
    *text = unpacker->Text();
  }
  finding.remedies.resize(unpacker->Count());
  for (std::string& remedy : finding.remedies) remedy = unpacker->Text();
  return finding;
}

}  // namespace

std::vector<int> ShareOut(const std::vector<double>& weights, int processes) {
  double low = 0.0;
  for (const double weight : weights) low = std::max(low, weight);
  double high = std::accumulate(weights.begin(), weights.end(), 0.0);
  constexpr int kHalvings = 60;  // to a rounding of the sum
  for (int i = 0; i < kHalvings && low < high; ++i) {
    const double most = 0.5 * (low + high);
    (Needed(weights, most) <= processes ? high : low) = most;
  }
  std::vector<int> counts(processes, 0);
  int p = 0;
  double sum = 0.0;
  for (const double weight : weights) {
    if (sum > 0.0 && sum + weight > high && p + 1 < processes) {
      ++p;
      sum = 0.0;
    }
    sum += weight;
    ++counts[p];
  }
  return counts;
}

std::vector<std::string> OwnFiles(const Processes& all,
                                  const std::vector<std::string>& files) {
  if (all.size() == 1) return files;
  // Each process asks for a part, which a file system serves beside each other.
  Totals totals(static_cast<int>(files.size()));
  for (size_t i = all.rank(); i < files.size(); i += all.size()) {
    std::error_code error;  // also a file that is not there: its reader says so
    const auto size = std::filesystem::file_size(files[i], error);
    totals.Add(i, error ? 1.0 : 1.0 + static_cast<double>(size));
  }
  const Eigen::VectorXd sizes = totals.Over(all);
  const std::vector<int> counts =
      ShareOut({sizes.begin(), sizes.end()}, all.size());
  const auto first =
      files.begin() +
      std::accumulate(counts.begin(), counts.begin() + all.rank(), 0);
  return {first, first + counts[all.rank()]};
}

void DoAlike(const Processes& all, const std::function<void()>& work) {
  if (all.size() == 1) {
    work();
    return;
  }
  Packer packer;
  try {
    work();
  } catch (const InputError& error) {
    packer.Put(error.place());
    packer.Put(error.detail());
    packer.Put(error.hint());
  }
  for (const std::string& bytes : GatherToAll(all, packer.bytes())) {
    if (bytes.empty()) continue;
    Unpacker unpacker(bytes);
    const std::string place = unpacker.Text(), what = unpacker.Text();
    throw InputError(place, what, unpacker.Text());
  }
}

std::vector<std::string> JoinLists(const Processes& all,
                                   const std::vector<std::string>& own) {
  if (all.size() == 1) return own;
  Packer packer;
  for (const std::string& text : own) packer.Put(text);
  std::vector<std::string> texts;
  for (const std::string& bytes : GatherToAll(all, packer.bytes())) {
    for (Unpacker unpacker(bytes); !unpacker.AtEnd();) {
      texts.push_back(unpacker.Text());
    }
  }
  return texts;
}

std::vector<Finding> FindingsOfAll(const Processes& all,
                                   std::vector<Finding> own) {
  if (all.size() == 1) return own;
  Packer packer;
  for (const Finding& finding : own) Pack(finding, &packer);
  std::vector<Finding> findings;
  for (const std::string& bytes : GatherToAll(all, packer.bytes())) {
    for (Unpacker unpacker(bytes); !unpacker.AtEnd();) {
      Finding finding = UnpackFinding(&unpacker);
      const bool known = std::any_of(
          findings.begin(), findings.end(), [&](const Finding& other) {
            return other.file == finding.file &&
                   FullText(other) == FullText(finding);
          });
      if (!known) findings.push_back(std::move(finding));
    }
  }
  Sort(&findings);
  return findings;
}

std::vector<Run> OutlinesOfAll(const Processes& all,
                               const std::vector<Run>& own) {
  std::vector<Run> outlines;
  for (const Run& run : own) outlines.push_back(OutlineOf(run));
  if (all.size() == 1) return outlines;
  Packer packer;
  for (const Run& outline : outlines) Pack(outline, &packer);
  outlines.clear();
  for (const std::string& bytes : GatherToAll(all, packer.bytes())) {
    for (Unpacker unpacker(bytes); !unpacker.AtEnd();) {
      outlines.push_back(Unpack(&unpacker));
    }
  }
  return outlines;
}

}  // namespace sysid
