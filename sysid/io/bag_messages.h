#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace sysid {

// Bytes in the order of ROS (little endian), taken from the front. False, and
// nothing taken, where there are too few: a count or length that a file claims
// is compared with what is there before anything is allocated.
class RosBytes {
 public:
  explicit RosBytes(std::string_view bytes) : bytes_(bytes) {}
  bool empty() const { return bytes_.empty(); }
  size_t size() const { return bytes_.size(); }
  bool Take(uint32_t* value);
  bool Take(double* value);
  bool Take(size_t n, std::string_view* part);
  // A length and as many bytes.
  bool TakeString(std::string_view* text);

 private:
  std::string_view bytes_;
};

struct BagConnection {
  std::string topic;
  std::string type;  // "sensor_msgs/JointState"
};

struct BagMessage {
  const BagConnection* connection;
  int64_t received_ns;  // when it was recorded
  std::string_view data;
};

// Calls visit for each message of a ROS 1 bag (format 2.0) in the order of the
// file, which is that of recording. The bag is read front to back, a chunk at a
// time, and needs no index.
//
// Throws InputError, with the byte, for a file that is no bag, or damaged, or
// encrypted, and for chunks that this build cannot decompress.
void ReadBag(const std::string& path,
             const std::function<void(const BagMessage&)>& visit);

}  // namespace sysid
