#pragma once

#include <string>

#include "sysid/session/session.h"
#include "sysid/stochastic/comparison.h"

namespace sysid {

// A comparison of solvers as people and programs read it.

// Tables for the terminal.
std::string ComparisonText(const Session& session,
                           const Comparison& comparison);

// Schema sysid.comparison/1; numbers finite or null.
std::string ComparisonJson(const Session& session,
                           const Comparison& comparison);

// SVG: the loss against iteration and against time, the path of each parameter
// with the mixture's deviation shaded, and of two parameters the likelihood on
// a grid with what each solver says of it.
std::string ComparisonFigure(const Session& session,
                             const Comparison& comparison);

// The solver's name in words: "Levenberg-Marquardt".
std::string SolverTitle(const std::string& solver);

}  // namespace sysid
