#include "sysid/estimation/shared_solve.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/math/decompositions.h"
#include "sysid/estimation/shared_blocks.h"

namespace sysid {
namespace {

using Point = SharedBlocks::Point;

// A cost along a direction, and its derivative, at x times that direction.
struct Sample {
  double x = 0.0;
  bool valid = false;
  double value = 0.0, slope = 0.0;
};

double ValueOf(const Eigen::VectorXd& polynomial, double x) {
  double value = 0.0;
  for (const double coefficient : polynomial) value = value * x + coefficient;
  return value;
}

// The polynomial with these values and slopes, highest power first.
Eigen::VectorXd Interpolate(const std::vector<Sample>& samples) {
  const int n = 2 * static_cast<int>(samples.size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd b(n);
  for (int i = 0; i < n; i += 2) {
    const Sample& sample = samples[i / 2];
    for (int j = 0; j < n; ++j) {
      const int power = n - 1 - j;
      A(i, j) = std::pow(sample.x, power);
      if (power > 0) A(i + 1, j) = power * std::pow(sample.x, power - 1);
    }
    b[i] = sample.value;
    b[i + 1] = sample.slope;
  }
  return A.fullPivLu().solve(b);
}

// Where the derivative of a polynomial may be zero: the real parts of its
// roots, which are eigenvalues of its companion matrix.
std::vector<double> Stationary(const Eigen::VectorXd& polynomial) {
  std::vector<double> derivative;
  for (int j = 0; j + 1 < polynomial.size(); ++j) {
    const double coefficient =
        static_cast<double>(polynomial.size() - 1 - j) * polynomial[j];
    if (derivative.empty() && coefficient == 0.0) continue;
    derivative.push_back(coefficient);
  }
  const int degree = static_cast<int>(derivative.size()) - 1;
  if (degree < 1) return {};
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(degree, degree);
  if (degree > 1) companion.diagonal(-1).setOnes();
  for (int j = 0; j < degree; ++j) {
    companion(degree - 1 - j, degree - 1) = -derivative[j + 1] / derivative[0];
  }
  const Eigen::VectorXd roots = EigenvaluesOf(companion).real();
  return {roots.begin(), roots.end()};
}

// The least of the polynomial through the samples, between two ends.
double LeastBetween(const std::vector<Sample>& samples, double low,
                    double high) {
  const Eigen::VectorXd polynomial = Interpolate(samples);
  std::vector<double> places = {0.5 * (low + high), low, high};
  for (const double root : Stationary(polynomial)) places.push_back(root);
  for (const Sample& sample : samples) places.push_back(sample.x);
  double least = std::numeric_limits<double>::infinity(), at = places[0];
  for (const double x : places) {
    if (x < low || x > high) continue;
    const double value = ValueOf(polynomial, x);
    if (!(value < least)) continue;
    least = value;
    at = x;
  }
  return at;
}

class SharedMinimiser {
 public:
  SharedMinimiser(const ceres::Solver::Options& options, SharedBlocks* blocks,
                  ceres::Solver::Summary* summary)
      : options_(options),
        blocks_(*blocks),
        summary_(*summary),
        radius_(options.initial_trust_region_radius) {}
  void Run();

 private:
  // Each false where it has ended, with the reason in the summary.
  bool Begin();
  bool GoesOn();
  bool TakeStep();
  bool Accept(const Point& candidate);

  bool Linearize();
  bool End(ceres::TerminationType type, const std::string& message);
  void SearchAlong(Point* step);
  Sample SampleAt(const Point& direction, double x);
  void Reject() {
    radius_ /= decrease_;
    decrease_ *= 2.0;
  }

  const ceres::Solver::Options& options_;
  SharedBlocks& blocks_;
  ceres::Solver::Summary& summary_;
  ceres::IterationSummary now_;
  Point x_;
  double cost_ = 0.0;
  double radius_, decrease_ = 2.0;
  int invalid_ = 0;  // steps, one after the other
  bool moved_ = false;
};

bool SharedMinimiser::End(ceres::TerminationType type,
                          const std::string& message) {
  summary_.termination_type = type;
  summary_.message = message;
  return false;
}

bool SharedMinimiser::Linearize() {
  ++summary_.num_jacobian_evaluations;
  if (!blocks_.Linearize(x_, now_.iteration == 0, &cost_)) {
    return End(ceres::FAILURE, "Residual and Jacobian evaluation failed.");
  }
  now_.cost = cost_;
  Point downhill = blocks_.gradient();
  downhill.theta *= -1.0;
  downhill.states *= -1.0;
  Point projected = blocks_.Plus(x_, downhill);
  projected.theta -= x_.theta;
  projected.states -= x_.states;
  now_.gradient_max_norm = blocks_.LargestNumber(projected);
  return true;
}

bool SharedMinimiser::Begin() {
  x_ = blocks_.Read();
  now_.iteration = 0;
  now_.step_is_valid = now_.step_is_successful = true;
  if (!Linearize()) return false;
  summary_.initial_cost = cost_;
  return true;
}

// Ends an iteration: tells who watches, and asks whether there is another.
bool SharedMinimiser::GoesOn() {
  blocks_.Write(x_);
  now_.trust_region_radius = radius_;
  summary_.iterations.push_back(now_);
  for (ceres::IterationCallback* callback : options_.callbacks) {
    const ceres::CallbackReturnType wanted = (*callback)(now_);
    if (wanted == ceres::SOLVER_TERMINATE_SUCCESSFULLY) {
      return End(ceres::USER_SUCCESS, "A callback asked to stop.");
    }
    if (wanted == ceres::SOLVER_ABORT) {
      return End(ceres::USER_FAILURE, "A callback asked to give up.");
    }
  }
  if (now_.iteration >= options_.max_num_iterations) {
    return End(ceres::NO_CONVERGENCE, "Maximum number of iterations reached.");
  }
  if (now_.step_is_successful &&
      now_.gradient_max_norm <= options_.gradient_tolerance) {
    return End(ceres::CONVERGENCE, "Gradient tolerance reached.");
  }
  if (radius_ <= options_.min_trust_region_radius) {
    return End(ceres::CONVERGENCE, "Minimum trust region radius reached.");
  }
  return true;
}

Sample SharedMinimiser::SampleAt(const Point& direction, double x) {
  Sample sample;
  sample.x = x;
  Point step = direction;
  step.theta *= x;
  step.states *= x;
  ++summary_.num_jacobian_evaluations;
  sample.valid = blocks_.CostAlong(blocks_.Plus(x_, step), direction,
                                   &sample.value, &sample.slope);
  return sample;
}

// Armijo's rule; shorter steps by the polynomial of the last two and the start.
void SharedMinimiser::SearchAlong(Point* step) {
  Sample start;
  start.valid = true;
  start.value = cost_;
  start.slope = blocks_.SlopeAlong(*step);
  Sample before, now = SampleAt(*step, 1.0);
  double largest = 0.0;
  const auto falls = [&] {
    return now.valid &&
           !(now.value >
             cost_ + options_.line_search_sufficient_function_decrease *
                         start.slope * now.x);
  };
  for (int i = 1; !falls(); ++i) {
    if (i >= options_.max_num_line_search_step_size_iterations) return;
    if (i == 1) largest = blocks_.LargestNumber(*step);
    const double low = options_.max_line_search_step_contraction * now.x;
    const double high = options_.min_line_search_step_contraction * now.x;
    double x = std::clamp(0.5 * now.x, low, high);
    if (now.valid) {
      std::vector<Sample> samples = {start, now};
      if (before.valid) samples.push_back(before);
      x = LeastBetween(samples, low, high);
    }
    if (x * largest < options_.min_line_search_step_size) return;
    before = now;
    now = SampleAt(*step, x);
  }
  step->theta *= now.x;
  step->states *= now.x;
}

bool SharedMinimiser::Accept(const Point& candidate) {
  moved_ = true;
  x_ = candidate;
  if (!Linearize()) return false;
  now_.step_is_successful = true;
  radius_ /= std::max(1.0 / 3.0,
                      1.0 - std::pow(2.0 * now_.relative_decrease - 1.0, 3));
  radius_ = std::min(options_.max_trust_region_radius, radius_);
  decrease_ = 2.0;
  return true;
}

bool SharedMinimiser::TakeStep() {
  Point step;
  double promised = 0.0;
  now_.step_is_valid =
      blocks_.Solve(&radius_, &step, &promised) && promised > 0.0;
  if (!now_.step_is_valid) {
    if (++invalid_ >= options_.max_num_consecutive_invalid_steps) {
      return End(ceres::FAILURE, "Too many steps in a row are invalid.");
    }
    Reject();
    now_.cost = cost_;
    now_.gradient_max_norm = summary_.iterations.back().gradient_max_norm;
    return true;
  }
  invalid_ = 0;
  if (blocks_.HasBounds() &&
      options_.max_num_line_search_step_size_iterations > 0) {
    SearchAlong(&step);
  }
  const Point candidate = blocks_.Plus(x_, step);
  double cost = 0.0;
  ++summary_.num_residual_evaluations;
  const bool possible = blocks_.Cost(candidate, &cost);
  if (!possible) cost = std::numeric_limits<double>::max();
  if (moved_) {
    Point way = candidate;
    way.theta -= x_.theta;
    way.states -= x_.states;
    now_.step_norm = std::sqrt(blocks_.SquaredNorm(way));
    const double size = std::sqrt(blocks_.SquaredNorm(x_));
    if (now_.step_norm <=
        options_.parameter_tolerance * (size + options_.parameter_tolerance)) {
      return End(ceres::CONVERGENCE, "Parameter tolerance reached.");
    }
  }
  now_.cost_change = cost_ - cost;
  if (std::abs(now_.cost_change) <= options_.function_tolerance * cost_) {
    return End(ceres::CONVERGENCE, "Function tolerance reached.");
  }
  now_.relative_decrease = possible ? now_.cost_change / promised
                                    : std::numeric_limits<double>::lowest();
  if (now_.relative_decrease > options_.min_relative_decrease) {
    return Accept(candidate);
  }
  Reject();
  now_.cost = cost;
  return true;
}

void SharedMinimiser::Run() {
  if (blocks_.Empty()) {
    double cost = 0.0;
    blocks_.Cost(blocks_.Read(), &cost);
    summary_.initial_cost = summary_.final_cost = cost;
    End(ceres::CONVERGENCE, "There is nothing to move.");
    return;
  }
  if (Begin()) {
    while (GoesOn()) {
      now_ = ceres::IterationSummary();
      now_.iteration = summary_.iterations.back().iteration + 1;
      if (!TakeStep()) break;
    }
    blocks_.Write(x_);
  }
  summary_.final_cost = cost_;
}

}  // namespace

void SolveOverProcesses(const Processes& all,
                        const ceres::Solver::Options& options, double* theta,
                        ceres::Problem* problem,
                        ceres::EvaluationCallback* moved,
                        ceres::Solver::Summary* summary) {
  *summary = ceres::Solver::Summary();
  summary->num_residual_evaluations = summary->num_jacobian_evaluations = 0;
  SharedBlocks blocks(all, options.num_threads, theta, problem, moved);
  SharedMinimiser(options, &blocks, summary).Run();
}

bool GradientOverProcesses(const Processes& all, int threads, double* theta,
                           ceres::Problem* problem,
                           ceres::EvaluationCallback* moved,
                           std::vector<double>* gradient) {
  SharedBlocks blocks(all, threads, theta, problem, moved);
  double cost = 0.0;
  if (!blocks.Linearize(blocks.Read(), true, &cost)) return false;
  const Eigen::VectorXd& by_theta = blocks.gradient().theta;
  gradient->assign(by_theta.begin(), by_theta.end());
  return true;
}

}  // namespace sysid
