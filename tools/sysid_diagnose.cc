// Says where a model fails and which effect is missing (docs/interface.md
// section 1).

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "gflags/gflags.h"
#include "models/error.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/io/write_file.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/fit_report.h"
#include "sysid/session/check_session.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/session/named_values.h"
#include "tools/fit_flags.h"
#include "tools/interrupt.h"
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
  --traj A.csv,B.csv         recordings, fitted together
  --holdout C.csv            recordings that decide which effect is believed
                             (default: the last quarter of every run)
  --auto                     add the best effect, refit, and look again, until
                             nothing is missing
  --candidates a,b@joint1    effects to consider, by kind or with a target
                             (default: every effect on every joint and link)
  --spec FILE.yaml           what to fit (default: MODEL.sysid.yaml beside it)
  --free a,b=0.5  --fix c=1  parameters to fit (from a start), to hold (at);
                             what is fixed by name is taken for right
  --add effect@target,...    effects that are in the model already
  --columns n=expr,...       foreign columns: t=time_ms*0.001,joint2.q=b-a
                             (of one run: b.csv/joint2.q=-b; below alike)
  --shift joint1.q=0.01      a column that was recorded late, by seconds
  --ignore joint1.q@12:14.5  measurements that are taken as missing
  --integrator rk4|semi_implicit_euler    --step S (default: from the noise)
  --segment S                length of a shooting segment (default: chosen)
  --noise S                  of a measurement, rad or m (default: estimated)
  --residual heading|rotation    --loss none|huber|cauchy
  --threads N (default: all cores)    --seed N
  --json FILE|-              machine-readable result
  --out DIR                  report.html to look at, diagnosis.json, fit.json,
                             prediction.csv, identified.urdf
Ctrl-C gives what was judged so far, once more ends at once.
Exit code: 0 done, 1 no usable result, 2 bad input.
)";

void WriteOutputs(const PageSource& source, const DiagnosisProblem& problem,
                  const Diagnosis& diagnosis, const FinalFit* final,
                  const std::string& json) {
  const std::filesystem::path out = FLAGS_out;
  WriteFileAtomically((out / "diagnosis.json").string(), json);
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

int Main() {
  const double start_s = Now();
  const bool to_stdout = IsStdout(FLAGS_json);
  const Catalogue catalogue;
  FitRequest request = RequestFromFlags();
  request.may_free_nothing = true;
  Session session = OpenSession(request, catalogue);
  const auto candidates = ChooseCandidates(
      catalogue, session.model.mechanism(),
      SplitList(FLAGS_candidates, "--candidates"), "--candidates");
  DiagnosisProblem problem = OpenDiagnosis(session, &session.notices);
  CheckOutputs(request, session);
  const Interrupt interrupt;
  session.options.stop = problem.options.stop = interrupt.token();
  CheckSessionNumbers(&session);
  PrintNotices(session.notices);
  session.options.keep_best = true;
  ProgressLine line;
  session.options.progress = [&](const Progress& p) { line.Show(p); };
  problem.options.progress = session.options.progress;
  DiagnosisOptions options;
  options.add = FLAGS_auto;
  options.keep_evaluated = true;
  Diagnosis diagnosis = Diagnose(problem, candidates, options);
  std::optional<FinalFit> final;
  if ((FLAGS_auto || !FLAGS_out.empty()) && diagnosis.interrupted.empty()) {
    final = FitFinalUnlessInterrupted(session, problem, &diagnosis);
  }
  line.Clear();
  PrintNotices(session.notices,
               CheckSessionData(&session, OutcomeOf(diagnosis)));
  if (final) {
    final->session.findings = session.findings;
    // All that passed, the search and the checks too.
    final->fit.wall_time_s = Now() - start_s;
    final->fit.cpu_time_s = CpuSeconds();
  }
  const FinalFit* fitted = final ? &*final : nullptr;
  const NextStep step = ChooseNext(diagnosis, fitted);
  const std::string next = CommandFromFlags("sysid_fit") +
                           FlagWith("add", step.add) +
                           FlagWith("fix", step.fix);
  const std::string json = DiagnosisJson(session, diagnosis, fitted, next);
  FileOutputs files;
  if (!FLAGS_out.empty()) {
    PageSource source = PageFromFlags("sysid_diagnose", session);
    if (FLAGS_auto) source.command += " --auto";
    source.train = problem.train.get();
    source.holdout = problem.holdout.get();
    files.Write(
        [&] { WriteOutputs(source, problem, diagnosis, fitted, json); });
  }
  if (to_stdout) {
    WriteStdout(json);
  } else {
    files.Write([&] {
      if (!FLAGS_json.empty()) WriteFileAtomically(FLAGS_json, json);
    });
    WriteStdout(DiagnosisText(session, diagnosis, fitted, next,
                              isatty(STDOUT_FILENO) == 1));
  }
  files.Rethrow();
  if (!diagnosis.interrupted.empty()) {
    interrupt.SayKept("what was judged so far", WritesFiles());
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
  return sysid::RunProgram(argc, argv, sysid::kHelp, sysid::Main);
}
