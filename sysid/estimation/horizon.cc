#include "sysid/estimation/horizon.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <utility>

#include "models/math/decompositions.h"
#include "models/state.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/shooting_segment.h"
#include "sysid/estimation/state_weights.h"

namespace sysid {
namespace {

constexpr int kCount = static_cast<int>(std::size(kHorizons));
constexpr double kRounding = 1e-9;  // of times, s
constexpr int kDraws = 2;           // a state
constexpr double kFree = 1.0;       // of StateBelief: no twist is held
// Of the log-likelihood of a window: z^2 / 2 for a state that is z = 0.2
// standard errors from its best, which makes an error 2 % larger at most.
constexpr double kNews = 0.02;

struct Sum {
  double squares = 0.0, dof = 0.0;

  void operator+=(const Sum& other) {
    squares += other.squares;
    dof += other.dof;
  }
};

// The first sample of a run that is later than t.
int After(const std::vector<double>& times, double t) {
  return static_cast<int>(std::upper_bound(times.begin(), times.end(), t) -
                          times.begin());
}

using HorizonSums =
    std::vector<std::map<std::string, Sum>>;  // horizons, channels

// Calls use(row, sum) for the measurements of positions at each horizon: within
// a tenth of it before it.
template <typename Use>
void ForEachAhead(const RunData& data, const SegmentRollout& rollout,
                  HorizonSums* sums, const Use& use) {
  for (const SegmentRow& row : rollout.rows()) {
    if (!IsPositionLike(data.run.channels[row.channel].kind)) continue;
    const double ahead = data.run.t[row.sample] - data.run.t[rollout.first()];
    for (int h = 0; h < kCount; ++h) {
      if (ahead > kHorizons[h] + kRounding ||
          ahead < 0.9 * kHorizons[h] - kRounding) {
        continue;
      }
      Sum& sum = (*sums)[h][data.run.channels[row.channel].name];
      use(row, &sum);
      sum.dof += ResidualDof(data.measurements.residuals[row.channel]);
    }
  }
}

// The sums that add(i, &sums) makes, for i up to `count`, by all threads, and
// of all processes.
std::vector<HorizonError> AddUp(
    const ShootingProblem& problem, size_t count,
    const std::function<void(int i, HorizonSums* sums)>& add) {
  std::vector<HorizonSums> parts(count, HorizonSums(kCount));
  ParallelFor(static_cast<int>(count), problem.options().threads, [&](int i) {
    add(i, &parts[i]);
    return true;
  });
  const DataSet& data = problem.data();
  const int width = static_cast<int>(data.channels().size());
  Totals totals(2 * kCount * width);
  for (const HorizonSums& part : parts) {
    for (int h = 0; h < kCount; ++h) {
      for (const auto& [name, sum] : part[h]) {
        const int at = 2 * (h * width + data.PlaceOf(name));
        totals.Add(at, sum.squares);
        totals.Add(at + 1, sum.dof);
      }
    }
  }
  const Eigen::VectorXd numbers = totals.Over(problem.processes());
  std::map<std::string, int> places;  // by name
  for (int c = 0; c < width; ++c) places[data.channels()[c].name] = c;
  std::vector<HorizonError> result;
  for (int h = 0; h < kCount; ++h) {
    Sum all;
    HorizonError error{kHorizons[h], 0.0, {}};
    for (const auto& [name, c] : places) {
      const int at = 2 * (h * width + c);
      const Sum sum{numbers[at], numbers[at + 1]};
      if (sum.dof == 0) continue;
      all += sum;
      error.channels.push_back({name, std::sqrt(sum.squares / sum.dof)});
    }
    if (all.dof == 0) continue;
    error.rms = std::sqrt(all.squares / all.dof);
    result.push_back(std::move(error));
  }
  return result;
}

// A window that is followed, to sample `last`.
struct Start {
  int run, window;
  int first, last;
};

// Those of a run that is cut at these samples.
void AddStarts(const ShootingProblem& problem, int run, std::vector<int> cuts,
               double longest, std::vector<Start>* starts) {
  const std::vector<double>& t = problem.runs()[run]->run.t;
  cuts.pop_back();
  const DataSet& data = problem.data();
  const std::vector<double> reach = HorizonReach(
      t, cuts, {data.first_run() + run, data.run_count()}, longest);
  for (size_t k = 0; k < cuts.size(); ++k) {
    const int last = After(t, t[cuts[k]] + reach[k] * 1.01) - 1;
    if (reach[k] == 0.0) continue;
    starts->push_back({run, static_cast<int>(k), cuts[k], last});
  }
}

SegmentRollout FollowFrom(const ShootingProblem& problem, const Solution& point,
                          const Start& start) {
  return SegmentRollout(&problem.model(), &problem.map(),
                        &problem.runs()[start.run]->measurements, start.first,
                        start.last, point.rollout);
}

// Whitened derivatives of a window's measurements by the tangent of the state x
// where it begins.
bool WindowDerivative(const ShootingProblem& problem, const Solution& point,
                      const Start& start, const double* x, ScratchPool* pool,
                      RowMatrixXd* J) {
  const std::vector<double>& t = problem.runs()[start.run]->run.t;
  const int end = std::min(After(t, t[start.first] + kHorizonWindow),
                           static_cast<int>(t.size()) - 1);
  if (end <= start.first) return false;
  const ShootingSegment window(problem, point.rollout, start.run, start.first,
                               end, pool);
  Eigen::VectorXd r, x_end;
  RowMatrixXd J_end;
  return window.LinearizeRows(x, point.theta.data(),
                              ShootingSegment::Columns::kState, &r, &x_end, J,
                              &J_end) &&
         J->rows() > 0 && J->allFinite();
}

// Adds the squares of some draws about x to those of each horizon; nothing
// where the dynamics fail.
void AddDraws(const ShootingProblem& problem, const Solution& point,
              const Start& start, const Eigen::VectorXd& x, ScratchPool* pool,
              std::mt19937_64* random, HorizonSums* sums) {
  RowMatrixXd J;
  if (start.last <= start.first ||
      !WindowDerivative(problem, point, start, x.data(), pool, &J)) {
    return;
  }
  // (J; B) dx = (w; 0): of what the window does not show (a spin) the belief
  // keeps the estimate near, as it does where states are estimated.
  const std::vector<double> belief = StateBelief(problem, kFree);
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(J.rows() + J.cols(), J.cols());
  rows.topRows(J.rows()) = J;
  for (int i = 0; i < J.cols(); ++i) rows(J.rows() + i, i) = 1.0 / belief[i];
  const HouseholderFactors solver(rows);
  const RunData& data = *problem.runs()[start.run];
  const SegmentRollout rollout = FollowFrom(problem, point, start);
  std::vector<double> there, moved;
  if (!RollErrors(rollout, x.data(), point.theta, &there)) return;
  std::normal_distribution<double> normal;
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::VectorXd w = Eigen::VectorXd::Zero(rows.rows());
    for (int i = 0; i < J.rows(); ++i) w[i] = normal(*random);
    const Eigen::VectorXd dx = solver.Solve(w);
    Eigen::VectorXd drawn = x;
    BoxPlus<double>(problem.model(), x.data(), dx.data(), drawn.data());
    if (!RollErrors(rollout, drawn.data(), point.theta, &moved)) continue;
    ForEachAhead(data, rollout, sums, [&](const SegmentRow& row, Sum* sum) {
      const double dof = ResidualDof(data.measurements.residuals[row.channel]);
      double squares = dof * std::pow(data.sigma[row.channel], 2);
      for (int i = row.first; i < row.first + row.size; ++i) {
        squares += std::pow(moved[i] - there[i], 2);
      }
      sum->squares += squares;
    });
  }
}

// At all samples, by the segments of a point: sooner than from the data.
std::vector<RowMatrixXd> StatesOfPoint(const ShootingProblem& problem,
                                       const Solution& point) {
  std::vector<RowMatrixXd> states(point.runs.size());
  for (size_t r = 0; r < states.size(); ++r) {
    if (!SampleStates(problem, point, static_cast<int>(r), &states[r])) {
      return AllStatesFromData(problem);
    }
  }
  return states;
}

}  // namespace

