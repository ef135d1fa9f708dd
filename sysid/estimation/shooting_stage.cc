#include "sysid/estimation/shooting_stage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "glog/logging.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/shared_blocks.h"
#include "sysid/estimation/shared_solve.h"
#include "sysid/estimation/stages.h"

namespace sysid {
namespace {

// A radius that damps no more than keeps what is singular solvable: Ceres'
// largest.
constexpr double kUndamped = 1e16;

bool HasDryFriction(const Model& model) {
  const EffectSet& effects = model.effects();
  for (int i = 0; i < effects.size(); ++i) {
    if ((effects.effect(i).hooks() & kDryFrictionHook) != 0) return true;
  }
  return false;
}

// Reports iterations to the history and to whoever watches.
class Watcher final : public ceres::IterationCallback {
 public:
  Watcher(const ShootingProblem& problem, const ShootingStage::Options& options,
          const std::string& doing, double start_time_s,
          const Eigen::VectorXd& theta, SharedBlocks* blocks,
          JoinedStates* joined, std::vector<HistoryEntry>* history)
      : problem_(problem.options()),
        options_(options),
        doing_(doing),
        start_time_s_(start_time_s),
        dof_(std::max(
            1.0, problem.data().DofPerSample() * problem.data().samples())),
        // As the problem weighs its errors, the cost is not that of noise.
        wanted_(problem.misfit().empty()
                    ? 0.5 * dof_ * std::pow(options.wanted_error, 2)
                    : std::numeric_limits<double>::infinity()),
        theta_(theta),
        blocks_(blocks),
        joined_(joined),
        history_(history),
        first_(history->empty() ? 0 : history->back().iteration) {}

  ceres::CallbackReturnType operator()(
      const ceres::IterationSummary& summary) override {
    // The first entry of a later stage is the same point as the last of the one
    // before, seen by another cost; it is no iteration.
    // A step that was refused leaves the cost as it was.
    if (summary.step_is_successful || summary.iteration == 0) {
      cost_ = summary.cost;
      if (joined_ != nullptr) joined_->set_least(Insignificant());
    }
    if (summary.iteration > 0 || history_->empty()) {
      history_->push_back(
          {first_ + summary.iteration, cost_, Now() - start_time_s_, theta_});
    }
    // Not SOLVER_ABORT, which puts the point back to where it started.
    if (problem_.stop.stop_requested()) {
      return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    }
    if (problem_.progress && !options_.quiet) {
      problem_.progress({doing_, first_ + summary.iteration,
                         first_ + options_.max_iterations,
                         std::sqrt(2.0 * cost_ / dof_)});
    }
    if (Crawls(summary.iteration)) return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    const bool was_taken = std::exchange(
        taken_, summary.step_is_successful || summary.iteration == 0);
    const bool ends =
        (summary.iteration > 0 && Gain(summary, was_taken) < Insignificant()) ||
        (taken_ && Follows() && IsAsPromised(summary) &&
         Promised() < LeastPromise());
    return ends ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  double Insignificant() const {
    return std::max(options_.news, options_.function_tolerance * cost_);
  }

  // Half of |dx|^2, dx in standard errors, which the misfit makes wider.
  double LeastPromise() const {
    constexpr double kThousandth = 1e-3;
    const double size = kThousandth * options_.misfit;
    return options_.exact ? std::min(Insignificant(), 0.5 * size * size)
                          : Insignificant();
  }

  // By EstimationOptions::least_gain and Options::wanted_error.
  bool Crawls(int iteration) {
    constexpr int kFew = 3;  // a refused step gains nothing, the next may
    costs_.push_back(cost_);
    const int last = static_cast<int>(costs_.size()) - 1;
    if (last < kFew) return false;
    const double pace = (costs_[last - kFew] - cost_) / kFew;
    const int left = options_.max_iterations - iteration;
    return pace * left < std::max(problem_.least_gain * cost_, cost_ - wanted_);
  }

  // Whether the model follows the data. Of one that does not the linear model
  // sees only the way from here, not what is left (an elastic drive ended a
  // hundred times too stiff).
  bool Follows() const { return 2.0 * cost_ < kMissing * kMissing * dof_; }

  // Whether the linear model told what a step gained that was taken, to a
  // tenth: where it did not there is more to gain, and no need to ask.
  static bool IsAsPromised(const ceres::IterationSummary& step) {
    constexpr double kTenth = 0.1;
    return step.iteration == 0 ||
           std::abs(step.relative_decrease - 1.0) < kTenth;
  }

  // What the step of Gauss and Newton from here gains by the linear model: no
  // more than that is left where the model holds. Half of |dx|^2 in units of
  // the standard errors.
  double Promised() const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (blocks_ == nullptr || blocks_->Empty()) return kInfinity;
    double cost, promised, radius = kUndamped;
    SharedBlocks::Point step;
    const bool known = blocks_->Linearize(blocks_->Read(), true, &cost) &&
                       blocks_->Solve(&radius, &step, &promised);
    return known ? std::abs(promised) : kInfinity;
  }

