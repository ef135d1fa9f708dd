// Says where a model fails and which effect is missing (docs/interface.md
// section 1).

#include <unistd.h>

#include <cstdio>
#include <string>

#include "gflags/gflags.h"
#include "models/error.h"
#include "sysid/api/diagnose.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/fit_report.h"
#include "sysid/session/named_values.h"
#include "tools/fit_flags.h"
#include "tools/on_processes.h"
#include "tools/program.h"

DEFINE_bool(auto, false, "add effects until nothing is missing");
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
  --time S                   at most so long, s: what was judged by then
                             (default: with --auto 300)
  --json FILE|-              machine-readable result
  --out DIR                  report.html to look at, diagnosis.json, fit.json,
                             prediction.csv, identified.urdf
Ctrl-C gives what was judged so far, once more ends at once.
Exit code: 0 done, 1 no usable result, 2 bad input.
)";

DiagnoseRequest DiagnoseRequestFromFlags(ProcessGroup* group, Watch* watch) {
  DiagnoseRequest request;
  static_cast<FitRequest&>(request) = RequestFromFlags();
  request.candidates = SplitEffects(FLAGS_candidates, "--candidates");
  request.add_found = FLAGS_auto;
  request.fit_whole_runs = !FLAGS_out.empty();
  if (group != nullptr) {
    request.started_with = group->shared_from_this();
    if (request.threads == 0) request.threads = group->CoresEach();
  }
  request.callbacks = CallbacksFromFlags(request, group, watch);
  return request;
}

// What to type next.
NextCommands CommandsAfter(const DiagnoseResult& result) {
  NextCommands next;
  next.fit = CommandFromFlags("sysid_fit") +
             FlagWith("add", AddText(result.next)) +
             FlagWith("fix", FixText(result.next)) + SolverText(result.next);
  if (!result.diagnosis.proposals.empty()) {
    next.formula =
        CommandFromFlags("sysid_fit") +
        FlagWith("add",
                 Join(result.diagnosis.proposals.front().effects(), ","));
  }
  if (!result.experiment) return next;
  next.experiment_words = ExperimentWords(*result.experiment);
  if (!result.experiment->flags.empty()) {
    next.experiment = SimulationFromFlags(result.session, *result.experiment);
  }
  return next;
}

void WriteOutputs(const DiagnoseResult& result, const NextCommands& next,
                  const std::string& json) {
  WriteIntoFolder("diagnosis.json", json);
  if (result.final) {
    WriteModelFiles(ShowFinal(*result.final, 0));
  } else {
    std::fprintf(stderr,
                 "note: stopped before the last fit: fit.json, "
                 "prediction.csv and identified.urdf are not written\n");
  }
  PageSource source = PageFromFlags("sysid_diagnose", result.session);
  source.train = result.problem.train.get();
  source.holdout = result.problem.holdout.get();
  source.experiment = next.experiment;
  source.experiment_words = next.experiment_words;
  WriteReport([&] { return DiagnosisPage(source, result); });
}

int Main(ProcessGroup* group) {
  Watch watch;
  const DiagnoseResult result =
      Diagnose(DiagnoseRequestFromFlags(group, &watch));
  if (group != nullptr) group->Finish();
  if (result.is_elsewhere) return kExitDone;
  for (const UndoneFault& fault : result.session.undone) {
    AdoptFlag(fault.flag, fault.value);
  }
  watch.ClearLine();
  PrintNotices(result.session.notices, result.session.run_names,
               result.notices_when_ready);
  const NextCommands next = CommandsAfter(result);
  const std::string json = DiagnosisJson(result, next);
  GiveResult(
      [&] {
        if (!FLAGS_out.empty()) WriteOutputs(result, next, json);
      },
      json,
      [&] {
        // The terminal of a process of mpirun is one, wherever mpirun's goes.
        const bool colour = group == nullptr && isatty(STDOUT_FILENO) == 1;
        return DiagnosisText(result, next, colour);
      });
  const Diagnosis& diagnosis = result.diagnosis;
  if (diagnosis.stopped_by == StoppedBy::kUser) {
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
