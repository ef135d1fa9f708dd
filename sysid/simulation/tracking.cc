#include "sysid/simulation/tracking.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "models/dynamics.h"
#include "models/error.h"
#include "models/math/decompositions.h"
#include "models/state.h"
#include "residuals/acting_inputs.h"
#include "sysid/io/csv.h"
#include "sysid/parameters/patterns.h"
#include "sysid/simulation/joint_limits.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr char kGainsHint[] =
    "write kp,kd for all joints, such as 200,20, or "
    "joint1=200:20,joint2=50:5, in N m/rad and N m s/rad (slides: N/m, N s/m)";

// "200<separator>20".
Gains ParsePair(const std::string& text, char separator,
                const std::string& place) {
  const size_t at = text.find(separator);
  Gains gains;
  const bool read =
      at != std::string::npos &&
      ParseNumber(Trim(std::string_view(text).substr(0, at)), &gains.kp) &&
      ParseNumber(Trim(std::string_view(text).substr(at + 1)), &gains.kd) &&
      std::isfinite(gains.kp) && std::isfinite(gains.kd);
  if (!read) {
    throw InputError(place, "'" + text + "' is no pair of gains", kGainsHint);
  }
  if (gains.kp <= 0 || gains.kd < 0) {
    throw InputError(place,
                     "'" + text + "': kp must be positive, kd not negative",
                     kGainsHint);
  }
  return gains;
}

struct NamedGains {
  std::string joint;
  Gains gains;
  std::string place;
};

std::vector<NamedGains> ParseList(const std::string& text,
                                  const std::string& place) {
  std::vector<NamedGains> list;
  for (size_t from = 0; from <= text.size();) {
    const size_t comma = std::min(text.find(',', from), text.size());
    const std::string part = text.substr(from, comma - from);
    const size_t equals = part.find('=');
    if (equals == std::string::npos) {
      throw InputError(place, "'" + part + "' has no joint", kGainsHint);
    }
    const std::string name(Trim(std::string_view(part).substr(0, equals)));
    for (const NamedGains& other : list) {
      if (other.joint != name) continue;
      throw InputError(place, "'" + name + "' is named twice", "name it once");
    }
    list.push_back(
        {name, ParsePair(part.substr(equals + 1), ':', place), place});
    from = comma + 1;
  }
  return list;
}

// The joint-space inertia of the joints that have gains, and theirs, in order.
struct Loop {
  std::vector<int> dofs;
  VectorXd kp, kd;
};

Loop LoopOf(const Model& model, const std::vector<Gains>& gains) {
  Loop loop;
  std::vector<double> kp, kd;
  for (size_t b = 0; b < gains.size(); ++b) {
    if (VelocitySize(model.bodies()[b]) != 1) continue;
    loop.dofs.push_back(model.bodies()[b].v_index);
    kp.push_back(gains[b].kp);
    kd.push_back(gains[b].kd);
  }
  loop.kp = VectorXd::Map(kp.data(), kp.size());
  loop.kd = VectorXd::Map(kd.data(), kd.size());
  return loop;
}

// The inverse of M, of the joints of the loop; balls between them move along.
MatrixXd Mobility(Workspace<double>* ws, const double* q,
                  const std::vector<int>& dofs) {
  MatrixX<double> M;
  MassMatrix<double>(ws, q, &M);
  const MatrixXd inverse = InverseOf(M);
  return inverse(dofs, dofs);
}

double Growth(const MatrixXd& mobility, const Loop& loop, double T) {
  const Eigen::Index n = mobility.rows();
  MatrixXd A(2 * n, 2 * n);
  const MatrixXd of_q = mobility * loop.kp.asDiagonal();
  const MatrixXd of_qd = mobility * loop.kd.asDiagonal();
  const MatrixXd I = MatrixXd::Identity(n, n);
  A << I - 0.5 * T * T * of_q, T * I - 0.5 * T * T * of_qd, -T * of_q,
      I - T * of_qd;
  const Eigen::VectorXcd all = EigenvaluesOf(A);
  return all.size() > 0 ? all.cwiseAbs().maxCoeff() : INFINITY;
}

// Two digits are enough of what is only suggested.
double TwoDigits(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
  return unit * std::round(value / unit);
}

