#include "sysid/stochastic/comparison.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "models/math/constants.h"
#include "models/math/decompositions.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/stochastic/rollouts.h"
#include "sysid/stochastic/transformation.h"
#include "sysid/stochastic/words.h"

namespace sysid {
namespace {

// The same problem from another start.
ShootingProblem StartedAt(const ShootingProblem& problem,
                          const Eigen::VectorXd& start) {
  std::vector<FreeParameter> free = problem.free();
  for (size_t i = 0; i < free.size(); ++i) free[i].initial = start[i];
  return ShootingProblem(problem.model(), std::move(free),
                         problem.shared_data(), problem.options());
}

Eigen::VectorXd Values(const ShootingProblem& problem,
                       const Eigen::VectorXd& theta) {
  Eigen::VectorXd values(theta.size());
  problem.map().ValuesOf<double>(theta.data(), values.data());
  return values;
}

// The measure that all are held against: (9.1) with squares, first states from
// the data, with the rollout of the solver whose steps were the finest.
class Judge {
 public:
  Judge(const ShootingProblem& problem, const Eigen::VectorXd& start,
        const RolloutOptions& rollout, bool from_rest)
      : problem_(StartedAt(problem, start)) {
    const double given = problem_.options().segment;
    Solution point =
        CutPoint(problem_, problem_.InitialTheta(), AllStatesFromData(problem_),
                 given > 0 ? given : kInfinity);
    point.rollout = rollout;
    if (from_rest) StartAtRest(problem_.model(), &point);
    rollouts_ = std::make_unique<Rollouts>(&problem_, point);
  }

  double Loss(const Eigen::VectorXd& theta) const {
    return rollouts_->Loss(rollouts_->size(), theta, kInfinity);
  }
  // The direction in which the loss is flattest.
  Eigen::VectorXd Flattest(const Eigen::VectorXd& theta) const {
    Eigen::MatrixXd H;
    Eigen::VectorXd g;
    double sum;
    rollouts_->NormalEquations(theta, &H, &g, &sum);
    return EigenOfSymmetric(H).vectors.col(0);
  }
  int samples() const { return rollouts_->Samples(rollouts_->size()); }
  const ShootingProblem& problem() const { return problem_; }

