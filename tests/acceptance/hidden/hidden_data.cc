#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>

#include "glog/logging.h"
#include "models/dynamics.h"
#include "models/internal_state.h"
#include "models/math/rotation.h"
#include "models/state.h"
#include "sysid/simulation/simulate.h"
#include "tests/acceptance/hidden/hidden_case.h"
#include "tests/acceptance/hidden/plant.h"
#include "tests/support/fnv1a.h"

namespace sysid {
namespace {

constexpr double kDuration = 8.0, kRate = 100.0;

// Follows the reference by computed torque with a natural frequency of 1 Hz;
// joints that are not driven get nothing.
Controller TrackingController(const TestMechanism& mechanism,
                              const Model& truth, std::uint64_t seed) {
  constexpr double kFrequency = 2 * M_PI;  // rad/s
  const auto reference = std::make_shared<Reference>(mechanism, seed);
  const auto model = std::make_shared<Model>(truth);
  const auto ws = std::make_shared<Workspace<double>>(*model);
  return [=, driven = mechanism.driven](double t, const Eigen::VectorXd& x,
                                        double* effort) {
    const int nq = model->nq(), nv = model->nv();
    Eigen::VectorXd qdd = Eigen::VectorXd::Zero(nv), tau(nv);
    for (size_t i = 0; i < driven.size(); ++i) {
      const Joint& joint = model->mechanism().joints[driven[i]];
      double q, qd, acceleration;
      reference->At(static_cast<int>(i), t, &q, &qd, &acceleration);
      qdd[joint.v_index] = acceleration +
                           2 * kFrequency * (qd - x[nq + joint.v_index]) +
                           kFrequency * kFrequency * (q - x[joint.q_index]);
    }
    InverseDynamics<double>(ws.get(), x.data(), x.data() + nq, qdd.data(),
                            tau.data());
    std::fill(effort, effort + nv, 0.0);
    for (const int index : driven) {
      const int v = model->mechanism().joints[index].v_index;
      effort[v] = tau[v];
    }
  };
}

// The run before it is moved through: times, and the efforts of an open loop,
// which are those of Simulate (they go by the weight of the bodies).
sysid::Run Planned(const TestMechanism& mechanism, const Model& truth,
                   const Model& with_effects, const Eigen::VectorXd& x0,
                   SimulationOptions options) {
  if (mechanism.drive == Drive::kMultisine) {
    MechanismParameters<double> bodies = with_effects.nominal();
    bodies.effects = truth.nominal().effects;
    Model without_effects = truth;
    without_effects.SetNominal(bodies);
    options.noise = 0.0;
    options.step = 1.0 / options.rate;
    sysid::Run run = Simulate(without_effects, x0, options);
    run.channels.clear();
    return run;
  }
  sysid::Run run;
  run.name = mechanism.name;
  const int samples =
      static_cast<int>(std::lround(options.duration * options.rate)) + 1;
  for (int k = 0; k < samples; ++k) run.t.push_back(k / options.rate);
  run.effort.setZero(samples, truth.nv());
  return run;
}

// A joint's position `delay` before each sample, between samples the cubic
// through positions and rates; before the first sample at its rate.
Eigen::VectorXd Late(const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
                     double delay) {
  constexpr double kStep = 1.0 / kRate;
  Eigen::VectorXd late(q.size());
  for (int k = 0; k < q.size(); ++k) {
    const double at = k - delay / kStep;
    if (at < 0) {
      late[k] = q[0] + qd[0] * at * kStep;
      continue;
    }
    const int i = std::min<int>(static_cast<int>(at), q.size() - 2);
    const double s = at - i, r = 1.0 - s;
    late[k] = r * r * (1 + 2 * s) * q[i] + s * s * (1 + 2 * r) * q[i + 1] +
              kStep * s * r * (r * qd[i] - s * qd[i + 1]);
  }
  return late;
}

// What planted sensors make of the positions of states.
void Sense(const Model& model, const std::vector<PlantedEffect>& planted,
           RowMatrixXd* states) {
  for (const PlantedEffect& effect : planted) {
    const int index = model.mechanism().FindJoint(effect.target());
    if (index < 0) continue;
    const Joint& joint = model.mechanism().joints[index];
    auto q = states->col(joint.q_index);
    const std::string kind = effect.kind();
    if (kind == "sensor_offset") {
      q.array() += effect.Get("sensor_offset");
    } else if (kind == "sensor_gain") {
      q *= 1.0 + effect.Get("sensor_gain");
    } else if (kind == "sensor_delay") {
      q = Late(q, states->col(model.nq() + joint.v_index),
               effect.Get("sensor_delay"));
    } else if (kind == "transmission_error") {
      const Eigen::ArrayXd angle = effect.Get("transmission_order") * q.array();
      q.array() += effect.Get("transmission_sin") * angle.sin() +
                   effect.Get("transmission_cos") * angle.cos();
    }
  }
}

// What Simulate measures, of states that another engine gave.
void Measure(const Model& model, const RowMatrixXd& seen, double noise,
             std::uint64_t seed, sysid::Run* run) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (const Body& body : model.bodies()) {
    Channel channel;
    channel.target = body.joint;
    channel.name = model.mechanism().joints[body.joint].name;
    const int size = ConfigurationSize(body.type);
    channel.kind = body.type == JointType::kSpherical
                       ? ChannelKind::kOrientation
                       : ChannelKind::kPosition;
    channel.values = seen.middleCols(body.q_index, size);
    for (int k = 0; k < run->size(); ++k) {
      if (body.type == JointType::kSpherical) {
        const Eigen::Vector3d error(noise * normal(random),
                                    noise * normal(random),
                                    noise * normal(random));
        const Eigen::Quaterniond q(
            Eigen::Vector4d(channel.values.row(k).transpose()));
        channel.values.row(k) =
            (q * Exp<double>(error)).normalized().coeffs().transpose();
      } else {
        channel.values(k, 0) += noise * normal(random);
      }
    }
    run->channels.push_back(std::move(channel));
  }
}

// Seeds of what is random in a case, apart from one another.
std::uint64_t Seed(const HiddenCase& c, int use) {
  std::seed_seq sequence{static_cast<unsigned>(c.seed),
                         static_cast<unsigned>(use), Fnv1a(c.name)};
  std::uint64_t seed[1];
  sequence.generate(seed, seed + 1);
  return seed[0];
}

// Plants the effect at the magnitude at which it makes the difference that is
// asked for, to a fifth; as large as it may be where that is not enough.
void PlantToStrength(const std::string& name, HiddenData* data) {
  const double noise = data->info.noise;
  const double wanted = data->info.strength * noise;
  const MagnitudeRange range =
      RangeOf(PlantEffect(data->truth, name, 1.0).kind());
  double magnitude = range.start, difference = 0.0;
  double low = 0.0, high = range.most;
  for (int i = 0; i < 12; ++i) {
    difference = Difference(data->mechanism, data->truth,
                            PlantEffect(data->truth, name, magnitude),
                            0.05 * noise, Seed(data->info, 1));
    if (std::abs(difference / wanted - 1.0) < 0.2) break;
    (difference < wanted ? low : high) = magnitude;
    if (low >= range.most) break;
    // By proportion, within what is known.
    double next = magnitude * wanted / difference;
    if (!(next > low && next < high)) {
      next = high >= range.most ? range.most : 0.5 * (low + high);
    }
    magnitude = next;
  }
  data->at_most = data->at_most || low >= range.most;
  data->magnitudes.push_back(magnitude);
  data->strengths.push_back(difference / noise);
  data->planted.push_back(PlantEffect(data->truth, name, magnitude));
}

}  // namespace

