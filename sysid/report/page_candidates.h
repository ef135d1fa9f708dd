#pragma once

#include <string>

#include "sysid/report/page_data.h"

namespace sysid {

// The parts of the page's document that a diagnosis says.

// What a step did: "+ a@j", "- b@k", or both.
std::string ChangeTitle(const DiagnosisStep& step);

// ModelData.candidates.
Json CandidatesJson(const PageSource& source, const Diagnosis& diagnosis);
// ModelData.force.
Json ForcesJson(const Where& where);

}  // namespace sysid
