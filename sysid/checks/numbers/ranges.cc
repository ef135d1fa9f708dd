// Lengths in millimetres: slides that run for a street, frames out of reach.

#include <algorithm>
#include <cmath>

#include "sysid/checks/column_fault.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/io/degrees.h"

namespace sysid {
namespace {

// How far a link's frame can be from the world's origin, m: the distances of
// the joints on the way; without bound behind a slide (-1).
double Reach(const Model& model, int link) {
  const Mechanism& mechanism = model.mechanism();
  double reach = 0.0;
  while (link > 0) {
    const Joint& joint = mechanism.joints[link - 1];
    if (joint.type == JointType::kPrismatic) return -1.0;
    reach += model.nominal().joint_p[link - 1].norm();
    if (joint.held) reach += joint.held->slide.norm();
    link = joint.parent_link;
  }
  return reach;
}

// What a factor mends.
ColumnFault Multiplied(const Series& series, Finding finding,
                       const std::string& factor) {
  ColumnFault fault;
  fault.finding = std::move(finding);
  fault.run = series.run;
  fault.columns = {series.column};
  fault.fixes = {
      {{series.column, series.column, [factor](const std::string& source) {
          return Times(source, factor);
        }}}};
  return fault;
}

}  // namespace

// As the reader does, for runs that did not come through it; a factor in the
// map says that the user knows (sysid/io/degrees.h).
void CheckDegrees(const CheckInput& input, std::vector<Finding>* findings) {
  const Mechanism& mechanism = input.model->mechanism();
  std::vector<ColumnFault> faults;
  for (const Series& series : AllSeries(input)) {
    if (!IsScalarPosition(series.channel->kind)) continue;
    const std::string source = SourceOf(input, series.column);
    if (source.find_first_of("*/") != std::string::npos) continue;
    const Joint& joint = mechanism.joints[series.channel->target];
    const RowMatrixXd& values = series.channel->values;
    const DegreesReport report = LookForDegrees(
        joint, series.run->t,
        std::vector<double>(values.data(), values.data() + values.size()), {});
    if (report.verdict != DegreesVerdict::kPosition) continue;
    ColumnFault fault =
        Multiplied(series, At(series, "degrees", Severity::kWrong),
                   "0.017453292519943295");
    fault.finding.weight = 1e5;
    fault.finding.evidence = report.reason;
    fault.finding.consequence =
        "read as radians, the motion is entirely different";
    faults.push_back(std::move(fault));
  }
  AddTogether(input, std::move(faults), findings);
}

void CheckRanges(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr double kSlide = 100.0;  // m: no slide of a machine is as long
  constexpr double kFar = 20.0;     // times the reach
  const Mechanism& mechanism = input.model->mechanism();
  std::vector<ColumnFault> faults;
  for (const Series& series : AllSeries(input)) {
    double limit = 0.0;
    std::string what;
    if (IsScalarPosition(series.channel->kind) &&
        mechanism.joints[series.channel->target].type ==
            JointType::kPrismatic) {
      limit = kSlide;
      what = "a slide of ";
    } else if (series.channel->kind == ChannelKind::kFramePosition) {
      const double reach = Reach(*input.model, series.channel->target);
      if (reach <= 0.0) continue;
      limit = kFar * reach;
      what = "a frame whose joints reach " + ShortNumber(reach) + " m moves ";
    } else {
      continue;
    }
    // Without the few values of spikes.
    const double range =
        Percentile(series.y, 0.98) - Percentile(series.y, 0.02);
    if (range <= limit) continue;
    // A slide that runs so far may be a hinge that goes round under its name:
    // the motion settles it.
    const bool is_slide = IsScalarPosition(series.channel->kind);
    ColumnFault fault =
        Multiplied(series,
                   At(series, "millimetres",
                      is_slide ? Severity::kNote : Severity::kWrong),
                   "0.001");
    fault.finding.weight = 1e4;
    fault.finding.evidence = what + ShortNumber(range) + " m";
    fault.finding.consequence =
        "read as metres the motion is a thousand times as large";
    faults.push_back(std::move(fault));
  }
  AddTogether(input, std::move(faults), findings);
}

}  // namespace sysid
