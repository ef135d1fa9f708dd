#include "sysid/diagnosis/linear_sets.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <string>

#include "glog/logging.h"
#include "models/math/decompositions.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/linearization/candidate_batch.h"
#include "sysid/linearization/candidate_weights.h"
#include "sysid/linearization/probe_choice.h"

namespace sysid {
namespace {

using Eigen::ArrayXd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of a stretch: none is predicted without any error.
constexpr double kLeastSquares = 1e-9;

// T of x_B = T x_R that minimises x' N x over what every model has (the first
// `count` columns); what the data does not tell of stays.
MatrixXd Elimination(const MatrixXd& N, int count) {
  constexpr double kNothing = 1e-12;
  if (count == 0) return MatrixXd::Zero(0, N.cols());
  const MatrixXd B = N.topLeftCorner(count, count);
  const VectorXd scale =
      B.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const SymmetricEigen eigen =
      EigenOfSymmetric(scale.asDiagonal() * B * scale.asDiagonal());
  const VectorXd inverse = eigen.values.unaryExpr(
      [](double x) { return x > kNothing ? 1.0 / x : 0.0; });
  const MatrixXd right =
      eigen.vectors.transpose() *
      (scale.asDiagonal() * N.topRightCorner(count, N.cols() - count));
  return -(scale.asDiagonal() *
           (eigen.vectors * (inverse.asDiagonal() * right)));
}

// G with x_B = T x_R: of x_R alone.
MatrixXd Reduced(const MatrixXd& G, const MatrixXd& T) {
  const Eigen::Index b = T.rows(), r = T.cols();
  const MatrixXd across = G.topRightCorner(b, r).transpose() * T;
  return G.bottomRightCorner(r, r) + across + across.transpose() +
         T.transpose() * (G.topLeftCorner(b, b) * T);
}

// Of X = [what every model has | r | the members' parameters | A] of some runs.
struct NormalMatrices {
  std::vector<MatrixXd> stretches;  // of the numbers measured
  std::vector<MatrixXd> folds;      // with what is believed of the states
  std::vector<int> fold;            // of a stretch
  ArrayXd dof;                      // of a stretch
  VectorXd own_length;              // squares of A with the states
};

NormalMatrices MatricesOf(const LinearizedFit& fit,
                          const std::vector<int>& always,
                          const std::vector<int>& own,
                          const std::vector<MatrixXd>& columns) {
  const Folds folds = FoldsOf(fit);
  const auto a = columns.empty() ? 0 : columns[0].cols();
  const auto width =
      static_cast<Eigen::Index>(always.size() + own.size()) + 1 + a;
  NormalMatrices matrices;
  matrices.stretches.assign(folds.stretches, MatrixXd::Zero(width, width));
  matrices.folds.assign(folds.count, MatrixXd::Zero(width, width));
  matrices.fold.assign(folds.stretches, 0);
  matrices.dof = ArrayXd::Zero(folds.stretches);
  matrices.own_length = VectorXd::Zero(a);
  const double state_dof = ObservedStateDof(fit.problem());
  for (size_t s = 0; s < fit.segments().size(); ++s) {
    const LinearizedFit::Segment& at = *fit.segments()[s];
    const MatrixXd A = fit.WithoutStates(at, columns[s]);
    MatrixXd X(A.rows(), width);
    X << at.theta(Eigen::all, always), fit.WithoutStates(at, at.whitened),
        at.theta(Eigen::all, own), A;
    matrices.own_length += columns[s].colwise().squaredNorm().transpose();
    const int stretch = folds.stretch[s];
    const auto measured = X.topRows(at.rows());
    matrices.stretches[stretch].noalias() += measured.transpose() * measured;
    matrices.folds[folds.fold[s]].noalias() += X.transpose() * X;
    matrices.fold[stretch] = folds.fold[s];
    matrices.dof[stretch] += at.numbers() - state_dof;
  }
  return matrices;
}

std::set<std::string> NamesOf(const Effect& effect) {
  const std::vector<std::string> names = effect.ParameterNames();
  return {names.begin(), names.end()};
}

// Whether all parameters of an effect are also another's, which has more.
bool IsPartOf(const Effect& part, const Effect& whole) {
  const std::set<std::string> some = NamesOf(part), all = NamesOf(whole);
  return some.size() < all.size() &&
         std::includes(all.begin(), all.end(), some.begin(), some.end());
}

}  // namespace

LinearSets::LinearSets(const DiagnosisProblem& problem,
                       const EvaluatedModel& fitted,
                       const Candidates& catalogue)
    : problem_(problem), fitted_(fitted), catalogue_(catalogue) {
  const ShootingProblem& posed = *fitted.problem;
  // Parameters that ran away for want of an effect are no place to look from.
  const Fit from = IsDoubtful(fitted.fit)
                       ? StatesAtStart(posed, fitted.fit.point)
                       : fitted.fit;
  const LinearizedFit fit(posed, from.point);
  valid_ = fit.Valid();
  if (!valid_) return;
  std::set<std::string> taken = problem.known;
  for (const FreeParameter& free : posed.free()) {
    taken.insert(free.parameter.name);
  }
  candidates_ = MakeCandidates(from.model, catalogue, taken);
  const std::vector<CandidateSet> sets =
      ChooseProbeSets(fit, from.model, candidates_);
  // What every model has first, then r and the members' parameters.
  std::set<std::string> given;
  for (const FreeParameter& free : problem.free) {
    given.insert(free.parameter.name);
  }
  std::vector<int> always, own;
  for (size_t k = 0; k < fit.kept().size(); ++k) {
    const std::string& name = posed.free()[fit.kept()[k]].parameter.name;
    (given.contains(name) ? always : own).push_back(static_cast<int>(k));
  }
  const auto matrices_of = [&](const LinearizedFit& linearized) {
    return MatricesOf(
        linearized, always, own,
        RespondToCandidates(linearized, from.model, candidates_, sets));
  };
  const NormalMatrices fitted_runs = matrices_of(fit);
  const int b = static_cast<int>(always.size());
  const int m = static_cast<int>(own.size());
  MatrixXd N = fitted_runs.folds[0];
  for (size_t f = 1; f < fitted_runs.folds.size(); ++f) {
    N += fitted_runs.folds[f];
  }
  for (int i = 0; i < b + m; ++i) {
    const auto& free = posed.free()[fit.kept()[i < b ? always[i] : own[i - b]]];
    const int at = i < b ? i : i + 1;
    if (free.prior) N(at, at) += 1.0 / (free.prior->std * free.prior->std);
  }
  follow_ = Elimination(N, b);
  all_ = Reduced(N, follow_);
  VectorXd values(posed.map().size());
  posed.map().ValuesOf(fit.point().theta.data(), values.data());
  for (const std::vector<int>* part : {&always, &own}) {
    for (const int k : *part) {
      const int at = fit.kept()[k];
      (part == &own ? own_ : always_)
          .push_back({posed.free()[at].parameter.name, values[at],
                      !posed.map().IsTransformed(at)});
    }
  }
  std::vector<MatrixXd> eliminations;
  for (const MatrixXd& part : fitted_runs.folds) {
    const MatrixXd rest = N - kLeftOut * part;
    eliminations.push_back(Elimination(rest, b));
    without_.push_back(Reduced(rest, eliminations.back()));
  }
  std::vector<double> dof;
  // Those where no segment's middle is have no data.
  const auto add_stretches = [&](const NormalMatrices& matrices,
                                 bool held_out) {
    for (size_t j = 0; j < matrices.stretches.size(); ++j) {
      if (!(matrices.dof[j] > 0.0)) continue;
      const int fold = held_out ? static_cast<int>(eliminations.size()) - 1
                                : matrices.fold[j];
      stretch_.push_back(Reduced(matrices.stretches[j], eliminations[fold]));
      fold_.push_back(fold);
      dof.push_back(matrices.dof[j]);
    }
  };
  add_stretches(fitted_runs, false);
  const double fitted_dof = std::accumulate(dof.begin(), dof.end(), 0.0);
  if (problem.holdout != nullptr && !fitted.holdout_point.runs.empty()) {
    // Nothing is left out of what predicts these.
    eliminations.push_back(follow_);
    without_.push_back(all_);
    const ShootingProblem held_out = posed.WithData(problem.holdout);
    Solution point = fitted.holdout_point;
    point.theta = from.point.theta;
    if (IsDoubtful(fitted.fit)) point = StatesAtStart(held_out, point).point;
    const LinearizedFit linearized(held_out, point);
    valid_ = linearized.Valid();
    if (!valid_) return;
    add_stretches(matrices_of(linearized), true);
  }
  dof_ = Eigen::Map<const ArrayXd>(dof.data(), dof.size());

  AddMembers(fit, own);
  AddCandidates(sets, fitted_runs.own_length,
                all_(0, 0) / std::max(1.0, fitted_dof));
  FindExclusions();
  const auto now = ScoreOf(members_);
  const double percent = fitted.fit.train.total.fit_percent;
  const double kappa = std::isfinite(percent)
                           ? std::clamp(1.0 - percent / 100.0, kLeastTrust, 1.0)
                           : kLeastTrust;
  valid_ = now.has_value();
  if (valid_) trust_ = kappa * kappa * now->squares;
}

void LinearSets::AddMembers(const LinearizedFit& fit,
                            const std::vector<int>& own) {
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  const ShootingProblem& posed = *fitted_.problem;
  const ParameterMap& map = posed.map();
  const int m = static_cast<int>(own.size());
  off_ = VectorXd::Zero(1 + m);
  down_ = VectorXd::Constant(1 + m, -kUnbounded);
  up_ = VectorXd::Constant(1 + m, kUnbounded);
  VectorXd values(map.size());
  map.ValuesOf(fit.point().theta.data(), values.data());
  std::vector<std::string> names;  // of columns
  for (int i = 0; i < m; ++i) {
    const int at = fit.kept()[own[i]];
    const FreeParameter& free = posed.free()[at];
    names.push_back(free.parameter.name);
    if (map.IsTransformed(at)) continue;
    down_[1 + i] = free.lower - values[at];
    up_[1 + i] = free.upper - values[at];
  }
  const auto add = [&](const Effect& effect) {
    Term term;
    const auto same = [&](const auto& other) {
      return other->name() == effect.name();
    };
    const auto at = std::find_if(catalogue_.begin(), catalogue_.end(), same);
    CHECK(at != catalogue_.end()) << effect.name();
    term.effect = static_cast<int>(at - catalogue_.begin());
    const std::set<std::string> its = NamesOf(effect);
    for (int i = 0; i < m; ++i) {
      if (its.contains(names[i])) term.columns.push_back(1 + i);
    }
    term.parameters = static_cast<int>(term.columns.size());
    terms_.push_back(term);
  };
  for (const auto& member : fitted_.added) {
    members_.push_back(static_cast<int>(terms_.size()));
    add(*member);
    // Where it is off: its own parameters at null, the mechanism's as given.
    VectorXd moved = values, theta;
    for (int i = 0; i < map.size(); ++i) {
      const Parameter& parameter = posed.free()[i].parameter;
      for (const EffectParameter& its : member->parameters()) {
        if (its.name == parameter.name) moved[i] = its.null_value;
      }
      const auto& adjusts = member->adjusts_nominal();
      if (std::find(adjusts.begin(), adjusts.end(), parameter.name) !=
          adjusts.end()) {
        moved[i] =
            FindParameters(problem_.model, {parameter.name}, member->name())[0]
                .nominal;
      }
    }
    if (!map.ThetaOf(moved, &theta)) continue;
    for (int i = 0; i < m; ++i) {
      const int at = fit.kept()[own[i]];
      if (moved[at] != values[at])
        off_[1 + i] = theta[at] - fit.point().theta[at];
    }
  }
  for (const auto& part : catalogue_) {
    const bool is_part =
        std::any_of(fitted_.added.begin(), fitted_.added.end(),
                    [&](const auto& whole) { return IsPartOf(*part, *whole); });
    if (is_part) add(*part);
  }
}

void LinearSets::AddCandidates(const std::vector<CandidateSet>& sets,
                               const VectorXd& own_length, double variance) {
  int first = 0;
  for (const CandidateSet& at : sets) {
    const Candidate& candidate = candidates_[at.candidate];
    const int size = candidate.columns(at.set);
    const int begin = static_cast<int>(off_.size()) + first;
    const ColumnProducts products = {all_.block(begin, begin, size, size),
                                     all_.block(begin, 0, size, 1),
                                     own_length.segment(first, size)};
    first += size;
    const Weights weights = BestWeights(candidate, at.set, products, variance);
    if (weights.identifiable.empty()) continue;
    Term term;
    const auto same = [&](const auto& effect) {
      return effect->name() == candidate.effect->name();
    };
    term.effect = static_cast<int>(
        std::find_if(catalogue_.begin(), catalogue_.end(), same) -
        catalogue_.begin());
    term.candidate = at.candidate;
    term.set = at.set;
    std::set<size_t> found;
    for (const int k : weights.identifiable) {
      found.insert(candidate.ParameterOf(at.set, k));
    }
    for (size_t p = 0; p < candidate.own(); ++p) {
      if (candidate.IsSearched(p) ||
          !candidate.effect->parameters()[p].grid.empty()) {
        found.insert(p);
      }
    }
    term.parameters = static_cast<int>(found.size());
    for (size_t p = 0; p < candidate.parameters.size(); ++p) {
      if (found.contains(p)) continue;
      term.without_influence.insert(candidate.parameters[p].name);
    }
    const ProbeSet& probes = candidate.sets[at.set];
    const auto add = [&](const std::vector<int>& of_set) {
      term.of_set = of_set;
      term.columns.clear();
      VectorXd secants(of_set.size());
      for (size_t i = 0; i < of_set.size(); ++i) {
        term.columns.push_back(begin + of_set[i]);
        secants[i] = of_set[i] < static_cast<int>(probes.size())
                         ? probes[of_set[i]].secant
                         : 0.0;
      }
      term.held.resize(0);
      if ((secants.array() != 0.0).all()) {
        // A law that is its probe's whatever the weight.
        Weights all{at.set, {}, of_set, secants, 0.0}, less = all;
        constexpr double kLess = 0.37;
        less.alpha *= kLess;
        if (ValuesOf(candidate, all) == ValuesOf(candidate, less)) {
          term.held = secants;
        }
      }
      terms_.push_back(term);
    };
    add(weights.identifiable);
    if (weights.active != weights.identifiable) add(weights.active);
  }
}

void LinearSets::FindExclusions() {
  const size_t n = terms_.size();
  excludes_.assign(n, std::vector<bool>(n, false));
  std::vector<std::set<std::string>> names;
  for (const Term& term : terms_) {
    names.push_back(NamesOf(*catalogue_[term.effect]));
  }
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < n; ++j) {
      excludes_[i][j] =
          terms_[i].effect == terms_[j].effect ||
          std::any_of(names[i].begin(), names[i].end(), [&](const auto& name) {
            return names[j].contains(name);
          });
    }
  }
}

