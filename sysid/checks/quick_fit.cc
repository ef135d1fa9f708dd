#include "sysid/checks/quick_fit.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "models/effects/catalogue.h"
#include "models/error.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/shooting_stage.h"
#include "sysid/estimation/state_weights.h"

namespace sysid {
namespace {

void Stage(const ShootingProblem& problem, double tolerance, int most,
           Solution* point) {
  ShootingStage::Options options;
  options.defect = std::numeric_limits<double>::infinity();
  options.twist_hold = kHeldSpin;
  options.function_tolerance = tolerance;
  options.max_iterations = most;
  options.quiet = true;
  std::vector<HistoryEntry> history;
  ShootingStage(problem, options, point).Solve("", 0.0, &history);
}

// Adds an effect to the model where nothing that is there has its parameters,
// and frees them.
void AddFree(const std::string& name, LooseModel* loose) {
  static const Catalogue& catalogue = *new Catalogue;
  std::shared_ptr<const Effect> effect;
  try {
    effect = catalogue.Make(name, loose->model.mechanism(), "check");
    if (loose->model.effects().Contains(name)) return;
    loose->model.AddEffect(effect, "check");
  } catch (const InputError&) {
    return;  // it has no meaning there, or a relative of it is in the model
  }
  for (const EffectParameter& parameter : effect->parameters()) {
    if (!parameter.whole) FreeAlso(loose->model, parameter.name, &loose->free);
  }
}

}  // namespace

void FreeAlso(const Model& model, const std::string& name,
              std::vector<FreeParameter>* free) {
  for (const FreeParameter& known : *free) {
    if (known.parameter.name == name) return;
  }
  FreeParameter added;
  added.parameter = FindParameters(model, {name}, "check").front();
  added.initial = added.parameter.nominal;
  added.lower = added.parameter.lower;
  added.upper = added.parameter.upper;
  if (added.initial < added.lower || added.initial > added.upper) return;
  free->push_back(added);
}

namespace {

std::shared_ptr<ShootingProblem> ProblemOf(const LooseModel& model,
                                           std::vector<Run> windows,
                                           const EstimationOptions& options,
                                           const QuickFit* like) {
  EstimationOptions quick = options;
  quick.loss = RobustLoss::kNone;
  quick.segment = 0.0;
  quick.progress = nullptr;
  return std::make_shared<ShootingProblem>(
      model.model, model.free,
      like == nullptr
          ? MakeDataSet(model.model, std::move(windows), quick)
          : MakeDataSetLike(model.model, std::move(windows), quick,
                            like->problem->data()),
      quick);
}

// What was fitted, judged where it ended.
QuickFit Judged(const std::shared_ptr<const ShootingProblem>& made,
                const Solution& point) {
  const ShootingProblem& problem = *made;
  QuickFit fit;
  fit.problem = made;
  fit.point = point;
  const double segments = static_cast<double>(AllSegments(point).size());
  const double fitted =
      problem.map().size() + ObservedStateDof(problem) * segments;
  const RunErrors errors = EvaluateErrors(problem, point, fitted);
  fit.dof = errors.dof;
  for (const SegmentError& segment : errors.segments) {
    fit.windows.push_back(segment.normalized_rms);
  }
  if (std::isfinite(errors.total.normalized_rms)) {
    fit.error = errors.total.normalized_rms;
    fit.correlation = AutocorrelationTime(problem, point);
  }
  fit.values.resize(problem.map().size());
  if (!fit.values.empty()) {
    problem.map().ValuesOf<double>(point.theta.data(), fit.values.data());
  }
  return fit;
}

}  // namespace

QuickFit FitShort(const LooseModel& model, std::vector<Run> windows,
                  const EstimationOptions& options, int iterations,
                  const QuickFit* like) {
  const auto problem = ProblemOf(model, std::move(windows), options, like);
  Solution point = CutPoint(*problem, problem->InitialTheta(),
                                 AllStatesFromData(*problem), kShortSegment);
  Stage(*problem, 1e-3, iterations, &point);
  return Judged(problem, point);
}

QuickFit FitLong(const QuickFit& from) {
  const ShootingProblem& problem = *from.problem;
  double longest = 0.0;  // s, of a window
  for (const auto& data : problem.runs()) {
    longest = std::max(longest, data->run.t.back() - data->run.t.front());
  }
  // Longer and longer: from the states of short segments a chaotic motion finds
  // its way, from those of the data it does not.
  Solution point = from.point;
  for (double length = 2 * kShortSegment; length < 0.7 * longest; length *= 2) {
    point = Recut(problem, point, length);
    Stage(problem, 1e-3, 10, &point);
  }
  point = Recut(problem, point, 1e9);
  Stage(problem, 1e-4, 25, &point);
  return Judged(from.problem, point);
}

QuickFit FitQuickly(const LooseModel& model, std::vector<Run> windows,
                    const EstimationOptions& options) {
  return FitLong(
      FitShort(model, std::move(windows), options, kShortIterations, nullptr));
}

QuickFit FitOn(const LooseModel& model, std::vector<Run> windows,
               const EstimationOptions& options, const QuickFit& like) {
  const auto problem = ProblemOf(model, std::move(windows), options, &like);
  Solution point = like.point;
  Stage(*problem, 1e-4, 10, &point);
  return Judged(problem, point);
}

double PartImproved(const QuickFit& better, const QuickFit& worse,
                    double factor) {
  if (worse.windows.empty() || better.windows.size() != worse.windows.size()) {
    return 1.0;  // the one that cannot be followed has none
  }
  int improved = 0;
  for (size_t i = 0; i < worse.windows.size(); ++i) {
    improved += better.windows[i] < factor * worse.windows[i];
  }
  return static_cast<double>(improved) / worse.windows.size();
}

LooseModel WithFriction(const Model& model,
                        const std::vector<FreeParameter>& free,
                        const std::vector<const Run*>& runs) {
  LooseModel loose{model, free};
  for (const Joint& joint : model.mechanism().joints) {
    if (joint.type == JointType::kFixed) continue;
    AddFree("viscous_damping@" + joint.name, &loose);
    if (joint.type == JointType::kSpherical) continue;
    AddFree("coulomb_friction@" + joint.name, &loose);
    const bool driven =
        std::any_of(runs.begin(), runs.end(), [&](const Run* run) {
          return !run->effort.col(joint.v_index).isZero(0.0);
        });
    if (driven) AddFree("effort_bias@" + joint.name, &loose);
  }
  return loose;
}

namespace {

void AddSpring(const Joint& joint, LooseModel* loose) {
  if (joint.type != JointType::kSpherical) {
    AddFree("spring@" + joint.name, loose);
  }
}

void FreeBody(const Joint& joint, LooseModel* loose) {
  const std::string& link =
      loose->model.mechanism().links[joint.child_link].name;
  for (const char* what :
       {"mass", "com_x", "com_y", "com_z", "inertia_scale"}) {
    FreeAlso(loose->model, link + "." + what, &loose->free);
  }
}

// With what is added for each joint that moves.
LooseModel With(
    const LooseModel& lean,
    const std::function<void(const Joint& joint, LooseModel* loose)>& add) {
  LooseModel loose = lean;
  for (const Joint& joint : lean.model.mechanism().joints) {
    if (joint.type != JointType::kFixed) add(joint, &loose);
  }
  return loose;
}

}  // namespace

LooseModel WithBodies(const LooseModel& lean) { return With(lean, FreeBody); }

LooseModel WithSprings(const LooseModel& lean) { return With(lean, AddSpring); }

LooseModel WithEverything(const LooseModel& lean) {
  return With(lean, [](const Joint& joint, LooseModel* loose) {
    AddSpring(joint, loose);
    if (joint.type != JointType::kSpherical) {
      AddFree("sensor_offset@" + joint.name, loose);
      AddFree("armature@" + joint.name, loose);
      AddFree("quadratic_drag@" + joint.name, loose);
    }
    FreeBody(joint, loose);
  });
}

}  // namespace sysid
