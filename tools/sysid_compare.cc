// Fits by Levenberg-Marquardt, Adam and a mixture of Gaussians, and compares
// how they get there (docs/interface.md section 1).

#include <cmath>
#include <cstdio>
#include <utility>

#include "gflags/gflags.h"
#include "models/error.h"
#include "sysid/estimation/time_limit.h"
#include "sysid/io/csv.h"
#include "sysid/io/write_file.h"
#include "sysid/report/comparison_report.h"
#include "sysid/session/check_session.h"
#include "sysid/session/free_choice.h"
#include "sysid/session/named_values.h"
#include "sysid/session/session_options.h"
#include "sysid/session/shared_runs.h"
#include "sysid/session/stochastic_session.h"
#include "sysid/stochastic/rollout_gradient.h"
#include "tools/fit_flags.h"
#include "tools/on_processes.h"
#include "tools/program.h"
#include "tools/stochastic_flags.h"

DEFINE_string(truth, "", "values known to be right, name=value");
DEFINE_string(figure, "", "figure to write, SVG");
DEFINE_int32(repeat, 1, "starts to compare from");
DEFINE_double(start_spread, 0.2, "of further starts, in parts of a size");
DECLARE_string(solver);

namespace sysid {
namespace {

constexpr char kHelp[] =
    R"(sysid_compare: Levenberg-Marquardt, Adam and a Gaussian mixture compared

  sysid_compare --model pendulum2 --traj data/runs/figure1.csv \
    --truth link1.length=0.81,link2.length=0.304 --figure figure.svg

