#include "sysid/estimation/segmentation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/internal_state.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/shooting_stage.h"

namespace sysid {
namespace {

std::vector<RowMatrixXd> AllSampleStates(const ShootingProblem& problem,
                                         const Solution& point) {
  std::vector<RowMatrixXd> states(point.runs.size());
  for (size_t r = 0; r < point.runs.size(); ++r) {
    if (!SampleStates(problem, point, static_cast<int>(r), &states[r])) {
      states[r] = StatesFromData(problem, static_cast<int>(r));
    }
  }
  return states;
}

// The states where segments begin.
void TakeStates(const RowMatrixXd& sample_states, Solution::Nodes* nodes) {
  nodes->states.resize(nodes->segments(), sample_states.cols());
  for (int k = 0; k < nodes->segments(); ++k) {
    nodes->states.row(k) = sample_states.row(nodes->samples[k]);
  }
}

ShootingStage::Options StageOf(const StateOptions& options) {
  return {.defect = options.defect,
          .fix_theta = true,
          .twist_hold = options.twist_hold,
          .max_iterations = options.max_iterations,
          .function_tolerance = options.tolerance,
          .news = options.news};
}

}  // namespace

int MinSegmentSamples(const ShootingProblem& problem) {
  const double per_sample = std::max(problem.data().DofPerSample(), 0.1);
  return std::max(5, static_cast<int>(std::ceil(
                         2.0 * problem.model().tangent_size() / per_sample)));
}

Solution CutPoint(const ShootingProblem& problem, const Eigen::VectorXd& theta,
                  const std::vector<RowMatrixXd>& sample_states,
                  double length) {
  const int min_samples = MinSegmentSamples(problem);
  Solution point;
  point.theta = theta;
  point.rollout = problem.options().rollout;
  for (size_t r = 0; r < problem.runs().size(); ++r) {
    Solution::Nodes nodes;
    nodes.samples = CutRun(problem.runs()[r]->run.t, length, min_samples);
    TakeStates(sample_states[r], &nodes);
    point.runs.push_back(std::move(nodes));
  }
  return point;
}

Solution ShortSegments(const ShootingProblem& problem) {
  Solution point = CutPoint(problem, problem.InitialTheta(),
                            AllStatesFromData(problem), kFirstLength);
  if (!(point.rollout.step > 0.0)) {
    point.rollout.step = problem.data().MedianSamplePeriod();
  }
  return point;
}

Solution Recut(const ShootingProblem& problem, const Solution& solution,
               double length) {
  Solution cut = CutPoint(problem, solution.theta,
                          AllSampleStates(problem, solution), length);
  cut.rollout = solution.rollout;
  return cut;
}

Solution WithStatesFromData(const ShootingProblem& problem, Solution solution) {
  const std::vector<RowMatrixXd> states = AllStatesFromData(problem);
  for (size_t r = 0; r < states.size(); ++r) {
    TakeStates(states[r], &solution.runs[r]);
  }
  return solution;
}

bool SameCut(const Solution& a, const Solution& b) {
  for (size_t r = 0; r < a.runs.size(); ++r) {
    if (a.runs[r].samples != b.runs[r].samples) return false;
  }
  return true;
}

double MeanSegment(const ShootingProblem& problem, const Solution& point) {
  double segments = 0.0;
  for (const Solution::Nodes& nodes : point.runs) segments += nodes.segments();
  return problem.data().TotalDuration() /
         SumOver(problem.processes(), segments);
}

double LongestSegment(const ShootingProblem& problem) {
  return std::min(problem.data().LongestDuration(), kLongestLength);
}

bool IsRegular(const ShootingProblem& problem, const Solution& point) {
  return ChooseSegment(problem, point, Drift::kLinear) >=
         LongestSegment(problem) * (1 - 1e-9);
}

double ChooseSegment(const ShootingProblem& problem, const Solution& point,
                     Drift allowed, ShootingSegments* segments) {
  // Where |dq/dq0| grows by more than this from half of a length to the length,
  // it grows faster than linearly: a regular motion (of a wide swing the period
  // depends on its width) about doubles it, chaos squares it.
  constexpr double kLinear = 3.0;
  constexpr double kLittle = 4.0;  // in all, whatever it grows like
  constexpr int kStarts = 12;      // of a run, evenly spread
  const Model& model = problem.model();
  const StateLayout& at = model.layout();
  const double longest = LongestSegment(problem);
  // How far each of some segments has been followed, and how the state there
  // moves with that at the start; lengths double, so each goes on from there.
  struct Walk {
    SegmentPlace start;
    int next;  // segment
    int sample;
    Eigen::VectorXd x;
    RowMatrixXd phi;
    double last = 1.0, growth = 1.0;  // there, and the most so far
  };
  std::vector<Walk> walks;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const Solution::Nodes& nodes = point.runs[r];
    const int count = std::min(nodes.segments(), kStarts);
    for (int i = 0; i < count; ++i) {
      const int k = nodes.segments() * i / count;
      walks.push_back(
          {{static_cast<int>(r), k},
           k,
           nodes.samples[k],
           nodes.states.row(k).transpose(),
           RowMatrixXd::Identity(at.tangent_size(), at.tangent_size())});
    }
  }
  const auto follow = [&](Walk* walk, int sample, const RowMatrixXd& J_end) {
    walk->sample = sample;
    walk->phi = J_end * walk->phi;
    walk->last =
        walk->phi.block(at.dq(), at.dq(), at.nv(), at.nv()).operatorNorm();
    walk->growth = std::max(walk->growth, walk->last);
  };
  // Goes on to a sample; false where the dynamics fail.
  const auto go = [&](Walk* walk, int sample) {
    const RunData& data = *problem.runs()[walk->start.run];
    const SegmentRollout rollout(&model, &problem.map(), &data.measurements,
                                 walk->sample, sample, point.rollout);
    Eigen::VectorXd errors(rollout.num_residuals());
    Eigen::VectorXd x_end(model.state_size());
    RowMatrixXd J, J_end;
    if (!rollout.Linearize(walk->x.data(), point.theta.data(), false,
                           errors.data(), x_end.data(), &J, &J_end)) {
      return false;
    }
    walk->x = x_end;
    follow(walk, sample, J_end);
    return true;
  };
  // Segments that are as short as the ways: from one to the next, whose states
  // are as near as the noise, and what one walk has seen serves all. Empty:
  // not yet seen.
  std::vector<std::vector<RowMatrixXd>> seen(point.runs.size());
  const bool by_segments = segments != nullptr &&
                           AllTrue(problem.processes(), segments->Fit(point)) &&
                           MeanSegment(problem, point) < 1.5 * kFirstLength;
  for (size_t r = 0; r < seen.size(); ++r) {
    seen[r].resize(point.runs[r].segments());
  }
  // Whether a walk has a next segment that ends by then.
  const auto has_next = [&](const Walk& walk, double end) {
    const Solution::Nodes& nodes = point.runs[walk.start.run];
    const std::vector<double>& t = problem.runs()[walk.start.run]->run.t;
    return walk.next < nodes.segments() &&
           t[nodes.samples[walk.next + 1]] < end;
  };
  const auto see = [&](double length) {
    std::vector<SegmentPlace> needed;
    for (Walk walk : walks) {
      const auto [r, k] = walk.start;
      const double begin = problem.runs()[r]->run.t[point.runs[r].samples[k]];
      for (; has_next(walk, begin + length + kFirstLength / 2); ++walk.next) {
        if (seen[r][walk.next].size() > 0) continue;
        seen[r][walk.next].resize(1, 1);
        needed.push_back({r, walk.next});
      }
    }
    return ParallelFor(
        static_cast<int>(needed.size()), problem.options().threads, [&](int i) {
          const auto [r, k] = needed[i];
          ShootingSegment* segment = segments->at(r, k);
          const bool ok = segment->Linearize(point.runs[r].states.row(k).data(),
                                             point.theta.data(),
                                             ShootingSegment::Columns::kState);
          if (ok) {
            seen[r][k] = segment->Take(segment->J_end(),
                                       ShootingSegment::Columns::kState);
          }
          return ok;
        });
  };
  double best = kFirstLength;
  while (best < longest) {
    const double length = 2.0 * best;
    const auto regular = [&](int i) {
      Walk& walk = walks[i];
      const std::vector<double>& t = problem.runs()[walk.start.run]->run.t;
      const double t0 =
          t[point.runs[walk.start.run].samples[walk.start.segment]];
      const double before = walk.growth;
      if (by_segments) {
        for (; has_next(walk, t0 + length + kFirstLength / 2); ++walk.next) {
          follow(&walk, 0, seen[walk.start.run][walk.next]);
        }
      }
      // By short ways: |dq/dq0| swings, and its greatest counts.
      for (double s = kFirstLength;
           !by_segments && s < length + kFirstLength / 2; s += kFirstLength) {
        const auto end = std::upper_bound(t.begin(), t.end(), t0 + s);
        const int sample = static_cast<int>(end - t.begin()) - 1;
        if (sample > walk.sample && !go(&walk, sample)) return false;
      }
      return allowed == Drift::kLittle
                 ? walk.last < kLittle
                 : walk.growth < std::max(kLittle, kLinear * before);
    };
    const bool ok = (!by_segments || see(length)) &&
                    ParallelFor(static_cast<int>(walks.size()),
                                problem.options().threads, regular);
    if (!AllTrue(problem.processes(), ok)) return best;
    best = length;
  }
  return std::min(best, longest);
}

