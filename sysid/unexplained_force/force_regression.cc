#include "sysid/unexplained_force/force_regression.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "models/math/decompositions.h"
#include "models/math/rotation.h"
#include "models/state.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// The motion of a segment with forces beside the model's, to first order: what
// the machine did, where the model alone goes elsewhere.
struct ForcedMotion {
  RowMatrixXd middle;        // intervals x state_size, as SegmentTangent's
  RowMatrixXd acceleration;  // intervals x nv
};

// The force over each interval of a segment, and what the parameters change.
ParameterForces RegressorForces(const ForceResponse& response, int s,
                                const RowMatrixXd& values,
                                const VectorXd& dtheta) {
  const LinearizedFit& fit = response.fit();
  const SegmentRollout& rollout = *fit.segments()[s]->rollout;
  const ParameterForces by_theta =
      ForceDerivatives(fit.problem().model(), fit.problem().map(),
                       fit.point().theta)
          .Along(rollout, response.tangent(s));
  ParameterForces forces = ParameterForces::Zero(rollout, 1);
  forces.direct = by_theta.direct * dtheta;
  for (size_t i = 0; i < forces.f.size(); ++i) {
    forces.f[i] = by_theta.f[i] * dtheta;
    response.KnotsOf(s).Around(
        response.Middle(s, static_cast<int>(i)), [&](int k, double weight) {
          forces.f[i].col(0) += weight * values.row(k).transpose();
        });
  }
  return forces;
}

ForcedMotion MoveSegment(const ForceResponse& response, int s,
                         const ParameterForces& forces) {
  const LinearizedFit& fit = response.fit();
  const LinearizedFit::Segment& segment = *fit.segments()[s];
  const Model& model = fit.problem().model();
  const SegmentTangent& tangent = response.tangent(s);
  const Run& run = response.RunOf(s);
  const int nv = model.nv();
  VectorXd dx = fit.StateAgainst(
      segment, segment.whitened + response.Respond(s, forces).col(0));
  ForcedMotion motion{tangent.middle, tangent.acceleration};
  for (int i = 0; i < tangent.middle.rows(); ++i) {
    const int k = segment.rollout->first() + i;
    const VectorXd next = tangent.A[i] * dx + tangent.B[i] * forces.f[i];
    const VectorXd middle = 0.5 * (dx + next);
    BoxPlus<double>(model, tangent.middle.row(i).data(), middle.data(),
                    motion.middle.row(i).data());
    motion.acceleration.row(i) +=
        (next - dx).tail(nv).transpose() / (run.t[k + 1] - run.t[k]);
    dx = next;
  }
  return motion;
}

// Of every segment: (7.1) with the forces, the parameters that go with them,
// and the states that suit both.
std::vector<ForcedMotion> MoveWith(const ForceResponse& response,
                                   const SmoothForce& force) {
  const LinearizedFit& fit = response.fit();
  std::vector<ForcedMotion> motions(fit.segments().size());
  ParallelFor(
      static_cast<int>(motions.size()), fit.problem().options().threads,
      [&](int s) {
        motions[s] = MoveSegment(
            response, s,
            RegressorForces(response, s, force.Values(fit.segments()[s]->run),
                            force.ParameterChange()));
        return true;
      });
  return motions;
}

// The joint at one instant. Components that its force does not have do not
// move.
struct Instant {
  const double* q;
  VectorXd qd, qdd, effort;
  double time;  // since the start of the run, s
};

// What a force may follow: columns of nv rows, whose weights are sought.
struct Regressor {
  std::string name;
  int columns;
  std::function<MatrixXd(const Instant& at)> evaluate;
};

