#pragma once

#include <limits>
#include <string>
#include <vector>

#include "models/error.h"
#include "sysid/checks/finding.h"
#include "sysid/estimation/shooting_problem.h"
#include "sysid/io/channel_edits.h"
#include "sysid/io/column_map.h"

namespace sysid {

// What is checked: a model with what is free of it, and recordings. The
// pointers must outlive the checks.
struct CheckInput {
  const Model* model = nullptr;
  std::string model_file;  // for places
  const std::vector<FreeParameter>* free = nullptr;
  std::vector<const Run*> runs;
  // Where other processes have runs too: the names of all.
  std::vector<std::string> run_names;
  ColumnMap columns;       // of flags and specification
  ColumnMap flag_columns;  // of the flag alone: a fix repeats it
  ChannelEdits flag_edits;
  // Where one run of several is asked alone: what the names in its remedies
  // begin with, "b.csv/".
  std::string scope;
  EstimationOptions options;
};

// A check of the numbers alone. Appends what it finds. The list of all is in
// shipped_checks.h; a check is a file and a line there.
using NumbersCheck = void (*)(const CheckInput& input,
                              std::vector<Finding>* findings);

// How a fault of the data predicts beside all that the model could lack: no
// better; better, but within what chance allows for; better beyond that.
enum class DataVerdict { kRejected, kUndecided, kAccepted };

// An explanation of what the model misses, compared with the others in windows
// that were not fitted.
struct ComparedExplanation {
  std::string what;      // "spring@joint1", "joint1.q read 8 ms earlier"
  bool of_data = false;  // a fault of the data; else of the model
  DataVerdict verdict = DataVerdict::kRejected;  // of a fault of the data
  double error = 0.0;        // that it leaves, in times the noise
  double error_ratio = 1.0;  // to that of the model as given, (10.3)
};

struct CheckResult {
  std::vector<Finding> findings;  // worst first
  // By what a coarse fit of the model misses windows that were not fitted, in
  // times the noise. NaN where nobody asked or could.
  double error = std::numeric_limits<double>::quiet_NaN();
  std::vector<ComparedExplanation> compared;  // least error first
  // Faults whose hypotheses were not asked for want of time, by name.
  std::vector<std::string> not_asked;
};

// Every check of the numbers alone, milliseconds each; worst first.
std::vector<Finding> CheckNumbers(const CheckInput& input);

// What the reader refused, as a finding.
Finding Unreadable(const InputError& error);

}  // namespace sysid
