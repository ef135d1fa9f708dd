#include "sysid/diagnosis/candidate_forces.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "residuals/acting_effort.h"
#include "residuals/parameter_forces.h"
#include "sysid/diagnosis/force_knots.h"
#include "sysid/diagnosis/joint_motion.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

using Eigen::VectorXd;

// A segment of the fit, rolled out.
struct Stretch {
  int run = 0;
  std::unique_ptr<SegmentRollout> rollout;
  SegmentTangent tangent;
};

// Empty where the dynamics fail.
std::vector<Stretch> RollOut(const ShootingProblem& problem,
                             const Solution& point) {
  const std::vector<SegmentPlace> places = AllSegments(point);
  std::vector<Stretch> stretches(places.size());
  const bool valid = ParallelFor(
      static_cast<int>(places.size()), problem.options().threads, [&](int i) {
        const Solution::Nodes& nodes = point.runs[places[i].run];
        const int k = places[i].segment;
        stretches[i].run = places[i].run;
        stretches[i].rollout = std::make_unique<SegmentRollout>(
            &problem.model(), &problem.map(),
            &problem.runs()[places[i].run]->measurements, nodes.samples[k],
            nodes.samples[k + 1], point.rollout);
        return LinearizeAlong(*stretches[i].rollout, nodes.states.row(k).data(),
                              point.theta.data(), &stretches[i].tangent);
      });
  if (!valid) stretches.clear();
  return stretches;
}

// Numbers of one kind along a run, halfway between its samples.
struct Track {
  std::vector<double> t, value;

  // Linear between them, constant before the first and after the last.
  double At(double time) const {
    const auto after = std::lower_bound(t.begin(), t.end(), time);
    if (after == t.begin()) return value.front();
    if (after == t.end()) return value.back();
    const size_t i = after - t.begin();
    const double part = (time - t[i - 1]) / (t[i] - t[i - 1]);
    return value[i - 1] + part * (value[i] - value[i - 1]);
  }
  std::vector<double> At(const std::vector<double>& times) const {
    std::vector<double> values;
    for (const double time : times) values.push_back(At(time));
    return values;
  }
};

// Calls value(stretch, s, i) for the i-th interval of each stretch s of a run.
template <typename Value>
Track Follow(const ShootingProblem& problem,
             const std::vector<Stretch>& stretches, const std::string& run,
             const Value& value) {
  Track track;
  for (size_t s = 0; s < stretches.size(); ++s) {
    const Stretch& stretch = stretches[s];
    const Run& recording = problem.runs()[stretch.run]->run;
    if (recording.name != run) continue;
    for (int i = 0; i < stretch.tangent.middle.rows(); ++i) {
      track.t.push_back(Middle(recording, stretch.rollout->first() + i));
      track.value.push_back(value(stretch, s, i));
    }
  }
  return track;
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

void AddMotion(const ShootingProblem& problem,
               const std::vector<Stretch>& stretches, ForceCurve* curve) {
  const Model& model = problem.model();
  const Body& body = BodyOf(model, curve->joint);
  const Eigen::Vector3d axis = LinkAxis(
      model.mechanism(), model.mechanism().joints[body.joint].child_link);
  const auto motion = [&](const Stretch& stretch, int i) {
    return MotionAt(model, body, axis, stretch.tangent.middle.row(i).data());
  };
  const int component = Component(*curve);
  curve->position = Follow(problem, stretches, curve->trajectory,
                           [&](const Stretch& stretch, size_t, int i) {
                             return motion(stretch, i).position;
                           })
                        .At(curve->t);
  curve->velocity = Follow(problem, stretches, curve->trajectory,
                           [&](const Stretch& stretch, size_t, int i) {
                             return motion(stretch, i).velocity[component];
                           })
                        .At(curve->t);
  for (const auto& data : problem.runs()) {
    const int place = body.v_index + component;
    if (data->run.name != curve->trajectory ||
        data->run.effort.col(place).isZero(0)) {
      continue;
    }
    for (const double t : curve->t) {
      curve->effort.push_back(data->run.effort(RowBefore(data->run, t), place));
    }
  }
}

// What the expected parameters of an effect change, of each stretch.
std::vector<ParameterForces> ForcesOf(const EvaluatedModel& evaluated,
                                      const std::vector<Stretch>& stretches,
                                      const ScreenedEffect& screened) {
  Model model = evaluated.fit.model;
  model.AddEffect(screened.effect);
  const ParameterMap map(
      model,
      FindParameters(model, screened.effect->ParameterNames(), "candidate"),
      false);
  VectorXd off(map.size());
  for (int i = 0; i < map.size(); ++i) off[i] = map.parameters()[i].nominal;
  VectorXd on = off;
  for (const ExpectedParameter& expected : screened.parameters) {
    for (int i = 0; i < map.size(); ++i) {
      if (map.parameters()[i].name != expected.name) continue;
      on[i] = expected.value;
      off[i] = expected.searched ? expected.value : expected.null_value;
    }
  }
  std::vector<ParameterForces> forces(stretches.size());
  ParallelFor(static_cast<int>(stretches.size()),
              evaluated.problem->options().threads, [&](int s) {
                forces[s] = DifferenceOfForces(model, map, off, on,
                                               *stretches[s].rollout,
                                               stretches[s].tangent);
                return true;
              });
  return forces;
}

bool Act(const std::vector<ParameterForces>& forces) {
  for (const ParameterForces& stretch : forces) {
    for (const RowMatrixXd& f : stretch.f) {
      if (!f.isZero(0)) return true;
    }
  }
  return false;
}

}  // namespace

void AddForcesToCompare(const EvaluatedModel& evaluated, int count,
                        std::vector<ForceCurve>* curves,
                        std::vector<CandidateEffect>* candidates) {
  const ShootingProblem& problem = *evaluated.problem;
  if (curves->empty()) return;
  const std::vector<Stretch> stretches = RollOut(problem, evaluated.fit.point);
  if (stretches.empty()) return;
  for (ForceCurve& curve : *curves) AddMotion(problem, stretches, &curve);
  count = std::min(count, static_cast<int>(candidates->size()));
  for (int c = 0; c < count; ++c) {
    CandidateEffect& candidate = (*candidates)[c];
    const std::vector<ParameterForces> forces =
        ForcesOf(evaluated, stretches, candidate.screened);
    if (!Act(forces)) continue;
    for (const ForceCurve& curve : *curves) {
      const int place =
          BodyOf(problem.model(), curve.joint).v_index + Component(curve);
      candidate.force.push_back(Follow(problem, stretches, curve.trajectory,
                                       [&](const Stretch&, size_t s, int i) {
                                         return forces[s].f[i](place, 0);
                                       })
                                    .At(curve.t));
    }
  }
}

}  // namespace sysid
