#pragma once

#include <vector>

#include "sysid/diagnosis/candidate_refits.h"

namespace sysid {

// Refits of proposals, shared out among DiagnosisProblem::helpers. Each of
// these processes has all runs. The first one searches and decides alone: it
// gives the others a model and what to add to it, they give back what came of
// it, to the last bit.

// Refits, and says which are refused. By the first process alone.
void RefitProposals(const DiagnosisProblem& problem,
                    const Candidates& candidates, const EvaluatedModel& before,
                    std::vector<CandidateRefit>* refits);

// The part of the others: does what the first one asks for, until its
// HelpersWanted ends.
void HelpToRefit(const DiagnosisProblem& problem, const Candidates& candidates);

// As long as it lives, the helpers wait for work.
class HelpersWanted {
 public:
  explicit HelpersWanted(const Processes& all) : all_(all) {}
  ~HelpersWanted() { all_.Share(""); }
  HelpersWanted(const HelpersWanted&) = delete;
  HelpersWanted& operator=(const HelpersWanted&) = delete;

 private:
  const Processes& all_;
};

}  // namespace sysid
