#include "sysid/estimation/horizon.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>

#include "models/state.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/shooting_segment.h"
#include "sysid/estimation/state_weights.h"

namespace sysid {
namespace {

constexpr int kCount = static_cast<int>(std::size(kHorizons));
constexpr int kDraws = 2;      // a state
constexpr double kFree = 1.0;  // of StateBelief: no twist is held

struct Sum {
  double squares = 0.0, dof = 0.0;
};

// The first sample of a run that is later than t.
int After(const std::vector<double>& times, double t) {
  return static_cast<int>(std::upper_bound(times.begin(), times.end(), t) -
                          times.begin());
}

// A state at a sample of a run, and what becomes of it.
class Start {
 public:
  Start(const ShootingProblem& problem, const Solution& solution, int run,
        int sample, double reach, const Eigen::VectorXd& x)
      : problem_(problem),
        theta_(solution.theta),
        rollout_(solution.rollout),
        run_(run),
        data_(*problem.runs()[run]),
        first_(sample),
        last_(After(data_.run.t, data_.run.t[sample] + reach * 1.01) - 1),
        x_(x) {}

  // Adds the squares of some draws to those of each horizon; nothing where the
  // dynamics fail.
  void Add(ScratchPool* pool, std::mt19937_64* random,
           std::vector<Sum>* sums) const;

 private:
  bool Derivative(ScratchPool* pool, RowMatrixXd* J) const;
  bool Roll(const SegmentRollout& rollout, const Eigen::VectorXd& x,
            std::vector<double>* errors) const;

  const ShootingProblem& problem_;
  const Eigen::VectorXd& theta_;
  const RolloutOptions rollout_;
  const int run_;
  const RunData& data_;
  const int first_, last_;
  const Eigen::VectorXd x_;
};

bool Start::Derivative(ScratchPool* pool, RowMatrixXd* J) const {
  const std::vector<double>& t = data_.run.t;
  const int end =
      std::min(After(t, t[first_] + kHorizonWindow), data_.run.size() - 1);
  if (end <= first_) return false;
  const ShootingSegment window(problem_, rollout_, run_, first_, end, pool);
  Eigen::VectorXd r, x_end;
  RowMatrixXd J_end;
  return window.LinearizeRows(x_.data(), theta_.data(),
                              ShootingSegment::Columns::kState, &r, &x_end, J,
                              &J_end) &&
         J->rows() > 0 && J->allFinite();
}

bool Start::Roll(const SegmentRollout& rollout, const Eigen::VectorXd& x,
                 std::vector<double>* errors) const {
  errors->resize(rollout.num_residuals());
  std::vector<double> x_end(x.size());
  return rollout(x.data(), theta_.data(), errors->data(), x_end.data());
}

void Start::Add(ScratchPool* pool, std::mt19937_64* random,
                std::vector<Sum>* sums) const {
  RowMatrixXd J;
  if (last_ <= first_ || !Derivative(pool, &J)) return;
  // (J; B) dx = (w; 0): of what the window does not show (a spin) the belief
  // keeps the estimate near, as it does where states are estimated.
  const std::vector<double> belief = StateBelief(problem_, kFree);
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(J.rows() + J.cols(), J.cols());
  rows.topRows(J.rows()) = J;
  for (int i = 0; i < J.cols(); ++i) rows(J.rows() + i, i) = 1.0 / belief[i];
  const Eigen::HouseholderQR<Eigen::MatrixXd> solver(rows);
  const SegmentRollout rollout(&problem_.model(), &problem_.map(),
                               &data_.measurements, first_, last_, rollout_);
  std::vector<double> there, moved;
  if (!Roll(rollout, x_, &there)) return;
  std::normal_distribution<double> normal;
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::VectorXd w = Eigen::VectorXd::Zero(rows.rows());
    for (int i = 0; i < J.rows(); ++i) w[i] = normal(*random);
    const Eigen::VectorXd dx = solver.solve(w);
    Eigen::VectorXd x = x_;
    BoxPlus<double>(problem_.model(), x_.data(), dx.data(), x.data());
    if (!Roll(rollout, x, &moved)) continue;
    for (const SegmentRow& row : rollout.rows()) {
      if (!IsPositionLike(data_.run.channels[row.channel].kind)) continue;
      const double ahead = data_.run.t[row.sample] - data_.run.t[first_];
      const double dof = ResidualDof(data_.measurements.residuals[row.channel]);
      double squares = dof * std::pow(data_.sigma[row.channel], 2);
      for (int i = row.first; i < row.first + row.size; ++i) {
        squares += std::pow(moved[i] - there[i], 2);
      }
      for (int h = 0; h < kCount; ++h) {
        // As EvaluateHorizon: samples within a tenth of the horizon before it.
        if (ahead > kHorizons[h] * (1 + 1e-9) || ahead < 0.9 * kHorizons[h]) {
          continue;
        }
        (*sums)[h].squares += squares;
        (*sums)[h].dof += dof;
      }
    }
  }
}

}  // namespace

std::vector<double> HorizonReach(const std::vector<double>& t,
                                 const std::vector<int>& starts) {
  constexpr double kApart = 0.25;         // of the horizon
  constexpr int kFewest = 8, kMost = 20;  // of a horizon
  std::vector<double> reach(starts.size(), 0.0);
  for (const double horizon : kHorizons) {
    // Of its last tenth there must be samples.
    const double room = t.back() - t.front() - 0.9 * horizon;
    if (!(room >= 0.0)) continue;
    const double apart =
        std::max(std::min(kApart * horizon, room / kFewest), room / kMost);
    double next = t.front();
    for (size_t k = 0; k < starts.size(); ++k) {
      const double begin = t[starts[k]];
      constexpr double kRounding = 1e-9;  // s
      if (begin < next - kRounding || begin > t.front() + room) continue;
      reach[k] = horizon;
      next = begin + apart;
    }
  }
  return reach;
}

std::vector<HorizonError> EstimateNoiseHorizon(const ShootingProblem& problem,
                                               const Solution& point) {
  std::vector<Start> starts;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const int run = static_cast<int>(r);
    const std::vector<double>& t = problem.runs()[r]->run.t;
    RowMatrixXd states;
    if (!SampleStates(problem, point, run, &states)) continue;
    std::vector<int> windows = CutRun(t, kHorizonWindow, 1);
    windows.pop_back();
    const std::vector<double> reach = HorizonReach(t, windows);
    for (size_t k = 0; k < windows.size(); ++k) {
      if (reach[k] == 0.0) continue;
      starts.emplace_back(problem, point, run, windows[k], reach[k],
                          states.row(windows[k]).transpose());
    }
  }
  ScratchPool pool;
  std::vector<std::vector<Sum>> parts(starts.size(), std::vector<Sum>(kCount));
  ParallelFor(static_cast<int>(starts.size()), problem.options().threads,
              [&](int i) {
                std::mt19937_64 random(static_cast<unsigned>(i));
                starts[i].Add(&pool, &random, &parts[i]);
                return true;
              });
  std::vector<HorizonError> result;
  for (int h = 0; h < kCount; ++h) {
    Sum sum;
    for (const std::vector<Sum>& part : parts) {
      sum.squares += part[h].squares;
      sum.dof += part[h].dof;
    }
    if (sum.dof == 0) continue;
    result.push_back({kHorizons[h], std::sqrt(sum.squares / sum.dof)});
  }
  return result;
}

}  // namespace sysid