// Configurations on the way, x0's first.
std::vector<VectorXd> Way(const Model& model, const JointReference& reference,
                          const VectorXd& x0) {
  constexpr int kPoints = 20;
  std::vector<VectorXd> way;
  for (int i = 0; i < kPoints; ++i) {
    VectorXd q = x0.segment(model.layout().q(), model.nq());
    for (const int b : reference.bodies()) {
      const double t = reference.duration() * i / (kPoints - 1);
      q[model.bodies()[b].q_index] = reference.At(b, t).q;
    }
    way.push_back(q);
  }
  return way;
}

}  // namespace

std::vector<Gains> ParseGains(const std::string& text, const Model& model,
                              const std::string& place) {
  std::vector<Gains> gains(model.bodies().size());
  const bool by_joint = text.find('=') != std::string::npos;
  std::vector<NamedGains> list;
  const Vocabulary joints = JointVocabulary(model.mechanism());
  if (by_joint) {
    list = ExpandPatterns(ParseList(text, place), &NamedGains::joint, joints);
  } else {
    const Gains all = ParsePair(text, ',', place);
    for (const std::string& name : joints.names) {
      list.push_back({name, all, place});
    }
  }
  for (const NamedGains& one : list) {
    if (std::find(joints.names.begin(), joints.names.end(), one.joint) ==
        joints.names.end()) {
      throw InputError(
          place,
          "no joint of one degree of freedom is named '" + one.joint + "'",
          NameHint(one.joint, joints.names));
    }
  }
  std::vector<std::string> missing;
  for (size_t b = 0; b < gains.size(); ++b) {
    const std::string& name =
        model.mechanism().joints[model.bodies()[b].joint].name;
    const auto at =
        std::find_if(list.begin(), list.end(),
                     [&](const auto& one) { return one.joint == name; });
    if (at != list.end()) {
      gains[b] = at->gains;
    } else if (VelocitySize(model.bodies()[b]) == 1) {
      missing.push_back(name);
    }
  }
  if (!missing.empty()) {
    throw InputError(place, "has no gains of " + Join(missing),
                     "give them, or '*=kp:kd' for all that are not named");
  }
  return gains;
}

std::string SuggestGains(const Model& model, const JointReference& reference,
                         const VectorXd& x0, double period) {
  std::vector<Gains> gains(model.bodies().size());
  Workspace<double> ws(model);
  MatrixX<double> M;
  MassMatrix<double>(&ws, x0.data() + model.layout().q(), &M);
  // What a joint feels while the others give way: more would make couplings
  // unstable that less does not.
  const VectorXd felt = InverseOf(M).diagonal().cwiseInverse();
  // A bandwidth of 5 Hz, or what is left of a loop of this period: halved until
  // it is stable with twice the period too.
  double w = std::min(2 * M_PI * 5.0, 0.5 / period);
  std::string text;
  for (int i = 0; i < 30; ++i, w *= 0.5) {
    std::vector<std::string> parts;
    for (size_t b = 0; b < gains.size(); ++b) {
      const Body& body = model.bodies()[b];
      if (VelocitySize(body) != 1) continue;
      const double inertia = felt[body.v_index];
      gains[b] = {TwoDigits(inertia * w * w), TwoDigits(2 * inertia * w)};
      parts.push_back(model.mechanism().joints[body.joint].name + "=" +
                      RoundedText(gains[b].kp) + ":" +
                      RoundedText(gains[b].kd));
    }
    text = Join(parts, ",");
    if (IsStable(LoopGrowth(model, reference, x0, gains, 2 * period))) break;
  }
  return text;
}

DriveLaw Track(const Model& model, const JointReference& reference,
               const std::vector<Gains>& gains) {
  const auto ws = std::make_shared<Workspace<double>>(model);
  const VectorXd still = VectorXd::Zero(model.nv());
  return [&model, &reference, gains, ws, still](
             int, double t, const VectorXd& x, Eigen::Ref<VectorXd> effort) {
    VectorXd seen = x.segment(model.layout().q(), model.nq());
    // A late sensor as if speeds stayed.
    ws->ModifyMeasurement(x.data() + model.layout().qd(), still.data(),
                          seen.data());
    for (const int b : reference.bodies()) {
      const Body& body = model.bodies()[b];
      const JointReference::Point point = reference.At(b, t);
      const double tau = gains[b].kp * (point.q - seen[body.q_index]) +
                         gains[b].kd * (point.qd - x[model.layout().qd(body)]);
      const double limit = EffortLimit(model.mechanism().joints[body.joint]);
      effort[body.v_index] = std::clamp(tau, -limit, limit);
    }
  };
}

