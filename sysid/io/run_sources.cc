#include "sysid/io/run_sources.h"

#include <algorithm>

#include "models/error.h"
#include "sysid/io/suggest_columns.h"

namespace sysid {
namespace {

// The map first, then the columns that have our names.
void FindSources(const TableFile& file, const ColumnMap& map,
                 const Mechanism& mechanism, RunSources* in) {
  const std::vector<std::string>& header = file.header();
  in->sources = ResolveColumns(map, header, file.path(), mechanism);
  const std::vector<std::string> names = RunColumnNames(mechanism);
  for (size_t i = 0; i < header.size(); ++i) {
    const bool ours =
        std::find(names.begin(), names.end(), header[i]) != names.end();
    if (!ours || in->Find(header[i]) >= 0) continue;
    ColumnSource source;
    source.name = header[i];
    source.expression = Expression::OfColumn(static_cast<int>(i));
    source.text = header[i];
    in->sources.push_back(source);
  }
  if (in->Find("t") < 0) {
    throw InputError(file.HeaderPlace(0), "there is no time column 't'",
                     TimeHint(mechanism, header, map));
  }
}

void FindGroups(const TableFile& file, const ColumnMap& map,
                const Mechanism& mechanism, RunSources* in) {
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    RunSources::Group found{group, {}};
    std::string missing;
    int present = -1;
    for (const std::string& column : group.columns) {
      found.sources.push_back(in->Find(column));
      if (found.sources.back() >= 0) {
        present = found.sources.back();
      } else if (missing.empty()) {
        missing = column;
      }
    }
    if (present < 0) continue;
    if (!missing.empty()) {
      throw InputError(file.HeaderPlace(in->sources[present].column()),
                       "there is " + in->sources[present].Describe() +
                           ", but no column '" + missing + "'",
                       "the columns " + Join(group.columns) +
                           " belong together: give all or none");
    }
    (group.is_effort ? in->efforts : in->channels).push_back(found);
  }
  if (!in->channels.empty()) return;
  throw InputError(file.HeaderPlace(0),
                   "no column measures anything of " +
                       (mechanism.name.empty() ? "the model" : mechanism.name),
                   MeasuredHint(mechanism, file.header(),
                                in->sources[in->Find("t")].column(), map));
}

// The joints that no column measures; and of several, where others are driven,
// those without an effort. "" where there are none.
std::string JointsWithoutColumns(const Mechanism& mechanism,
                                 const RunSources& in) {
  std::vector<std::string> still, free;
  const auto has = [&](const std::vector<RunSources::Group>& groups, int j) {
    return std::any_of(groups.begin(), groups.end(), [&](const auto& found) {
      return found.group.kind != ChannelKind::kFramePosition &&
             found.group.target == j;
    });
  };
  for (int j = 0; j < static_cast<int>(mechanism.joints.size()); ++j) {
    if (mechanism.joints[j].type == JointType::kFixed) continue;
    if (!has(in.channels, j)) still.push_back(mechanism.joints[j].name);
    if (!in.efforts.empty() && !has(in.efforts, j)) {
      free.push_back(mechanism.joints[j].name);
    }
  }
  std::vector<std::string> parts;
  if (!still.empty()) parts.push_back("no column measures " + Join(still));
  if (!free.empty()) parts.push_back("no column has an effort of " + Join(free));
  return Join(parts, ", and ");
}

std::string IgnoredColumns(const std::vector<std::string>& header,
                           const Mechanism& mechanism, const RunSources& in) {
  const std::vector<std::string> names = RunColumnNames(mechanism);
  std::vector<std::string> ignored;
  for (size_t i = 0; i < header.size(); ++i) {
    const bool used = std::any_of(
        in.sources.begin(), in.sources.end(), [&](const ColumnSource& source) {
          const std::vector<int>& columns = source.expression.columns();
          return std::find(columns.begin(), columns.end(),
                           static_cast<int>(i)) != columns.end();
        });
    if (used || header[i].empty() || header[i] == "t") continue;
    std::string text = header[i];
    if (in.Find(header[i]) >= 0) {
      text += " (mapped from another column)";
    } else if (HasRunColumnSuffix(header[i])) {
      const ColumnNameFault fault = ExplainUnknownColumn(header[i], mechanism);
      text += " (" + fault.what + "; " + fault.hint + ")";
    }
    ignored.push_back(text);
  }
  if (ignored.empty()) return "";
  constexpr size_t kMostNames = 24;
  const size_t more = ignored.size() - std::min(ignored.size(), kMostNames);
  if (more > 0) {
    ignored.resize(kMostNames);
    ignored.push_back("and " + std::to_string(more) + " more");
  }
  return (ignored.size() == 1 ? "ignored the column "
                              : "ignored the columns ") +
         Join(ignored);
}

}  // namespace

int RunSources::Find(const std::string& name) const {
  for (size_t i = 0; i < sources.size(); ++i) {
    if (sources[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

RunSources FindRunSources(const TableFile& file, const ColumnMap& map,
                          const Mechanism& mechanism, std::string* ignored,
                          std::string* without) {
  RunSources in;
  FindSources(file, map, mechanism, &in);
  FindGroups(file, map, mechanism, &in);
  *ignored = IgnoredColumns(file.header(), mechanism, in);
  *without = ignored->empty() ? "" : JointsWithoutColumns(mechanism, in);
  return in;
}

}  // namespace sysid
