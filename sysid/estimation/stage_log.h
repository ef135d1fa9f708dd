#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sysid/estimation/fit.h"

namespace sysid {

// The stages of a fit as they end, so that one that was killed goes on.
//
// A fit is a sequence of stages, each of which starts where the last ended, and
// what lies between them (how long segments are, how steps are chosen, how
// channels are weighed) follows from that. Where a log has the outcomes of the
// first stages, a fit of the same problem takes them from there, computes
// again what lies between, and ends as if it had never been stopped.

// What a stage came to.
struct StageOutcome {
  std::string doing;
  Solution solution;
  StageSummary summary;
  int iterations = 0, evaluations = 0;  // of the fit until then
  std::vector<HistoryEntry> history;    // of this stage
};

class StageLog {
 public:
  virtual ~StageLog() = default;
  // What the next stage, of this name, came to before; nothing after the last.
  virtual std::optional<StageOutcome> Next(const std::string& doing) = 0;
  virtual void Keep(const StageOutcome& outcome) = 0;
};

// FitLevenbergMarquardt (fit.h) with its stages kept in a log.
Fit FitLevenbergMarquardt(const ShootingProblem& problem, StageLog* log);

}  // namespace sysid
