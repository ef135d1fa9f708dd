#include "sysid/checks/physics.h"

#include <cmath>

#include "sysid/checks/as_read.h"
#include "sysid/checks/find_idle_effort.h"
#include "sysid/checks/find_knob.h"
#include "sysid/checks/find_reading.h"

namespace sysid {
namespace {

// A model within this of the noise misses nothing worth a reading.
constexpr double kFits = 1.5;

// An angle whose "noise" is a good part of a turn is no smooth motion as it was
// read (degrees that wrap at every sample): any model is within such a noise.
bool HasRoughAngle(const AsRead& as_read) {
  constexpr double kRough = 0.2;  // rad
  const RunData& data = *as_read.fit().problem->runs().front();
  const Mechanism& mechanism = as_read.input().model->mechanism();
  for (size_t c = 0; c < data.sigma.size(); ++c) {
    const Channel& channel = data.run.channels[c];
    if (channel.kind == ChannelKind::kPosition &&
        IsRotation1(mechanism.joints[channel.target].type) &&
        data.sigma[c] > kRough) {
      return true;
    }
  }
  return false;
}

}  // namespace

bool CheckPhysics(const CheckInput& input, std::vector<Finding>* findings) {
  AsRead as_read(input);
  if (as_read.empty()) return false;
  const double error = as_read.fit().error;
  const bool rough = HasRoughAngle(as_read);
  if (error <= kFits && !rough) return true;
  if (FindReading(&as_read, findings)) return false;
  if (!std::isfinite(error) || rough) return false;
  std::vector<Finding> knobs;
  FindKnob(&as_read, &knobs);
  // Another clock makes up for efforts that are another's, as masses do.
  const bool is_clear = !knobs.empty() && knobs[0].fault != "clock_scale";
  const bool idle =
      !is_clear && !as_read.CouldBeModel() && FindIdleEffort(as_read, findings);
  if (!idle) findings->insert(findings->end(), knobs.begin(), knobs.end());
  return error <= kFits;
}

}  // namespace sysid
