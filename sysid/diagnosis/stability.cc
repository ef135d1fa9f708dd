#include "sysid/diagnosis/stability.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>

#include "glog/logging.h"
#include "models/math/decompositions.h"
#include "residuals/parameter_forces.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/estimation/parallel.h"
#include "sysid/linearization/force_response.h"
#include "sysid/linearization/statistics.h"
#include "sysid/unexplained_force/joint_motion.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Strata kAllStrata[] = {Strata::kTime,      Strata::kSpeed,
                                 Strata::kPosition,  Strata::kEffort,
                                 Strata::kAmplitude, Strata::kRun};

// A variable between the samples of all segments: of segment s its i-th value
// is that from its i-th sample to the next.
using Variable = std::vector<std::vector<double>>;

// A variable cut into strata.
struct Cut {
  Strata strata = Strata::kTime;
  int body = 0;
  std::vector<double> bounds;        // strata + 1
  std::vector<std::vector<int>> at;  // stratum, as Variable
  int count() const { return static_cast<int>(bounds.size()) - 1; }
};

// Strata with as much data each; none where the variable hardly varies.
Cut CutInto(int count, const Variable& variable) {
  std::vector<double> sorted;
  for (const auto& values : variable) {
    sorted.insert(sorted.end(), values.begin(), values.end());
  }
  std::sort(sorted.begin(), sorted.end());
  Cut cut;
  cut.bounds = {sorted.front()};
  const double least = 1e-3 * (sorted.back() - sorted.front());
  for (int b = 1; b < count; ++b) {
    const double bound = sorted[sorted.size() * b / count];
    // The last one may be of one value: a run, or a limit that is often met.
    const auto above =
        sorted.end() - std::lower_bound(sorted.begin(), sorted.end(), bound);
    if (bound > cut.bounds.back() + least &&
        above * 2 * count >= static_cast<std::ptrdiff_t>(sorted.size())) {
      cut.bounds.push_back(bound);
    }
  }
  cut.bounds.push_back(sorted.back());
  for (const auto& values : variable) {
    cut.at.emplace_back();
    for (const double value : values) {
      const auto next =
          std::upper_bound(cut.bounds.begin() + 1, cut.bounds.end() - 1, value);
      cut.at.back().push_back(static_cast<int>(next - cut.bounds.begin()) - 1);
    }
  }
  return cut;
}

int BodyOf(const Model& model, const Effect& effect) {
  int joint = effect.joint();
  const Mechanism& mechanism = model.mechanism();
  for (size_t j = 0; j < mechanism.joints.size() && joint < 0; ++j) {
    if (effect.link() >= 0 && mechanism.joints[j].child_link == effect.link()) {
      joint = static_cast<int>(j);
    }
  }
  const std::vector<Body>& bodies = model.movers();
  for (size_t b = 0; b < bodies.size(); ++b) {
    if (bodies[b].joint == joint) return static_cast<int>(b);
  }
  return 0;
}

// All that the strata are made of.
class Motion {
 public:
  explicit Motion(const LinearizedFit& fit) : fit_(fit) {
    for (const auto& segment : fit.segments()) {
      states_.push_back(fit.StatesAlong(*segment));
    }
  }

  Cut CutBy(Strata strata, int body) const {
    const bool by_run = strata == Strata::kRun;
    const auto runs = static_cast<int>(fit_.problem().runs().size());
    Cut cut = CutInto(by_run ? std::min(runs, kMostRuns) : kStrataOf,
                      Along(strata, body));
    cut.strata = strata;
    cut.body = body;
    return cut;
  }

 private:
  static constexpr int kStrataOf = 4;
  static constexpr int kMostRuns = 8;

