#include "sysid/io/read_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/csv.h"
#include "sysid/io/degrees.h"
#include "sysid/io/run_columns.h"
#include "sysid/io/suggest_columns.h"
#include "sysid/io/table_file.h"

namespace sysid {
namespace {

// Reads one file: what its columns mean, then its rows, each straight into the
// run, then what the numbers say.
class RunReader {
 public:
  RunReader(TableFile* file, const ColumnMap& map, const Mechanism& mechanism,
            std::vector<std::string>* notices)
      : file_(*file), map_(map), mechanism_(mechanism), notices_(notices) {
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

  void FindSources();
  void FindGroups();
  void NoteUnknownColumns();
  int FindSource(const std::string& name) const;

  void ReadRows(Run* run);
  void ReadRow(std::span<const double> cells, Run* run);
  void ReadTime(double t, Run* run) const;
  void Reserve(Run* run);
  double Value(int source, std::span<const double> cells) const;
  void CheckChannel(const Found& found, Channel* channel) const;
  void NormalizeOrientation(const Found& found, Channel* channel) const;
  void HoldEffort(const Found& found, RowMatrixXd* effort);
  void CheckDegrees(const Run& run);

  std::string Place(int source, int row) const {
    return file_.Place(row, sources_[source].column());
  }
  // "column 'pos1' (joint1.q)".
  std::string Describe(int source) const;
  void Notice(const std::string& text) const {
    if (notices_ != nullptr) notices_->push_back(file_.path() + ": " + text);
  }

  TableFile& file_;
  const ColumnMap& map_;
  const Mechanism& mechanism_;
  std::vector<std::string>* notices_;
  std::vector<ColumnSource> sources_;
  std::vector<Found> channels_;
  std::vector<Found> efforts_;
  // The columns that are asked for, and by source where its own are in them.
  std::vector<int> wanted_;
  std::vector<size_t> first_cell_;
};

int RunReader::FindSource(const std::string& name) const {
  for (size_t i = 0; i < sources_.size(); ++i) {
    if (sources_[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

std::string RunReader::Describe(int source) const {
  const ColumnSource& s = sources_[source];
  return (s.expression.is_column() ? "column " : "") + Shown(s.text) +
         (s.text == s.name ? "" : " (" + s.name + ")");
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
    source.expression = Expression::OfColumn(static_cast<int>(i));
    source.text = header[i];
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
          file_.HeaderPlace(sources_[present].column()),
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
      MeasuredHint(mechanism_, file_.header(),
                   sources_[FindSource("t")].column(), map_));
}

void RunReader::NoteUnknownColumns() {
  const std::vector<std::string>& header = file_.header();
  const std::vector<std::string> names = RunColumnNames(mechanism_);
  std::vector<std::string> ignored;
  for (size_t i = 0; i < header.size(); ++i) {
    const bool used = std::any_of(
        sources_.begin(), sources_.end(), [&](const ColumnSource& source) {
          const std::vector<int>& columns = source.expression.columns();
          return std::find(columns.begin(), columns.end(),
                           static_cast<int>(i)) != columns.end();
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
  constexpr size_t kMostNames = 24;
  const size_t more = ignored.size() - std::min(ignored.size(), kMostNames);
  if (more > 0) {
    ignored.resize(kMostNames);
    ignored.push_back("and " + std::to_string(more) + " more");
  }
  Notice(
      (ignored.size() == 1 ? "ignored the column " : "ignored the columns ") +
      Join(ignored));
}

// NaN where a cell of it is missing.
double RunReader::Value(int source, std::span<const double> cells) const {
  const Expression& expression = sources_[source].expression;
  const std::span<const double> own =
      cells.subspan(first_cell_[source], expression.columns().size());
  const double value = expression.Evaluate(own);
  if (std::isfinite(value)) return value;
  for (const double cell : own) {
    if (std::isnan(cell)) return value;
  }
  return std::numeric_limits<double>::infinity();
}

void RunReader::ReadTime(double t, Run* run) const {
  const int time = FindSource("t");
  const int row = run->size();
  if (std::isnan(t)) {
    throw InputError(Place(time, row), "no time in " + Describe(time),
                     "every row needs its time: fill it in, or remove the "
                     "row");
  }
  if (row > 0 && t <= run->t.back()) {
    const std::string before = ShortestText(run->t.back());
    const std::string at = " (" + file_.RowName(row - 1) + ")";
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

// Room for twice as many rows; to grow such blocks moves pages, not numbers,
// and pages that are not written to take no memory.
void RunReader::Reserve(Run* run) {
  const Eigen::Index rows = std::max<Eigen::Index>(64, 2 * run->effort.rows());
  for (Channel& channel : run->channels) {
    channel.values.conservativeResize(rows, channel.values.cols());
  }
  run->effort.conservativeResize(rows, run->effort.cols());
}

void RunReader::ReadRow(std::span<const double> cells, Run* run) {
  const int row = run->size();
  if (row == std::numeric_limits<int>::max()) {
    throw InputError(file_.path(), "more than " + std::to_string(row) + " rows",
                     "split it into several files");
  }
  if (row == run->effort.rows()) Reserve(run);
  const auto value = [&](int source) {
    const double number = Value(source, cells);
    if (std::isinf(number)) {
      throw InputError(Place(source, row),
                       Shown(sources_[source].text) + " (" +
                           sources_[source].name + ") is not finite here",
                       "is there a division by a column that is zero?");
    }
    return number;
  };
  ReadTime(value(FindSource("t")), run);
  for (size_t c = 0; c < channels_.size(); ++c) {
    const Found& found = channels_[c];
    auto into = run->channels[c].values.row(row);
    for (size_t i = 0; i < found.sources.size(); ++i) {
      into[found.group.slots[i]] = value(found.sources[i]);
    }
    if (into.hasNaN()) {
      into.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
  run->effort.row(row).setZero();
  for (const Found& found : efforts_) {
    auto into = run->effort.row(row).segment(
        mechanism_.joints[found.group.target].v_index, found.sources.size());
    for (size_t i = 0; i < found.sources.size(); ++i) {
      into[found.group.slots[i]] = value(found.sources[i]);
    }
    if (into.hasNaN()) {
      into.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
}

void RunReader::ReadRows(Run* run) {
  for (const ColumnSource& source : sources_) {
    first_cell_.push_back(wanted_.size());
    const std::vector<int>& columns = source.expression.columns();
    wanted_.insert(wanted_.end(), columns.begin(), columns.end());
  }
  for (const Found& found : channels_) {
    Channel channel;
    channel.kind = found.group.kind;
    channel.target = found.group.target;
    channel.name = found.group.name;
    channel.values.resize(0, found.group.columns.size());
    run->channels.push_back(std::move(channel));
  }
  run->effort.resize(0, mechanism_.nv);
  file_.ReadRows(wanted_,
                 [&](std::span<const double> cells) { ReadRow(cells, run); });
  for (const std::string& notice : file_.notices()) Notice(notice);
  if (run->size() < 2) {
    throw InputError(file_.HeaderPlace(0),
                     run->t.empty() ? "there is a header but no row of data"
                                    : "there is only one row of data",
                     "a run needs at least two samples");
  }
  for (Channel& channel : run->channels) {
    channel.values.conservativeResize(run->size(), channel.values.cols());
  }
  run->effort.conservativeResize(run->size(), run->effort.cols());
}

void RunReader::CheckChannel(const Found& found, Channel* channel) const {
  const ColumnGroup& group = found.group;
  if (channel->values.array().isNaN().all()) {
    throw InputError(file_.HeaderPlace(sources_[found.sources[0]].column()),
                     "nothing was measured in " + Join(group.columns) +
                         (group.columns.size() == 1
                              ? ": every cell is empty or nan"
                              : ": every row has a cell that is empty or nan"),
                     "remove the column where the quantity was not measured");
  }
  if (group.kind == ChannelKind::kOrientation) {
    NormalizeOrientation(found, channel);
  }
}

void RunReader::NormalizeOrientation(const Found& found,
                                     Channel* channel) const {
  constexpr double kRounding = 0.01;
  for (int row = 0; row < channel->values.rows(); ++row) {
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

// A missing effort is the one before it.
void RunReader::HoldEffort(const Found& found, RowMatrixXd* effort) {
  const ColumnGroup& group = found.group;
  const int rows = static_cast<int>(effort->rows());
  int held = 0;
  int leading = 0;
  for (int row = 0; row < rows; ++row) {
    auto now = effort->row(row).segment(mechanism_.joints[group.target].v_index,
                                        group.columns.size());
    if (!now.hasNaN()) continue;
    if (held == row) ++leading;
    ++held;
    if (row == 0) {
      now.setZero();
    } else {
      now = effort->row(row - 1).segment(
          mechanism_.joints[group.target].v_index, group.columns.size());
    }
  }
  if (held == rows) {
    throw InputError(
        file_.HeaderPlace(sources_[found.sources[0]].column()),
        "nothing was measured in " + Join(group.columns) + ": every " +
            (group.columns.size() == 1 ? "cell" : "row") + " is empty or nan",
        "remove the column where the quantity was not measured");
  }
  if (held == 0) return;
  Notice(std::to_string(held) + " of " + std::to_string(rows) + " efforts in " +
         Join(group.columns) + " are missing: each holds the value before it" +
         (leading == 0 ? ""
                       : "; the first " + std::to_string(leading) +
                             " are taken as zero"));
}

void RunReader::CheckDegrees(const Run& run) {
  // Enough to see it, and no copy of a run of any length.
  constexpr Eigen::Index kMost = Eigen::Index{1} << 20;
  const auto column = [kMost](const Channel& channel) {
    const Eigen::Index n = std::min(channel.values.size(), kMost);
    return std::vector<double>(channel.values.data(),
                               channel.values.data() + n);
  };
  const std::vector<double> t(
      run.t.begin(), run.t.begin() + std::min<Eigen::Index>(run.size(), kMost));
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
        joint, t, column(position),
        has_velocity ? column(run.channels[i + 1]) : std::vector<double>());
    if (report.verdict == DegreesVerdict::kNo) continue;
    const bool velocity = report.verdict == DegreesVerdict::kVelocity;
    const int source = channels_[velocity ? i + 1 : i].sources[0];
    const Expression& expression = sources_[source].expression;
    if (expression.has_factor()) continue;
    const std::string& name = sources_[source].name;
    const std::string& text = sources_[source].text;
    const std::string from = expression.is_column() ? text : "(" + text + ")";
    if (report.verdict == DegreesVerdict::kPerhaps) {
      Notice(Describe(source) + " may be in degrees: " + report.reason +
             "; if so: " + DegreesFlag(name, from, map_));
      continue;
    }
    throw InputError(file_.HeaderPlace(sources_[source].column()),
                     Describe(source) + " looks like degrees" +
                         (velocity ? " per second" : "") +
                         ", not radians: " + report.reason,
                     DegreesHint(name, from, map_));
  }
}

Run RunReader::Read() {
  Run run;
  run.name = file_.path();
  ReadRows(&run);
  for (size_t c = 0; c < channels_.size(); ++c) {
    CheckChannel(channels_[c], &run.channels[c]);
  }
  for (const Found& found : efforts_) HoldEffort(found, &run.effort);
  CheckDegrees(run);
  return run;
}

}  // namespace

Run ReadRun(const std::string& path, const ColumnMap& columns,
            const Mechanism& mechanism, std::vector<std::string>* notices) {
  const std::unique_ptr<TableFile> file = OpenTable(path);
  Run run = RunReader(file.get(), columns, mechanism, notices).Read();
  run.name = path;  // with the topic of a bag
  return run;
}

Run ParseRun(const std::string& path, const std::string& text,
             const ColumnMap& columns, const Mechanism& mechanism,
             std::vector<std::string>* notices) {
  CsvFile file(path, text);
  file.CheckHeader();
  return RunReader(&file, columns, mechanism, notices).Read();
}

}  // namespace sysid
