#pragma once

#include <string>

#include "sysid/api/diagnose.h"
#include "sysid/diagnosis/diagnose.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/session/next_experiment.h"

namespace sysid {

// A diagnosis as people and programs read it. Everything here turns numbers
// into text; nothing computes.

// A step as flags say it: its effects and what to hold, comma separated, as
// --add and --fix take them; and " --solver NAME", or nothing.
std::string AddText(const NextStep& step);
std::string FixText(const NextStep& step);
std::string SolverText(const NextStep& step);

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

// Both of a result.
std::string DiagnosisJson(const DiagnoseResult& result,
                          const NextCommands& next);
std::string DiagnosisText(const DiagnoseResult& result,
                          const NextCommands& next, bool colour);

}  // namespace sysid
