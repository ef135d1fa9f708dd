#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "models/error.h"
#include "sysid/io/bag_file.h"
#include "sysid/io/byte_source.h"
#include "sysid/io/cell.h"
#include "sysid/io/csv.h"
#include "sysid/io/foreign_format.h"
#include "sysid/io/mat_file.h"
#include "sysid/io/table_file.h"

namespace sysid {
namespace {

std::unique_ptr<TableFile> OpenCsv(ByteSource source, const std::string&) {
  RefuseForeignFormat(&source);
  auto file = std::make_unique<CsvFile>(std::move(source));
  file->CheckHeader();
  return file;
}

// A format: what its files begin with, and its reader. `part` is what stands
// behind the file's name ("/joint_states"), and "" for all but bags.
struct TableFormat {
  std::string_view begins;
  std::unique_ptr<TableFile> (*open)(ByteSource source,
                                     const std::string& part);
};

constexpr TableFormat kFormats[] = {
    {"MATLAB ", OpenMatFile},
    {"#ROSBAG V", OpenBagFile},
    {"", OpenCsv},
};

}  // namespace

std::unique_ptr<TableFile> OpenTable(const std::string& path) {
  constexpr std::string_view kBag = ".bag:";
  std::string file = path;
  std::string part;
  if (const size_t at = path.rfind(kBag); at != std::string::npos) {
    file = path.substr(0, at + kBag.size() - 1);
    part = path.substr(at + kBag.size());
  }
  ByteSource source(file);
  for (const TableFormat& format : kFormats) {
    if (source.Peek(format.begins.size()) != format.begins) continue;
    if (!part.empty() && format.open != OpenBagFile) {
      throw InputError(path, "is no ROS bag, and has no topics",
                       "name it without " + Shown(":" + part));
    }
    return format.open(std::move(source), part);
  }
  return nullptr;  // the last format takes all
}

}  // namespace sysid