  Variable Along(Strata strata, int body) const {
    const Model& model = fit_.problem().model();
    const Body& moved = model.movers()[body];
    const Mechanism& mechanism = model.mechanism();
    const Eigen::Vector3d axis =
        LinkAxis(mechanism, mechanism.joints[moved.joint].child_link);
    Variable variable;
    for (size_t s = 0; s < states_.size(); ++s) {
      const LinearizedFit::Segment& segment = *fit_.segments()[s];
      const Run& run = fit_.problem().runs()[segment.run]->run;
      std::vector<double> values;
      for (int i = 0; i + 1 < states_[s].rows(); ++i) {
        const int k = segment.rollout->first() + i;
        const JointMotion motion =
            MotionAt(model, moved, axis, states_[s].row(i).data());
        switch (strata) {
          case Strata::kTime:
            values.push_back(run.t[k] - run.t.front());
            break;
          case Strata::kSpeed:
            values.push_back(motion.velocity.norm());
            break;
          case Strata::kPosition:
          case Strata::kAmplitude:
            values.push_back(IsRotation1(moved.type) &&
                                     strata == Strata::kPosition
                                 ? std::remainder(motion.position, 2 * M_PI)
                                 : motion.position);
            break;
          case Strata::kEffort:
            values.push_back(run.effort.row(k)
                                 .segment(moved.v_index, VelocitySize(moved))
                                 .norm());
            break;
          case Strata::kRun:
            values.push_back(segment.run + 1);
            break;
        }
      }
      if (strata == Strata::kAmplitude) {
        const auto [least, most] =
            std::minmax_element(values.begin(), values.end());
        values.assign(values.size(), 0.5 * (*most - *least));
      }
      variable.push_back(std::move(values));
    }
    return variable;
  }

  const LinearizedFit& fit_;
  std::vector<RowMatrixXd> states_;
};

// A parameter of an effect that was added, in the strata of a cut.
struct AskedParameter {
  const Effect* effect = nullptr;
  std::string unit;
  int parameter = 0;  // place in fit.kept()
  double off = 0.0;   // where the law is off
  int cut = 0;
  int first = 0;  // of its columns
};

// x_b: what a parameter does to the errors of a segment where its variable is
// in each of the strata, all asked' columns one after the other, and what
// all parameters do.
struct Columns {
  MatrixXd theta, by_strata;
};

// By forces that act in a stratum alone.
class StrataByForces {
 public:
  explicit StrataByForces(const LinearizedFit& fit)
      : fit_(fit), response_(fit) {
    const EffectSet& effects = fit.problem().model().effects();
    says_ = response_.Valid();
    for (int i = 0; i < effects.size(); ++i) {
      says_ = says_ &&
              (effects.effect(i).hooks() & (kStateRateHook | kLimitHook)) == 0;
    }
  }
  bool Says() const { return says_; }

  Columns Of(int s, const std::vector<AskedParameter>& asked,
             const std::vector<Cut>& cuts, int total) const {
    const LinearizedFit::Segment& segment = *fit_.segments()[s];
    const ShootingProblem& problem = fit_.problem();
    const ParameterForces all =
        ForceDerivatives(problem.model(), problem.map(), fit_.point().theta)
            .Along(*segment.rollout, response_.tangent(s));
    ParameterForces parts = ParameterForces::Zero(*segment.rollout, total);
    for (const AskedParameter& one_asked : asked) {
      const std::vector<int>& at = cuts[one_asked.cut].at[s];
      const int k = fit_.kept()[one_asked.parameter];
      for (size_t i = 0; i < at.size(); ++i) {
        parts.f[i].col(one_asked.first + at[i]) = all.f[i].col(k);
      }
      for (const SegmentRow& row : segment.rollout->rows()) {
        const int i = std::min<int>(row.sample - segment.rollout->first(),
                                    static_cast<int>(at.size()) - 1);
        parts.direct.col(one_asked.first + at[i]).segment(row.first, row.size) =
            all.direct.col(k).segment(row.first, row.size);
      }
    }
    const MatrixXd theta =
        fit_.WithoutStates(segment, response_.Respond(s, all));
    return {theta(Eigen::all, fit_.kept()),
            fit_.WithoutStates(segment, response_.Respond(s, parts))};
  }

 private:
  const LinearizedFit& fit_;
  ForceResponse response_;
  bool says_ = false;
};

