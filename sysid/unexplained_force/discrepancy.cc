#include "sysid/unexplained_force/discrepancy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "models/math/decompositions.h"
#include "models/parameters.h"
#include "residuals/segment_tangent.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/elimination.h"
#include "sysid/estimation/linearization.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/shooting_segment.h"
#include "sysid/estimation/state_weights.h"
#include "sysid/linearization/statistics.h"
#include "sysid/unexplained_force/force_equations.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Fisher's distribution is then the chi-squared.
constexpr double kManyDof = 1e6;
constexpr int kDraws = 16;  // their mean is known to a quarter or better

// The prior (7.8) that makes the data most likely.
struct RandomForce {
  VectorXd width;           // of each degree of freedom, N m or N
  double time_scale = 0.0;  // ell, s
  double variance = std::numeric_limits<double>::infinity();  // that remains
};

RandomForce EstimateRandomForce(const LinearizedFit& fit) {
  RandomForce random;
  const Processes& all = fit.problem().processes();
  if (!fit.Valid() || AllTrue(all, fit.segments().empty())) return random;
  const ForceResponse response(fit);
  if (!response.Valid()) return random;
  const ForceEquations equations = MakeForceEquations(response);
  const SmoothForce force(equations);
  if (!force.Valid()) return random;
  random.width.setZero(equations.nv);
  for (int v = 0; v < equations.nv; ++v) {
    if (force.Seen(v)) random.width[v] = force.width(v);
  }
  // Of all runs about the same: that of the first.
  Packer packer;
  if (!response.knots().empty()) packer.Put(response.knots().front().spacing);
  for (const std::string& bytes : GatherToAll(all, packer.bytes())) {
    if (bytes.empty()) continue;
    random.time_scale = force.time_scale() * Unpacker(bytes).Number();
    break;
  }
  random.variance = force.variance();
  return random;
}

// Knots of a run, closer than the time scale, between which forces are linear.
ForceKnots KnotsFor(const Run& run, double time_scale) {
  constexpr double kKnotsPerScale = 2.0;
  ForceKnots knots;
  knots.start = run.t.front();
  knots.spacing = time_scale / kKnotsPerScale;
  knots.count = 2 + knots.Before(run.t.back());
  return knots;
}

// The covariance of C' phi; C: forces at knots (knots * widths) x columns.
MatrixXd CovarianceOfScores(const MatrixXd& C, const RandomForce& random,
                            double spacing) {
  constexpr double kFar = 12.0;  // time scales: the correlation is gone
  const int nv = static_cast<int>(random.width.size());
  const int knots = static_cast<int>(C.rows()) / nv;
  const double apart_by_one = spacing / random.time_scale;
  const int reach = std::min(knots - 1, static_cast<int>(kFar / apart_by_one));
  MatrixXd smoothed = MatrixXd::Zero(C.rows(), C.cols());
  for (int apart = -reach; apart <= reach; ++apart) {
    const int first = std::max(0, -apart) * nv;
    const int rows = (knots - std::abs(apart)) * nv;
    smoothed.middleRows(first, rows) += ForceCorrelation(apart * apart_by_one) *
                                        C.middleRows(first + apart * nv, rows);
  }
  for (int row = 0; row < smoothed.rows(); ++row) {
    smoothed.row(row) *= random.width[row % nv] * random.width[row % nv];
  }
  return C.transpose() * smoothed;
}