std::vector<double> HorizonReach(const std::vector<double>& t,
                                 const std::vector<int>& starts,
                                 const RunPlace& run, double longest) {
  constexpr double kApart = 0.25;         // of the horizon
  constexpr int kFewest = 8, kMost = 20;  // of a horizon
  constexpr int kOfAll = 400;             // of a horizon, of many runs
  const int most = std::clamp(kOfAll / run.count, 1, kMost);
  const int fewest = std::min(kFewest, most);
  // A low-discrepancy sequence: the golden ratio's multiples, modulo 1.
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0) * run.number;
  const double shift = most < kMost ? golden - std::floor(golden) : 0.0;
  std::vector<double> reach(starts.size(), 0.0);
  for (const double horizon : kHorizons) {
    if (horizon > longest) break;
    // Of its last tenth there must be samples.
    const double more = t.back() - t.front() - 0.9 * horizon;
    if (!(more >= -kRounding)) continue;
    const double room = std::max(more, 0.0);
    if (std::isfinite(longest)) reach.assign(starts.size(), 0.0);
    const double apart =
        std::max(std::min(kApart * horizon, room / fewest), room / most);
    double next = t.front() + shift * apart;
    for (size_t k = 0; k < starts.size(); ++k) {
      const double begin = t[starts[k]];
      if (begin < next - kRounding || begin > t.front() + room + kRounding) {
        continue;
      }
      reach[k] = horizon;
      next = begin + apart;
    }
  }
  return reach;
}

