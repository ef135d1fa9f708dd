#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "models/integrator.h"
#include "models/model.h"
#include "residuals/channel_residual.h"
#include "residuals/costs.h"
#include "residuals/run.h"
#include "sysid/estimation/processes.h"
#include "sysid/io/channel_edits.h"
#include "sysid/io/column_map.h"
#include "sysid/parameters/fit_specification.h"

namespace sysid {

// How much of a recording is checked: --check.
enum class CheckLevel {
  kNone,
  kNumbers,  // what the numbers alone show: milliseconds
  kAll,      // and hypotheses about the data, where a fit misses them
};

// What is fitted to what, and how: plain values, which say what the flags of
// docs/interface.md section 1 say. Errors name the flag: "--free" is `free`. SI
// units. What is empty is not given: a specification may give it, or it is
// chosen.
struct FitRequest {
  // A shipped model's name, or a URDF file.
  std::string model;
  // A model in memory, with the effects that are in it; `model` is then only
  // its name in reports (empty: its mechanism's), and no file is read for it.
  std::shared_ptr<const Model> model_in_memory;

  // Recordings to fit: files, and then those in memory, of the model before any
  // joint is locked: effort samples x nv (none: no effort was recorded), times
  // that rise. One in memory that has no name gets one ("run 1").
  std::vector<std::string> traj;
  std::vector<Run> runs;
  // So too those that are only predicted.
  std::vector<std::string> holdout;
  std::vector<Run> holdout_runs;
  bool skip_bad_runs = false;  // sets files aside that cannot be read

  // A specification file (docs/specification.md); empty: the one beside the
  // model's file, where there is one.
  std::string spec;

  // Parameters to fit, from a value or from the model's, and to hold, at a
  // value or at the model's. Names, patterns ("link*.mass") and `inertial`.
  std::vector<NamedValue> free, fix;
  // Frees nothing, whatever a specification says, but what `add` names.
  bool free_none = false;
  // Effects to put into the model: names, patterns, laws ("custom@joint1:
  // -k*q").
  std::vector<std::string> add;
  // Effects that a diagnosis considers: names, kinds, patterns, laws; empty:
  // all of the catalogue.
  std::vector<std::string> candidates;
  // Joints held still, at a position (rad, m) or at zero.
  std::vector<NamedValue> lock;

  // How the recordings are read: the names of files' columns, and corrections
  // of all recordings.
  ColumnMap columns;
  std::vector<ChannelShift> shift;
  std::vector<IgnoredSpan> ignore;

  // One of Solvers() by name; empty: lm.
  std::string solver;
  std::optional<Integrator> integrator;
  std::optional<OrientationResidual> residual;
  std::optional<RobustLoss> loss;
  std::optional<RunStart> start;  // of all runs
  // Integration step, s; length of a shooting segment, s; standard deviation of
  // a measurement, rad or m. Positive.
  std::optional<double> step, segment, noise;
  int threads = 0;  // 0: all cores
  // Longest duration of the whole work, s: what there is by then is the result.
  std::optional<double> time;
  // Not given: all of it, and the numbers where several processes fit.
  std::optional<CheckLevel> check;

  // That share out the runs (each has those in memory that are its own); null:
  // one has all.
  std::shared_ptr<const Processes> processes;

  // Whether nothing need be free: a model is then compared as it stands.
  bool may_free_nothing = false;
  // Whether links without inertia are given one where their joints have nothing
  // else to move (AssumeInertia): a diagnosis may find what moves there.
  bool assumes_inertia = false;
  // Whether the caller has other solvers than lm.
  bool any_solver = false;
};

}  // namespace sysid
