#pragma once

#include <functional>
#include <vector>

#include "sysid/linearization/candidate_columns.h"
#include "sysid/linearization/force_response.h"

namespace sysid {

// The columns of candidates as forces do it that are held between samples,
// (7.2): no more than a linearisation along the fit, and a few products for
// each column, but off by what a law changes within a sample.
class ColumnsByForces {
 public:
  // Both must outlive it.
  ColumnsByForces(const LinearizedFit& fit, const Model& fitted);

  // Whether forces stand for what a candidate does. They do not where it
  // saturates, nor where what acts on a joint does so through a drive of the
  // fitted model that has states or a limit: those are what they are along the
  // motion. And not where the dynamics fail.
  bool Says(const Candidate& candidate) const;

  // Calls visit(s, columns) for each segment s, from several threads at a time,
  // with what RespondToCandidates has of it.
  void ForEachSegment(
      const std::vector<Candidate>& candidates,
      const std::vector<CandidateSet>& sets,
      const std::function<void(int, const Eigen::MatrixXd&)>& visit) const;

  // What spans Theta as forces have it: a candidate that does what free
  // parameters do is told by it, whatever forces are off.
  const ThetaBasis& theta_basis() const { return theta_; }

 private:
  const LinearizedFit& fit_;
  const Model& fitted_;
  ForceResponse response_;
  bool says_;  // of candidates that do not saturate
  ThetaBasis theta_;
};

}  // namespace sysid
