// Joints without columns in a file that has columns which nobody reads.

#include <algorithm>

#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/io/run_columns.h"
#include "sysid/io/suggest_columns.h"

namespace sysid {
namespace {

// The first that looks so, no longer among them; "" where none does.
std::string Take(bool (*looks)(const std::string&),
                 std::vector<std::string>* columns) {
  for (size_t i = 0; i < columns->size(); ++i) {
    const std::string column = (*columns)[i];
    if (!looks(column)) continue;
    columns->erase(columns->begin() + i);
    return column;
  }
  return "";
}

bool HasFrames(const Run& run) {
  return std::any_of(run.channels.begin(), run.channels.end(),
                     [](const Channel& channel) {
                       return channel.kind == ChannelKind::kFramePosition;
                     });
}

void CheckRun(const CheckInput& input, const Run& run,
              std::vector<Finding>* findings) {
  std::vector<std::string> unread = run.unread;
  NewColumns columns;
  Finding finding;
  const std::vector<Joint>& joints = input.model->mechanism().joints;
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    const Joint& joint = joints[j];
    if (VelocitySize(joint) != 1) continue;
    const auto add = [&](const char* suffix,
                         bool (*looks)(const std::string&)) {
      const std::string column = Take(looks, &unread);
      if (column.empty()) return false;
      if (!finding.subject.empty()) finding.subject += ", ";
      finding.subject += joint.name + suffix;
      columns.push_back({joint.name + suffix, column});
      return true;
    };
    if (!HasFrames(run) &&
        FindChannel(run, ChannelKind::kPosition, j) == nullptr &&
        add(".q", LooksLikePosition) &&
        FindChannel(run, ChannelKind::kVelocity, j) == nullptr) {
      add(".qd", LooksLikeVelocity);
    }
    if (!HasEffort(run, joint.v_index)) {
      add(".tau", LooksLikeEffort);
    }
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