sysid::Run Record(const TestMechanism& mechanism, const Model& truth,
                  const std::vector<PlantedEffect>& planted,
                  const HiddenCase& info, double duration, std::uint64_t seed) {
  SimulationOptions options;
  options.duration = duration;
  options.rate = kRate;
  options.noise = info.noise;
  options.seed = seed;
  if (mechanism.drive == Drive::kMultisine) {
    options.excitation = Excitation::kMultisine;
  }
  const Eigen::VectorXd x0 = StartOf(mechanism, seed);
  const Model with_effects = WithEffects(truth, planted);
  if (info.engine == "sysid" && mechanism.drive != Drive::kTracking) {
    return Simulate(with_effects, AdoptState(truth, x0.data(), with_effects),
                    options);
  }
  sysid::Run run = Planned(mechanism, truth, with_effects, x0, options);
  Controller controller;
  if (mechanism.drive == Drive::kTracking) {
    controller = TrackingController(mechanism, truth, seed);
  }
  // Where it sticks MuJoCo's steps are of first order and 0.5 ms do.
  const double tolerance =
      info.friction_time > 0.0 ? 1e30 : std::max(1e-8, 1e-2 * info.noise);
  RowMatrixXd states = MoveAccurately(
      [&](double step) -> std::unique_ptr<Plant> {
        if (info.engine == "sysid") return MakeSysidPlant(with_effects, step);
        return MakeMujocoPlant(truth, planted, {step, info.friction_time});
      },
      1e-3, 4, tolerance, x0, controller, &run);
  if (states.size() == 0) throw std::runtime_error("the motion is lost");
  Sense(truth, planted, &states);
  Measure(truth, states, info.noise, seed + 1, &run);
  return run;
}

