#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sysid/io/byte_source.h"
#include "sysid/io/line_numbers.h"
#include "sysid/io/table_file.h"

namespace sysid {

// The messages sensor_msgs/JointState of one topic of a ROS 1 bag: a row a
// stamp, with the columns t (s, by the messages' stamps, from the first one)
// and J.q, J.qd, J.tau of each joint J that has a position, velocity, effort
// somewhere. Messages may have different joints: what is not in one is missing
// there; messages of one stamp and different joints are one row.
class BagFile : public TableFile {
 public:
  // `topic` "" is the only one of that type. Reads the bag once, for the
  // joints. Throws InputError for what ReadBag refuses, for a bag with no such
  // topic or several, and for a message that cannot be read.
  BagFile(const std::string& path, const std::string& topic);

  std::string HeaderPlace(int column) const override;
  std::string Place(int row, int column) const override;
  // "message 12", of the topic, from 1.
  std::string RowName(int row) const override;
  void ReadRows(const std::vector<int>& wanted, const Visit& visit) override;

 private:
  struct JointState {
    int number = 0;  // from 1
    int64_t stamp_ns = 0;
    int64_t received_ns = 0;
    std::vector<std::string_view> names;
    std::vector<double> values[3];  // positions, velocities, efforts
  };

  void ReadMessages(const std::function<void(const JointState&)>& visit) const;
  std::string ChooseTopic(const std::map<std::string, std::string>& topics,
                          const std::string& topic) const;

  std::string topic_;
  bool has_stamps_ = true;
  std::optional<int64_t> start_ns_;
  std::map<std::string, int, std::less<>> columns_;  // by name
  LineNumbers numbers_;                              // of messages
};

bool BeginsBagFile(std::string_view first_bytes);
std::unique_ptr<TableFile> OpenBagFile(ByteSource source,
                                       const std::string& topic);

}  // namespace sysid
