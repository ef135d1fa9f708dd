#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// The model with what a recording of any machine may feel beside: viscous and
// Coulomb friction on every joint, a bias of every effort that acts; and the
// freedoms of the user's with theirs. So a missing friction is not taken for a
// fault of the data.
struct LooseModel {
  Model model;
  std::vector<FreeParameter> free;
};

// What a quick fit says of one reading of the data: how well the model with
// these freedoms can explain it at all.
struct QuickFit {
  // Times the noise, corrected for what was fitted; infinity where the model
  // cannot follow at all.
  double error = std::numeric_limits<double>::infinity();
  double dof = 1.0;
  std::vector<double> windows;  // the error of each, uncorrected
  double correlation = 1.0;  // autocorrelation time of the residuals, samples
  Solution point;
  std::vector<double> values;                      // of the free parameters
  std::shared_ptr<const ShootingProblem> problem;  // of the windows
};

// Few iterations from what the data alone say, on short segments: any model can
// follow so far, and what is hopeless shows already. `like` (may be null):
// a fit whose noise is used. The step is the options', or a sample's.
inline constexpr double kShortSegment = 0.15;  // s
inline constexpr int kShortIterations = 15;
QuickFit FitShort(const LooseModel& model, std::vector<Run> windows,
                  const EstimationOptions& options, int iterations,
                  const QuickFit* like);

// On whole windows, from the parameters of a short fit. Each window keeps a
// state of its own, so that what one piece lacks spoils no other.
QuickFit FitLong(const QuickFit& from);

// Both.
QuickFit FitQuickly(const LooseModel& model, std::vector<Run> windows,
                    const EstimationOptions& options);

// A fit of a reading that differs little, from where another ended: its
// segments, its noise.
QuickFit FitOn(const LooseModel& model, std::vector<Run> windows,
               const EstimationOptions& options, const QuickFit& like);

// Of the user's model and what is free of it.
LooseModel WithFriction(const Model& model,
                        const std::vector<FreeParameter>& free,
                        const std::vector<const Run*>& runs);

// The same with the mass, centre and inertia of every link free too.
LooseModel WithBodies(const LooseModel& lean);

// The same with a spring on every hinge and slide.
LooseModel WithSprings(const LooseModel& lean);

// And with a spring, the zero, an armature and a drag of every joint: all that
// a rigid body could be.
LooseModel WithEverything(const LooseModel& lean);

// The part of the windows in which `better` has a smaller error than `worse`
// times `factor`.
double PartImproved(const QuickFit& better, const QuickFit& worse,
                    double factor);

// Frees a parameter of the model by name from its nominal value, unless it is
// free already.
void FreeAlso(const Model& model, const std::string& name,
              std::vector<FreeParameter>* free);

}  // namespace sysid
