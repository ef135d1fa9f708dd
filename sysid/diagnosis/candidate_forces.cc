#include "sysid/diagnosis/candidate_forces.h"

#include <algorithm>

#include "residuals/acting_inputs.h"
#include "residuals/parameter_forces.h"
#include "sysid/estimation/parallel.h"
#include "sysid/linearization/force_response.h"
#include "sysid/unexplained_force/joint_motion.h"

namespace sysid {
namespace {

// What value(s, i) says of the i-th interval of each segment s of a curve's
// run, at the curve's times: linear between the middles of the intervals,
// constant before the first and after the last.
template <typename Value>
std::vector<double> Follow(const ForceResponse& response,
                           const ForceCurve& curve, const Value& value) {
  std::vector<double> t, y, at;
  const auto& segments = response.fit().segments();
  for (int s = 0; s < static_cast<int>(segments.size()); ++s) {
    if (response.RunOf(s).name != curve.trajectory) continue;
    for (int i = 0; i < response.tangent(s).middle.rows(); ++i) {
      t.push_back(response.Middle(s, i));
      y.push_back(value(s, i));
    }
  }
  if (t.empty()) return at;
  for (const double time : curve.t) {
    const size_t i = std::lower_bound(t.begin(), t.end(), time) - t.begin();
    if (i == 0 || i == t.size()) {
      at.push_back(i == 0 ? y.front() : y.back());
      continue;
    }
    const double part = (time - t[i - 1]) / (t[i] - t[i - 1]);
    at.push_back(y[i - 1] + part * (y[i] - y[i - 1]));
  }
  return at;
}

const Body& BodyOf(const Model& model, const std::string& joint) {
  const int index = model.mechanism().FindJoint(joint);
  return *std::find_if(model.bodies().begin(), model.bodies().end(),
                       [&](const Body& body) { return body.joint == index; });
}

// The degree of freedom that a curve is of, counted from its body's first.
int Component(const ForceCurve& curve) {
  return curve.component.empty() ? 0 : curve.component[0] - 'x';
}

void AddMotion(const ForceResponse& response, ForceCurve* curve) {
  const ShootingProblem& problem = response.fit().problem();
  const Model& model = problem.model();
  const Body& body = BodyOf(model, curve->joint);
  const Eigen::Vector3d axis = LinkAxis(
      model.mechanism(), model.mechanism().joints[body.joint].child_link);
  const auto motion = [&](int s, int i) {
    return MotionAt(model, body, axis,
                    response.tangent(s).middle.row(i).data());
  };
  const int component = Component(*curve);
  curve->position = Follow(response, *curve,
                           [&](int s, int i) { return motion(s, i).position; });
  curve->velocity = Follow(response, *curve, [&](int s, int i) {
    return motion(s, i).velocity[component];
  });
  const int place = body.v_index + component;
  for (const auto& data : problem.runs()) {
    const Run& run = data->run;
    if (run.name != curve->trajectory || run.effort.col(place).isZero(0)) {
      continue;
    }
    for (const double t : curve->t) {
      curve->effort.push_back(run.effort(RowBefore(run, t), place));
    }
  }
}

// What the expected parameters of an effect change, of each segment.
std::vector<ParameterForces> ForcesOf(const EvaluatedModel& evaluated,
                                      const ForceResponse& response,
                                      const ScreenedEffect& screened) {
  Model model = evaluated.fit.model;
  model.AddEffect(screened.effect);
  const ParameterMap map(
      model,
      FindParameters(model, screened.effect->ParameterNames(), "candidate"),
      false);
  Eigen::VectorXd on(map.size());
  for (int i = 0; i < map.size(); ++i) {
    const Parameter& parameter = map.parameters()[i];
    on[i] = parameter.nominal;
    for (const ExpectedParameter& expected : screened.parameters) {
      if (parameter.name == expected.name) on[i] = expected.value;
    }
  }
  const auto& segments = response.fit().segments();
  std::vector<ParameterForces> forces(segments.size());
  ParallelFor(static_cast<int>(segments.size()),
              evaluated.problem->options().threads, [&](int s) {
                ForceDifference difference(evaluated.fit.model, model, map, on);
                forces[s] = difference.Along(*segments[s]->rollout,
                                             response.tangent(s));
                return true;
              });
  return forces;
}

bool Act(const std::vector<ParameterForces>& forces) {
  for (const ParameterForces& segment : forces) {
    for (const RowMatrixXd& f : segment.f) {
      if (!f.isZero(0)) return true;
    }
  }
  return false;
}

}  // namespace

void AddForcesToCompare(const EvaluatedModel& evaluated, int count,
                        std::vector<ForceCurve>* curves,
                        std::vector<CandidateEffect>* candidates) {
  if (curves->empty()) return;
  const LinearizedFit fit(*evaluated.problem, evaluated.fit.point);
  if (!fit.Valid()) return;
  const ForceResponse response(fit);
  if (!response.Valid()) return;
  for (ForceCurve& curve : *curves) AddMotion(response, &curve);
  count = std::min(count, static_cast<int>(candidates->size()));
  for (int c = 0; c < count; ++c) {
    CandidateEffect& candidate = (*candidates)[c];
    const std::vector<ParameterForces> forces =
        ForcesOf(evaluated, response, candidate.screened);
    if (!Act(forces)) continue;
    for (const ForceCurve& curve : *curves) {
      const int place =
          BodyOf(fit.problem().model(), curve.joint).v_index + Component(curve);
      candidate.force.push_back(Follow(response, curve, [&](int s, int i) {
        return forces[s].f[i](place, 0);
      }));
    }
  }
}

}  // namespace sysid
