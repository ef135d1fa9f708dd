#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "glog/logging.h"
#include "models/internal_state-impl.h"
#include "models/internal_state.h"
#include "models/math/rosenbrock.h"

namespace sysid {

// Internal states z of effects that a motion was computed without, carried
// along it: q and qd are the motion's, as if no force of these effects changed
// it. States that the motion has are the motion's.
//
// Rates f(t, z) may be stiff (elastic drives), so a step h takes the L-stable
// Rosenbrock method of second order (ROS2; Verwer et al. 1999), with
// g = 1 - 1 / sqrt(2) and J = df/dz by differences:
//
//   (1 - g h J) k_1 = f(t, z) + g h f_t,
//   (1 - g h J) k_2 = f(t + h, z + h k_1) - 2 k_1 - g h f_t,
//   z(t + h) = z + h (3 k_1 + k_2) / 2,   h f_t = f(t + h, z) - f(t, z).
template <typename T>
class CarriedStates {
 public:
  // The workspace, of the model with the effects, must outlive it. `from` is
  // the motion's model.
  CarriedStates(const Model& from, Workspace<T>* ws)
      : ws_(ws), same_(SameStates(from, ws->model())) {
    const auto& known = from.effects().states();
    for (const EffectState& own : ws->model().effects().states()) {
      const auto same = std::find_if(
          known.begin(), known.end(),
          [&](const EffectState& other) { return other.name == own.name; });
      known_.push_back(
          same == known.end() ? -1 : static_cast<int>(same - known.begin()));
    }
    const int nz = ws->model().layout().nz();
    for (const auto& effect : ws->state_effects) has_rates_ |= !effect.moves;
    for (const auto& effect : ws->state_effects) {
      CHECK_LE(effect.states, kMostStates);
      J_.push_back(Small::Zero(effect.states, effect.states));
    }
    for (std::vector<T>* numbers : {&f_, &f_next_, &k_1_, &k_2_, &moved_}) {
      numbers->resize(nz);
    }
  }

  // Starts at a state of the motion's model; x, of the workspace's, follows.
  void Start(const double* motion, T* x) const {
    SetMotion(motion, x);
    if (!same_) internal::StartStatesAt<T>(ws_, ws_->nothing.data(), x);
    UseMotion(motion, x);
  }

  // From x at a sample: x halfway to the next, and there, h later; `held` acts
  // meanwhile.
  void Carry(const T* x, const double* motion_middle, const double* motion_next,
             double h, const T* held, T* middle, T* next) {
    const StateLayout& at = ws_->model().layout();
    SetMotion(motion_middle, middle);
    SetMotion(motion_next, next);
    if (at.nz() == 0) return;
    if (!same_) {
      std::copy_n(x + at.z(), at.nz(), next + at.z());
      if (has_rates_) StepRates(x, h, held, next);
      for (int i = at.z(); i < at.size(); ++i) {
        middle[i] = 0.5 * (x[i] + next[i]);
      }
      internal::MoveStatesFrom<T>(*ws_, x, middle);
      internal::MoveStatesFrom<T>(*ws_, middle, next);
    }
    UseMotion(motion_middle, middle);
    UseMotion(motion_next, next);
  }

 private:
  // Of a state's typical size, for J: far above rounding, far below the size.
  // The method keeps its order with any J.
  static constexpr double kMove = 1e-6;
  // Of one effect, so that a step allocates nothing; those shipped have two.
  static constexpr int kMostStates = 8;
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0,
                              kMostStates, kMostStates>;

  void SetMotion(const double* motion, T* x) const {
    for (int i = 0; i < ws_->model().layout().z(); ++i) x[i] = T(motion[i]);
  }
  // States that the motion has.
  void UseMotion(const double* motion, T* x) const {
    const int first = ws_->model().layout().z();
    for (size_t i = 0; i < known_.size(); ++i) {
      if (known_[i] >= 0) x[first + i] = T(motion[first + known_[i]]);
    }
  }
  void Rates(const T* x, const T* z, const T* held, T* f) {
    const StateLayout& at = ws_->model().layout();
    ws_->z = z;
    internal::Hold<T>(ws_, x + at.q(), x + at.qd(), held);
    internal::StateRates<T>(*ws_, x + at.q(), x + at.qd(), f);
  }

