#pragma once

#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "models/effects/effect.h"
#include "sysid/linearization/linearized_fit.h"

namespace sysid {

// What candidate effects would do to the errors of a fit: the columns A of
// (7.3).

// A candidate effect, off, in the fitted model.
struct Candidate {
  std::shared_ptr<const Effect> effect;
  // Its own, as they are in `model`, then those of the mechanism that it
  // adjusts and that are not free.
  std::vector<Parameter> parameters;
  std::vector<ProbeSet> sets;  // of own parameters; one empty set if none
  Model model;                 // fitted, with the effect in it

  size_t own() const { return effect->parameters().size(); }
  // Of a set: its probes, then the adjusted parameters.
  int columns(int set) const {
    return static_cast<int>(sets[set].size() + parameters.size() - own());
  }
  // The parameter by which a column of a set is a derivative.
  size_t ParameterOf(int set, int column) const {
    const size_t probes = sets[set].size(), i = column;
    return i < probes ? sets[set][i].along : own() + i - probes;
  }
  // Whether p is an own parameter along which no probe is: it is found by other
  // means.
  bool IsSearched(size_t p) const {
    return p < own() &&
           std::none_of(sets.front().begin(), sets.front().end(),
                        [&](const Probe& probe) {
                          return probe.along == static_cast<int>(p);
                        });
  }
  // Whether some parameter comes out of several probes together.
  bool ComesOfAllProbes() const {
    for (size_t p = 0; p < own(); ++p) {
      if (IsSearched(p) && effect->parameters()[p].grid.empty()) return true;
    }
    return false;
  }
  // Own parameters where a probe looks: what is searched as the probe has it,
  // the others as the model has them (null, or the values of an effect that
  // this one replaces).
  std::vector<double> At(const Probe& probe) const {
    std::vector<double> values;
    for (size_t p = 0; p < own(); ++p) {
      values.push_back(IsSearched(p) ? probe.at[p] : parameters[p].nominal);
    }
    return values;
  }

  explicit Candidate(const Model& m) : model(m) {}
};

// Those of the effects that the fitted model does not have and that do not move
// only `taken` parameters (by name).
std::vector<Candidate> MakeCandidates(
    const Model& fitted,
    const std::vector<std::shared_ptr<const Effect>>& effects,
    const std::set<std::string>& taken);

// One of the sets of a candidate, by their places.
struct CandidateSet {
  int candidate, set;
};

// Whether a candidate's law is far from linear over the change that matters: on
// a spherical joint whose link is thin, whatever turns it about its own axis is
// soon saturated. A friction stops that spin long before the derivative at null
// would have it.
bool Saturates(const Candidate& candidate);

// The columns of these sets, one after the other: rows x columns for each
// segment, whitened. Exact derivatives, or where a law is far from linear over
// the change that matters, secants.
std::vector<Eigen::MatrixXd> RespondToCandidates(
    const LinearizedFit& fit, const Model& fitted,
    const std::vector<Candidate>& candidates,
    const std::vector<CandidateSet>& sets);

}  // namespace sysid