// Of a body's joint; `axis`: its link's.
std::vector<Regressor> Regressors(const Body& body, const Vector3d& axis,
                                  bool driven) {
  const int nv = VelocitySize(body);
  const bool ball = body.type == JointType::kSpherical;
  const bool slides = body.type == JointType::kPrismatic;
  // Below this speed the sign of a velocity is smooth, as in CoulombFriction.
  const double slow = slides ? 1e-3 : 1e-2;
  const MatrixXd one = MatrixXd::Identity(nv, nv);
  const auto rotation = [](const Instant& at) {
    return Eigen::Quaterniond(at.q[3], at.q[0], at.q[1], at.q[2]);
  };
  const auto beside_constant = [=](const MatrixXd& value) {
    MatrixXd out(nv, value.cols() + nv);
    out << value, one;
    return out;
  };
  std::vector<Regressor> all = {
      {"constant", nv, [=](const Instant&) { return one; }},
      {"velocity", 1, [](const Instant& at) { return at.qd; }},
      {"sign(velocity)", 1,
       [=](const Instant& at) {
         return at.qd / std::hypot(at.qd.norm(), slow);
       }},
      {"|velocity| velocity", 1,
       [](const Instant& at) { return at.qd.norm() * at.qd; }},
      // With a constant: a spring may rest anywhere.
      {"position", 1 + nv,
       [=](const Instant& at) {
         return beside_constant(ball ? MatrixXd(Log(rotation(at)))
                                     : MatrixXd::Constant(1, 1, at.q[0]));
       }},
      {"acceleration", 1, [](const Instant& at) { return at.qdd; }},
      {"time", 2 * nv,
       [=](const Instant& at) { return beside_constant(at.time * one); }}};
  // Of a spherical joint the moments of forces along the parent's axes, which
  // act on the link's.
  if (ball) {
    all.push_back({"sin, cos(position)", 3, [=](const Instant& at) {
                     const Matrix3d R = ToMatrix(rotation(at));
                     Matrix3d out;
                     for (int i = 0; i < 3; ++i) {
                       out.col(i) = axis.cross(R.row(i).transpose());
                     }
                     return out;
                   }});
  } else if (!slides) {
    all.push_back({"sin, cos(position)", 2, [](const Instant& at) {
                     return Eigen::RowVector2d(std::sin(at.q[0]),
                                               std::cos(at.q[0]));
                   }});
  }
  if (driven) {
    all.push_back({"effort", 1, [](const Instant& at) { return at.effort; }});
  }
  return all;
}

// Which components of a body's force are more than a hundredth of the largest:
// 1 or 0 each. The spin of a thin rod is not: a friction there is saturated at
// once, and nothing linear tells of it.
VectorXd ComponentsOf(const SmoothForce& force, const Body& body) {
  constexpr double kNothing = 0.01;
  VectorXd widths(VelocitySize(body));
  for (int c = 0; c < widths.size(); ++c) {
    widths[c] = force.width(body.v_index + c);
  }
  return (widths.array() > kNothing * widths.maxCoeff()).cast<double>();
}

// The regressor at the knots of a run: its mean over the intervals beside each,
// knots * nv rows, of which those of other components are zero.
MatrixXd AtKnots(const ForceResponse& response,
                 const std::vector<ForcedMotion>& motions, int run,
                 const Body& body, const VectorXd& components,
                 const Regressor& regressor) {
  const LinearizedFit& fit = response.fit();
  const ForceKnots& knots = response.knots()[run];
  const Model& model = fit.problem().model();
  const int own = VelocitySize(body), nv = model.nv();
  MatrixXd sum = MatrixXd::Zero(knots.count * nv, regressor.columns);
  VectorXd weights = VectorXd::Zero(knots.count);
  for (int s = 0; s < static_cast<int>(motions.size()); ++s) {
    const LinearizedFit::Segment& segment = *fit.segments()[s];
    if (segment.run != run) continue;
    const Run& recording = response.RunOf(s);
    for (int i = 0; i < motions[s].middle.rows(); ++i) {
      const int k = segment.rollout->first() + i;
      const double t = response.Middle(s, i);
      const auto x = motions[s].middle.row(i);
      const auto qdd = motions[s].acceleration.row(i);
      const Instant at = {
          x.data() + model.layout().q(body),
          x.segment(model.layout().qd(body), own)
              .transpose()
              .cwiseProduct(components),
          qdd.segment(body.v_index, own).transpose().cwiseProduct(components),
          recording.effort.row(k).segment(body.v_index, own).transpose(),
          t - recording.t.front()};
      const MatrixXd value = components.asDiagonal() * regressor.evaluate(at);
      knots.Around(t, [&](int n, double weight) {
        sum.middleRows(n * nv + body.v_index, own) += weight * value;
        weights[n] += weight;
      });
    }
  }
  for (int n = 0; n < knots.count; ++n) {
    if (weights[n] > 0) sum.middleRows(n * nv, nv) /= weights[n];
  }
  return sum;
}

bool IsDriven(const LinearizedFit& fit, const Body& body) {
  for (const auto& data : fit.problem().runs()) {
    const auto effort =
        data->run.effort.middleCols(body.v_index, VelocitySize(body));
    if ((effort.rowwise() - effort.row(0)).cwiseAbs().maxCoeff() > 0) {
      return true;
    }
  }
  return false;
}