  --model NAME|FILE.urdf  --traj A.csv,'d/*.csv',@LISTFILE  --spec FILE.yaml
  --free a,b=0.5  --fix c=1  --add effect@target,...  --columns n=expr,...
  --lock joint=0.3,...
  --integrator rk4|semi_implicit_euler|ros2  --step S  --segment S  --noise S
  --residual heading|rotation  --shift  --ignore  --threads N  --skip_bad_runs
                             as of sysid_fit
  --learning_rate 0.1  --schedule cosine|exponential|constant  --epochs 150
  --huber D  --from_rest  --kernels 3  --draws 16  --spread 0.3  --online
                             of Adam and the mixture, as of sysid_fit
  --time S                   at most so long, s: the starts that ended by then
  --truth a=1,b=2            true values, if known: distances are to these
                             (default: to what Levenberg-Marquardt finds)
  --repeat N                 N starts and seeds: the given start, then others
  --start_spread 0.2         drawn about it, in parts of a parameter's size
  --seed N                   every random draw derives from it
  --figure FILE.svg          loss against iteration and time, paths, deviations;
                             of two parameters the likelihood on a grid
  --json FILE|-              machine-readable result
  --out DIR                  comparison.json, comparison.svg
Ctrl-C gives what there is of the comparison, once more ends at once.
mpirun -n 8 sysid_compare ... shares out the starts: docs/processes.md.
Exit code: 0 done, 1 a solver has no usable result, 2 bad input.
)";

// --truth for every free parameter.
std::optional<Eigen::VectorXd> ReadTruth(const Session& session) {
  if (FLAGS_truth.empty()) return std::nullopt;
  Eigen::VectorXd truth =
      Eigen::VectorXd::Constant(session.free.size(), std::nan(""));
  std::vector<std::string> names;
  for (const FreeParameter& free : session.free) {
    names.push_back(free.parameter.name);
  }
  for (const NamedValue& named : SplitAssignments(FLAGS_truth, "--truth")) {
    const auto at = std::find(names.begin(), names.end(), named.name);
    if (at == names.end()) {
      throw InputError("--truth", "'" + named.name + "' is not free",
                       NameHint(named.name, names));
    }
    if (!named.value) {
      throw InputError("--truth", "'" + named.name + "' has no value",
                       "write " + named.name + "=value");
    }
    CheckValue(session.model, session.free[at - names.begin()].parameter,
               *named.value, "--truth");
    truth[at - names.begin()] = *named.value;
  }
  for (int i = 0; i < truth.size(); ++i) {
    if (!std::isnan(truth[i])) continue;
    throw InputError("--truth", "says nothing of '" + names[i] + "'",
                     "give all of " + Join(names) + ", or none");
  }
  return truth;
}

ComparisonOptions OptionsFromFlags(const Session& session) {
  ComparisonOptions options;
  options.adam = AdamOptionsFromFlags();
  options.mixture = MixtureOptionsFromFlags();
  options.truth = ReadTruth(session);
  CheckCount("repeat", FLAGS_repeat, 10000);
  CheckPositive("start_spread", FLAGS_start_spread, 3.0);
  options.repeat = FLAGS_repeat;
  options.start_spread = FLAGS_start_spread;
  return options;
}

void CheckFigure(const FitRequest& request) {
  if (FLAGS_figure.empty()) return;
  CheckIsNoInput("--figure", FLAGS_figure, request.traj);
  if (!FLAGS_figure.ends_with(".svg")) {
    throw InputError("--figure", "'" + FLAGS_figure + "' is no .svg",
                     "the figure is written as SVG: name it figure.svg");
  }
  CheckWritableFile(FLAGS_figure);
}

int Main(ProcessGroup* group) {
  constexpr std::pair<const char*, const char*> kOfOthers[] = {
      {"solver", "all three solvers are compared"},
      {"holdout", "sysid_fit predicts held-out runs"},
      {"loss",
       "all three minimise squares; --huber bends those of Adam and the "
       "mixture"}};
  for (const auto& [flag, hint] : kOfOthers) {
    if (!FlagGiven(flag)) continue;
    throw InputError(std::string("--") + flag, "has no meaning here", hint);
  }
  if (!HaveStanMath()) {
    throw InputError("sysid_compare", "this build has no Adam and no mixture",
                     kStanMathHint);
  }
  const Catalogue catalogue;
  FitRequest request = RequestFromFlags();
  // Whatever a specification says: all solvers minimise the same.
  request.solver = "lm";
  request.loss = RobustLoss::kNone;
  if (group != nullptr && request.threads == 0) {
    request.threads = group->CoresEach();
  }
  Session session = OpenSession(request, catalogue);
  ComparisonOptions options = OptionsFromFlags(session);
  CheckMixtureSize(session, options.mixture);
  const Processes& all = group != nullptr ? *group : Alone();
  const bool is_first = all.rank() == 0;
  options.helpers = &all;
  DoAlike(all, [&] {
    if (!is_first) return;
    CheckOutputs(request, session);
    CheckFigure(request);
  });
  Watch watch(&session.options);
  const TimeLimit limit(session.options.stop,
                        kShareOfWork * DurationOf(request));
  session.options.stop = limit.stop();
  CheckSessionNumbers(&session);
  NoteMovedStarts(&session);
  PrintNotices(session.notices, session.run_names);
  const ShootingProblem problem(session.model, session.free, session.runs,
                                session.options);
  Comparison comparison = CompareSolvers(problem, options);
  comparison.stopped_by = limit.stopped_by();
  if (group != nullptr) group->Finish();
  if (!is_first) return kExitDone;
  watch.ClearLine();
  // The comparison begins with Levenberg-Marquardt.
  PrintNotices(session.notices, session.run_names,
               CheckSessionData(
                   &session, OutcomeOf(comparison.runs.front().fit, problem)));
  const std::string json = ComparisonJson(session, comparison);
  const std::string figure = ComparisonFigure(session, comparison);
  GiveResult(
      [&] {
        if (!FLAGS_out.empty()) {
          WriteIntoFolder("comparison.json", json);
          WriteIntoFolder("comparison.svg", figure);
        }
        if (!FLAGS_figure.empty()) WriteFileAtomically(FLAGS_figure, figure);
      },
      json, [&] { return ComparisonText(session, comparison); });
  watch.SayKept("what there is of the comparison",
                WritesFiles() || !FLAGS_figure.empty());
  const int starts = static_cast<int>(comparison.trials.size());
  if (starts < comparison.asked) {
    const bool out_of_time = comparison.stopped_by == StoppedBy::kTime;
    std::fprintf(stderr, "%s after %d of %d starts\n",
                 out_of_time ? "note: out of time" : "error: interrupted",
                 starts, comparison.asked);
    if (!out_of_time) return kExitNoResult;
  }
  for (const SolverRun& run : comparison.runs) {
    if (run.fit.converged) continue;
    std::fprintf(stderr, "error: no usable result of %s: %s\n",
                 run.solver.c_str(), run.fit.termination.c_str());
    return kExitNoResult;
  }
  return kExitDone;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  return sysid::RunOnProcesses(argc, argv, sysid::kHelp, sysid::Main);
}
