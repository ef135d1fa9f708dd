#include "sysid/io/run_sources.h"

#include <algorithm>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/suggest_columns.h"

namespace sysid {
namespace {

// The map first, then the columns that have our names.
void FindSources(const TableFile& file, const ColumnMap& map,
                 const Mechanism& mechanism, RunSources* in) {
  const std::vector<std::string>& header = file.header();
  in->sources = ResolveColumns(map, header, file.path(), mechanism);
  std::vector<std::string> names = RunColumnNames(mechanism);
  for (std::string& name : HeldColumnNames(mechanism)) {
    names.push_back(std::move(name));
  }
  for (std::string& name : FollowerColumnNames(mechanism)) {
    names.push_back(std::move(name));
  }
  for (size_t i = 0; i < header.size(); ++i) {
    if (!Contains(names, header[i]) || in->Find(header[i]) >= 0) continue;
    ColumnSource source;
    source.name = header[i];
    source.expression = Expression::OfColumn(static_cast<int>(i));
    source.text = header[i];
    in->sources.push_back(source);
  }
  if (in->Find("t") < 0) {
    throw UnnamedColumns(file.HeaderPlace(0),
                         file.no_header().empty()
                             ? "there is no time column 't'"
                             : file.no_header(),
                         SuggestWithTime(mechanism, header, map), map);
  }
}

// The efforts of the joints that follow this one.
std::vector<std::pair<int, double>> AddedEfforts(const Mechanism& mechanism,
                                                 const ColumnGroup& group,
                                                 const RunSources& in) {
  std::vector<std::pair<int, double>> added;
  for (const FollowerEffort& effort : FollowerEfforts(mechanism)) {
    const int source = in.Find(effort.column);
    if (effort.leader == group.target && source >= 0) {
      added.emplace_back(source, effort.multiplier);
    }
  }
  return added;
}

void FindGroups(const TableFile& file, const ColumnMap& map,
                const Mechanism& mechanism, RunContent content,
                RunSources* in) {
  std::vector<std::string> efforts;
  const auto is_frame = [](const ColumnGroup& group) {
    return !group.is_effort && group.kind == ChannelKind::kFramePosition;
  };
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    RunSources::Group found{group, {}, {}};
    if (group.is_effort) efforts.push_back(group.columns.front());
    std::string missing;
    int present = -1;
    for (size_t i = 0; i < group.columns.size(); ++i) {
      const int source = in->Find(group.columns[i]);
      if (source >= 0) {
        present = source;
        found.sources.push_back(source);
        if (is_frame(group)) found.axes.push_back(static_cast<int>(i));
      } else if (missing.empty()) {
        missing = group.columns[i];
      }
    }
    if (group.is_effort) found.added = AddedEfforts(mechanism, group, *in);
    if (present < 0 && found.added.empty()) continue;
    found.group = AlongAxes(group, found.axes);
    // A camera sees a frame in a plane.
    if (present >= 0 && !missing.empty() && !is_frame(group)) {
      throw InputError(file.HeaderPlace(in->sources[present].column()),
                       "there is " + in->sources[present].Describe() +
                           ", but no column '" + missing + "'",
                       "the columns " + Join(group.columns) +
                           " belong together: give all or none");
    }
    (group.is_effort ? in->efforts : in->channels).push_back(found);
  }
  const std::string model =
      mechanism.name.empty() ? "the model" : mechanism.name;
  if (content == RunContent::kEfforts) {
    if (!in->efforts.empty()) return;
    throw InputError(file.HeaderPlace(0), "no column is an effort of " + model,
                     "its columns are t and any of " + JoinSome(efforts));
  }
  if (content == RunContent::kInputs || !in->channels.empty()) return;
  throw UnnamedColumns(
      file.HeaderPlace(0), "no column measures anything of " + model,
      SuggestMeasured(mechanism, file.header(),
                      in->sources[in->Find("t")].column(), map),
      map);
}

// What effects may read.
void FindInputs(const Mechanism& mechanism, RunSources* in) {
  const auto is_channel = [&](const std::string& name) {
    return std::any_of(
        in->channels.begin(), in->channels.end(),
        [&](const auto& found) { return Contains(found.group.columns, name); });
  };
  for (const InputColumn& column : InputColumns(mechanism)) {
    const int source = in->Find(column.name);
    if (source >= 0 && !is_channel(column.name)) {
      in->inputs.push_back({column, source});
    }
  }
}

// The columns of joints that are held still.
void FindHeld(const Mechanism& mechanism, RunSources* in) {
  for (const ColumnGroup& group : HeldColumnGroups(mechanism)) {
    RunSources::Group found{group, {}, {}};
    for (const std::string& column : group.columns) {
      const int source = in->Find(column);
      if (source >= 0) found.sources.push_back(source);
    }
    if (!found.sources.empty()) in->held.push_back(found);
  }
}

// The joints whose position or effort is not read, and a column that would be
// it; "" where there are none. A file of frames' positions measures
// joints without their own columns.
std::string UnreadJoints(const Mechanism& mechanism, const RunSources& in,
                         std::string* column) {
  const auto has_target = [](const std::vector<RunSources::Group>& groups,
                             const ColumnGroup& wanted) {
    return std::any_of(groups.begin(), groups.end(), [&](const auto& found) {
      return found.group.kind == wanted.kind &&
             found.group.target == wanted.target;
    });
  };
  const bool has_frames = std::any_of(
      in.channels.begin(), in.channels.end(), [](const auto& found) {
        return found.group.kind == ChannelKind::kFramePosition;
      });
  std::vector<std::string> positions, efforts;
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    const bool is_position =
        !group.is_effort && (group.kind == ChannelKind::kPosition ||
                             group.kind == ChannelKind::kOrientation);
    const bool asked = group.is_effort || (is_position && !has_frames);
    if (!asked ||
        has_target(group.is_effort ? in.efforts : in.channels, group)) {
      continue;
    }
    (group.is_effort ? efforts : positions)
        .push_back(mechanism.joints[group.target].name);
    // Of a position rather than of an effort, which joints may do without.
    if (column->empty() || (is_position && positions.size() == 1)) {
      *column = group.columns.front();
    }
  }
  std::vector<std::string> parts;
  if (!positions.empty()) parts.push_back("the position of " + Join(positions));
  if (!efforts.empty()) parts.push_back("the effort of " + Join(efforts));
  return Join(parts, " or ");
}

