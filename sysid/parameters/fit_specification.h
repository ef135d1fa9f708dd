#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sysid/io/channel_edits.h"
#include "sysid/io/column_map.h"
#include "sysid/parameters/free_parameter.h"

namespace sysid {

// A value and where it was read ("fit.yaml:3:5"), for errors that come later.
template <typename T>
struct Located {
  T value{};
  std::string place;
};

// A parameter that is to have a value; empty: that of the model. Requests in
// code need no place.
struct NamedValue {
  std::string name;
  std::optional<double> value = {};
  std::string place = {};
};

// What a fit is asked to do, as written (docs/specification.md). Names
// are not checked against a model here. SI units. What the file does not say is
// empty.
struct FitSpecification {
  struct Free {
    std::string name;  // "link1.length"
    std::optional<double> initial, lower, upper;
    std::optional<FreeParameter::Prior> prior;
    std::string place;  // of the name
  };

  std::string path;  // the file; empty where there is none
  // A shipped model's name as it is; a path resolved against the file's folder.
  std::optional<Located<std::string>> model;
  std::vector<Free> free;  // in the order of the file, as all that follow
  std::vector<NamedValue> fix;
  std::vector<NamedValue> lock;  // joints or patterns of them, and positions
  std::vector<Located<std::string>> effects;  // "coulomb_friction@joint1"
  ColumnMap columns;
  ChannelEdits edits;                      // `shift` and `ignore`
  std::optional<Located<double>> noise;    // > 0
  std::optional<Located<double>> step;     // s, > 0
  std::optional<Located<double>> segment;  // s, > 0
  // Each one of its KnownWords().
  std::optional<Located<std::string>> integrator, residual, solver, loss, start;
  std::optional<double> loss_scale;  // > 0; residuals are in units of the noise
};

// The words that a flag and key may have: of integrator, residual, solver, loss
// and start.
const std::vector<std::string>& KnownWords(const std::string& key);

// Reads a specification. An empty file is an empty specification. `free` is a
// map of names to {initial, lower, upper, prior: {mean, std}} (all optional),
// or a list of names; `fix` a map of names to numbers, or a list of names;
// `lock` is as `fix`, of joints and patterns of their names;
// `loss` a name or {name, scale}; `shift` and `ignore` are texts as on the
// flags (channel_edits.h).
//
// Throws InputError with file, line and column for anything else: unknown keys
// at any level (with the nearest known), keys given twice, values of the wrong
// type, text that is not YAML, lower >= upper, an initial value outside its
// bounds, a standard deviation, noise, step, segment or scale that is not
// positive, an integrator, residual, solver, loss or start that there is not.
FitSpecification ReadFitSpecification(const std::string& path);

// The same from text; `path` names it in errors and resolves `model`.
FitSpecification ParseFitSpecification(const std::string& path,
                                       const std::string& text);

}  // namespace sysid
