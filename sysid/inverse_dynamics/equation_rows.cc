#include "sysid/inverse_dynamics/equation_rows.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>

#include "models/dynamics.h"
#include "models/effects/coulomb_friction.h"
#include "models/inertial_columns.h"
#include "models/joint_part.h"
#include "models/math/decompositions.h"
#include "residuals/acting_inputs.h"
#include "sysid/estimation/parallel.h"

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

// Times of a grid.
struct Range {
  int first, last;  // last excluded
  int size() const { return last - first; }
};

// (11.10) of each time, before the Gaussian.
struct Unknown {
  Eigen::VectorXd e;        // of the undriven joints
  Eigen::VectorXd qdd;      // nv: qdd, with qdd_u + e_u
  Eigen::MatrixXd inverse;  // of M_uu
};

// By time of the range.
std::vector<Unknown> SolveAccelerations(const Model& model,
                                        const SampledMotion& grid, Range range,
                                        const PlainPart& plain) {
  const std::vector<int>& at = plain.undriven;
  if (at.empty()) return {};
  std::vector<Unknown> all(range.size());
  std::vector<double> q(model.nq()), u(model.held_size());
  Eigen::VectorXd qdd, needed(model.nv()), moved(model.nv());
  Workspace<double> ws(model);
  ws.SetParameters(plain.values);
  for (int k = range.first; k < range.last; ++k) {
    const MotionSample& motion = grid.motion[k];
    if (!motion.known) continue;
    Unmeasure(ws, motion, &q);
    SetDryModes(grid, motion, &ws);
    ActingInputs<double>(grid.run, ws, k, grid.run.t[k], grid.step, u.data());
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
    Unknown& solved = all[k - range.first];
    solved.inverse = InverseOf(M_uu);
    solved.e = solved.inverse * r_u;
    solved.qdd = motion.qdd;
    solved.qdd(at) += solved.e;
  }
  return all;
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
// each time of the range and joint. Returns the inverse dynamics, times x nv.
RowMatrixXd AddInertialColumns(const Model& model, const SampledMotion& grid,
                               Range range, const PlainPart& plain,
                               const std::vector<Pass>& passes,
                               const std::vector<Unknown>& solved,
                               RowMatrixXd* rows) {
  constexpr int kTen = 10;
  const int nv = model.nv();
  std::vector<double> q(model.nq());
  RowMatrixXd needed = RowMatrixXd::Zero(range.size(), nv);
  std::vector<double> held(model.held_size());
  Workspace<double> ws(model);
  ws.SetParameters(plain.values);
  Eigen::VectorXd efforts(nv);
  RowMatrixXd columns(nv, kTen);
  for (int k = range.first; k < range.last; ++k) {
    const MotionSample& motion = grid.motion[k];
    if (!motion.known) continue;
    Unmeasure(ws, motion, &q);
    SetDryModes(grid, motion, &ws);
    ActingInputs<double>(grid.run, ws, k, grid.run.t[k], grid.step,
                         held.data());
    const int i_time = k - range.first;
    for (const Pass& pass : passes) {
      const Eigen::VectorXd& qdd =
          pass.solved ? solved[i_time].qdd : motion.qdd;
      InverseDynamics<double>(&ws, q.data(), motion.qd.data(), qdd.data(),
                              held.data(), efforts.data());
      for (const int v : pass.joints) needed(i_time, v) = efforts[v];
      for (size_t i = 0; i < plain.links.size(); ++i) {
        InertialColumns(ws, plain.links[i], columns);
        for (const int v : pass.joints) {
          rows->row(i_time * nv + v).segment<kTen>(kTen * i) = -columns.row(v);
        }
      }
    }
  }
  return needed;
}

// Sets [dr | r | u] before the Gaussian, of each time of the range and joint.
// Derivatives by the inertial part where the model has them, by Jets of the
// rest: of (2.31) alone where nothing else varies. Returns the evaluations.
template <typename T>
double SetUnfiltered(const Model& model, const SampledMotion& grid, Range range,
                     int columns, const Seeding<T>& seeding,
                     const PlainPart& plain, RowMatrixXd* unfiltered) {
  constexpr bool kJets = !std::is_same_v<T, double>;
  const int nv = model.nv();
  RowMatrixXd& rows = *unfiltered;
  double work = 0.0;
  std::vector<T> q(model.nq()), qd(nv), qdd(nv), u(model.held_size()),
      needed(nv);
  MechanismParameters<T> values;
  Workspace<T> ws(model);
  const std::vector<Pass> passes = Passes(nv, plain.undriven);
  const std::vector<Unknown> solved =
      SolveAccelerations(model, grid, range, plain);
  int first = 0;      // column by Jets
  RowMatrixXd known;  // the inverse dynamics, where `first` > 0
  if (!plain.links.empty() && HasInertialColumns(Workspace<double>(model))) {
    first = 10 * static_cast<int>(plain.links.size());
    known =
        AddInertialColumns(model, grid, range, plain, passes, solved, &rows);
  }
  for (int begin = first; begin == first || begin < columns;) {
    work += range.size();
    seeding(begin, &values);
    ws.SetParameters(values);
    const bool joints_alone = first > 0 && OnlyJointPartVaries(ws);
    for (int k = range.first; k < range.last; ++k) {
      const MotionSample& motion = grid.motion[k];
      if (!motion.known) continue;
      const int i_time = k - range.first;
      Unmeasure(ws, motion, &q);
      for (int v = 0; v < nv; ++v) qd[v] = T(motion.qd[v]);
      SetDryModes(grid, motion, &ws);
      ActingInputs<T>(grid.run, ws, k, grid.run.t[k], grid.step, u.data());
      for (const Pass& pass : passes) {
        const Eigen::VectorXd& moved =
            pass.solved ? solved[i_time].qdd : motion.qdd;
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
          auto row = rows.row(i_time * nv + v);
          if constexpr (kJets) {
            const int count = std::min<int>(T::DIMENSION, columns - begin);
            for (int c = 0; c < count; ++c) row[begin + c] = rest.v[c];
          }
          row[columns] =
              first > 0 ? ValueOf(u[v]) - known(i_time, v) : ValueOf(rest);
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
  for (int i_time = 0; i_time < static_cast<int>(solved.size()); ++i_time) {
    if (!grid.motion[range.first + i_time].known) continue;
    const std::vector<int>& at = plain.undriven;
    auto of_time = rows.middleRows(i_time * nv, nv);
    const RowMatrixXd forces = of_time.leftCols(columns)(at, Eigen::all);
    const RowMatrixXd accelerations = solved[i_time].inverse * forces;
    for (size_t i = 0; i < at.size(); ++i) {
      of_time.row(at[i]).head(columns) = accelerations.row(i);
      of_time(at[i], columns) = solved[i_time].e[i];
    }
  }
  return work;
}

// Where on the grid an average is.
int MiddleOf(int average) { return kReachSteps + average * kSteps; }

// g at the steps of its reach.
const Eigen::RowVectorXd& Weights() {
  static const Eigen::RowVectorXd* const weights = [] {
    auto* g = new Eigen::RowVectorXd(2 * kReachSteps + 1);
    for (int i = -kReachSteps; i <= kReachSteps; ++i) {
      (*g)[i + kReachSteps] = GaussianWeight(static_cast<double>(i) / kSteps);
    }
    *g /= g->sum();
    return g;
  }();
  return *weights;
}

// The rows and the effort of one average, of [dr | r | u] in a range. False
// where something around it is not known.
bool SetAverage(const SampledMotion& sampled, Range range,
                const RowMatrixXd& unfiltered, int average, EquationRows* out) {
  const int nv = out->nv;
  const int first = MiddleOf(average) - kReachSteps;
  for (int k = first; k <= first + 2 * kReachSteps; ++k) {
    if (!sampled.motion[k].known) return false;
  }
  // All numbers of a time as one row, of which its sums are products.
  const int width = nv * static_cast<int>(unfiltered.cols());
  const Eigen::Map<const RowMatrixXd> by_time(unfiltered.data(), range.size(),
                                              width);
  RowMatrixXd sum(nv, unfiltered.cols());
  Eigen::Map<Eigen::RowVectorXd>(sum.data(), width).noalias() =
      Weights() * by_time.middleRows(first - range.first, Weights().size());
  if (!sum.allFinite()) return false;
  out->rows.middleRows(average * nv, nv) = sum.leftCols(sum.cols() - 1);
  out->effort.row(average) = sum.rightCols<1>().transpose();
  return true;
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

// Samples x nv: true where the direction of a joint is not known or another
// than before, and where that lasts for longer than half a width of g, so that
// it may rest.
struct SlowTimes {
  MatrixXb turns, rests;
};
SlowTimes FindSlow(const SampledMotion& sampled) {
  const int nv = static_cast<int>(sampled.slowest.size());
  SlowTimes slow;
  slow.turns.setConstant(sampled.size(), nv, false);
  slow.rests = slow.turns;
  for (int v = 0; v < nv; ++v) {
    if (!(sampled.slowest[v] > 0.0)) continue;
    int first = 0;  // of those that are slow together
    for (int k = 0; k <= sampled.size(); ++k) {
      const bool known = k < sampled.size() && sampled.motion[k].known;
      const double qd = known ? sampled.motion[k].qd[v] : 0.0;
      if (known && std::abs(qd) < sampled.slowest[v]) {
        slow.turns(k, v) = true;
        continue;
      }
      if (2 * (k - first) > kSteps) {
        slow.rests.col(v).segment(first, k - first).setConstant(true);
      }
      first = k + 1;
      if (known && k > 0 && sampled.motion[k - 1].known &&
          (sampled.motion[k - 1].qd[v] > 0.0) != (qd > 0.0)) {
        slow.turns(k, v) = true;
      }
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
                           double to, const EquationFilter& filter,
                           int threads) {
  SampledMotion sampled;
  const double step = sampled.step = filter.average / kSteps;
  sampled.bend = filter.motion;
  const int n = static_cast<int>(std::floor((to - from) / step)) + 1;
  if (n < 1) return sampled;
  sampled.run.effort = RowMatrixXd::Zero(n, model.nv());
  for (const Input& input : run.inputs) {
    sampled.run.inputs.push_back({input.name, true, std::vector<double>(n)});
  }
  sampled.run.t.resize(n);
  sampled.motion.resize(n);
  ParallelRanges(n, kTimesOfRange, threads, [&](int first, int last) {
    MotionSmoother smoother(model, run, filter.motion);
    for (int k = first; k < last; ++k) {
      const double time = from + k * step;
      sampled.run.t[k] = time - 0.5 * step;
      MeanEffort(run, time - 0.5 * step, time + 0.5 * step,
                 sampled.run.effort.row(k).data());
      for (size_t i = 0; i < run.inputs.size(); ++i) {
        sampled.run.inputs[i].values[k] = MeanInput(
            run, run.inputs[i].name, time - 0.5 * step, time + 0.5 * step);
      }
      sampled.motion[k] = smoother.At(time);
    }
  });
  sampled.run.t.push_back(sampled.run.t.back() + step);
  sampled.slowest = SlowestKnown(model, sampled.motion);
  return sampled;
}

void ReadDryFriction(const Model& model, SampledMotion* sampled) {
  sampled->slowest =
      sampled->slowest.cwiseMax(SlowestKnown(model, sampled->motion));
}

SampledMotion SampleMotion(const Model& model, const Run& run,
                           const EquationFilter& filter, int threads) {
  return SampleMotion(model, run, run.t.front(), run.t.back(), filter, threads);
}

template <typename T>
EquationRows MakeEquationRows(const Model& model, const SampledMotion& sampled,
                              int columns, const Seeding<T>& seeding,
                              const PlainPart& plain, int threads) {
  EquationRows out;
  const int nv = out.nv = model.nv();
  const int within = sampled.size() - 2 * kReachSteps;
  const int times = within > 0 ? (within - 1) / kSteps + 1 : 0;
  out.rows.resize(times * nv, columns + 1);
  out.effort.resize(times, nv);
  out.qd.resize(times, nv);
  out.rests.setConstant(times, nv, false);
  out.qdd.resize(times, nv);
  std::vector<char> known(times);  // not bool: threads set one each
  std::mutex mutex;
  ParallelRanges(times, kTimesOfRange, threads, [&](int first, int last) {
    const Range range = {first * kSteps,
                         (last - 1) * kSteps + 2 * kReachSteps + 1};
    RowMatrixXd rest = RowMatrixXd::Zero(range.size() * nv, columns + 2);
    const double work =
        SetUnfiltered<T>(model, sampled, range, columns, seeding, plain, &rest);
    {
      const std::lock_guard lock(mutex);
      out.work += work;
    }
    for (int i = first; i < last; ++i) {
      known[i] = SetAverage(sampled, range, rest, i, &out) ? 1 : 0;
    }
  });
  const SlowTimes slow = FindSlow(sampled);
  // How far what holds a joint at rest shows: beyond so many widths of g and of
  // the fit of the motion together there is less than 1 % of it. Where it turns
  // about it may rest for less than can be seen.
  constexpr double kShows = 2.6, kTurnShows = 1.5;
  const double width =
      std::hypot(sampled.bend, kSteps * sampled.step) / sampled.step;
  for (int i = 0; i < times; ++i) {
    if (known[i] == 0) continue;
    const int k = MiddleOf(i), at = out.times();
    const auto near = [&](const MatrixXb& of, double widths) {
      const int reach = static_cast<int>(std::ceil(widths * width));
      const int first = std::max(0, k - reach);
      const int last = std::min(sampled.size() - 1, k + reach);
      return of.middleRows(first, last - first + 1).colwise().any().eval();
    };
    out.rests.row(at) = near(slow.rests, kShows).array() ||
                        near(slow.turns, kTurnShows).array();
    if (at < i) {
      out.rows.middleRows(at * nv, nv) = out.rows.middleRows(i * nv, nv);
      out.effort.row(at) = out.effort.row(i);
    }
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
                               const std::vector<int>& undriven, int threads) {
  return MakeEquationRows<double>(
      model, sampled, 0,
      [&](int, MechanismParameters<double>* out) { *out = values; },
      {values, {}, undriven}, threads);
}

#define SYSID_INSTANTIATE(T)                                      \
  template EquationRows MakeEquationRows<T>(                      \
      const Model&, const SampledMotion&, int, const Seeding<T>&, \
      const PlainPart&, int);
SYSID_INSTANTIATE(double)
SYSID_INSTANTIATE(Jet8)
SYSID_INSTANTIATE(Jet24)
#undef SYSID_INSTANTIATE

}  // namespace sysid
