#include "sysid/simulation/simulate.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "models/error.h"
#include "models/state.h"
#include "residuals/acting_inputs.h"
#include "residuals/channel_residual.h"
#include "residuals/sensed_positions.h"
#include "sysid/simulation/excitation.h"
#include "sysid/simulation/joint_limits.h"

namespace sysid {
namespace {

// A run with its times, and no efforts.
Run EmptyRun(const Model& model, const SimulationOptions& options) {
  Run run;
  run.name = model.mechanism().name;
  const int samples = SampleCount(options);
  for (int k = 0; k < samples; ++k) run.t.push_back(k / options.rate);
  run.effort.setZero(samples, model.nv());
  if (options.inputs == nullptr) return run;
  const Run& from = *options.inputs;
  // A row at a sample holds from there on.
  const double just_after = 1e-6 / options.rate;
  for (const Input& input : from.inputs) {
    run.inputs.push_back({input.name, input.held, {}});
    for (const double t : run.t) {
      const double at = from.t.front() + t + (input.held ? just_after : 0.0);
      run.inputs.back().values.push_back(InputBefore(from, input.name, at));
    }
  }
  return run;
}

MotionOptions HowToMove(const SimulationOptions& options) {
  return {options.integrator, options.step,
          std::max(1e-9, 1e-3 * options.noise)};
}

MultisineOptions HowToExcite(const SimulationOptions& options) {
  MultisineOptions multisine;
  multisine.lowest = options.lowest_frequency;
  multisine.highest = options.highest_frequency;
  multisine.effort_level = options.excitation_level;
  multisine.excursion = options.excursion;
  multisine.noise = options.noise;
  return multisine;
}

// Adds what sensors at motors say of the states.
void MeasureMotors(const Model& model, const RowMatrixXd& states,
                   const SimulationOptions& options, std::mt19937_64* random,
                   Run* run) {
  std::normal_distribution<double> normal(0.0, 1.0);
  Workspace<double> ws(model);
  SensedPositions<double> sensed(options.integrator, &ws);
  for (const Body& body : model.movers()) {
    if (body.type == JointType::kSpherical) continue;
    Channel channel;
    channel.kind = ChannelKind::kMotorPosition;
    channel.target = body.joint;
    channel.name = model.mechanism().joints[body.joint].name + ".motor_q";
    channel.values.resize(run->size(), 1);
    for (int k = 0; k < run->size(); ++k) {
      const double* x = states.row(k).data();
      sensed(*run, k, x);
      channel.values(k, 0) =
          sensed.OfMotors(x)[body.q_index] + options.noise * normal(*random);
    }
    run->channels.push_back(std::move(channel));
  }
}

// Adds what sensors say of the states, joint by joint.
void Measure(const Model& model, const RowMatrixXd& states,
             const SimulationOptions& options, std::mt19937_64* random,
             Run* run) {
  if (states.size() == 0) {
    throw InputError("simulation", "the motion does not stay finite",
                     "check masses and efforts, or give a smaller --step");
  }
  const int samples = run->size();
  const double noise = options.noise;
  std::normal_distribution<double> normal(0.0, 1.0);
  Workspace<double> ws(model);
  SensedPositions<double> sensed(options.integrator, &ws);
  for (const Body& body : model.movers()) {
    Channel channel;
    channel.target = body.joint;
    channel.name = model.mechanism().joints[body.joint].name;
    channel.values.resize(samples, ConfigurationSize(body.type));
    channel.kind = body.type == JointType::kSpherical
                       ? ChannelKind::kOrientation
                       : ChannelKind::kPosition;
    for (int k = 0; k < samples; ++k) {
      const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(
          sensed(*run, k, states.row(k).data()), model.nq());
      if (body.type == JointType::kSpherical) {
        Eigen::Vector3d error;
        for (int i = 0; i < 3; ++i) error[i] = noise * normal(*random);
        const Eigen::Quaterniond seen = Multiply(
            Eigen::Quaterniond(Eigen::Vector4d(q.segment<4>(body.q_index))),
            Exp<double>(error));
        channel.values.row(k) = seen.normalized().coeffs().transpose();
      } else {
        channel.values(k, 0) = q[body.q_index] + noise * normal(*random);
      }
    }
    run->channels.push_back(std::move(channel));
  }
  if (options.motor_sensors) MeasureMotors(model, states, options, random, run);
}

}  // namespace

Eigen::VectorXd RandomState(const Model& model, double amplitude,
                            std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> within(-amplitude, amplitude);
  std::uniform_real_distribution<double> turn(0.0, 2 * M_PI);
  Eigen::VectorXd x = NeutralState(model);
  for (const Body& body : model.movers()) {
    if (body.type == JointType::kSpherical) {
      const double direction = turn(random);
      const double tilt = within(random);
      const Eigen::Vector3d phi(tilt * std::cos(direction),
                                tilt * std::sin(direction), 0.0);
      x.segment<4>(model.layout().q(body)) = Exp<double>(phi).coeffs();
    } else {
      const Joint joint = LimitedJoint(model, body);
      double& q = x[model.layout().q(body)];
      q = within(random);
      if (!HasPositionLimits(joint)) continue;
      // Not just beside a limit either.
      const double half = 0.5 * (joint.upper - joint.lower);
      const double reach = std::min(amplitude, 0.95 * half);
      const double free = reach + 0.05 * half;
      q = q * (reach / amplitude) +
          std::max(joint.lower + free, std::min(0.0, joint.upper - free));
    }
  }
  return x;
}

Eigen::VectorXd NearestToNeutral(const Model& model) {
  Eigen::VectorXd x = NeutralState(model);
  for (const Body& body : model.movers()) {
    const Joint joint = LimitedJoint(model, body);
    if (!HasPositionLimits(joint)) continue;
    x[model.layout().q(body)] = std::clamp(0.0, joint.lower, joint.upper);
  }
  return x;
}

Eigen::VectorXd FirstState(const Model& model, const Run& run) {
  Eigen::VectorXd x = NeutralState(model);
  for (const Channel& channel : run.channels) {
    if (channel.kind == ChannelKind::kFramePosition ||
        channel.kind == ChannelKind::kMotorPosition) {
      continue;
    }
    const Joint& joint = model.mechanism().joints[channel.target];
    const int at = IsPositionLike(channel.kind) ? model.layout().q(joint)
                                                : model.layout().qd(joint);
    for (int c = 0; c < channel.values.cols(); ++c) {
      if (!std::isnan(channel.values(0, c))) x[at + c] = channel.values(0, c);
    }
  }
  return x;
}

int SampleCount(const SimulationOptions& options) {
  return static_cast<int>(std::lround(options.duration * options.rate)) + 1;
}

Run Simulate(const Model& model, const Eigen::VectorXd& x0,
             const SimulationOptions& options) {
  std::mt19937_64 random(options.seed);
  Run run = EmptyRun(model, options);
  RowMatrixXd states;
  if (options.excitation == Excitation::kWithinLimits) {
    states = ExciteWithinLimits(model, x0, HowToExcite(options),
                                HowToMove(options), &random, &run);
  } else {
    if (options.excitation == Excitation::kMultisine) {
      AddMultisineEfforts(model, HowToExcite(options), &random, &run);
    }
    states = DrivenMotion(model, x0, HowToMove(options), {}, &run);
  }
  Measure(model, states, options, &random, &run);
  return run;
}

Run SimulateDriven(const Model& model, const Eigen::VectorXd& x0,
                   const SimulationOptions& options, const DriveLaw& drive) {
  Run run = EmptyRun(model, options);
  const RowMatrixXd states =
      DrivenMotion(model, x0, HowToMove(options), drive, &run);
  std::mt19937_64 random(options.seed);
  Measure(model, states, options, &random, &run);
  return run;
}

}  // namespace sysid
