#pragma once

#include <string>

#include "tests/acceptance/hidden/hidden_case.h"

namespace sysid {

// Writes a case for the programs into a folder, which is made: model.urdf,
// spec.yaml, train1.csv, train2.csv, holdout.csv; and, for the reader alone,
// truth.txt.
void ExportCase(const HiddenData& data, const std::string& folder);

}  // namespace sysid
