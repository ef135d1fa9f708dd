#include <cmath>
#include <string>
#include <vector>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/text_layout.h"

// What Vicon's Nexus exports as ASCII (its CSV), of which the trajectories are
// read:
//
//   Trajectories
//   100                                  frames a second
//   ,,arm:tip,,,arm:elbow,,
//   Frame,Sub Frame,X,Y,Z,X,Y,Z
//   ,,mm,mm,mm,mm,mm,mm
//   1,0,12.5,...
//
// A marker that was not seen has empty cells. Frames are counted from the start
// of the capture, so t = frame / rate.
namespace sysid {

bool ReadViconLayout(const std::string& path, TextRows* rows,
                     TextLayout* layout) {
  const std::string_view ahead = rows->Ahead();
  constexpr std::string_view kWord = "Trajectories";
  if (!ahead.starts_with(kWord) || ahead.size() == kWord.size() ||
      std::string_view(",\r\n").find(ahead[kWord.size()]) ==
          std::string_view::npos) {
    return false;
  }
  rows->set_separator(',');
  rows->ReadCells();
  const auto fail = [&](const std::string& what) {
    throw InputError(path + ":" + std::to_string(rows->row_line()) + ":1", what,
                     "export the trajectories again, as ASCII with commas");
  };
  const auto next = [&] {
    if (rows->AtEnd()) fail("an export of Nexus that ends in its header");
    return rows->ReadCells();
  };
  const std::vector<std::string> rate = next();
  if (!ParseNumber(rate[0], &layout->rate_hz) ||
      !std::isfinite(layout->rate_hz) || layout->rate_hz <= 0.0) {
    fail(Shown(rate[0]) + " is not a number of frames a second");
  }
  const std::vector<std::string> markers = next();
  const std::vector<std::string> axes = next();
  layout->header_line = rows->row_line();
  if (axes.size() < 3 || axes[0] != "Frame") {
    fail("an export of Nexus without the row \"Frame,Sub Frame,X,Y,Z,...\"");
  }
  const std::vector<std::string> units = next();
  layout->header = {axes[0], axes[1]};
  std::string marker;
  for (size_t i = 2; i < axes.size(); ++i) {
    // A name stands over the first of its columns.
    if (i < markers.size() && !markers[i].empty()) marker = markers[i];
    layout->header.push_back(axes[i].empty() ? "" : marker + "." + axes[i]);
  }
  layout->header.push_back("t");
  layout->makes_time = true;
  layout->frame_column = 0;
  layout->width_hint =
      "only trajectories are read: export them alone, without other sections";
  const std::string unit = units.size() > 2 ? units[2] : "";
  layout->notices.push_back(
      "an export of Nexus: t is Frame / " + ShortestText(layout->rate_hz) +
      " Hz, lengths are in " + (unit.empty() ? "an unknown unit" : unit) +
      (unit == "mm" ? " (map them by *0.001)" : ""));
  return true;
}

}  // namespace sysid
