#include "sysid/inverse_dynamics/equation_look.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "glog/logging.h"
#include "models/inertial_columns.h"
#include "models/parameters.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/inverse_dynamics/effort_audit.h"
#include "sysid/inverse_dynamics/equation_columns.h"
#include "sysid/inverse_dynamics/equation_products.h"
#include "sysid/inverse_dynamics/equation_rows.h"
#include "sysid/inverse_dynamics/equation_search.h"
#include "sysid/inverse_dynamics/estimate.h"
#include "sysid/inverse_dynamics/filter_choice.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "sysid/inverse_dynamics/motion.h"
#include "sysid/inverse_dynamics/regression.h"
#include "sysid/parameters/free_bodies.h"

namespace sysid {
namespace {

// A model and candidates, as columns of the equations of all runs.
class ColumnsOfRuns {
 public:
  // All must outlive it.
  ColumnsOfRuns(const ShootingProblem& problem, const Model& start,
                const std::vector<FreeParameter>& free,
                const std::vector<std::shared_ptr<const Effect>>& candidates,
                const std::set<std::string>& known,
                const std::vector<int>& undriven)
      : problem_(problem),
        start_(start),
        free_(free),
        undriven_(undriven),
        columns_(MakeEquationColumns(start, free, candidates, known)),
        map_(columns_.model, columns_.parameters, false),
        theta_(map_.size()) {
    std::vector<std::string> names;
    for (int i = 0; i < map_.size(); ++i) {
      theta_[i] = map_.parameters()[i].nominal;
      names.push_back(map_.parameters()[i].name);
    }
    gains_ = EffortGains(columns_.model, undriven_, names);
  }
  // Of the links that move, those of a possible body and of which nothing is
  // free already.
  void AskBodies() {
    if (!HasInertialColumns(Workspace<double>(start_))) return;
    std::set<int> asked;
    for (int i = 0; i < columns_.free; ++i) {
      const Parameter& p = columns_.parameters[i];
      if (p.kind >= ParameterKind::kMass &&
          p.kind <= ParameterKind::kInertiaScale) {
        asked.insert(p.index);
      }
    }
    const std::vector<Inertial<double>>& bodies = start_.nominal().links;
    std::vector<Eigen::MatrixXd> beliefs;
    for (int link = 0; link < static_cast<int>(bodies.size()); ++link) {
      if (asked.contains(link) || start_.placement(link).body < 0) continue;
      const Eigen::MatrixXd curvature = EntropyCurvature(bodies[link]);
      if (curvature.size() == 0) continue;
      links_.push_back(link);
      beliefs.push_back(kBodyWeight * curvature);
    }
    bodies_.columns = kTen * static_cast<int>(links_.size());
    bodies_.belief = Eigen::MatrixXd::Zero(bodies_.columns, bodies_.columns);
    for (size_t i = 0; i < beliefs.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(kTen * i);
      bodies_.belief.block<kTen, kTen>(at, at) = beliefs[i];
    }
  }

  const Model& model() const { return columns_.model; }
  const std::vector<int>& links() const { return links_; }  // of AskBodies()
  int candidates() const {
    return static_cast<int>(columns_.candidates.size());
  }
  std::vector<EquationRows> Rows(const EquationFilter& filter) const {
    std::vector<EquationRows> rows;
    for (const auto& data : problem_.runs()) {
      rows.push_back(RowsOf(data->run, filter));
    }
    return rows;
  }
  std::unique_ptr<EquationSearch> Search(const std::vector<EquationRows>& rows,
                                         const std::vector<int>& silent,
                                         bool bodies_are_free) const {
    auto search = std::make_unique<EquationSearch>(
        columns_, free_, theta_, gains_, rows, bodies_, silent,
        [this] { ThrowIfCancelled(problem_.options().stop); });
    search->Run(bodies_are_free);
    return search;
  }
  MechanismParameters<double> ValuesOf(const EquationSearch& search) const {
    return ValuesAt(ThetaOf(search));
  }
  std::vector<ScreenedEffect> EffectsOf(const EquationSearch& search,
                                        const EquationFilter& filter) const {
    std::vector<ScreenedEffect> effects;
    const Eigen::VectorXd changes = search.Changes();
    int i = columns_.free;
    for (const int k : search.chosen()) {
      const EquationColumns::Candidate& candidate = columns_.candidates[k];
      ScreenedEffect effect;
      effect.effect = candidate.effect;
      effect.dof = candidate.count;
      effect.p_value = search.p_value(k);
      for (int c = 0; c < candidate.count; ++c, ++i) {
        const int column = candidate.first + c;
        const Parameter& parameter = columns_.parameters[column];
        // Some columns are zero only where the law is off (the reference of a
        // spring).
        if (search.IsZero(column) && !MovesAnything(search, column, filter)) {
          effect.without_influence.push_back(parameter.name);
          --effect.dof;
          continue;
        }
        ExpectedParameter expected;
        expected.name = parameter.name;
        expected.unit = parameter.unit;
        expected.null_value = theta_[column];
        expected.value = expected.null_value + changes[i];
        expected.std_error = search.Deviation(i);
        effect.parameters.push_back(expected);
      }
      effects.push_back(std::move(effect));
    }
    return effects;
  }