// Paths of the random force, (knots * widths) x draws: of each degree of
// freedom
//   ell^2 f'' + sqrt(2) ell f' + f = white noise,
// whose correlation is that of (7.8), exactly from knot to knot.
MatrixXd DrawForces(const RandomForce& random, const ForceKnots& knots,
                    int draws, std::mt19937_64* generator) {
  const int nv = static_cast<int>(random.width.size());
  const double x = knots.spacing / (std::sqrt(2.0) * random.time_scale);
  // By (f, ell f'), whose stationary covariance is the identity.
  Eigen::Matrix2d A;
  A << std::cos(x) + std::sin(x), std::sqrt(2.0) * std::sin(x),
      -std::sqrt(2.0) * std::sin(x), std::cos(x) - std::sin(x);
  A *= std::exp(-x);
  const Eigen::Matrix2d L =
      (Eigen::Matrix2d::Identity() - A * A.transpose()).llt().matrixL();
  std::normal_distribution<double> normal;
  MatrixXd paths(knots.count * nv, draws);
  for (int draw = 0; draw < draws; ++draw) {
    for (int v = 0; v < nv; ++v) {
      Eigen::Vector2d f(normal(*generator), normal(*generator));
      for (int k = 0; k < knots.count; ++k) {
        paths(k * nv + v, draw) = random.width[v] * f[0];
        f = A * f + L * Eigen::Vector2d(normal(*generator), normal(*generator));
      }
    }
  }
  return paths;
}

// A segment that forces act on, its errors whitened.
class ForcedSegment {
 public:
  ForcedSegment(const ShootingProblem& problem, const Solution& point,
                const SegmentPlace& at)
      : rollout_(&problem.model(), &problem.map(),
                 &problem.runs()[at.run]->measurements,
                 point.runs[at.run].samples[at.segment],
                 point.runs[at.run].samples[at.segment + 1], point.rollout),
        t_(problem.runs()[at.run]->run.t) {
    valid_ = LinearizeAlong(rollout_,
                            point.runs[at.run].states.row(at.segment).data(),
                            point.theta.data(), &tangent_);
    if (!valid_) return;
    VectorXd r = tangent_.r;
    RowMatrixXd& C = tangent_.C;
    MakeWhitening(problem, at.run, rollout_)
        .Apply(r.data(),
               {Eigen::Map<RowMatrixXd>(C.data(), C.rows(), C.cols())});
  }
  bool Valid() const { return valid_; }

  // A phi: what forces at knots do to the rows of the segment, `rows` with
  // those of its defect or belief.
  MatrixXd Forward(const MatrixXd& phi, const ForceKnots& knots, int rows,
                   const VectorXd& defect_weight) const {
    const int nv = static_cast<int>(phi.rows()) / knots.count;
    MatrixXd out = MatrixXd::Zero(rows, phi.cols());
    MatrixXd dx = MatrixXd::Zero(tangent_.C.cols(), phi.cols());
    ForEachSample([&](int k, int first, int size) {
      out.middleRows(first, size) = tangent_.C.middleRows(first, size) * dx;
      if (k == rollout_.last()) return;
      const int i = k - rollout_.first();
      MatrixXd f = MatrixXd::Zero(nv, phi.cols());
      knots.Around(Middle(i), [&](int knot, double weight) {
        f += weight * phi.middleRows(knot * nv, nv);
      });
      dx = (tangent_.A[i] * dx + tangent_.B[i] * f).eval();
    });
    if (defect_weight.size() > 0) {
      out.bottomRows(dx.rows()) = defect_weight.asDiagonal() * dx;
    }
    return out;
  }

  // Adds A' W.
  void Backward(const MatrixXd& W, const ForceKnots& knots,
                const VectorXd& defect_weight, MatrixXd* sum) const {
    const int nv = static_cast<int>(sum->rows()) / knots.count;
    std::vector<std::array<int, 3>> samples;
    ForEachSample([&](int k, int first, int size) {
      samples.push_back({k, first, size});
    });
    const int n = static_cast<int>(tangent_.C.cols());
    MatrixXd lambda = MatrixXd::Zero(n, W.cols());
    if (defect_weight.size() > 0) {
      lambda = defect_weight.asDiagonal() * W.bottomRows(n);
    }
    for (auto at = samples.rbegin(); at != samples.rend(); ++at) {
      const auto [k, first, size] = *at;
      if (k < rollout_.last()) {
        const int i = k - rollout_.first();
        const MatrixXd c = tangent_.B[i].transpose() * lambda;
        knots.Around(Middle(i), [&](int knot, double weight) {
          sum->middleRows(knot * nv, nv) += weight * c;
        });
        lambda = (tangent_.A[i].transpose() * lambda).eval();
      }
      lambda += tangent_.C.middleRows(first, size).transpose() *
                W.middleRows(first, size);
    }
  }

