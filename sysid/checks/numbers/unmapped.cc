// Joints without columns in a file that has columns which nobody reads.

#include <algorithm>
#include <string>
#include <vector>

#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/io/cell.h"
#include "sysid/io/match_columns.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

bool HasFrames(const Run& run) {
  return std::any_of(run.channels.begin(), run.channels.end(),
                     [](const Channel& channel) {
                       return channel.kind == ChannelKind::kFramePosition;
                     });
}

void CheckRun(const CheckInput& input, const Run& run,
              std::vector<Finding>* findings) {
  const Mechanism& mechanism = input.model->mechanism();
  const bool frames = HasFrames(run);
  std::vector<std::string> wanted;
  for (int j = 0; j < static_cast<int>(mechanism.joints.size()); ++j) {
    const Joint& joint = mechanism.joints[j];
    if (VelocitySize(joint) != 1) continue;
    if (!frames && FindChannel(run, ChannelKind::kPosition, j) == nullptr) {
      wanted.push_back(joint.name + ".q");
      if (FindChannel(run, ChannelKind::kVelocity, j) == nullptr) {
        wanted.push_back(joint.name + ".qd");
      }
    }
    if (!HasEffort(run, joint.v_index)) wanted.push_back(joint.name + ".tau");
  }
  const ColumnMatches found = MatchColumns(
      mechanism, run.unread,
      [&](const std::string& name) { return Contains(wanted, name); });
  NewColumns columns;
  Finding finding;
  for (const ColumnMapping& entry : found.map) {
    if (!finding.subject.empty()) finding.subject += ", ";
    finding.subject += entry.name;
    columns.push_back({entry.name, entry.expression});
  }
  if (columns.empty()) return;
  finding.fault = "unmapped_columns";
  finding.severity = Severity::kWrong;
  finding.file = run.name;
  finding.evidence = "no column is read as " + finding.subject +
                     ", and these columns are unused: " + Join(run.unread);
  finding.consequence =
      "an unmeasured joint is only predicted, and an effort that is not read "
      "still acted on the mechanism";
  finding.remedies = {ColumnsFlag(OfOneRun(input, run), columns)};
  findings->push_back(finding);
}

}  // namespace

void CheckUnmapped(const CheckInput& input, std::vector<Finding>* findings) {
  for (const Run* run : input.runs) {
    if (!run->unread.empty()) CheckRun(input, *run, findings);
  }
}

}  // namespace sysid
