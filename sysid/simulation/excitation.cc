#include "sysid/simulation/excitation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "models/dynamics.h"
#include "models/error.h"
#include "models/math/decompositions.h"
#include "models/printable.h"
#include "sysid/io/csv.h"
#include "sysid/simulation/joint_limits.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kSines = 5;
// Of a sum of sines over its rms, at most.
const double kCrest = std::sqrt(2.0 * kSines);

struct Sine {
  double w = 0.0;      // rad/s
  double phase = 0.0;  // rad
};
using Sines = std::array<Sine, kSines>;

// Those of each body with one degree of freedom, in the order of the bodies.
std::vector<Sines> DrawSines(const Model& model,
                             const MultisineOptions& options,
                             std::mt19937_64* random) {
  std::uniform_real_distribution<double> phase(0.0, 2 * M_PI);
  std::uniform_real_distribution<double> within(0.0, 1.0);
  std::vector<Sines> drawn(model.bodies().size());
  for (size_t b = 0; b < drawn.size(); ++b) {
    if (VelocitySize(model.bodies()[b]) != 1) continue;
    for (int s = 0; s < kSines; ++s) {
      const double f =
          options.lowest * std::pow(options.highest / options.lowest,
                                    (s + within(*random)) / kSines);
      drawn[b][s].w = 2 * M_PI * f;
      drawn[b][s].phase = phase(*random);
    }
  }
  return drawn;
}

// Largest moment of the weight about each joint (N m), or the weight that a
// slide carries (N): by distance, at no special configuration.
std::vector<double> WeightScale(const Model& model) {
  Workspace<double> ws(model);
  std::vector<double> scale(model.bodies().size(), 0.0);
  const double g = ws.gravity.norm() > 0 ? ws.gravity.norm() : 9.81;
  for (size_t i = 0; i < model.bodies().size(); ++i) {
    const BodyData<double>& body = ws.bodies[i];
    double arm = body.mass > 0 ? body.h_B.norm() / body.mass : 0.0;
    for (int j = static_cast<int>(i); j >= 0; j = model.bodies()[j].parent) {
      const bool slide = model.bodies()[j].type == JointType::kPrismatic;
      scale[j] += body.mass * g * (slide ? 1.0 : arm);
      arm += ws.bodies[j].p_PB.norm();
    }
  }
  for (const Body& body : model.followers()) {
    const int child = model.mechanism().joints[body.joint].child_link;
    scale[body.leader] +=
        std::abs(body.multiplier) * scale[model.placement(child).body];
  }
  return scale;
}

struct JointMotion {
  double q = 0.0, qd = 0.0, qdd = 0.0;
};

// What a joint with limits is to do (docs/simulation.md, equations 1 to 3):
//   r(t)     = c + h m(t),  m a sum of sines, max |m| = 1            (1)
//   q_ref(t) = (1 - s) q0 + s r(t),  s from 0 to 1 within T_b        (2)
//   c        = the point nearest to q0 in [lower + d + h, upper - d - h]  (3)
// so that q_ref, which lies between q0 and r, never leaves the limits.
class Excursion {
 public:
  // `most_qdd`: the largest acceleration, rad/s^2 or m/s^2.
  Excursion(const Joint& joint, double q0, double most_qdd, const Sines& sines,
            const MultisineOptions& options, const std::vector<double>& times)
      : joint_(joint), q0_(q0), sines_(sines) {
    // A period of the band's middle.
    blend_s_ = std::min(1.0 / std::sqrt(options.lowest * options.highest),
                        0.25 * times.back());
    const double half = 0.5 * (joint.upper - joint.lower);
    // Beside the limits, for what the loop misses and what the sensor adds.
    constexpr double kRoom = 0.05, kSigmas = 5.0;
    margin_ = std::min(kRoom * half + kSigmas * options.noise, 0.5 * half);
    double highest = 0.0;
    for (const double t : times) {
      highest = std::max(highest, std::abs(Unit(t).q));
    }
    peak_ = std::max(highest, 1e-12);
    // A whole turn to either side shows all that there is.
    SetHeight(options.excursion *
              std::min(half - margin_,
                       joint.type == JointType::kRevolute ? M_PI : HUGE_VAL));
    // An excursion of none is at rest.
    constexpr double kPart = 0.9, kSmaller = 0.95;
    const double most_qd = kPart * VelocityLimit(joint);
    for (int i = 0; i < 200 && IsFaster(most_qd, most_qdd, times); ++i) {
      Shrink(kSmaller);
    }
  }

  void Shrink(double factor) { SetHeight(factor * height_); }
  double blend_s() const { return blend_s_; }
  double height() const { return height_; }