 private:
  double Middle(int i) const {
    return 0.5 * (t_[rollout_.first() + i] + t_[rollout_.first() + i + 1]);
  }
  // Calls visit(sample, first of its rows, their number) in the order of time.
  template <typename Visit>
  void ForEachSample(const Visit& visit) const {
    const std::vector<SegmentRow>& rows = rollout_.rows();
    size_t row = 0;
    int first = 0;
    for (int k = rollout_.first(); k <= rollout_.last(); ++k) {
      int size = 0;
      for (; row < rows.size() && rows[row].sample == k; ++row) {
        size += rows[row].size;
      }
      visit(k, first, size);
      first += size;
    }
  }

  SegmentRollout rollout_;
  const std::vector<double>& t_;
  SegmentTangent tangent_;
  bool valid_ = false;
};

// What a run says of theta and of random forces.
struct RunScores {
  RowMatrixXd root;   // RunReduction's
  RowMatrixXd drawn;  // the same with a column of theta for each draw
  MatrixXd scores;    // the covariance of W' A phi
};

bool ScoresOf(const ShootingProblem& problem, const Fit& fit, int run,
              const RandomForce& random, const VectorXd& defect_weight,
              const RunLinearization& linearization, RunScores* out) {
  const int n = problem.map().size();
  const RunReduction reduction(linearization);
  out->root = reduction.root();
  const RowMatrixXd still = reduction.SubstituteBack(VectorXd::Zero(n));
  std::vector<RowMatrixXd> dx(n);
  for (int i = 0; i < n; ++i) {
    dx[i] = reduction.SubstituteBack(VectorXd::Unit(n, i)) - still;
  }
  const ForceKnots knots =
      KnotsFor(problem.runs()[run]->run, random.time_scale);
  std::mt19937_64 generator(problem.data().first_run() + run + 1);
  const MatrixXd paths = DrawForces(random, knots, kDraws, &generator);
  MatrixXd C = MatrixXd::Zero(paths.rows(), n);
  RunLinearization drawn = linearization;
  for (size_t k = 0; k < linearization.segments.size(); ++k) {
    const SegmentLinearization& segment = linearization.segments[k];
    const ForcedSegment forced(problem, fit.point, {run, static_cast<int>(k)});
    if (!forced.Valid()) return false;
    const bool joined = segment.J_next.size() > 0;
    MatrixXd W = segment.J_theta;
    for (int i = 0; i < n; ++i) {
      W.col(i) += segment.J_x * dx[i].row(k).transpose();
      if (joined) W.col(i) += segment.J_next * dx[i].row(k + 1).transpose();
    }
    const VectorXd weight = joined ? defect_weight : VectorXd();
    forced.Backward(W, knots, weight, &C);
    RowMatrixXd& J_theta = drawn.segments[k].J_theta;
    J_theta.conservativeResize(Eigen::NoChange, n + kDraws);
    J_theta.rightCols(kDraws) = forced.Forward(
        paths, knots, static_cast<int>(segment.r.size()), weight);
  }
  out->drawn = RunReduction(drawn).root();
  out->scores = CovarianceOfScores(C, random, knots.spacing);
  return true;
}

// The sum of squares tells the size of the force no better than nu independent
// numbers do,
//   nu = tr(M)^2 / tr(M^2),   M = P^-1 A' A, states and theta projected out
// (Satterthwaite 1946), M by the products of independent draws. So that 1.96
// standard errors hold 95 %: Student's quantile for nu over that of the normal
// distribution, squared.
double Widening(const MatrixXd& products) {
  const int draws = static_cast<int>(products.rows());
  const double trace = products.trace() / draws;
  const double of_square =
      (products.squaredNorm() - products.diagonal().squaredNorm()) /
      (draws * (draws - 1.0));
  const double nu = std::max(1.0, trace * trace / of_square);
  const double t = StudentQuantile(0.975, nu) / 1.959964;
  return t * t;
}

