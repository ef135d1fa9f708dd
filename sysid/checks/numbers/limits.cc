// Positions beyond the limits of the URDF: wrong limits, or another unit.

#include <algorithm>
#include <cmath>

#include "sysid/checks/column_fault.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/io/cell.h"

namespace sysid {
namespace {

constexpr double kDegree = M_PI / 180.0;

struct Span {
  double low, high;
  bool IsWithin(const Joint& joint, double slack) const {
    return low >= joint.lower - slack && high <= joint.upper + slack;
  }
};

// Without the few values of spikes.
Span SpanOf(const Series& series) {
  const std::vector<double> q = AsRead(series);
  return {Percentile(q, 0.01), Percentile(q, 0.99)};
}

bool AreCounts(const Series& series) {
  const std::vector<double> q = AsRead(series);
  return std::all_of(q.begin(), q.end(), [](double count) {
    return count >= 0.0 && count == std::round(count);
  });
}

// The ticks of a turn, a power of two, of which the largest count is one of
// the last half; 0 where no encoder counts so.
double TicksOfTurn(double most) {
  constexpr double kFewest = 256.0, kMost = 1 << 24;
  double ticks = kFewest;
  while (ticks <= most && ticks < kMost) ticks *= 2.0;
  return most < ticks && 2.0 * most >= ticks ? ticks : 0.0;
}

ColumnFault FaultOf(const Series& series, const Span& span,
                    const Joint& joint) {
  const bool slides = joint.type == JointType::kPrismatic;
  ColumnFault fault;
  fault.run = series.run;
  fault.columns = {series.column};
  fault.finding = At(series, "beyond_limits", Severity::kNote);
  fault.finding.weight = 1e2;
  fault.finding.evidence =
      "runs from " + ShortNumber(span.low) + " to " + ShortNumber(span.high) +
      ", beyond the limits " + ShortNumber(joint.lower) + " to " +
      ShortNumber(joint.upper) + (slides ? " m" : " rad") + " of the URDF";
  return fault;
}

void MendBy(const Series& series,
            const std::function<std::string(const std::string&)>& expression,
            ColumnFault* fault) {
  fault->fixes.push_back({{series.column, series.column, expression}});
}

// Of a hinge: `ticks` of a turn, or 0.
ColumnFault OfHinge(const Series& series, const Joint& joint, double ticks) {
  constexpr double kSlack = 0.1;
  const Span span = SpanOf(series);
  ColumnFault fault = FaultOf(series, span, joint);
  const double unit = 2.0 * M_PI / ticks, middle = 0.5 * ticks;
  const Span turned{(span.low - middle) * unit, (span.high - middle) * unit};
  if (ticks > 0.0 && turned.IsWithin(joint, kSlack)) {
    fault.finding.fault = "ticks";
    fault.finding.severity = Severity::kWrong;
    fault.finding.weight = 1e5;
    fault.finding.evidence += ", in whole numbers: ticks of " +
                              RoundedText(ticks) + " a turn, with " +
                              RoundedText(middle) + " in the middle";
    fault.finding.consequence =
        "read as radians, the motion is entirely different";
    const std::string count = RoundedText(ticks);
    MendBy(
        series,
        [middle, count](const std::string& source) {
          return "(" + source + "-" + RoundedText(middle) + ")*2*pi/" + count;
        },
        &fault);
    return fault;
  }
  const Span as_degrees{span.low * kDegree, span.high * kDegree};
  const bool may_be = as_degrees.IsWithin(joint, kSlack);
  fault.finding.evidence +=
      may_be ? "; as degrees it would be within them, and so would other units"
             : "; it is no angle that is known here";
  fault.finding.consequence =
      "right if the limits are wrong; else it is another unit. One that no "
      "factor is known of is identified by --add sensor_gain@" +
      joint.name + ",sensor_offset@" + joint.name;
  if (may_be) {
    MendBy(
        series,
        [](const std::string& source) {
          return Times(source, "0.017453292519943295");
        },
        &fault);
  }
  return fault;
}

ColumnFault OfSlide(const Series& series, const Joint& joint) {
  const Span span = SpanOf(series);
  ColumnFault fault = FaultOf(series, span, joint);
  const double slack = 0.1 * (joint.upper - joint.lower);
  fault.finding.consequence = "right if the limits are wrong";
  const Span mm{1e-3 * span.low, 1e-3 * span.high};
  if (!mm.IsWithin(joint, slack)) return fault;
  fault.finding.fault = "millimetres";
  fault.finding.weight = 1e4;
  fault.finding.evidence += "; as millimetres it is within them";
  fault.finding.consequence =
      "read as metres the motion is a thousand times as large";
  MendBy(
      series, [](const std::string& source) { return Times(source, "0.001"); },
      &fault);
  return fault;
}

}  // namespace

void CheckLimits(const CheckInput& input, std::vector<Finding>* findings) {
  // CheckRanges says so of slides that run for a street.
  constexpr double kStreet = 100.0;  // m
  const Mechanism& mechanism = input.model->mechanism();
  const std::vector<Series> all = AllSeries(input);
  const auto joint_of = [&](const Series& series) -> const Joint& {
    return mechanism.joints[series.channel->target];
  };
  std::vector<const Series*> beyond;
  double most = 0.0;  // count
  for (const Series& series : all) {
    if (series.channel->kind != ChannelKind::kPosition) continue;
    const Joint& joint = joint_of(series);
    const bool street =
        joint.type == JointType::kPrismatic && series.range > kStreet;
    if (street || !IsBeyondLimits(series, joint)) continue;
    beyond.push_back(&series);
    if (AreCounts(series)) {
      most = std::max(most, Percentile(AsRead(series), 1.0));
    }
  }
  std::vector<ColumnFault> faults;
  for (const Series* series : beyond) {
    const Joint& joint = joint_of(*series);
    faults.push_back(
        joint.type == JointType::kPrismatic
            ? OfSlide(*series, joint)
            : OfHinge(*series, joint,
                      AreCounts(*series) ? TicksOfTurn(most) : 0.0));
  }
  AddTogether(input, std::move(faults), findings);
}

}  // namespace sysid
