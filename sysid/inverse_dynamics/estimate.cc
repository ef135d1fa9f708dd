#include "sysid/inverse_dynamics/estimate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace sysid {
namespace {

constexpr int kTen = 10;
// Beliefs of this size say nothing beside data: they move what is known to its
// size by 1 % of a standard error.
constexpr double kWide = 10.0;
// How much a body of the URDF counts beside the data. Its inertias are rough:
// so much as one sample of noise.
constexpr double kEntropy = 1.0;

// dJ / d xi_c of (11.8).
std::array<Eigen::Matrix4d, kTen> PseudoInertiaColumns() {
  std::array<Eigen::Matrix4d, kTen> E;
  for (Eigen::Matrix4d& e : E) e.setZero();
  E[0](3, 3) = 1.0;
  for (int i = 0; i < 3; ++i) {
    E[1 + i](i, 3) = E[1 + i](3, i) = 1.0;
    for (int j = 0; j < 3; ++j) E[4 + i](j, j) = i == j ? -0.5 : 0.5;
  }
  constexpr int kRow[] = {0, 0, 1}, kColumn[] = {1, 2, 2};
  for (int i = 0; i < 3; ++i) {
    E[7 + i](kRow[i], kColumn[i]) = E[7 + i](kColumn[i], kRow[i]) = -1.0;
  }
  return E;
}

const std::array<Eigen::Matrix4d, kTen>& Columns() {
  static const auto& columns =
      *new std::array<Eigen::Matrix4d, kTen>(PseudoInertiaColumns());
  return columns;
}

Eigen::Matrix4d PseudoInertia(const Eigen::VectorXd& xi) {
  Eigen::Matrix4d J = Eigen::Matrix4d::Zero();
  for (int c = 0; c < kTen; ++c) J += xi[c] * Columns()[c];
  return J;
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

 private:
  // Newton's method until half the squared decrement is below `settled`.
  bool Descend(double settled, int* iterations);
  struct Point {
    Eigen::VectorXd unknowns, theta, xi;
    RowMatrixXd D;  // d xi / d unknowns
    double cost = INFINITY;
  };
  void FindFreeBodies();
  // At the unknowns; the cost is infinite where they are no possible body.
  Point At(const Eigen::VectorXd& unknowns) const;
  void Differentiate(Point* point) const;
  // Gradient and curvature of (11.7).
  void Curve(const Point& point, Eigen::VectorXd* g, Eigen::MatrixXd* H) const;

  const ShootingProblem& problem_;
  const ParameterMap& map_;
  const EquationCoordinates& coordinates_;
  const RowMatrixXd& triangle_;
  double entropy_ = kEntropy;  // how much it counts now
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
  for (FreeBody& body : bodies_) {
    body.J0_inverse = PseudoInertia(xi0_.segment(body.xi, kTen)).inverse();
  }
  // Where there is no belief: a wide one, by what the parameter would have to
  // be to make all of the efforts alone.
  Point start;
  start.unknowns.setZero(n);
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
    const Eigen::VectorXd xi = unknowns.segment(body.unknown, kTen);
    const Eigen::Matrix4d J = PseudoInertia(xi);
    const Eigen::LLT<Eigen::Matrix4d> llt(J);
    if (llt.info() != Eigen::Success) return point;
    const Eigen::Matrix4d L = llt.matrixL();
    entropy += entropy_ * ((body.J0_inverse * J).trace() -
                           2.0 * L.diagonal().array().log().sum());
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
  for (const FreeBody& body : bodies_) {
    for (int c = 0; c < kTen; ++c) {
      point->D.row(body.xi + c).setZero();
      point->D(body.xi + c, body.unknown + c) = 1.0;
    }
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
    const Eigen::Matrix4d J_inverse =
        PseudoInertia(point.unknowns.segment(body.unknown, kTen)).inverse();
    std::array<Eigen::Matrix4d, kTen> B;
    for (int c = 0; c < kTen; ++c) {
      B[c] = J_inverse * Columns()[c];
      (*g)[body.unknown + c] +=
          entropy_ * ((body.J0_inverse * Columns()[c]).trace() - B[c].trace());
    }
    for (int c = 0; c < kTen; ++c) {
      for (int d = 0; d < kTen; ++d) {
        (*H)(body.unknown + c, body.unknown + d) +=
            entropy_ * B[c].cwiseProduct(B[d].transpose()).sum();
      }
    }
  }
}

bool Minimiser::Descend(double settled, int* iterations) {
  constexpr int kMost = 30;
  constexpr double kArmijo = 1e-4;
  const int n = static_cast<int>(mean_.size());
  for (int i = 0; i < kMost; ++i) {
    ++*iterations;
    Differentiate(&now_);
    Eigen::VectorXd g;
    Eigen::MatrixXd H;
    Curve(now_, &g, &H);
    // What a bound holds stays (Bertsekas 1982).
    std::vector<int> loose;
    for (int i = 0; i < n; ++i) {
      const bool held = (now_.unknowns[i] <= lower_[i] && g[i] > 0.0) ||
                        (now_.unknowns[i] >= upper_[i] && g[i] < 0.0);
      if (!held) loose.push_back(i);
    }
    // Scaled to a unit diagonal: the units of the unknowns differ by 1e6.
    const Eigen::VectorXd scale =
        H.diagonal()(loose).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled =
        scale.asDiagonal() * H(loose, loose) * scale.asDiagonal();
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
    step(loose) =
        -scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(g(loose))));
    const double slope = -g.dot(step);
    if (!(slope > 2.0 * settled)) return std::isfinite(slope);
    Point next;
    for (double part = 1.0; part > 1e-10; part *= 0.5) {
      next =
          At((now_.unknowns + part * step).cwiseMax(lower_).cwiseMin(upper_));
      if (next.cost <= now_.cost - kArmijo * part * slope) break;
    }
    if (!(next.cost < now_.cost)) return false;
    const bool done = now_.cost - next.cost < settled;
    now_ = std::move(next);
    if (done) return true;
  }
  return false;
}

// Where the data alone would have no possible body, Newton's method may creep
// along the bound of those that are, by steps that a small weight of the
// entropy cuts short. Then the weight begins where the entropy counts as much
// as the data and falls by tens (the path of an interior-point method: Boyd and
// Vandenberghe 2004, section 11.3).
RegressionEstimate Minimiser::Run() {
  // Of the cost, which is half a chi-square: a thousandth of a standard error.
  constexpr double kSettled = 1e-6;
  constexpr double kFall = 0.1;
  const int n = static_cast<int>(mean_.size());
  Eigen::VectorXd start(n);
  for (size_t k = 0; k < rest_.size(); ++k) start[k] = theta0_[rest_[k]];
  for (const FreeBody& body : bodies_) {
    start.segment(body.unknown, kTen) = xi0_.segment(body.xi, kTen);
  }
  RegressionEstimate out;
  now_ = At(start);
  if (!std::isfinite(now_.cost)) {
    out.theta = now_.theta;
    out.xi = now_.xi;
    return out;
  }
  out.converged = Descend(kSettled, &out.iterations);
  if (!out.converged && !bodies_.empty()) {
    const double misfit = 0.5 * triangle_.rightCols(1).squaredNorm();
    entropy_ = std::max(kEntropy, misfit / (kTen * bodies_.size()));
    now_ = At(start);
    while (entropy_ > kEntropy) {
      Descend(entropy_, &out.iterations);
      entropy_ = std::max(kEntropy, kFall * entropy_);
      now_ = At(now_.unknowns);
    }
    out.converged = Descend(kSettled, &out.iterations);
  }
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

}  // namespace sysid
