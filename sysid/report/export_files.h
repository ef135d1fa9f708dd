#pragma once

#include <string>
#include <vector>

#include "sysid/report/page_data.h"

namespace sysid {

struct NamedText {
  std::string name, text;  // "identified.xml"
};

// The fitted model in the formats of simulators: identified.xml (MJCF) and
// identified.sdf, where they can be written, and export.json, which says of
// each of these files and of identified.urdf what arrived in it, what the
// format cannot say, and why a file is missing (docs/exports.md).
std::vector<NamedText> ExportFiles(const PageFit& fit);

// What lies beside ModelFiles() in the folder of a fit: force tables, and
// ExportFiles.
std::vector<NamedText> FilesBeside(const PageFit& fit);

}  // namespace sysid
