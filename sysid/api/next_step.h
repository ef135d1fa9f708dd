#pragma once

#include <string>
#include <vector>

#include "sysid/diagnosis/diagnose.h"
#include "sysid/session/session.h"

namespace sysid {

// What to put into a model that was diagnosed: the effects that were added, or
// else the first candidate where it was accepted; and what of their parameters
// to hold, for the data does not tell of it, or since it is no number that a
// fit could move.
struct NextStep {
  std::vector<std::string> add;
  std::vector<NamedValue> fix;
  std::string solver;  // where the motion is not to be fitted; else empty
};
NextStep ChooseNext(const Session& session, const Diagnosis& diagnosis);

// The request with that in it.
FitRequest WithStep(FitRequest request, const NextStep& step);

}  // namespace sysid
