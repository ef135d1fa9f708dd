#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "models/model.h"
#include "residuals/run.h"
#include "tests/acceptance/hidden/planted_effect.h"

namespace sysid {

// A mechanism that moves from sample to sample of a run, under the run's
// efforts. A controller may write the effort of a sample just before.
class Plant {
 public:
  virtual ~Plant() = default;
  // x = (q, qd) in our conventions.
  virtual void SetState(const Eigen::VectorXd& x) = 0;
  virtual Eigen::VectorXd State() const = 0;
  // From a sample of the run to the next; false where the motion is lost.
  virtual bool Advance(const Run& run, int sample) = 0;
};

// The library's dynamics with the library's effects, by Runge-Kutta steps of at
// most `step`, s.
std::unique_ptr<Plant> MakeSysidPlant(const Model& with_effects, double step);

struct MujocoPlantOptions {
  double step = 1e-3;  // s, RK4
  // > 0: Coulomb friction as MuJoCo's frictionloss, which sticks, with this
  // time constant (solreffriction, by default 0.02), s; 0: our smooth law.
  // MuJoCo's force is against the velocity that it expects half of that time
  // later: at the default the friction turns 10 ms before the joint does. On
  // spherical joints it would be a law for each axis.
  double friction_time = 0.0;
};

// MuJoCo's dynamics with the effects in its own terms where it has them
// (damping, stiffness, armature, gravity, bodies), else as forces that are
// evaluated in every stage of its steps. Shares nothing with the library's
// effects but their names. sensor_offset is the measurement's.
std::unique_ptr<Plant> MakeMujocoPlant(
    const Model& truth, const std::vector<PlantedEffect>& planted,
    const MujocoPlantOptions& options);

// Writes the efforts of a sample, nv numbers, from the state at it.
using Controller =
    std::function<void(double t, const Eigen::VectorXd& x, double* effort)>;

// Moves a plant from x0 through all samples of the run; `controller`, where
// there is one, fills run->effort. States at the samples; empty where the
// motion is lost.
RowMatrixXd Move(Plant* plant, const Eigen::VectorXd& x0,
                 const Controller& controller, Run* run);

// The same with plants made for steps that are halved, from `step`, until that
// changes no number of a state by more than the tolerance, at most `halvings`
// times. Empty where the motion is lost even so.
RowMatrixXd MoveAccurately(
    const std::function<std::unique_ptr<Plant>(double step)>& make, double step,
    int halvings, double tolerance, const Eigen::VectorXd& x0,
    const Controller& controller, Run* run);

}  // namespace sysid
