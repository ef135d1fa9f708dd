#pragma once

#include <string>
#include <vector>

#include "models/model.h"

namespace sysid {

// What the recordings say beside the model.
struct ExportData {
  // Names of joints whose effort was recorded: they get actuators J.tau.
  std::vector<std::string> driven;
  // Names of joints that were recorded beyond the limits of the model, which
  // are then kept as numbers, but do not act.
  std::vector<std::string> beyond_limits;
};

struct ExportText {
  std::string text;  // empty: it cannot be written
  std::string why_not;
  std::vector<std::string>
      notes;  // what is not a parameter, and is to be known
};

// The time step that is written, s, and what MuJoCo's constraints are made as
// hard as: two of them.
inline constexpr double kMjcfTimestep = 0.001;

// MJCF (MuJoCo) of the model at its nominal values. Bodies and joints have the
// model's names; each link is a body with its frame, its mass, centre of mass
// and full inertia (principal moments and axes), also what is fixed. Joint
// coordinates are the model's, but for sensor offsets: `ref` moves the
// coordinate so that qpos is what the sensor measures,
//   qpos = q + offset,                                                  (E.1)
// and springref, range and the bias of drives with it:
//   kp (u - q) - kd qd = kp u + kp offset - kp qpos - kd qvel.          (E.2)
//
// Actuators: "J.tau" takes the recorded effort of a driven joint,
//   force = (1 + g) act + bias,  lag act' = ctrl - act,                 (E.3)
// "J.cmd" the commanded position of a drive. Ball joints have three, J.taux,
// J.tauy, J.tauz, in the child's axes. Integrator: RK4 at kMjcfTimestep.
//
// Dry friction and mimic joints are soft constraints in MuJoCo. A friction
// that the joint could overcome is a damping of b = 2 / (d timeconst) of what
// moves; with a time constant of two steps h it stops the joint in one:
//   b h = 1 / d, d = 0.9999.                                            (E.4)
//
// There is no text where a body has an inertia that no body has (a principal
// moment that exceeds the sum of the others): MuJoCo does not load it.
ExportText WriteMjcf(const Model& model, const ExportData& data,
                     const std::vector<std::string>& comments);

}  // namespace sysid