std::vector<HorizonError> EvaluateHorizon(const ShootingProblem& problem,
                                          const Solution& solution,
                                          double longest) {
  Solution windows =
      CutPoint(problem, solution.theta,
               std::isfinite(longest) ? StatesOfPoint(problem, solution)
                                      : AllStatesFromData(problem),
               kHorizonWindow);
  windows.rollout = solution.rollout;
  std::vector<Start> starts;
  for (size_t r = 0; r < windows.runs.size(); ++r) {
    AddStarts(problem, static_cast<int>(r), windows.runs[r].samples, longest,
              &starts);
  }
  std::vector<SegmentPlace> places;
  for (const Start& start : starts) {
    places.push_back({start.run, start.window});
  }
  windows = SolveOneByOne(problem, {.max_iterations = 20, .news = kNews},
                          {windows}, places);
  return AddUp(problem, starts.size(), [&](int i, HorizonSums* sums) {
    const Start& start = starts[i];
    if (start.last <= start.first) return;
    const SegmentRollout rollout = FollowFrom(problem, windows, start);
    const auto x = windows.runs[start.run].states.row(start.window);
    std::vector<double> errors;
    if (!RollErrors(rollout, x.data(), windows.theta, &errors)) return;
    ForEachAhead(*problem.runs()[start.run], rollout, sums,
                 [&](const SegmentRow& row, Sum* sum) {
                   for (int e = row.first; e < row.first + row.size; ++e) {
                     sum->squares += errors[e] * errors[e];
                   }
                 });
  });
}

std::vector<HorizonError> EstimateNoiseHorizon(const ShootingProblem& problem,
                                               const Solution& point) {
  std::vector<Start> starts;
  std::vector<RowMatrixXd> states(point.runs.size());
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const int run = static_cast<int>(r);
    if (!SampleStates(problem, point, run, &states[r])) continue;
    const std::vector<double>& t = problem.runs()[r]->run.t;
    AddStarts(problem, run, CutRun(t, kHorizonWindow, 1),
              std::numeric_limits<double>::infinity(), &starts);
  }
  ScratchPool pool;
  return AddUp(problem, starts.size(), [&](int i, HorizonSums* sums) {
    const Start& start = starts[i];
    std::mt19937_64 random(static_cast<unsigned>(i));
    AddDraws(problem, point, start,
             states[start.run].row(start.first).transpose(), &pool, &random,
             sums);
  });
}

}  // namespace sysid
