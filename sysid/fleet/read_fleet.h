#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sysid/fleet/random_effects.h"

namespace sysid {

// What a robot's fit.json says of one parameter.
struct RobotParameter {
  std::string name, unit;
  RobotEstimate estimate;
  std::string unusable;  // why it is compared with no other; "" where it is
};

// A robot as its files say (docs/fleet.md section 1).
struct Robot {
  std::string name;    // its folder
  std::string file;    // the diagnosis, or the fit
  std::string broken;  // why there is nothing of it; "" where there is
  std::string model;
  std::string verdict;  // "" without a diagnosis
  std::string final_verdict;
  std::vector<std::string> missing;  // effects that it lacks in the model
  std::vector<std::vector<std::string>> rivals;
  double train = 0.0, holdout = 0.0;  // over the noise; NaN: none
  std::vector<RobotParameter> parameters;
  std::string not_compared;  // why its parameters are not; "" where they are
  std::vector<std::string> skipped_runs;  // "run: reason"
  std::optional<double> recorded;         // s since 1970
  std::string recorded_from;              // times, recording or folder
};

// Reads the robots that --fits names: files, and patterns, whose folders
// without a usable file are broken robots. Throws InputError, with file, key
// and hint, where a pattern meets nothing, a file that is named as it is
// cannot be used, or every robot is broken.
std::vector<Robot> ReadFleet(const std::vector<std::string>& fits);

// "2026-11-25" or "20261125" within a text, s since 1970.
std::optional<double> DateIn(const std::string& text);
// "2026-11-25".
std::string DateText(double seconds);

}  // namespace sysid
