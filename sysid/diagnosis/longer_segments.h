#pragma once

#include <functional>
#include <optional>
#include <string>

#include "sysid/diagnosis/evaluated_model.h"

namespace sysid {

// A model that is right can be followed for longer, and what is too small for a
// segment adds up over a longer one.

// What is being done, and the error so far.
using ReportDoing = std::function<void(const std::string& doing, double error)>;

// Whether a fit converged to what leaves less than half of the motion (or
// nothing but noise). Beyond, errors grow no more, as large as they are, and
// what is missing is not linear in them.
bool Follows(const EvaluatedModel& evaluated);

// The model in segments twice as long, where its motion can be followed so far
// (kMostIterationsToFollow); nothing where it cannot, or where too few segments
// would be left.
std::optional<EvaluatedModel> Lengthen(const DiagnosisProblem& problem,
                                       const EvaluatedModel& now,
                                       const ReportDoing& report);

// The same up to a length, s; nothing where its motion is not followed so far.
std::optional<EvaluatedModel> LengthenTo(const DiagnosisProblem& problem,
                                         double length, EvaluatedModel now);

// Segments are of whole samples and equal in a run: whether one is as long as
// another but for that.
bool IsAsLong(double segment_s, double length);

// The model from whole trajectories, where its states may be caught in wrong
// ones; nothing where that does not help.
std::optional<EvaluatedModel> FromWholeRuns(const DiagnosisProblem& problem,
                                            const EvaluatedModel& now,
                                            const ReportDoing& report);

// A model with all runs, those that are held out too; whole again where their
// ends were.
ShootingProblem WithAllRuns(const DiagnosisProblem& problem,
                            const EvaluatedModel& evaluated);
// Its fit as one trajectory a run; nothing where that cannot follow the motion.
std::optional<Fit> FitWholeRuns(const ShootingProblem& all,
                                const EvaluatedModel& evaluated);

}  // namespace sysid