// By the rows that were measured there: what a law with states of its own did
// before stays in it.
Columns ByRows(const LinearizedFit& fit, int s,
               const std::vector<AskedParameter>& asked,
               const std::vector<Cut>& cuts, int total) {
  const LinearizedFit::Segment& segment = *fit.segments()[s];
  Columns columns{segment.theta, MatrixXd::Zero(segment.theta.rows(), total)};
  for (const AskedParameter& one_asked : asked) {
    const std::vector<int>& at = cuts[one_asked.cut].at[s];
    for (const SegmentRow& row : segment.rollout->rows()) {
      const int i = std::min<int>(row.sample - segment.rollout->first(),
                                  static_cast<int>(at.size()) - 1);
      columns.by_strata.col(one_asked.first + at[i])
          .segment(row.first, row.size) =
          segment.theta.col(one_asked.parameter).segment(row.first, row.size);
    }
    // What is believed of the state is no data of a stratum.
    const auto believed = segment.theta.rows() - segment.rows();
    columns.by_strata.col(one_asked.first + at.front()).tail(believed) =
        segment.theta.col(one_asked.parameter).tail(believed);
  }
  return columns;
}

// Whether the law's size grows along the strata: a line over their order has
// most of what the estimates differ by.
Trend TrendOf(const std::vector<StratumEstimate>& estimates, double off,
              double tau) {
  double w = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
  for (size_t i = 0; i < estimates.size(); ++i) {
    const auto at = static_cast<double>(i);
    const double weight =
        1.0 / (std::pow(estimates[i].std_error, 2) + tau * tau);
    const double value = estimates[i].value - off;
    w += weight;
    x += weight * at;
    y += weight * value;
    xx += weight * at * at;
    xy += weight * at * value;
    yy += weight * value * value;
  }
  const double across = w * xy - x * y;
  if (!(tau > 0.0) ||
      across * across < kMost * (w * xx - x * x) * (w * yy - y * y)) {
    return Trend::kNone;
  }
  return across * y > 0.0 ? Trend::kRises : Trend::kFalls;
}

// Least squares by normal equations N x = -g.
struct Solved {
  VectorXd x;
  MatrixXd covariance;  // of errors of unit variance
  double gained = 0.0;  // of the sum of squares
};
Solved Solve(const MatrixXd& N, const VectorXd& g) {
  // Of a direction that the data does not tell of: it stays, and its variance
  // is as large as can be said.
  constexpr double kNotTold = 1e-10;
  const VectorXd scale =
      N.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const SymmetricEigen eigen =
      EigenOfSymmetric(scale.asDiagonal() * N * scale.asDiagonal());
  const MatrixXd axes = scale.asDiagonal() * eigen.vectors;
  const VectorXd along = axes.transpose() * g;
  Solved solved;
  VectorXd step(along.size());
  for (Eigen::Index i = 0; i < step.size(); ++i) {
    step[i] = eigen.values[i] > kNotTold ? -along[i] / eigen.values[i] : 0.0;
  }
  solved.x = axes * step;
  solved.gained = -step.dot(along);
  const VectorXd inverse = eigen.values.cwiseMax(kNotTold).cwiseInverse();
  solved.covariance = axes * inverse.asDiagonal() * axes.transpose();
  return solved;
}

std::vector<AskedParameter> AskedParameters(const EvaluatedModel& evaluated,
                                            const LinearizedFit& fit,
                                            const Motion& motion,
                                            std::vector<Cut>* cuts,
                                            int* total) {
  const ShootingProblem& problem = fit.problem();
  std::map<int, std::vector<int>> of_body;  // places of its cuts
  std::vector<AskedParameter> asked;
  for (const auto& effect : evaluated.added) {
    const int body = BodyOf(problem.model(), *effect);
    if (!of_body.contains(body)) {
      for (const Strata strata : kAllStrata) {
        Cut cut = motion.CutBy(strata, body);
        if (cut.count() < 2) continue;
        of_body[body].push_back(static_cast<int>(cuts->size()));
        cuts->push_back(std::move(cut));
      }
    }
    const std::vector<std::string> names = effect->ParameterNames();
    for (size_t k = 0; k < fit.kept().size(); ++k) {
      const FreeParameter& free = problem.free()[fit.kept()[k]];
      const std::string& name = free.parameter.name;
      if (std::find(names.begin(), names.end(), name) == names.end()) continue;
      AskedParameter one_asked{effect.get(), free.parameter.unit,
                               static_cast<int>(k)};
      one_asked.off = free.parameter.nominal;
      for (const EffectParameter& own : effect->parameters()) {
        if (own.name == name) one_asked.off = own.null_value;
      }
      for (const int cut : of_body[body]) {
        one_asked.cut = cut;
        one_asked.first = *total;
        *total += (*cuts)[cut].count();
        asked.push_back(one_asked);
      }
    }
  }
  return asked;
}