  // What a step gained that was taken. Of one that was refused what it
  // promised, if the one before it was taken: then the radius is no reason to
  // promise little, and where only rounding refuses there is nothing left to
  // gain. (Ceres would also stop where a refused step happens to cost the
  // same.)
  static double Gain(const ceres::IterationSummary& step, bool was_taken) {
    if (step.step_is_successful) return step.cost_change;
    const double promised = step.cost_change / step.relative_decrease;
    // Of one that cannot be evaluated both are the lowest number.
    const bool evaluated =
        step.relative_decrease > std::numeric_limits<double>::lowest();
    return step.step_is_valid && evaluated && was_taken && promised >= 0.0
               ? promised
               : std::numeric_limits<double>::infinity();
  }

  const EstimationOptions& problem_;
  const ShootingStage::Options& options_;
  const std::string& doing_;
  const double start_time_s_, dof_;
  const double wanted_;  // the cost of Options::wanted_error
  const Eigen::VectorXd& theta_;
  SharedBlocks* const blocks_;  // null: not asked for promises
  JoinedStates* const joined_;  // may be null
  std::vector<HistoryEntry>* history_;
  int first_;
  double cost_ = 0.0;
  std::vector<double> costs_;  // by iteration
  bool taken_ = true;          // the last step
};

// The problem's equations of theta, times a weight.
class EquationsCost final : public ceres::CostFunction {
 public:
  EquationsCost(const ThetaEquations* equations, int size, double weight)
      : equations_(equations), size_(size), weight_(weight) {
    set_num_residuals(equations->rows());
    mutable_parameter_block_sizes()->push_back(size);
  }
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const bool with_J = jacobians != nullptr && jacobians[0] != nullptr;
    RowMatrixXd J;
    equations_->Evaluate(parameters[0], residuals, with_J ? &J : nullptr);
    Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) *= weight_;
    if (with_J) {
      Eigen::Map<RowMatrixXd>(jacobians[0], num_residuals(), size_) =
          weight_ * J;
    }
    return true;
  }

 private:
  const ThetaEquations* equations_;
  const int size_;
  const double weight_;
};

std::string Message(const ceres::Solver::Summary& summary, int most) {
  if (summary.termination_type == ceres::USER_SUCCESS) {
    return "the last step gained nothing of significance";
  }
  if (summary.termination_type == ceres::NO_CONVERGENCE) {
    return "still moving after the " + std::to_string(most) +
           " iterations that are allowed; better starting values, bounds, "
           "priors or fewer free parameters help";
  }
  return summary.message;
}

}  // namespace

