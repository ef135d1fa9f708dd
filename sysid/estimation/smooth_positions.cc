#include "sysid/estimation/smooth_positions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "models/math/constants.h"
#include "models/state.h"

namespace sysid {
namespace {

constexpr double kHalfWindow = 0.05;  // s
constexpr int kMinNeighbours = 2;     // samples on either side

// Value and slope at t0 of the polynomial through the points (t, y) in the
// least squares; y: one row a point, each number with the noise sigma.
// Quadratic or, where there are points enough, cubic; of higher degree while
// what is left is more than the noise (few samples of a fast motion). By
// polynomials that are orthogonal on the points (Forsythe 1957), of x = (t -
// t0) / scale: p_d+1 = (x - a_d) p_d - b_d p_d-1, one degree after the other.
void FitPolynomial(const std::vector<double>& t, RowMatrixXd y, double t0,
                   double sigma, Eigen::RowVectorXd* value,
                   Eigen::RowVectorXd* slope) {
  constexpr int kMostDegree = 6;
  const int n = static_cast<int>(t.size());
  const double scale = n > 1 ? std::max(t.back() - t0, t0 - t.front()) : 1.0;
  const int least = n >= 7 ? 3 : std::min(2, n - 1);
  const Eigen::ArrayXd x =
      (Eigen::Map<const Eigen::ArrayXd>(t.data(), n) - t0) / scale;
  Eigen::VectorXd p = Eigen::VectorXd::Ones(n), before, next;
  double at = 1.0, at_before = 0.0;  // p and the one before at t0,
  double by = 0.0, by_before = 0.0;  // and their derivatives by x
  double size_before = 0.0;
  value->setZero(y.cols());
  slope->setZero(y.cols());
  before.setZero(n);
  for (int degree = 0;; ++degree) {
    const double size = p.squaredNorm();
    const Eigen::RowVectorXd c = p.transpose() * y / size;
    y.noalias() -= p * c;
    *value += c * at;
    *slope += c * (by / scale);
    const int left = (n - degree - 1) * static_cast<int>(y.cols());
    if (degree >= least && (left <= 0 || degree == kMostDegree ||
                            y.squaredNorm() <= 4.0 * sigma * sigma * left)) {
      return;
    }
    const double a = (x * p.array().square()).sum() / size;
    const double b = degree > 0 ? size / size_before : 0.0;
    next = (x - a) * p.array() - b * before.array();
    before.swap(p);
    p.swap(next);
    const double at_next = -a * at - b * at_before;
    const double by_next = at - a * by - b * by_before;
    at_before = std::exchange(at, at_next);
    by_before = std::exchange(by, by_next);
    size_before = size;
  }
}

// The valid samples around k: within the half window, at least a few.
std::vector<int> Neighbours(const std::vector<double>& t,
                            const std::vector<int>& valid, size_t k) {
  size_t low = k, high = k;
  const double t0 = t[valid[k]];
  while (low > 0 && (t0 - t[valid[low - 1]] <= kHalfWindow ||
                     k - low < static_cast<size_t>(kMinNeighbours))) {
    --low;
  }
  while (high + 1 < valid.size() &&
         (t[valid[high + 1]] - t0 <= kHalfWindow ||
          high - k < static_cast<size_t>(kMinNeighbours))) {
    ++high;
  }
  // At an end as many as in the middle, all on one side.
  constexpr size_t kFewest = 2 * kMinNeighbours + 1;
  while (high - low + 1 < kFewest && low > 0) --low;
  while (high - low + 1 < kFewest && high + 1 < valid.size()) ++high;
  return std::vector<int>(valid.begin() + low, valid.begin() + high + 1);
}

// Fills the rows that are not `known` between their neighbours: linear in the
// tangent; the ends are held. Leaves all as it is where nothing is known.
void BridgeGaps(const std::vector<double>& t, const std::vector<bool>& known,
                Eigen::Ref<RowMatrixXd> q, Eigen::Ref<RowMatrixXd> qd) {
  const int n = static_cast<int>(t.size());
  int before = -1;
  for (int k = 0; k <= n; ++k) {
    if (k < n && !known[k]) continue;
    if (k == n && before < 0) return;
    for (int m = before + 1; m < k; ++m) {
      if (before < 0 || k == n) {
        const int from = before < 0 ? k : before;
        q.row(m) = q.row(from);
        qd.row(m).setZero();
        continue;
      }
      const double s = (t[m] - t[before]) / (t[k] - t[before]);
      if (q.cols() == 4) {
        const Eigen::Quaterniond a(Eigen::Vector4d(q.row(before).transpose()));
        const Eigen::Quaterniond b(Eigen::Vector4d(q.row(k).transpose()));
        q.row(m) = a.slerp(s, b).coeffs().transpose();
      } else {
        q.row(m) = (1 - s) * q.row(before) + s * q.row(k);
      }
      qd.row(m) = (1 - s) * qd.row(before) + s * qd.row(k);
    }
    before = k;
  }
}

// Samples that stand out from their neighbours on both sides by more than these
// differ among themselves, and more than noise does: no start for a state.
std::vector<bool> Spikes(const std::vector<double>& y,
                         const std::vector<int>& valid, double sigma) {
  constexpr int kHalf = 3;  // neighbours on either side
  constexpr double kRanges = 1.0, kSigmas = 3.0;
  std::vector<bool> spikes(y.size(), false);
  const int n = static_cast<int>(valid.size());
  for (int i = kHalf; i < n - kHalf; ++i) {
    std::vector<double> others;
    for (int j = i - kHalf; j <= i + kHalf; ++j) {
      if (j != i) others.push_back(y[valid[j]]);
    }
    std::sort(others.begin(), others.end());
    // Without their own extremes: a second spike may be among them.
    const double low = others[1], high = others[others.size() - 2];
    const double value = y[valid[i]];
    const double off = std::max(low - value, value - high);
    spikes[valid[i]] = off > kRanges * (high - low) + kSigmas * sigma;
  }
  return spikes;
}

// Smooths a joint's position at the valid samples, each by those around it:
// local(k, m) says sample m in coordinates about sample k, and at(k, value) the
// position that has these coordinates. Bridges the others.
template <typename Local, typename At>
void Smooth(const std::vector<double>& t, double sigma,
            const std::vector<int>& valid, const Local& local, const At& at,
            Eigen::Ref<RowMatrixXd> q, Eigen::Ref<RowMatrixXd> qd) {
  std::vector<bool> known(t.size(), false);
  for (size_t i = 0; i < valid.size(); ++i) {
    const int k = valid[i];
    const std::vector<int> around = Neighbours(t, valid, i);
    std::vector<double> times;
    RowMatrixXd y(around.size(), qd.cols());
    for (size_t m = 0; m < around.size(); ++m) {
      times.push_back(t[around[m]]);
      y.row(m) = local(k, around[m]);
    }
    Eigen::RowVectorXd value, slope;
    FitPolynomial(times, y, t[k], sigma, &value, &slope);
    q.row(k) = at(k, value);
    qd.row(k) = slope;  // a rotation's: body axes; J_r(value) = 1 to the noise
    known[k] = true;
  }
  BridgeGaps(t, known, q, qd);
}

}  // namespace

void SmoothScalar(const std::vector<double>& t, bool wraps, double sigma,
                  const Eigen::VectorXd& measured, Eigen::Ref<RowMatrixXd> q,
                  Eigen::Ref<RowMatrixXd> qd) {
  std::vector<int> valid;
  std::vector<double> unwrapped(t.size(), kNaN);
  for (size_t k = 0; k < t.size(); ++k) {
    if (std::isnan(measured[k])) continue;
    double value = measured[k];
    if (wraps && !valid.empty()) {
      const double before = unwrapped[valid.back()];
      value -= 2 * M_PI * std::round((value - before) / (2 * M_PI));
    }
    unwrapped[k] = value;
    valid.push_back(static_cast<int>(k));
  }
  std::erase_if(valid, [&, spikes = Spikes(unwrapped, valid, sigma)](int k) {
    return spikes[k];
  });
  using Number = Eigen::Matrix<double, 1, 1>;
  Smooth(
      t, sigma, valid, [&](int, int m) { return Number(unwrapped[m]); },
      [](int, const Eigen::RowVectorXd& value) { return value; }, q, qd);
}

void SmoothQuaternion(const std::vector<double>& t, double sigma,
                      const RowMatrixXd& measured, Eigen::Ref<RowMatrixXd> q,
                      Eigen::Ref<RowMatrixXd> qd) {
  std::vector<int> valid;
  for (size_t k = 0; k < t.size(); ++k) {
    if (!std::isnan(measured(k, 0))) valid.push_back(static_cast<int>(k));
  }
  const auto rotation = [&](int k) {
    return Eigen::Quaterniond(Eigen::Vector4d(measured.row(k).transpose()));
  };
  Smooth(
      t, sigma, valid,
      [&](int k, int m) -> Eigen::RowVector3d {
        return Log<double>(Multiply(rotation(k).conjugate(), rotation(m)))
            .transpose();
      },
      [&](int k, const Eigen::RowVectorXd& value) -> Eigen::RowVector4d {
        const Eigen::Vector3d moved = value.transpose();
        return Multiply(rotation(k), Exp<double>(moved))
            .normalized()
            .coeffs()
            .transpose();
      },
      q, qd);
}

}  // namespace sysid
