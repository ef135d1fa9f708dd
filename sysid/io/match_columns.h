#pragma once

#include <functional>
#include <string>
#include <vector>

#include "models/mechanism.h"
#include "sysid/io/column_map.h"

namespace sysid {

// Which of a recording's columns are which of ours, as far as names tell: for
// hints.
struct ColumnMatches {
  ColumnMap map;  // "joint1.q" from "pos1*0.0174532925"
  // Those of ours that only the order of the columns gives.
  std::vector<std::string> by_order;
  // Columns that look like a position and are nobody's by name.
  std::vector<std::string> left;
};

// For J.q, J.qd, J.tau and J.cmd of joints of one degree of freedom, each kind
// for itself: names before order. A column is a joint's whose name's words it
// has (those that not all joints have, "shoulder" in "/state/shoulder/pos"),
// and of several the one with the most. Numbers alone ("q1" for "joint1") count
// where they leave no joint and no column over. Only where no name matches any
// joint it is the order, q2 before q10. A commanded effort is taken where none
// is measured; a factor is what the name says of the unit (column_names.h).
//
// `wanted` says whether one of our names is asked for.
ColumnMatches MatchColumns(
    const Mechanism& mechanism, const std::vector<std::string>& columns,
    const std::function<bool(const std::string& name)>& wanted);

// A column's name as an expression: in quotes where it needs them.
std::string QuotedColumn(const std::string& name);

}  // namespace sysid
