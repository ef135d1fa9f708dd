#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sysid/diagnosis/diagnose.h"
#include "sysid/session/session.h"

namespace sysid {

// Which recording would decide between the rivals of a diagnosis (Hunter and
// Reiner 1965; Box and Hill 1967).
//
// A motion is simulated with rival i at its estimates. What rival j leaves of
// it, over segments as long as those by which the diagnosis judges, after a fit
// of their states x and of its parameters theta, which the recordings have
// already told to within Sigma_j = L_j L_j',
//
//   lambda_ij = min over dx, z  |(r + J_x dx + J_theta L_j z) / s|^2 + |z|^2,
//                                                                       (7.16)
//
// r the whitened difference of their predictions, J its derivatives, s the
// larger of the two models' errors over the noise (1 at least), is the expected
// logarithm of the likelihood ratio, doubled. That has the variance 4
// lambda_ij, so that the likelier of the two is the right one with the
// probability Phi(sqrt(lambda_ij) / 2).
struct NextExperiment {
  // Flags of sysid_simulate that make the motion, beside --model: names and
  // values, with the first rival's estimates.
  std::vector<std::pair<std::string, std::string>> flags;
  // That the likelier of two rivals is the right one, if one of them is: the
  // least of any two, but for those that look alike in all of the motions.
  double probability = 0.0;
  std::vector<std::vector<std::string>> alike;  // groups of rivals
  bool one_fits = false;  // whether a rival reaches the noise
  // Why there is no such motion; then there are no flags. Else empty.
  std::string why_none;
};

// Of motions as long as the recordings, two and four times as long, as wide,
// twice and half as wide, driven where the recordings are: the first that
// decides with a probability of 99 %, else the likeliest to. Nothing where
// there are no rivals.
std::optional<NextExperiment> ChooseExperiment(const Catalogue& catalogue,
                                               const Session& session,
                                               const DiagnosisProblem& problem,
                                               const Diagnosis& diagnosis);

}  // namespace sysid
