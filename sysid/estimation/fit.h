#pragma once

#include <limits>
#include <map>
#include <string>
#include <vector>

#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/estimates.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/shooting_stage.h"

namespace sysid {

// What the inverse dynamics leave of the measured efforts of a joint, N m or N,
// and in % of their root mean square.
struct EffortError {
  std::string joint;
  double rms = 0.0, percent = 0.0;
};

// What the model misses of a joint, as a random force (docs/theory.md, 6.6):
// its standard deviation, N m or N, and the time after which it is correlated
// by 1/e.
struct Discrepancy {
  std::string joint;
  double force_std = 0.0, correlation_time_s = 0.0;
};

// A combination of parameters that the equations of motion determine, by the
// names of sysid/inverse_dynamics/coordinates.h.
struct BaseParameter {
  struct Term {
    std::string name;
    double factor;
  };
  std::vector<Term> terms;  // the first has factor 1
  std::string unit;
  double value = 0.0, std_error = 0.0;
};

// What an estimator found: the parameters, and how it came to them.
struct Fit : Estimates {
  std::string solver = "lm";
  bool converged = false;
  std::string termination;                    // in words; where it failed: why
  StoppedBy stopped_by = StoppedBy::kNobody;  // then it has not converged
  int iterations = 0;
  // That ended by themselves: of what was stopped in the first, none.
  int stages = 0;
  // Times that all data was rolled out, with or without derivatives.
  int evaluations = 0;
  // Of the fit; a program makes it its own, and all threads' processor time.
  double wall_time_s = 0.0, cpu_time_s = 0.0;
  int processes = 0;              // that MPI started for it; 0 without MPI
  double step_s = 0.0;            // longest integration step
  double segment_s = 0.0;         // mean length of the last stage's segments
  double defect = kJoinedDefect;  // how tightly they hang together
  int samples = 0;
  double noise = 0.0;

  RunErrors train;
  std::vector<HorizonError> horizon;
  std::vector<OpenError> open;
  std::vector<HistoryEntry> history;
  std::vector<EffortError> effort;  // where efforts were measured
  // Of the filter of efforts and equations of motion, Hz; 0 where neither was
  // looked at.
  double cut_off_hz = 0.0;
  // No efforts were measured and inverse_dynamics tells ratios only; the scale
  // is then held, or not free.
  bool only_ratios = false, holds_scale = false;
  std::vector<BaseParameter> base;  // of inverse_dynamics and lm
  // Of the joints where a force is missing; with it the covariance is (6.7).
  std::vector<Discrepancy> discrepancy;
  // What the channels were weighed by at the end (ShootingProblem::Weighing).
  std::map<std::string, double> misfit;

  Solution point;
  Model model;  // with the estimates as nominal values

  explicit Fit(const Model& m) : model(m) {}
};

// Ceres' Levenberg-Marquardt over multiple-shooting segments that grow: short
// and loosely joined first, then the last length, tightly joined (one
// trajectory of the model a run). Covariance from the Jacobian with the states
// eliminated.
//
// The covariance is that of white noise of the problem's sigma, times the
// reduced chi-square where that is above 1 (a model that misses the data by
// eight times the noise knows its parameters eight times worse), times the
// autocorrelation time of the residuals: what is missing pulls the same way for
// many samples.
//
// Never throws for numerics: Fit::converged and termination say what happened.
// Throws Cancelled, as all fits and diagnoses do, where EstimationOptions::stop
// asks for it; with keep_best only before the first step that was taken.
Fit FitLevenbergMarquardt(const ShootingProblem& problem);

// The same from parameters that are known to predict independent segments of
// `length` seconds, as a search found them: states first, then joined. Short
// segments would move the parameters to where a long run is in a wrong
// frequency.
Fit FitLevenbergMarquardtFrom(const ShootingProblem& problem, double length);

// The same without joining the segments of the last length: each keeps a state
// of its own. What the model lacks then spoils no more than the length of a
// segment, so that such a fit converges where one trajectory does not exist,
// and its errors are those of prediction over that length, as held-out runs are
// judged. `horizon` and `open` stay empty. Segments that are chosen from the
// data are no longer than `longest` seconds.
Fit FitIndependentSegments(
    const ShootingProblem& problem,
    double longest = std::numeric_limits<double>::infinity());

// The states alone, of independent segments cut like `cut`, with the parameters
// where the problem starts.
Fit StatesAtStart(const ShootingProblem& problem, const Solution& cut);

// The same from a point that is cut already, in one stage: for models that
// differ little from one that was fitted.
Fit RefitIndependentSegments(const ShootingProblem& problem,
                             const Solution& start);

// Whether a parameter ended at its bound.
bool HasBound(const Fit& fit);
// Whether a fit did not converge, or has such a parameter.
bool IsDoubtful(const Fit& fit);

// Fills in what a fit says of the point where it ended: the model, errors,
// parameters with their uncertainty, what the data does not determine, step and
// segments. `fitted` numbers were fitted to the runs. Linearised with the
// fit's own defect, with steps of `tangent_step` (ShootingSegment); where the
// dynamics fail there it has not converged.
void SummarizeFit(const ShootingProblem& problem, const Solution& point,
                  double fitted, Fit* fit, double tangent_step = 0.0);

}  // namespace sysid