ShootingStage::ShootingStage(const ShootingProblem& problem,
                             const Options& options, Solution* point,
                             std::shared_ptr<ShootingSegments> segments)
    : shooting_(problem),
      options_(options),
      point_(point),
      manifold_(std::make_unique<StateManifold>(&problem.model())),
      segments_(std::move(segments)) {
  if (segments_ == nullptr || !segments_->Fit(*point)) {
    segments_ = std::make_shared<ShootingSegments>(problem, *point);
  }
  if (std::isfinite(options.defect)) {
    defect_sigma_ = DefectSigma(problem);
    for (double& sigma : defect_sigma_) sigma *= options.defect;
  }
  // Looser joints take up the second order of a step. A model that misses the
  // data has no trajectory to follow: its states are pulled from it by the
  // data, and full steps lead it into other minima (the video of a pendulum,
  // without damping, to twice the error). Where dry friction lets go a motion
  // has no second order: full steps crawled along what the data left open
  // (Stribeck's velocity and static friction).
  if (options.defect < kMiddleDefect && options.misfit < kMissing &&
      !options.fix_states && !HasDryFriction(problem.model())) {
    using Columns = ShootingSegment::Columns;
    joined_ = std::make_unique<JoinedStates>(
        problem.model(), point, segments_.get(), defect_sigma_,
        options.fix_theta ? Columns::kState : Columns::kBoth, Threads());
  }
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.evaluation_callback = joined_.get();
  problem_ = std::make_unique<ceres::Problem>(problem_options);
  AddSegments();
  AddPriors();
  if (!options.fix_states) return;
  for (const auto& [run, k] : AllSegments(*point)) {
    problem_->SetParameterBlockConstant(State(run, k));
  }
}

ShootingStage::~ShootingStage() = default;

int ShootingStage::Threads() const {
  return options_.threads > 0 ? options_.threads : shooting_.options().threads;
}

double* ShootingStage::State(int run, int segment) const {
  RowMatrixXd& states = point_->runs[run].states;
  return states.data() + segment * states.cols();
}

bool ShootingStage::HasDefect(int run, int segment) const {
  return !defect_sigma_.empty() && segment + 1 < point_->runs[run].segments();
}

void ShootingStage::AddSegments() {
  double* theta = point_->theta.data();
  const bool with_theta = shooting_.map().size() > 0;
  for (size_t r = 0; r < point_->runs.size(); ++r) {
    for (int k = 0; k < point_->runs[r].segments(); ++k) {
      const bool with_defect = HasDefect(r, k);
      auto cost = std::make_unique<ShootingSegmentCost>(
          segments_->at(r, k),
          with_defect ? defect_sigma_ : std::vector<double>(), joined_.get(),
          static_cast<int>(r), k);
      if (cost->num_residuals() == 0) continue;
      std::vector<double*> parameters{State(r, k)};
      if (with_theta) parameters.push_back(theta);
      if (with_defect) parameters.push_back(State(r, k + 1));
      problem_->AddResidualBlock(cost.release(), nullptr, parameters);
      problem_->SetManifold(State(r, k), manifold_.get());
      if (with_defect) problem_->SetManifold(State(r, k + 1), manifold_.get());
    }
  }
  if (!with_theta) return;
  if (!problem_->HasParameterBlock(theta)) {
    problem_->AddParameterBlock(theta, shooting_.map().size());
  }
  if (options_.fix_theta) {
    problem_->SetParameterBlockConstant(theta);
    return;
  }
  // Ceres searches along its steps where there are bounds, which this problem
  // likes (16 iterations instead of 47 for the shipped run of pendulum3): so
  // each parameter has some.
  constexpr double kUnbounded = 1e12;
  for (size_t i = 0; i < shooting_.free().size(); ++i) {
    const bool own = !shooting_.map().IsTransformed(i);
    const FreeParameter& free = shooting_.free()[i];
    problem_->SetParameterLowerBound(
        theta, i, own ? std::max(free.lower, -kUnbounded) : -kUnbounded);
    problem_->SetParameterUpperBound(
        theta, i, own ? std::min(free.upper, kUnbounded) : kUnbounded);
  }
}

