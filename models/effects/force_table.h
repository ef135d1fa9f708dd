#pragma once

#include <array>
#include <cmath>
#include <string>

#include "models/effects/effect.h"

namespace sysid {

// A generalised force that is a smooth table over the position and the velocity
// of a hinge or slide: it closes the gap between a model and a machine, for a
// simulation or a feed-forward. It explains nothing, and no diagnosis names it.
//
// Knots: x_i = (q - from) / (to - from) (n - 1), i = 0..n-1, evenly spaced; the
// speeds are closer together near rest, where friction turns over:
//   y = (n - 1)/2 (1 + asinh(b qd / speed) / asinh(b)).                  (E.1)
// Between knots cubic convolution (Keys 1981), continuous with its slope: with
// t in [0, 1) past knot i the weights of knots i-1 .. i+2 are
//   -t/2 + t^2 - t^3/2,  1 - 5/2 t^2 + 3/2 t^3,
//   t/2 + 2 t^2 - 3/2 t^3,  -t^2/2 + t^3/2,                              (E.2)
// a knot beyond the ends being 2 f_0 - f_1. Outside of the table x and y run
// into end + tanh(x - end), so that the force stays bounded and smooth. A table
// of a continuous joint over a whole turn is periodic; over less it is that of
// the nearest turn.
//
// Values at knots are F = L_q W L_qd', W the parameters and L L' the
// correlation of Matern (3/2) over two knots: with W independent of equal size,
// which is the prior that a fit gives them (sysid/session/table_range.h), F is
// smooth, and cells without data follow from their neighbours. The shapes L_0,
// L_1, .. of an axis come by their weight: from flat to rough.
class ForceTable : public EffectOf<ForceTable> {
 public:
  static constexpr char kName[] = "force_table";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "a smooth table over q and qd";
  static constexpr char kShowsIn[] = "motion through all positions and speeds";
  static constexpr bool kOnlyNamed = true;
  static constexpr int kKnots = 7;
  static constexpr int kWeights = kKnots * kKnots;
  // Places of the range among the parameters: how far it reaches below and
  // above position 0, and the speed at its ends.
  static constexpr int kBelow = kWeights, kAbove = kWeights + 1;
  static constexpr int kSpeed = kWeights + 2;
  // b of (E.1): the knot beside rest is at an eighth of the largest speed.
  static constexpr double kNearRest = 10.0;

  ForceTable(const Mechanism& mechanism, const std::string& joint);

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    const bool periodic = joint.type == JointType::kContinuous &&
                          IsTurn(ValueOf(p[kBelow]), ValueOf(p[kAbove]));
    std::array<T, kKnots> by_q, by_qd;
    WeighPositions(joint, p, periodic, &by_q);
    WeighSpeeds(joint.qd[0], p[kSpeed], &by_qd);
    for (int i = 0; i < kKnots; ++i) {
      T sum = T(0.0);
      for (int j = 0; j < kKnots; ++j) sum += p[i * kKnots + j] * by_qd[j];
      tau[0] += by_q[i] * sum;
    }
  }

  // The speed at y in [-1, 1] of the way through the knots of (E.1).
  static double SpeedAt(double y, double speed) {
    return speed * std::sinh(y * std::asinh(kNearRest)) / kNearRest;
  }
  // A range over which a continuous joint's table is periodic.
  static bool IsTurn(double below, double above);

 private:
  using Shapes = std::array<std::array<double, kKnots>, kKnots>;  // [knot][k]

  // (E.2) of all knots at x, in knots from the first.
  template <typename T>
  static void WeighKnots(const T& x, bool periodic, std::array<T, kKnots>* w) {
    w->fill(T(0.0));
    int i = static_cast<int>(std::floor(ValueOf(x)));
    if (!periodic) i = i < 0 ? 0 : i > kKnots - 2 ? kKnots - 2 : i;
    const T t = x - static_cast<double>(i);
    // Beyond the ends along the slope there.
    const bool before = !periodic && ValueOf(t) < 0.0;
    const bool beyond = !periodic && ValueOf(t) > 1.0;
    const T in = before ? T(0.0) : beyond ? T(1.0) : t;
    const T in2 = in * in, in3 = in2 * in;
    std::array<T, 4> c = {
        -0.5 * in + in2 - 0.5 * in3, 1.0 - 2.5 * in2 + 1.5 * in3,
        0.5 * in + 2.0 * in2 - 1.5 * in3, -0.5 * in2 + 0.5 * in3};
    if (before || beyond) {
      const T out = t - in;
      const int first = before ? 0 : 1;
      c[first] -= 0.5 * out;
      c[first + 2] += 0.5 * out;
    }
    for (int k = 0; k < 4; ++k) {
      const int knot = i - 1 + k;
      if (periodic) {
        (*w)[((knot % kKnots) + kKnots) % kKnots] += c[k];
      } else if (knot < 0) {
        (*w)[0] += 2.0 * c[k];
        (*w)[1] -= c[k];
      } else if (knot >= kKnots) {
        (*w)[kKnots - 1] += 2.0 * c[k];
        (*w)[kKnots - 2] -= c[k];
      } else {
        (*w)[knot] += c[k];
      }
    }
  }

  // How much of each shape is there.
  template <typename T>
  static void Weigh(const std::array<T, kKnots>& knots, const Shapes& shapes,
                    std::array<T, kKnots>* w) {
    for (int k = 0; k < kKnots; ++k) {
      (*w)[k] = T(0.0);
      for (int i = 0; i < kKnots; ++i) (*w)[k] += knots[i] * shapes[i][k];
    }
  }

  template <typename T>
  static T Bounded(const T& x) {
    using std::tanh;
    constexpr double kEnd = kKnots - 1;
    if (ValueOf(x) < 0.0) return tanh(x);
    return ValueOf(x) > kEnd ? T(kEnd + tanh(x - kEnd)) : x;
  }

  template <typename T>
  void WeighPositions(const JointState<T>& joint, const T* p, bool periodic,
                      std::array<T, kKnots>* w) const {
    std::array<T, kKnots> knots;
    const T span = p[kAbove] + p[kBelow];
    T from = joint.q[0] + p[kBelow];
    if (joint.type == JointType::kContinuous) {
      const double middle = 0.5 * ValueOf(span);
      from -= 2 * M_PI * std::round((ValueOf(from) - middle) / (2 * M_PI));
    }
    if (periodic) {
      WeighKnots<T>(from * (kKnots / (2 * M_PI)), true, &knots);
    } else {
      WeighKnots<T>(Bounded<T>(from / span * double{kKnots - 1}), false,
                    &knots);
    }
    Weigh<T>(knots, periodic ? turning_ : straight_, w);
  }

  template <typename T>
  void WeighSpeeds(const T& qd, const T& speed,
                   std::array<T, kKnots>* w) const {
    using std::log;
    using std::sqrt;
    std::array<T, kKnots> knots;
    // asinh, which not every scalar has, by its definition for |x|.
    const T x = qd * kNearRest / speed;
    const T size = ValueOf(x) < 0.0 ? T(-x) : x;
    const T up = log(size + sqrt(size * size + 1.0)) / std::asinh(kNearRest);
    const T y = ValueOf(x) < 0.0 ? T(-up) : up;
    WeighKnots<T>(Bounded<T>(0.5 * (kKnots - 1) * (y + 1.0)), false, &knots);
    Weigh<T>(knots, straight_, w);
  }

  Shapes straight_, turning_;
};

}  // namespace sysid
