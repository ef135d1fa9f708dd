#pragma once

#include "sysid/session/session.h"

namespace sysid {

// How to fit, from request and specification; the request wins. All throw
// InputError at the place of what is wrong.

// Throws InputError at the flag for a word that is none of its KnownWords(),
// but for the empty one, which is not given.
void CheckWord(const std::string& name, const std::string& word);
// Words of flags and keys as values; throw InputError at the flag.
RobustLoss ParseLoss(const std::string& word);
RunStart ParseStart(const std::string& word);
std::string ToString(RunStart start);
OrientationResidual ParseOrientation(const std::string& word);
CheckLevel ParseCheckLevel(const std::string& word);

// Solver, options and checks, as far as they do not depend on the runs.
void FillOptions(const FitRequest& request, const FitSpecification& spec,
                 Session* session);

// The integration step and the length of segments, as they suit the session's
// runs. A step that is longer than the samples are apart is cut to that, and a
// segment to the longest run, with a notice.
void FillLengths(const FitRequest& request, const FitSpecification& spec,
                 Session* session);

// Says of the session's runs how they begin, where that is said of all (runs in
// memory may say it themselves). Throws InputError for one that
// begins as known, but whose first row lacks a position or velocity.
void FillStart(const FitRequest& request, const FitSpecification& spec,
               Session* session);

// FitRequest::time, s; infinity where there is none. Throws InputError for one
// that is not positive.
double DurationOf(const FitRequest& request);
// Of that for the work itself; the rest is for the reports.
inline constexpr double kShareOfWork = 0.9;
// What a result says of its end by that.
std::string OutOfTime(double seconds);

}  // namespace sysid