bool IsOfHeldJoint(const std::string& column, const Mechanism& mechanism) {
  const int joint = mechanism.FindJoint(column.substr(0, column.rfind('.')));
  return joint >= 0 && mechanism.joints[joint].held.has_value();
}

std::string IgnoredColumns(const std::vector<std::string>& header,
                           const Mechanism& mechanism, RunContent content,
                           RunSources* sources) {
  const RunSources& in = *sources;
  std::vector<std::string> ignored;
  for (size_t i = 0; i < header.size(); ++i) {
    const bool used = std::any_of(
        in.sources.begin(), in.sources.end(), [&](const ColumnSource& source) {
          return Contains(source.expression.columns(), static_cast<int>(i));
        });
    if (used || header[i].empty() || header[i] == "t") continue;
    std::string text = header[i];
    if (in.Find(header[i]) >= 0) {
      text += " (mapped from another column)";
    } else if (IsOfHeldJoint(header[i], mechanism)) {
      text += " (its joint is held still)";
    } else if (HasRunColumnSuffix(header[i])) {
      const ColumnNameFault fault = ExplainUnknownColumn(header[i], mechanism);
      text += " (" + fault.what + "; " + fault.hint + ")";
    }
    ignored.push_back(text);
    sources->unread.push_back(header[i]);
  }
  if (ignored.empty()) return "";
  const std::string list =
      (ignored.size() == 1 ? "ignored the column " : "ignored the columns ") +
      JoinSome(ignored);
  if (content != RunContent::kMeasurements) return list;
  std::string column;
  const std::string unread = UnreadJoints(mechanism, in, &column);
  if (unread.empty()) return list;
  return "no column is read as " + unread + "; " + list + ": --columns " +
         column + "=COLUMN maps one";
}

}  // namespace

int RunSources::Find(const std::string& name) const {
  for (size_t i = 0; i < sources.size(); ++i) {
    if (sources[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

RunSources FindRunSources(const TableFile& file, const ColumnMap& map,
                          const Mechanism& mechanism, RunContent content,
                          std::string* ignored) {
  RunSources in;
  FindSources(file, map, mechanism, &in);
  FindGroups(file, map, mechanism, content, &in);
  FindInputs(mechanism, &in);
  if (content == RunContent::kInputs && in.inputs.empty()) {
    std::vector<std::string> names;
    for (const InputColumn& column : InputColumns(mechanism)) {
      names.push_back(column.name);
    }
    throw InputError(file.HeaderPlace(0), "no column is an input",
                     "inputs are any of " + JoinSome(names));
  }
  FindHeld(mechanism, &in);
  *ignored = IgnoredColumns(file.header(), mechanism, content, &in);
  return in;
}

}  // namespace sysid
