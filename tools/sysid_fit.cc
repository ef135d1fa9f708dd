// Fits the free parameters of a model to recordings
// (docs/interface.md section 1).

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "gflags/gflags.h"
#include "models/error.h"
#include "models/urdf/write_urdf.h"
#include "sysid/diagnosis/discrepancy.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/inverse_dynamics/effort_comparison.h"
#include "sysid/inverse_dynamics/fitted_base.h"
#include "sysid/io/cell.h"
#include "sysid/io/memory.h"
#include "sysid/report/fit_report.h"
#include "sysid/report/mixture_report.h"
#include "sysid/report/sampled_models.h"
#include "sysid/session/check_session.h"
#include "sysid/session/checkpoint.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/session/shared_runs.h"
#include "sysid/stochastic/solvers.h"
#include "tools/fit_flags.h"
#include "tools/on_processes.h"
#include "tools/program.h"
#include "tools/stochastic_flags.h"

DECLARE_uint64(seed);
DEFINE_int32(sample, 0, "URDFs to draw from what was fitted, into --out");
DEFINE_bool(resume, false, "go on with the fit whose checkpoint is in --out");

namespace sysid {
namespace {

constexpr char kHelp[] =
    R"(sysid_fit: identify a mechanism's parameters from recordings

  sysid_fit --model pendulum3 --traj data/runs/pendulum3.csv --out result