double LoopGrowth(const Model& model, const JointReference& reference,
                  const VectorXd& x0, const std::vector<Gains>& gains,
                  double period) {
  const Loop loop = LoopOf(model, gains);
  Workspace<double> ws(model);
  double growth = 0.0;
  for (const VectorXd& q : Way(model, reference, x0)) {
    growth = std::max(growth,
                      Growth(Mobility(&ws, q.data(), loop.dofs), loop, period));
  }
  return growth;
}

bool IsStable(double growth) { return growth <= 1.0 + 1e-6; }

double StableRate(const Model& model, const JointReference& reference,
                  const VectorXd& x0, const std::vector<Gains>& gains,
                  double rate) {
  for (int i = 0; i < 10; ++i) {
    rate *= 2;
    if (IsStable(LoopGrowth(model, reference, x0, gains, 1.0 / rate))) {
      return rate;
    }
  }
  return 0.0;
}

Run SimulateTracking(const Model& model, const VectorXd& x0,
                     const SimulationOptions& options,
                     const JointReference& reference,
                     const std::vector<Gains>& gains,
                     const std::string& suggested,
                     std::vector<std::string>* notices) {
  constexpr double kLost = 1.0;  // rad, m: that is no following
  const double growth =
      LoopGrowth(model, reference, x0, gains, 1.0 / options.rate);
  const bool stable = IsStable(growth);
  const double rate =
      stable ? 0.0 : StableRate(model, reference, x0, gains, options.rate);
  const std::string what = "make a loop of " + ShortestText(options.rate) +
                           " samples a second unstable: from one to the next "
                           "it grows by a factor of " +
                           RoundedText(TwoDigits(growth));
  const std::string hint =
      (rate > 0 ? "give --rate " + RoundedText(rate) + ", or lower gains: "
                : "give lower gains: ") +
      suggested;
  double farthest = 0.0;
  const DriveLaw track = Track(model, reference, gains);
  const DriveLaw watched = [&](int k, double t, const VectorXd& x,
                               Eigen::Ref<VectorXd> effort) {
    if (k == 0) farthest = 0.0;
    for (const int b : reference.bodies()) {
      const double q = x[model.layout().q(model.bodies()[b])];
      farthest = std::max(farthest, std::abs(q - reference.At(b, t).q));
    }
    // Stops here, before numbers overflow.
    if (!stable && farthest > kLost) effort.setConstant(NAN);
    if (stable || farthest <= kLost) track(k, t, x, effort);
  };
  const auto lost = [&] { return InputError("--gains", what, hint); };
  Run run;
  try {
    run = SimulateDriven(model, x0, options, watched);
  } catch (const InputError&) {
    if (!stable) throw lost();
    throw;
  }
  if (!stable) notices->push_back("--gains: " + what + "; " + hint);
  for (const std::string& notice : LimitNotices(model, run)) {
    notices->push_back(notice);
  }
  return run;
}

DriveLaw Replay(const Run& efforts) {
  return
      [&efforts](int, double t, const VectorXd&, Eigen::Ref<VectorXd> effort) {
        // The row that holds from t on: rounding does not keep it from
        // beginning.
        const double at = efforts.t.front() + t + 1e-9;
        effort = efforts.effort.row(RowBefore(efforts, at)).transpose();
      };
}

std::vector<std::string> LimitNotices(const Model& model, const Run& run) {
  std::vector<std::string> notices;
  for (size_t b = 0; b < model.movers().size(); ++b) {
    const Body& body = model.movers()[b];
    const Joint joint = LimitedJoint(model, body);
    if (VelocitySize(body) != 1) continue;
    const double limit = EffortLimit(joint);
    const auto at_limit =
        (run.effort.col(body.v_index).array().abs() >= limit).count();
    if (at_limit > 0) {
      notices.push_back(
          "joint '" + joint.name + "' is at its effort limit, " +
          ShortestText(limit) + ", in " +
          RoundedText(std::ceil(1000.0 * at_limit / run.size()) / 10.0) +
          " % of the samples");
    }
    if (!HasPositionLimits(joint)) continue;
    const auto& q = run.channels[b].values.col(0);
    const double slack = 0.01 * (joint.upper - joint.lower);
    for (int k = 0; k < run.size(); ++k) {
      if (q[k] >= joint.lower - slack && q[k] <= joint.upper + slack) continue;
      notices.push_back("joint '" + joint.name + "' leaves its limits " +
                        ShortestText(joint.lower) + " to " +
                        ShortestText(joint.upper) +
                        " at t = " + ShortestText(run.t[k]) +
                        " s: the dynamics have no stops");
      break;
    }
  }
  return notices;
}

}  // namespace sysid