  // The z of x, as they are at `from`, h later.
  void StepRates(const T* from, double h, const T* held, T* x) {
    const StateLayout& at = ws_->model().layout();
    const int nz = at.nz();
    const double g = kRosenbrockGamma;
    T* z = x + at.z();
    Rates(from, z, held, f_.data());
    Rates(x, z, held, f_next_.data());
    Differentiate(x, z, held);
    Invert(g * h);
    for (int i = 0; i < nz; ++i) {
      k_1_[i] = f_[i] + g * (f_next_[i] - f_[i]);
    }
    Solve(&k_1_);
    for (int i = 0; i < nz; ++i) moved_[i] = z[i] + h * k_1_[i];
    Rates(x, moved_.data(), held, k_2_.data());
    for (int i = 0; i < nz; ++i) {
      k_2_[i] -= 2.0 * k_1_[i] + g * (f_next_[i] - f_[i]);
    }
    Solve(&k_2_);
    for (int i = 0; i < nz; ++i) z[i] += 0.5 * h * (3.0 * k_1_[i] + k_2_[i]);
  }

  // J of each effect, at z: the j-th states of all are moved together.
  void Differentiate(const T* x, const T* z, const T* held) {
    const auto& states = ws_->model().effects().states();
    for (int j = 0;; ++j) {
      std::copy_n(z, moved_.size(), moved_.begin());
      bool more = false;
      for (const auto& effect : ws_->state_effects) {
        if (effect.moves || j >= effect.states) continue;
        const int place = effect.first_z + j;
        moved_[place] += kMove * states[place].typical_scale;
        more = true;
      }
      if (!more) return;
      Rates(x, moved_.data(), held, k_2_.data());
      for (size_t e = 0; e < J_.size(); ++e) {
        const auto& effect = ws_->state_effects[e];
        if (effect.moves || j >= effect.states) continue;
        const double move = kMove * states[effect.first_z + j].typical_scale;
        for (int i = 0; i < effect.states; ++i) {
          const int row = effect.first_z + i;
          J_[e](i, j) = (ValueOf(k_2_[row]) - ValueOf(f_next_[row])) / move;
        }
      }
    }
  }

  // (1 - gh J)^-1 of each effect.
  void Invert(double gh) {
    for (size_t e = 0; e < J_.size(); ++e) {
      if (ws_->state_effects[e].moves) continue;
      Small& J = J_[e];
      J *= -gh;
      J.diagonal().array() += 1.0;
      if (J.rows() == 2) {
        J = Eigen::Matrix2d(J).inverse().eval();
      } else {
        J = J.inverse().eval();
      }
    }
  }

  void Solve(std::vector<T>* k) const {
    T solved[kMostStates];
    for (size_t e = 0; e < J_.size(); ++e) {
      const auto& effect = ws_->state_effects[e];
      if (effect.moves) continue;
      for (int i = 0; i < effect.states; ++i) {
        solved[i] = T(0.0);
        for (int j = 0; j < effect.states; ++j) {
          solved[i] += J_[e](i, j) * (*k)[effect.first_z + j];
        }
      }
      std::copy_n(solved, effect.states, k->begin() + effect.first_z);
    }
  }

  Workspace<T>* ws_;
  bool same_, has_rates_ = false;
  std::vector<int> known_;  // of each state, its place in the motion's; or -1
  std::vector<T> f_, f_next_, k_1_, k_2_, moved_;
  std::vector<Small> J_;  // of each effect with states; then (1 - g h J)^-1
};

}  // namespace sysid
