#include "sysid/inverse_dynamics/equation_rows.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/dynamics.h"
#include "models/effects/coulomb_friction.h"
#include "models/inertial_columns.h"
#include "models/joint_part.h"
#include "residuals/acting_inputs.h"

namespace sysid {
namespace {

// Of the times at which (11.2) is evaluated, a width of g.
constexpr int kSteps = 3;
const int kReachSteps = static_cast<int>(kGaussianReach * kSteps);

// The true position of what was measured: effects add to it what they add to
// the true one.
template <typename T>
void Unmeasure(const Workspace<T>& ws, const MotionSample& motion,
               std::vector<T>* q) {
  const Eigen::VectorXd& measured = motion.q;
  for (int i = 0; i < measured.size(); ++i) (*q)[i] = T(measured[i]);
  if (ws.measurement_effects.empty()) return;
  std::vector<T> again = *q;
  const std::vector<T> qd(motion.qd.begin(), motion.qd.end());
  const std::vector<T> qdd(motion.qdd.begin(), motion.qdd.end());
  ws.ModifyMeasurement(qd.data(), qdd.data(), again.data());
  for (int i = 0; i < measured.size(); ++i) {
    (*q)[i] = T(2.0 * measured[i]) - again[i];
  }
}

// Friction by the law itself where a joint's direction is known.
template <typename T>
void SetDryModes(const SampledMotion& grid, const MotionSample& motion,
                 Workspace<T>* ws) {
  for (const int i : ws->dry_bodies) {
    const int v = ws->model().bodies()[i].v_index;
    ws->bodies[i].dry = std::abs(motion.qd[v]) < grid.slowest[v]
                            ? DryMode::kSmoothed
                        : motion.qd[v] > 0.0 ? DryMode::kForward
                                             : DryMode::kBackward;
  }
}

// (11.10) of each time, before the Gaussian.
struct Unknown {
  Eigen::VectorXd e;        // of the undriven joints
  Eigen::VectorXd qdd;      // nv: qdd, with qdd_u + e_u
  Eigen::MatrixXd inverse;  // of M_uu
};

std::vector<Unknown> SolveAccelerations(const Model& model,
                                        const SampledMotion& grid,
                                        const PlainPart& plain) {
  const std::vector<int>& at = plain.undriven;
  if (at.empty()) return {};
  std::vector<Unknown> solved(grid.size());
  std::vector<double> q(model.nq()), u(model.held_size());
  Eigen::VectorXd qdd, needed(model.nv()), moved(model.nv());
  Workspace<double> ws(model);
  ws.SetParameters(plain.values);
  for (size_t k = 0; k < solved.size(); ++k) {
    const MotionSample& motion = grid.motion[k];
    if (!motion.known) continue;
    Unmeasure(ws, motion, &q);
    SetDryModes(grid, motion, &ws);
    ActingInputs<double>(grid.run, ws, static_cast<int>(k), grid.run.t[k],
                         grid.step, u.data());
    const auto need = [&](Eigen::VectorXd* out) {
      InverseDynamics<double>(&ws, q.data(), motion.qd.data(), qdd.data(),
                              u.data(), out->data());
    };
    qdd = motion.qdd;
    need(&needed);
    Eigen::MatrixXd M_uu(at.size(), at.size());
    Eigen::VectorXd r_u(at.size());
    for (size_t i = 0; i < at.size(); ++i) {
      r_u[i] = u[at[i]] - needed[at[i]];
      qdd[at[i]] += 1.0;
      need(&moved);
      qdd[at[i]] = motion.qdd[at[i]];
      M_uu.col(i) = (moved - needed)(at);
    }
    solved[k].inverse = M_uu.inverse();
    solved[k].e = solved[k].inverse * r_u;
    solved[k].qdd = motion.qdd;
    solved[k].qdd(at) += solved[k].e;
  }
  return solved;
}

// Joints, and the accelerations at which their equations are linearised.
struct Pass {
  std::vector<int> joints;
  bool solved;
};

std::vector<Pass> Passes(int nv, const std::vector<int>& undriven) {
  std::vector<int> driven;
  for (int v = 0; v < nv; ++v) {
    if (std::find(undriven.begin(), undriven.end(), v) == undriven.end()) {
      driven.push_back(v);
    }
  }
  std::vector<Pass> passes;
  if (!driven.empty()) passes.push_back({driven, false});
  if (!undriven.empty()) passes.push_back({undriven, true});
  return passes;
}

// Columns of dr by the inertial parameters of links, (2.30), ten a link, of
// each time and joint. Returns the inverse dynamics, times x nv.
RowMatrixXd AddInertialColumns(const Model& model, const SampledMotion& grid,
                               const PlainPart& plain,
                               const std::vector<Pass>& passes,
                               const std::vector<Unknown>& solved,
                               RowMatrixXd* rows) {
  constexpr int kTen = 10;
  const int nv = model.nv();
  std::vector<double> q(model.nq());
  RowMatrixXd needed = RowMatrixXd::Zero(grid.size(), nv);
  std::vector<double> held(model.held_size());
  Workspace<double> ws(model);
  ws.SetParameters(plain.values);
  Eigen::VectorXd efforts(nv);
  RowMatrixXd columns(nv, kTen);
  for (int k = 0; k < grid.size(); ++k) {
    const MotionSample& motion = grid.motion[k];
    if (!motion.known) continue;
    Unmeasure(ws, motion, &q);
    SetDryModes(grid, motion, &ws);
    ActingInputs<double>(grid.run, ws, k, grid.run.t[k], grid.step,
                         held.data());
    for (const Pass& pass : passes) {
      const Eigen::VectorXd& qdd = pass.solved ? solved[k].qdd : motion.qdd;
      InverseDynamics<double>(&ws, q.data(), motion.qd.data(), qdd.data(),
                              held.data(), efforts.data());
      for (const int v : pass.joints) needed(k, v) = efforts[v];
      for (size_t i = 0; i < plain.links.size(); ++i) {
        InertialColumns(ws, plain.links[i], columns);
        for (const int v : pass.joints) {
          rows->row(k * nv + v).segment<kTen>(kTen * i) = -columns.row(v);
        }
      }
    }
  }
  return needed;
}

// [dr | r | u] before the Gaussian, of each time and joint. Derivatives by
// the inertial part where the model has them, by Jets of the rest: of (2.31)
// alone where nothing else varies.
template <typename T>
RowMatrixXd Unfiltered(const Model& model, const SampledMotion& grid,
                       int columns, const Seeding<T>& seeding,
                       const PlainPart& plain, double* work) {
  constexpr bool kJets = !std::is_same_v<T, double>;
  const int nv = model.nv();
  RowMatrixXd rows = RowMatrixXd::Zero(grid.size() * nv, columns + 2);
  std::vector<T> q(model.nq()), qd(nv), qdd(nv), u(model.held_size()),
      needed(nv);
  MechanismParameters<T> values;
  Workspace<T> ws(model);
  const std::vector<Pass> passes = Passes(nv, plain.undriven);
  const std::vector<Unknown> solved = SolveAccelerations(model, grid, plain);
  int first = 0;      // column by Jets
  RowMatrixXd known;  // the inverse dynamics, where `first` > 0
  if (!plain.links.empty() && HasInertialColumns(Workspace<double>(model))) {
    first = 10 * static_cast<int>(plain.links.size());
    known = AddInertialColumns(model, grid, plain, passes, solved, &rows);
  }
  for (int begin = first; begin == first || begin < columns;) {
    *work += grid.size();
    seeding(begin, &values);
    ws.SetParameters(values);
    const bool joints_alone = first > 0 && OnlyJointPartVaries(ws);
    for (int k = 0; k < grid.size(); ++k) {
      const MotionSample& motion = grid.motion[k];
      if (!motion.known) continue;
      Unmeasure(ws, motion, &q);
      for (int v = 0; v < nv; ++v) qd[v] = T(motion.qd[v]);
      SetDryModes(grid, motion, &ws);
      ActingInputs<T>(grid.run, ws, k, grid.run.t[k], grid.step, u.data());
      for (const Pass& pass : passes) {
        const Eigen::VectorXd& moved = pass.solved ? solved[k].qdd : motion.qdd;
        for (int v = 0; v < nv; ++v) qdd[v] = T(moved[v]);
        if (joints_alone) {
          JointPart<T>(&ws, q.data(), qd.data(), qdd.data(), u.data(),
                       needed.data());
        } else {
          InverseDynamics<T>(&ws, q.data(), qd.data(), qdd.data(), u.data(),
                             needed.data());
        }
        for (const int v : pass.joints) {
          const T rest = u[v] - needed[v];
          auto row = rows.row(k * nv + v);
          if constexpr (kJets) {
            const int count = std::min<int>(T::DIMENSION, columns - begin);
            for (int c = 0; c < count; ++c) row[begin + c] = rest.v[c];
          }
          row[columns] =
              first > 0 ? ValueOf(u[v]) - known(k, v) : ValueOf(rest);
          row[columns + 1] = ValueOf(u[v]);
        }
      }
    }
    if constexpr (kJets) {
      begin += T::DIMENSION;
    } else {
      break;
    }
  }
  for (size_t k = 0; k < solved.size(); ++k) {
    if (!grid.motion[k].known) continue;
    const std::vector<int>& at = plain.undriven;
    auto of_time = rows.middleRows(static_cast<int>(k) * nv, nv);
    const RowMatrixXd forces = of_time.leftCols(columns)(at, Eigen::all);
    const RowMatrixXd accelerations = solved[k].inverse * forces;
    for (size_t i = 0; i < at.size(); ++i) {
      of_time.row(at[i]).head(columns) = accelerations.row(i);
      of_time(at[i], columns) = solved[k].e[i];
    }
  }
  return rows;
}

// The speeds below which joints with dry friction may rest,
//
//   max(3 s, v_s),                                                   (11.13)
//
// s the standard error of a speed, (11.12), as most times have it: kinks leave
// more; v_s where the law is smoothed.
Eigen::VectorXd SlowestKnown(const Model& model,
                             const std::vector<MotionSample>& motion) {
  constexpr double kErrors = 3.0;
  Eigen::VectorXd slowest = Eigen::VectorXd::Zero(model.nv());
  for (const int i : Workspace<double>(model).dry_bodies) {
    const Body& body = model.bodies()[i];
    std::vector<double> variances;
    for (const MotionSample& sample : motion) {
      if (sample.known) variances.push_back(sample.qd_variance[body.v_index]);
    }
    if (variances.empty()) continue;
    const auto middle = variances.begin() + variances.size() / 2;
    std::nth_element(variances.begin(), middle, variances.end());
    slowest[body.v_index] =
        std::max(kErrors * std::sqrt(*middle),
                 FrictionSmoothingSpeed(body.type == JointType::kPrismatic));
  }
  return slowest;
}

// Samples x nv: true where a joint's direction is not known.
MatrixXb FindSlow(const SampledMotion& sampled) {
  const int nv = static_cast<int>(sampled.slowest.size());
  MatrixXb slow(sampled.size(), nv);
  for (int k = 0; k < sampled.size(); ++k) {
    const MotionSample& motion = sampled.motion[k];
    for (int v = 0; v < nv; ++v) {
      slow(k, v) = motion.known && std::abs(motion.qd[v]) < sampled.slowest[v];
    }
  }
  return slow;
}

}  // namespace

double ReachOf(const EquationFilter& filter) {
  return kReachSteps * filter.average / kSteps;
}

double CutOff(double width) {
  return std::sqrt(std::numbers::ln2) / (2.0 * std::numbers::pi * width);
}

SampledMotion SampleMotion(const Model& model, const Run& run, double from,
                           double to, const EquationFilter& filter) {
  SampledMotion sampled;
  const double step = sampled.step = filter.average / kSteps;
  sampled.bend = filter.motion;
  const int n = static_cast<int>(std::floor((to - from) / step)) + 1;
  if (n < 1) return sampled;
  sampled.run.effort = RowMatrixXd::Zero(n, model.nv());
  for (const Input& input : run.inputs) {
    sampled.run.inputs.push_back({input.name, true, {}});
  }
  MotionSmoother smoother(model, run, filter.motion);
  for (int k = 0; k < n; ++k) {
    const double time = from + k * step;
    sampled.run.t.push_back(time - 0.5 * step);
    MeanEffort(run, time - 0.5 * step, time + 0.5 * step,
               sampled.run.effort.row(k).data());
    for (size_t i = 0; i < run.inputs.size(); ++i) {
      sampled.run.inputs[i].values.push_back(MeanInput(
          run, run.inputs[i].name, time - 0.5 * step, time + 0.5 * step));
    }
    sampled.motion.push_back(smoother.At(time));
  }
  sampled.run.t.push_back(sampled.run.t.back() + step);
  sampled.slowest = SlowestKnown(model, sampled.motion);
  return sampled;
}

SampledMotion SampleMotion(const Model& model, const Run& run,
                           const EquationFilter& filter) {
  return SampleMotion(model, run, run.t.front(), run.t.back(), filter);
}

template <typename T>
EquationRows MakeEquationRows(const Model& model, const SampledMotion& sampled,
                              int columns, const Seeding<T>& seeding,
                              const PlainPart& plain) {
  EquationRows out;
  const int nv = out.nv = model.nv();
  const RowMatrixXd rest =
      Unfiltered<T>(model, sampled, columns, seeding, plain, &out.work);
  const int most = std::max(0, sampled.size() / kSteps + 1);
  out.rows.resize(most * nv, columns + 1);
  out.effort.resize(most, nv);
  out.qd.resize(most, nv);
  out.rests.setConstant(most, nv, false);
  out.qdd.resize(most, nv);
  const MatrixXb slow = FindSlow(sampled);
  // How far the fit of the motion carries a kink.
  const int bend =
      static_cast<int>(std::ceil(kGaussianReach * sampled.bend / sampled.step));
  // g, and all numbers of a time as one row, of which its sums are products.
  Eigen::RowVectorXd g(2 * kReachSteps + 1);
  for (int i = -kReachSteps; i <= kReachSteps; ++i) {
    g[i + kReachSteps] = GaussianWeight(static_cast<double>(i) / kSteps);
  }
  g /= g.sum();
  const int width = nv * (columns + 2);
  const Eigen::Map<const RowMatrixXd> by_time(rest.data(), sampled.size(),
                                              width);
  RowMatrixXd sum(nv, columns + 2);
  for (int k = kReachSteps; k + kReachSteps < sampled.size(); k += kSteps) {
    bool known = true;
    for (int i = -kReachSteps; i <= kReachSteps; ++i) {
      known = known && sampled.motion[k + i].known;
    }
    if (!known) continue;
    Eigen::Map<Eigen::RowVectorXd>(sum.data(), width).noalias() =
        g * by_time.middleRows(k - kReachSteps, g.size());
    if (!sum.allFinite()) continue;
    const int at = out.times();
    const int first = std::max(0, k - kReachSteps - bend);
    const int last = std::min(sampled.size() - 1, k + kReachSteps + bend);
    out.rests.row(at) =
        slow.middleRows(first, last - first + 1).colwise().any();
    out.rows.middleRows(at * nv, nv) = sum.leftCols(columns + 1);
    out.effort.row(at) = sum.col(columns + 1).transpose();
    out.qd.row(at) = sampled.motion[k].qd.transpose();
    out.qdd.row(at) = sampled.motion[k].qdd.transpose();
    out.t.push_back(sampled.run.t[k] + 0.5 * sampled.step);
  }
  out.rows.conservativeResize(out.times() * nv, columns + 1);
  out.effort.conservativeResize(out.times(), nv);
  out.qd.conservativeResize(out.times(), nv);
  out.rests.conservativeResize(out.times(), nv);
  out.qdd.conservativeResize(out.times(), nv);
  return out;
}

EquationRows EvaluateEquations(const Model& model, const SampledMotion& sampled,
                               const MechanismParameters<double>& values,
                               const std::vector<int>& undriven) {
  return MakeEquationRows<double>(
      model, sampled, 0,
      [&](int, MechanismParameters<double>* out) { *out = values; },
      {values, {}, undriven});
}

#define SYSID_INSTANTIATE(T)                                      \
  template EquationRows MakeEquationRows<T>(                      \
      const Model&, const SampledMotion&, int, const Seeding<T>&, \
      const PlainPart&);
SYSID_INSTANTIATE(double)
SYSID_INSTANTIATE(Jet8)
SYSID_INSTANTIATE(Jet24)
#undef SYSID_INSTANTIATE

}  // namespace sysid
