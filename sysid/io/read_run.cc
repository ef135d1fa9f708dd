#include "sysid/io/read_run.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "models/error.h"
#include "models/printable.h"
#include "sysid/io/base_acceleration.h"
#include "sysid/io/cell.h"
#include "sysid/io/csv.h"
#include "sysid/io/even_times.h"
#include "sysid/io/joined_table.h"
#include "sysid/io/line_numbers.h"
#include "sysid/io/memory.h"
#include "sysid/io/refuse_degrees.h"
#include "sysid/io/run_sources.h"
#include "sysid/io/suggest_columns.h"
#include "sysid/io/table_file.h"
#include "sysid/io/units.h"
#include "sysid/io/unreadable_run.h"

namespace sysid {
namespace {

constexpr char kTimeHint[] =
    "rows must be in the order of time; are two recordings in one file, or is "
    "the time rounded?";

// Reads one file: what its columns mean, then its rows, each straight into the
// run, then what the numbers say.
class RunReader {
 public:
  RunReader(TableFile* file, const ColumnMap& map, const Mechanism& mechanism,
            std::vector<std::string>* notices,
            RunContent content = RunContent::kMeasurements)
      : file_(*file),
        map_(map),
        mechanism_(mechanism),
        notices_(notices),
        content_(content) {
    std::string ignored;
    in_ = FindRunSources(*file, map, mechanism, content, &ignored);
    if (!ignored.empty()) Notice(ignored);
    TakeUnits();
    NoteFollowers();
  }

  Run Read() {
    Run run;
    run.name = file_.path();
    run.unread = in_.unread;
    run.time_source = TimeSource();
    ReadRows(&run);
    FinishTimes(&run);
    DropUnmeasured(&run);
    for (size_t c = 0; c < in_.channels.size(); ++c) {
      CheckChannel(in_.channels[c], &run.channels[c]);
    }
    HoldEfforts(&run.effort);
    for (size_t i = 0; i < in_.inputs.size(); ++i) {
      FillInput(in_.inputs[i], &run.inputs[i]);
    }
    AddBaseAcceleration(&run);
    NoteHeld();
    for (const std::string& notice :
         RefuseDegrees(in_, file_, map_, mechanism_, run)) {
      Notice(notice);
    }
    return run;
  }

 private:
  using Found = RunSources::Group;

  std::string TimeSource() const {
    const ColumnSource& time = in_.sources[in_.Find("t")];
    if (time.expression.has_factor()) return "";
    if (!time.expression.is_column()) return "(" + time.text + ")";
    const bool plain = time.text.find_first_of("+-*/^(),\" ") == time.text.npos;
    return plain || time.text[0] == '"' ? time.text : '"' + time.text + '"';
  }

  // What a row of units says of columns that the map gives no factor for.
  void TakeUnits() {
    if (file_.units().empty()) return;
    std::vector<std::string> read;
    for (ColumnSource& source : in_.sources) {
      if (source.expression.has_factor()) continue;
      const size_t column = source.column();
      const std::string& text =
          column < file_.units().size() ? file_.units()[column] : "";
      const std::optional<Unit> unit = ParseUnit(text);
      if (!unit || unit->of == Unit::Of::kNone ||
          unit->of != QuantityOf(source.name, mechanism_)) {
        continue;
      }
      source.factor = unit->factor;
      if (unit->factor != 1.0) read.push_back(source.name + " in " + text);
    }
    Notice("the row of units behind the names is taken at its word" +
           (read.empty() ? "" : ": " + Join(read)));
  }

  void NoteFollowers() const {
    std::vector<std::string> added;
    for (const Found& found : in_.efforts) {
      for (const auto& [source, multiplier] : found.added) {
        added.push_back(
            in_.sources[source].name +
            (multiplier == 1.0 ? "" : " times " + RoundedText(multiplier)) +
            " to " + found.group.columns[0]);
      }
    }
    if (added.empty()) return;
    Notice("efforts of joints that follow others (<mimic>) are added: " +
           Join(added));
  }

