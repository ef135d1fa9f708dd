#include <algorithm>
#include <cmath>

#include "models/effects/force_table.h"
#include "sysid/io/cell.h"
#include "sysid/report/fit_report.h"

namespace sysid {
namespace {

// So many rows between two knots of the table that a linear interpolation of
// the file follows it.
constexpr int kRowsAKnot = 4;
constexpr int kRows = (ForceTable::kKnots - 1) * kRowsAKnot;

std::string TableCsv(const Joint& joint, const ForceTable& table,
                     const double* p) {
  const EffectHooks<double>& hooks = table.HooksFor(ScalarTag<double>());
  std::string text = CsvCell(joint.name + ".q") + "," +
                     CsvCell(joint.name + ".qd") + "," +
                     CsvCell(joint.name + ".force") + "\n";
  const double below = p[ForceTable::kBelow], above = p[ForceTable::kAbove];
  for (int i = 0; i <= kRows; ++i) {
    const double q = -below + (above + below) * i / kRows;
    for (int j = 0; j <= kRows; ++j) {
      const double qd =
          ForceTable::SpeedAt(2.0 * j / kRows - 1.0, p[ForceTable::kSpeed]);
      const JointState<double> at{joint.type, 1, &q, &qd};
      double force = 0.0;
      hooks.AddEffort(at, p, &force);
      text += ShortestText(q) + "," + ShortestText(qd) + "," +
              ShortestText(force) + "\n";
    }
  }
  return text;
}

}  // namespace

std::vector<ForceTableFile> ForceTableFiles(const Model& model) {
  std::vector<ForceTableFile> files;
  const EffectSet& effects = model.effects();
  for (int i = 0; i < effects.size(); ++i) {
    if (effects.effect(i).kind() != ForceTable::kName) continue;
    const auto& table = static_cast<const ForceTable&>(effects.effect(i));
    const Joint& joint = model.mechanism().joints[table.joint()];
    std::string name = joint.name;
    std::replace(name.begin(), name.end(), '/', '_');
    files.push_back(
        {name + ".force_table.csv",
         TableCsv(joint, table,
                  model.nominal().effects.data() + effects.offset(i))});
  }
  return files;
}

}  // namespace sysid
