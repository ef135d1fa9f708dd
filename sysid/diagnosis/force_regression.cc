#include "sysid/diagnosis/force_regression.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "models/math/rotation.h"

namespace sysid {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

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
  void (*evaluate)(const Body& body, const Vector3d& axis, const Instant& at,
                   MatrixXd* out);
};

// Below this speed the sign of a velocity is smooth, as in CoulombFriction.
double SlowSpeed(const Body& body) {
  return body.type == JointType::kPrismatic ? 1e-3 : 1e-2;
}

void Constant(const Body&, const Vector3d&, const Instant&, MatrixXd* out) {
  out->setIdentity();
}

// With a constant: a spring may rest anywhere.
void Position(const Body& body, const Vector3d&, const Instant& at,
              MatrixXd* out) {
  if (body.type == JointType::kSpherical) {
    out->col(0) = Log(Eigen::Quaterniond(at.q[3], at.q[0], at.q[1], at.q[2]));
  } else {
    (*out)(0, 0) = at.q[0];
  }
  out->rightCols(out->rows()).setIdentity();
}

// A hinge's sine and cosine; of a spherical joint the moments of forces along
// the parent's axes, which act on the link's.
void Sines(const Body& body, const Vector3d& axis, const Instant& at,
           MatrixXd* out) {
  if (body.type == JointType::kSpherical) {
    const Matrix3d R =
        ToMatrix(Eigen::Quaterniond(at.q[3], at.q[0], at.q[1], at.q[2]));
    for (int i = 0; i < 3; ++i) out->col(i) = axis.cross(R.row(i).transpose());
  } else {
    *out << std::sin(at.q[0]), std::cos(at.q[0]);
  }
}

void Velocity(const Body&, const Vector3d&, const Instant& at, MatrixXd* out) {
  out->col(0) = at.qd;
}

void Sign(const Body& body, const Vector3d&, const Instant& at, MatrixXd* out) {
  out->col(0) = at.qd / std::hypot(at.qd.norm(), SlowSpeed(body));
}

void Square(const Body&, const Vector3d&, const Instant& at, MatrixXd* out) {
  out->col(0) = at.qd.norm() * at.qd;
}

void Acceleration(const Body&, const Vector3d&, const Instant& at,
                  MatrixXd* out) {
  out->col(0) = at.qdd;
}

void Effort(const Body&, const Vector3d&, const Instant& at, MatrixXd* out) {
  out->col(0) = at.effort;
}

void Time(const Body&, const Vector3d&, const Instant& at, MatrixXd* out) {
  const int nv = static_cast<int>(out->rows());
  out->leftCols(nv) = at.time * MatrixXd::Identity(nv, nv);
  out->rightCols(nv).setIdentity();
}

std::vector<Regressor> Regressors(const Body& body, bool driven) {
  const int nv = VelocitySize(body.type);
  const bool ball = body.type == JointType::kSpherical;
  std::vector<Regressor> all = {
      {"constant", nv, Constant},     {"velocity", 1, Velocity},
      {"sign(velocity)", 1, Sign},    {"|velocity| velocity", 1, Square},
      {"position", 1 + nv, Position}, {"acceleration", 1, Acceleration},
      {"time", 2 * nv, Time}};
  if (body.type != JointType::kPrismatic) {
    all.push_back({"sin, cos(position)", ball ? 3 : 2, Sines});
  }
  if (driven) all.push_back({"effort", 1, Effort});
  return all;
}

// The components of a body's force that are more than a hundredth of the
// largest. The spin of a thin rod is not: a friction there is saturated at
// once, and nothing linear tells of it.
std::vector<int> ComponentsOf(const SmoothForce& force, const Body& body) {
  constexpr double kNothing = 0.01;
  double most = 0.0;
  for (int c = 0; c < VelocitySize(body.type); ++c) {
    most = std::max(most, force.width(body.v_index + c));
  }
  std::vector<int> components;
  for (int c = 0; c < VelocitySize(body.type); ++c) {
    if (force.width(body.v_index + c) > kNothing * most) {
      components.push_back(c);
    }
  }
  return components;
}

// The regressor at the knots of a run: its mean over the intervals beside each,
// knots * nv rows of the body's.
MatrixXd AtKnots(const LinearizedFit& fit, const ForceKnots& knots,
                 const std::vector<ForcedMotion>& motions, int run,
                 const Body& body, const std::vector<int>& components,
                 const Regressor& regressor) {
  const Model& model = fit.problem().model();
  const Run& recording = fit.problem().runs()[run]->run;
  const int nv = VelocitySize(body.type);
  const Vector3d axis = LinkAxis(
      model.mechanism(), model.mechanism().joints[body.joint].child_link);
  VectorXd moves = VectorXd::Zero(nv);
  for (const int c : components) moves[c] = 1.0;
  MatrixXd sum = MatrixXd::Zero(knots.count * nv, regressor.columns);
  VectorXd weight = VectorXd::Zero(knots.count);
  MatrixXd value(nv, regressor.columns);
  for (size_t s = 0; s < motions.size(); ++s) {
    const LinearizedFit::Segment& segment = *fit.segments()[s];
    if (segment.run != run) continue;
    for (int i = 0; i < motions[s].middle.rows(); ++i) {
      const int k = segment.rollout->first() + i;
      const double t = Middle(recording, k);
      const auto x = motions[s].middle.row(i);
      const auto qdd = motions[s].acceleration.row(i);
      const Instant at = {
          x.data() + model.layout().q(body),
          x.segment(model.layout().qd(body), nv)
              .transpose()
              .cwiseProduct(moves),
          qdd.segment(body.v_index, nv).transpose().cwiseProduct(moves),
          recording.effort.row(k).segment(body.v_index, nv).transpose(),
          t - recording.t.front()};
      regressor.evaluate(body, axis, at, &value);
      const int below = static_cast<int>(knots.Place(t));
      for (int n = below; n <= std::min(below + 1, knots.count - 1); ++n) {
        sum.middleRows(n * nv, nv) += knots.Weight(n, t) * value;
        weight[n] += knots.Weight(n, t);
      }
    }
  }
  for (int n = 0; n < knots.count; ++n) {
    if (weight[n] > 0) sum.middleRows(n * nv, nv) /= weight[n];
  }
  return sum;
}

