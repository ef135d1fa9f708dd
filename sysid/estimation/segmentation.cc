#include "sysid/estimation/segmentation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "glog/logging.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/parallel.h"

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
  // How far each of some segments has been followed, and how the state there
  // moves with that at the start; lengths double, so each goes on from there.
  struct Walk {
    SegmentPlace start;
    int sample;
    Eigen::VectorXd x;
    RowMatrixXd phi;
  };
  std::vector<Walk> walks;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const ShootingPoint::Nodes& nodes = point.runs[r];
    const int count = std::min(nodes.segments(), kStarts);
    for (int i = 0; i < count; ++i) {
      const int k = nodes.segments() * i / count;
      walks.push_back({{static_cast<int>(r), k},
                       nodes.samples[k],
                       nodes.states.row(k).transpose(),
                       RowMatrixXd::Identity(2 * nv, 2 * nv)});
    }
  }
  double best = kFirstLength;
  while (best < longest) {
    const double length = 2.0 * best;
    const auto regular = [&](int i) {
      Walk& walk = walks[i];
      const int run = walk.start.run;
      const RunData& data = *problem.runs()[run];
      const std::vector<double>& t = data.run.t;
      const double t0 = t[point.runs[run].samples[walk.start.segment]];
      const auto end = std::upper_bound(t.begin(), t.end(), t0 + length);
      const int last = static_cast<int>(end - t.begin()) - 1;
      if (last <= walk.sample) return true;
      const SegmentRollout rollout(&model, &problem.map(), &data.measurements,
                                   walk.sample, last,
                                   problem.options().rollout);
      Eigen::VectorXd errors(rollout.num_residuals());
      Eigen::VectorXd x_end(model.state_size());
      RowMatrixXd J, J_end;
      if (!rollout.Linearize(walk.x.data(), point.theta.data(), false,
                             errors.data(), x_end.data(), &J, &J_end)) {
        return false;
      }
      walk.sample = last;
      walk.x = x_end;
      walk.phi = J_end * walk.phi;
      return walk.phi.topLeftCorner(nv, nv).operatorNorm() < kGrowth;
    };
    if (!ParallelFor(static_cast<int>(walks.size()), problem.options().threads,
                     regular)) {
      return best;
    }
    best = length;
  }
  return std::min(best, longest);
}

ShootingPoint SolveOneByOne(const ShootingProblem& problem,
                            ShootingStage::Options options,
                            const std::vector<ShootingPoint>& starts,
                            const std::vector<SegmentPlace>& which) {
  options.threads = 1;  // each; they are spread instead
  options.quiet = true;
  ShootingPoint point = starts.front();
  const auto solve = [&](int i) {
    const auto [r, k] = which[i];
    ShootingPoint single;
    single.theta = point.theta;
    single.runs.resize(point.runs.size());
    for (ShootingPoint::Nodes& nodes : single.runs) {
      nodes.samples = {0};
      nodes.states.resize(0, point.runs[r].states.cols());
    }
    ShootingPoint::Nodes& one = single.runs[r];
    one.samples = {point.runs[r].samples[k], point.runs[r].samples[k + 1]};
    const auto segments = std::make_shared<ShootingSegments>(problem, single);
    double least = std::numeric_limits<double>::infinity();
    Eigen::RowVectorXd best = point.runs[r].states.row(k);
    for (const ShootingPoint& start : starts) {
      one.states = start.runs[r].states.row(k);
      std::vector<HistoryEntry> history;
      const StageSummary done =
          ShootingStage(problem, options, &single, segments)
              .Solve("states", Now(), &history);
      if (!(done.cost < least)) continue;
      least = done.cost;
      best = one.states.row(0);
    }
    point.runs[r].states.row(k) = best;
    return true;
  };
  ParallelFor(static_cast<int>(which.size()), problem.options().threads, solve);
  return point;
}

ShootingPoint StatesOnly(const ShootingProblem& problem, double length,
                         double defect) {
  CHECK_EQ(problem.map().size(), 0);
  const std::vector<RowMatrixXd> states = AllStatesFromData(problem);
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
  return SolveOneByOne(problem, options, {longer, joined}, AllSegments(longer));
}

ShootingPoint StatesFrom(const ShootingProblem& problem,
                         const ShootingPoint& start) {
  CHECK_EQ(problem.map().size(), 0);
  ShootingStage::Options options;
  options.defect = std::numeric_limits<double>::infinity();
  options.function_tolerance = 1e-6;
  return SolveOneByOne(problem, options, {start}, AllSegments(start));
}

}  // namespace sysid
