#include "sysid/session/session_options.h"

#include <algorithm>
#include <cmath>
#include <thread>

#include "models/error.h"
#include "models/math/constants.h"
#include "sysid/io/csv.h"
#include "sysid/session/shared_runs.h"
#include "sysid/stochastic/rollout_gradient.h"
#include "sysid/stochastic/solvers.h"

namespace sysid {
namespace {

// The flag's number, or else the file's; 0 at "" where neither is given.
Located<double> ChooseNumber(const std::optional<double>& flag,
                             const std::optional<Located<double>>& file,
                             const std::string& name, double lowest,
                             double highest, const std::string& hint) {
  const Located<double> chosen = flag   ? Located<double>{*flag, "--" + name}
                                 : file ? *file
                                        : Located<double>{};
  if (chosen.place.empty()) return chosen;
  if (!(chosen.value > 0 && std::isfinite(chosen.value))) {
    throw InputError(
        chosen.place,
        "must be a positive number, not " + ShortestText(chosen.value), hint);
  }
  if (chosen.value < lowest || chosen.value > highest) {
    throw InputError(chosen.place,
                     "cannot be " + ShortestText(chosen.value) +
                         ": it lies between " + ShortestText(lowest) + " and " +
                         ShortestText(highest),
                     hint);
  }
  return chosen;
}

// A step that is longer than the samples are apart ends at each of them.
void FitStepToRuns(const Located<double>& step, Session* session) {
  constexpr double kMostSteps = 1000;  // between two samples, on average
  session->options.rollout.step = step.value;
  if (step.place.empty()) return;
  double gap = 0.0;
  const Processes& all = ProcessesOf(session->options);
  DoAlike(all, [&] {
    for (const Run& run : session->runs) {
      const double period =
          (run.t.back() - run.t.front()) / std::max(1, run.size() - 1);
      if (period / step.value > kMostSteps) {
        throw InputError(step.place,
                         ShortestText(step.value) +
                             " s makes more than 1000 steps "
                             "from one sample of " +
                             run.name + " to the next",
                         "leave it out: it is then chosen so that its error is "
                         "below the noise");
      }
      for (int k = 1; k < run.size(); ++k) {
        gap = std::max(gap, run.t[k] - run.t[k - 1]);
      }
    }
  });
  gap = MaxOver(all, gap);
  if (step.value <= gap * (1 + 1e-9)) return;
  session->options.rollout.step = gap;
  session->notices.push_back(step.place + ": " + ShortestText(step.value) +
                             " s is longer than the samples are apart: a step "
                             "ends at every sample");
}

// A run that is shorter than a segment is one segment: a notice names those,
// unless the segment is the whole run as a person rounds its duration.
void FitSegmentToRuns(const Located<double>& segment, Session* session) {
  session->options.segment = segment.value;
  if (segment.place.empty()) return;
  double longest = 0.0;
  std::vector<std::string> shorter;
  for (const Run& run : session->runs) {
    const double duration = run.t.back() - run.t.front();
    const double period = duration / std::max(1, run.size() - 1);
    longest = std::max(longest, duration);
    if (segment.value <= duration + period) continue;
    shorter.push_back(run.name + " (" + RoundedText(duration) + " s)");
  }
  const Processes& all = ProcessesOf(session->options);
  session->options.segment = std::min(segment.value, MaxOver(all, longest));
  shorter = JoinLists(all, shorter);
  if (shorter.empty()) return;
  session->notices.push_back(
      segment.place + ": " + ShortestText(segment.value) +
      " s is longer than " + Join(shorter) + ", which " +
      (shorter.size() == 1 ? "is" : "are") + " fitted in one segment" +
      (shorter.size() == 1 ? "" : " each"));
}

std::string ChooseSolver(const FitRequest& request,
                         const FitSpecification& spec) {
  CheckWord("solver", request.solver);
  const auto [solver, place] =
      request.solver.empty() ? spec.solver.value_or(Located<std::string>())
                             : Located<std::string>{request.solver, "--solver"};
  if (solver.empty() || solver == "lm") return "lm";
  if (!request.any_solver) {
    throw InputError(place, "this program has no solver '" + solver + "'",
                     "it fits by lm; sysid_fit has all solvers");
  }
  if (FindSolver(solver).kind == SolverKind::kStochastic && !HaveStanMath()) {
    throw InputError(place, "this build has no solver '" + solver + "'",
                     kStanMathHint);
  }
  return solver;
}

int ChooseThreads(int threads) {
  // Each has a stack and buffers of its own.
  constexpr int kMostThreads = 1024;
  if (threads < 0) {
    throw InputError("--threads", "must not be negative", "0 means all cores");
  }
  if (threads > kMostThreads) {
    throw InputError(
        "--threads",
        "cannot be " + std::to_string(threads) + ": 1024 are the most",
        "more threads than cores make nothing faster; 0 means all "
        "cores");
  }
  if (threads > 0) return threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

RobustLoss ChooseLoss(const FitRequest& request, const FitSpecification& spec) {
  if (request.loss) return *request.loss;
  if (!spec.loss) return RobustLoss::kNone;
  return ParseLoss(spec.loss->value);
}

}  // namespace

void CheckWord(const std::string& name, const std::string& word) {
  if (word.empty()) return;
  const std::vector<std::string>& known = KnownWords(name);
  if (std::find(known.begin(), known.end(), word) != known.end()) return;
  throw InputError("--" + name, "unknown " + name + " '" + word + "'",
                   NameHint(word, known));
}

RobustLoss ParseLoss(const std::string& word) {
  CheckWord("loss", word);
  if (word == "huber") return RobustLoss::kHuber;
  return word == "cauchy" ? RobustLoss::kCauchy : RobustLoss::kNone;
}

OrientationResidual ParseOrientation(const std::string& word) {
  CheckWord("residual", word);
  return word == "rotation" ? OrientationResidual::kRotation
                            : OrientationResidual::kHeading;
}

CheckLevel ParseCheckLevel(const std::string& word) {
  if (word == "none") return CheckLevel::kNone;
  if (word == "numbers") return CheckLevel::kNumbers;
  if (word == "all") return CheckLevel::kAll;
  throw InputError("--check", "cannot be '" + word + "'",
                   NameHint(word, {"none", "numbers", "all"}));
}

namespace {

// That the first row has positions and velocities of all that moves.
void CheckFirstRow(const Model& model, const Run& run,
                   const std::string& place) {
  for (const Body& body : model.movers()) {
    bool position = false, velocity = false;
    for (const Channel& channel : run.channels) {
      if (channel.target != body.joint || channel.values.row(0).hasNaN() ||
          channel.kind == ChannelKind::kFramePosition ||
          channel.kind == ChannelKind::kMotorPosition) {
        continue;
      }
      const bool rate = channel.kind == ChannelKind::kVelocity ||
                        channel.kind == ChannelKind::kAngularVelocity;
      (rate ? velocity : position) = true;
    }
    if (position && velocity) continue;
    throw InputError(
        place,
        "the first row of " + run.name + " has no " +
            (position ? "velocity" : "position") + " of " +
            model.mechanism().joints[body.joint].name,
        "known needs both of every joint; rest: nothing moves there");
  }
}

}  // namespace

void FillOptions(const FitRequest& request, const FitSpecification& spec,
                 Session* session) {
  // Outside of this the squares of whitened errors overflow.
  constexpr double kLeastNoise = 1e-12, kMostNoise = 1e6;
  EstimationOptions* const options = &session->options;
  session->solver = ChooseSolver(request, spec);
  options->noise =
      ChooseNumber(request.noise, spec.noise, "noise", kLeastNoise, kMostNoise,
                   "give the standard deviation of a measurement, in rad or m; "
                   "left out, it is estimated from the data")
          .value;
  std::optional<Integrator> integrator = request.integrator;
  if (!integrator && spec.integrator) {
    integrator =
        ParseIntegrator(spec.integrator->value, spec.integrator->place);
  }
  if (integrator) {
    options->rollout.integrator = *integrator;
    options->rollout.may_change = false;
  }
  if (request.residual) {
    options->orientation = *request.residual;
  } else if (spec.residual) {
    options->orientation = ParseOrientation(spec.residual->value);
  }
  options->loss = ChooseLoss(request, spec);
  if (options->loss != RobustLoss::kNone &&
      FindSolver(session->solver).kind == SolverKind::kStochastic) {
    throw InputError(
        request.loss ? "--loss" : spec.loss->place,
        "has no meaning for --solver " + session->solver,
        "it belongs to --solver lm and inverse_dynamics (--loss none leaves it "
        "out); adam and gmm have --huber");
  }
  options->loss_scale = spec.loss_scale.value_or(options->loss_scale);
  options->threads = ChooseThreads(request.threads);
  session->check = request.check.value_or(
      request.processes == nullptr ? CheckLevel::kAll : CheckLevel::kNumbers);
}

std::string ToString(RunStart start) {
  return start == RunStart::kRest    ? "rest"
         : start == RunStart::kKnown ? "known"
                                     : "estimated";
}

RunStart ParseStart(const std::string& word) {
  CheckWord("start", word);
  for (const RunStart start : {RunStart::kRest, RunStart::kKnown}) {
    if (word == ToString(start)) return start;
  }
  return RunStart::kEstimated;
}

void FillStart(const FitRequest& request, const FitSpecification& spec,
               Session* session) {
  std::optional<RunStart> start = request.start;
  std::string place = "--start";
  if (!start && spec.start) {
    start = ParseStart(spec.start->value);
    place = spec.start->place;
  }
  session->start = start.value_or(session->start);
  for (std::vector<Run>* runs : {&session->runs, &session->holdout}) {
    for (Run& run : *runs) {
      run.start = start.value_or(run.start);
      if (run.start == RunStart::kKnown)
        CheckFirstRow(session->model, run, place);
    }
  }
}

double DurationOf(const FitRequest& request) {
  if (!request.time) return kInfinity;
  if (*request.time > 0) return *request.time;
  throw InputError("--time", "cannot be " + ShortestText(*request.time),
                   "it is a duration in seconds, above 0");
}

std::string OutOfTime(double seconds) {
  return "out of time (--time " + ShortestText(seconds) + ")";
}

void FillLengths(const FitRequest& request, const FitSpecification& spec,
                 Session* session) {
  const std::string hint = "give seconds, or leave it out: it is then chosen";
  FitSegmentToRuns(ChooseNumber(request.segment, spec.segment, "segment", 0.0,
                                kInfinity, hint),
                   session);
  FitStepToRuns(
      ChooseNumber(request.step, spec.step, "step", 0.0, kInfinity, hint),
      session);
}

}  // namespace sysid