void ShootingStage::AddPriors() {
  const Model& model = shooting_.model();
  const bool independent = std::isinf(options_.defect);
  const std::vector<double> sigma = StateBelief(shooting_, options_.twist_hold);
  for (size_t r = 0; r < point_->runs.size(); ++r) {
    const int count = independent ? point_->runs[r].segments() : 1;
    for (int k = 0; k < count; ++k) {
      const double* x = State(r, k);
      const StartBelief belief =
          point_->runs[r].samples[k] == 0
              ? BeliefAtStart(shooting_, r, options_.twist_hold, x)
              : StartBelief{{x, x + model.state_size()}, sigma};
      auto* cost = new StatePriorCost(&model, belief.state, belief.sigma);
      problem_->AddResidualBlock(cost, nullptr, State(r, k));
      problem_->SetManifold(State(r, k), manifold_.get());
    }
  }
  if (options_.equations > 0.0 && !options_.fix_theta) {
    problem_->AddResidualBlock(
        new EquationsCost(shooting_.equations().get(), shooting_.map().size(),
                          options_.equations),
        nullptr, point_->theta.data());
  }
  std::vector<int> places;
  std::vector<double> means, sigmas;
  for (size_t i = 0; i < shooting_.free().size(); ++i) {
    if (!shooting_.free()[i].prior) continue;
    places.push_back(static_cast<int>(i));
    means.push_back(shooting_.free()[i].prior->mean);
    sigmas.push_back(shooting_.free()[i].prior->std);
  }
  const ThetaBelief bodies = BodyBelief(shooting_);
  for (size_t k = 0; k < bodies.places.size(); ++k) {
    places.push_back(bodies.places[k]);
    means.push_back(point_->theta[bodies.places[k]]);
    sigmas.push_back(bodies.sigmas[k] / options_.misfit);
  }
  if (places.empty() || options_.fix_theta) return;
  problem_->AddResidualBlock(
      new PriorCost(shooting_.map().size(), places, means, sigmas), nullptr,
      point_->theta.data());
}

ceres::Solver::Options ShootingStage::SolverOptions() const {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.num_threads = Threads();
  options.function_tolerance = 0.0;  // the Watcher's
  options.parameter_tolerance = 1e-12;
  options.gradient_tolerance = 1e-12;
  options.max_num_consecutive_invalid_steps = 30;
  // Ceres damps by the diagonal, which the stiff defects dominate, while what
  // all segments do together is soft: at the usual radius of 1e4 that part
  // waits until the radius has grown by the square of the stiffness. Far off,
  // where a full step of the linear problem lands nowhere, first steps are
  // short instead.
  constexpr double kFar = 3e0, kNear = 1e3, kJoined = 1e4;
  bool joined = false;
  for (const Solution::Nodes& nodes : point_->runs) {
    joined |= nodes.segments() > 1 && std::isfinite(options_.defect);
  }
  joined = !AllTrue(shooting_.processes(), !joined);
  options.initial_trust_region_radius =
      options_.far && !joined ? kFar
      : joined                ? std::min(options.max_trust_region_radius,
                                         kJoined / std::pow(std::min(1.0, options_.defect), 4))
                              : kNear;
  // They follow a full step; one that is cut short follows nothing.
  if (joined_ != nullptr) options.max_num_line_search_step_size_iterations = 0;
  options.logging_type = ceres::SILENT;
  return options;
}

std::shared_ptr<ceres::ParameterBlockOrdering> ShootingStage::Ordering() const {
  // The states first, theta last: the states couple only with their neighbours,
  // so eliminating them fills in nothing but theta's rows.
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (size_t r = 0; r < point_->runs.size(); ++r) {
    for (int k = 0; k < point_->runs[r].segments(); ++k) {
      if (problem_->HasParameterBlock(State(r, k))) {
        ordering->AddElementToGroup(State(r, k), 0);
      }
    }
  }
  if (problem_->HasParameterBlock(point_->theta.data())) {
    ordering->AddElementToGroup(point_->theta.data(), 1);
  }
  return ordering;
}