  // As a person reads a position.
  static std::string Short(double q) {
    constexpr double kDigits = 1e4;
    return RoundedText(std::round(q * kDigits) / kDigits);
  }

  // Where a joint that is held still says that it was.
  struct HeldPosition {
    int joint, source;
    double least = std::numeric_limits<double>::infinity(), most = -least;
    void Add(double q) {
      if (!std::isfinite(q)) return;
      least = std::min(least, q);
      most = std::max(most, q);
    }
  };

  // That columns of joints which are held still are not used, and where such a
  // joint moved after all, or stood elsewhere.
  void NoteHeld() const {
    constexpr double kStill = 0.01;  // rad or m
    std::vector<std::string> columns;
    std::set<int> joints;
    for (const Found& found : in_.held) {
      joints.insert(found.group.target);
      for (const int source : found.sources) {
        columns.push_back(in_.sources[source].name);
      }
    }
    if (columns.empty()) return;
    Notice(Join(columns) + (columns.size() == 1 ? " is" : " are") +
           " not used: --lock holds the joint" +
           (joints.size() == 1 ? "" : "s") + " still");
    for (const HeldPosition& held : held_) {
      const Joint& joint = mechanism_.joints[held.joint];
      const double at = joint.held->position, moved = held.most - held.least;
      const std::string begin = "joint '" + joint.name + "' is held still at " +
                                Short(at) + ", although its column ";
      const std::string unit =
          joint.held->type == JointType::kPrismatic ? " m" : " rad";
      if (moved > kStill) {
        Notice(begin + "moves by " + Short(moved) + unit + ", from " +
               Short(held.least) + " to " + Short(held.most));
      } else if (std::max(held.most - at, at - held.least) > kStill) {
        const std::string mean = Short(0.5 * (held.least + held.most));
        Notice(begin + "is at " + mean + unit + ": --lock " + joint.name + "=" +
               mean);
      }
    }
  }

