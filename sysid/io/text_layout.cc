#include "sysid/io/text_layout.h"

namespace sysid {

std::vector<std::string> ReadCells(TextRows* rows) {
  std::vector<std::string> cells;
  rows->ReadRow([&](int, std::string_view cell) { cells.emplace_back(cell); });
  return cells;
}

TextLayout ReadTextLayout(const std::string& path, TextRows* rows) {
  constexpr bool (*kLayouts[])(const std::string&, TextRows*, TextLayout*) = {
      ReadMotiveLayout,
      ReadViconLayout,
      ReadQualisysLayout,
      ReadPlainLayout,
  };
  TextLayout layout;
  for (const auto read : kLayouts) {
    if (read(path, rows, &layout)) break;
  }
  return layout;
}

}  // namespace sysid