std::string Label(const ForceRegression& law) {
  if (law.regressor == "constant") return "a constant";
  if (law.regressor == "sin, cos(position)") return law.regressor;
  // Of what has a constant beside it the first weight tells; a spherical
  // joint's drift has a direction.
  if (law.regressor == "time" && law.coefficients.size() > 2) {
    return law.regressor;
  }
  return (law.coefficients[0] < 0 ? "-" : "") + law.regressor;
}

// The law and its criterion: twice a log-likelihood, less is better.
using Ranked = std::pair<double, ForceRegression>;

// The earliest of those that are as good as the best comes first: what is
// simple and common before what is not.
void Sort(std::vector<Ranked>* ranked) {
  constexpr double kAsGood = 2.0;
  const auto better = [](const Ranked& a, const Ranked& b) {
    return a.first < b.first;
  };
  const double best =
      std::min_element(ranked->begin(), ranked->end(), better)->first;
  const auto first =
      std::find_if(ranked->begin(), ranked->end(),
                   [&](const Ranked& r) { return r.first < best + kAsGood; });
  std::rotate(ranked->begin(), first, first + 1);
  std::stable_sort(ranked->begin() + 1, ranked->end(), better);
}

// These rows of all runs, one below the other.
template <typename Matrix>
MatrixXd Stack(const std::vector<Matrix>& runs,
               const std::vector<std::vector<int>>& rows) {
  MatrixXd all(0, runs.front().cols());
  for (size_t r = 0; r < runs.size(); ++r) {
    all.conservativeResize(all.rows() + rows[r].size(), Eigen::NoChange);
    all.bottomRows(rows[r].size()) = runs[r](rows[r], Eigen::all);
  }
  return all;
}

// Of one body, best first.
std::vector<ForceRegression> Regress(const ForceResponse& response,
                                     const SmoothForce& force,
                                     const std::vector<ForcedMotion>& motions,
                                     const Body& body) {
  const LinearizedFit& fit = response.fit();
  const Model& model = fit.problem().model();
  const Joint& joint = model.mechanism().joints[body.joint];
  const VectorXd components = ComponentsOf(force, body);
  const int runs = static_cast<int>(response.knots().size());
  std::vector<std::vector<int>> rows(runs);  // of these components
  for (int r = 0; r < runs; ++r) {
    for (int k = 0; k < response.knots()[r].count; ++k) {
      for (int c = 0; c < components.size(); ++c) {
        if (components[c] == 0.0) continue;
        rows[r].push_back(k * model.nv() + body.v_index + c);
      }
    }
  }
  const VectorXd y = Stack(force.Forces(), rows);
  // What is not noise.
  const double squares = std::max(y.squaredNorm() - force.NoiseSquares(rows),
                                  1e-3 * y.squaredNorm());
  std::vector<Ranked> ranked;
  for (const Regressor& regressor :
       Regressors(body, LinkAxis(model.mechanism(), joint.child_link),
                  IsDriven(fit, body))) {
    std::vector<MatrixXd> laws;
    for (int r = 0; r < runs; ++r) {
      laws.push_back(
          AtKnots(response, motions, r, body, components, regressor));
    }
    // As it would come out of the same data, which smooths it.
    const MatrixXd X = Stack(force.Smooth(laws), rows);
    int rank = 0;
    const VectorXd b = LeastSquares(X, y, &rank);
    const double left = (y - X * b).squaredNorm() / y.squaredNorm();
    ForceRegression law;
    law.joint = joint.name;
    law.regressor = regressor.name;
    law.r2 = std::clamp((1.0 - left) * y.squaredNorm() / squares, 0.0, 1.0);
    law.coefficients.assign(b.begin(), b.end());
    law.label = Label(law);
    // The more weights, the more it must explain (BIC).
    const double determined =
        std::max(3.0, force.Determined(body.v_index, VelocitySize(body)));
    ranked.push_back({determined * std::log(std::max(left, 1e-12)) +
                          rank * std::log(determined),
                      std::move(law)});
  }
  Sort(&ranked);
  std::vector<ForceRegression> laws;
  for (Ranked& next : ranked) laws.push_back(std::move(next.second));
  return laws;
}

}  // namespace

std::vector<ForceRegression> RegressForces(
    const ForceResponse& response, const SmoothForce& force,
    const std::vector<const Body*>& bodies) {
  std::vector<ForceRegression> all;
  if (bodies.empty()) return all;
  const std::vector<ForcedMotion> motions = MoveWith(response, force);
  for (const Body* body : bodies) {
    for (ForceRegression& law : Regress(response, force, motions, *body)) {
      all.push_back(std::move(law));
    }
  }
  return all;
}

}  // namespace sysid