Solution SolveStates(const ShootingProblem& problem, Solution solution,
                     const StateOptions& options) {
  std::vector<HistoryEntry> history;
  ShootingStage(problem, StageOf(options), &solution)
      .Solve("states", Now(), &history);
  return solution;
}

Solution SolveOneByOne(const ShootingProblem& problem,
                       const StateOptions& options,
                       const std::vector<Solution>& starts,
                       const std::vector<SegmentPlace>& which) {
  ShootingStage::Options stage = StageOf(options);
  stage.threads = 1;  // each; they are spread instead
  stage.quiet = true;
  Solution solution = starts.front();
  const ShootingProblem apart = problem.Apart();
  const auto solve = [&](int i) {
    const auto [r, k] = which[i];
    Solution single;
    single.theta = solution.theta;
    single.rollout = solution.rollout;
    single.runs.resize(solution.runs.size());
    for (Solution::Nodes& nodes : single.runs) {
      nodes.samples = {0};
      nodes.states.resize(0, solution.runs[r].states.cols());
    }
    Solution::Nodes& one = single.runs[r];
    one.samples = {solution.runs[r].samples[k],
                   solution.runs[r].samples[k + 1]};
    const auto segments = std::make_shared<ShootingSegments>(apart, single);
    double least = std::numeric_limits<double>::infinity();
    Eigen::RowVectorXd best = solution.runs[r].states.row(k);
    for (const Solution& start : starts) {
      one.states = start.runs[r].states.row(k);
      std::vector<HistoryEntry> history;
      const StageSummary done = ShootingStage(apart, stage, &single, segments)
                                    .Solve("states", Now(), &history);
      if (!(done.cost < least)) continue;
      least = done.cost;
      best = one.states.row(0);
    }
    solution.runs[r].states.row(k) = best;
    return true;
  };
  ParallelFor(static_cast<int>(which.size()), problem.options().threads, solve);
  return solution;
}

