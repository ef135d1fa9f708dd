#include "sysid/stochastic/adam.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "models/error.h"

namespace sysid {

Schedule ParseSchedule(const std::string& name, const std::string& place) {
  const std::vector<std::string> names{"constant", "exponential", "cosine"};
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end()) {
    throw InputError(place, "unknown schedule '" + name + "'",
                     NameHint(name, names));
  }
  return static_cast<Schedule>(at - names.begin());
}

double LearningRate(const AdamOptions& options, int epoch) {
  const double done = double(epoch - 1) / options.epochs;
  switch (options.schedule) {
    case Schedule::kConstant:
      break;
    case Schedule::kExponential:
      return options.learning_rate * std::pow(0.01, done);
    case Schedule::kCosine:
      return options.learning_rate * 0.5 * (1.0 + std::cos(M_PI * done));
  }
  return options.learning_rate;
}

Adam::Adam(int size, const AdamOptions& options)
    : options_(options),
      m_(Eigen::ArrayXd::Zero(size)),
      s_(Eigen::ArrayXd::Zero(size)) {}

void Adam::Step(const Eigen::VectorXd& gradient, double learning_rate,
                Eigen::VectorXd* v) {
  ++steps_;
  m_ = options_.beta1 * m_ + (1.0 - options_.beta1) * gradient.array();
  s_ = options_.beta2 * s_ + (1.0 - options_.beta2) * gradient.array().square();
  const double m_scale = 1.0 / (1.0 - std::pow(options_.beta1, steps_));
  const double s_scale = 1.0 / (1.0 - std::pow(options_.beta2, steps_));
  v->array() -= learning_rate * (m_ * m_scale) /
                ((s_ * s_scale).sqrt() + options_.epsilon);
}

}  // namespace sysid