double Difference(const TestMechanism& mechanism, const Model& truth,
                  const PlantedEffect& effect, double tolerance,
                  std::uint64_t seed) {
  SimulationOptions options;
  options.duration = kDuration;
  options.rate = kRate;
  options.seed = seed;
  if (mechanism.drive == Drive::kMultisine) {
    options.excitation = Excitation::kMultisine;
  }
  const Eigen::VectorXd x0 = StartOf(mechanism, seed);
  const Model with_effects = WithEffects(truth, {effect});
  sysid::Run run = Planned(mechanism, truth, with_effects, x0, options);
  Controller controller;
  if (mechanism.drive == Drive::kTracking) {
    controller = TrackingController(mechanism, truth, seed);
  }
  RowMatrixXd states = MoveAccurately(
      [&](double step) { return MakeSysidPlant(with_effects, step); }, 5e-3, 6,
      tolerance, x0, controller, &run);
  if (states.size() == 0) return std::numeric_limits<double>::infinity();
  Sense(truth, {effect}, &states);
  const int window = static_cast<int>(std::lround(mechanism.window * kRate));
  const std::unique_ptr<Plant> plain = MakeSysidPlant(truth, 5e-3);
  double sum = 0.0;
  int count = 0;
  Eigen::VectorXd dx(truth.tangent_size());
  for (int first = 0; first + window < run.size(); first += window) {
    plain->SetState(states.row(first).transpose());
    for (int k = first; k < first + window; ++k) {
      if (!plain->Advance(run, k)) break;
      const Eigen::VectorXd x = plain->State();
      const Eigen::VectorXd seen = states.row(k + 1).transpose();
      BoxMinus<double>(truth, seen.data(), x.data(), dx.data());
      sum += dx.head(truth.nv()).squaredNorm();
      count += truth.nv();
    }
  }
  return std::sqrt(sum / count);
}

HiddenData MakeHiddenData(const HiddenCase& hidden_case) {
  HiddenData data(hidden_case, MakeTestMechanism(hidden_case.mechanism));
  data.truth = TrueModel(data.mechanism, Seed(hidden_case, 0));
  for (const std::string& name : hidden_case.planted) {
    PlantToStrength(name, &data);
  }
  for (int run = 0; run < 3; ++run) {
    sysid::Run recorded =
        Record(data.mechanism, data.truth, data.planted, hidden_case, kDuration,
               Seed(hidden_case, 2 + run));
    recorded.name = run < 2 ? "train" + std::to_string(run + 1) + ".csv"
                            : std::string("holdout.csv");
    if (run < 2) {
      data.train.push_back(std::move(recorded));
    } else {
      data.holdout = std::move(recorded);
    }
  }
  return data;
}

}  // namespace sysid