// The normal equations of all parameters, and of one of them by strata.
class StrataEquations {
 public:
  StrataEquations(const LinearizedFit& fit,
                  const std::vector<AskedParameter>& asked,
                  const std::vector<Cut>& cuts, int total) {
    const ShootingProblem& problem = fit.problem();
    const StrataByForces by_forces(fit);
    const auto segments = static_cast<int>(fit.segments().size());
    std::vector<Columns> columns(segments);
    ParallelFor(segments, problem.options().threads, [&](int s) {
      columns[s] = by_forces.Says() ? by_forces.Of(s, asked, cuts, total)
                                    : ByRows(fit, s, asked, cuts, total);
      return true;
    });
    const auto p = static_cast<int>(fit.kept().size());
    TT_ = MatrixXd::Zero(p, p);
    TX_ = MatrixXd::Zero(p, total);
    Tr_ = VectorXd::Zero(p);
    Xr_ = VectorXd::Zero(total);
    for (const AskedParameter& one : asked) {
      const int n = cuts[one.cut].count();
      XX_.push_back(MatrixXd::Zero(n, n));
    }
    for (int s = 0; s < segments; ++s) {
      const LinearizedFit::Segment& segment = *fit.segments()[s];
      const VectorXd r = fit.WithoutStates(segment, segment.whitened);
      const auto& [T, X] = columns[s];
      squares_ += r.squaredNorm();
      TT_.noalias() += T.transpose() * T;
      TX_.noalias() += T.transpose() * X;
      Tr_.noalias() += T.transpose() * r;
      Xr_.noalias() += X.transpose() * r;
      for (size_t i = 0; i < asked.size(); ++i) {
        const auto own = X.middleCols(asked[i].first, XX_[i].cols());
        XX_[i].noalias() += own.transpose() * own;
      }
    }
    for (int k = 0; k < p; ++k) {
      const FreeParameter& free = problem.free()[fit.kept()[k]];
      if (free.prior) TT_(k, k) += 1.0 / std::pow(free.prior->std, 2);
    }
    squares_constant_ = squares_ - Solve(TT_, Tr_).gained;
  }

  // The changes of the i-th that was asked, by strata, and ln of how much less
  // is left with them.
  struct ByStrata {
    VectorXd change, std_error;  // of errors of unit variance
    double gain = 0.0;
  };
  ByStrata Of(size_t i, const AskedParameter& one) const {
    const auto p = static_cast<int>(TT_.rows());
    const auto n = static_cast<int>(XX_[i].rows());
    std::vector<int> others;
    for (int k = 0; k < p; ++k) {
      if (k != one.parameter) others.push_back(k);
    }
    MatrixXd N(p - 1 + n, p - 1 + n);
    const MatrixXd cross = TX_.middleCols(one.first, n)(others, Eigen::all);
    N << TT_(others, others), cross, cross.transpose(), XX_[i];
    VectorXd g(p - 1 + n);
    g << Tr_(others), Xr_.segment(one.first, n);
    const Solved solved = Solve(N, g);
    return {solved.x.tail(n), solved.covariance.diagonal().tail(n).cwiseSqrt(),
            0.5 * std::log(squares_constant_ / (squares_ - solved.gained))};
  }

  // The size of a change of parameters, of the errors.
  double SizeOf(const VectorXd& change) const {
    return std::sqrt(change.dot(TT_ * change));
  }

 private:
  MatrixXd TT_, TX_;
  VectorXd Tr_, Xr_;
  std::vector<MatrixXd> XX_;
  double squares_ = 0.0, squares_constant_ = 0.0;
};

}  // namespace

const char* NameOf(Strata strata) {
  constexpr std::array kNames = {"time",   "speed",     "position",
                                 "effort", "amplitude", "run"};
  return kNames.at(static_cast<size_t>(strata));
}

const char* NameOf(Trend trend) {
  constexpr std::array kNames = {"none", "rises", "falls"};
  return kNames.at(static_cast<size_t>(trend));
}

bool ParameterByStrata::IsConstant() const {
  return !(part * least_spread >= kStandsIn &&
           gain > (static_cast<double>(estimates.size()) - 1.0) *
                      std::log1p(kMatters));
}

