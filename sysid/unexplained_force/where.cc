#include "sysid/unexplained_force/where.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/state_weights.h"
#include "sysid/unexplained_force/joint_motion.h"

namespace sysid {
namespace {

constexpr int kBins = 8;
constexpr int kFewestInBin = 10;
// Forces that leave more of the errors' variance than this, in units of the
// noise, or than this part of what those segments miss without them, are not
// those of the machine: the segments are too long for what is linear.
constexpr double kExplained = 1.2;
constexpr double kUnexplained = 0.003;
constexpr double kShorter = 2.0;   // times
constexpr double kShortest = 0.1;  // s

// What a joint's own channels missed at one instant of its motion.
struct Sample {
  double value = 0.0;    // of the motion
  double squares = 0.0;  // whitened
  double dof = 0.0;
};

void AddBins(const MotionBin& like, const std::vector<Sample>& samples,
             std::vector<MotionBin>* bins) {
  const auto [least, most] = std::minmax_element(
      samples.begin(), samples.end(),
      [](const Sample& a, const Sample& b) { return a.value < b.value; });
  const double from = least->value, width = (most->value - from) / kBins;
  if (!(width > 0)) return;
  std::vector<Sample> sums(kBins);
  std::vector<int> counts(kBins, 0);
  for (const Sample& sample : samples) {
    const int bin =
        std::min(kBins - 1, static_cast<int>((sample.value - from) / width));
    sums[bin].squares += sample.squares;
    sums[bin].dof += sample.dof;
    ++counts[bin];
  }
  for (int i = 0; i < kBins; ++i) {
    if (counts[i] < kFewestInBin) continue;
    MotionBin bin = like;
    bin.from = from + i * width;
    bin.to = from + (i + 1) * width;
    bin.samples = counts[i];
    bin.normalized_rms = std::sqrt(sums[i].squares / sums[i].dof);
    bins->push_back(bin);
  }
}

// Of a body's joint; nothing where no channel measures it.
void AddBinsOf(const LinearizedFit& fit, const Body& body,
               std::vector<MotionBin>* bins) {
  const Model& model = fit.problem().model();
  const Joint& joint = model.mechanism().joints[body.joint];
  const Eigen::Vector3d axis = LinkAxis(model.mechanism(), joint.child_link);
  std::vector<Sample> by_position, by_velocity;
  for (const auto& segment : fit.segments()) {
    const RunData& data = *fit.problem().runs()[segment->run];
    const RowMatrixXd states = fit.StatesAlong(*segment);
    for (const SegmentRow& row : segment->rollout->rows()) {
      const Channel& channel = data.run.channels[row.channel];
      if (channel.kind == ChannelKind::kFramePosition ||
          channel.target != body.joint) {
        continue;
      }
      const double sigma = data.sigma[row.channel];
      Sample sample;
      sample.squares =
          segment->errors.segment(row.first, row.size).squaredNorm() /
          (sigma * sigma);
      sample.dof = ResidualDof(data.measurements.residuals[row.channel]);
      const JointMotion motion =
          MotionAt(model, body, axis,
                   states.row(row.sample - segment->rollout->first()).data());
      // A joint that turns over comes back to where it was.
      sample.value = IsRotation1(body.type)
                         ? std::remainder(motion.position, 2 * M_PI)
                         : motion.position;
      by_position.push_back(sample);
      sample.value = motion.velocity.size() == 1 ? motion.velocity[0]
                                                 : motion.velocity.norm();
      by_velocity.push_back(sample);
    }
  }
  if (by_position.empty()) return;
  const bool ball = body.type == JointType::kSpherical;
  MotionBin like;
  like.joint = joint.name;
  like.over = ball ? "tilt" : "position";
  like.unit = body.type == JointType::kPrismatic ? "m" : "rad";
  AddBins(like, by_position, bins);
  like.over = ball ? "speed" : "velocity";
  like.unit += "/s";
  AddBins(like, by_velocity, bins);
}

bool IsOfEffect(const FreeParameter& free) {
  return free.parameter.kind == ParameterKind::kEffect;
}

// The furthest that a parameter ended from where it started, over its size. An
// effect starts where it does nothing, and has to move.
double FurthestMove(const ShootingProblem& problem, const Fit& fit) {
  double most = 0.0;
  for (size_t i = 0; i < fit.parameters.size(); ++i) {
    const FreeParameter& free = problem.free()[i];
    if (IsOfEffect(free)) continue;
    const double moved = fit.parameters[i].value - free.initial;
    const double size =
        std::max(std::abs(free.initial), free.parameter.typical_scale);
    const double part = std::abs(moved) / size;
    most = std::isfinite(part) ? std::max(most, part) : 1e9;
  }
  return most;
}

// Where the parameters started, effects as they were found.
Eigen::VectorXd StartValues(const ShootingProblem& problem, const Fit& fit) {
  Eigen::VectorXd values(problem.free().size());
  for (int i = 0; i < values.size(); ++i) {
    const FreeParameter& free = problem.free()[i];
    values[i] = IsOfEffect(free) ? fit.parameters[i].value : free.initial;
  }
  Eigen::VectorXd theta = problem.InitialTheta();
  problem.map().ThetaOf(values, &theta);
  return theta;
}

// 1 where one joint alone has the force, less the more they share it.
double Concentration(const UnexplainedForce& force) {
  double sum = 0.0;
  for (const JointForce& joint : force.joints) sum += joint.share * joint.share;
  return sum;
}

bool Explains(const UnexplainedForce& force) {
  return force.variance <= std::max(kExplained, kUnexplained * force.before);
}

// With the parameters theta, in segments from `length` down to as short as it
// takes to explain the errors; `best` where none does better.
UnexplainedForce ForceFrom(const ShootingProblem& problem, const Fit& fit,
                           const Eigen::VectorXd& theta, double length,
                           UnexplainedForce best) {
  for (; !Explains(best) && length > kShortest; length /= kShorter) {
    // States from the data, then the best for the parameters as they are.
    Solution cut = CutPoint(problem, theta, AllStatesFromData(problem), length);
    cut.rollout = fit.point.rollout;
    cut = SolveStates(problem, cut, {.twist_hold = kHeldSpin});
    UnexplainedForce next = EstimateForce(LinearizedFit(problem, cut));
    if (next.curves.empty()) continue;
    if (next.variance < best.variance) best = std::move(next);
  }
  return best;
}

// Parameters that are not to be trusted may have run away for want of what is
// missing: from where they started then. Where they went some way only, both
// are tried, and the force that fewer joints need is the better guess.
UnexplainedForce ForceOf(const ShootingProblem& problem, const Fit& fit,
                         const LinearizedFit& fitted) {
  constexpr double kSomeWay = 0.25, kRanAway = 1.0;  // of its size
  constexpr double kHuge = 20.0;                     // times the noise
  const double moved = FurthestMove(problem, fit);
  const bool trusted = fitted.Valid() && !IsDoubtful(fit) && moved < kRanAway;
  const bool wavering =
      !trusted || (moved > kSomeWay && fit.train.total.normalized_rms > kHuge);
  const double length = fit.segment_s;
  UnexplainedForce none;
  none.variance = std::numeric_limits<double>::infinity();
  UnexplainedForce best = none;
  if (trusted) {
    best = ForceFrom(problem, fit, fit.point.theta, length / kShorter,
                     EstimateForce(fitted));
  }
  if (wavering) {
    UnexplainedForce start =
        ForceFrom(problem, fit, StartValues(problem, fit), length, none);
    if (best.curves.empty() ||
        (!start.curves.empty() &&
         (Explains(start) || start.variance < best.variance) &&
         Concentration(start) > Concentration(best))) {
      best = std::move(start);
    }
  }
  return best.curves.empty() ? EstimateForce(fitted) : best;
}

}  // namespace

Where FindWhere(const ShootingProblem& problem, const Fit& fit) {
  Where where;
  where.channels = fit.train.channels;
  where.segments = fit.train.segments;
  where.horizon = EvaluateHorizon(problem, fit.point);
  const LinearizedFit linearized(problem, fit.point);
  if (linearized.Valid()) {
    for (const Body& body : problem.model().movers()) {
      AddBinsOf(linearized, body, &where.bins);
    }
    where.whiteness = TestWhiteness(linearized);
    where.inputs = CorrelateInputs(linearized);
  }
  UnexplainedForce force = ForceOf(problem, fit, linearized);
  where.force = std::move(force.curves);
  where.joints = std::move(force.joints);
  where.regression = std::move(force.regression);
  return where;
}

}  // namespace sysid
