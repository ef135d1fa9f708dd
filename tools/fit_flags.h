#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gflags/gflags_declare.h"
#include "sysid/api/callbacks.h"
#include "sysid/report/page_data.h"
#include "sysid/session/next_experiment.h"
#include "sysid/session/session.h"
#include "tools/program.h"

// The flags of programs that fit a model to runs (docs/interface.md section 1).

DECLARE_string(json);
DECLARE_string(out);

namespace sysid {

FitRequest RequestFromFlags();

// The command line of `program` with the flags that were given and say what is
// fitted to what and how, without --add and --fix, for a shell.
std::string CommandFromFlags(const std::string& program);

// The same flag with more in its list: " --add a,b", or nothing where there is
// nothing.
std::string FlagWith(const std::string& flag, const std::string& more);

// The command of sysid_simulate that makes the motion of an experiment.
std::string SimulationFromFlags(const Session& session,
                                const NextExperiment& experiment);

// What the page of a program shows beside its models; `train` and `holdout`
// are yet to be set.
PageSource PageFromFlags(const std::string& program, const Session& session);

// Writes a file into --out.
void WriteIntoFolder(const std::string& name, const std::string& text);

// Writes into --out what lies beside the files of a model: force tables, the
// model for simulators, export.json; their names.
std::vector<std::string> WriteFilesBeside(const PageFit& fit);

// Writes the files of a model into --out, and those; their names.
std::vector<std::string> WriteModelFiles(const PageFit& fit);

// Writes report.html into --out. Where the build has no page it calls nothing
// but says why on standard error. Whether the report is there.
bool WriteReport(const std::function<Json()>& page);

// That the results can be written, before the long work; after all that may be
// wrong with the input, so that this leaves no empty folder.
void CheckOutputs(const FitRequest& request, const Session& session);
// How a program follows Identify or Diagnose, and ends them by a signal: once
// they are ready, and after `check` (may be empty) of what the session makes of
// other flags, it sees that the results can be written, begins the watch and
// prints the notices. `processes`: those that share the work; null: one. The
// watch must live as long as the call.
Callbacks CallbacksFromFlags(const FitRequest& request,
                             const Processes* processes, Watch* watch,
                             std::function<void(const Session&)> check = {});

// Whether --out or --json names one: all else goes to standard output.
bool WritesFiles();

// Gives a program's result: calls `write_files`, writes `json` to --json, and
// prints that, or else `text()`. Files that cannot be written (the disk may be
// full by now) are said at last: the result is printed all the same.
void GiveResult(const std::function<void()>& write_files,
                const std::string& json,
                const std::function<std::string()>& text);

// Help on flags that sysid_diagnose and sysid_studio have alike.
extern const char kDiagnosisFlagsHelp[];

}  // namespace sysid
