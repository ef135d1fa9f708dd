#include "sysid/io/bag_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "models/error.h"
#include "sysid/io/bag_messages.h"
#include "sysid/io/cell.h"
#include "sysid/io/line_numbers.h"

namespace sysid {
namespace {

constexpr std::string_view kType = "sensor_msgs/JointState";
constexpr const char* kSuffixes[] = {".q", ".qd", ".tau"};

// A count and as many numbers.
bool TakeNumbers(RosBytes* bytes, std::vector<double>* numbers) {
  uint32_t count;
  if (!bytes->Take(&count) || count > bytes->size() / 8) return false;
  numbers->resize(count);
  for (double& number : *numbers) bytes->Take(&number);
  return true;
}

bool TakeNames(RosBytes* bytes, std::vector<std::string_view>* names) {
  uint32_t count;
  if (!bytes->Take(&count) || count > bytes->size() / 4) return false;
  names->resize(count);
  for (std::string_view& name : *names) {
    if (!bytes->TakeString(&name)) return false;
  }
  return true;
}

std::string ChooseTopic(const std::string& path,
                        const std::map<std::string, std::string>& topics,
                        const std::string& topic) {
  std::vector<std::string> fit, others;
  for (const auto& [name, type] : topics) {
    if (type == kType) fit.push_back(name);
    others.push_back(name + " (" + type + ")");
  }
  if (fit.empty()) {
    throw InputError(path, "no topic of the type " + std::string(kType),
                     others.empty() ? "it holds no messages"
                                    : "its topics are " + Join(others));
  }
  if (!topic.empty()) {
    if (Contains(fit, topic)) return topic;
    throw InputError(
        path + ":" + topic,
        "no topic " + Shown(topic) + " of the type " + std::string(kType),
        NameHint(topic, fit));
  }
  if (fit.size() == 1) return fit[0];
  throw InputError(
      path,
      "several topics of the type " + std::string(kType) + ": " + Join(fit),
      "choose one: " + path + ":" + fit[0]);
}

class BagFile : public TableFile {
 public:
  BagFile(const std::string& path, const std::string& topic) : TableFile(path) {
    std::map<std::string, std::string> topics;
    ReadBag(path, [&](const BagMessage& message) {
      topics[message.connection->topic] = message.connection->type;
    });
    topic_ = ChooseTopic(path, topics, topic);
    header_ = {"t"};
    ReadMessages([&](const JointState& state) {
      if (state.stamp_ns == 0) has_stamps_ = false;
      if (!start_ns_) start_ns_ = state.stamp_ns;
      for (int kind = 0; kind < 3; ++kind) {
        for (size_t i = 0; i < state.values[kind].size(); ++i) {
          const std::string name =
              std::string(state.names[i]) + kSuffixes[kind];
          const int next = static_cast<int>(header_.size());
          if (columns_.emplace(name, next).second) header_.push_back(name);
        }
      }
    });
    if (!has_stamps_) start_ns_.reset();
    notices_.push_back(
        "messages of " + topic_ + "; t counts from the first one" +
        (has_stamps_ ? ", by their stamps"
                     : ", by when they were recorded: some carry no stamp"));
  }

  std::string HeaderPlace(int) const override { return path_ + ":" + topic_; }
  std::string Place(int row, int) const override {
    return HeaderPlace(0) + ": " + RowName(row);
  }
  // "message 12", of the topic, from 1.
  std::string RowName(int row) const override {
    return "message " + std::to_string(numbers_.Line(row));
  }

