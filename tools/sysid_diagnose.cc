// Says where a model fails and which effect is missing (docs/interface.md
// section 1).

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <optional>

#include "gflags/gflags.h"
#include "models/error.h"
#include "sysid/diagnosis/shared_refits.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/fit_report.h"
#include "sysid/session/check_session.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/session/named_values.h"
#include "sysid/session/shared_runs.h"
#include "tools/fit_flags.h"
#include "tools/on_processes.h"
#include "tools/program.h"

DEFINE_bool(auto, false, "add effects until nothing is missing");
DEFINE_bool(sets, false, "by the search over sets of effects");
DEFINE_string(candidates, "", "effects to consider; all where not given");

namespace sysid {
namespace {

constexpr char kHelp[] =
    R"(sysid_diagnose: where a model fails, and which effect is missing

  sysid_diagnose --model pendulum2_planar --traj a.csv,b.csv --holdout c.csv \
    --auto --out result

  --model NAME|FILE.urdf     a shipped model (pendulum1..3, pendulum2_planar,
                             pendulum3_planar, cartpole, arm7) or a URDF
  --traj A.csv,B.csv         recordings, fitted together; 'd/*.csv', @LISTFILE
  --holdout C.csv            recordings not fitted, which decide between effects
                             (default: the last quarter of every run)
  --auto                     add the best effect, refit, and look again, until
                             nothing is missing
)";

constexpr char kHelpOnResults[] =
    R"(  --check none|numbers|all   of the recordings (default: all)
  --json FILE|-              machine-readable result
  --out DIR                  report.html to look at, diagnosis.json, fit.json,
                             prediction.csv, identified.urdf
Ctrl-C gives what was judged so far, once more ends at once.
mpirun -n 6 sysid_diagnose ... shares out candidate refits: docs/processes.md.
Exit code: 0 done, 1 no usable result, 2 bad input.
)";

void WriteOutputs(const PageSource& source, const DiagnosisProblem& problem,
                  const Diagnosis& diagnosis, const FinalFit* final,
                  const std::string& json) {
  WriteIntoFolder("diagnosis.json", json);
  if (final != nullptr) {
    WriteModelFiles(ShowFinal(*final, 0));
  } else {
    std::fprintf(stderr,
                 "note: interrupted before the last fit: fit.json, "
                 "prediction.csv and identified.urdf are not written\n");
  }
  WriteReport([&] { return DiagnosisPage(source, problem, diagnosis, final); });
}

// The last fit, as far as it came; none where that is nowhere.
std::optional<FinalFit> FitFinalUnlessInterrupted(
    const Session& session, const DiagnosisProblem& problem,
    Diagnosis* diagnosis) {
  std::optional<FinalFit> final;
  try {
    final = FitFinal(session, problem, *diagnosis);
    if (final->fit.converged || !session.options.stop.stop_requested()) {
      return final;
    }
  } catch (const Cancelled&) {
  }
  diagnosis->interrupted = "fitting whole runs, the last step";
  diagnosis->doubts.push_back("interrupted while " + diagnosis->interrupted);
  return final;
}

std::optional<NextExperiment> ChooseExperimentUnlessInterrupted(
    const Catalogue& catalogue, const Session& session,
    const DiagnosisProblem& problem, Diagnosis* diagnosis) {
  try {
    return ChooseExperiment(catalogue, session, problem, *diagnosis);
  } catch (const Cancelled&) {
    diagnosis->interrupted = "choosing the next experiment";
    return std::nullopt;
  }
}

// Whether something is left to explain: what an effect explains is no fault of
// the data.
FitOutcome OutcomeOf(const Diagnosis& diagnosis) {
  FitOutcome outcome = OutcomeOf(diagnosis.base.fit, *diagnosis.base.problem);
  outcome.error = std::min(outcome.error, diagnosis.last().train_error());
  for (const CandidateEffect& candidate : diagnosis.candidates) {
    if (!candidate.confirmed || !candidate.confirmed->accepted) continue;
    outcome.error = std::min(outcome.error, candidate.confirmed->train);
  }
  return outcome;
}

// The others help until it is through.
Diagnosis DiagnoseTogether(const DiagnosisProblem& problem,
                           const Candidates& candidates,
                           const DiagnosisOptions& options) {
  const HelpersWanted helpers(*problem.helpers);
  return Diagnose(problem, candidates, options);
}

