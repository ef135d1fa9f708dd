#include "sysid/inverse_dynamics/estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "models/math/decompositions.h"

namespace sysid {
namespace {

constexpr int kTen = 10;
// Beliefs of this size say nothing beside data: they move what is known to its
// size by 1 % of a standard error.
constexpr double kWide = 10.0;
using Ten = Eigen::Matrix<double, kTen, 1>;

// J of (11.8).
Eigen::Matrix4d PseudoInertia(const Ten& xi) {
  Eigen::Matrix4d J;
  const Eigen::Vector3d I = xi.segment<3>(4);
  J.topLeftCorner<3, 3>() = (0.5 * I.sum() - I.array()).matrix().asDiagonal();
  J(0, 1) = J(1, 0) = -xi[7];
  J(0, 2) = J(2, 0) = -xi[8];
  J(1, 2) = J(2, 1) = -xi[9];
  J.topRightCorner<3, 1>() = xi.segment<3>(1);
  J.bottomLeftCorner<1, 3>() = xi.segment<3>(1).transpose();
  J(3, 3) = xi[0];
  return J;
}

// The inverse of PseudoInertia().
Ten CoordinatesOf(const Eigen::Matrix4d& J) {
  Ten xi;
  xi << J(3, 3), J.topRightCorner<3, 1>(), J(1, 1) + J(2, 2), J(0, 0) + J(2, 2),
      J(0, 0) + J(1, 1), -J(0, 1), -J(0, 2), -J(1, 2);
  return xi;
}

// S of (11.16), orthonormal in its ten coordinates.
Eigen::Matrix4d Symmetric(const Ten& s) {
  Eigen::Matrix4d S;
  int c = 0;
  for (int i = 0; i < 4; ++i) {
    S(i, i) = s[c++];
    for (int j = 0; j < i; ++j) S(i, j) = S(j, i) = M_SQRT1_2 * s[c++];
  }
  return S;
}

// A link all of whose parameters are free: its place in xi and in the unknowns,
// and its ten places in theta.
struct FreeBody {
  int link, xi, unknown;
  std::array<int, kTen> theta;  // in the order of ParameterKind, components
  Eigen::Matrix4d J0_inverse;
};

class Minimiser {
 public:
  Minimiser(const ShootingProblem& problem,
            const EquationCoordinates& coordinates, const RowMatrixXd& triangle,
            const Eigen::VectorXd& theta0);
  RegressionEstimate Run();
  // Of (11.7) at the start.
  double StartCost() const { return At(StartingPoint()).cost; }

 private:
  // Newton's method until half the squared decrement is below `settled`.
  bool Descend(double settled, int* iterations);
  // Newton's, of the unknowns that no bound holds (Bertsekas 1982).
  Eigen::VectorXd FreeStep(const Eigen::VectorXd& g,
                           const Eigen::MatrixXd& H) const;
  // How much of `step` the free bodies bear before one is no longer possible.
  double ToTheBound(const Eigen::VectorXd& step) const;
  struct Point {
    Eigen::VectorXd unknowns, theta, xi;
    // d unknowns / d step, (11.16) for the free bodies, and d xi / d step.
    Eigen::MatrixXd T;
    RowMatrixXd D;
    double cost = INFINITY;
  };
  void FindFreeBodies();
  Eigen::VectorXd StartingPoint() const;  // the unknowns of theta0
  // At the unknowns; the cost is infinite where they are no possible body.
  Point At(const Eigen::VectorXd& unknowns) const;
  // L of (11.16).
  Eigen::Matrix4d FactorAt(const Point& point, const FreeBody& body) const;
  void Differentiate(Point* point) const;
  // Gradient and curvature of (11.15) by the step.
  void Curve(const Point& point, Eigen::VectorXd* g, Eigen::MatrixXd* H) const;

