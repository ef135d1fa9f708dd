#include "sysid/io/bag_messages.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <utility>

#include "models/error.h"
#include "sysid/io/byte_source.h"
#include "sysid/io/cell.h"
#include "sysid/io/decompress.h"

// wiki.ros.org/Bags/Format/2.0. A bag is the line "#ROSBAG V2.0" and records: a
// length, a header of fields "name=value" with a length each, a length, data.
// What is read are chunks (op 5, which hold records), connections (7) and
// messages (2); the bag's header, indices and summaries are passed over.
namespace sysid {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::string_view kHint =
    "it is damaged or cut off: try `rosbag reindex`, or record again";
// Headers hold names; chunks are made of 768 kB unless somebody asked.
constexpr uint32_t kLongestHeader = uint32_t{1} << 20;
constexpr uint32_t kLargestChunk = uint32_t{1} << 30;

using Fields = std::map<std::string_view, std::string_view>;

bool ReadFields(std::string_view header, Fields* fields) {
  RosBytes bytes(header);
  while (!bytes.empty()) {
    std::string_view field;
    if (!bytes.TakeString(&field)) return false;
    const size_t equals = field.find('=');
    if (equals == std::string_view::npos) return false;
    (*fields)[field.substr(0, equals)] = field.substr(equals + 1);
  }
  return true;
}

bool FieldNumber(const Fields& fields, std::string_view name, uint32_t* value) {
  const auto field = fields.find(name);
  if (field == fields.end()) return false;
  return RosBytes(field->second).Take(value);
}

class BagReader {
 public:
  BagReader(const std::string& path,
            const std::function<void(const BagMessage&)>& visit)
      : source_(path), visit_(visit) {}

  void Read() {
    std::string magic;
    if (!ReadExactly(kMagic.size(), &magic) || magic != kMagic) {
      Fail("is no ROS 1 bag of format 2.0", "convert it by `rosbag migrate`");
    }
    while (at_ < source_.size()) {
      record_ = at_;
      std::string header;
      const uint32_t length = ReadLength("a record's header");
      if (length > kLongestHeader) Fail("a record's header of more than 1 MiB");
      Fields fields;
      if (!ReadExactly(length, &header) || !ReadFields(header, &fields)) {
        Fail("a record's header that cannot be read");
      }
      const int op = ReadOp(fields);
      const uint32_t size = ReadLength("a record");
      if (op == kBagHeader && fields.count("encryptor") &&
          !fields["encryptor"].empty()) {
        Fail("it is encrypted", "decrypt it by `rosbag decrypt`");
      }
      if (op != kChunk && op != kConnection && op != kMessage) {
        Skip(size);
        continue;
      }
      if (size > kLargestChunk) Fail("a record of more than 1 GiB");
      std::string data;
      if (!ReadExactly(size, &data)) Fail("the file ends in a record");
      if (op == kChunk) {
        ReadChunk(fields, std::move(data));
      } else if (op == kConnection) {
        ReadConnection(fields, data);
      } else {
        ReadMessage(fields, data);
      }
    }
  }

 private:
  enum Op { kMessage = 2, kBagHeader = 3, kChunk = 5, kConnection = 7 };

  [[noreturn]] void Fail(const std::string& what,
                         std::string_view hint = kHint) const {
    throw InputError(
        source_.path(),
        what + " (in the record at byte " + std::to_string(record_) + ")",
        std::string(hint));
  }

  bool ReadExactly(size_t n, std::string* into) {
    into->resize(n);
    size_t used = 0;
    while (used < n) {
      const size_t got = source_.Read(into->data() + used, n - used);
      if (got == 0) break;
      used += got;
    }
    at_ += used;
    into->resize(used);
    return used == n;
  }

  uint32_t ReadLength(const char* what) {
    std::string bytes;
    uint32_t length = 0;
    if (!ReadExactly(4, &bytes) || !RosBytes(bytes).Take(&length)) {
      Fail("the file ends in a record");
    }
    if (length > source_.size() - at_) {
      Fail(std::string(what) + " claims " + std::to_string(length) +
           " bytes, but the file has " + std::to_string(source_.size() - at_) +
           " more");
    }
    return length;
  }

  void Skip(uint32_t n) {
    constexpr uint32_t kBlock = uint32_t{1} << 16;
    std::string block;
    for (; n > 0; n -= std::min(n, kBlock)) {
      if (!ReadExactly(std::min(n, kBlock), &block)) {
        Fail("the file ends in a record");
      }
    }
  }

