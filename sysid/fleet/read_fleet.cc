#include "sysid/fleet/read_fleet.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>

#include "models/error.h"
#include "models/math/constants.h"
#include "models/printable.h"
#include "sysid/fleet/result_keys.h"
#include "sysid/session/run_list.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;

constexpr char kRunHint[] =
    "sysid_diagnose --out FOLDER and sysid_fit --out FOLDER write it";

// Unix times: after 2001, before 2100.
bool IsUnixTime(double t) { return t >= 1e9 && t < 4.1e9; }

// From the times of the segments, the names of the recordings, or the folder.
void SetDate(const ResultKeys& segments, Robot* robot) {
  std::string run;
  for (const ResultKeys& segment : segments.Items()) {
    const double t = segment.Number("t_start");
    if (IsUnixTime(t) && t < robot->recorded.value_or(4.1e9)) {
      robot->recorded = t;
      robot->recorded_from = "times";
    }
    if (run.empty()) run = segment.Text("trajectory");
  }
  if (robot->recorded) return;
  robot->recorded = DateIn(run);
  robot->recorded_from = robot->recorded ? "recording" : "";
  if (robot->recorded) return;
  robot->recorded = DateIn(fs::path(robot->file).parent_path().string());
  robot->recorded_from = robot->recorded ? "folder" : "";
}

void AddSkipped(const ResultKeys& json, Robot* robot) {
  if (!json.Has("skipped_runs")) return;  // of an older program
  for (const ResultKeys& run : json.At("skipped_runs").Items()) {
    robot->skipped_runs.push_back(run.Text("run") + ": " + run.Text("reason"));
  }
}

void ReadParameters(const ResultKeys& fit, const std::string& file,
                    Robot* robot) {
  for (const ResultKeys& entry : fit.At("parameters").Items()) {
    RobotParameter parameter;
    parameter.name = entry.Text("name");
    for (const RobotParameter& other : robot->parameters) {
      if (other.name != parameter.name) continue;
      throw InputError(file, "has the parameter '" + parameter.name + "' twice",
                       kRunHint);
    }
    parameter.unit = entry.Text("unit");
    parameter.estimate = {entry.Number("value"), entry.Number("std_error")};
    if (!entry.Flag("identifiable")) {
      parameter.unusable = "not identifiable";
    } else if (entry.Flag("at_bound")) {
      parameter.unusable = "at a bound";
    } else if (!(parameter.estimate.std_error > 0.0) ||
               !std::isfinite(parameter.estimate.std_error) ||
               !std::isfinite(parameter.estimate.value)) {
      parameter.unusable = "without a standard error";
    }
    robot->parameters.push_back(parameter);
  }
  if (!fit.Flag("converged")) {
    robot->not_compared =
        "the fit has not converged: " + fit.Text("termination");
  }
}

void ReadFit(const ResultKeys& fit, Robot* robot) {
  robot->model = fit.Text("model");
  const ResultKeys error = fit.At("error");
  robot->train = error.At("train").Number("normalized_rms");
  robot->holdout = error.IsNull("holdout")
                       ? kNaN
                       : error.At("holdout").Number("normalized_rms");
  if (fit.Has("added")) robot->missing = fit.At("added").Texts("effects");
  ReadParameters(fit, robot->file, robot);
  AddSkipped(fit, robot);
  SetDate(error.At("segments"), robot);
}

// Effects that were added, or the one that would be.
std::vector<std::string> MissingOf(const ResultKeys& diagnosis) {
  std::vector<std::string> missing;
  const auto name = [](const ResultKeys& entry) {
    return entry.Text("effect") + "@" + entry.Text("target");
  };
  for (const ResultKeys& added : diagnosis.At("added").Items()) {
    missing.push_back(name(added));
  }
  if (!missing.empty() || diagnosis.Text("verdict") != "missing_effect") {
    return missing;
  }
  for (const ResultKeys& candidate : diagnosis.At("candidates").Items()) {
    if (candidate.IsNull("confirmed")) continue;
    if (candidate.At("confirmed").Flag("accepted")) return {name(candidate)};
  }
  return missing;
}

