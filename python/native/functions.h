#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "models/model.h"
#include "residuals/run.h"
#include "sysid/api/diagnose.h"
#include "sysid/api/identify.h"
#include "sysid/io/memory_table.h"
#include "sysid/report/json.h"

namespace sysid::python {

// A model as later calls take it: by its name or file, with the specification
// beside it, or in memory.
struct ModelHandle {
  std::string name;
  std::shared_ptr<const Model> model;  // null: by name
  Mechanism mechanism;                 // before any joint is held
};

// A recording that was read, and the mechanism that it was read for.
struct RunHandle {
  Run run;
  Mechanism mechanism;
  std::vector<std::string> notices;
};

// What a call wrote for the command of a fit: the arguments as Python has them,
// without add and fix, and those, comma separated.
struct PythonCall {
  std::string arguments, add, fix;
};

struct FitHandle {
  IdentifyResult result;
  PythonCall call;
};
struct DiagnosisHandle {
  DiagnoseResult result;
  PythonCall call;
};

struct NamedArray {
  std::string name;
  RowMatrixXd values;
};

// What a call gives.
struct Result {
  std::string text;  // JSON
  std::vector<NamedArray> arrays = {};
  std::shared_ptr<const ModelHandle> model = nullptr;
  std::shared_ptr<const RunHandle> run = nullptr;
  std::shared_ptr<const FitHandle> fit = nullptr;
  std::shared_ptr<const DiagnosisHandle> diagnosis = nullptr;
};

// What passes between a call that runs and who waits for it.
struct Control {
  std::stop_source stop;
  std::mutex mutex;
  std::optional<Progress> progress;
};

struct TableView {
  std::string name;
  size_t rows = 0;
  std::vector<MemoryTable::Column> columns;
};

// A call: `request` says which of the objects and tables is what, by their
// numbers.
struct Call {
  Json request;
  std::vector<const Result*> objects;
  std::vector<TableView> tables;
  Control* control = nullptr;  // may be null

  Callbacks MakeCallbacks() const;
};

// Throw InputError, Cancelled.
Result LoadModel(const Call& call);      // {"name"}
Result ReadRecording(const Call& call);  // {"model", "run", "columns"}
Result SimulateRun(const Call& call);    // {"model", "options"}
Result FitRuns(const Call& call);  // {"model", "runs", "holdout", "options"}
Result DiagnoseRuns(const Call& call);  // the same
// Of the first object, a fit: {"run", "open"}; {"count", "seed"}; {}; {}; {}.
Result PredictRun(const Call& call);
Result SampleFit(const Call& call);
Result FilesOf(const Call& call);  // of a diagnosis, too
Result TextOf(const Call& call);   // so too
Result ModelOf(const Call& call);
Result Predictions(const Call& call);  // {"held_out", "run"}

// What the calls share.

// The object of a request's {"object": 0}; throws std::logic_error where it is
// none of this kind.
const ModelHandle& ModelIn(const Call& call, const Json& json);
// Of a table whose columns were named for this mechanism: throws InputError for
// one of a joint or link that it does not have.
void CheckNames(const TableView& table, const Mechanism& mechanism);
// A run of a request: {"table": 0} or {"object": 0}, for this mechanism.
Run RunIn(const Call& call, const Json& json, const Mechanism& mechanism,
          const ColumnMap& columns, std::vector<std::string>* notices);
// Its columns as arrays, t first.
std::vector<NamedArray> ArraysOf(const Mechanism& mechanism, const Run& run);
Result ResultOf(std::shared_ptr<const RunHandle> run);
Result DescribeModel(std::shared_ptr<const ModelHandle> handle,
                     const Model& model, std::vector<std::string> notices);

// A request of a fit or a diagnosis, with what reading its recordings said.
// Options are those of docs/python.md: the flags by their names. `own` are
// those that the caller reads itself.
void FillRequest(const Call& call, const std::vector<std::string>& own,
                 FitRequest* request, std::vector<std::string>* notices);
PythonCall CallIn(const Json& request);
std::string Command(const std::string& function, const PythonCall& call,
                    const std::string& add, const std::string& fix);
// Values of an option; throw InputError for those of another kind. Numbers may
// be texts, as flags have them.
double Number(const Json& value, const std::string& place);
std::uint64_t Whole(const Json& value, const std::string& place);
std::string Text(const Json& value, const std::string& place);
bool Truth(const Json& value, const std::string& place);
// "a=1,b", a list of such texts, or a dict of names and values (or null).
std::vector<NamedValue> Assignments(const Json& value,
                                    const std::string& place);
std::vector<NamedValue> EffectValues(const Json& value,
                                     const std::string& place);
// A text as Python writes it.
std::string Quoted(const std::string& text);

}  // namespace sysid::python
