#include "sysid/io/refuse_degrees.h"

#include <algorithm>

#include "sysid/io/cell.h"
#include "sysid/io/degrees.h"
#include "sysid/io/suggest_columns.h"
#include "sysid/io/unreadable_run.h"

namespace sysid {
namespace {

// Enough to see it, and no copy of a run of any length.
constexpr Eigen::Index kMost = Eigen::Index{1} << 20;

std::vector<double> First(const double* values, Eigen::Index size) {
  return std::vector<double>(values, values + std::min(size, kMost));
}

// The hinge that a column "J.cmd" commands, or -1.
int CommandedHinge(const std::string& column, const Mechanism& mechanism) {
  constexpr std::string_view kCommand = ".cmd";
  if (!column.ends_with(kCommand)) return -1;
  const int joint =
      mechanism.FindJoint(column.substr(0, column.size() - kCommand.size()));
  return joint >= 0 && IsRotation1(mechanism.joints[joint].type) ? joint : -1;
}

// "beyond the limits -3 to 3 rad of the URDF" of angles that are; else "".
std::string BeyondLimits(const Joint& joint, const std::vector<double>& q) {
  if (!joint.has_limits || joint.type != JointType::kRevolute) return "";
  const bool beyond = std::any_of(q.begin(), q.end(), [&](double angle) {
    return angle < joint.lower || angle > joint.upper;
  });
  if (!beyond) return "";
  return Format("beyond the limits %.4g to %.4g rad of the URDF", joint.lower,
                joint.upper);
}

std::string OtherUnitHint(const std::string& name, const std::string& column,
                          const std::string& joint) {
  return "  (if it is neither, as per cent of a servo's range: " + name + "=" +
         column + "*1 with --add sensor_gain@" + joint + ",sensor_offset@" +
         joint + ", which identify its scale)";
}

}  // namespace

std::vector<std::string> RefuseDegrees(const RunSources& sources,
                                       const TableFile& file,
                                       const ColumnMap& map,
                                       const Mechanism& mechanism,
                                       const Run& run) {
  std::vector<std::string> notices;
  const std::vector<double> t = First(run.t.data(), run.size());
  // Of a position and its velocity, which may have no column.
  const auto look = [&](int joint, const std::vector<double>& q, int q_source,
                        const std::vector<double>& qd, int qd_source) {
    const DegreesReport report =
        LookForDegrees(mechanism.joints[joint], t, q, qd);
    if (report.verdict == DegreesVerdict::kNo) return;
    const bool velocity = report.verdict == DegreesVerdict::kVelocity;
    const ColumnSource& source =
        sources.sources[velocity ? qd_source : q_source];
    if (source.expression.has_factor()) return;
    const std::string from =
        source.expression.is_column() ? source.text : "(" + source.text + ")";
    if (report.verdict == DegreesVerdict::kPerhaps) {
      notices.push_back(source.Describe() +
                        " may be in degrees: " + report.reason +
                        "; if so: " + DegreesFlag(source.name, from, map));
      return;
    }
    const std::string column = source.Describe();
    const std::string& name = mechanism.joints[joint].name;
    // A swing alone says that it is no radians, not what it is.
    const std::string limits =
        report.certain ? "" : BeyondLimits(mechanism.joints[joint], q);
    const std::string what =
        limits.empty()
            ? column + " looks like degrees" + (velocity ? " per second" : "") +
                  ", not radians: " + report.reason
            : column + " is no angle in radians: " + report.reason + ", " +
                  limits + ". Degrees, or a unit that is not known here";
    throw MisreadColumn(
        "degrees", file.HeaderPlace(source.column()), what,
        DegreesHint(source.name, from, map) +
            (limits.empty() ? "" : OtherUnitHint(source.name, from, name)),
        source.name, InRadians(from));
  };
  for (size_t i = 0; i < run.channels.size(); ++i) {
    const Channel& position = run.channels[i];
    if (!IsScalarPosition(position.kind)) continue;
    // The velocity stands behind its position.
    const bool has_velocity =
        i + 1 < run.channels.size() &&
        run.channels[i + 1].kind == ChannelKind::kVelocity &&
        run.channels[i + 1].target == position.target;
    const auto column = [](const Channel& channel) {
      return First(channel.values.data(), channel.values.size());
    };
    look(position.target, column(position), sources.channels[i].sources[0],
         has_velocity ? column(run.channels[i + 1]) : std::vector<double>(),
         has_velocity ? sources.channels[i + 1].sources[0] : -1);
  }
  for (const RunSources::InputSource& input : sources.inputs) {
    const int joint = CommandedHinge(input.column.name, mechanism);
    const Input* read = FindInput(run, input.column.name);
    if (joint < 0 || read == nullptr) continue;
    look(joint, First(read->values.data(), run.size()), input.source, {}, -1);
  }
  return notices;
}

}  // namespace sysid