std::vector<ParameterByStrata> ParametersByStrata(
    const EvaluatedModel& evaluated) {
  std::vector<ParameterByStrata> all;
  if (evaluated.added.empty()) return all;
  const ShootingProblem& problem = *evaluated.problem;
  const LinearizedFit fit(problem, evaluated.fit.point);
  if (!fit.Valid()) return all;
  std::vector<Cut> cuts;
  int total = 0;
  const std::vector<AskedParameter> asked =
      AskedParameters(evaluated, fit, Motion(fit), &cuts, &total);
  if (asked.empty()) return all;
  const StrataEquations equations(fit, asked, cuts, total);
  const ParameterMap& map = problem.map();
  VectorXd values(map.size());
  map.ValuesOf(fit.point().theta.data(), values.data());
  // Of errors that are correlated over so many samples.
  const double time = std::max(1.0, fit.AutocorrelationTime());
  const double dof = fit.DegreesOfFreedom();
  const double sigma =
      std::sqrt(std::max(1.0, fit.SumOfSquares() / dof) * time);
  for (size_t i = 0; i < asked.size(); ++i) {
    const AskedParameter& one = asked[i];
    const Cut& cut = cuts[one.cut];
    const int at = fit.kept()[one.parameter];
    // The value per theta.
    double slope = 1.0;
    if (map.IsTransformed(at)) {
      constexpr double kStep = 1e-6;
      VectorXd theta = fit.point().theta, moved(values.size());
      theta[at] += kStep;
      map.ValuesOf(theta.data(), moved.data());
      slope = (moved[at] - values[at]) / kStep;
    }
    const auto [change, std_error, gain] = equations.Of(i, one);
    ParameterByStrata by;
    by.effect = one.effect->name();
    by.parameter = problem.free()[at].parameter.name;
    by.unit = one.unit;
    by.strata = cut.strata;
    const Body& body = problem.model().movers()[cut.body];
    by.joint = problem.model().mechanism().joints[body.joint].name;
    by.is_slide = body.type == JointType::kPrismatic;
    by.gain = gain;
    const VectorXd by_stratum = values[at] + (slope * change).array();
    const VectorXd errors = std::abs(slope) * sigma * std_error;
    for (int b = 0; b < cut.count(); ++b) {
      by.estimates.push_back(
          {cut.bounds[b], cut.bounds[b + 1], by_stratum[b], errors[b]});
    }
    const double size = std::max(1e-300, std::abs(values[at] - one.off));
    const int free = cut.count() - 1;
    const auto [Q, C, weights] = HeterogeneityOf(by_stratum, errors);
    const double tau = std::sqrt(std::max(0.0, (Q - free) / C));
    by.spread = tau / size;
    // What chance makes of Q, where the errors tell dof / time times.
    const double chance = free * FisherQuantile(kByChance / asked.size(), free,
                                                std::max(2.0, dof / time));
    by.least_spread = std::sqrt(std::max(0.0, Q - chance) / weights) / size;
    by.trend = TrendOf(by.estimates, one.off, tau);
    VectorXd law = VectorXd::Zero(fit.kept().size()), own = law;
    for (const AskedParameter& other : asked) {
      if (other.effect != one.effect) continue;
      const int k = fit.kept()[other.parameter];
      if (map.IsTransformed(k)) continue;
      law[other.parameter] = values[k] - other.off;
    }
    own[one.parameter] = law[one.parameter];
    if (const double of_law = equations.SizeOf(law); of_law > 0.0) {
      by.part = std::min(1.0, equations.SizeOf(own) / of_law);
    }
    VLOG(1) << by.parameter << " by " << NameOf(by.strata) << ": spread "
            << by.spread << ", least " << by.least_spread << ", part "
            << by.part << ", gain " << by.gain;
    all.push_back(std::move(by));
  }
  return all;
}

std::vector<ParameterByStrata> StandIns(
    const std::vector<ParameterByStrata>& all) {
  std::map<std::string, ParameterByStrata> most;
  for (const ParameterByStrata& one : all) {
    if (one.IsConstant()) continue;
    const auto [at, is_new] = most.emplace(one.effect, one);
    if (!is_new && one.gain > at->second.gain) at->second = one;
  }
  std::vector<ParameterByStrata> found;
  for (auto& [effect, one] : most) found.push_back(std::move(one));
  return found;
}

}  // namespace sysid