std::optional<LinearSets::Score> LinearSets::ScoreOf(const Set& set) const {
  VectorXd u = VectorXd::Zero(all_.rows());
  u[0] = 1.0;
  u.segment(1, off_.size() - 1) = off_.tail(off_.size() - 1);
  std::vector<int> columns;
  Score score;
  for (const int t : set) {
    const Term& term = terms_[t];
    score.effects.push_back(term.effect);
    score.parameters += term.parameters;
    if (term.held.size() > 0) {
      u(term.columns) = term.held;
    } else {
      u(term.columns).setZero();
      columns.insert(columns.end(), term.columns.begin(), term.columns.end());
    }
  }
  std::sort(score.effects.begin(), score.effects.end());
  score.set = set;
  if (!columns.empty() && set != members_) {
    const MatrixXd C = all_(columns, columns);
    const VectorXd scale = C.diagonal().cwiseSqrt().cwiseInverse();
    const Cholesky factor(scale.asDiagonal() * C * scale.asDiagonal());
    if (!factor.Valid() ||
        factor.L().diagonal().array().square().minCoeff() < kLeastPivot) {
      return std::nullopt;
    }
  }
  // What u or the set have at all: few of many columns.
  std::vector<int> some;
  std::set<int> of_set(columns.begin(), columns.end());
  for (int c = 0; c < u.size(); ++c) {
    if (u[c] != 0.0 || of_set.contains(c)) some.push_back(c);
  }
  const auto solve = [&](const MatrixXd& N) -> VectorXd {
    const VectorXd right = N(columns, some) * u(some);
    return -SolveSymmetric(N(columns, columns), right);
  };
  // One bound after the other, the members'.
  for (bool again = true; again && !columns.empty();) {
    again = false;
    const VectorXd alpha = solve(all_);
    for (size_t i = 0; i < columns.size() && !again; ++i) {
      const int c = columns[i];
      if (c >= off_.size()) continue;
      const double inside = std::clamp(alpha[i], down_[c], up_[c]);
      if (inside == alpha[i]) continue;
      u[c] = inside;
      columns.erase(columns.begin() + i);
      again = true;
    }
  }
  score.v = u;
  if (!columns.empty()) score.v(columns) = solve(all_);
  for (const int t : set) {
    const Term& term = terms_[t];
    score.values.emplace_back();
    if (term.candidate < 0) continue;
    const Candidate& candidate = candidates_[term.candidate];
    const Weights weights{term.set, {}, term.of_set, score.v(term.columns), 0};
    if (!Feasible(candidate, weights)) return std::nullopt;
    score.values.back() = ValuesOf(candidate, weights);
  }
  std::vector<VectorXd> v(without_.size(), u);
  if (!columns.empty()) {
    for (size_t f = 0; f < v.size(); ++f) v[f](columns) = solve(without_[f]);
  }
  score.squares.resize(dof_.size());
  for (Eigen::Index j = 0; j < dof_.size(); ++j) {
    const VectorXd at = v[fold_[j]](some);
    const double squares = at.dot(stretch_[j](some, some) * at);
    score.squares[j] = std::max(kLeastSquares, squares) / dof_[j];
  }
  return score;
}