  JointMotion At(double t) const {
    const JointMotion m = Unit(t);
    const double h = height_ / peak_;
    const double r = centre_ + h * m.q - q0_, rd = h * m.qd, rdd = h * m.qdd;
    if (t >= blend_s_) return {q0_ + r, rd, rdd};
    // s = 10 x^3 - 15 x^4 + 6 x^5: at rest at both ends, and no force there.
    const double x = t / blend_s_;
    const double s = x * x * x * (10 + x * (-15 + 6 * x));
    const double sd = 30 * x * x * (1 - x) * (1 - x) / blend_s_;
    const double sdd = 60 * x * (1 - x) * (1 - 2 * x) / (blend_s_ * blend_s_);
    return {q0_ + s * r, sd * r + s * rd, sdd * r + 2 * sd * rd + s * rdd};
  }

 private:
  void SetHeight(double height) {
    height_ = height;
    const double low = joint_.lower + margin_ + height_;
    const double high = joint_.upper - margin_ - height_;
    centre_ = low < high ? std::clamp(q0_, low, high) : 0.5 * (low + high);
  }

  // The sum of sines, each of the same speed: amplitudes fall with frequency.
  JointMotion Unit(double t) const {
    JointMotion m;
    for (const Sine& sine : sines_) {
      const double a = 1.0 / sine.w, angle = sine.w * t + sine.phase;
      m.q += a * std::sin(angle);
      m.qd += a * sine.w * std::cos(angle);
      m.qdd -= a * sine.w * sine.w * std::sin(angle);
    }
    return m;
  }

  bool IsFaster(double qd, double qdd, const std::vector<double>& times) const {
    return std::any_of(times.begin(), times.end(), [&](double t) {
      const JointMotion at = At(t);
      return std::abs(at.qd) > qd || std::abs(at.qdd) > qdd;
    });
  }

  Joint joint_;
  double q0_;
  Sines sines_;
  double blend_s_ = 0.0, margin_ = 0.0, peak_ = 1.0;
  double height_ = 0.0, centre_ = 0.0;
};

// Computed torque on some joints, which makes each of them a double integrator
// that follows its excursion with critical damping (docs/simulation.md,
// equations 4 and 5). The others have the efforts that are there.
class ComputedTorque {
 public:
  ComputedTorque(const Model& model, const RowMatrixXd& open_efforts,
                 double bandwidth, double period)
      : model_(model),
        open_(open_efforts),
        w_(bandwidth),
        period_(period),
        ws_(model) {}

  struct Tracked {
    int body;
    Excursion excursion;
  };
  std::vector<Tracked> tracked;

  // tau at a sample, before the effort limits act.
  VectorXd Efforts(int sample, double t, const VectorXd& x) {
    const int nv = model_.nv();
    const double* q = x.data() + model_.layout().q();
    const double* qd = x.data() + model_.layout().qd();
    MatrixX<double> M;
    MassMatrix<double>(&ws_, q, &M);
    VectorXd bias(nv), qdd = VectorXd::Zero(nv);
    InverseDynamics<double>(&ws_, q, qd, qdd.data(), bias.data());
    std::vector<char> is_tracked(nv, 0);
    for (const Tracked& one : tracked) {
      const Body& body = model_.bodies()[one.body];
      // The effort holds over the period: the acceleration is its middle's.
      const JointMotion now = one.excursion.At(t);
      const JointMotion middle = one.excursion.At(t + 0.5 * period_);
      is_tracked[body.v_index] = 1;
      qdd[body.v_index] = middle.qdd + 2 * w_ * (now.qd - qd[body.v_index]) +
                          w_ * w_ * (now.q - q[body.q_index]);
    }
    std::vector<int> free, held;
    for (int i = 0; i < nv; ++i) (is_tracked[i] ? held : free).push_back(i);
    const VectorXd open = open_.row(sample);
    if (!free.empty()) {
      const VectorXd load = open(free) - bias(free) - M(free, held) * qdd(held);
      const VectorXd follows = Cholesky(M(free, free)).Solve(load);
      qdd(free) = follows;
    }
    VectorXd tau = open;
    const VectorXd all = M * qdd + bias;
    for (const int i : held) tau[i] = all[i];
    return tau;
  }

 private:
  const Model& model_;
  const RowMatrixXd& open_;
  double w_, period_;
  Workspace<double> ws_;
};

// What of the limits a motion does not keep; "" where it keeps all.
std::string Broken(const Model& model, const ComputedTorque& torque,
                   const RowMatrixXd& states, const VectorXd& overload,
                   double noise) {
  for (const ComputedTorque::Tracked& one : torque.tracked) {
    const Body& body = model.bodies()[one.body];
    const Joint joint = LimitedJoint(model, body);
    const auto q = states.col(model.layout().q(body));
    const auto qd = states.col(model.layout().qd(body));
    // A start beside a limit is not the excursion's fault.
    const double slack = 1e-3 * (joint.upper - joint.lower);
    if (q.minCoeff() < std::min(joint.lower + 3 * noise, q[0] - slack) ||
        q.maxCoeff() > std::max(joint.upper - 3 * noise, q[0] + slack)) {
      return "position limits of joint '" + joint.name + "', " +
             ShortestText(joint.lower) + " to " + ShortestText(joint.upper);
    }
    if (qd.cwiseAbs().maxCoeff() > VelocityLimit(joint)) {
      return "velocity limit of joint '" + joint.name + "', " +
             ShortestText(joint.velocity_limit);
    }
    if (overload[body.v_index] > EffortLimit(joint)) {
      return "effort limit of joint '" + joint.name + "', " +
             ShortestText(joint.effort_limit) + ", of which it takes " +
             RoundedText(overload[body.v_index]);
    }
  }
  return "";
}