  const ShootingProblem& problem_;
  const ParameterMap& map_;
  const EquationCoordinates& coordinates_;
  const RowMatrixXd& triangle_;
  const double entropy_;  // EstimationOptions::body_weight
  double barrier_;        // weight of -log det J now, (11.15)
  std::vector<FreeBody> bodies_;
  std::vector<int> rest_;  // places in theta of the other unknowns, first
  Eigen::VectorXd theta0_, xi0_, lower_, upper_, mean_, weight_;
  Point now_;
};

Minimiser::Minimiser(const ShootingProblem& problem,
                     const EquationCoordinates& coordinates,
                     const RowMatrixXd& triangle, const Eigen::VectorXd& theta0)
    : problem_(problem),
      map_(problem.map()),
      coordinates_(coordinates),
      triangle_(triangle),
      entropy_(problem.options().body_weight),
      barrier_(entropy_),
      theta0_(theta0) {
  FindFreeBodies();
  MechanismParameters<double> values;
  map_.Apply<double>(theta0.data(), &values);
  xi0_.resize(coordinates.size());
  coordinates.Read<double>(values, xi0_.data());
  const int n = static_cast<int>(rest_.size() + kTen * bodies_.size());
  lower_.setConstant(n, -INFINITY);
  upper_.setConstant(n, INFINITY);
  mean_.setZero(n);
  weight_.setZero(n);
  for (size_t k = 0; k < rest_.size(); ++k) {
    const int i = rest_[k];
    const FreeParameter& free = problem.free()[i];
    mean_[k] = theta0[i];
    if (!map_.IsTransformed(i)) {
      lower_[k] = free.lower;
      upper_[k] = free.upper;
      if (free.prior) {
        mean_[k] = free.prior->mean;
        weight_[k] = 1.0 / (free.prior->std * free.prior->std);
      }
    }
  }
  // J_0 is where the problem starts: an estimate from the same data, which may
  // be near the bound, is no belief.
  map_.Apply<double>(problem.InitialTheta().data(), &values);
  Eigen::VectorXd initial(coordinates.size());
  coordinates.Read<double>(values, initial.data());
  for (FreeBody& body : bodies_) {
    body.J0_inverse = PseudoInertia(initial.segment<kTen>(body.xi)).inverse();
  }
  // Where there is no belief: a wide one, by what the parameter would have to
  // be to make all of the efforts alone.
  Point start;
  start.unknowns = StartingPoint();
  start.theta = theta0;
  Differentiate(&start);
  const RowMatrixXd A = triangle.leftCols(coordinates.size()) * start.D;
  const double all = triangle.rightCols(1).norm();
  for (size_t k = 0; k < rest_.size(); ++k) {
    if (weight_[k] > 0.0) continue;
    const double typical = problem.free()[rest_[k]].parameter.typical_scale;
    const double by_data = A.col(k).norm() / std::max(all, 1e-300);
    weight_[k] = std::pow(std::max(by_data, 1e-6 / typical) / kWide, 2);
  }
}

void Minimiser::FindFreeBodies() {
  std::map<int, std::map<std::pair<ParameterKind, int>, int>> places;
  const std::vector<Parameter>& parameters = map_.parameters();
  for (int i = 0; i < map_.size(); ++i) {
    const Parameter& p = parameters[i];
    const FreeParameter& free = problem_.free()[i];
    // One with a bound or a belief of its own is not a body's alone.
    const bool plain =
        !free.prior && free.lower <= p.lower && free.upper >= p.upper;
    if (plain &&
        (p.kind == ParameterKind::kMass || p.kind == ParameterKind::kCom ||
         p.kind == ParameterKind::kInertia)) {
      places[p.index][{p.kind, p.component}] = i;
    }
  }
  std::vector<bool> of_body(map_.size(), false);
  for (const auto& [link, ten] : places) {
    if (ten.size() != kTen) continue;
    FreeBody body{link, coordinates_.PlaceOf(link), 0, {}, {}};
    int k = 0;
    for (const auto& [what, i] : ten) {
      body.theta[k++] = i;
      of_body[i] = true;
    }
    bodies_.push_back(body);
  }
  for (int i = 0; i < map_.size(); ++i) {
    if (!of_body[i]) rest_.push_back(i);
  }
  int at = static_cast<int>(rest_.size());
  for (FreeBody& body : bodies_) {
    body.unknown = at;
    at += kTen;
  }
}

Minimiser::Point Minimiser::At(const Eigen::VectorXd& unknowns) const {
  Point point;
  point.unknowns = unknowns;
  double entropy = 0.0;
  Eigen::VectorXd values(map_.size());
  map_.ValuesOf<double>(theta0_.data(), values.data());
  for (const FreeBody& body : bodies_) {
    const Ten xi = unknowns.segment<kTen>(body.unknown);
    const Eigen::Matrix4d J = PseudoInertia(xi);
    const Eigen::LLT<Eigen::Matrix4d> llt(J);
    if (llt.info() != Eigen::Success) return point;
    const Eigen::Matrix4d L = llt.matrixL();
    entropy += entropy_ * (body.J0_inverse * J).trace() -
               barrier_ * 2.0 * L.diagonal().array().log().sum();
    const Inertial<double> as = EquationCoordinates::BodyAt(xi.data());
    const Eigen::Matrix3d& I = as.inertia;
    const double ten[] = {as.mass, as.com[0], as.com[1], as.com[2], I(0, 0),
                          I(1, 1), I(2, 2),   I(0, 1),   I(0, 2),   I(1, 2)};
    for (int k = 0; k < kTen; ++k) values[body.theta[k]] = ten[k];
  }
  if (!map_.ThetaOf(values, &point.theta)) return point;
  for (size_t k = 0; k < rest_.size(); ++k) {
    point.theta[rest_[k]] = unknowns[k];
  }
  if (!map_.FirstImpossibleLink(point.theta.data()).empty()) return point;
  MechanismParameters<double> applied;
  map_.Apply<double>(point.theta.data(), &applied);
  point.xi.resize(coordinates_.size());
  coordinates_.Read<double>(applied, point.xi.data());
  const int n = coordinates_.size();
  const Eigen::VectorXd left =
      triangle_.leftCols(n) * (point.xi - xi0_) + triangle_.col(n);
  point.cost = 0.5 * left.squaredNorm() + entropy +
               0.5 * weight_.dot((unknowns - mean_).cwiseAbs2());
  if (!std::isfinite(point.cost)) point.cost = INFINITY;
  return point;
}

Eigen::Matrix4d Minimiser::FactorAt(const Point& point,
                                    const FreeBody& body) const {
  const Ten xi = point.unknowns.segment<kTen>(body.unknown);
  return PseudoInertia(xi).llt().matrixL();
}

void Minimiser::Differentiate(Point* point) const {
  constexpr int kWidth = EquationCoordinates::kWidth;
  const int n = coordinates_.size(), rest = static_cast<int>(rest_.size());
  point->D.setZero(n, point->unknowns.size());
  std::vector<Jet24> theta(point->theta.begin(), point->theta.end()), xi(n);
  MechanismParameters<Jet24> values;
  for (int begin = 0; begin < rest; begin += kWidth) {
    const int count = std::min(kWidth, rest - begin);
    for (int c = 0; c < count; ++c) theta[rest_[begin + c]].v[c] = 1.0;
    map_.Apply<Jet24>(theta.data(), &values);
    coordinates_.Read<Jet24>(values, xi.data());
    for (int i = 0; i < n; ++i) {
      for (int c = 0; c < count; ++c) point->D(i, begin + c) = xi[i].v[c];
    }
    for (int c = 0; c < count; ++c) theta[rest_[begin + c]].v.setZero();
  }
  point->T.setIdentity(point->unknowns.size(), point->unknowns.size());
  for (const FreeBody& body : bodies_) {
    const Eigen::Matrix4d L = FactorAt(*point, body);
    for (int c = 0; c < kTen; ++c) {
      const Ten column =
          CoordinatesOf(L * Symmetric(Ten::Unit(c)) * L.transpose());
      point->T.col(body.unknown + c).segment<kTen>(body.unknown) = column;
    }
    point->D.middleRows<kTen>(body.xi) =
        point->T.middleRows<kTen>(body.unknown);
  }
}

void Minimiser::Curve(const Point& point, Eigen::VectorXd* g,
                      Eigen::MatrixXd* H) const {
  const int n = coordinates_.size();
  const RowMatrixXd A = triangle_.leftCols(n) * point.D;
  const Eigen::VectorXd left =
      triangle_.leftCols(n) * (point.xi - xi0_) + triangle_.col(n);
  *g = A.transpose() * left + weight_.cwiseProduct(point.unknowns - mean_);
  *H = A.transpose() * A;
  H->diagonal() += weight_;
  for (const FreeBody& body : bodies_) {
    const Eigen::Matrix4d L = FactorAt(point, body);
    const Eigen::Matrix4d G = L.transpose() * body.J0_inverse * L;
    for (int c = 0; c < kTen; ++c) {
      const Eigen::Matrix4d S = Symmetric(Ten::Unit(c));
      (*g)[body.unknown + c] +=
          entropy_ * G.cwiseProduct(S).sum() - barrier_ * S.trace();
      (*H)(body.unknown + c, body.unknown + c) += barrier_;
    }
  }
}

double Minimiser::ToTheBound(const Eigen::VectorXd& step) const {
  double part = INFINITY;
  for (const FreeBody& body : bodies_) {
    const double least =
        EigenOfSymmetric(Symmetric(step.segment<kTen>(body.unknown))).values[0];
    if (least < 0.0) part = std::min(part, -1.0 / least);
  }
  return part;
}

Eigen::VectorXd Minimiser::FreeStep(const Eigen::VectorXd& g,
                                    const Eigen::MatrixXd& H) const {
  // Of the step: what is cut that short bends all of it.
  constexpr double kNear = 0.01;
  const int n = static_cast<int>(g.size());
  std::vector<bool> held(n, false);
  Eigen::VectorXd step;
  for (bool more = true; more;) {
    std::vector<int> loose;
    for (int i = 0; i < n; ++i) {
      if (!held[i]) loose.push_back(i);
    }
    // Scaled to a unit diagonal: the units of the unknowns differ by 1e6.
    const Eigen::VectorXd scale =
        H.diagonal()(loose).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled =
        scale.asDiagonal() * H(loose, loose) * scale.asDiagonal();
    step.setZero(n);
    step(loose) = -scale.cwiseProduct(
        SolveSymmetric(scaled, Eigen::VectorXd(scale.cwiseProduct(g(loose)))));
    more = false;
    for (const int i : loose) {
      const double room = g[i] > 0.0 ? now_.unknowns[i] - lower_[i]
                                     : upper_[i] - now_.unknowns[i];
      if (room > kNear * std::abs(step[i]) || g[i] == 0.0) continue;
      held[i] = more = true;
    }
  }
  // What is held goes the rest of its way.
  for (int i = 0; i < n; ++i) {
    if (held[i]) step[i] = (g[i] > 0.0 ? lower_ : upper_)[i] - now_.unknowns[i];
  }
  return step;
}

bool Minimiser::Descend(double settled, int* iterations) {
  constexpr int kMost = 100;
  constexpr double kArmijo = 1e-4;
  // Of the way to the bound of the possible bodies.
  constexpr double kInside = 0.9;
  for (int i = 0; i < kMost; ++i) {
    ++*iterations;
    Differentiate(&now_);
    Eigen::VectorXd g;
    Eigen::MatrixXd H;
    Curve(now_, &g, &H);
    const Eigen::VectorXd step = FreeStep(g, H);
    const Eigen::VectorXd move = now_.T * step;
    const double slope = -g.dot(step);
    const auto after = [&](double part) {
      return At(
          (now_.unknowns + part * move).cwiseMax(lower_).cwiseMin(upper_));
    };
    const double most_part = kInside * ToTheBound(step);
    if (!(slope > 2.0 * settled)) {
      // Onto a bound, however little that gains.
      Point last = after(std::min(1.0, most_part));
      if (last.cost <= now_.cost) now_ = std::move(last);
      return std::isfinite(slope);
    }
    double part = std::min(1.0, most_part);
    Point next = after(part);
    while (!(next.cost <= now_.cost - kArmijo * part * slope) && part > 1e-10) {
      part *= 0.5;
      next = after(part);
    }
    if (!(next.cost < now_.cost)) return false;
    // A step that was cut short gains little wherever it is.
    const bool done = part == 1.0 && now_.cost - next.cost < settled;
    // From near the bound Newton's step only doubles the distance to it.
    while (part >= 1.0 && 2.0 * part <= most_part) {
      part *= 2.0;
      Point further = after(part);
      if (!(further.cost < next.cost)) break;
      next = std::move(further);
    }
    now_ = std::move(next);
    if (done) return true;
  }
  return false;
}

Eigen::VectorXd Minimiser::StartingPoint() const {
  Eigen::VectorXd start(mean_.size());
  for (size_t k = 0; k < rest_.size(); ++k) start[k] = theta0_[rest_[k]];
  for (const FreeBody& body : bodies_) {
    start.segment<kTen>(body.unknown) = xi0_.segment<kTen>(body.xi);
  }
  return start;
}

RegressionEstimate Minimiser::Run() {
  // Of the cost, which is half a chi-square: a thousandth of a standard error.
  constexpr double kSettled = 1e-6;
  // The weight falls as the distance to the bound may, kInside. Each time
  // Newton's method first comes to where it converges quadratically: half the
  // squared decrement 0.03 of the weight (Boyd and Vandenberghe 2004, 9.6.4).
  constexpr double kFall = 0.1, kCentred = 0.03;
  RegressionEstimate out;
  if (!bodies_.empty()) {
    const double misfit = 0.5 * triangle_.rightCols(1).squaredNorm();
    barrier_ = std::max(entropy_, misfit / (kTen * bodies_.size()));
  }
  now_ = At(StartingPoint());
  if (!std::isfinite(now_.cost)) {
    // A start that no body can have.
    out.theta = theta0_;
    out.xi = xi0_;
    return out;
  }
  while (barrier_ > entropy_) {
    Descend(kCentred * barrier_, &out.iterations);
    barrier_ = std::max(entropy_, kFall * barrier_);
    now_ = At(now_.unknowns);
  }
  out.converged = Descend(kSettled, &out.iterations);
  out.theta = now_.theta;
  out.xi = now_.xi;
  return out;
}

}  // namespace

RegressionEstimate EstimateByRegression(const ShootingProblem& problem,
                                        const EquationCoordinates& coordinates,
                                        const RowMatrixXd& triangle,
                                        const Eigen::VectorXd& theta0) {
  return Minimiser(problem, coordinates, triangle, theta0).Run();
}

Eigen::MatrixXd EntropyCurvature(const Inertial<double>& body) {
  // About the link's origin, in its axes.
  const Eigen::Vector3d& c = body.com;
  const Eigen::Matrix3d I =
      body.inertia +
      body.mass *
          (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
  Ten xi;
  xi << body.mass, body.mass * c, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2),
      I(1, 2);
  const Eigen::Matrix4d J0 = PseudoInertia(xi);
  const Cholesky factor{J0};
  constexpr double kNoBody = 1e-6;  // of its size
  if (!factor.Valid() || factor.L().diagonal().minCoeff() <
                             kNoBody * factor.L().diagonal().maxCoeff()) {
    return {};
  }
  std::vector<Eigen::MatrixXd> moved;
  for (int i = 0; i < kTen; ++i) {
    moved.push_back(factor.Solve(Eigen::MatrixXd(PseudoInertia(Ten::Unit(i)))));
  }
  Eigen::MatrixXd curvature(kTen, kTen);
  for (int i = 0; i < kTen; ++i) {
    for (int j = 0; j < kTen; ++j) {
      curvature(i, j) = (moved[i] * moved[j]).trace();
    }
  }
  return curvature;
}

double CostOfBeliefs(const ShootingProblem& problem,
                     const EquationCoordinates& coordinates,
                     const Eigen::VectorXd& theta) {
  const RowMatrixXd nothing = RowMatrixXd::Zero(1, coordinates.size() + 1);
  return Minimiser(problem, coordinates, nothing, theta).StartCost();
}

}  // namespace sysid
