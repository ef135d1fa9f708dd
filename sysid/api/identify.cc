#include "sysid/api/identify.h"

#include <algorithm>
#include <filesystem>
#include <utility>
#include <vector>

#include "models/error.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/clock.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/time_limit.h"
#include "sysid/inverse_dynamics/effort_comparison.h"
#include "sysid/inverse_dynamics/fitted_base.h"
#include "sysid/linearization/statistics.h"
#include "sysid/session/check_session.h"
#include "sysid/session/session_options.h"
#include "sysid/session/shared_runs.h"
#include "sysid/session/stochastic_session.h"
#include "sysid/unexplained_force/discrepancy.h"

namespace sysid {
namespace {

// What several processes do not do.
void CheckProcesses(const IdentifyRequest& request) {
  if (request.processes == nullptr || request.check != CheckLevel::kAll) return;
  throw InputError("--check",
                   "hypotheses about the data are tested by one process alone",
                   "--check numbers here, and sysid_check on some of the runs");
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
void CheckResume(const IdentifyRequest& request, const Session& session) {
  if (!request.resume) return;
  if (FindSolver(session.solver).kind != SolverKind::kShooting) {
    throw InputError("--resume", session.solver + " keeps no checkpoints",
                     "leave it out; fits by lm keep them");
  }
  if (request.checkpoint.empty()) {
    throw InputError("--resume", "has no folder to go on in",
                     "name that of the fit which was ended: --out DIR");
  }
}

void Say(const Callbacks& callbacks, const std::string& remark) {
  if (callbacks.remark) callbacks.remark(remark);
}

// Where a fit by Levenberg-Marquardt keeps its stages.
std::shared_ptr<Checkpoint> OpenCheckpoint(const IdentifyRequest& request,
                                           const Session& session,
                                           const ShootingProblem& problem) {
  if (request.checkpoint.empty() ||
      FindSolver(session.solver).kind != SolverKind::kShooting) {
    return nullptr;
  }
  auto checkpoint =
      std::make_shared<Checkpoint>(request.checkpoint, problem, request.resume);
  if (request.resume) {
    const size_t stages = checkpoint->resumed();
    Say(request.callbacks,
        stages > 0
            ? "goes on after " + std::to_string(stages) + " stages of " +
                  checkpoint->file()
            : "there is no " + checkpoint->file() + ": the fit begins anew");
  }
  return checkpoint;
}

// Says where a fit goes on that is interrupted before it has a point.
Solved SolveOrSay(const IdentifyRequest& request, const Session& session,
                  const ShootingProblem& problem, Checkpoint* checkpoint) {
  try {
    return FindSolver(session.solver)
        .solve(problem, {request.adam, request.mixture, checkpoint});
  } catch (const Cancelled&) {
    if (checkpoint != nullptr && std::filesystem::exists(checkpoint->file())) {
      Say(request.callbacks, "the stages that ended are in " +
                                 checkpoint->file() +
                                 ": --resume goes on from there");
    }
    throw;
  }
}

// The problem with runs of whose start nothing is known.
ShootingProblem WithEstimatedStarts(const ShootingProblem& problem) {
  std::vector<Run> runs = RunsOf(problem.data());
  for (Run& run : runs) run.start = RunStart::kEstimated;
  return problem.WithData(MakeDataSetLike(problem.model(), std::move(runs),
                                          problem.options(), problem.data()));
}

// Whether the data contradict what is said of the starts of the runs: whether
// the fit would be better with starts of its own by more than noise makes it in
// one of a thousand recordings. Twice the log-likelihood ratio, in units of
// what the better fit leaves of the noise, is chi-square distributed with the
// count of what is said (Wilks 1938).
bool ContradictsStarts(const ShootingProblem& problem, const Fit& fit) {
  constexpr double kChance = 1e-3;
  double said = 0.0;
  for (const auto& data : problem.runs()) {
    if (data->run.start == RunStart::kEstimated) continue;
    said += problem.model().nv() *
            (data->run.start == RunStart::kKnown ? 2.0 : 1.0);
  }
  if (said == 0.0) return false;
  try {
    const Fit own = FitLevenbergMarquardtFrom(
        WithEstimatedStarts(problem).StartingAt(fit.point.theta),
        fit.segment_s);
    if (!own.converged) return false;
    const double unit = std::max(1.0, own.train.squares / own.train.dof);
    const double gained = fit.train.squares - own.train.squares;
    return FisherTail(gained / (unit * said), said, own.train.dof) < kChance;
  } catch (const Cancelled&) {
    return false;  // The fit itself is an answer.
  }
}

// The trial of added effects; nothing where it takes more than its part of the
// time, and the fit begins where it is told.
std::optional<AddedEffects> TryAddedEffectsInTime(
    const Catalogue& catalogue, const IdentifyRequest& request,
    const Session& session) {
  constexpr double kPart = 0.5;
  const TimeLimit limit(session.options.stop, kPart * DurationOf(request));
  Session limited = session;
  limited.options.stop = limit.stop();
  try {
    return TryAddedEffects(catalogue, limited);
  } catch (const Cancelled&) {
    if (session.options.stop.stop_requested()) throw;
    return std::nullopt;
  }
}

Holdout PredictHeldOut(const Session& session, const ShootingProblem& problem,
                       const Fit& fit) {
  const auto held_out = MakeDataSetLike(session.model, session.holdout,
                                        session.options, problem.data());
  Holdout holdout = PredictHoldout(OpenHoldout(
      fit.model, held_out, session.options, fit.point.rollout, fit.segment_s));
  holdout.effort = CompareEfforts(*holdout.problem, {}).errors;
  return holdout;
}

// What a solver leaves to others to say of its fit.
void Complete(const ShootingProblem& problem, SolverKind kind, Fit* fit) {
  // Longer ones take longer than such a fit.
  constexpr double kLongestHorizon = 0.5;  // s
  if (kind == SolverKind::kEquations) {
    fit->horizon = EvaluateHorizon(problem, fit->point, kLongestHorizon);
  }
  if (kind == SolverKind::kShooting) {
    AddDiscrepancy(problem, fit);
    AddBaseParameters(problem, fit);
  }
}

// The session as it is read and checked, all that its user should know first in
// its notices.
Session Open(const IdentifyRequest& request, const Catalogue& catalogue,
             const std::stop_token& stop) {
  CheckProcesses(request);
  Session session = OpenSession(request, catalogue);
  if (request.processes != nullptr) CheckSharedSession(catalogue, session);
  CheckSomethingIsFitted(session);
  CheckResume(request, session);
  if (session.solver == "gmm") CheckMixtureSize(session, request.mixture);
  session.options.keep_best = true;
  session.options.progress = request.callbacks.progress;
  session.options.stop = stop;
  CheckSessionNumbers(&session);
  if (FindSolver(session.solver).kind == SolverKind::kStochastic) {
    NoteMovedStarts(&session);
  }
  return session;
}

}  // namespace

IdentifyResult Identify(IdentifyRequest request, const Catalogue& catalogue) {
  const double start_s = Now();
  request.any_solver = true;
  request.may_free_nothing = true;
  const Processes& all =
      request.processes != nullptr ? *request.processes : Alone();
  const TimeLimit limit(request.callbacks.stop,
                        kShareOfWork * DurationOf(request));
  Session session = Open(request, catalogue, all.StopTogether(limit.stop()));
  request.runs.clear();
  request.holdout_runs.clear();
  DoAlike(all, [&] {
    if (request.callbacks.ready) request.callbacks.ready(session);
  });
  const size_t notices_when_ready = session.notices.size();
  const SolverKind kind = FindSolver(session.solver).kind;
  // The trial is by Levenberg-Marquardt, of one process; the others start where
  // they are told, or where the equations of motion begin a fit.
  std::optional<AddedEffects> added;
  if (kind == SolverKind::kShooting && request.processes == nullptr) {
    added = TryAddedEffectsInTime(catalogue, request, session);
  }
  if (added) session = StartedFrom(*added, session);
  auto problem = std::make_shared<const ShootingProblem>(
      session.model, session.free, session.runs, session.options);
  const auto checkpoint = OpenCheckpoint(request, session, *problem);
  Solved solved = SolveOrSay(request, session, *problem, checkpoint.get());
  if (kind == SolverKind::kShooting && solved.fit.converged &&
      ContradictsStarts(*problem, solved.fit)) {
    const bool known = session.start == RunStart::kKnown;
    session.notices.push_back(
        "the recordings contradict --start " + ToString(session.start) +
        (known ? ": their first rows are taken to be as noisy as the others"
               : ": did they begin before the first row?"));
    if (known) {
      const auto estimated = std::make_shared<const ShootingProblem>(
          WithEstimatedStarts(*problem));
      try {
        solved = SolveOrSay(request, session, *estimated, nullptr);
        problem = estimated;
      } catch (const Cancelled&) {
        // What was fitted from the first rows is what there is.
      }
    }
  }
  IdentifyResult result{std::move(session), notices_when_ready, problem,
                        std::move(solved),  std::nullopt,       added,
                        checkpoint};
  Fit* const fit = &result.solved.fit;
  if (!fit->converged && result.session.options.stop.stop_requested()) {
    fit->stopped_by = limit.stopped_by();
    if (fit->stopped_by == StoppedBy::kTime) {
      fit->termination = OutOfTime(*request.time) + ", " + fit->termination;
    }
  }
  if (checkpoint != nullptr && !checkpoint->trouble().empty()) {
    result.session.notices.push_back("the last stages are in no checkpoint: " +
                                     checkpoint->trouble());
  }
  if (!AllTrue(all, result.session.holdout.empty())) {
    result.holdout = PredictHeldOut(result.session, *problem, *fit);
  }
  Complete(*problem, kind, fit);
  CheckSessionData(&result.session, OutcomeOf(*fit, *problem));
  GatherErrors(all, &fit->train);
  GatherOpen(all, &fit->open);
  if (result.holdout) {
    GatherErrors(all, &result.holdout->errors);
    GatherOpen(all, &result.holdout->open);
  }
  // All that passed, reading and checking too.
  fit->wall_time_s = Now() - start_s;
  fit->cpu_time_s = SumOver(all, CpuSeconds());
  if (request.processes != nullptr) fit->processes = all.size();
  return result;
}

}  // namespace sysid
