#include "sysid/estimation/segmentation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "glog/logging.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/shooting_stage.h"

namespace sysid {
namespace {

std::vector<RowMatrixXd> AllSampleStates(const ShootingProblem& problem,
                                         const ShootingPoint& point) {
  std::vector<RowMatrixXd> states(point.runs.size());
  for (size_t r = 0; r < point.runs.size(); ++r) {
    if (!SampleStates(problem, point, static_cast<int>(r), &states[r])) {
      states[r] = StatesFromData(problem, static_cast<int>(r));
    }
  }
  return states;
}

// Independent segments, each a problem of its own: together they would share
// one trust region, and the most crooked of them would hold up all. Each starts
// from the state of every one of `starts`, and keeps the best.
ShootingPoint SolveOneByOne(const ShootingProblem& problem,
                            const ShootingStage::Options& options,
                            const std::vector<ShootingPoint>& starts) {
  ShootingPoint point = starts.front();
  ShootingPoint single;
  single.theta = point.theta;
  single.runs.resize(point.runs.size());
  for (ShootingPoint::Nodes& nodes : single.runs) nodes.samples = {0};
  for (size_t r = 0; r < point.runs.size(); ++r) {
    ShootingPoint::Nodes& all = point.runs[r];
    ShootingPoint::Nodes& one = single.runs[r];
    for (int k = 0; k < all.segments(); ++k) {
      double least = std::numeric_limits<double>::infinity();
      for (const ShootingPoint& start : starts) {
        one.samples = {all.samples[k], all.samples[k + 1]};
        one.states = start.runs[r].states.row(k);
        std::vector<HistoryEntry> history;
        const StageSummary done = ShootingStage(problem, options, &single)
                                      .Solve("states", Now(), &history);
        if (!(done.cost < least)) continue;
        least = done.cost;
        all.states.row(k) = one.states.row(0);
      }
    }
    one.samples = {0};
    one.states.resize(0, all.states.cols());
  }
  return point;
}

}  // namespace

int MinSegmentSamples(const ShootingProblem& problem) {
  const double per_sample = std::max(problem.DofPerSample(), 0.1);
  return std::max(5, static_cast<int>(std::ceil(
                         2.0 * problem.model().tangent_size() / per_sample)));
}

ShootingPoint CutPoint(const ShootingProblem& problem,
                       const Eigen::VectorXd& theta,
                       const std::vector<RowMatrixXd>& sample_states,
                       double length) {
  const int min_samples = MinSegmentSamples(problem);
  ShootingPoint point;
  point.theta = theta;
  for (size_t r = 0; r < problem.runs().size(); ++r) {
    ShootingPoint::Nodes nodes;
    nodes.samples = CutRun(problem.runs()[r]->run.t, length, min_samples);
    nodes.states.resize(nodes.segments(), sample_states[r].cols());
    for (int k = 0; k < nodes.segments(); ++k) {
      nodes.states.row(k) = sample_states[r].row(nodes.samples[k]);
    }
    point.runs.push_back(std::move(nodes));
  }
  return point;
}

void Recut(const ShootingProblem& problem, double length,
           ShootingPoint* point) {
  *point =
      CutPoint(problem, point->theta, AllSampleStates(problem, *point), length);
}

bool SameCut(const ShootingPoint& a, const ShootingPoint& b) {
  for (size_t r = 0; r < a.runs.size(); ++r) {
    if (a.runs[r].samples != b.runs[r].samples) return false;
  }
  return true;
}

double MeanSegment(const ShootingProblem& problem, const ShootingPoint& point) {
  double duration = 0.0;
  int segments = 0;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const std::vector<double>& t = problem.runs()[r]->run.t;
    duration += t.back() - t.front();
    segments += point.runs[r].segments();
  }
  return duration / segments;
}

double ChooseSegment(const ShootingProblem& problem,
                     const ShootingPoint& point) {
  constexpr double kGrowth = 4.0;
  constexpr int kStarts = 12;  // of a run, evenly spread
  const Model& model = problem.model();
  const int nv = model.nv();
  const double longest = std::min(problem.LongestDuration(), kLongestLength);
  double best = kFirstLength;
  while (best < longest) {
    const double length = 2.0 * best;
    for (size_t r = 0; r < point.runs.size(); ++r) {
      const RunData& data = *problem.runs()[r];
      const ShootingPoint::Nodes& nodes = point.runs[r];
      const std::vector<double>& t = data.run.t;
      const int count = std::min(nodes.segments(), kStarts);
      for (int i = 0; i < count; ++i) {
        const int k = nodes.segments() * i / count;
        const int first = nodes.samples[k];
        const auto end =
            std::upper_bound(t.begin(), t.end(), t[first] + length);
        const int last = static_cast<int>(end - t.begin()) - 1;
        if (last <= first) continue;
        const SegmentRollout rollout(&model, &problem.map(), &data.measurements,
                                     first, last, problem.options().rollout);
        std::vector<double> errors(rollout.num_residuals());
        std::vector<double> x_end(model.state_size());
        RowMatrixXd J, J_end;
        if (!rollout.Linearize(nodes.states.row(k).data(), point.theta.data(),
                               false, errors.data(), x_end.data(), &J,
                               &J_end) ||
            !(J_end.topLeftCorner(nv, nv).operatorNorm() < kGrowth)) {
          return best;
        }
      }
    }
    best = length;
  }
  return std::min(best, longest);
}

ShootingPoint StatesOnly(const ShootingProblem& problem, double length,
                         double defect) {
  CHECK_EQ(problem.map().size(), 0);
  std::vector<RowMatrixXd> states;
  for (size_t r = 0; r < problem.runs().size(); ++r) {
    states.push_back(StatesFromData(problem, static_cast<int>(r)));
  }
  ShootingPoint point =
      CutPoint(problem, Eigen::VectorXd(0), states, kFirstLength);
  std::vector<HistoryEntry> history;
  ShootingStage::Options options;
  options.defect = kLooseDefect;
  options.max_iterations = 20;
  options.function_tolerance = 1e-4;
  ShootingStage(problem, options, &point).Solve("states", Now(), &history);
  ShootingPoint longer =
      CutPoint(problem, point.theta, AllSampleStates(problem, point), length);
  options.defect = defect;
  options.max_iterations = 100;
  options.function_tolerance = 1e-8;
  if (std::isfinite(defect)) {
    ShootingStage(problem, options, &longer).Solve("states", Now(), &history);
    return longer;
  }
  ShootingPoint joined = longer;
  options.defect = kJoinedDefect;
  ShootingStage(problem, options, &joined).Solve("states", Now(), &history);
  options.defect = defect;
  return SolveOneByOne(problem, options, {longer, joined});
}

ShootingPoint StatesFrom(const ShootingProblem& problem,
                         const ShootingPoint& start) {
  CHECK_EQ(problem.map().size(), 0);
  ShootingStage::Options options;
  options.defect = std::numeric_limits<double>::infinity();
  options.function_tolerance = 1e-6;
  return SolveOneByOne(problem, options, {start});
}

}  // namespace sysid
