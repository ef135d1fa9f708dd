#pragma once

#include <string>
#include <vector>

#include "models/math/types.h"

namespace sysid {

// What a column group of a recording measures.
enum class ChannelKind {
  kPosition,         // J.q: 1 number, rad or m
  kVelocity,         // J.qd: 1 number, rad/s or m/s
  kOrientation,      // J.qx ..: 4 numbers x, y, z, w; unit
  kAngularVelocity,  // J.wx ..: 3 numbers, child's axes, rad/s
  kFramePosition,    // F.px ..: 1 to 3 numbers, world axes, m
  kMotorPosition,    // J.motor_q: 1 number, the joint's side of the gear
};

// Whether it is one number of a hinge or slide, its own or its motor's.
inline bool IsScalarPosition(ChannelKind kind) {
  return kind == ChannelKind::kPosition || kind == ChannelKind::kMotorPosition;
}

// One measured quantity over time. A missing measurement is a row of NaN (the
// whole row, also where only one of its cells was empty).
struct Channel {
  ChannelKind kind = ChannelKind::kPosition;
  int target = -1;   // joint index, or link index of a frame position
  std::string name;  // "joint1", "joint1.qd", "tip"
  // The world axes that each number of a frame position is along, 0 to 2
  // rising: a camera sees two of them. Else empty.
  std::vector<int> axes;
  RowMatrixXd values;  // samples x 1 to 4
};

// What was recorded beside efforts and measurements, for effects that read it:
// "joint1.cmd", "base.ax", "joint1.temperature", or a name of its own.
struct Input {
  std::string name;
  bool held = false;  // until the next sample; else linear between samples
  std::vector<double> values;  // one a sample, none missing
};

// What is known of the motion at the first sample of a run, beside what was
// measured: nothing; that nothing moved; that the first row's positions and
// velocities are exact.
enum class RunStart { kEstimated, kRest, kKnown };

// A recording: what sysid_fit fits. SI units throughout.
struct Run {
  std::string name;       // the file as the user gave it
  std::vector<double> t;  // s, strictly increasing
  std::vector<Channel> channels;
  RowMatrixXd effort;  // samples x nv, held until the next sample;
                       // zero where none was recorded
  // Which of the nv efforts were recorded: one that is zero throughout is then
  // known to be so. Empty: those that are not zero throughout.
  std::vector<bool> recorded_efforts;
  RunStart start = RunStart::kEstimated;
  std::vector<Input> inputs;
  std::vector<std::string> unread;  // columns of the file that nobody reads
  // What a factor for the time would multiply; empty where it has one.
  std::string time_source = "t";
  int size() const { return static_cast<int>(t.size()); }
};

// The name under which an effect reads the time of a run, s.
inline constexpr char kTimeInput[] = "t";

// Whether one of so many efforts, from `first` of nv on, was recorded.
bool HasEffort(const Run& run, int first, int size = 1);

// Null where the run has none of this name.
const Input* FindInput(const Run& run, const std::string& name);
// Whether effects may read this of the run: an input, or the time.
bool HasInput(const Run& run, const std::string& name);

}  // namespace sysid
