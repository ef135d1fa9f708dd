#pragma once

#include <string>

#include "models/math/types.h"

namespace sysid {

// How the learning rate a_t falls over E epochs, t = 1 .. E.
enum class Schedule {
  kConstant,     // a
  kExponential,  // a 0.01^((t-1)/E)
  kCosine,       // a (1 + cos(pi (t-1)/E)) / 2
};
// By its name ("cosine"). Throws InputError at `place` for one that is none.
Schedule ParseSchedule(const std::string& name, const std::string& place);

struct AdamOptions {
  double learning_rate = 0.1;  // in units of v: parts of a parameter's size
  Schedule schedule = Schedule::kCosine;
  int epochs = 150;
  double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
};

double LearningRate(const AdamOptions& options, int epoch);

// Adam (Kingma and Ba 2015, algorithm 1), g the gradient at step t = 1, 2, ..:
//
//   m = beta1 m + (1 - beta1) g,    s = beta2 s + (1 - beta2) g^2
//   v = v - a_t (m / (1 - beta1^t)) / (sqrt(s / (1 - beta2^t)) + epsilon) (9.3)
class Adam {
 public:
  Adam(int size, const AdamOptions& options);

  void Step(const Eigen::VectorXd& gradient, double learning_rate,
            Eigen::VectorXd* v);
  int steps() const { return steps_; }

 private:
  AdamOptions options_;
  int steps_ = 0;
  Eigen::ArrayXd m_, s_;
};

}  // namespace sysid