void ReadDiagnosis(const ResultKeys& diagnosis, Robot* robot) {
  robot->model = diagnosis.Text("model");
  robot->verdict = diagnosis.Text("verdict");
  robot->missing = MissingOf(diagnosis);
  for (const ResultKeys& rival : diagnosis.At("rivals").Items()) {
    robot->rivals.push_back(rival.At("effects").Texts());
  }
  ResultKeys errors = diagnosis.At("baseline");
  robot->final_verdict = robot->verdict;
  if (!diagnosis.IsNull("final_fit")) {
    errors = diagnosis.At("final_fit");
    robot->final_verdict = errors.Text("verdict");
  }
  robot->train = errors.At("train").Number("normalized_rms");
  robot->holdout = errors.At("holdout").Number("normalized_rms");
  AddSkipped(diagnosis, robot);
  SetDate(diagnosis.At("where").At("segments"), robot);
  const fs::path fit = fs::path(robot->file).parent_path() / "fit.json";
  if (!fs::exists(fit)) {
    robot->not_compared = "there is no fit.json beside its diagnosis";
    return;
  }
  const ResultKeys beside = ResultKeys::Read(fit.string(), kRunHint);
  beside.CheckSchema({"sysid.fit/1"});
  ReadParameters(beside, fit.string(), robot);
  if (!diagnosis.IsNull("interrupted")) {
    robot->not_compared =
        "the diagnosis was interrupted: " + diagnosis.Text("interrupted");
  } else if (robot->final_verdict == "unexplained") {
    robot->not_compared = "the verdict is unexplained";
  }
}

// Throws InputError for a file that is no result.
Robot ReadRobot(const std::string& file) {
  Robot robot;
  robot.file = file;
  const ResultKeys json = ResultKeys::Read(file, kRunHint);
  const std::string schema =
      json.CheckSchema({"sysid.diagnosis/1", "sysid.fit/1"});
  schema == "sysid.fit/1" ? ReadFit(json, &robot) : ReadDiagnosis(json, &robot);
  return robot;
}

// What ended the program that was to write the folder's files: the first error
// in error.txt; "" where there is none.
std::string KeptError(const fs::path& folder) {
  std::ifstream in(folder / "error.txt");
  const std::string start = "error: ";
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with(start)) {
      return std::string(Printable(line.substr(start.size())));
    }
  }
  return "";
}

// The robot in a folder that a pattern met; broken where it has no usable file.
Robot RobotIn(const fs::path& folder, const std::string& name_or_pattern) {
  Robot robot;
  robot.file = (folder / name_or_pattern).string();
  std::vector<std::string> files = GlobFiles(robot.file);
  const fs::path fit = folder / "fit.json";
  if (files.empty() && fs::exists(fit)) files = {fit.string()};
  if (files.empty()) {
    robot.file = folder.string();
    robot.broken = KeptError(folder);
    if (robot.broken.empty()) {
      robot.broken = "has no " + name_or_pattern +
                     (name_or_pattern == "fit.json" ? "" : " and no fit.json");
    }
    return robot;
  }
  try {
    return ReadRobot(files.front());
  } catch (const InputError& error) {
    robot.file = files.front();
    robot.broken = error.WithoutHint();
  }
  return robot;
}

void AddRobots(const std::string& fits, std::vector<Robot>* robots) {
  std::error_code error;
  if (!IsFilePattern(fits) || fs::exists(fits, error)) {
    robots->push_back(ReadRobot(fits));
    return;
  }
  const fs::path path(fits);
  const std::string last = path.filename().string();
  const size_t before = robots->size();
  for (const std::string& one :
       GlobFiles(path.has_parent_path() ? path.parent_path().string() : ".")) {
    if (!fs::is_directory(one, error)) continue;
    // A pattern of files: those of a folder are robots each.
    std::vector<std::string> files = GlobFiles((fs::path(one) / last).string());
    if (IsFilePattern(last) && files.size() > 1) {
      for (const std::string& file : files) {
        robots->push_back(RobotIn(one, fs::path(file).filename().string()));
      }
    } else {
      robots->push_back(RobotIn(one, last));
    }
  }
  if (robots->size() > before) return;
  throw InputError("--fits", "no folder matches '" + fits + "'",
                   "name the results of each robot, in a folder each: --fits "
                   "'fleet/*/diagnosis.json'");
}