void CheckStart(const Joint& joint, double q0) {
  if (q0 >= joint.lower && q0 <= joint.upper) return;
  throw InputError("--initial",
                   "joint '" + joint.name + "' starts at " + ShortestText(q0) +
                       ", outside of its limits " + ShortestText(joint.lower) +
                       " to " + ShortestText(joint.upper),
                   "start within them");
}

void AddEfforts(const Model& model, double level,
                const std::vector<Sines>& drawn, Run* run) {
  const std::vector<double> scale = WeightScale(model);
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    const Body& body = model.bodies()[b];
    if (VelocitySize(body) != 1) continue;
    const double amplitude = level * scale[b] * std::sqrt(2.0 / kSines);
    for (const Sine& sine : drawn[b]) {
      for (int k = 0; k < run->size(); ++k) {
        run->effort(k, body.v_index) +=
            amplitude * std::sin(sine.w * run->t[k] + sine.phase);
      }
    }
  }
}

}  // namespace

void AddMultisineEfforts(const Model& model, const MultisineOptions& options,
                         std::mt19937_64* random, Run* run) {
  AddEfforts(model, options.effort_level, DrawSines(model, options, random),
             run);
}

RowMatrixXd ExciteWithinLimits(const Model& model, const VectorXd& x0,
                               const MultisineOptions& options,
                               const MotionOptions& motion,
                               std::mt19937_64* random, Run* run) {
  constexpr double kSmaller = 0.8;
  constexpr int kMostTrials = 40;  // 0.8^40 = 1e-4
  const std::vector<Sines> drawn = DrawSines(model, options, random);
  AddEfforts(model, options.effort_level, drawn, run);
  const RowMatrixXd open = run->effort;
  const double period = run->t[1] - run->t[0];
  // Twice the band, and not beyond what a sampled loop can do (equation 5).
  const double w = std::min(2 * 2 * M_PI * options.highest, 0.5 / period);
  ComputedTorque torque(model, open, w, period);
  const std::vector<double> scale = WeightScale(model);
  Workspace<double> ws(model);
  MatrixX<double> M;
  MassMatrix<double>(&ws, x0.data() + model.layout().q(), &M);
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    const Body& body = model.bodies()[b];
    if (VelocitySize(body) != 1) continue;
    const Joint joint = LimitedJoint(model, body);
    if (!HasPositionLimits(joint)) continue;
    const double q0 = x0[model.layout().q(body)];
    CheckStart(joint, q0);
    // To accelerate takes no more than the open loop would have given.
    const double most_qdd = kCrest * options.effort_level * scale[b] /
                            M(body.v_index, body.v_index);
    torque.tracked.push_back(
        {static_cast<int>(b),
         Excursion(joint, q0, most_qdd, drawn[b], options, run->t)});
  }
  if (torque.tracked.empty()) return DrivenMotion(model, x0, motion, {}, run);
  VectorXd overload(model.nv());
  const DriveLaw drive = [&](int k, double t, const VectorXd& x,
                             Eigen::Ref<VectorXd> effort) {
    if (k == 0) overload.setZero();
    effort = torque.Efforts(k, t, x);
    for (const ComputedTorque::Tracked& one : torque.tracked) {
      const Body& body = model.bodies()[one.body];
      const double limit = EffortLimit(model.mechanism().joints[body.joint]);
      double& tau = effort[body.v_index];
      // A start that moves is braked with what there is.
      if (t >= one.excursion.blend_s()) {
        overload[body.v_index] =
            std::max(overload[body.v_index], std::abs(tau));
      }
      tau = std::clamp(tau, -limit, limit);
    }
  };
  std::string broken;
  const auto keeps = [&](RowMatrixXd* states) {
    *states = DrivenMotion(model, x0, motion, drive, run);
    broken = states->size() == 0
                 ? "motion finite"
                 : Broken(model, torque, *states, overload, options.noise);
    return broken.empty();
  };
  const auto shrink = [&](double factor) {
    for (auto& one : torque.tracked) one.excursion.Shrink(factor);
  };
  RowMatrixXd states;
  if (keeps(&states)) return states;
  // What does not keep them at rest never will.
  const std::vector<ComputedTorque::Tracked> tracked = torque.tracked;
  shrink(0.0);
  if (keeps(&states)) {
    torque.tracked = tracked;
    for (int trial = 0; trial < kMostTrials; ++trial) {
      shrink(kSmaller);
      if (keeps(&states)) return states;
    }
  }
  throw InputError("--excite",
                   "no excursion, however small, keeps the " + broken,
                   "start elsewhere (--initial), or give the URDF other limits "
                   "or masses");
}

}  // namespace sysid
