#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>

#include "models/error.h"
#include "models/find_model.h"
#include "models/parameters.h"
#include "models/urdf/load_urdf.h"
#include "python/native/functions.h"
#include "sysid/checks/model_findings.h"
#include "sysid/io/cell.h"
#include "sysid/io/column_map.h"
#include "sysid/io/read_run.h"
#include "sysid/io/run_columns.h"
#include "sysid/io/write_run.h"
#include "sysid/session/session.h"

namespace sysid::python {
namespace {

// Whether runs of the one are runs of the other.
bool HaveSameColumns(const Mechanism& a, const Mechanism& b) {
  const auto same = [](const Joint& x, const Joint& y) {
    return x.name == y.name && x.type == y.type && x.v_index == y.v_index &&
           x.held.has_value() == y.held.has_value() &&
           x.mimic.has_value() == y.mimic.has_value();
  };
  const auto same_name = [](const Link& x, const Link& y) {
    return x.name == y.name;
  };
  return std::equal(a.joints.begin(), a.joints.end(), b.joints.begin(),
                    b.joints.end(), same) &&
         std::equal(a.links.begin(), a.links.end(), b.links.begin(),
                    b.links.end(), same_name);
}

std::unique_ptr<TableFile> TableOf(const TableView& view) {
  return std::make_unique<MemoryTable>(view.name, view.rows, view.columns);
}

// The mechanism with the inputs that a table of these columns has: words of
// their own, which effects may read.
Mechanism WithInputs(Mechanism mechanism, const ColumnMap& columns,
                     const std::vector<std::string>& header) {
  std::vector<std::string> inputs = OwnInputs(columns, mechanism);
  for (const std::string& name : header) {
    if (columns.empty() && IsOwnInput(name, mechanism)) inputs.push_back(name);
  }
  for (std::string& input : inputs) {
    if (std::find(mechanism.inputs.begin(), mechanism.inputs.end(), input) ==
        mechanism.inputs.end()) {
      mechanism.inputs.push_back(std::move(input));
    }
  }
  return mechanism;
}

Run ReadOpen(std::unique_ptr<TableFile> table, const ColumnMap& columns,
             const Mechanism& mechanism, std::vector<std::string>* notices) {
  const Mechanism with = WithInputs(mechanism, columns, table->header());
  return ReadTable(std::move(table), columns, with, notices);
}

}  // namespace

const ModelHandle& ModelIn(const Call& call, const Json& json) {
  const Result& object = *call.objects.at(json.at("object"));
  if (object.model == nullptr) throw std::logic_error("no model");
  return *object.model;
}

std::vector<NamedArray> ArraysOf(const Mechanism& mechanism, const Run& run) {
  const auto column = [](const std::string& name, const auto& values) {
    return NamedArray{name, RowMatrixXd(values)};
  };
  const auto vector = [](const std::vector<double>& values) {
    return Eigen::Map<const Eigen::VectorXd>(values.data(), values.size());
  };
  std::vector<NamedArray> arrays{column("t", vector(run.t))};
  for (const ColumnOfRun& of : ColumnsOfRun(mechanism, run)) {
    arrays.push_back(column(of.name, of.values->col(of.slot)));
  }
  for (const Input& input : run.inputs) {
    arrays.push_back(column(input.name, vector(input.values)));
  }
  return arrays;
}

Result ResultOf(std::shared_ptr<const RunHandle> run) {
  Result result;
  result.text = Compact({{"name", run->run.name}, {"notices", run->notices}});
  result.arrays = ArraysOf(run->mechanism, run->run);
  result.run = std::move(run);
  return result;
}

void CheckNames(const TableView& table, const Mechanism& mechanism) {
  const std::vector<std::string> known = RunColumnNames(mechanism);
  const std::vector<std::string> followers = FollowerColumnNames(mechanism);
  for (const MemoryTable::Column& column : table.columns) {
    const std::string& name = column.name;
    if (!HasRunColumnSuffix(name) || Contains(known, name) ||
        Contains(followers, name)) {
      continue;
    }
    const ColumnNameFault fault = ExplainUnknownColumn(name, mechanism);
    throw InputError(table.name + ", " + name, fault.what, fault.hint);
  }
}

Run RunIn(const Call& call, const Json& json, const Mechanism& mechanism,
          const ColumnMap& columns, std::vector<std::string>* notices) {
  if (json.contains("table")) {
    return ReadOpen(TableOf(call.tables.at(json["table"])), columns, mechanism,
                    notices);
  }
  const std::shared_ptr<const RunHandle>& handle =
      call.objects.at(json.at("object"))->run;
  if (handle == nullptr) throw std::logic_error("no run");
  if (HaveSameColumns(handle->mechanism, mechanism)) {
    notices->insert(notices->end(), handle->notices.begin(),
                    handle->notices.end());
    return handle->run;
  }
  // Of another model: by the names of its columns.
  const std::vector<NamedArray> arrays =
      ArraysOf(handle->mechanism, handle->run);
  TableView view{handle->run.name, handle->run.t.size(), {}};
  for (const NamedArray& array : arrays) {
    view.columns.push_back({array.name, array.values.data(), 1});
  }
  return ReadOpen(TableOf(view), columns, mechanism, notices);
}

Result DescribeModel(std::shared_ptr<const ModelHandle> handle,
                     const Model& model, std::vector<std::string> notices) {
  const auto joint = [](const Joint& of) -> Json {
    const bool slides = of.type == JointType::kPrismatic;
    return {{"name", of.name},
            {"type", ToString(of.type)},
            {"unit", slides ? "m" : "rad"},
            {"effort_unit", slides ? "N" : "N m"}};
  };
  std::vector<Joint> moving = model.mechanism().joints;
  std::erase_if(moving, [](const Joint& j) { return VelocitySize(j) == 0; });
  std::vector<std::string> links;
  for (const Link& link : model.mechanism().links) links.push_back(link.name);
  Json parameters = Json::object();
  for (const Parameter& parameter : AllParameters(model)) {
    parameters[parameter.name] = {{"value", Finite(parameter.nominal)},
                                  {"unit", parameter.unit}};
  }
  Result result;
  result.text = Compact({{"name", model.mechanism().name},
                         {"joints", List(moving, joint)},
                         {"links", links},
                         {"parameters", parameters},
                         {"effects", model.effects().names()},
                         {"columns", RunColumnNames(model.mechanism())},
                         {"notices", notices}});
  result.model = std::move(handle);
  return result;
}

Result LoadModel(const Call& call) {
  const std::string name = call.request.at("name");
  std::vector<NamedValue> locks;
  std::vector<std::string> notices;
  std::string file;
  const Catalogue catalogue;
  const Model model = OpenModel(name, catalogue, &locks, &file, &notices);
  for (const Finding& finding : ModelFindings(model, file)) {
    notices.push_back(BriefText(finding));
  }
  return DescribeModel(std::make_shared<const ModelHandle>(
                           ModelHandle{name, nullptr, model.mechanism()}),
                       model, notices);
}

Result ReadRecording(const Call& call) {
  FitRequest request;
  std::vector<std::string> notices = call.request.at("notices");
  Call options = call;
  options.request["runs"] = Json::array();
  options.request["holdout"] = Json::array();
  FillRequest(options, {}, &request, &notices);
  const ModelHandle& model = ModelIn(call, call.request.at("model"));
  // The columns that a specification beside the model maps hold for its files.
  const Json& run = call.request.at("run");
  ColumnMap columns = request.columns;
  if (run.contains("file")) {
    request.traj = {run["file"]};
    request.may_free_nothing = request.any_solver = true;
    columns = OpenModelSession(request, Catalogue()).columns;
  }
  const Mechanism mechanism = WithInputs(model.mechanism, columns, {});
  RunHandle handle{run.contains("file")
                       ? ReadRun(request.traj[0], columns, mechanism, &notices)
                       : RunIn(call, run, mechanism, columns, &notices),
                   model.mechanism, notices};
  return ResultOf(std::make_shared<const RunHandle>(std::move(handle)));
}

}  // namespace sysid::python