// The root of N, and the covariance of the score by (6.7), with the force as
// large as (6.8) has it. False where the dynamics fail.
bool ScoreCovariance(const ShootingProblem& problem, const Fit& fit,
                     RandomForce* random, RowMatrixXd* root, MatrixXd* scores) {
  std::vector<RunLinearization> runs;
  if (!Linearize(problem, fit.point,
                 {.defect = fit.defect, .triangular = false}, &runs)) {
    return false;
  }
  // A defect's derivative by the end of its segment is the identity where it is
  // small.
  const std::vector<double> sigma = DefectSigma(problem);
  const VectorXd defect_weight =
      (Eigen::Map<const VectorXd>(sigma.data(), std::ssize(sigma)) * fit.defect)
          .cwiseInverse();
  const int n = problem.map().size(), count = static_cast<int>(runs.size());
  std::vector<RunScores> of_run(count);
  const Processes& processes = problem.processes();
  const bool mine = ParallelFor(
      count, problem.options().threads, problem.options().stop, [&](int r) {
        return ScoresOf(problem, fit, r, *random, defect_weight, runs[r],
                        &of_run[r]);
      });
  if (!AllTrue(processes, mine)) return false;
  RowMatrixXd J_prior;
  VectorXd r_prior;
  LinearizePriors(problem, fit.point.theta, &J_prior, &r_prior);
  // Square also where the data says little.
  std::vector<RowMatrixXd> roots(1, RowMatrixXd::Zero(n + 1, n + 1));
  std::vector<RowMatrixXd> drawn(
      1, RowMatrixXd::Zero(n + kDraws + 1, n + kDraws + 1));
  Totals totals(n * n);
  for (const RunScores& run : of_run) {
    roots.push_back(run.root);
    drawn.push_back(run.drawn);
    totals.Add(0, run.scores);
  }
  *scores = totals.Over(processes).reshaped(n, n);
  if (processes.rank() > 0) J_prior.resize(0, n);  // they count once
  RowMatrixXd prior = RowMatrixXd::Zero(J_prior.rows(), n + 1);
  prior.leftCols(n) = J_prior;
  roots.push_back(prior);
  prior.conservativeResizeLike(
      RowMatrixXd::Zero(J_prior.rows(), n + kDraws + 1));
  drawn.push_back(prior);
  const RowMatrixXd all = MergeRoots(processes, roots);
  *root = all.topLeftCorner(n, n);
  const double squares = all(n, n) * all(n, n);
  const MatrixXd R = MergeRoots(processes, drawn).block(n, n, kDraws, kDraws);
  const MatrixXd products = R.transpose() * R;  // of what is left of the draws
  const double expected = products.trace() / kDraws;
  if (!(expected > 0)) return false;
  const double size =
      std::max(0.0, squares - random->variance * fit.train.dof) / expected;
  random->width *= std::sqrt(size);
  *scores *= size * Widening(products);
  *scores += random->variance * root->transpose() * *root;
  return true;
}

std::vector<Discrepancy> ByJoint(const Model& model,
                                 const RandomForce& random) {
  // Where the correlation is 1/e, in times ell: exp(-x) (cos x + sin x) = 1/e
  // for x = 1.2378, x = t / (sqrt(2) ell).
  constexpr double kCorrelated = 1.7505;
  std::vector<Discrepancy> list;
  for (const Body& body : model.movers()) {
    const int size = VelocitySize(body);
    list.push_back({model.mechanism().joints[body.joint].name,
                    random.width.segment(body.v_index, size).norm() /
                        std::sqrt(1.0 * size),
                    kCorrelated * random.time_scale});
  }
  return list;
}