// Folders, or what tells them apart.
void NameRobots(std::vector<Robot>* robots) {
  const auto folder = [](const Robot& robot) {
    const fs::path path = fs::absolute(robot.file).lexically_normal();
    return fs::is_directory(path) ? path : path.parent_path();
  };
  std::map<std::string, int> names, paths;
  for (Robot& robot : *robots) {
    robot.name = folder(robot).filename().string();
    ++names[robot.name];
    ++paths[folder(robot).string()];
  }
  for (Robot& robot : *robots) {
    if (names[robot.name] == 1) continue;
    robot.name = paths[folder(robot).string()] > 1
                     ? robot.file
                     : fs::path(robot.file).parent_path().string();
  }
}

// That no robot comes twice: by the same file, or by the fit.json that a
// diagnosis wrote beside its own result.
void CheckOnce(const std::vector<Robot>& robots) {
  std::map<std::string, std::string> seen;
  for (const Robot& robot : robots) {
    std::error_code error;
    fs::path path = fs::weakly_canonical(robot.file, error);
    if (path.filename() == "fit.json" || path.filename() == "diagnosis.json") {
      path = path.parent_path();
    }
    const auto [at, is_new] = seen.emplace(path.string(), robot.file);
    if (is_new) continue;
    throw InputError(
        "--fits",
        robot.file == at->second
            ? "'" + robot.file + "' is named twice"
            : "'" + at->second + "' and '" + robot.file + "' are of one robot",
        "give each robot once: what is counted twice makes the "
        "intervals too narrow");
  }
}

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::vector<Robot> ReadFleet(const std::vector<std::string>& fits) {
  std::vector<Robot> robots;
  for (const std::string& one : fits) AddRobots(one, &robots);
  CheckOnce(robots);
  NameRobots(&robots);
  const bool any =
      std::any_of(robots.begin(), robots.end(),
                  [](const Robot& robot) { return robot.broken.empty(); });
  if (!any) {
    throw InputError("--fits",
                     "no robot is left: each of " +
                         std::to_string(robots.size()) + " is broken; " +
                         robots.front().name + ": " + robots.front().broken,
                     kRunHint);
  }
  return robots;
}

std::optional<double> DateIn(const std::string& text) {
  using std::chrono::day, std::chrono::month, std::chrono::year;
  for (size_t at = 0; at < text.size(); ++at) {
    if (!IsDigit(text[at]) || (at > 0 && IsDigit(text[at - 1]))) continue;
    size_t end = at;
    std::string digits;
    while (end < text.size() &&
           (IsDigit(text[end]) ||
            (text[end] == '-' && (end - at == 4 || end - at == 7)))) {
      if (text[end] != '-') digits += text[end];
      ++end;
    }
    const bool dashes =
        end - at == 10 && text[at + 4] == '-' && text[at + 7] == '-';
    if (digits.size() != 8 || !(dashes || end - at == 8)) continue;
    const std::chrono::year_month_day date(
        year(std::stoi(digits.substr(0, 4))),
        month(std::stoi(digits.substr(4, 2))),
        day(std::stoi(digits.substr(6, 2))));
    const int y = static_cast<int>(date.year());
    if (!date.ok() || y < 1970 || y >= 2100) continue;
    const std::chrono::sys_days days(date);
    return 86400.0 * days.time_since_epoch().count();
  }
  return std::nullopt;
}

std::string DateText(double seconds) {
  const std::chrono::sys_days days(
      std::chrono::days(static_cast<int>(std::floor(seconds / 86400.0))));
  const std::chrono::year_month_day date(days);
  char text[32];
  std::snprintf(
      text, sizeof(text), "%04d-%02u-%02u", static_cast<int>(date.year()),
      static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
  return text;
}

}  // namespace sysid
