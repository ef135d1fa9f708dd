#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace sysid {

// Writes ROS 1 bags (wiki.ros.org/Bags/Format/2.0) as tests need them, with
// indices left out, as after a recording that was killed.
class BagWriter {
 public:
  static std::string U32(uint32_t value) {
    std::string bytes(4, 0);
    for (int i = 0; i < 4; ++i) bytes[i] = static_cast<char>(value >> 8 * i);
    return bytes;
  }
  static std::string F64(double value) {
    uint64_t bits;
    std::memcpy(&bits, &value, 8);
    return U32(static_cast<uint32_t>(bits)) +
           U32(static_cast<uint32_t>(bits >> 32));
  }
  static std::string String(const std::string& text) {
    return U32(static_cast<uint32_t>(text.size())) + text;
  }
  using Fields = std::vector<std::pair<std::string, std::string>>;
  static std::string Record(const Fields& fields, const std::string& data) {
    std::string header;
    for (const auto& [name, value] : fields) {
      header += String(name + "=" + value);
    }
    return String(header) + String(data);
  }
  static std::string Op(char op) { return std::string(1, op); }

  static std::string Connection(uint32_t number, const std::string& topic,
                                const std::string& type) {
    return Record({{"op", Op(7)}, {"conn", U32(number)}, {"topic", topic}},
                  String("topic=" + topic) + String("type=" + type));
  }
  static std::string Message(uint32_t number, uint32_t seconds,
                             const std::string& data) {
    return Record(
        {{"op", Op(2)}, {"conn", U32(number)}, {"time", U32(seconds) + U32(0)}},
        data);
  }
  // `compression` "none", with `data` as it is, or another with `data`
  // compressed from `size` bytes.
  static std::string Chunk(const std::string& compression,
                           const std::string& data, size_t size) {
    return Record({{"op", Op(5)},
                   {"compression", compression},
                   {"size", U32(static_cast<uint32_t>(size))}},
                  data);
  }
  static std::string Bag(const std::string& records) {
    return "#ROSBAG V2.0\n" +
           Record({{"op", Op(3)},
                   {"index_pos", std::string(8, 0)},
                   {"conn_count", U32(0)},
                   {"chunk_count", U32(0)}},
                  std::string(4027, ' ')) +
           records;
  }

  static std::string JointState(uint32_t seconds, uint32_t nanoseconds,
                                const std::vector<std::string>& names,
                                const std::vector<double>& position,
                                const std::vector<double>& velocity = {},
                                const std::vector<double>& effort = {}) {
    std::string data = U32(7) + U32(seconds) + U32(nanoseconds) + String("arm");
    data += U32(static_cast<uint32_t>(names.size()));
    for (const std::string& name : names) data += String(name);
    for (const auto* values : {&position, &velocity, &effort}) {
      data += U32(static_cast<uint32_t>(values->size()));
      for (const double value : *values) data += F64(value);
    }
    return data;
  }
};

}  // namespace sysid