bool LinearSets::DoTheSame(const Set& a, const Set& b) const {
  const auto columns_of = [&](const Set& set) {
    std::vector<int> columns;
    for (const int t : set) {
      columns.insert(columns.end(), terms_[t].columns.begin(),
                     terms_[t].columns.end());
    }
    return columns;
  };
  const std::vector<int> of_a = columns_of(a), of_b = columns_of(b);
  const auto makes = [&](const std::vector<int>& some,
                         const std::vector<int>& others) {
    const MatrixXd both = all_(some, others);
    const MatrixXd made =
        both.transpose() * SolveSymmetric(all_(some, some), both);
    const auto own = all_.diagonal()(others).array();
    return ((own - made.diagonal().array()) < kLeastPivot * own).all();
  };
  return makes(of_a, of_b) && makes(of_b, of_a);
}

std::map<std::string, double> LinearSets::StartOf(const Score& score,
                                                  double part) const {
  std::map<std::string, double> start;
  const auto move = [&](const Value& at, double step) {
    start[at.name] = at.value + (at.is_plain ? part * step : 0.0);
  };
  const VectorXd step = follow_ * score.v;
  for (size_t i = 0; i < always_.size(); ++i) move(always_[i], step[i]);
  for (size_t k = 0; k < score.set.size(); ++k) {
    const Term& term = terms_[score.set[k]];
    if (term.candidate < 0) {
      for (const int c : term.columns) move(own_[c - 1], score.v[c]);
      continue;
    }
    const Candidate& candidate = candidates_[term.candidate];
    for (size_t p = 0; p < candidate.parameters.size(); ++p) {
      const Parameter& parameter = candidate.parameters[p];
      const double to = score.values[k][p];
      // Part of the way the law would still be off.
      const bool all_the_way =
          candidate.IsSearched(p) ||
          (p < candidate.own() &&
           candidate.effect->parameters()[p].start.has_value());
      start[parameter.name] =
          all_the_way ? to
                      : parameter.nominal + part * (to - parameter.nominal);
    }
  }
  for (const std::string& name : WithoutInfluence(score)) start.erase(name);
  return start;
}

std::set<std::string> LinearSets::WithoutInfluence(const Score& score) const {
  std::set<std::string> without;
  for (const int t : score.set) {
    without.insert(terms_[t].without_influence.begin(),
                   terms_[t].without_influence.end());
  }
  return without;
}

}  // namespace sysid