int Main(ProcessGroup* group) {
  const double start_s = Now();
  const Catalogue catalogue;
  FitRequest request = RequestFromFlags();
  request.candidates = FLAGS_candidates;
  request.may_free_nothing = true;
  request.assumes_inertia = true;
  if (group != nullptr && request.threads == 0) {
    request.threads = group->CoresEach();
  }
  Session session = OpenSession(request, catalogue);
  const auto candidates = ChooseCandidates(
      catalogue, session, SplitEffects(request.candidates, "--candidates"),
      "--candidates", FLAGS_sets);
  DiagnosisProblem problem = OpenDiagnosis(session, &session.notices);
  const Processes& all = group != nullptr ? *group : Alone();
  const bool is_first = all.rank() == 0;
  DoAlike(all, [&] {
    if (is_first) CheckOutputs(request, session);
  });
  problem.helpers = &all;
  Watch watch(&session.options);
  problem.options.stop = session.options.stop;
  problem.options.progress = session.options.progress;
  CheckSessionNumbers(&session);
  PrintNotices(session.notices, session.run_names);
  DiagnosisOptions options;
  options.add = FLAGS_auto;
  options.keep_evaluated = true;
  options.by_sets = FLAGS_sets;
  if (!is_first) {
    HelpToRefit(problem, candidates);
    SumOver(all, CpuSeconds());
    group->Finish();
    return kExitDone;
  }
  Diagnosis diagnosis = DiagnoseTogether(problem, candidates, options);
  const double helpers_cpu_s = SumOver(all, 0.0);
  if (group != nullptr) group->Finish();
  std::optional<FinalFit> final;
  if ((FLAGS_auto || !FLAGS_out.empty()) && diagnosis.interrupted.empty()) {
    final = FitFinalUnlessInterrupted(session, problem, &diagnosis);
  }
  std::optional<NextExperiment> experiment;
  if (diagnosis.interrupted.empty()) {
    experiment = ChooseExperimentUnlessInterrupted(catalogue, session, problem,
                                                   &diagnosis);
  }
  watch.ClearLine();
  PrintNotices(session.notices, session.run_names,
               CheckSessionData(&session, OutcomeOf(diagnosis)));
  if (final) {
    final->session.findings = session.findings;
    // All that passed, the search and the checks too.
    final->fit.wall_time_s = Now() - start_s;
    final->fit.cpu_time_s = CpuSeconds() + helpers_cpu_s;
    if (group != nullptr) final->fit.processes = all.size();
  }
  const FinalFit* fitted = final ? &*final : nullptr;
  const NextStep step = ChooseNext(session, diagnosis);
  NextCommands next;
  next.fit = CommandFromFlags("sysid_fit") + FlagWith("add", step.add) +
             FlagWith("fix", step.fix) + step.solver;
  if (!diagnosis.proposals.empty()) {
    next.formula =
        CommandFromFlags("sysid_fit") +
        FlagWith("add", Join(diagnosis.proposals.front().effects(), ","));
  }
  if (experiment) {
    next.experiment_words = ExperimentWords(*experiment);
    if (!experiment->flags.empty()) {
      next.experiment = SimulationFromFlags(session, *experiment);
    }
  }
  const std::string json = DiagnosisJson(session, diagnosis, fitted, next);
  PageSource source = PageFromFlags("sysid_diagnose", session);
  source.train = problem.train.get();
  source.holdout = problem.holdout.get();
  source.experiment = next.experiment;
  source.experiment_words = next.experiment_words;
  GiveResult(
      [&] {
        if (FLAGS_out.empty()) return;
        WriteOutputs(source, problem, diagnosis, fitted, json);
      },
      json,
      [&] {
        // That of a process of mpirun is one, wherever mpirun's goes.
        const bool colour = group == nullptr && isatty(STDOUT_FILENO) == 1;
        return DiagnosisText(session, diagnosis, fitted, next, colour);
      });
  if (!diagnosis.interrupted.empty()) {
    watch.SayKept("what was judged so far", WritesFiles());
    std::fprintf(stderr, "error: no usable result: interrupted while %s\n",
                 diagnosis.interrupted.c_str());
    return kExitNoResult;
  }
  if (!diagnosis.usable) {
    std::fprintf(stderr, "error: no usable result: %s\n",
                 diagnosis.doubts.empty() ? "the fit failed"
                                          : diagnosis.doubts.front().c_str());
    return kExitNoResult;
  }
  return kExitDone;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  return sysid::RunOnProcesses(argc, argv,
                               std::string(sysid::kHelp) +
                                   sysid::kDiagnosisFlagsHelp +
                                   sysid::kHelpOnResults,
                               sysid::Main);
}
