#include "sysid/io/read_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "models/error.h"
#include "sysid/io/csv.h"
#include "sysid/io/degrees.h"
#include "sysid/io/run_columns.h"
#include "sysid/io/suggest_columns.h"

namespace sysid {
namespace {

// Reads one file: what its columns mean, then what the numbers say.
class RunReader {
 public:
  RunReader(const CsvFile& file, const ColumnMap& map,
            const Mechanism& mechanism, std::vector<std::string>* notices)
      : file_(file), map_(map), mechanism_(mechanism), notices_(notices) {
    CheckHeader();
    FindSources();
    FindGroups();
    NoteUnknownColumns();
  }

  Run Read();

 private:
  // A group of the mechanism's that the file has, by index into sources_.
  struct Found {
    ColumnGroup group;
    std::vector<int> sources;
  };

  void CheckHeader() const;
  void FindSources();
  void FindGroups();
  void NoteUnknownColumns();
  int FindSource(const std::string& name) const;

  void ReadTime(Run* run) const;
  Channel ReadChannel(const Found& found) const;
  void ReadEffort(const Found& found, RowMatrixXd* effort);
  void NormalizeOrientation(const Found& found, Channel* channel) const;
  void CheckDegrees(const Run& run);

  // Our value in a row, NaN where it is missing.
  double Value(int source, int row) const {
    const ColumnSource& s = sources_[source];
    return s.factor * table_.columns[source][row] + s.offset;
  }
  std::string Place(int source, int row) const {
    return file_.Place(table_.lines[row], sources_[source].column);
  }
  // "column 'pos1' (joint1.q)".
  std::string Describe(int source) const;
  void Notice(const std::string& text) const {
    if (notices_ != nullptr) notices_->push_back(file_.path() + ": " + text);
  }