  void ReadRows(const std::vector<int>& wanted, const Visit& visit) override {
    constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
    // Of the row that is gathered: by column of the header.
    std::vector<double> row(header_.size(), kMissing);
    std::vector<char> is_set(header_.size(), 0);
    std::vector<double> cells(wanted.size());
    std::optional<int64_t> row_ns;
    const auto finish = [&] {
      for (size_t i = 0; i < wanted.size(); ++i) cells[i] = row[wanted[i]];
      visit(cells);
    };
    std::string name;
    ReadMessages([&](const JointState& state) {
      const int64_t now_ns = has_stamps_ ? state.stamp_ns : state.received_ns;
      if (!start_ns_) start_ns_ = now_ns;
      std::vector<std::pair<int, double>> values;
      bool is_new = !row_ns || *row_ns != now_ns;
      for (int kind = 0; kind < 3; ++kind) {
        for (size_t i = 0; i < state.values[kind].size(); ++i) {
          name.assign(state.names[i]);
          name += kSuffixes[kind];
          const int column = columns_.find(name)->second;
          const double value = state.values[kind][i];
          values.emplace_back(column, value);
          is_new = is_new || is_set[column];
          if (!std::isinf(value) || !Contains(wanted, column)) continue;
          throw InputError(
              HeaderPlace(0) + ": message " + std::to_string(state.number),
              Shown(ShortestText(value)) + " in " + Shown(name) +
                  " is not finite",
              "nan is a missing measurement");
        }
      }
      if (is_new) {
        if (row_ns) finish();
        std::fill(row.begin(), row.end(), kMissing);
        std::fill(is_set.begin(), is_set.end(), 0);
        row_ns = now_ns;
        row[0] = static_cast<double>(now_ns - *start_ns_) / 1e9;
        numbers_.Add(state.number);
      }
      for (const auto& [column, value] : values) {
        row[column] = value;
        is_set[column] = 1;
      }
    });
    if (row_ns) finish();
  }

 private:
  struct JointState {
    int number = 0;  // from 1
    int64_t stamp_ns = 0;
    int64_t received_ns = 0;
    std::vector<std::string_view> names;
    std::vector<double> values[3];  // positions, velocities, efforts
  };

  void ReadMessages(const std::function<void(const JointState&)>& visit) const {
    JointState state;
    ReadBag(path_, [&](const BagMessage& message) {
      if (message.connection->type != kType ||
          message.connection->topic != topic_) {
        return;
      }
      ++state.number;
      const auto fail = [&](const std::string& what) {
        throw InputError(path_,
                         "message " + std::to_string(state.number) + " of " +
                             topic_ + " " + what,
                         "is it a sensor_msgs/JointState of ROS 1?");
      };
      RosBytes bytes(message.data);
      uint32_t sequence, seconds, nanoseconds;
      std::string_view frame;
      if (!bytes.Take(&sequence) || !bytes.Take(&seconds) ||
          !bytes.Take(&nanoseconds) || !bytes.TakeString(&frame) ||
          !TakeNames(&bytes, &state.names) ||
          !TakeNumbers(&bytes, &state.values[0]) ||
          !TakeNumbers(&bytes, &state.values[1]) ||
          !TakeNumbers(&bytes, &state.values[2])) {
        fail("is shorter than it claims");
      }
      for (const std::vector<double>& values : state.values) {
        if (values.empty() || values.size() == state.names.size()) continue;
        fail("has " + CountOf(values.size(), "value") + " for " +
             CountOf(state.names.size(), "joint"));
      }
      state.stamp_ns = int64_t{seconds} * 1000000000 + nanoseconds;
      state.received_ns = message.received_ns;
      visit(state);
    });
  }

  std::string topic_;
  bool has_stamps_ = true;
  std::optional<int64_t> start_ns_;
  std::map<std::string, int, std::less<>> columns_;  // by name
  LineNumbers numbers_;                              // of messages
};

}  // namespace

std::unique_ptr<TableFile> OpenBagFile(ByteSource source,
                                       const std::string& topic) {
  if (!source.is_file()) {
    throw InputError(source.path(), "is a ROS bag, which cannot be a pipe",
                     "save it as a file");
  }
  return std::make_unique<BagFile>(source.path(), topic);
}

}  // namespace sysid
