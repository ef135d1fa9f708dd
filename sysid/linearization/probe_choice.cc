#include "sysid/linearization/probe_choice.h"

#include <algorithm>
#include <vector>

#include "sysid/linearization/candidate_weights.h"
#include "sysid/linearization/columns_by_forces.h"

namespace sysid {
namespace {

// So many at a time that those of a segment stay in the processor's cache, and
// that nothing grows with the grids.
constexpr int kColumnsAtOnce = 256;

// What columns of some sets of candidates, one after the other, are to the
// errors: products of each set and, to take Theta out of them, of its basis Q,
//   A' (1 - Q Q') A = A' A - (Q' A)' (Q' A),
//   A' (1 - Q Q') r = A' r - (Q' A)' (Q' r).
class Products {
 public:
  Products(const std::vector<Candidate>& candidates,
           const std::vector<CandidateSet>& sets, int rank) {
    int columns = 0;
    for (const CandidateSet& at : sets) {
      const int size = candidates[at.candidate].columns(at.set);
      first_.push_back(columns);
      C_.push_back(Eigen::MatrixXd::Zero(size, size));
      columns += size;
    }
    own_ = b_ = Eigen::VectorXd::Zero(columns);
    inner_ = Eigen::MatrixXd::Zero(rank, columns);
    inner_r_ = Eigen::VectorXd::Zero(rank);
  }

  // Of a segment: its columns, and what is left of them without its states.
  void Set(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& A,
           const Eigen::VectorXd& r, const Eigen::MatrixXd& Q) {
    own_ = columns.colwise().squaredNorm().transpose();
    b_.noalias() = A.transpose() * r;
    inner_.noalias() = Q.transpose() * A;
    inner_r_.noalias() = Q.transpose() * r;
    for (size_t i = 0; i < C_.size(); ++i) {
      const auto part = A.middleCols(first_[i], C_[i].cols());
      C_[i].noalias() = part.transpose() * part;
    }
  }
  void Add(const Products& other) {
    own_ += other.own_;
    b_ += other.b_;
    inner_ += other.inner_;
    inner_r_ += other.inner_r_;
    for (size_t i = 0; i < C_.size(); ++i) C_[i] += other.C_[i];
  }

  ColumnProducts Of(int set) const {
    const int first = first_[set], size = static_cast<int>(C_[set].cols());
    const auto inner = inner_.middleCols(first, size);
    return {C_[set] - inner.transpose() * inner,
            b_.segment(first, size) - inner.transpose() * inner_r_,
            own_.segment(first, size)};
  }

 private:
  std::vector<int> first_;  // of each set's columns
  std::vector<Eigen::MatrixXd> C_;
  Eigen::VectorXd own_, b_, inner_r_;
  Eigen::MatrixXd inner_;
};

Products SumOver(std::vector<Products> segments) {
  Products sum = std::move(segments.front());
  for (size_t s = 1; s < segments.size(); ++s) sum.Add(segments[s]);
  return sum;
}

struct SetGain {
  int set;
  double gain;
};

// The places of those that may be the best, which comes first.
std::vector<int> Rank(std::vector<SetGain> gains, double close) {
  if (gains.empty()) return {0};
  std::stable_sort(
      gains.begin(), gains.end(),
      [](const SetGain& a, const SetGain& b) { return a.gain > b.gain; });
  std::vector<int> sets = {gains.front().set};
  for (size_t i = 1; i < gains.size(); ++i) {
    if (gains[i].gain >= close * gains.front().gain) {
      sets.push_back(gains[i].set);
    }
  }
  return sets;
}

// So many of `count` places, evenly spread.
std::vector<int> Evenly(size_t count, size_t most) {
  std::vector<int> places;
  for (size_t k = 0; k < std::min(count, most); ++k) {
    places.push_back(
        static_cast<int>(count <= most ? k : k * (count - 1) / (most - 1)));
  }
  return places;
}

}  // namespace

std::vector<CandidateSet> ChooseProbeSets(
    const LinearizedFit& fit, const Model& fitted,
    const std::vector<Candidate>& candidates) {
  constexpr size_t kMostSets = 3;
  // Forces are off by a tenth of a column's length, and so is what it gains by
  // a fifth.
  constexpr double kClose = 0.8;
  const ColumnsByForces by_forces(fit, fitted);
  const double variance = fit.SumOfSquares() / fit.DegreesOfFreedom();
  const auto& segments = fit.segments();
  const ThetaBasis& theta = by_forces.theta_basis();
  std::vector<std::vector<SetGain>> gains(candidates.size());
  const auto look = [&](const std::vector<CandidateSet>& sets) {
    std::vector<Products> parts(segments.size(),
                                Products(candidates, sets, theta.rank()));
    by_forces.ForEachSegment(
        candidates, sets, [&](int s, const Eigen::MatrixXd& columns) {
          parts[s].Set(columns, fit.WithoutStates(*segments[s], columns),
                       segments[s]->r, theta.of(s));
        });
    const Products products = SumOver(std::move(parts));
    for (size_t i = 0; i < sets.size(); ++i) {
      const Candidate& candidate = candidates[sets[i].candidate];
      const ColumnProducts of_set = products.Of(static_cast<int>(i));
      const Weights weights =
          BestWeights(candidate, sets[i].set, of_set, variance);
      if (weights.active.empty()) continue;
      gains[sets[i].candidate].push_back(
          {sets[i].set, GainOf(candidate, weights, of_set)});
    }
  };
  std::vector<CandidateSet> some;
  int columns = 0;
  for (int i = 0; i < static_cast<int>(candidates.size()); ++i) {
    const int count = static_cast<int>(candidates[i].sets.size());
    if (count == 1 || !by_forces.Says(candidates[i])) continue;
    for (int s = 0; s < count; ++s) {
      some.push_back({i, s});
      columns += candidates[i].columns(s);
      if (columns < kColumnsAtOnce) continue;
      look(some);
      some.clear();
      columns = 0;
    }
  }
  if (!some.empty()) look(some);
  std::vector<CandidateSet> chosen;
  for (int i = 0; i < static_cast<int>(candidates.size()); ++i) {
    std::vector<int> places =
        by_forces.Says(candidates[i])
            ? Rank(std::move(gains[i]), kClose)
            : Evenly(candidates[i].sets.size(), kMostSets);
    if (places.size() > kMostSets) places.resize(kMostSets);
    for (const int set : places) chosen.push_back({i, set});
  }
  return chosen;
}

}  // namespace sysid