  --model NAME|FILE.urdf     a shipped model (pendulum1..3, pendulum2_planar,
                             pendulum3_planar, cartpole, arm7) or a URDF
  --traj A.csv,B.csv         recordings, fitted together; 'd/*.csv', @LISTFILE
  --holdout C.csv            recordings that are only predicted
  --spec FILE.yaml           what to fit (default: MODEL.sysid.yaml beside it)
  --free a,b=0.5  --fix c=1  parameters to fit (from a start), to hold (at):
                             names, inertial (all of each link), 'link*.mass';
                             --free none compares the model as it stands
  --add effect@target,...    effects to add ('viscous_damping@*');
                             docs/effects.md lists them, sysid_diagnose says
                             which is missing
  --columns n=expr,...       foreign columns: t=time_ms*0.001,joint2.q=b-a
                             (of one run: b.csv/joint2.q=-b; below alike)
  --shift joint1.q=0.01      a column that was recorded late, by seconds
  --ignore joint1.q@12:14.5  measurements that are taken as missing
  --lock 'wheel_*,head=0.3'  joints held still
  --solver lm|inverse_dynamics|adam|gmm    Levenberg-Marquardt; least squares on
                             the efforts (docs/inverse_dynamics.md); Adam, and
                             on a mixture of Gaussians (docs/stochastic.md)
    --learning_rate 0.1  --schedule cosine|exponential|constant  --epochs 150
    --huber D (rad, m; default: none, 0.1)  --from_rest    of adam and gmm
    --kernels 3  --draws 16  --spread 0.3  --online    of gmm
  --integrator rk4|semi_implicit_euler|ros2  --step S (default: from the noise)
  --segment S                length of a shooting segment (default: chosen)
  --noise S                  of a measurement, rad or m (default: estimated)
  --residual heading|rotation    --loss none|huber|cauchy
  --check none|numbers|all   of the recordings (default: all)
  --threads N (default: all cores)    --seed N    --skip_bad_runs
  --json FILE|-              machine-readable result
  --out DIR  --resume        report.html to look at, fit.json, prediction.csv,
                             identified.urdf; go on there with a killed fit
  --sample N                 also N URDFs and samples.csv there, drawn from the
                             estimate's normal distribution (gmm: its mixture)
Ctrl-C gives the best point so far, once more ends at once.
mpirun -n 8 sysid_fit ... (or srun) shares out the runs: docs/processes.md.
Exit code: 0 done, 1 no usable result, 2 bad input.
)";

// The fit for the page and the files.
PageFit Show(const Session& session, const ShootingProblem& problem,
             const Fit& fit, const Holdout* holdout, const AddedEffects* added,
             const MixtureFit* mixture) {
  PageFit shown;
  shown.title = "the fit";
  shown.session = &session;
  shown.problem = &problem;
  shown.fit = &fit;
  shown.holdout = holdout;
  shown.added = added;
  shown.mixture = mixture;
  shown.with_prediction_csv = true;
  shown.next_command = CommandFromFlags("sysid_diagnose") +
                       FlagWith("add", "") + FlagWith("fix", "");
  return shown;
}

// The names of what was written, in a line.
std::string WriteOutputs(const PageFit& fit) {
  if (ProcessesOf(fit.session->options).size() > 1) {
    std::vector<std::string> names;
    for (const ModelFile& file : ModelFiles()) {
      if (file.name == "prediction.csv") continue;
      WriteIntoFolder(file.name, ModelFileText(fit, file.name));
      names.push_back(file.name);
    }
    for (const ForceTableFile& file : ForceTableFiles(fit.fit->model)) {
      WriteIntoFolder(file.name, file.text);
      names.push_back(file.name);
    }
    bool had = false;  // of an earlier fit, which they would be taken for
    for (const char* const name : {"/prediction.csv", "/report.html"}) {
      had = std::filesystem::remove(FLAGS_out + name) || had;
    }
    std::fprintf(stderr,
                 "note: no prediction.csv and no report.html%s: each process "
                 "knows the samples of its own runs alone\n",
                 had ? " (those of an earlier fit are removed)" : "");
    return Join(names);
  }
  std::vector<std::string> names = WriteModelFiles(fit);
  PageSource source = PageFromFlags("sysid_fit", *fit.session);
  source.train = &fit.problem->data();
  source.holdout =
      fit.holdout == nullptr ? nullptr : &fit.holdout->problem->data();
  if (WriteReport([&] { return FitPage(source, fit); })) {
    names.push_back("report.html");
  }
  return Join(names);
}

// A draw a file: sample_1.urdf, ..., and all in samples.csv.
void WriteSamples(const SampledModels& samples) {
  for (size_t i = 0; i < samples.urdfs.size(); ++i) {
    WriteIntoFolder("sample_" + std::to_string(i + 1) + ".urdf",
                    samples.urdfs[i]);
  }
  WriteIntoFolder("samples.csv", samples.csv);
}

std::string SampleFiles(const SampledModels& samples) {
  const size_t count = samples.urdfs.size();
  if (count == 0) return "";
  return ", samples.csv, sample_1.urdf" +
         (count > 1 ? " to sample_" + std::to_string(count) + ".urdf" : "");
}

std::string SampleText(const SampledModels& samples, const Fit& fit) {
  std::string text;
  for (const std::string& remark : samples.remarks) {
    text += "  " + remark + "\n";
  }
  if (!samples.urdfs.empty() && !fit.converged) {
    text += "  the samples are drawn from a fit that has not converged\n";
  }
  return text;
}

void CheckSampling(const Session& session) {
  if (!FlagGiven("sample")) return;
  CheckCount("sample", FLAGS_sample, 100000);
  if (session.free.empty()) {
    throw InputError("--sample", "has nothing to draw: nothing is free",
                     "name parameters with --free");
  }
  if (FLAGS_out.empty()) {
    throw InputError("--sample", "has nowhere to write to",
                     "name a folder: --out DIR");
  }
}

// The shooting solver estimates states of a model as it stands, the equations
// of motion say what efforts it leaves; the others have nothing to do.
void CheckSomethingIsFitted(const Session& session) {
  const Solver& solver = FindSolver(session.solver);
  if (!session.free.empty() || solver.kind != SolverKind::kStochastic) return;
  throw InputError("--solver",
                   session.solver + " has nothing to fit: nothing is free",
                   "name parameters with --free, or compare the model as it "
                   "stands by --solver lm or inverse_dynamics");
}

// Only Levenberg-Marquardt keeps its stages.
void CheckResume(const Session& session) {
  if (!FLAGS_resume) return;
  if (FindSolver(session.solver).kind != SolverKind::kShooting) {
    throw InputError("--resume", session.solver + " keeps no checkpoints",
                     "leave it out; fits by lm keep them");
  }
  if (FLAGS_out.empty()) {
    throw InputError("--resume", "has no folder to go on in",
                     "name that of the fit which was ended: --out DIR");
  }
}

// Where a fit by Levenberg-Marquardt keeps its stages.
std::optional<Checkpoint> OpenCheckpoint(const Session& session,
                                         const ShootingProblem& problem) {
  if (FLAGS_out.empty() ||
      FindSolver(session.solver).kind != SolverKind::kShooting) {
    return std::nullopt;
  }
  std::optional<Checkpoint> checkpoint(
      std::in_place, FLAGS_out + "/checkpoint.cbor", problem, FLAGS_resume);
  if (FLAGS_resume) {
    const size_t stages = checkpoint->resumed();
    PrintNotices({stages > 0 ? "goes on after " + std::to_string(stages) +
                                   " stages of " + checkpoint->file()
                             : "there is no " + checkpoint->file() +
                                   ": the fit begins anew"});
  }
  return checkpoint;
}

// The samples are made before any is written: their URDFs and a line each.
void CheckSampleSize(const Session& session) {
  if (FLAGS_sample == 0) return;
  const double urdf = static_cast<double>(WriteUrdf(session.model).size());
  CheckMemory(FLAGS_sample * (urdf + 100.0 * session.free.size()), "--sample",
              "to draw that many URDFs", "draw fewer at a time, by --seed");
}

// What several processes do not do.
void CheckProcesses(FitRequest* request) {
  if (request->check != "all") return;
  if (FlagGiven("check")) {
    throw InputError(
        "--check", "hypotheses about the data are tested by one process alone",
        "--check numbers here, and sysid_check on some of the runs");
  }
  request->check = "numbers";
}

void CheckSharedSession(const Catalogue& catalogue, const Session& session) {
  if (session.solver != "lm") {
    throw InputError("--solver", session.solver + " fits by one process alone",
                     "--solver lm fits by many");
  }
  for (const std::string& name : session.added) {
    const auto effect =
        catalogue.Make(name, session.model.mechanism(), "--add");
    for (const EffectParameter& p : effect->parameters()) {
      if (!p.whole || std::find(session.fixed.begin(), session.fixed.end(),
                                p.name) != session.fixed.end()) {
        continue;
      }
      throw InputError(
          "--add", p.name + " of " + name + " is found by one process alone",
          "give it: --fix " + p.name + "=N");
    }
  }
}

// Says where a fit goes on that is interrupted before it has a point.
Solved SolveOrSay(const Solver& solver, const ShootingProblem& problem,
                  const SolverOptions& how,
                  const std::optional<Checkpoint>& checkpoint) {
  try {
    return solver.solve(problem, how);
  } catch (const Cancelled&) {
    if (checkpoint && std::filesystem::exists(checkpoint->file())) {
      PrintNotices({"the stages that ended are in " + checkpoint->file() +
                    ": --resume goes on from there"});
    }
    throw;
  }
}

int Main(ProcessGroup* group) {
  const double start_s = Now();
  const Catalogue catalogue;
  FitRequest request = RequestFromFlags();
  request.any_solver = true;
  request.may_free_nothing = true;
  const bool is_first = group == nullptr || group->rank() == 0;
  if (group != nullptr) {
    request.processes = group->shared_from_this();
    if (request.threads == 0) request.threads = group->CoresEach();
    CheckProcesses(&request);
  }
  Session session = OpenSession(request, catalogue);
  if (group != nullptr) CheckSharedSession(catalogue, session);
  CheckSolverFlags(session.solver);
  CheckSomethingIsFitted(session);
  CheckSampling(session);
  CheckResume(session);
  const Solver& solver = FindSolver(session.solver);
  SolverOptions how{AdamOptionsFromFlags(), MixtureOptionsFromFlags()};
  if (session.solver == "gmm") CheckMixtureSize(session, how.mixture);
  CheckSampleSize(session);
  const Processes& all = group != nullptr ? *group : Alone();
  DoAlike(all, [&] {
    if (is_first) CheckOutputs(request, session);
  });
  Watch watch(&session.options);
  if (group != nullptr) {
    session.options.stop = group->StopTogether(session.options.stop);
  }
  CheckSessionNumbers(&session);
  if (solver.kind == SolverKind::kStochastic) NoteMovedStarts(&session);
  PrintNotices(session.notices, session.run_names);
  // The trial is by Levenberg-Marquardt, of one process; the others start where
  // they are told, or where the equations of motion begin a fit.
  const std::optional<AddedEffects> added =
      solver.kind == SolverKind::kShooting && group == nullptr
          ? TryAddedEffects(catalogue, session)
          : std::nullopt;
  if (added) session = StartedFrom(*added, session);
  const ShootingProblem problem(session.model, session.free, session.runs,
                                session.options);
  std::optional<Checkpoint> checkpoint = OpenCheckpoint(session, problem);
  if (checkpoint) how.log = &*checkpoint;
  Solved solved = SolveOrSay(solver, problem, how, checkpoint);
  if (checkpoint && !checkpoint->trouble().empty()) {
    session.notices.push_back("the last stages are in no checkpoint: " +
                              checkpoint->trouble());
  }
  const Fit& fit = solved.fit;
  const std::optional<MixtureFit>& mixture = solved.mixture;
  std::shared_ptr<const DataSet> held_out;
  std::optional<Holdout> holdout;
  if (!AllTrue(all, session.holdout.empty())) {
    held_out = MakeDataSetLike(session.model, session.holdout, session.options,
                               problem.data());
    holdout = PredictHoldout(OpenHoldout(fit.model, held_out, session.options,
                                         fit.point.rollout, fit.segment_s));
    holdout->effort = CompareEfforts(*holdout->problem, {}).errors;
  }
  if (solver.kind == SolverKind::kEquations) {
    // Longer ones take longer than such a fit.
    constexpr double kLongestHorizon = 0.5;  // s
    solved.fit.horizon = EvaluateHorizon(problem, fit.point, kLongestHorizon);
  }
  if (solver.kind == SolverKind::kShooting) {
    AddDiscrepancy(problem, &solved.fit);
    AddBaseParameters(problem, &solved.fit);
  }
  watch.ClearLine();
  PrintNotices(session.notices, session.run_names,
               CheckSessionData(&session, OutcomeOf(fit, problem)));
  GatherErrors(all, &solved.fit.train);
  GatherOpen(all, &solved.fit.open);
  if (holdout) {
    GatherErrors(all, &holdout->errors);
    GatherOpen(all, &holdout->open);
  }
  // All that passed, reading and checking too.
  solved.fit.wall_time_s = Now() - start_s;
  solved.fit.cpu_time_s = SumOver(all, CpuSeconds());
  if (group != nullptr) {
    solved.fit.processes = group->size();
    group->Finish();
  }
  const Holdout* held = holdout ? &*holdout : nullptr;
  const AddedEffects* tried = added ? &*added : nullptr;
  const PageFit shown =
      Show(session, problem, fit, held, tried, mixture ? &*mixture : nullptr);
  const std::string json = ModelFileText(shown, "fit.json");
  SampledModels samples;
  if (FLAGS_sample > 0) {
    samples = SampleModels(session, problem, solved, FLAGS_sample, FLAGS_seed);
  }
  std::string written;  // once all of it is
  if (is_first) {
    GiveResult(
        [&] {
          if (FLAGS_out.empty()) return;
          const std::string names = WriteOutputs(shown);
          if (!samples.urdfs.empty()) WriteSamples(samples);
          written = "  written to " + FLAGS_out + ": " + names +
                    SampleFiles(samples) + "\n";
        },
        json,
        [&] {
          // That of a process of mpirun is one, wherever mpirun's goes.
          const bool colour = group == nullptr && isatty(STDOUT_FILENO) == 1;
          std::string text =
              FitText(session, problem, fit, held, tried, colour);
          if (mixture) text += MixtureText(*mixture);
          return text + written + SampleText(samples, fit);
        });
    // What was interrupted can go on.
    if (checkpoint && !session.options.stop.stop_requested()) {
      checkpoint->Remove();
    }
  }
  if (!fit.converged) {
    watch.SayKept("the best point so far", WritesFiles());
    std::fprintf(stderr, "error: no usable result: %s\n",
                 fit.termination.c_str());
  }
  if (!samples.failure.empty()) {
    std::fprintf(stderr, "error: no samples: %s\n", samples.failure.c_str());
  }
  return fit.converged && samples.failure.empty() ? kExitDone : kExitNoResult;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  return sysid::RunOnProcesses(argc, argv, sysid::kHelp, sysid::Main);
}