Solution SolveSegments(const ShootingProblem& problem, const Solution& solution,
                       const StateOptions& options) {
  return SolveOneByOne(problem, options, {solution}, AllSegments(solution));
}

Solution AdoptStates(const Model& from, Solution solution, const Model& to) {
  if (SameStates(from, to)) return solution;
  for (Solution::Nodes& nodes : solution.runs) {
    RowMatrixXd adopted(nodes.states.rows(), to.state_size());
    for (int k = 0; k < adopted.rows(); ++k) {
      adopted.row(k) =
          AdoptState(from, nodes.states.row(k).data(), to).transpose();
    }
    nodes.states = std::move(adopted);
  }
  return solution;
}

Solution StatesFromScratch(const ShootingProblem& problem, double length,
                           double defect) {
  const Solution loose = SolveStates(
      problem,
      CutPoint(problem, problem.InitialTheta(), AllStatesFromData(problem),
               kFirstLength),
      {.defect = kLooseDefect, .max_iterations = 20, .tolerance = 1e-4});
  const Solution longer = Recut(problem, loose, length);
  const bool independent = std::isinf(defect);
  const Solution joined = SolveStates(
      problem, longer,
      {.defect = independent ? kJoinedDefect : defect, .tolerance = 1e-8});
  if (!independent) return joined;
  return SolveOneByOne(problem, {.tolerance = 1e-8}, {longer, joined},
                       AllSegments(longer));
}

}  // namespace sysid
