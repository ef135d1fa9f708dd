#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/text_layout.h"

// What OptiTrack's Motive exports as CSV (docs.optitrack.com, "Data Export:
// CSV", formats 1.2 and later):
//
//   Format Version,1.23,Take Name,...,Length Units,Millimeters,...
//
//   ,Type,Marker,Marker,Marker,Rigid Body,...        1.23: the word may be
//   ,Name,tip,tip,tip,arm,...                        missing: ",,Marker"
//   ,ID,1,1,1,2,...
//   ,Parent,...                                      Motive 3
//   ,,Position,Position,Position,Rotation,...
//   Frame,Time (Seconds),X,Y,Z,X,Y,Z,W
//   0,0.000000,12.5,...
//
// A marker that was not seen has empty cells.
namespace sysid {
namespace {

// A row above the axes, found by the word in its second cell or, where that is
// missing, by its place.
using Rows = std::vector<std::vector<std::string>>;

std::string CellOf(const std::vector<std::string>& row, size_t i) {
  return i < row.size() ? row[i] : "";
}

const std::vector<std::string>* FindRow(const Rows& rows,
                                        const std::string& word, size_t place) {
  for (const auto& row : rows) {
    if (CellOf(row, 1) == word) return &row;
  }
  const bool may_be = place < rows.size() && CellOf(rows[place], 1).empty();
  return may_be ? &rows[place] : nullptr;
}

// "tip.X"; "arm.Rotation.W".
std::string ColumnName(const std::string& object, const std::string& quantity,
                       const std::string& axis) {
  if (object.empty()) return axis;  // "TimeCode"
  std::string name = object;
  if (!quantity.empty() && quantity != "Position") name += "." + quantity;
  if (!axis.empty()) name += "." + axis;
  return name;
}

}  // namespace

bool ReadMotiveLayout(const std::string& path, TextRows* rows,
                      TextLayout* layout) {
  if (!rows->Ahead().starts_with("Format Version,")) return false;
  rows->set_separator(',');
  const std::vector<std::string> facts = rows->ReadCells();
  Rows above;
  std::vector<std::string> axes;
  constexpr int kMostRows = 10;
  while (CellOf(axes, 0) != "Frame") {
    if (!axes.empty()) above.push_back(axes);
    rows->SkipEmptyLines(nullptr);
    if (rows->AtEnd() || above.size() > kMostRows) {
      throw InputError(path + ":1:1",
                       "an export of Motive without the row \"Frame,Time "
                       "(Seconds),...\"",
                       "export it again, with the header on");
    }
    axes = rows->ReadCells();
  }
  layout->header_line = rows->row_line();
  const auto* types = FindRow(above, "Type", 0);
  const auto* names = FindRow(above, "Name", 1);
  const auto* ids = FindRow(above, "ID", 2);
  if (above.size() < 2 || names == nullptr) {
    throw InputError(path + ":1:1",
                     "an export of Motive without the row of names",
                     "export it again, with the header on");
  }
  const std::vector<std::string>& quantities = above.back();
  // A rigid body's marker stands there as seen and as expected, by one name.
  const auto name_of = [&](size_t i, int detail) {
    std::string object = CellOf(*names, i);
    if (detail > 0 && types) object += " (" + CellOf(*types, i) + ")";
    if (detail > 1 && ids) object += " [" + CellOf(*ids, i) + "]";
    return ColumnName(object, CellOf(quantities, i), axes[i]);
  };
  std::vector<std::string> header;
  for (size_t i = 2; i < axes.size(); ++i) header.push_back(name_of(i, 0));
  for (const int detail : {1, 2}) {
    std::map<std::string, int> count;
    for (const std::string& name : header) ++count[name];
    for (size_t i = 2; i < axes.size(); ++i) {
      std::string& name = header[i - 2];
      if (count[name] > 1) name = name_of(i, detail);
    }
  }
  layout->header = {"Frame", CellOf(axes, 1)};
  if (layout->header[1] == "Time (Seconds)") layout->header[1] = "t";
  layout->header.insert(layout->header.end(), header.begin(), header.end());
  std::string unit = "an unknown unit";
  for (size_t i = 0; i + 1 < facts.size(); ++i) {
    if (facts[i] == "Length Units") unit = facts[i + 1];
  }
  layout->notices.push_back(
      "an export of Motive: t is its time, lengths are in " + unit +
      (unit == "Millimeters" ? " (map them by *0.001)" : "") +
      ", and Y is up unless another axis was chosen: tip.px=NAME.X, "
      "tip.py=-NAME.Z, tip.pz=NAME.Y make z up");
  return true;
}

}  // namespace sysid