std::vector<int> ShootingStage::PushedOutward() {
  std::vector<int> at;
  for (size_t i = 0; i < shooting_.free().size(); ++i) {
    if (options_.fix_theta || shooting_.map().IsTransformed(i)) continue;
    const FreeParameter& free = shooting_.free()[i];
    const double value = point_->theta[i];
    if (value <= free.lower || value >= free.upper) {
      at.push_back(static_cast<int>(i));
    }
  }
  if (at.empty()) return at;
  ReleaseTheta();
  double* theta = point_->theta.data();
  std::vector<double> gradient;
  if (!ThetaGradient(&gradient)) return at;
  // The cost falls against the gradient.
  std::erase_if(at, [&](int i) {
    const bool below = theta[i] <= shooting_.free()[i].lower;
    return below ? gradient[i] <= 0 : gradient[i] >= 0;
  });
  return at;
}

bool ShootingStage::ThetaGradient(std::vector<double>* gradient) {
  double* theta = point_->theta.data();
  if (shooting_.options().processes != nullptr) {
    return GradientOverProcesses(shooting_.processes(), Threads(), theta,
                                 problem_.get(), joined_.get(), gradient);
  }
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = {theta};
  options.num_threads = Threads();
  return problem_->Evaluate(options, nullptr, nullptr, gradient, nullptr);
}

void ShootingStage::ReleaseTheta() {
  double* theta = point_->theta.data();
  problem_->SetParameterBlockVariable(theta);
  problem_->SetManifold(theta, nullptr);
}

void ShootingStage::HoldTheta(const std::vector<int>& held) {
  if (held.empty()) return;  // also where there is no theta
  double* theta = point_->theta.data();
  if (static_cast<int>(held.size()) == shooting_.map().size()) {
    problem_->SetParameterBlockConstant(theta);
  } else {
    theta_manifold_ =
        std::make_unique<ceres::SubsetManifold>(shooting_.map().size(), held);
    problem_->SetManifold(theta, theta_manifold_.get());
  }
}

StageSummary ShootingStage::Solve(const std::string& doing, double start_time_s,
                                  std::vector<HistoryEntry>* history) {
  constexpr int kMostSets = 8;  // of parameters held at their bounds
  StageSummary result;
  ceres::Solver::Options options = SolverOptions();
  // The active set: parameters at a bound that the cost pushes outward are
  // held while the others are solved for; then again with those that the
  // solution pushes. (Clamped steps of all together only crawl.)
  std::vector<int> held = PushedOutward();
  const std::stop_token& stop = shooting_.options().stop;
  for (int set = 0; set < kMostSets; ++set) {
    ThrowIfCancelled(stop);
    HoldTheta(held);
    std::unique_ptr<SharedBlocks> blocks;
    if (!options_.fix_states) {
      blocks =
          std::make_unique<SharedBlocks>(shooting_.processes(), Threads(),
                                         point_->theta.data(), problem_.get());
    }
    Watcher watcher(shooting_, options_, doing, start_time_s, point_->theta,
                    blocks.get(), joined_.get(), history);
    options.callbacks = {&watcher};
    options.update_state_every_iteration = true;  // theta, for the history
    options.linear_solver_ordering = Ordering();  // Ceres strikes what is held
    options.max_num_iterations = options_.max_iterations - result.iterations;
    ceres::Solver::Summary summary;
    if (shooting_.options().processes != nullptr) {
      SolveOverProcesses(shooting_.processes(), options, point_->theta.data(),
                         problem_.get(), joined_.get(), &summary);
    } else {
      ceres::Solve(options, problem_.get(), &summary);
    }
    if (joined_ != nullptr) joined_->Adopt();
    ThrowIfCancelled(stop);
    result.converged = summary.termination_type == ceres::CONVERGENCE ||
                       summary.termination_type == ceres::USER_SUCCESS;
    result.message = Message(summary, shooting_.options().max_iterations);
    // The first is the start; where that cannot be evaluated there is none.
    result.iterations +=
        std::max(0, static_cast<int>(summary.iterations.size()) - 1);
    result.cost = summary.final_cost;
    result.evaluations +=
        summary.num_residual_evaluations + summary.num_jacobian_evaluations;
    const std::vector<int> pushed = PushedOutward();
    if (pushed == held || result.iterations >= options_.max_iterations) break;
    held = pushed;
  }
  return result;
}

}  // namespace sysid