 private:
  Eigen::VectorXd ThetaOf(const EquationSearch& search) const {
    const Eigen::VectorXd changes = search.Changes();
    Eigen::VectorXd theta = theta_;
    for (size_t i = 0; i < search.now().at.size(); ++i) {
      const int at = search.now().at[i];
      if (at < theta.size()) theta[at] += changes[static_cast<Eigen::Index>(i)];
    }
    return theta;
  }
  MechanismParameters<double> ValuesAt(const Eigen::VectorXd& theta) const {
    MechanismParameters<double> values;
    map_.Apply<double>(theta.data(), &values);
    return values;
  }

  // Whether the equations have a derivative by a parameter where a search
  // ended.
  bool MovesAnything(const EquationSearch& search, int column,
                     const EquationFilter& filter) const {
    constexpr double kStep = 1e-3, kRounding = 1e-12;
    Eigen::VectorXd above = ThetaOf(search), below = above;
    above[column] += kStep;
    below[column] -= kStep;
    return std::any_of(
        problem_.runs().begin(), problem_.runs().end(), [&](const auto& data) {
          const SampledMotion sampled =
              SampleMotion(columns_.model, data->run, filter);
          const auto rows = [&](const Eigen::VectorXd& at) {
            return EvaluateEquations(columns_.model, sampled, ValuesAt(at),
                                     undriven_)
                .rows;
          };
          const RowMatrixXd lower = rows(below);
          return (rows(above) - lower).norm() > kRounding * lower.norm();
        });
  }

  EquationRows RowsOf(const Run& run, const EquationFilter& filter) const {
    ThrowIfCancelled(problem_.options().stop);
    const Seeding<Jet24> seeding = [&](int begin,
                                       MechanismParameters<Jet24>* s) {
      std::vector<Jet24> seeded(theta_.data(), theta_.data() + theta_.size());
      const int end = std::min<int>(begin + Jet24::DIMENSION, map_.size());
      for (int i = begin; i < end; ++i) seeded[i] = Jet24(theta_[i], i - begin);
      map_.Apply<Jet24>(seeded.data(), s);
    };
    const int threads = problem_.options().threads;
    const SampledMotion sampled =
        SampleMotion(columns_.model, run, filter, threads);
    EquationRows rows = MakeEquationRows<Jet24>(
        columns_.model, sampled, map_.size(), seeding,
        {columns_.model.nominal(), {}, undriven_}, threads);
    if (!links_.empty()) AddBodies(sampled, threads, &rows);
    NormaliseByGain(gains_, theta_, &rows);
    return rows;
  }

  // The columns of bodies before the last, r. Effects that are off, or do not
  // depend on bodies, do not change them.
  void AddBodies(const SampledMotion& sampled, int threads,
                 EquationRows* rows) const {
    const EquationRows own = MakeEquationRows<double>(
        start_, sampled, bodies_.columns,
        [&](int, MechanismParameters<double>* s) { *s = start_.nominal(); },
        {start_.nominal(), links_, undriven_}, threads);
    const Eigen::Index r = rows->rows.cols() - 1;
    RowMatrixXd all(rows->rows.rows(), r + bodies_.columns + 1);
    all << rows->rows.leftCols(r), own.rows.leftCols(bodies_.columns),
        rows->rows.rightCols<1>();
    rows->rows = std::move(all);
  }

