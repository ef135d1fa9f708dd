#include "sysid/simulation/simulate.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "models/error.h"
#include "models/state.h"
#include "residuals/segment.h"

namespace sysid {
namespace {

// Largest moment of the weight about each joint (N m), or the weight that a
// slide carries (N): by distance, at no special configuration.
std::vector<double> WeightScale(const Model& model) {
  Workspace<double> ws(model);
  std::vector<double> scale(model.bodies().size(), 0.0);
  const double g = ws.gravity.norm() > 0 ? ws.gravity.norm() : 9.81;
  for (size_t i = 0; i < model.bodies().size(); ++i) {
    const BodyData<double>& body = ws.bodies[i];
    double arm = body.mass > 0 ? body.h_B.norm() / body.mass : 0.0;
    for (int j = static_cast<int>(i); j >= 0; j = model.bodies()[j].parent) {
      const bool slide = model.bodies()[j].type == JointType::kPrismatic;
      scale[j] += body.mass * g * (slide ? 1.0 : arm);
      arm += ws.bodies[j].p_PB.norm();
    }
  }
  return scale;
}

void AddMultisine(const Model& model, const SimulationOptions& options,
                  std::mt19937_64* random, Run* run) {
  constexpr int kSines = 5;
  constexpr double kLowest = 0.1, kHighest = 2.0;  // Hz
  const std::vector<double> scale = WeightScale(model);
  std::uniform_real_distribution<double> phase(0.0, 2 * M_PI);
  std::uniform_real_distribution<double> within(0.0, 1.0);
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    const Body& body = model.bodies()[b];
    if (body.type == JointType::kSpherical) continue;
    const double amplitude =
        options.excitation_level * scale[b] * std::sqrt(2.0 / kSines);
    for (int s = 0; s < kSines; ++s) {
      const double f = kLowest * std::pow(kHighest / kLowest,
                                          (s + within(*random)) / kSines);
      const double shift = phase(*random);
      for (int k = 0; k < run->size(); ++k) {
        run->effort(k, body.v_index) +=
            amplitude * std::sin(2 * M_PI * f * run->t[k] + shift);
      }
    }
  }
}

// States at all samples, samples x state_size.
bool Roll(const Model& model, const Run& run, const Eigen::VectorXd& x0,
          Integrator integrator, double step, RowMatrixXd* states) {
  const ParameterMap nothing(model, {});
  const Measurements measurements{&run, {}};
  const SegmentRollout rollout(&model, &nothing, &measurements, 0,
                               run.size() - 1, {integrator, step});
  std::vector<double> x_end(x0.size()), visited;
  if (!rollout(x0.data(), static_cast<const double*>(nullptr),
               static_cast<double*>(nullptr), x_end.data(), &visited)) {
    return false;
  }
  *states =
      Eigen::Map<const RowMatrixXd>(visited.data(), run.size(), x0.size());
  return states->allFinite();
}

RowMatrixXd RollAccurately(const Model& model, const Run& run,
                           const Eigen::VectorXd& x0,
                           const SimulationOptions& options) {
  const double period = 1.0 / options.rate;
  RowMatrixXd states, finer;
  if (options.step > 0) {
    if (Roll(model, run, x0, options.integrator, options.step, &states)) {
      return states;
    }
  } else {
    const double tolerance = std::max(1e-9, 1e-3 * options.noise);
    bool have = Roll(model, run, x0, options.integrator, period, &states);
    // In chaos the two never agree; 256 steps a sample are then the truth.
    for (int parts = 2; parts <= 256; parts *= 2) {
      const bool have_finer =
          Roll(model, run, x0, options.integrator, period / parts, &finer);
      if (have && have_finer &&
          (states - finer)
                  .middleCols(model.layout().q(), model.nq())
                  .cwiseAbs()
                  .maxCoeff() < tolerance) {
        return finer;
      }
      have = have_finer;
      states = finer;
    }
    if (have) return states;
  }
  throw InputError("simulation", "the motion does not stay finite",
                   "check masses and efforts, or give a smaller --step");
}

}  // namespace

Eigen::VectorXd RandomState(const Model& model, double amplitude,
                            std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> within(-amplitude, amplitude);
  std::uniform_real_distribution<double> turn(0.0, 2 * M_PI);
  Eigen::VectorXd x = NeutralState(model);
  for (const Body& body : model.bodies()) {
    if (body.type == JointType::kSpherical) {
      const double direction = turn(random);
      const double tilt = within(random);
      const Eigen::Vector3d phi(tilt * std::cos(direction),
                                tilt * std::sin(direction), 0.0);
      x.segment<4>(model.layout().q(body)) = Exp<double>(phi).coeffs();
    } else {
      x[model.layout().q(body)] = within(random);
    }
  }
  return x;
}

Eigen::VectorXd FirstState(const Model& model, const Run& run) {
  Eigen::VectorXd x = NeutralState(model);
  for (const Channel& channel : run.channels) {
    if (channel.kind == ChannelKind::kFramePosition) continue;
    const Joint& joint = model.mechanism().joints[channel.target];
    const int at = IsPositionLike(channel.kind) ? model.layout().q(joint)
                                                : model.layout().qd(joint);
    for (int c = 0; c < channel.values.cols(); ++c) {
      if (!std::isnan(channel.values(0, c))) x[at + c] = channel.values(0, c);
    }
  }
  return x;
}

Run Simulate(const Model& model, const Eigen::VectorXd& x0,
             const SimulationOptions& options) {
  std::mt19937_64 random(options.seed);
  Run run;
  run.name = model.mechanism().name;
  const int samples =
      static_cast<int>(std::lround(options.duration * options.rate)) + 1;
  for (int k = 0; k < samples; ++k) run.t.push_back(k / options.rate);
  run.effort.setZero(samples, model.nv());
  if (options.excitation == Excitation::kMultisine) {
    AddMultisine(model, options, &random, &run);
  }
  const RowMatrixXd states = RollAccurately(model, run, x0, options);
  std::normal_distribution<double> normal(0.0, 1.0);
  Workspace<double> ws(model);
  for (const Body& body : model.bodies()) {
    Channel channel;
    channel.target = body.joint;
    channel.name = model.mechanism().joints[body.joint].name;
    channel.values.resize(samples, ConfigurationSize(body.type));
    channel.kind = body.type == JointType::kSpherical
                       ? ChannelKind::kOrientation
                       : ChannelKind::kPosition;
    for (int k = 0; k < samples; ++k) {
      Eigen::VectorXd q =
          states.row(k).segment(model.layout().q(), model.nq()).transpose();
      ws.ModifyMeasurement(q.data());
      if (body.type == JointType::kSpherical) {
        Eigen::Vector3d error;
        for (int i = 0; i < 3; ++i) error[i] = options.noise * normal(random);
        const Eigen::Quaterniond seen = Multiply(
            Eigen::Quaterniond(Eigen::Vector4d(q.segment<4>(body.q_index))),
            Exp<double>(error));
        channel.values.row(k) = seen.normalized().coeffs().transpose();
      } else {
        channel.values(k, 0) = q[body.q_index] + options.noise * normal(random);
      }
    }
    run.channels.push_back(std::move(channel));
  }
  return run;
}

}  // namespace sysid
