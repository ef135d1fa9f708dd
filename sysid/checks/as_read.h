#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sysid/checks/check.h"
#include "sysid/checks/excerpt.h"
#include "sysid/checks/quick_fit.h"

namespace sysid {

// In how many of the windows a reading must be better at least: what is right
// is so everywhere, and one window in which the motion is chaotic decides
// nothing.
inline constexpr double kWindows = 0.6;

// How much better than anything of the model a reading must be that is none of
// it.
inline constexpr double kBeyondModel = 1.15;

// The recordings as they were read, and what the model makes of an excerpt of
// them: what every other reading is compared with.
class AsRead {
 public:
  // `part`: the size of the excerpt, in parts of the usual.
  explicit AsRead(const CheckInput& input, double part = 1.0);

  const CheckInput& input() const { return input_; }
  const Excerpt& excerpt() const { return excerpt_; }
  const Excerpt& glance() const { return glance_; }  // a part of it
  const EstimationOptions& options() const { return options_; }
  const LooseModel& lean() const { return lean_; }
  const QuickFit& fit() const { return fit_; }
  const QuickFit& short_fit() const { return short_; }  // that it began with
  // Its error; of a motion that cannot be followed at all, what a reading must
  // be better than at least, for anything is better than that motion.
  double missed() const;
  bool empty() const { return excerpt_.empty() || glance_.empty(); }

  // A short fit of the glance, its runs changed as a reading says. Its error is
  // a number also where the motion cannot be followed: as bad as any.
  QuickFit Glance(const LooseModel& model,
                  const std::function<void(Run*)>& change) const;

  // Whether bodies, springs, zeros, armatures and drags could make all that is
  // missed of the data as they were read: then nothing is beyond the model.
  bool CouldBeModel();

  // The error with all of them free; of short segments.
  double Anything();
  double AnythingShort();

  // Whether a reading with this error is better than anything that they could
  // make of the data as they were read; or they make as much more of the
  // reading. `scale`: what an error as it was read counts in units of the
  // reading's noise.
  bool IsBeyondModel(double error, const std::function<void(Run*)>& change,
                     double scale);

 private:
  double AnythingOf(const std::function<void(Run*)>& change) const;

  const CheckInput& input_;
  const Excerpt excerpt_, glance_;
  EstimationOptions options_;
  const LooseModel lean_;
  QuickFit short_, fit_;
  std::optional<double> anything_, anything_short_;
};

std::string TimesText(double error);  // "3.2 times the noise"

}  // namespace sysid
