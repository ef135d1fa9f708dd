#pragma once

#include <limits>
#include <string>
#include <vector>

namespace sysid {

// How bad a fault of the data is, worst first: the order of the report.
enum class Severity {
  kUnreadable,  // the reader refuses it
  kWrong,       // fitting it gives wrong numbers
  kHarmful,     // fitting it gives worse numbers than the recording could
  kNote,        // suspicious: right only if it is meant
};
std::string ToString(Severity severity);

// A model within this of the noise misses nothing worth a hypothesis, and
// nothing that matters is wrong with the data.
inline constexpr double kExplained = 1.5;

// Names of faults that other checks ask for.
inline constexpr char kSlowSampling[] = "slow_sampling";
inline constexpr char kMissingEfforts[] = "effort_not_measured";
inline constexpr char kTimeJitter[] = "time_jitter";

// What is wrong with a recording or a model.
struct Finding {
  std::string fault;  // short, stable: "axis_flipped" (docs/checks.md)
  Severity severity = Severity::kWrong;
  // How much stands on it, among those of one severity: the larger, the
  // earlier. For hypotheses, by how much the error falls.
  double weight = 0.0;
  // Of hypotheses: what the model still misses with the fix, in times the
  // noise. NaN of the numbers alone, which ask no model.
  double error_left = kNaN;
  std::string file;     // run or URDF; "" where it is of all runs
  std::string subject;  // our name of the column, joint or link: "joint1.q"
  // Whether effects of the catalogue say the same.
  bool is_effect = false;
  // Time span, s; NaN where it is everywhere.
  double t_start = kNaN, t_end = kNaN;
  std::string evidence;     // numbers with units
  std::string consequence;  // what a fit would make of it
  // What mends it: flags to be pasted ("--columns joint1.q=-joint1.q"), or,
  // where no flag can, what to do. The first is meant; any other does as much.
  std::vector<std::string> remedies;

  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
};

// Names another explanation with that of a finding: in its words ("with
// joint1.q read 8 ms later"), its remedies as others.
void NameAlso(const std::string& says, const std::vector<std::string>& remedies,
              Finding* finding);

// Worst first; stable. What a hypothesis says and yet does not explain stands
// behind what the numbers show: it may be their fault, and they are certain.
void Sort(std::vector<Finding>* findings);

// As lists for people show them: of more than three of one kind in one file the
// first, which names the others.
std::vector<Finding> Gathered(const std::vector<Finding>& findings);

// "run.csv: joint1.q, 2 s to 3 s".
std::string PlaceOf(const Finding& finding);

// One line: fault, place, evidence, first remedy.
std::string BriefText(const Finding& finding);

// Some lines, for people.
std::string FullText(const Finding& finding);

// "%.4g" of a number.
std::string ShortNumber(double value);

}  // namespace sysid