  int ReadOp(const Fields& fields) const {
    const auto op = fields.find("op");
    if (op == fields.end() || op->second.size() != 1) {
      Fail("a record without its kind");
    }
    return op->second[0];
  }

  void ReadChunk(const Fields& fields, std::string data) {
    const auto compression = fields.find("compression");
    uint32_t size = 0;
    if (compression == fields.end() || !FieldNumber(fields, "size", &size)) {
      Fail("a chunk without its compression or size");
    }
    if (compression->second == "none") {
      ReadRecords(data);
      return;
    }
    if (size > kLargestChunk) Fail("a chunk of more than 1 GiB");
    const bool bzip2 = compression->second == "bz2";
    if (!bzip2 && compression->second != "lz4") {
      Fail("a chunk with the unknown compression " +
           Shown(compression->second));
    }
    std::string plain;
    const std::string fault = bzip2 ? DecompressBzip2(data, size, &plain)
                                    : DecompressLz4(data, size, &plain);
    if (fault == kNoDecompression) {
      Fail("a chunk cannot be decompressed: " + fault,
           bzip2
               ? "install libbz2-dev and build again, or `rosbag decompress` it"
               : "install liblz4-dev and build again, or `rosbag decompress` "
                 "it");
    }
    if (!fault.empty()) Fail("a chunk cannot be decompressed: " + fault);
    data.clear();
    data.shrink_to_fit();
    ReadRecords(plain);
  }

  void ReadRecords(std::string_view records) {
    RosBytes bytes(records);
    while (!bytes.empty()) {
      std::string_view header, data;
      Fields fields;
      if (!bytes.TakeString(&header) || !bytes.TakeString(&data) ||
          !ReadFields(header, &fields)) {
        Fail("a chunk whose records cannot be read");
      }
      const int op = ReadOp(fields);
      if (op == kConnection) ReadConnection(fields, data);
      if (op == kMessage) ReadMessage(fields, data);
    }
  }

  void ReadConnection(const Fields& fields, std::string_view data) {
    uint32_t number;
    Fields facts;
    if (!FieldNumber(fields, "conn", &number) || !fields.count("topic") ||
        !ReadFields(data, &facts) || !facts.count("type")) {
      Fail("a connection that cannot be read");
    }
    connections_[number] = {std::string(fields.find("topic")->second),
                            std::string(facts.find("type")->second)};
  }

  void ReadMessage(const Fields& fields, std::string_view data) const {
    uint32_t number, seconds, nanoseconds;
    const auto time = fields.find("time");
    const bool has_number = FieldNumber(fields, "conn", &number);
    RosBytes bytes(time == fields.end() ? std::string_view() : time->second);
    if (!has_number || !bytes.Take(&seconds) || !bytes.Take(&nanoseconds)) {
      Fail("a message without its connection or time");
    }
    const auto connection = connections_.find(number);
    if (connection == connections_.end()) {
      Fail("a message of the connection " + std::to_string(number) +
           ", which is not there");
    }
    visit_({&connection->second, int64_t{seconds} * 1000000000 + nanoseconds,
            data});
  }

  ByteSource source_;
  const std::function<void(const BagMessage&)>& visit_;
  uint64_t at_ = 0;
  uint64_t record_ = 0;  // where the record that is read begins
  std::map<uint32_t, BagConnection> connections_;
};

}  // namespace

bool RosBytes::Take(size_t n, std::string_view* part) {
  if (n > bytes_.size()) return false;
  *part = bytes_.substr(0, n);
  bytes_.remove_prefix(n);
  return true;
}

bool RosBytes::Take(uint32_t* value) {
  std::string_view part;
  if (!Take(4, &part)) return false;
  *value = 0;
  for (int i = 3; i >= 0; --i) {
    *value = *value << 8 | static_cast<unsigned char>(part[i]);
  }
  return true;
}

bool RosBytes::Take(double* value) {
  uint32_t low, high;
  if (bytes_.size() < 8 || !Take(&low) || !Take(&high)) return false;
  const uint64_t bits = uint64_t{high} << 32 | low;
  std::memcpy(value, &bits, sizeof(bits));
  return true;
}

bool RosBytes::TakeString(std::string_view* text) {
  const std::string_view before = bytes_;
  uint32_t length;
  if (Take(&length) && Take(length, text)) return true;
  bytes_ = before;
  return false;
}

void ReadBag(const std::string& path,
             const std::function<void(const BagMessage&)>& visit) {
  BagReader(path, visit).Read();
}

}  // namespace sysid