// Whether a step leaves the parameters other than those `at` something of their
// way to their bounds: more than a tenth, since linearisations are no better.
bool StaysWithinBounds(const Estimates& estimates, const std::vector<int>& at,
                       const VectorXd& step) {
  constexpr double kLeft = 0.1;
  for (int i = 0; i < step.size(); ++i) {
    if (std::find(at.begin(), at.end(), i) != at.end()) continue;
    const ParameterEstimate& p = estimates.parameters[i];
    if (p.at_bound) continue;  // held there
    if (-step[i] > (1 - kLeft) * (p.value - p.lower)) return false;
    if (step[i] > (1 - kLeft) * (p.upper - p.value)) return false;
  }
  return true;
}

// What the residuals say of a random force, and the covariance with it.
void AddDiscrepancyOf(const ShootingProblem& problem, Fit* fit) {
  // Over longer segments a force that hardly changes would pass for random.
  const double length = ChooseSegment(problem, fit->point, Drift::kLittle);
  RandomForce random = EstimateRandomForce(LinearizedFit(
      problem, length < fit->segment_s ? Recut(problem, fit->point, length)
                                       : fit->point));
  RowMatrixXd root;
  MatrixXd scores;
  if (!std::isfinite(random.variance) ||
      !ScoreCovariance(problem, *fit, &random, &root, &scores)) {
    return;
  }
  fit->discrepancy = ByJoint(problem.model(), random);
  static_cast<Estimates&>(*fit) =
      MakeEstimates(problem, fit->point.theta, root, scores);
}

}  // namespace

void AddDiscrepancy(const ShootingProblem& given, Fit* fit) {
  if (!(fit->train.total.normalized_rms > NoiseFloor(fit->train.dof))) return;
  // A fit that may be stopped with a point to keep keeps it.
  try {
    ThrowIfCancelled(given.options().stop);
    AddDiscrepancyOf(given.Weighing(fit->misfit), fit);
  } catch (const Cancelled&) {
    if (!given.options().keep_best) throw;
  }
}

double PValueOf(const Effect& effect, const Model& given, const Fit& fit) {
  std::map<std::string, double> nominal;
  for (const Parameter& parameter : AllParameters(given)) {
    nominal[parameter.name] = parameter.nominal;
  }
  std::vector<int> at;
  std::vector<double> to_none;
  bool none_at_bound = false;
  const auto look_at = [&](const std::string& name, double null_value) {
    const auto known = nominal.find(name);
    const double none = known != nominal.end() ? known->second : null_value;
    for (size_t i = 0; i < fit.parameters.size(); ++i) {
      const ParameterEstimate& estimate = fit.parameters[i];
      if (estimate.name != name || estimate.at_bound) continue;
      at.push_back(static_cast<int>(i));
      to_none.push_back(none - estimate.value);
      none_at_bound = none <= estimate.lower || none >= estimate.upper;
    }
  };
  for (const EffectParameter& own : effect.parameters()) {
    if (own.grid.empty() && !own.whole) look_at(own.name, own.null_value);
  }
  for (const std::string& name : effect.adjusts_nominal()) look_at(name, 0.0);
  if (at.empty()) return 0.0;
  const int n = static_cast<int>(at.size());
  const VectorXd d = Eigen::Map<const VectorXd>(to_none.data(), n);
  MatrixXd variance = fit.covariance(at, at);
  const MatrixXd moves = fit.undetermined(at, Eigen::all);
  if (moves.cols() > 0 &&
      StaysWithinBounds(fit, at,
                        fit.undetermined * ShortestLeastSquares(moves, d))) {
    variance += moves * moves.transpose();
  }
  const double p =
      FisherTail(d.dot(SolveSymmetric(variance, d)) / n, n, kManyDof);
  return n == 1 && none_at_bound ? 0.5 * p : p;
}

}  // namespace sysid
