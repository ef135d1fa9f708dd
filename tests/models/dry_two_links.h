#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "tests/support/dynamics_calls.h"

namespace sysid {

// Two links in a plane, hanging at q = 0; two_links.
struct TwoLinks {
  static constexpr double kMass1 = 1.3, kMass2 = 0.8, kCom1 = 0.22,
                          kCom2 = 0.18, kLength = 0.45, kInertia1 = 0.03,
                          kInertia2 = 0.015;

  static Mechanism Make() {
    Mechanism mechanism;
    mechanism.AddRoot("base");
    mechanism.AddJoint(
        MakeJoint("joint1", JointType::kRevolute, 0, Eigen::Vector3d::UnitY()),
        "link1", Eigen::Vector3d::Zero(),
        Body(kMass1, Eigen::Vector3d(0, 0, -kCom1),
             Eigen::Vector3d(0.03, kInertia1, 0.01)));
    mechanism.AddJoint(
        MakeJoint("joint2", JointType::kRevolute, 1, Eigen::Vector3d::UnitY()),
        "link2", Eigen::Vector3d(0, 0, -kLength),
        Body(kMass2, Eigen::Vector3d(0, 0, -kCom2),
             Eigen::Vector3d(0.015, kInertia2, 0.01)));
    return mechanism;
  }
};

// They with dry friction, by the textbook's equations of motion and steps of
// 50 us to each event: found by halving, and who rests by trying every
// combination. Levels by |qd|, of each joint.
class DryTwoLinks {
 public:
  using Level = std::function<double(int, double)>;
  explicit DryTwoLinks(Level level) : level_(std::move(level)) {}

  void Advance(double h, const Eigen::Vector2d& tau, Eigen::Vector4d* x) const {
    double left = h;
    while (left > 0.0) {
      const double step = std::min(left, 5e-5);
      const std::array<int, 2> modes = Decide(*x, tau);
      const auto ends_well = [&](double part) {
        const Eigen::Vector4d y = Step(*x, tau, modes, part);
        for (int j = 0; j < 2; ++j) {
          if (modes[j] != 0 && y[2 + j] * modes[j] < 0) return false;
          if (modes[j] == 0 &&
              std::abs(Needed(y, tau, modes)[j]) > level_(j, 0.0)) {
            return false;
          }
        }
        return true;
      };
      double part = step;
      if (!ends_well(step)) {
        double low = 0.0;
        while (part - low > 1e-15) {
          const double middle = 0.5 * (low + part);
          (ends_well(middle) ? low : part) = middle;
        }
      }
      const Eigen::Vector4d y = Step(*x, tau, modes, part);
      for (int j = 0; j < 2; ++j) {
        (*x)[j] = y[j];
        const bool stopped = modes[j] == 0 || y[2 + j] * modes[j] <= 0;
        (*x)[2 + j] = stopped ? 0.0 : y[2 + j];
      }
      left -= part;
    }
  }

 private:
  using Modes = std::array<int, 2>;

  static Eigen::Matrix2d Inertia(const Eigen::Vector4d& x) {
    using S = TwoLinks;
    const double coupled = S::kMass2 * S::kLength * S::kCom2 * std::cos(x[1]);
    const double outer = S::kInertia2 + S::kMass2 * S::kCom2 * S::kCom2;
    Eigen::Matrix2d M;
    M(0, 0) = S::kInertia1 + S::kMass1 * S::kCom1 * S::kCom1 + outer +
              S::kMass2 * S::kLength * S::kLength + 2 * coupled;
    M(0, 1) = M(1, 0) = outer + coupled;
    M(1, 1) = outer;
    return M;
  }
  // What moves the joints, without friction.
  static Eigen::Vector2d Drive(const Eigen::Vector4d& x,
                               const Eigen::Vector2d& tau) {
    using S = TwoLinks;
    const double h = S::kMass2 * S::kLength * S::kCom2 * std::sin(x[1]);
    const double outer = S::kMass2 * S::kCom2 * 9.81 * std::sin(x[0] + x[1]);
    const double inner =
        (S::kMass1 * S::kCom1 + S::kMass2 * S::kLength) * 9.81 * std::sin(x[0]);
    return tau + Eigen::Vector2d(h * x[3] * (2 * x[2] + x[3]) - inner - outer,
                                 -h * x[2] * x[2] - outer);
  }
  Eigen::Vector2d Slipping(const Eigen::Vector4d& x, const Modes& modes) const {
    return {-modes[0] * level_(0, std::abs(x[2])),
            -modes[1] * level_(1, std::abs(x[3]))};
  }
  Eigen::Vector2d Acceleration(const Eigen::Vector4d& x,
                               const Eigen::Vector2d& tau,
                               const Modes& modes) const {
    const Eigen::Matrix2d M = Inertia(x);
    const Eigen::Vector2d f = Drive(x, tau) + Slipping(x, modes);
    if (modes[0] == 0 && modes[1] == 0) return {0.0, 0.0};
    if (modes[0] == 0) return {0.0, f[1] / M(1, 1)};
    if (modes[1] == 0) return {f[0] / M(0, 0), 0.0};
    return M.inverse() * f;
  }
  // The friction that the accelerations need.
  Eigen::Vector2d Needed(const Eigen::Vector4d& x, const Eigen::Vector2d& tau,
                         const Modes& modes) const {
    return Inertia(x) * Acceleration(x, tau, modes) - Drive(x, tau);
  }
  Eigen::Vector4d Rate(const Eigen::Vector4d& x, const Eigen::Vector2d& tau,
                       const Modes& modes) const {
    Eigen::Vector4d f;
    f << x.tail<2>(), Acceleration(x, tau, modes);
    return f;
  }
  Eigen::Vector4d Step(const Eigen::Vector4d& x, const Eigen::Vector2d& tau,
                       const Modes& modes, double h) const {
    const Eigen::Vector4d a = Rate(x, tau, modes);
    const Eigen::Vector4d b = Rate(x + 0.5 * h * a, tau, modes);
    const Eigen::Vector4d c = Rate(x + 0.5 * h * b, tau, modes);
    const Eigen::Vector4d d = Rate(x + h * c, tau, modes);
    return x + h / 6 * (a + 2 * b + 2 * c + d);
  }
  Modes Decide(const Eigen::Vector4d& x, const Eigen::Vector2d& tau) const {
    Modes best{};
    double least = 1e300;
    for (int code = 0; code < 9; ++code) {
      const Modes modes{code % 3 - 1, code / 3 - 1};
      double wrong = 0.0;
      const Eigen::Vector2d qdd = Acceleration(x, tau, modes);
      const Eigen::Vector2d needed = Needed(x, tau, modes);
      for (int j = 0; j < 2; ++j) {
        if (x[2 + j] != 0) {
          if (modes[j] * x[2 + j] <= 0) wrong += 1e6;
        } else if (modes[j] == 0) {
          wrong += std::max(0.0, std::abs(needed[j]) - level_(j, 0.0));
        } else {
          wrong += std::max(0.0, -modes[j] * qdd[j]);
        }
      }
      if (wrong < least) {
        least = wrong;
        best = modes;
      }
    }
    return best;
  }

  Level level_;
};

}  // namespace sysid