  static constexpr int kTen = 10;
  const ShootingProblem& problem_;
  const Model& start_;
  const std::vector<FreeParameter>& free_;
  const std::vector<int>& undriven_;
  const EquationColumns columns_;
  const ParameterMap map_;
  Eigen::VectorXd theta_;  // off
  std::vector<int> gains_;
  std::vector<int> links_;
  EquationSearch::Bodies bodies_;
};

// What is left of each joint, on the velocity of each other one, its sign and
// its acceleration: how much of what the joint's own three leave they explain.
std::vector<FollowedMotion> MotionsThatAreFollowed(
    const EquationSearch::Trial& now, const std::vector<EquationRows>& runs,
    const std::vector<std::string>& names, const std::vector<int>& silent) {
  constexpr double kMost = 0.5;  // of what is left
  const int nv = static_cast<int>(names.size());
  const auto left = [&](const EquationRows& rows, int time, int v) {
    const auto row = rows.rows.row(time * nv + v);
    double r = row[rows.rows.cols() - 1];
    for (size_t i = 0; i < now.at.size(); ++i) {
      r += row[now.at[i]] * now.d[i];
    }
    return r;
  };
  const auto motion = [&](const EquationRows& rows, int time, int w) {
    const double speed = rows.qd(time, w);
    return Eigen::Vector3d(speed, std::copysign(1.0, speed), rows.qdd(time, w));
  };
  // The squares of joint v that the motion of some joints leaves.
  const auto squares = [&](int v, const std::vector<int>& joints) {
    const int n = 3 * static_cast<int>(joints.size());
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(n), a(n);
    double sum = 0.0;
    for (const EquationRows& rows : runs) {
      for (int t = 0; t < rows.times(); ++t) {
        for (size_t k = 0; k < joints.size(); ++k) {
          a.segment<3>(static_cast<Eigen::Index>(3 * k)) =
              motion(rows, t, joints[k]);
        }
        const double r = left(rows, t, v);
        G += a * a.transpose();
        g += a * r;
        sum += r * r;
      }
    }
    return sum - g.dot(SolveScaled(G, g));
  };
  std::vector<FollowedMotion> followed;
  for (int v = 0; v < nv; ++v) {
    if (std::find(silent.begin(), silent.end(), v) != silent.end()) continue;
    const double own = squares(v, {v});
    FollowedMotion best;
    for (int w = 0; w < nv; ++w) {
      if (w == v) continue;
      const double share = own > 0.0 ? 1.0 - squares(v, {v, w}) / own : 0.0;
      if (share > best.share) best = {names[v], names[w], share};
    }
    if (best.share > kMost) followed.push_back(best);
  }
  return followed;
}

// The plain laws that a model has, from its values, but for what is free
// already or known.
std::vector<FreeParameter> GivenPlainLaws(
    const Model& model, const std::vector<FreeParameter>& free,
    const std::set<std::string>& known) {
  std::set<std::string> taken = known;
  for (const FreeParameter& one : free) taken.insert(one.parameter.name);
  std::vector<FreeParameter> laws;
  for (int i = 0; i < model.effects().size(); ++i) {
    if (!IsPlainLaw(model.effects().effect(i))) continue;
    for (const EffectParameter& own : model.effects().effect(i).parameters()) {
      if (own.whole || taken.contains(own.name)) continue;
      const Parameter p = FindParameters(model, {own.name}, "effects").front();
      laws.push_back({p, p.nominal, p.lower, p.upper, std::nullopt});
    }
  }
  return laws;
}

bool IsMeasured(const Model& model, const DataSet& data) {
  return std::all_of(data.runs().begin(), data.runs().end(),
                     [&](const auto& one) {
                       return UnmeasuredJoints(model, one->run).empty() &&
                              one->run.effort.size() > 0 &&
                              (one->run.effort.array() != 0.0).any();
                     });
}

}  // namespace

void AddWhatArmsHave(const EquationLook& look, const Model& model,
                     std::vector<FreeParameter>* free,
                     EstimationOptions* options) {
  for (const FreeParameter& law : look.given_laws) {
    free->push_back(law);
    // By its place in this model.
    free->back().parameter =
        FindParameters(model, {law.parameter.name}, "effects").front();
  }
  for (FreeParameter& body : FreeBodies(model, look.bodies)) {
    free->push_back(std::move(body));
  }
  if (!look.bodies.empty()) options->body_weight = kBodyWeight;
  for (const RejectedEffort& rejected : look.rejected) {
    options->no_efforts.push_back(rejected.v);
  }
}

EquationLook LookByEquations(
    const ShootingProblem& problem,
    const std::vector<std::shared_ptr<const Effect>>& candidates,
    const std::set<std::string>& known, int few) {
  // Internal states are no part of the equations of one instant.
  if (!IsMeasured(problem.model(), problem.data()) ||
      problem.model().layout().nz() > 0) {
    return {};
  }
  const ShootingProblem started = StartByInverseDynamics(problem);
  MechanismParameters<double> values;
  started.map().Apply<double>(started.InitialTheta().data(), &values);
  Model start = started.model();
  start.SetNominal(values);
  std::vector<const Run*> runs;
  for (const auto& data : problem.runs()) runs.push_back(&data->run);
  const std::vector<int> undriven = UndrivenJoints(started);
  const std::vector<std::string> joints = VelocityNames(start);
  EquationLook look;
  std::vector<int> silent;

  // With a slow filter, and what every driven joint has: is it an arm, which
  // efforts are none, and what filter do its equations want?
  const EquationFilter first = FirstFilter(runs);
  std::vector<std::shared_ptr<const Effect>> plain;
  std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(plain),
               [](const auto& effect) { return IsPlainLaw(*effect); });
  EquationFilter filter;
  std::vector<FreeParameter> free = problem.free();
  {
    look.given_laws = GivenPlainLaws(start, free, known);
    std::vector<FreeParameter> with = free;
    with.insert(with.end(), look.given_laws.begin(), look.given_laws.end());
    const ColumnsOfRuns columns(problem, start, with, plain, known, undriven);
    const std::vector<EquationRows> rows = columns.Rows(first);
    auto found = columns.Search(rows, silent, false);
    look.is_arm =
        static_cast<int>(found->chosen().size() + look.given_laws.size()) > few;
    if (!look.is_arm) {
      look.given_laws.clear();
    } else {
      const std::vector<EffortAudit> audits = AuditEfforts(rows);
      for (int v = 0; v < static_cast<int>(audits.size()); ++v) {
        VLOG(1) << joints[v] << ": explained " << audits[v].explained
                << ", scale " << audits[v].scale << ", rigid "
                << audits[v].rigid;
        if (audits[v].IsEffort() ||
            std::find(undriven.begin(), undriven.end(), v) != undriven.end()) {
          continue;
        }
        silent.push_back(v);
        look.rejected.push_back({joints[v], v, audits[v].explained});
        std::erase_if(look.given_laws, [&](const FreeParameter& law) {
          return law.parameter.name.starts_with(joints[v] + ".");
        });
      }
      if (!silent.empty()) found = columns.Search(rows, silent, false);
      free.insert(free.end(), look.given_laws.begin(), look.given_laws.end());
    }
    filter = ChooseFilter(columns.model(), columns.ValuesOf(*found), runs,
                          first, problem.options().threads);
  }

  std::vector<std::shared_ptr<const Effect>> asked = candidates;
  if (look.is_arm) {
    // All bodies are asked together: none of them is an effect.
    std::erase_if(asked, [](const auto& effect) {
      return !effect->adjusts_nominal().empty();
    });
  }
  ColumnsOfRuns columns(problem, start, free, asked, known, undriven);
  if (look.is_arm) columns.AskBodies();
  const std::vector<EquationRows> rows = columns.Rows(filter);
  auto found = columns.Search(rows, silent, false);
  if (look.is_arm && !columns.links().empty()) {
    auto freely = columns.Search(rows, silent, true);
    // Laws that only the given bodies need stand in for others.
    if (found->IsBeatenBy(freely.get()) ||
        (freely->special_laws() < found->special_laws() &&
         !freely->IsBeatenBy(found.get()))) {
      found = std::move(freely);
      look.bodies = columns.links();
    }
  }
  look.effects = columns.EffectsOf(*found, filter);
  look.tests = columns.candidates();
  look.followed = MotionsThatAreFollowed(found->now(), rows, joints, silent);
  return look;
}

}  // namespace sysid
