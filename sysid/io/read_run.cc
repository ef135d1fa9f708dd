#include "sysid/io/read_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <span>
#include <utility>

#include "models/error.h"
#include "models/printable.h"
#include "sysid/io/base_acceleration.h"
#include "sysid/io/cell.h"
#include "sysid/io/csv.h"
#include "sysid/io/memory.h"
#include "sysid/io/refuse_degrees.h"
#include "sysid/io/run_sources.h"
#include "sysid/io/suggest_columns.h"
#include "sysid/io/table_file.h"
#include "sysid/io/unreadable_run.h"

namespace sysid {
namespace {

// Reads one file: what its columns mean, then its rows, each straight into the
// run, then what the numbers say.
class RunReader {
 public:
  RunReader(TableFile* file, const ColumnMap& map, const Mechanism& mechanism,
            std::vector<std::string>* notices,
            RunContent content = RunContent::kMeasurements)
      : file_(*file), map_(map), mechanism_(mechanism), notices_(notices) {
    std::string ignored;
    in_ = FindRunSources(*file, map, mechanism, content, &ignored);
    if (!ignored.empty()) Notice(ignored);
  }

  Run Read() {
    Run run;
    run.name = file_.path();
    run.unread = in_.unread;
    run.time_source = TimeSource();
    ReadRows(&run);
    for (size_t c = 0; c < in_.channels.size(); ++c) {
      CheckChannel(in_.channels[c], &run.channels[c]);
    }
    for (const Found& found : in_.efforts) HoldEffort(found, &run.effort);
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
      fill(found, run->effort.row(row).segment(
                      mechanism_.joints[found.group.target].v_index,
                      found.sources.size()));
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

  void ReadTime(double t, Run* run) const {
    const int time = in_.Find("t");
    const int row = run->size();
    if (std::isnan(t)) {
      throw InputError(Place(time, row), "no time in " + Describe(time),
                       "every row needs its time: fill it in, or remove the "
                       "row");
    }
    if (row > 0 && t <= run->t.back()) {
      const std::string before = ShortestText(run->t.back());
      const std::string at = " (" + file_.RowName(row - 1) + ")";
      throw UnreadableRun(
          t == run->t.back() ? "time_repeats" : "time_goes_back",
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
    const double value = expression.Evaluate(own);
    if (std::isfinite(value)) return value;
    for (const double cell : own) {
      if (std::isnan(cell)) return value;
    }
    return std::numeric_limits<double>::infinity();
  }

  void CheckChannel(const Found& found, Channel* channel) const {
    const ColumnGroup& group = found.group;
    if (channel->values.array().isNaN().all()) {
      FailUnmeasured(found, group.columns.size() == 1
                                ? "every cell is empty or nan"
                                : "every row has a cell that is empty or nan");
    }
    if (group.kind == ChannelKind::kOrientation) {
      NormalizeOrientation(found, channel);
    }
  }

  void NormalizeOrientation(const Found& found, Channel* channel) const {
    constexpr double kRounding = 0.01;
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
      channel->values.row(row) /= norm;
    }
  }

  // A missing effort is the one before it.
  void HoldEffort(const Found& found, RowMatrixXd* effort) {
    const ColumnGroup& group = found.group;
    const int rows = static_cast<int>(effort->rows());
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
    if (held == rows) {
      FailUnmeasured(found, group.columns.size() == 1
                                ? "every cell is empty or nan"
                                : "every row is empty or nan");
    }
    if (held == 0) return;
    Notice(std::to_string(held) + " of " + std::to_string(rows) +
           " efforts in " + Join(group.columns) +
           " are missing: each holds the value before it" +
           (leading == 0 ? ""
                         : "; the first " + std::to_string(leading) +
                               " are taken as zero"));
  }

  [[noreturn]] void FailUnmeasured(const Found& found,
                                   const std::string& why) const {
    throw InputError(
        file_.HeaderPlace(in_.sources[found.sources[0]].column()),
        "nothing was measured in " + Join(found.group.columns) + ": " + why,
        "remove the column where the quantity was not measured");
  }
  std::string Place(int source, int row) const {
    return file_.Place(row, in_.sources[source].column());
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
  RunSources in_;
  std::vector<HeldPosition> held_;
  // The columns that are asked for, and by source where its own are in them.
  std::vector<int> wanted_;
  std::vector<size_t> first_cell_;
};

}  // namespace

Run ReadRun(const std::string& path, const ColumnMap& columns,
            const Mechanism& mechanism, std::vector<std::string>* notices) {
  const std::unique_ptr<TableFile> file = OpenTable(path);
  Run run = RunReader(file.get(), columns, mechanism, notices).Read();
  run.name = path;  // with the topic of a bag
  return run;
}

namespace {

Run ReadContent(const std::string& path, RunContent content,
                const Mechanism& mechanism, std::vector<std::string>* notices) {
  const std::unique_ptr<TableFile> file = OpenTable(path);
  Run run = RunReader(file.get(), {}, mechanism, notices, content).Read();
  run.name = path;
  return run;
}

}  // namespace

Run ReadEfforts(const std::string& path, const Mechanism& mechanism,
                std::vector<std::string>* notices) {
  return ReadContent(path, RunContent::kEfforts, mechanism, notices);
}

Run ReadPositions(const std::string& path, const Mechanism& mechanism,
                  std::vector<std::string>* notices) {
  return ReadContent(path, RunContent::kPositions, mechanism, notices);
}

Run ReadInputs(const std::string& path, const Mechanism& mechanism,
               std::vector<std::string>* notices) {
  return ReadContent(path, RunContent::kInputs, mechanism, notices);
}

ColumnMap OwnInputColumns(const std::string& path, const Mechanism& mechanism) {
  ColumnMap map;
  const std::unique_ptr<TableFile> file = OpenTable(path);
  for (const std::string& name : file->header()) {
    if (IsOwnInput(name, mechanism)) map.push_back({name, name, path});
  }
  return map;
}

Run ParseRun(const std::string& path, const std::string& text,
             const ColumnMap& columns, const Mechanism& mechanism,
             std::vector<std::string>* notices) {
  CsvFile file(path, text);
  file.CheckHeader();
  return RunReader(&file, columns, mechanism, notices).Read();
}

}  // namespace sysid