bool IsDriven(const LinearizedFit& fit, const Body& body) {
  for (const auto& data : fit.problem().runs()) {
    const auto effort =
        data->run.effort.middleCols(body.v_index, VelocitySize(body.type));
    if ((effort.rowwise() - effort.row(0)).cwiseAbs().maxCoeff() > 0) {
      return true;
    }
  }
  return false;
}

std::string Label(const ForceRegression& law, int columns) {
  if (law.regressor == "constant") return "a constant";
  if (law.regressor == "sin, cos(position)") return law.regressor;
  // Of what has a constant beside it the first weight tells; a spherical
  // joint's drift has a direction.
  if (law.regressor == "time" && columns > 2) return law.regressor;
  return (law.coefficients[0] < 0 ? "-" : "") + law.regressor;
}

struct Ranked {
  ForceRegression law;
  double criterion;
};

// The earliest of those that are as good as the best comes first: what is
// simple and common before what is not.
void Sort(std::vector<Ranked>* ranked) {
  constexpr double kAsGood = 2.0;  // twice a log-likelihood
  const auto better = [](const Ranked& a, const Ranked& b) {
    return a.criterion < b.criterion;
  };
  const double best =
      std::min_element(ranked->begin(), ranked->end(), better)->criterion;
  const auto first = std::find_if(
      ranked->begin(), ranked->end(),
      [&](const Ranked& r) { return r.criterion < best + kAsGood; });
  std::rotate(ranked->begin(), first, first + 1);
  std::stable_sort(ranked->begin() + 1, ranked->end(), better);
}

}  // namespace

std::vector<ForceRegression> RegressForce(
    const LinearizedFit& fit, const std::vector<ForceKnots>& knots,
    const SmoothForce& force, const std::vector<ForcedMotion>& motions,
    const Body& body) {
  const Model& model = fit.problem().model();
  const int nv = model.nv();
  const std::vector<int> components = ComponentsOf(force, body);
  const int runs = static_cast<int>(knots.size());
  // Rows of these components among those of the body, and of all.
  std::vector<std::vector<int>> own(runs), rows(runs);
  int total = 0;
  for (int r = 0; r < runs; ++r) {
    for (int k = 0; k < knots[r].count; ++k) {
      for (const int c : components) {
        own[r].push_back(k * VelocitySize(body.type) + c);
        rows[r].push_back(k * nv + body.v_index + c);
      }
    }
    total += static_cast<int>(rows[r].size());
  }
  VectorXd y(total);
  for (int r = 0, at = 0; r < runs; ++r) {
    const int size = static_cast<int>(rows[r].size());
    const RowMatrixXd values = force.Values(r);
    y.segment(at, size) =
        Eigen::Map<const VectorXd>(values.data(), values.size())(rows[r]);
    at += size;
  }
  // What is not noise.
  const double squares = std::max(y.squaredNorm() - force.NoiseSquares(rows),
                                  1e-3 * y.squaredNorm());
  std::vector<Ranked> ranked;
  for (const Regressor& regressor : Regressors(body, IsDriven(fit, body))) {
    // As it would come out of the same data, which smooths it.
    std::vector<MatrixXd> laws;
    for (int r = 0; r < runs; ++r) {
      laws.push_back(MatrixXd::Zero(knots[r].count * nv, regressor.columns));
      laws.back()(rows[r], Eigen::all) =
          AtKnots(fit, knots[r], motions, r, body, components, regressor)(
              own[r], Eigen::all);
    }
    laws = force.Smooth(laws);
    MatrixXd X(total, regressor.columns);
    for (int r = 0, at = 0; r < runs; ++r) {
      const int size = static_cast<int>(rows[r].size());
      X.middleRows(at, size) = laws[r](rows[r], Eigen::all);
      at += size;
    }
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(X);
    const VectorXd b = qr.solve(y);
    const double left = (y - X * b).squaredNorm() / y.squaredNorm();
    Ranked next;
    next.law.joint = model.mechanism().joints[body.joint].name;
    next.law.regressor = regressor.name;
    next.law.r2 =
        std::clamp((1.0 - left) * y.squaredNorm() / squares, 0.0, 1.0);
    next.law.coefficients.assign(b.begin(), b.end());
    next.law.label = Label(next.law, regressor.columns);
    // The more weights, the more it must explain (BIC).
    const double determined =
        std::max(3.0, force.Determined(body.v_index, VelocitySize(body.type)));
    next.criterion = determined * std::log(std::max(left, 1e-12)) +
                     qr.rank() * std::log(determined);
    ranked.push_back(std::move(next));
  }
  Sort(&ranked);
  std::vector<ForceRegression> laws;
  for (Ranked& next : ranked) laws.push_back(std::move(next.law));
  return laws;
}

}  // namespace sysid