 private:
  const ShootingProblem problem_;
  std::unique_ptr<Rollouts> rollouts_;
};

int SettledAt(const std::vector<PathPoint>& path) {
  int settled = 0;
  for (const PathPoint& point : path) {
    if (!(std::abs(point.loss - path.back().loss) <=
          kSettled * path.back().loss)) {
      settled = point.iteration + 1;
    }
  }
  return settled;
}

void Measure(const Judge& judge, const Eigen::VectorXd& reference,
             SolverRun* run) {
  for (const HistoryEntry& entry : run->fit.history) {
    run->path.push_back({entry.iteration, entry.time_s, judge.Loss(entry.theta),
                         Values(judge.problem(), entry.theta)});
  }
  const Eigen::VectorXd& theta = run->fit.point.theta;
  const Eigen::VectorXd found = Values(judge.problem(), theta);
  if (run->path.empty()) {
    run->path.push_back({0, 0.0, judge.Loss(theta), found});
  }
  run->settled = SettledAt(run->path);
  run->distance = std::nan("");
  for (int i = 0; i < found.size(); ++i) {
    const Parameter& parameter = judge.problem().free()[i].parameter;
    const double size =
        reference[i] != 0.0 ? std::abs(reference[i]) : parameter.typical_scale;
    const double off = std::abs(found[i] - reference[i]) / size;
    if (std::isfinite(off) && !(off < run->distance)) {
      run->distance = off;
      run->farthest = parameter.name;
    }
  }
}

std::vector<SolverRun> SolveAll(const ShootingProblem& problem,
                                const Eigen::VectorXd& start,
                                SolverOptions options, std::uint64_t seed) {
  const ShootingProblem own = StartedAt(problem, start);
  options.mixture.seed = seed;
  std::vector<SolverRun> runs;
  for (const Solver& solver : Solvers()) {
    if (solver.kind == SolverKind::kEquations) continue;  // no trajectories
    runs.emplace_back(solver.name, solver.solve(own, options));
  }
  return runs;
}

Eigen::VectorXd Found(const SolverRun& run) {
  Eigen::VectorXd values(run.fit.parameters.size());
  for (int i = 0; i < values.size(); ++i) {
    values[i] = run.fit.parameters[i].value;
  }
  return values;
}

// What Levenberg-Marquardt found, NaN where that is no reference.
Eigen::VectorXd Determined(const SolverRun& lm) {
  Eigen::VectorXd values = Found(lm);
  for (int i = 0; i < values.size(); ++i) {
    if (!lm.fit.converged || !lm.fit.parameters[i].identifiable) {
      values[i] = std::nan("");
    }
  }
  return values;
}

ComparedStart Summary(const std::vector<SolverRun>& runs, std::uint64_t seed,
                      const Eigen::VectorXd& start) {
  ComparedStart trial{seed, start, {}};
  for (const SolverRun& run : runs) {
    trial.solvers.push_back({run.fit.converged, run.fit.iterations, run.settled,
                             run.fit.evaluations, run.fit.wall_time_s,
                             run.path.back().loss,
                             run.fit.train.total.normalized_rms, run.distance});
  }
  return trial;
}

// Why the mixture's deviation is not Levenberg-Marquardt's standard error:
// (9.6). Nothing in a mean of the loss keeps a deviation from shrinking, and
// nothing shrinks it faster than the learning rate; the noise does not occur.
std::string WhyTheyDiffer(const ParameterEstimate& lm, double mixture,
                          double start_std, int epochs) {
  constexpr double kAlike = 3.0;
  const double narrowed = start_std / mixture;
  const std::string course = narrowed > 1.0
                                 ? Words("narrowed %.3g-fold", narrowed)
                                 : Words("widened %.3g-fold", 1.0 / narrowed);
  if (!lm.identifiable) {
    return "not identifiable from this data; the mixture " + course +
           (narrowed > 2.0
                ? " nevertheless: kernels of diagonal covariance cannot "
                  "represent correlated parameters"
                : "");
  }
  if (!std::isfinite(lm.std_error)) {
    return "at its bound, without a standard error; the mixture " + course;
  }
  const double ratio = mixture / lm.std_error;
  if (ratio > kAlike) {
    return Words("%.3g times as large: ", ratio) +
           (narrowed > 1.0
                ? Words("%d epochs reduced it %.3g-fold; more epochs would "
                        "reduce it further, independent of the noise",
                        epochs, narrowed)
                : Words("in %d epochs it ", epochs) + course +
                      " instead of narrowing");
  }
  if (ratio < 1.0 / kAlike) {
    return Words("%.3g times smaller: ", 1.0 / ratio) +
           "a mean loss sets no lower limit to a deviation, whatever the "
           "noise, and the initial states are taken as exact";
  }
  return Words("similar (%.2g times), by coincidence: ", ratio) +
         "it depends on the number of epochs, not on the noise";
}

void CompareUncertainty(const ShootingProblem& problem, Comparison* out) {
  const Fit& lm = out->runs[0].fit;
  const MixtureFit& mixture = *out->runs[2].mixture;
  const Eigen::VectorXd first = mixture.epochs.front().kernels.Std();
  const Eigen::VectorXd last = mixture.mixture.Std();
  for (size_t i = 0; i < problem.free().size(); ++i) {
    const ParameterEstimate& of_lm = lm.parameters[i];
    out->uncertainty.push_back(
        {out->names[i], out->units[i], of_lm.std_error, last[i],
         WhyTheyDiffer(of_lm, last[i], first[i], mixture.fit.iterations)});
  }
}

// Over what the solvers visited last, and the reference.
Landscape MakeLandscape(const Judge& judge, const Comparison& comparison) {
  // As fine as 5 million steps allow.
  const int cells = std::clamp(
      static_cast<int>(std::sqrt(5e6 / std::max(1, judge.samples()))), 21, 81);
  Landscape landscape;
  Eigen::Vector2d low = comparison.start, high = low;
  const auto include = [&](const Eigen::Vector2d& point) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  };
  if (comparison.reference_is_truth) include(comparison.reference);
  for (const SolverRun& run : comparison.runs) include(Found(run));
  const MixtureFit& mixture = *comparison.runs[2].mixture;
  for (const MixtureEpoch* epoch :
       {&mixture.epochs.front(), &mixture.epochs.back()}) {
    for (int k = 0; k < epoch->kernels.weights.size(); ++k) {
      const Eigen::Vector2d mean = epoch->kernels.means.row(k);
      const Eigen::Vector2d std = epoch->kernels.stds.row(k);
      include(mean + std);
      include(mean - std);
    }
  }
  const Eigen::Vector2d margin = 0.1 * (high - low);
  low -= margin;
  high += margin;
  for (int i = 0; i < 2; ++i) {
    const FreeParameter& free = judge.problem().free()[i];
    low[i] = std::max(low[i], free.lower);
    high[i] = std::min(high[i], free.upper);
  }
  landscape.x = Eigen::VectorXd::LinSpaced(cells, low[0], high[0]);
  landscape.y = Eigen::VectorXd::LinSpaced(cells, low[1], high[1]);
  landscape.deviance.resize(cells, cells);
  for (int row = 0; row < cells; ++row) {
    for (int column = 0; column < cells; ++column) {
      landscape.deviance(row, column) =
          judge.Loss(Eigen::Vector2d(landscape.x[column], landscape.y[row]));
    }
  }
  double best = landscape.deviance.minCoeff();
  for (const SolverRun& run : comparison.runs) {
    best = std::min(best, run.path.back().loss);
  }
  const double noise2 = std::pow(judge.problem().data().PooledNoise(), 2);
  const double dof = std::max(
      1.0, judge.problem().data().DofPerSample() * judge.samples() - 2.0);
  const double chi2 = std::max(1.0, best * judge.samples() / noise2 / dof);
  landscape.deviance =
      (landscape.deviance.array() - best) * (judge.samples() / noise2 / chi2);
  landscape.valley = judge.Flattest(Found(comparison.runs[0]));
  return landscape;
}

// All starts, to the first process: in the order of their seeds.
void GatherTrials(const Processes& all, std::vector<ComparedStart>* trials) {
  if (all.size() == 1) return;
  Packer own;
  for (const ComparedStart& trial : *trials) {
    own.Put(static_cast<double>(trial.seed));
    own.Put(RowMatrixXd(trial.start));
    own.Put(static_cast<double>(trial.solvers.size()));
    for (const SolverTrial& solver : trial.solvers) {
      own.Put(solver.converged ? 1.0 : 0.0);
      for (const int count :
           {solver.iterations, solver.settled, solver.evaluations}) {
        own.Put(static_cast<double>(count));
      }
      for (const double number :
           {solver.time_s, solver.loss, solver.error, solver.distance}) {
        own.Put(number);
      }
    }
  }
  trials->clear();
  for (const std::string& part : all.Gather(own.bytes())) {
    Unpacker theirs(part);
    while (!theirs.AtEnd() && !theirs.failed()) {
      ComparedStart& trial = trials->emplace_back();
      trial.seed = static_cast<std::uint64_t>(theirs.Number());
      trial.start = theirs.Matrix();
      trial.solvers.resize(theirs.Count());
      for (SolverTrial& solver : trial.solvers) {
        solver.converged = theirs.Number() != 0.0;
        for (int* count :
             {&solver.iterations, &solver.settled, &solver.evaluations}) {
          *count = theirs.Count();
        }
        for (double* number :
             {&solver.time_s, &solver.loss, &solver.error, &solver.distance}) {
          *number = theirs.Number();
        }
      }
    }
  }
  std::sort(trials->begin(), trials->end(),
            [](const ComparedStart& a, const ComparedStart& b) {
              return a.seed < b.seed;
            });
}

}  // namespace

