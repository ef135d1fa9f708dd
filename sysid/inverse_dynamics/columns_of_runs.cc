#include "sysid/inverse_dynamics/columns_of_runs.h"

#include <algorithm>
#include <utility>

#include "models/inertial_columns.h"
#include "models/parameters.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/inverse_dynamics/estimate.h"
#include "sysid/inverse_dynamics/regression.h"
#include "sysid/parameters/free_bodies.h"

namespace sysid {
namespace {

constexpr int kTen = 10;  // coordinates of a link

// Whether some column along the i-th parameter acts on a joint; what is
// searched, or follows from the weights of several columns, has none.
bool IsSeen(const EquationModels& models,
            const EquationColumns::Candidate& candidate, int i) {
  const auto probes = static_cast<int>(candidate.probes.size());
  const auto own = static_cast<int>(candidate.effect->parameters().size());
  if (i >= own) return !models.IsZero(candidate.first + probes + i - own);
  bool any = false;
  for (int c = 0; c < probes; ++c) {
    if (candidate.probes[c].along != i) continue;
    any = true;
    if (!models.IsZero(candidate.first + c)) return true;
  }
  return !any;
}

}  // namespace

ModelledEfforts::ModelledEfforts(const EquationRows& rows,
                                 const EquationModels::Fit& fit,
                                 const std::vector<int>& undriven)
    : t_(rows.t), u_(rows.effort) {
  const Eigen::Index last = rows.rows.cols() - 1;
  for (Eigen::Index i = 0; i < rows.rows.rows(); ++i) {
    const auto v = static_cast<int>(i % rows.nv);
    // Of those the equations are of accelerations.
    if (std::find(undriven.begin(), undriven.end(), v) != undriven.end()) {
      continue;
    }
    u_(i / rows.nv, v) -=
        rows.rows(i, last) + rows.rows.row(i)(fit.at).dot(fit.d);
  }
}

RowMatrixXd ModelledEfforts::At(const SampledMotion& sampled) const {
  RowMatrixXd efforts = sampled.run.effort;
  for (int k = 0; !t_.empty() && k < sampled.size(); ++k) {
    const double time = sampled.run.t[k] + 0.5 * sampled.step;
    const auto after = std::upper_bound(t_.begin(), t_.end(), time);
    if (after == t_.begin() || after == t_.end()) {
      efforts.row(k) =
          after == t_.begin() ? u_.topRows<1>() : u_.bottomRows<1>();
      continue;
    }
    const auto i = after - t_.begin();
    const double part = (time - t_[i - 1]) / (t_[i] - t_[i - 1]);
    efforts.row(k) = (1.0 - part) * u_.row(i - 1) + part * u_.row(i);
  }
  return efforts;
}

ColumnsOfRuns::ColumnsOfRuns(
    const ShootingProblem& problem, const Model& start,
    const std::vector<FreeParameter>& free,
    const std::vector<std::shared_ptr<const Effect>>& candidates,
    const std::set<std::string>& known, const std::vector<int>& undriven,
    bool all_laws)
    : problem_(problem),
      start_(start),
      free_(free),
      undriven_(undriven),
      columns_(MakeEquationColumns(start, free, candidates, known, all_laws)),
      gains_(EffortGains(model(), undriven_, columns_.names)) {
  for (const EquationColumns::Pass& pass : columns_.passes) {
    maps_.emplace_back(pass.model, pass.parameters, false);
  }
}

void ColumnsOfRuns::AskBodies() {
  if (!HasInertialColumns(Workspace<double>(start_))) return;
  std::set<int> asked;
  for (int i = 0; i < columns_.free; ++i) {
    const Parameter& p = free_[i].parameter;
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

std::vector<EquationRows> ColumnsOfRuns::Rows(
    const EquationFilter& filter,
    const std::vector<ModelledEfforts>* efforts) const {
  std::vector<EquationRows> rows;
  for (size_t i = 0; i < problem_.runs().size(); ++i) {
    rows.push_back(RowsOf(problem_.runs()[i]->run, filter,
                          efforts != nullptr ? &(*efforts)[i] : nullptr));
  }
  return rows;
}

std::unique_ptr<EquationSearch> ColumnsOfRuns::Search(
    const std::vector<EquationRows>& rows, const std::vector<int>& silent,
    bool bodies_are_free, int most) const {
  auto search = std::make_unique<EquationSearch>(
      std::make_unique<EquationModels>(columns_, free_, gains_, rows, bodies_,
                                       silent, bodies_are_free),
      [this] { ThrowIfCancelled(problem_.options().stop); });
  search->Run(most);
  return search;
}

MechanismParameters<double> ColumnsOfRuns::ValuesOf(
    const EquationSearch& search) const {
  const EquationColumns::Pass& pass = columns_.passes[0];
  const Eigen::VectorXd changes = search.models().Changes(search.now());
  Eigen::VectorXd theta = columns_.at(pass.columns);
  for (size_t i = 0; i < search.now().at.size(); ++i) {
    const auto at =
        std::find(pass.columns.begin(), pass.columns.end(), search.now().at[i]);
    if (at != pass.columns.end()) {
      theta[at - pass.columns.begin()] += changes[static_cast<Eigen::Index>(i)];
    }
  }
  MechanismParameters<double> values;
  maps_[0].Apply<double>(theta.data(), &values);
  return values;
}

bool ColumnsOfRuns::ReadEfforts(const EquationSearch& search) const {
  return std::any_of(
      search.chosen().begin(), search.chosen().end(), [this](int k) {
        return (columns_.candidates[k].effect->hooks() & kReadsEffort) != 0;
      });
}

std::vector<ScreenedEffect> ColumnsOfRuns::EffectsOf(
    EquationSearch* search) const {
  std::vector<ScreenedEffect> effects;
  for (const int k : search->chosen()) {
    const EquationColumns::Candidate& candidate = columns_.candidates[k];
    const auto [values, std_errors] = search->EstimateOf(k);
    ScreenedEffect effect;
    effect.effect = candidate.effect;
    effect.dof = candidate.count;
    effect.p_value = search->p_value(k);
    for (size_t i = 0; i < values.size(); ++i) {
      const Parameter& parameter = candidate.parameters[i];
      if (!IsSeen(search->models(), candidate, static_cast<int>(i))) {
        effect.without_influence.push_back(parameter.name);
        --effect.dof;
        continue;
      }
      const std::vector<EffectParameter>& own = candidate.effect->parameters();
      ExpectedParameter expected;
      expected.name = parameter.name;
      expected.unit = parameter.unit;
      expected.null_value =
          i < own.size() ? own[i].null_value : parameter.nominal;
      expected.value = values[i];
      expected.searched = i < own.size() && !own[i].grid.empty();
      expected.std_error = std_errors[i];
      effect.parameters.push_back(expected);
    }
    effects.push_back(std::move(effect));
  }
  return effects;
}

EquationRows ColumnsOfRuns::RowsOf(const Run& run, const EquationFilter& filter,
                                   const ModelledEfforts* efforts) const {
  ThrowIfCancelled(problem_.options().stop);
  const int threads = problem_.options().threads;
  SampledMotion sampled = SampleMotion(model(), run, filter, threads);
  for (const EquationColumns::Pass& pass : columns_.passes) {
    ReadDryFriction(pass.model, &sampled);
  }
  EquationRows rows = RowsOfPass(0, sampled);
  RowMatrixXd all = RowMatrixXd::Zero(rows.rows.rows(),
                                      columns_.size() + bodies_.columns + 1);
  all(Eigen::all, columns_.passes[0].columns) =
      rows.rows.leftCols(rows.rows.cols() - 1);
  all.rightCols<1>() = rows.rows.rightCols<1>();
  for (size_t i = 1; i < columns_.passes.size(); ++i) {
    ThrowIfCancelled(problem_.options().stop);
    const EquationColumns::Pass& pass = columns_.passes[i];
    SampledMotion loaded;
    if (pass.reads_effort && efforts != nullptr) {
      loaded = sampled;
      loaded.run.effort = efforts->At(sampled);
    }
    const EquationRows more =
        RowsOfPass(i, loaded.size() > 0 ? loaded : sampled);
    // A law that has no value somewhere tells nothing.
    if (more.t != rows.t) continue;
    all(Eigen::all, pass.columns) = more.rows.leftCols(more.rows.cols() - 1);
  }
  if (!links_.empty()) {
    all.middleCols(columns_.size(), bodies_.columns) =
        BodyColumns(sampled, threads);
  }
  rows.rows = std::move(all);
  NormaliseByGain(gains_, columns_.at, &rows);
  return rows;
}

EquationRows ColumnsOfRuns::RowsOfPass(size_t i,
                                       const SampledMotion& sampled) const {
  const EquationColumns::Pass& pass = columns_.passes[i];
  const ParameterMap& map = maps_[i];
  const Eigen::VectorXd theta = columns_.at(pass.columns);
  const Seeding<Jet24> seeding = [&](int begin, MechanismParameters<Jet24>* s) {
    std::vector<Jet24> seeded(theta.data(), theta.data() + theta.size());
    const int end = std::min<int>(begin + Jet24::DIMENSION, map.size());
    for (int k = begin; k < end; ++k) seeded[k] = Jet24(theta[k], k - begin);
    map.Apply<Jet24>(seeded.data(), s);
  };
  return MakeEquationRows<Jet24>(pass.model, sampled, map.size(), seeding,
                                 {pass.model.nominal(), {}, undriven_},
                                 problem_.options().threads);
}

// Effects that are off, or do not depend on bodies, do not change them.
RowMatrixXd ColumnsOfRuns::BodyColumns(const SampledMotion& sampled,
                                       int threads) const {
  return MakeEquationRows<double>(
             start_, sampled, bodies_.columns,
             [&](int, MechanismParameters<double>* s) {
               *s = start_.nominal();
             },
             {start_.nominal(), links_, undriven_}, threads)
      .rows.leftCols(bodies_.columns);
}

}  // namespace sysid