  const CsvFile& file_;
  const ColumnMap& map_;
  const Mechanism& mechanism_;
  std::vector<std::string>* notices_;
  std::vector<ColumnSource> sources_;
  std::vector<Found> channels_;
  std::vector<Found> efforts_;
  CsvFile::Table table_;
};

void RunReader::CheckHeader() const {
  const std::vector<std::string>& header = file_.header();
  if (file_.HeaderIsNumbers()) {
    const std::vector<std::string> names = RunColumnNames(mechanism_);
    std::string hint = "put a row of names before it, such as t," +
                       (names.size() > 1 ? names[1] : "joint1.q");
    const std::string& comment = file_.last_comment();
    if (std::count(comment.begin(), comment.end(), ',') + 1 ==
            static_cast<int>(header.size()) &&
        header.size() > 1) {
      hint = "the comment " + Shown(comment) +
             " reads like the header: take its '#' away";
    }
    throw InputError(file_.HeaderPlace(0),
                     "there is no header: the first row is numbers (" +
                         Shown(header[0]) +
                         (header.size() > 1 ? ", ...)" : ")"),
                     hint);
  }
  for (const char separator : {';', '\t'}) {
    if (header.size() > 1 || header[0].find(separator) == std::string::npos) {
      continue;
    }
    throw InputError(file_.HeaderPlace(0),
                     std::string("the columns are separated by ") +
                         (separator == ';' ? "semicolons" : "tabs") +
                         ", not by commas",
                     "save it with commas between the columns and points in "
                     "the numbers");
  }
}

int RunReader::FindSource(const std::string& name) const {
  for (size_t i = 0; i < sources_.size(); ++i) {
    if (sources_[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

std::string RunReader::Describe(int source) const {
  const std::string& column = file_.header()[sources_[source].column];
  const std::string& name = sources_[source].name;
  return "column " + Shown(column) + (column == name ? "" : " (" + name + ")");
}

// The map first, then the columns that have our names.
void RunReader::FindSources() {
  const std::vector<std::string>& header = file_.header();
  sources_ = ResolveColumns(map_, header, file_.path(), mechanism_);
  const std::vector<std::string> names = RunColumnNames(mechanism_);
  for (size_t i = 0; i < header.size(); ++i) {
    const bool ours =
        std::find(names.begin(), names.end(), header[i]) != names.end();
    if (!ours || FindSource(header[i]) >= 0) continue;
    ColumnSource source;
    source.name = header[i];
    source.column = static_cast<int>(i);
    sources_.push_back(source);
  }
  if (FindSource("t") < 0) {
    throw InputError(file_.HeaderPlace(0), "there is no time column 't'",
                     TimeHint(mechanism_, header, map_));
  }
}

void RunReader::FindGroups() {
  for (const ColumnGroup& group : RunColumnGroups(mechanism_)) {
    Found found{group, {}};
    std::string missing;
    int present = -1;
    for (const std::string& column : group.columns) {
      found.sources.push_back(FindSource(column));
      if (found.sources.back() >= 0) {
        present = found.sources.back();
      } else if (missing.empty()) {
        missing = column;
      }
    }
    if (present < 0) continue;
    if (!missing.empty()) {
      throw InputError(
          file_.HeaderPlace(sources_[present].column),
          "there is " + Describe(present) + ", but no column '" + missing + "'",
          "the columns " + Join(group.columns) +
              " belong together: give all or none");
    }
    (group.is_effort ? efforts_ : channels_).push_back(found);
  }
  if (!channels_.empty()) return;
  throw InputError(
      file_.HeaderPlace(0),
      "no column measures anything of " +
          (mechanism_.name.empty() ? "the model" : mechanism_.name),
      MeasuredHint(mechanism_, file_.header(), sources_[FindSource("t")].column,
                   map_));
}

void RunReader::NoteUnknownColumns() {
  const std::vector<std::string>& header = file_.header();
  const std::vector<std::string> names = RunColumnNames(mechanism_);
  std::vector<std::string> ignored;
  for (size_t i = 0; i < header.size(); ++i) {
    const bool used = std::any_of(sources_.begin(), sources_.end(),
                                  [&](const ColumnSource& source) {
                                    return source.column == static_cast<int>(i);
                                  });
    if (used || header[i].empty() || header[i] == "t") continue;
    std::string text = header[i];
    if (FindSource(header[i]) >= 0) {
      text += " (mapped from another column)";
    } else if (HasRunColumnSuffix(header[i])) {
      const ColumnNameFault fault = ExplainUnknownColumn(header[i], mechanism_);
      text += " (" + fault.what + "; " + fault.hint + ")";
    }
    ignored.push_back(text);
  }
  if (ignored.empty()) return;
  Notice(
      (ignored.size() == 1 ? "ignored the column " : "ignored the columns ") +
      Join(ignored));
}

void RunReader::ReadTime(Run* run) const {
  const int time = FindSource("t");
  for (int row = 0; row < table_.rows(); ++row) {
    const double t = Value(time, row);
    if (std::isnan(t)) {
      throw InputError(Place(time, row), "no time in " + Describe(time),
                       "every row needs its time: fill it in, or remove the "
                       "row");
    }
    if (row > 0 && t <= run->t.back()) {
      const std::string before = ShortestText(run->t.back());
      const std::string at =
          " (line " + std::to_string(table_.lines[row - 1]) + ")";
      throw InputError(
          Place(time, row),
          t == run->t.back() ? "time repeats: " + before + " s again" + at
                             : "time goes back: from " + before + " s" + at +
                                   " to " + ShortestText(t) + " s",
          "rows must be in the order of time; are two recordings in one file, "
          "or is the time rounded?");
    }
    run->t.push_back(t);
  }
  if (run->size() < 2) {
    throw InputError(file_.HeaderPlace(0),
                     run->t.empty() ? "there is a header but no row of data"
                                    : "there is only one row of data",
                     "a run needs at least two samples");
  }
}

Channel RunReader::ReadChannel(const Found& found) const {
  const ColumnGroup& group = found.group;
  Channel channel;
  channel.kind = group.kind;
  channel.target = group.target;
  channel.name = group.name;
  channel.values.resize(table_.rows(), group.columns.size());
  bool any = false;
  for (int row = 0; row < table_.rows(); ++row) {
    for (size_t i = 0; i < group.columns.size(); ++i) {
      channel.values(row, group.slots[i]) = Value(found.sources[i], row);
    }
    if (channel.values.row(row).hasNaN()) {
      channel.values.row(row).setConstant(
          std::numeric_limits<double>::quiet_NaN());
    } else {
      any = true;
    }
  }
  if (!any) {
    throw InputError(file_.HeaderPlace(sources_[found.sources[0]].column),
                     "nothing was measured in " + Join(group.columns) +
                         (group.columns.size() == 1
                              ? ": every cell is empty or nan"
                              : ": every row has a cell that is empty or nan"),
                     "remove the column where the quantity was not measured");
  }
  if (group.kind == ChannelKind::kOrientation) {
    NormalizeOrientation(found, &channel);
  }
  return channel;
}

void RunReader::NormalizeOrientation(const Found& found,
                                     Channel* channel) const {
  constexpr double kRounding = 0.01;
  for (int row = 0; row < table_.rows(); ++row) {
    const double norm = channel->values.row(row).norm();
    if (std::isnan(norm)) continue;
    if (std::abs(norm - 1.0) > kRounding) {
      throw InputError(
          Place(found.sources[0], row),
          "the quaternion " + Join(found.group.columns) + " has norm " +
              ShortestText(std::round(norm * 1e6) * 1e-6) + ", not 1",
          "its columns are w, x, y, z of a unit quaternion; leave them empty "
          "where nothing was measured");
    }
    channel->values.row(row) /= norm;
  }
}

void RunReader::ReadEffort(const Found& found, RowMatrixXd* effort) {
  const ColumnGroup& group = found.group;
  const int first = mechanism_.joints[group.target].v_index;
  int held = 0;
  int leading = 0;
  for (int row = 0; row < table_.rows(); ++row) {
    bool missing = false;
    for (const int source : found.sources) {
      missing = missing || std::isnan(Value(source, row));
    }
    if (missing) {
      if (held == row) ++leading;
      ++held;
    }
    for (size_t i = 0; i < group.columns.size(); ++i) {
      const int v = first + group.slots[i];
      if (!missing) {
        (*effort)(row, v) = Value(found.sources[i], row);
      } else if (row > 0) {
        (*effort)(row, v) = (*effort)(row - 1, v);
      }
    }
  }
  if (held == table_.rows()) {
    throw InputError(
        file_.HeaderPlace(sources_[found.sources[0]].column),
        "nothing was measured in " + Join(group.columns) + ": every " +
            (group.columns.size() == 1 ? "cell" : "row") + " is empty or nan",
        "remove the column where the quantity was not measured");
  }
  if (held == 0) return;
  Notice(std::to_string(held) + " of " + std::to_string(table_.rows()) +
         " efforts in " + Join(group.columns) +
         " are missing: each holds the value before it" +
         (leading == 0 ? ""
                       : "; the first " + std::to_string(leading) +
                             " are taken as zero"));
}

void RunReader::CheckDegrees(const Run& run) {
  const auto column = [](const Channel& channel) {
    return std::vector<double>(channel.values.data(),
                               channel.values.data() + channel.values.size());
  };
  for (size_t i = 0; i < run.channels.size(); ++i) {
    const Channel& position = run.channels[i];
    if (position.kind != ChannelKind::kPosition) continue;
    // The velocity stands behind its position.
    const bool has_velocity =
        i + 1 < run.channels.size() &&
        run.channels[i + 1].kind == ChannelKind::kVelocity &&
        run.channels[i + 1].target == position.target;
    const Joint& joint = mechanism_.joints[position.target];
    const DegreesReport report = LookForDegrees(
        joint, run.t, column(position),
        has_velocity ? column(run.channels[i + 1]) : std::vector<double>());
    if (report.verdict == DegreesVerdict::kNo) continue;
    const bool velocity = report.verdict == DegreesVerdict::kVelocity;
    const int source = channels_[velocity ? i + 1 : i].sources[0];
    if (sources_[source].has_factor) continue;
    const std::string& name = sources_[source].name;
    const std::string& from = file_.header()[sources_[source].column];
    if (report.verdict == DegreesVerdict::kPerhaps) {
      Notice(Describe(source) + " may be in degrees: " + report.reason +
             "; if so: " + DegreesFlag(name, from, map_));
      continue;
    }
    throw InputError(file_.HeaderPlace(sources_[source].column),
                     Describe(source) + " looks like degrees" +
                         (velocity ? " per second" : "") +
                         ", not radians: " + report.reason,
                     DegreesHint(name, from, map_));
  }
}

Run RunReader::Read() {
  std::vector<int> wanted;
  for (const ColumnSource& source : sources_) wanted.push_back(source.column);
  table_ = file_.ReadColumns(wanted);
  Run run;
  run.name = file_.path();
  ReadTime(&run);
  for (const Found& found : channels_) {
    run.channels.push_back(ReadChannel(found));
  }
  run.effort = RowMatrixXd::Zero(run.size(), mechanism_.nv);
  for (const Found& found : efforts_) ReadEffort(found, &run.effort);
  CheckDegrees(run);
  return run;
}

}  // namespace

Run ReadRun(const std::string& path, const ColumnMap& columns,
            const Mechanism& mechanism, std::vector<std::string>* notices) {
  const CsvFile file(path);
  return RunReader(file, columns, mechanism, notices).Read();
}

Run ParseRun(const std::string& path, const std::string& text,
             const ColumnMap& columns, const Mechanism& mechanism,
             std::vector<std::string>* notices) {
  const CsvFile file(path, text);
  return RunReader(file, columns, mechanism, notices).Read();
}

}  // namespace sysid
