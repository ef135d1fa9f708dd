#include "sysid/hypotheses/coarse_fit.h"

#include <algorithm>
#include <cmath>

#include "models/effects/catalogue.h"
#include "models/error.h"
#include "sysid/checks/series.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/shooting_stage.h"
#include "sysid/estimation/state_weights.h"
#include "sysid/hypotheses/constants.h"
#include "sysid/hypotheses/work.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"

namespace sysid {
namespace {

using namespace hypotheses;

// Frees a parameter by name from its nominal value, unless it is free already.
void FreeAlso(const std::string& name, CoarseModel* model) {
  for (const FreeParameter& known : model->free) {
    if (known.parameter.name == name) return;
  }
  FreeParameter added;
  added.parameter = FindParameters(model->model, {name}, "check").front();
  added.initial = added.parameter.nominal;
  added.lower = added.parameter.lower;
  added.upper = added.parameter.upper;
  if (added.initial < added.lower || added.initial > added.upper) return;
  model->free.push_back(added);
}

// Places of parameters change with the effects of a model.
void FindAgain(CoarseModel* model) {
  std::vector<std::string> names;
  for (const FreeParameter& f : model->free) names.push_back(f.parameter.name);
  if (names.empty()) return;
  const std::vector<Parameter> found =
      FindParameters(model->model, names, "check");
  for (size_t i = 0; i < found.size(); ++i) {
    model->free[i].parameter = found[i];
  }
}

// Adds an effect and frees its parameters where nothing that is there has them.
void AddFree(const std::string& name, CoarseModel* model) {
  static const Catalogue& catalogue = *new Catalogue;
  std::shared_ptr<const Effect> effect;
  try {
    effect = catalogue.Make(name, model->model.mechanism(), "check");
    if (model->model.effects().Contains(name)) return;
    model->model.AddEffect(effect, "check");
  } catch (const InputError&) {
    return;  // it has no meaning there, or a relative of it is in the model
  }
  for (const EffectParameter& parameter : effect->parameters()) {
    if (!parameter.whole) FreeAlso(parameter.name, model);
  }
}

int Solve(const ShootingProblem& problem, bool fix_theta, int iterations,
          Solution* point) {
  ShootingStage::Options options;
  options.defect = std::numeric_limits<double>::infinity();
  options.twist_hold = kHeldSpin;
  options.fix_theta = fix_theta;
  options.function_tolerance = kTolerance;
  options.max_iterations = iterations;
  options.quiet = true;
  std::vector<HistoryEntry> history;
  return ShootingStage(problem, options, point)
      .Solve("", 0.0, &history)
      .evaluations;
}

}  // namespace

CoarseModel WithFriction(const Model& model,
                         const std::vector<FreeParameter>& free,
                         const std::vector<const Run*>& runs) {
  CoarseModel coarse{model, free};
  for (const Joint& joint : model.mechanism().joints) {
    if (VelocitySize(joint) == 0) continue;
    AddFree("viscous_damping@" + joint.name, &coarse);
    if (joint.type == JointType::kSpherical) continue;
    AddFree("coulomb_friction@" + joint.name, &coarse);
    const bool driven =
        std::any_of(runs.begin(), runs.end(), [&](const Run* run) {
          return !run->effort.col(joint.v_index).isZero(0.0);
        });
    if (driven) AddFree("effort_bias@" + joint.name, &coarse);
  }
  FindAgain(&coarse);
  return coarse;
}

CoarseModel Augmented(const CoarseModel& model, bool bodies) {
  CoarseModel augmented = model;
  for (const Joint& joint : model.model.mechanism().joints) {
    if (VelocitySize(joint) == 0) continue;
    if (joint.type != JointType::kSpherical) {
      for (const char* kind :
           {"spring@", "sensor_offset@", "armature@", "quadratic_drag@"}) {
        AddFree(kind + joint.name, &augmented);
      }
    }
    if (!bodies) continue;
    const std::string& link =
        augmented.model.mechanism().links[joint.child_link].name;
    for (const char* what :
         {".mass", ".com_x", ".com_y", ".com_z", ".inertia_scale"}) {
      FreeAlso(link + what, &augmented);
    }
  }
  FindAgain(&augmented);
  return augmented;
}

CoarseModel WithEffect(const CoarseModel& model, const ScreenedEffect& effect) {
  CoarseModel with = model;
  with.model.AddEffect(effect.effect);
  FindAgain(&with);
  for (const EffectParameter& parameter : effect.effect->parameters()) {
    double expected = parameter.null_value;
    for (const ExpectedParameter& p : effect.parameters) {
      if (p.name == parameter.name) expected = p.value;
    }
    if (parameter.whole) {
      with.model.SetEffectParameter(parameter.name, expected);
      continue;
    }
    FreeAlso(parameter.name, &with);
    for (FreeParameter& free : with.free) {
      if (free.parameter.name != parameter.name) continue;
      free.initial = std::clamp(expected, free.lower, free.upper);
    }
  }
  FindAgain(&with);
  return with;
}

CoarseModel StartingAt(CoarseModel model, const std::vector<double>& values) {
  for (size_t i = 0; i < values.size(); ++i) {
    FreeParameter& free = model.free[i];
    free.initial = std::clamp(values[i], free.lower, free.upper);
  }
  return model;
}

CoarseModel Without(CoarseModel model, const Supposition& supposed) {
  if (supposed.hypothesis != nullptr && supposed.hypothesis->change_model) {
    supposed.hypothesis->change_model(&model.model);
  }
  return model;
}

CoarseFitter::CoarseFitter(const CheckInput& input, int samples, bool patient)
    : mechanism_(input.model->mechanism()),
      excerpt_(input.runs, samples),
      options_(input.options),
      patient_(patient) {
  options_.rollout.step = 0.0;  // a sample's: coarse as the fit
  options_.loss = RobustLoss::kNone;
  options_.segment = 0.0;
  options_.progress = nullptr;
  options_.keep_best = false;
  for (int w = 1; w < excerpt_.count(); w += 2) {
    held_runs_.push_back(excerpt_.run(w));
  }
  segment_s_ = std::max({kShortest, kSegmentRadians * RadianTime(input.runs),
                         kFewestSamples * excerpt_.period_s()});
}

Excerpt::Change CoarseFitter::ChangeOf(const Supposition& supposed) const {
  return [&mechanism = mechanism_, supposed](int run, Run* window) {
    Undo(supposed, mechanism, run, window);
  };
}

std::vector<Run> CoarseFitter::Half(const Supposition& supposed,
                                    int first) const {
  std::vector<Run> all = excerpt_.Windows(ChangeOf(supposed)), half;
  for (size_t w = first; w < all.size(); w += 2) {
    half.push_back(std::move(all[w]));
  }
  return half;
}

std::vector<Run> CoarseFitter::Train(const Supposition& supposed) const {
  return Half(supposed, 0);
}

int CoarseFitter::Samples() const {
  return static_cast<int>(excerpt_.count() * excerpt_.window_s() /
                          std::max(1e-9, excerpt_.period_s()));
}

namespace {

// Of an angle that is read modulo a turn while it leaps by more than half a
// turn from sample to sample every turn of its range is as likely: the
// logarithm of their number, for each of those samples (10.4).
double LogTurns(const Channel& channel, const Mechanism& mechanism) {
  if (!IsScalarPosition(channel.kind) ||
      !IsRotation1(mechanism.joints[channel.target].type)) {
    return 0.0;
  }
  double low = INFINITY, high = -INFINITY;
  int leaps = 0, steps = 0;
  for (int k = 0; k < channel.values.rows(); ++k) {
    const double y = channel.values(k, 0);
    if (std::isnan(y)) continue;
    low = std::min(low, y);
    high = std::max(high, y);
    if (k == 0) continue;
    const double step = std::abs(y - channel.values(k - 1, 0));
    steps += !std::isnan(step);
    leaps += step > M_PI;
  }
  const double turns = (high - low) / (2.0 * M_PI);
  return turns > 1.0 && steps > 0 ? std::log(turns) * leaps / steps : 0.0;
}

}  // namespace

double CoarseFitter::WorkOf(int columns, double evaluations) const {
  return Work(Samples(), evaluations, columns);
}

CoarseFitter::Solved CoarseFitter::SolveFrom(Solution point,
                                             const ShootingProblem& problem,
                                             bool fix_theta,
                                             int iterations) const {
  Solved solved;
  solved.evaluations = Solve(problem, fix_theta, iterations, &point);
  const double fitted = (fix_theta ? 0 : problem.map().size()) +
                        ObservedStateDof(problem) *
                            static_cast<double>(AllSegments(point).size());
  const double error =
      EvaluateErrors(problem, point, fitted).total.normalized_rms;
  solved.error = std::isfinite(error) ? error : INFINITY;
  solved.point = std::move(point);
  return solved;
}

CoarseFitter::Solved CoarseFitter::SolveFromData(const ShootingProblem& problem,
                                                 const Eigen::VectorXd& theta,
                                                 bool fix_theta,
                                                 int iterations) const {
  const std::vector<RowMatrixXd> states = AllStatesFromData(problem);
  Solved best = SolveFrom(CutPoint(problem, theta, states, segment_s_), problem,
                          fix_theta, iterations);
  if (!patient_ || best.error <= kExplained) return best;
  const double first = std::max(kFirstRadians / kSegmentRadians * segment_s_,
                                kFewestSamples * excerpt_.period_s());
  // As a fit begins (docs/theory.md, section 11).
  const Eigen::VectorXd begin =
      fix_theta ? theta : StartByInverseDynamics(problem).InitialTheta();
  Solution point = CutPoint(problem, begin, states, first);
  const int evaluations = Solve(problem, fix_theta, kLookIterations, &point);
  Solved other = SolveFrom(Recut(problem, point, segment_s_), problem,
                           fix_theta, iterations);
  const int all = best.evaluations + evaluations + other.evaluations;
  if (other.error < best.error) best = std::move(other);
  best.evaluations = all;
  return best;
}

CoarseFit CoarseFitter::Fit(const CoarseModel& as_given,
                            const Supposition& supposed, int iterations,
                            const CoarseFit* start, const DataSet* noise_of) {
  const CoarseModel model = Without(as_given, supposed);
  const auto problem = std::make_shared<ShootingProblem>(
      model.model, model.free,
      noise_of == nullptr
          ? MakeDataSet(model.model, Train(supposed), options_)
          : MakeDataSetLike(model.model, Train(supposed), options_, *noise_of),
      options_);
  CoarseFit fit;
  fit.supposed = supposed;
  fit.train = problem;
  Solved solved =
      start != nullptr
          ? SolveFrom(start->point, *problem, false, iterations)
          : SolveFromData(*problem, problem->InitialTheta(), false, iterations);
  const int columns = problem->map().size() + model.model.tangent_size();
  work_ += 0.5 * WorkOf(columns, solved.evaluations);
  fit.train_error = solved.error;
  fit.point = std::move(solved.point);
  fit.values.resize(problem->map().size());
  if (!fit.values.empty()) {
    problem->map().ValuesOf<double>(fit.point.theta.data(), fit.values.data());
  }
  return fit;
}

void CoarseFitter::Judge(CoarseFit* fit) {
  const ShootingProblem problem = fit->train->WithData(
      MakeDataSetLike(fit->train->model(), Half(fit->supposed, 1), options_,
                      fit->train->data()));
  const Solved solved =
      SolveFromData(problem, fit->point.theta, true, kLookIterations);
  const Solution& point = solved.point;
  work_ += 0.5 * WorkOf(problem.model().tangent_size(), solved.evaluations);
  fit->error = solved.error;
  const int windows = static_cast<int>(point.runs.size());
  size_t channels = 0;
  for (const auto& data : problem.runs()) {
    channels = std::max(channels, data->run.channels.size());
  }
  fit->log_errors = RowMatrixXd::Constant(windows, channels, NAN);
  fit->weights = RowMatrixXd::Zero(windows, channels);
  std::vector<double> missed(channels, 0.0), moved(channels, 0.0);
  ScratchPool pool;
  for (int w = 0; w < windows; ++w) {
    const RunData& data = *problem.runs()[w];
    std::vector<double> squares(channels, 0.0), motion(channels, 0.0);
    std::vector<int> counts(channels, 0);
    for (int k = 0; k < point.runs[w].segments(); ++k) {
      const auto& samples = point.runs[w].samples;
      const ShootingSegment segment(problem, point.rollout, w, samples[k],
                                    samples[k + 1], &pool);
      Eigen::VectorXd r, x_end;
      const bool follows = segment.RollRows(point.runs[w].states.row(k).data(),
                                            point.theta.data(), &r, &x_end);
      std::vector<SumsOfLine> lines(channels);
      for (const SegmentRow& row : segment.rollout().rows()) {
        const int c = row.channel;
        const Eigen::RowVectorXd y =
            data.run.channels[c].values.row(row.sample);
        lines[c].Add(data.run.t[row.sample], y);
        ++counts[c];
        if (follows) {
          const double s = data.sigma[c];
          squares[c] += s * s * r.segment(row.first, row.size).squaredNorm();
        } else {
          squares[c] = INFINITY;
        }
      }
      for (size_t c = 0; c < channels; ++c) motion[c] += lines[c].AboutLine();
    }
    for (size_t c = 0; c < channels; ++c) {
      if (counts[c] == 0) continue;
      const double sigma = data.sigma[c];
      const double all = motion[c] + counts[c] * sigma * sigma;
      const double capped = std::min(squares[c], kHopeless * kHopeless * all);
      fit->weights(w, c) = motion[c] / counts[c];
      missed[c] += std::max(0.0, capped - counts[c] * sigma * sigma);
      moved[c] += all;
      fit->log_errors(w, c) =
          0.5 * std::log(std::max(capped / counts[c], 1e-30)) +
          LogTurns(data.run.channels[c], mechanism_) -
          LogUnit(fit->supposed, mechanism_, data.run.channels[c]);
    }
  }
  fit->unexplained = 0.0;
  for (size_t c = 0; c < channels; ++c) {
    // (10.3): a window at rest tells nothing.
    auto weights = fit->weights.col(c).array();
    const double rest = std::max(
        kRest * kRest * Median({weights.begin(), weights.end()}), 1e-300);
    weights /= weights + rest;
    if (!(moved[c] > 0.0)) continue;
    fit->unexplained =
        std::max(fit->unexplained, std::sqrt(missed[c] / moved[c]));
  }
}

bool Difference::IsBetter(double significance, double factor) const {
  // About Student's quantile over the normal one, at three standard errors.
  const double few = 1.0 + 3.0 / std::max(1.0, windows - 1.0);
  return windows >= kFewestWindows && mean > std::log(factor) &&
         mean > significance * few * std_error;
}

bool Difference::IsTie() const {
  return std::abs(mean) <= std::max(kTie * std_error, std::log(kWorth));
}

Difference Compare(const CoarseFit& a, const CoarseFit& b,
                   const std::vector<int>& held_runs,
                   const std::vector<int>& runs) {
  // Of each window: its weight, and its weighted sum over the channels.
  std::vector<std::pair<double, double>> of_windows;
  double weight = 0.0, squared_weights = 0.0, sum = 0.0;
  const auto channels = std::min(a.log_errors.cols(), b.log_errors.cols());
  for (int w = 0; w < static_cast<int>(held_runs.size()); ++w) {
    if (!IsOfRun(runs, held_runs[w])) continue;
    double of_window = 0.0, sum_of_window = 0.0;
    for (int c = 0; c < channels; ++c) {
      const double d = a.log_errors(w, c) - b.log_errors(w, c);
      if (std::isnan(d)) continue;
      of_window += a.weights(w, c);
      sum_of_window += a.weights(w, c) * d;
    }
    of_windows.push_back({of_window, sum_of_window});
    weight += of_window;
    squared_weights += of_window * of_window;
    sum += sum_of_window;
  }
  Difference difference;
  if (!(weight > 0.0)) return difference;
  difference.windows = weight * weight / squared_weights;
  difference.mean = sum / weight;
  if (difference.windows <= 1.0) return difference;
  double squares = 0.0;
  for (const auto& [of_window, sum_of_window] : of_windows) {
    squares += std::pow(sum_of_window - of_window * difference.mean, 2);
  }
  difference.std_error =
      std::sqrt(squares * difference.windows / (difference.windows - 1.0)) /
      weight;
  return difference;
}

}  // namespace sysid