  void ReadRows(Run* run) {
    for (const Found& found : in_.held) {
      if (!found.group.is_effort &&
          found.group.kind == ChannelKind::kPosition) {
        held_.push_back({found.group.target, found.sources[0]});
      }
    }
    for (const ColumnSource& source : in_.sources) {
      first_cell_.push_back(wanted_.size());
      const std::vector<int>& columns = source.expression.columns();
      wanted_.insert(wanted_.end(), columns.begin(), columns.end());
    }
    for (const Found& found : in_.channels) {
      Channel channel;
      channel.kind = found.group.kind;
      channel.target = found.group.target;
      channel.name = found.group.name;
      channel.axes = found.axes;
      channel.values.resize(0, found.group.columns.size());
      run->channels.push_back(std::move(channel));
    }
    run->effort.resize(0, mechanism_.nv);
    run->recorded_efforts.assign(mechanism_.nv, false);
    for (const Found& found : in_.efforts) {
      const auto first = run->recorded_efforts.begin() +
                         mechanism_.joints[found.group.target].v_index;
      std::fill_n(first, found.group.columns.size(), true);
    }
    for (const auto& input : in_.inputs) {
      run->inputs.push_back({input.column.name, input.column.held, {}});
    }
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

  void ReadRow(std::span<const double> cells, Run* run) {
    if (IsCopy(cells, run)) return;
    rows_.Add(read_ - 1);
    const int row = run->size();
    if (row == std::numeric_limits<int>::max()) {
      throw InputError(file_.path(),
                       "more than " + std::to_string(row) + " rows",
                       "split it into several files");
    }
    if (row == run->effort.rows()) Reserve(run);
    const auto value = [&](int source) {
      const double number = Value(source, cells);
      if (std::isinf(number)) {
        throw InputError(
            Place(source, row),
            Shown(in_.sources[source].text) + " (" + in_.sources[source].name +
                ") is not finite here",
            "is there a division by zero, or a function without a value?");
      }
      return number;
    };
    // An angle that is larger has no digit left that says where it stands.
    constexpr double kLargest = 1e15;
    const auto measured = [&](int source) {
      const double number = value(source);
      if (std::abs(number) > kLargest) {
        throw InputError(Place(source, row),
                         Describe(source) + " is " + ShortestText(number) +
                             " here, and no measurement is beyond 1e15",
                         "leave the cell empty where nothing was measured");
      }
      return number;
    };
    // A number that is missing makes all of its group missing.
    for (HeldPosition& held : held_) {
      held.Add(Value(held.source, cells));
    }
    const auto fill = [&](const Found& found, auto into) {
      for (size_t i = 0; i < found.sources.size(); ++i) {
        into[found.group.slots[i]] = measured(found.sources[i]);
      }
      if (into.hasNaN()) {
        into.setConstant(std::numeric_limits<double>::quiet_NaN());
      }
    };
    ReadTime(value(in_.Find("t")), run);
    for (size_t c = 0; c < in_.channels.size(); ++c) {
      const Found& found = in_.channels[c];
      fill(found, run->channels[c].values.row(row));
    }
    for (size_t i = 0; i < in_.inputs.size(); ++i) {
      run->inputs[i].values.push_back(measured(in_.inputs[i].source));
    }
    run->effort.row(row).setZero();
    for (const Found& found : in_.efforts) {
      auto efforts = run->effort.row(row).segment(
          mechanism_.joints[found.group.target].v_index,
          found.group.columns.size());
      fill(found, efforts);
      for (const auto& [source, multiplier] : found.added) {
        efforts[0] += multiplier * measured(source);
      }
    }
  }

  // A missing input is the one before it, of one that is linear between samples
  // on the line between its neighbours; at the ends the nearest.
  void FillInput(const RunSources::InputSource& found, Input* input) {
    std::vector<double>& values = input->values;
    const int rows = static_cast<int>(values.size());
    int missing = 0, before = -1;
    for (int row = 0; row <= rows; ++row) {
      if (row < rows && std::isnan(values[row])) {
        ++missing;
        continue;
      }
      if (row == rows && before < 0) {
        throw InputError(
            file_.HeaderPlace(in_.sources[found.source].column()),
            "nothing was measured in " + input->name + ": every cell is empty",
            "remove the column where the quantity was not measured");
      }
      for (int k = before + 1; k < row; ++k) {
        if (before < 0) {
          values[k] = values[row];
        } else if (row == rows || input->held) {
          values[k] = values[before];
        } else {
          const double part = static_cast<double>(k - before) / (row - before);
          values[k] = values[before] + part * (values[row] - values[before]);
        }
      }
      before = row;
    }
    if (missing == 0) return;
    Notice(std::to_string(missing) + " of " + std::to_string(rows) +
           " numbers of " + input->name + " are missing: " +
           (input->held ? "each holds the one before it"
                        : "they are taken on lines between the others"));
  }

  void ReadTime(double t, Run* run) {
    const int time = in_.Find("t");
    const int row = run->size();
    if (std::isnan(t)) {
      throw InputError(Place(time, row), "no time in " + Describe(time),
                       "every row needs its time: fill it in, or remove the "
                       "row");
    }
    if (row > 0 && t < run->t.back()) {
      throw UnreadableRun("time_goes_back", Place(time, row),
                          "time goes back: from " +
                              ShortestText(run->t.back()) + " s" + Behind(row) +
                              " to " + ShortestText(t) + " s",
                          kTimeHint);
    }
    if (row > 0 && t == run->t.back() && first_repeat_ < 0) first_repeat_ = row;
    run->t.push_back(t);
  }

  // " (line 12)" of the row before.
  std::string Behind(int row) const {
    return " (" + file_.RowName(rows_.Line(row - 1)) + ")";
  }

  // Whether the row says what the one before it said, to the last digit.
  bool IsCopy(std::span<const double> cells, const Run* run) {
    ++read_;
    const bool copy =
        run->size() > 0 &&
        std::equal(cells.begin(), cells.end(), last_cells_.begin(),
                   [](double a, double b) {
                     return a == b || (std::isnan(a) && std::isnan(b));
                   });
    if (copy) {
      ++copies_;
    } else {
      last_cells_.assign(cells.begin(), cells.end());
    }
    return copy;
  }

  // Times that repeat at even steps, or not at all; and those since 1970 from
  // the first row on, as all that is printed of them then has digits enough.
  void FinishTimes(Run* run) const {
    if (copies_ > 0) {
      Notice(CountOf(copies_, "row") + " of " + std::to_string(read_) +
             " say the same as the row before, time included: left out");
    }
    if (first_repeat_ >= 0) SpreadTimes(run);
    constexpr double kLong = 1e8;  // s: three years
    const double first = run->t.front();
    if (first < kLong) return;
    CountFrom(first, &run->t);
    Notice("its times count from its first row, which is at " +
           ShortestText(first) + " s");
  }

  // A double tells times since 1970 to a quarter of a microsecond: what is left
  // of them are whole ones, where these tell them apart.
  static void CountFrom(double first, std::vector<double>* t) {
    constexpr double kPerSecond = 1e6;
    std::vector<double> rounded(t->size());
    bool rise = true;
    for (size_t k = 0; k < t->size(); ++k) {
      (*t)[k] -= first;
      rounded[k] = std::round((*t)[k] * kPerSecond) / kPerSecond;
      rise = rise && (k == 0 || rounded[k] > rounded[k - 1]);
    }
    if (rise) *t = std::move(rounded);
  }

  void SpreadTimes(Run* run) const {
    const std::optional<EvenTimes> even = FindEvenTimes(run->t);
    if (!even) {
      throw UnreadableRun(
          "time_repeats", Place(in_.Find("t"), first_repeat_),
          "time repeats: " + ShortestText(run->t[first_repeat_]) + " s again" +
              Behind(first_repeat_),
          kTimeHint);
    }
    for (size_t k = 0; k < run->t.size(); ++k) {
      run->t[k] = even->start + static_cast<double>(k) * even->step;
    }
    Notice("times repeat, as they have steps of " + RoundedText(even->digit) +
           " s: the rows are taken as even, " + RoundedText(even->step) +
           " s apart (" + RoundedText(1.0 / even->step) +
           " Hz), which agrees with each of them to its last digit");
  }

  // Columns without any number were not recorded: one note. Where nothing is
  // left that was asked for, an error.
  void DropUnmeasured(Run* run) {
    std::vector<std::string> names;
    const Found first = in_.channels.empty() ? Found() : in_.channels[0];
    const auto add = [&](const Found& found) {
      names.insert(names.end(), found.group.columns.begin(),
                   found.group.columns.end());
    };
    for (size_t c = in_.channels.size(); c-- > 0;) {
      const auto missing = run->channels[c].values.array().isNaN();
      if (!missing.rowwise().any().all()) continue;
      add(in_.channels[c]);
      in_.channels.erase(in_.channels.begin() + c);
      run->channels.erase(run->channels.begin() + c);
    }
    if (in_.channels.empty() && !names.empty()) FailUnmeasured(first);
    const bool only_efforts = content_ == RunContent::kEfforts;
    std::erase_if(in_.efforts, [&](const Found& found) {
      const int v = mechanism_.joints[found.group.target].v_index;
      auto efforts = run->effort.middleCols(v, found.group.columns.size());
      if (!efforts.array().isNaN().rowwise().any().all()) return false;
      if (only_efforts) FailUnmeasured(found);
      add(found);
      efforts.setZero();
      std::fill_n(run->recorded_efforts.begin() + v, efforts.cols(), false);
      return true;
    });
    if (names.empty()) return;
    std::sort(names.begin(), names.end());
    Notice("no number in " + Join(names) + ": taken as not recorded");
  }

  // Room for twice as many rows; to grow such blocks moves pages, not numbers,
  // and pages that are not written to take no memory.
  void Reserve(Run* run) {
    const Eigen::Index rows =
        std::max<Eigen::Index>(64, 2 * run->effort.rows());
    double numbers = static_cast<double>(run->effort.cols()) + 1.0;
    for (const Channel& channel : run->channels) {
      numbers += static_cast<double>(channel.values.cols());
    }
    // What is grown and not yet written to takes nothing.
    CheckMemory(0.5 * sizeof(double) * numbers * static_cast<double>(rows),
                file_.path(), "a run of so many rows",
                "keep fewer samples, or fewer columns");
    for (Channel& channel : run->channels) {
      channel.values.conservativeResize(rows, channel.values.cols());
    }
    run->effort.conservativeResize(rows, run->effort.cols());
  }

  // NaN where a cell of it is missing.
  double Value(int source, std::span<const double> cells) const {
    const Expression& expression = in_.sources[source].expression;
    const std::span<const double> own =
        cells.subspan(first_cell_[source], expression.columns().size());
    const double value = in_.sources[source].factor * expression.Evaluate(own);
    if (std::isfinite(value)) return value;
    for (const double cell : own) {
      if (std::isnan(cell)) return value;
    }
    return std::numeric_limits<double>::infinity();
  }

  void CheckChannel(const Found& found, Channel* channel) const {
    if (found.group.kind == ChannelKind::kOrientation) {
      NormalizeOrientation(found, channel);
    }
  }

  void NormalizeOrientation(const Found& found, Channel* channel) const {
    constexpr double kRounding = 0.01;
    constexpr double kUnit = 4.0 * std::numeric_limits<double>::epsilon();
    for (int row = 0; row < channel->values.rows(); ++row) {
      const double norm = channel->values.row(row).norm();
      if (std::isnan(norm)) continue;
      if (std::abs(norm - 1.0) > kRounding) {
        throw UnreadableRun(
            "quaternion_norm", Place(found.sources[0], row),
            "the quaternion " + Join(found.group.columns) + " has norm " +
                ShortestText(std::round(norm * 1e6) * 1e-6) + ", not 1",
            "its columns are w, x, y, z of a unit quaternion; leave them empty "
            "where nothing was measured");
      }
      // What was normalised stays: a run that is written reads back the same.
      if (std::abs(norm - 1.0) > kUnit) channel->values.row(row) /= norm;
    }
  }

  // A missing effort is the one before it.
  void HoldEfforts(RowMatrixXd* effort) const {
    const int rows = static_cast<int>(effort->rows());
    // Columns by how many are missing, and of them before any.
    std::map<std::pair<int, int>, std::vector<std::string>> columns;
    for (const Found& found : in_.efforts) {
      const ColumnGroup& group = found.group;
      auto efforts = effort->middleCols(mechanism_.joints[group.target].v_index,
                                        group.columns.size());
      int held = 0, leading = 0;
      for (int row = 0; row < rows; ++row) {
        auto now = efforts.row(row);
        if (!now.hasNaN()) continue;
        if (held == row) ++leading;
        ++held;
        if (row == 0) {
          now.setZero();
        } else {
          now = efforts.row(row - 1);
        }
      }
      std::vector<std::string>& names = columns[{held, leading}];
      names.insert(names.end(), group.columns.begin(), group.columns.end());
    }
    for (const auto& [count, names] : columns) {
      const auto [held, leading] = count;
      if (held == 0) continue;
      Notice(std::to_string(held) + " of " + std::to_string(rows) +
             " efforts in " + Join(names) +
             " are missing: each holds the value before it" +
             (leading == 0 ? ""
                           : "; the first " + std::to_string(leading) +
                                 " are taken as zero"));
    }
  }

  [[noreturn]] void FailUnmeasured(const Found& found) const {
    throw InputError(file_.HeaderPlace(in_.sources[found.sources[0]].column()),
                     "nothing was measured in " + Join(found.group.columns) +
                         (found.group.columns.size() == 1
                              ? ": every cell is empty or nan"
                              : ": every row has a cell that is empty or nan"),
                     "remove the column where the quantity was not measured");
  }
  std::string Place(int source, int row) const {
    return file_.Place(rows_.Line(row), in_.sources[source].column());
  }
  std::string Describe(int source) const {
    return in_.sources[source].Describe();
  }
  void Notice(const std::string& text) const {
    // With names of the file's columns.
    if (notices_ != nullptr) {
      notices_->push_back(Printable(file_.path() + ": " + text));
    }
  }

  TableFile& file_;
  const ColumnMap& map_;
  const Mechanism& mechanism_;
  std::vector<std::string>* notices_;
  RunContent content_;
  RunSources in_;
  int read_ = 0, copies_ = 0;  // rows of the file
  int first_repeat_ = -1;      // the row of the run whose time repeats
  std::vector<double> last_cells_;
  LineNumbers rows_;  // of the run's rows: those of the file
  std::vector<HeldPosition> held_;
  // The columns that are asked for, and by source where its own are in them.
  std::vector<int> wanted_;
  std::vector<size_t> first_cell_;
};

}  // namespace

Run ReadTable(std::unique_ptr<TableFile> table, const ColumnMap& columns,
              const Mechanism& mechanism, std::vector<std::string>* notices,
              RunContent content) {
  const std::string path = table->path();
  const std::unique_ptr<TableFile> file =
      JoinOtherFiles(std::move(table), ColumnsOf(columns, path, mechanism));
  return RunReader(file.get(), columns, mechanism, notices, content).Read();
}

namespace {

Run ReadAs(const std::string& path, const ColumnMap& columns,
           const Mechanism& mechanism, std::vector<std::string>* notices) {
  const std::unique_ptr<TableFile> file =
      JoinOtherFiles(OpenTable(path), ColumnsOf(columns, path, mechanism));
  Run run = RunReader(file.get(), columns, mechanism, notices).Read();
  run.name = path;  // with the topic of a bag
  return run;
}

// Reads the file as the suggestion says, and takes up what the numbers then
// say of a column's unit. Throws InputError, as UnnamedColumns does, with what
// was found: what a hint says has been tried.
[[noreturn]] void FailWithTried(const std::string& path,
                                const ColumnMap& columns,
                                const Mechanism& mechanism,
                                const UnnamedColumns& error) {
  Suggestion hint = error.suggestion();
  // A column each, and one more.
  for (size_t tries = hint.map.size() + 1; tries > 0; --tries) {
    try {
      ReadAs(path, MergeByName(columns, hint.map), mechanism, nullptr);
      break;
    } catch (const MisreadColumn& misread) {
      for (ColumnMapping& entry : hint.map) {
        if (entry.name == misread.name()) {
          entry.expression = misread.expression();
        }
      }
      hint.after += "; " + misread.detail();
    } catch (const InputError& other) {
      hint.after += "; what is then wrong: " + other.WithoutHint();
      break;
    }
  }
  throw InputError(error.place(), error.detail(), hint.Text(columns));
}

}  // namespace

Run ReadRun(const std::string& path, const ColumnMap& columns,
            const Mechanism& mechanism, std::vector<std::string>* notices) {
  try {
    return ReadAs(path, columns, mechanism, notices);
  } catch (const UnnamedColumns& error) {
    std::error_code unknown;
    if (!error.suggestion().complete ||
        !std::filesystem::is_regular_file(path, unknown)) {
      throw;
    }
    FailWithTried(path, columns, mechanism, error);
  }
}

Run ReadContent(const std::string& path, RunContent content,
                const Mechanism& mechanism, std::vector<std::string>* notices) {
  Run run = ReadTable(OpenTable(path), {}, mechanism, notices, content);
  run.name = path;  // with the topic of a bag
  return run;
}

ColumnMap OwnInputColumns(const TableFile& table, const Mechanism& mechanism) {
  ColumnMap map;
  for (const std::string& name : table.header()) {
    if (IsOwnInput(name, mechanism)) map.push_back({name, name, table.path()});
  }
  return map;
}

ColumnMap OwnInputColumns(const std::string& path, const Mechanism& mechanism) {
  return OwnInputColumns(*OpenTable(path), mechanism);
}

Run ParseRun(const std::string& path, const std::string& text,
             const ColumnMap& columns, const Mechanism& mechanism,
             std::vector<std::string>* notices) {
  CsvFile file(path, text);
  file.CheckHeader();
  return RunReader(&file, columns, mechanism, notices).Read();
}

}  // namespace sysid
