#include "sysid/report/export_files.h"

#include <algorithm>
#include <cmath>

#include "sysid/estimation/shooting_problem.h"
#include "sysid/exports/arrival.h"
#include "sysid/exports/write_mjcf.h"
#include "sysid/exports/write_sdf.h"
#include "sysid/io/cell.h"
#include "sysid/report/fit_report.h"
#include "sysid/report/json.h"

namespace sysid {
namespace {

bool IsBeyond(const Joint& joint, const Channel& channel) {
  constexpr double kMargin = 1e-3;  // rad or m: noise of a sensor at the stop
  for (int k = 0; k < channel.values.rows(); ++k) {
    const double q = channel.values(k, 0);
    if (std::isfinite(q) &&
        (q < joint.lower - kMargin || q > joint.upper + kMargin)) {
      return true;
    }
  }
  return false;
}

ExportData DataOf(const ShootingProblem& problem, const Model& model) {
  ExportData data;
  const auto& joints = model.mechanism().joints;
  const auto add = [](const std::string& name,
                      std::vector<std::string>* names) {
    if (!Contains(*names, name)) names->push_back(name);
  };
  for (const auto& shared : problem.runs()) {
    const Run& run = shared->run;
    for (const Joint& joint : joints) {
      const int nv = VelocitySize(joint);
      if (nv > 0 && HasEffort(run, joint.v_index, nv)) {
        add(joint.name, &data.driven);
      }
    }
    for (const Channel& channel : run.channels) {
      if (!IsScalarPosition(channel.kind)) continue;
      const Joint& joint = joints[channel.target];
      if (joint.has_limits && IsBeyond(joint, channel)) {
        add(joint.name, &data.beyond_limits);
      }
    }
  }
  return data;
}

const char* WordOf(Arrival arrival) {
  switch (arrival) {
    case Arrival::kArrived:
      return "arrived";
    case Arrival::kPartly:
      return "partly";
    default:
      return "lost";
  }
}

Json TextOrNull(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json RowsJson(const std::vector<ArrivalRow>& rows) {
  Json list = Json::array();
  for (const ArrivalRow& row : rows) {
    list.push_back({{"name", row.name},
                    {"effect", TextOrNull(row.effect)},
                    {"value", Finite(row.value)},
                    {"unit", row.unit},
                    {"arrival", WordOf(row.arrival)},
                    {"where", TextOrNull(row.where)},
                    {"remark", TextOrNull(row.remark)}});
  }
  return list;
}

// What a format leaves out, a line each, for the file's comments.
std::vector<std::string> Comments(const Session& session,
                                  const std::vector<ArrivalRow>& rows) {
  std::vector<std::string> lines{"identified from " + session.model_name +
                                 "; export.json says what arrived"};
  for (const ArrivalRow& row : rows) {
    if (row.arrival == Arrival::kArrived) continue;
    lines.push_back(std::string(WordOf(row.arrival)) + ": " + row.name + " = " +
                    ShortestText(row.value) + " " + row.unit + " (" +
                    row.remark + ")");
  }
  return lines;
}

struct Exported {
  std::string file;
  ExportFormat format;
  std::vector<ArrivalRow> rows;
  ExportText text;
};

Json FileJson(const Exported& of) {
  const bool written = of.text.why_not.empty();
  Json lost = Json::array();
  for (const ArrivalRow& row : of.rows) {
    if (row.arrival == Arrival::kLost) lost.push_back(row.name);
  }
  return {{"file", of.file},
          {"format", ToString(of.format)},
          {"written", written},
          {"why_not", TextOrNull(of.text.why_not)},
          {"parameters", written ? RowsJson(of.rows) : Json::array()},
          {"lost", written ? lost : Json::array()},
          {"notes", of.text.notes}};
}

}  // namespace

std::vector<NamedText> ExportFiles(const PageFit& fit) {
  const Session& session = *fit.session;
  const Model& model = fit.fit->model;
  const ExportData data = DataOf(*fit.problem, model);
  std::vector<std::string> fitted;
  for (const ParameterEstimate& p : fit.fit->parameters) {
    fitted.push_back(p.name);
  }
  std::vector<Exported> all;
  const auto add = [&](const std::string& file, ExportFormat format,
                       const auto& write) {
    Exported of{file, format, ArrivalRows(model, format, fitted), {}};
    of.text = write(Comments(session, of.rows));
    all.push_back(std::move(of));
  };
  add("identified.urdf", ExportFormat::kUrdf,
      [](const std::vector<std::string>&) { return ExportText{}; });
  const std::string geometry =
      "bodies have no geometry: visuals and collisions stay in the URDF";
  add("identified.xml", ExportFormat::kMjcf,
      [&](const std::vector<std::string>& comments) {
        ExportText text = WriteMjcf(model, data, comments);
        text.notes.push_back(geometry);
        return text;
      });
  add("identified.sdf", ExportFormat::kSdf,
      [&](const std::vector<std::string>& comments) {
        ExportText text = WriteSdf(model, data, comments);
        text.notes.push_back(geometry);
        return text;
      });
  std::vector<NamedText> files;
  Json list = Json::array();
  for (const Exported& of : all) {
    list.push_back(FileJson(of));
    if (!of.text.text.empty()) files.push_back({of.file, of.text.text});
  }
  files.push_back({"export.json", Dump({{"schema", "sysid.export/1"},
                                        {"model", session.model_name},
                                        {"files", list}})});
  return files;
}

std::vector<NamedText> FilesBeside(const PageFit& fit) {
  std::vector<NamedText> files;
  for (const ForceTableFile& file : ForceTableFiles(fit.fit->model)) {
    files.push_back({file.name, file.text});
  }
  for (NamedText& file : ExportFiles(fit)) files.push_back(std::move(file));
  return files;
}

}  // namespace sysid
