#pragma once

#include <string>
#include <vector>

#include "sysid/diagnosis/candidate_refits.h"

namespace sysid {

// Models and refits as bytes (CBOR, RFC 8949) for another process that has the
// same problem and the same candidates; numbers to their last bit.

std::string Pack(const EvaluatedModel& model);
EvaluatedModel UnpackModel(const std::string& bytes,
                           const DiagnosisProblem& problem,
                           const Candidates& candidates);

// What is to be refitted: without `after`.
std::string Pack(const std::vector<CandidateRefit>& refits);
std::vector<CandidateRefit> UnpackRefits(const std::string& bytes,
                                         const Candidates& candidates);

}  // namespace sysid
