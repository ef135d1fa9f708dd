#include "sysid/simulation/reference.h"

#include <algorithm>
#include <cmath>

#include "models/error.h"
#include "sysid/io/csv.h"
#include "sysid/io/run_columns.h"
#include "sysid/simulation/joint_limits.h"

namespace sysid {
namespace {

// The slopes at the samples of parabolas through three of them; of a line where
// there are but two.
std::vector<double> Slopes(const std::vector<double>& t,
                           const std::vector<double>& q) {
  const size_t n = t.size();
  std::vector<double> slopes(n, 0.0);
  if (n < 2) return slopes;
  const auto between = [&](size_t k) {
    return (q[k + 1] - q[k]) / (t[k + 1] - t[k]);
  };
  if (n == 2) {
    slopes = {between(0), between(0)};
    return slopes;
  }
  for (size_t k = 1; k + 1 < n; ++k) {
    const double before = t[k] - t[k - 1], behind = t[k + 1] - t[k];
    slopes[k] =
        (behind * between(k - 1) + before * between(k)) / (before + behind);
  }
  slopes[0] = 2 * between(0) - slopes[1];
  slopes[n - 1] = 2 * between(n - 2) - slopes[n - 2];
  return slopes;
}

void CheckLimits(const Joint& joint, double q, double t,
                 const std::string& name) {
  constexpr double kRounding = 1e-9;
  if (!HasPositionLimits(joint)) return;
  if (q >= joint.lower - kRounding && q <= joint.upper + kRounding) return;
  throw InputError(
      name,
      joint.name + ".q is " + ShortestText(q) + " at t = " + ShortestText(t) +
          " s, outside of the limits " + ShortestText(joint.lower) + " to " +
          ShortestText(joint.upper) + " of the URDF",
      "keep the reference within them; angles are in radians");
}

}  // namespace

JointReference::JointReference(const Model& model, const Run& run)
    : series_(model.bodies().size()), duration_(run.t.back() - run.t.front()) {
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    const Body& body = model.bodies()[b];
    const Channel* channel =
        FindChannel(run, ChannelKind::kPosition, body.joint);
    if (channel == nullptr) continue;
    const Joint joint = LimitedJoint(model, body);
    Series series;
    for (int k = 0; k < run.size(); ++k) {
      const double q = channel->values(k, 0);
      if (std::isnan(q)) continue;
      CheckLimits(joint, q, run.t[k], run.name);
      series.t.push_back(run.t[k] - run.t.front());
      series.q.push_back(q);
    }
    series.qd = Slopes(series.t, series.q);
    series_[b] = std::move(series);
    bodies_.push_back(static_cast<int>(b));
  }
  if (!bodies_.empty()) return;
  std::vector<std::string> columns;
  for (const Joint& joint : model.mechanism().joints) {
    if (VelocitySize(joint) == 1) columns.push_back(joint.name + ".q");
  }
  throw InputError(run.name, "has no position of a joint to follow",
                   columns.empty()
                       ? "this model has no joint of one degree of "
                         "freedom"
                       : "its columns are t and any of " + Join(columns));
}

bool JointReference::Has(int body) const { return series_[body].has_value(); }

JointReference::Point JointReference::At(int body, double t) const {
  const Series& s = *series_[body];
  const size_t behind =
      std::upper_bound(s.t.begin(), s.t.end(), t) - s.t.begin();
  // At the last sample still moving: that is where its table ends.
  if (behind == 0) return {s.q.front(), 0.0};
  if (behind == s.t.size()) {
    return {s.q.back(), t == s.t.back() ? s.qd.back() : 0.0};
  }
  const size_t k = behind - 1;
  const double h = s.t[k + 1] - s.t[k], x = (t - s.t[k]) / h;
  // Hermite's cubic: q_k + h x (qd_k + x (a + x b)).
  const double step = (s.q[k + 1] - s.q[k]) / h;
  const double a = 3 * step - 2 * s.qd[k] - s.qd[k + 1];
  const double b = s.qd[k] + s.qd[k + 1] - 2 * step;
  return {s.q[k] + h * x * (s.qd[k] + x * (a + x * b)),
          s.qd[k] + x * (2 * a + 3 * b * x)};
}

std::vector<std::string> JointReference::Missing(const Model& model) const {
  std::vector<std::string> missing;
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    const Joint& joint = model.mechanism().joints[model.bodies()[b].joint];
    if (VelocitySize(joint) == 1 && !series_[b]) {
      missing.push_back(joint.name);
    }
  }
  return missing;
}

Eigen::VectorXd JointReference::Start(const Model& model,
                                      Eigen::VectorXd x0) const {
  for (const int b : bodies_) {
    const Point start = At(b, 0.0);
    x0[model.layout().q(model.bodies()[b])] = start.q;
    x0[model.layout().qd(model.bodies()[b])] = start.qd;
  }
  return x0;
}

void JointReference::HoldOthers(const Model& model, const Eigen::VectorXd& x0) {
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    const Body& body = model.bodies()[b];
    if (VelocitySize(body) != 1 || series_[b]) continue;
    series_[b] = Series{{0.0}, {x0[model.layout().q(body)]}, {0.0}};
    bodies_.push_back(static_cast<int>(b));
  }
}

}  // namespace sysid
