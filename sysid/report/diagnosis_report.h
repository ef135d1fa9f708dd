#pragma once

#include <string>

#include "sysid/diagnosis/diagnose.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/session/next_experiment.h"

namespace sysid {

// A diagnosis as people and programs read it. Everything here turns numbers
// into text; nothing computes.

// What to put into the model next: the effects that were added, or else the
// first candidate where it was accepted; and what of their parameters to hold,
// for the data does not tell of it. Comma separated, as --add and --fix take
// them.
struct NextStep {
  std::string add, fix;
  std::string solver;  // a flag more, where the motion is not to be fitted
};
NextStep ChooseNext(const Session& session, const Diagnosis& diagnosis);

// What to type next.
struct NextCommands {
  std::string fit;         // with what was found
  std::string formula;     // with the first of the proposals; empty: none
  std::string experiment;  // simulates a motion that would decide between the
                           // rivals; empty where there is none
  // What that would show; where there is none, why. Empty without rivals.
  std::string experiment_words;
};

// What an experiment would show, and what to do with it; or why there is none.
std::string ExperimentWords(const NextExperiment& experiment);

// The verdict in words.
std::string DiagnosisSentence(const Diagnosis& diagnosis);

// Where the search ended, and what became of that model when it was fitted to
// whole runs; and whether all of that is at the noise.
std::string EndSentence(const Diagnosis& diagnosis, const FinalFit& final);
bool EndsWell(const Diagnosis& diagnosis, const FinalFit& final);

// diagnosis.json of docs/interface.md section 6.
std::string DiagnosisJson(const Session& session, const Diagnosis& diagnosis,
                          const FinalFit* final, const NextCommands& next);

// The same on the terminal: verdict first, then where, which, what was added,
// and the next command as the last line.
std::string DiagnosisText(const Session& session, const Diagnosis& diagnosis,
                          const FinalFit* final, const NextCommands& next,
                          bool colour);

}  // namespace sysid
