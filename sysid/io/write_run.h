#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"
#include "residuals/run.h"

namespace sysid {

// What a run has beside its times and inputs, by the columns of
// docs/interface.md section 2: column `slot` of a matrix of the run.
struct ColumnOfRun {
  std::string name;
  const RowMatrixXd* values;
  int slot;
};
std::vector<ColumnOfRun> ColumnsOfRun(const Mechanism& mechanism,
                                      const Run& run);

// The run as CSV (docs/interface.md section 2): the comments, a line each with
// a leading '#'; the header; a row a sample, numbers that read back as they
// are. A missing measurement is an empty cell; the effort of a joint that has
// none throughout is left out.
std::string FormatRun(const Mechanism& mechanism, const Run& run,
                      const std::vector<std::string>& comments = {});

}  // namespace sysid
