#include "tests/acceptance/hidden/plant.h"

#include <algorithm>
#include <cmath>

#include "models/internal_state.h"
#include "models/stepper.h"
#include "residuals/acting_inputs.h"

namespace sysid {
namespace {

class SysidPlant : public Plant {
 public:
  SysidPlant(const Model& model, double step)
      : model_(model),
        step_(step),
        ws_(model_),
        stepper_(Integrator::kRungeKutta4, &ws_) {}

  // Internal states of effects start with the first sample from there.
  void SetState(const Eigen::VectorXd& x) override {
    x_.setZero(model_.layout().size());
    x_.head(x.size()) = x;
    starts_ = true;
  }
  Eigen::VectorXd State() const override {
    return x_.head(model_.layout().z());
  }

  bool Advance(const Run& run, int sample) override {
    const double dt = run.t[sample + 1] - run.t[sample];
    const int steps =
        std::max(1, static_cast<int>(std::ceil(dt / step_ * (1 - 1e-9))));
    std::vector<double> held(model_.held_size());
    for (int s = 0; s < steps; ++s) {
      ActingInputs<double>(run, ws_, sample, run.t[sample] + dt * s / steps,
                           dt / steps, held.data());
      if (starts_) StartStates(&ws_, held.data(), x_.data());
      starts_ = false;
      if (!stepper_.Step(dt / steps, held.data(), x_.data())) return false;
    }
    return x_.allFinite();
  }

 private:
  const Model model_;
  double step_;
  Workspace<double> ws_;
  Stepper<double> stepper_;
  Eigen::VectorXd x_;
  bool starts_ = false;
};

}  // namespace

std::unique_ptr<Plant> MakeSysidPlant(const Model& with_effects, double step) {
  return std::make_unique<SysidPlant>(with_effects, step);
}

RowMatrixXd Move(Plant* plant, const Eigen::VectorXd& x0,
                 const Controller& controller, Run* run) {
  RowMatrixXd states(run->size(), x0.size());
  plant->SetState(x0);
  for (int k = 0;; ++k) {
    const Eigen::VectorXd x = plant->State();
    states.row(k) = x.transpose();
    if (controller) {
      controller(run->t[k], x, run->effort.data() + k * run->effort.cols());
    }
    if (k == run->size() - 1) return states;
    if (!plant->Advance(*run, k)) return {};
  }
}

RowMatrixXd MoveAccurately(
    const std::function<std::unique_ptr<Plant>(double step)>& make, double step,
    int halvings, double tolerance, const Eigen::VectorXd& x0,
    const Controller& controller, Run* run) {
  RowMatrixXd states;
  for (int i = 0; i <= halvings; ++i) {
    const std::unique_ptr<Plant> plant = make(step);
    RowMatrixXd finer = Move(plant.get(), x0, controller, run);
    const bool close = states.size() > 0 && finer.size() > 0 &&
                       (states - finer).cwiseAbs().maxCoeff() < tolerance;
    states = std::move(finer);
    if (close) break;
    step /= 2;
  }
  return states;
}

}  // namespace sysid
