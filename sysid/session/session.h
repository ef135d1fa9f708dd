#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sysid/checks/finding.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/shooting_problem.h"
#include "sysid/io/channel_edits.h"
#include "sysid/parameters/fit_specification.h"
#include "sysid/parameters/free_parameter.h"
#include "sysid/session/fit_request.h"

namespace sysid {

// A run that was set aside, and why.
struct SkippedRun {
  std::string run, reason;
};

// A fault of the recordings that was found, and undone by a flag: what follows
// reads them so.
struct UndoneFault {
  std::string hypothesis;   // Finding::fault
  std::string where;        // "run.csv: joint1.q"
  std::string flag, value;  // "columns", "joint1.q=-joint1.q"
  std::string text;         // of both, as it is pasted
  double gain = 0.0;        // by what the error fell; 0: the numbers show it
};

// Everything that a fit starts from. What was assumed on the way, and what of
// the input was ignored, is in `notices`, a line each.
struct Session {
  std::string model_name;              // for reports: "pendulum3"
  std::string model_file;              // empty where it was in memory
  std::shared_ptr<const Model> given;  // FitRequest::model_in_memory
  Model model;
  std::vector<FreeParameter> free;
  std::vector<Run> runs, holdout;        // of this process
  std::vector<std::string> run_names;    // of both, of all processes
  std::vector<SkippedRun> skipped_runs;  // of both
  EstimationOptions options;
  RunStart start = RunStart::kEstimated;  // of the runs
  std::string solver;                     // one of Solvers()
  std::string spec_file;                  // empty where there is none
  ColumnMap columns;                      // of flags and specification
  ChannelEdits edits;                     // so too: --shift and --ignore
  // What of both the flags alone say.
  ColumnMap flag_columns;
  ChannelEdits flag_edits;
  std::vector<std::string> fixed;    // names that --fix or `fix:` hold
  std::vector<std::string> assumed;  // AssumeInertia, as --fix takes it
  std::vector<NamedValue> locked;    // joints held still, with their positions
  std::vector<NamedValue> flag_locks;  // what of that the flag says
  // What --add put into the model, and what that freed, by name.
  std::vector<std::string> added;
  std::set<std::string> freed_by_added;
  std::vector<std::string> effects;  // names of those that are in the model
  std::vector<std::string> notices;
  CheckLevel check = CheckLevel::kAll;
  // What CheckSession found, worst first; `checked` where it was asked.
  std::vector<Finding> findings;
  bool checked = false;
  std::vector<UndoneFault> undone;  // UndoFaults
  size_t not_checked = 0;           // kinds of fault, for want of time

  explicit Session(const Model& m) : model(m) {}
};

// A model by its name or file with joints held still (`locks` is resolved:
// locks.h), and its URDF's <dynamics> as effects; a notice for each of those.
// Names of `columns` that are plain words are inputs that effects may read.
Model OpenModel(const std::string& name_or_file, const Catalogue& catalogue,
                std::vector<NamedValue>* locks, std::string* file,
                std::vector<std::string>* notices,
                const ColumnMap& columns = {});

// Reads model, specification and runs, and decides what is free. The request
// wins over the specification. Throws InputError for whatever is wrong with any
// of them.
Session OpenSession(FitRequest request, const Catalogue& catalogue);

// The same without reading a run: FitRequest::traj may name files that are not
// there.
Session OpenModelSession(const FitRequest& request, const Catalogue& catalogue);

// A model in memory as OpenModel makes those of files.
Model AdaptModel(const Model& given, const Catalogue& catalogue,
                 std::vector<NamedValue>* locks,
                 std::vector<std::string>* notices,
                 const ColumnMap& columns = {});

// One run as the session's columns, shifts and ignored spans make it. Throws
// InputError as ReadRun and ApplyEdits do.
Run ReadSessionRun(const Session& session, const std::string& file,
                   std::vector<std::string>* notices);
// One that can be fitted by itself: its times and what the model's effects read
// are there. Throws InputError for all that makes it a bad run.
Run ReadGoodRun(const Session& session, const std::string& file,
                std::vector<std::string>* notices);

}  // namespace sysid
