#pragma once

#include <vector>

#include "sysid/linearization/candidate_columns.h"

namespace sysid {

// What (7.3) knows of columns A of a candidate: without states and Theta.
struct ColumnProducts {
  Eigen::MatrixXd C;    // A' A
  Eigen::VectorXd b;    // A' r
  Eigen::VectorXd own;  // squared lengths of the columns as they were with them
};

// The weights of some columns of a candidate that its bounds allow.
struct Weights {
  int set = 0;
  std::vector<int> identifiable;  // columns of the set, given the data
  std::vector<int> active;        // those that the bounds leave
  Eigen::VectorXd alpha;          // of those
  double score = -1.0;            // (7.4); < 0: the data tells of no column
};

// Values of the candidate's parameters.
std::vector<double> ValuesOf(const Candidate& candidate,
                             const Weights& weights);

bool Feasible(const Candidate& candidate, const Weights& weights);

// The weights of a set that gain most within the bounds: of all columns that
// the data tells of, or of fewer where those leave the bounds. `variance` is
// that of the numbers that remain.
Weights BestWeights(const Candidate& candidate, int set,
                    const ColumnProducts& products, double variance);

// The drop of the sum of squares with the values that the law has by these
// weights. It is the score but for a law that is its probe's, whatever the
// weight of that (a limit, a stiffness): to be compared among its probes.
double GainOf(const Candidate& candidate, const Weights& weights,
              const ColumnProducts& products);

}  // namespace sysid
