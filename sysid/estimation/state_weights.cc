#include "sysid/estimation/state_weights.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "sysid/estimation/initial_states.h"

namespace sysid {

double TightDefect(const ShootingProblem& problem, const Solution& solution) {
  // Of the run with most of both.
  std::vector<double> most = {1.0, 1.0};  // samples, segments
  for (const Solution::Nodes& nodes : solution.runs) {
    most[0] = std::max<double>(most[0], nodes.samples.back());
    most[1] = std::max<double>(most[1], nodes.segments());
  }
  problem.processes().Max(&most);
  return std::min(kJoinedDefect, 0.1 / std::sqrt(most[0] * most[1]));
}

namespace {

// Of the channel that measures the joint, as it is weighed.
double JointMisfit(const ShootingProblem& problem, int joint) {
  const SensedChannel* sensor = problem.data().SensorOf(joint);
  return sensor != nullptr ? problem.Misfit(sensor->name) : 1.0;
}

}  // namespace

std::vector<double> DefectSigma(const ShootingProblem& problem) {
  const Model& model = problem.model();
  const StateLayout& at = model.layout();
  std::vector<double> sigma(at.tangent_size());
  for (const Body& body : model.movers()) {
    const double joint = problem.data().JointSigma(body.joint) *
                         JointMisfit(problem, body.joint);
    for (int i = 0; i < VelocitySize(body); ++i) {
      sigma[at.dq(body) + i] = joint;
      sigma[at.dqd(body) + i] = joint / kDefectTime;
    }
  }
  const std::vector<EffectState>& states = model.effects().states();
  for (int i = 0; i < at.nz(); ++i) {
    sigma[at.dz() + i] = kDefectPart * states[i].typical_scale;
  }
  return sigma;
}

std::vector<double> StateBelief(const ShootingProblem& problem,
                                double twist_hold) {
  constexpr double kPosition = 1.0,
                   kVelocity = 100.0;  // rad or m, where measured
  // Of a spherical joint by heading vectors: the rotation is measured, though
  // the residual does not see its twist.
  constexpr double kTwist = 0.05, kTwistRate = 0.5;
  const Model& model = problem.model();
  const StateLayout& at = model.layout();
  std::vector<double> sigma(at.tangent_size());
  for (const Body& body : model.movers()) {
    const bool blind =
        body.type == JointType::kSpherical &&
        problem.options().orientation == OrientationResidual::kHeading;
    for (int i = 0; i < VelocitySize(body); ++i) {
      sigma[at.dq(body) + i] = blind ? kTwist / twist_hold : kPosition;
      sigma[at.dqd(body) + i] = blind ? kTwistRate / twist_hold : kVelocity;
    }
  }
  const std::vector<EffectState>& states = model.effects().states();
  for (int i = 0; i < at.nz(); ++i) {
    sigma[at.dz() + i] = states[i].typical_scale;
  }
  return sigma;
}

StartBelief BeliefAtStart(const ShootingProblem& problem, int run,
                          double twist_hold, const double* x) {
  // Of what a measurement tells: that weighs nothing beside it.
  constexpr double kExact = 1e-3;
  const Model& model = problem.model();
  const StateLayout& at = model.layout();
  StartBelief belief{{x, x + at.size()}, StateBelief(problem, twist_hold)};
  const RunStart start = problem.runs()[run]->run.start;
  if (start == RunStart::kEstimated) return belief;
  const std::vector<double> measured = DefectSigma(problem);
  const auto known = StatesFromData(problem, run).row(0).eval();
  for (const Body& body : model.movers()) {
    const int nv = VelocitySize(body);
    for (int i = 0; i < nv; ++i) {
      belief.state[at.qd(body) + i] = known[at.qd(body) + i];
      belief.sigma[at.dqd(body) + i] = kExact * measured[at.dqd(body) + i];
    }
    if (start == RunStart::kRest) continue;
    for (int i = 0; i < nv; ++i) {
      belief.sigma[at.dq(body) + i] = kExact * measured[at.dq(body) + i];
    }
    for (int i = 0; i < ConfigurationSize(body.type); ++i) {
      belief.state[at.q(body) + i] = known[at.q(body) + i];
    }
  }
  return belief;
}

ThetaBelief BodyBelief(const ShootingProblem& problem) {
  constexpr int kTen = 10;
  std::map<int, std::vector<int>> of_links;
  for (int i = 0; i < problem.map().size(); ++i) {
    const Parameter& parameter = problem.free()[i].parameter;
    if (parameter.kind == ParameterKind::kMass ||
        parameter.kind == ParameterKind::kCom ||
        parameter.kind == ParameterKind::kInertia) {
      of_links[parameter.index].push_back(i);
    }
  }
  ThetaBelief belief;
  for (const auto& [link, places] : of_links) {
    if (places.size() != kTen) continue;
    for (const int i : places) {
      belief.places.push_back(i);
      belief.sigmas.push_back(problem.map().IsTransformed(i)
                                  ? 1.0
                                  : problem.free()[i].parameter.typical_scale);
    }
  }
  return belief;
}

}  // namespace sysid
