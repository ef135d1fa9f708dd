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
#include "sysid/inverse_dynamics/columns_of_runs.h"
#include "sysid/inverse_dynamics/effort_audit.h"
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

// What is left of each joint, on the velocity of each other one, its sign and
// its acceleration: how much of what the joint's own three leave they explain.
std::vector<FollowedMotion> MotionsThatAreFollowed(
    const EquationModels::Fit& now, const std::vector<EquationRows>& runs,
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
  std::vector<ModelledEfforts> efforts;  // by run
  std::vector<FreeParameter> free = problem.free();
  {
    look.given_laws = GivenPlainLaws(start, free, known);
    std::vector<FreeParameter> with = free;
    with.insert(with.end(), look.given_laws.begin(), look.given_laws.end());
    ColumnsOfRuns columns(problem, start, with, plain, known, undriven, false);
    columns.AskBodies();
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
    if (look.is_arm) found = columns.Search(rows, silent, true);
    for (const EquationRows& run : rows) {
      efforts.emplace_back(run, found->now(), undriven);
    }
  }

  VLOG(1) << "filter of " << filter.average << " s";
  std::vector<std::shared_ptr<const Effect>> asked = candidates;
  if (look.is_arm) {
    // All bodies are asked together: none of them is an effect.
    std::erase_if(asked, [](const auto& effect) {
      return !effect->adjusts_nominal().empty();
    });
  }
  ColumnsOfRuns columns(problem, start, free, asked, known, undriven,
                        look.is_arm);
  if (look.is_arm) columns.AskBodies();
  std::vector<EquationRows> rows;
  std::unique_ptr<EquationSearch> found;
  const auto search = [&] {
    rows = columns.Rows(filter, &efforts);
    const bool first = found == nullptr;
    const bool asks = look.is_arm && !columns.links().empty();
    if (!first || !asks) {
      found = columns.Search(rows, silent, !look.bodies.empty());
      return;
    }
    auto freely = columns.Search(rows, silent, true);
    // Laws that only the given bodies need stand in for others: where there are
    // more of them, it need not go on.
    found = columns.Search(rows, silent, false, freely->special_laws());
    if (found->IsBeatenBy(freely.get()) ||
        (freely->special_laws() < found->special_laws() &&
         !freely->IsBeatenBy(found.get()))) {
      found = std::move(freely);
      look.bodies = columns.links();
    }
  };
  // Laws that read efforts read those of a model without them: once more, with
  // those of the model that has them.
  constexpr int kMostTimes = 3;
  for (int i = 0; i < kMostTimes; ++i) {
    search();
    if (!look.is_arm || !columns.ReadEfforts(*found)) break;
    efforts.clear();
    for (const EquationRows& run : rows) {
      efforts.emplace_back(run, found->now(), undriven);
    }
  }
  look.effects = columns.EffectsOf(found.get());
  look.tests = columns.candidates();
  look.followed = MotionsThatAreFollowed(found->now(), rows, joints, silent);
  return look;
}

}  // namespace sysid