Comparison CompareSolvers(const ShootingProblem& problem,
                          const ComparisonOptions& options) {
  Comparison out;
  const int n = problem.map().size();
  const Transformation transformation(problem);
  out.start = transformation.start();
  bool values = true;  // theta is the values themselves
  for (int i = 0; i < n; ++i) {
    out.names.push_back(problem.free()[i].parameter.name);
    out.units.push_back(problem.free()[i].parameter.unit);
    values = values && !problem.map().IsTransformed(i);
  }
  const bool from_rest = options.adam.from_rest;
  const std::uint64_t seed = options.mixture.seed;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, options.start_spread);
  const std::stop_token& stop = problem.options().stop;
  const Processes& all = *options.helpers;
  for (int r = 0; r < options.repeat; ++r) {
    Eigen::VectorXd start = out.start;
    if (r > 0) {
      Eigen::VectorXd v(n);
      for (double& component : v) component = normal(random);
      start = Values(problem, transformation.Theta(v));
    }
    if (r % all.size() != all.rank()) continue;
    std::vector<SolverRun> runs;
    try {
      runs = SolveAll(problem, start, options, seed + r);
    } catch (const Cancelled&) {
      if (r == 0 || !problem.options().keep_best) throw;
    }
    // A further start that was interrupted says nothing of the solvers.
    if (r > 0 && stop.stop_requested()) break;
    const auto finest = std::min_element(
        runs.begin(), runs.end(), [](const SolverRun& a, const SolverRun& b) {
          return a.fit.step_s < b.fit.step_s;
        });
    const Judge judge(problem, start, finest->fit.point.rollout, from_rest);
    const Eigen::VectorXd reference =
        options.truth ? *options.truth : Determined(runs[0]);
    for (SolverRun& run : runs) Measure(judge, reference, &run);
    out.trials.push_back(Summary(runs, seed + r, start));
    out.asked = options.repeat;
    if (r > 0) continue;
    out.rollout = finest->fit.point.rollout;
    out.reference = reference;
    out.reference_is_truth = options.truth.has_value();
    out.runs = std::move(runs);
    CompareUncertainty(problem, &out);
    if (n == 2 && values) out.landscape = MakeLandscape(judge, out);
    if (stop.stop_requested()) break;
  }
  GatherTrials(all, &out.trials);
  return out;
}

}  // namespace sysid
