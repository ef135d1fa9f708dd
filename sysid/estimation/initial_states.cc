#include "sysid/estimation/initial_states.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "models/internal_state.h"
#include "models/state.h"
#include "residuals/acting_inputs.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kHalfWindow = 0.05;  // s
constexpr int kMinNeighbours = 2;     // samples on either side

// Value and slope at t0 of the polynomial through the points (t, y) in the
// least squares; y: one row a point, each number with the noise sigma.
// Quadratic or, where there are points enough, cubic; of higher degree while
// what is left is more than the noise (few samples of a fast motion). By
// polynomials that are orthogonal on the points (Forsythe 1957), of x = (t -
// t0) / scale: p_d+1 = (x - a_d) p_d - b_d p_d-1, one degree after the other.
void FitPolynomial(const std::vector<double>& t, RowMatrixXd y, double t0,
                   double sigma, Eigen::RowVectorXd* value,
                   Eigen::RowVectorXd* slope) {
  constexpr int kMostDegree = 6;
  const int n = static_cast<int>(t.size());
  const double scale = n > 1 ? std::max(t.back() - t0, t0 - t.front()) : 1.0;
  const int least = n >= 7 ? 3 : std::min(2, n - 1);
  const Eigen::ArrayXd x =
      (Eigen::Map<const Eigen::ArrayXd>(t.data(), n) - t0) / scale;
  Eigen::VectorXd p = Eigen::VectorXd::Ones(n), before, next;
  double at = 1.0, at_before = 0.0;  // p and the one before at t0,
  double by = 0.0, by_before = 0.0;  // and their derivatives by x
  double size_before = 0.0;
  value->setZero(y.cols());
  slope->setZero(y.cols());
  before.setZero(n);
  for (int degree = 0;; ++degree) {
    const double size = p.squaredNorm();
    const Eigen::RowVectorXd c = p.transpose() * y / size;
    y.noalias() -= p * c;
    *value += c * at;
    *slope += c * (by / scale);
    const int left = (n - degree - 1) * static_cast<int>(y.cols());
    if (degree >= least && (left <= 0 || degree == kMostDegree ||
                            y.squaredNorm() <= 4.0 * sigma * sigma * left)) {
      return;
    }
    const double a = (x * p.array().square()).sum() / size;
    const double b = degree > 0 ? size / size_before : 0.0;
    next = (x - a) * p.array() - b * before.array();
    before.swap(p);
    p.swap(next);
    const double at_next = -a * at - b * at_before;
    const double by_next = at - a * by - b * by_before;
    at_before = std::exchange(at, at_next);
    by_before = std::exchange(by, by_next);
    size_before = size;
  }
}

// The valid samples around k: within the half window, at least a few.
std::vector<int> Neighbours(const std::vector<double>& t,
                            const std::vector<int>& valid, size_t k) {
  size_t low = k, high = k;
  const double t0 = t[valid[k]];
  while (low > 0 && (t0 - t[valid[low - 1]] <= kHalfWindow ||
                     k - low < static_cast<size_t>(kMinNeighbours))) {
    --low;
  }
  while (high + 1 < valid.size() &&
         (t[valid[high + 1]] - t0 <= kHalfWindow ||
          high - k < static_cast<size_t>(kMinNeighbours))) {
    ++high;
  }
  // At an end as many as in the middle, all on one side.
  constexpr size_t kFewest = 2 * kMinNeighbours + 1;
  while (high - low + 1 < kFewest && low > 0) --low;
  while (high - low + 1 < kFewest && high + 1 < valid.size()) ++high;
  return std::vector<int>(valid.begin() + low, valid.begin() + high + 1);
}

// Fills the rows that are not `known` between their neighbours: linear in the
// tangent; the ends are held. Leaves all as it is where nothing is known.
void BridgeGaps(const std::vector<double>& t, const std::vector<bool>& known,
                Eigen::Ref<RowMatrixXd> q, Eigen::Ref<RowMatrixXd> qd) {
  const int n = static_cast<int>(t.size());
  int before = -1;
  for (int k = 0; k <= n; ++k) {
    if (k < n && !known[k]) continue;
    if (k == n && before < 0) return;
    for (int m = before + 1; m < k; ++m) {
      if (before < 0 || k == n) {
        const int from = before < 0 ? k : before;
        q.row(m) = q.row(from);
        qd.row(m).setZero();
        continue;
      }
      const double s = (t[m] - t[before]) / (t[k] - t[before]);
      if (q.cols() == 4) {
        const Eigen::Quaterniond a(Eigen::Vector4d(q.row(before).transpose()));
        const Eigen::Quaterniond b(Eigen::Vector4d(q.row(k).transpose()));
        q.row(m) = a.slerp(s, b).coeffs().transpose();
      } else {
        q.row(m) = (1 - s) * q.row(before) + s * q.row(k);
      }
      qd.row(m) = (1 - s) * qd.row(before) + s * qd.row(k);
    }
    before = k;
  }
}

// Samples that stand out from their neighbours on both sides by more than these
// differ among themselves, and more than noise does: no start for a state.
std::vector<bool> Spikes(const std::vector<double>& y,
                         const std::vector<int>& valid, double sigma) {
  constexpr int kHalf = 3;  // neighbours on either side
  constexpr double kRanges = 1.0, kSigmas = 3.0;
  std::vector<bool> spikes(y.size(), false);
  const int n = static_cast<int>(valid.size());
  for (int i = kHalf; i < n - kHalf; ++i) {
    std::vector<double> others;
    for (int j = i - kHalf; j <= i + kHalf; ++j) {
      if (j != i) others.push_back(y[valid[j]]);
    }
    std::sort(others.begin(), others.end());
    // Without their own extremes: a second spike may be among them.
    const double low = others[1], high = others[others.size() - 2];
    const double value = y[valid[i]];
    const double off = std::max(low - value, value - high);
    spikes[valid[i]] = off > kRanges * (high - low) + kSigmas * sigma;
  }
  return spikes;
}

// Smooths a joint's position at the valid samples, each by those around it:
// local(k, m) says sample m in coordinates about sample k, and at(k, value) the
// position that has these coordinates. Bridges the others.
template <typename Local, typename At>
void Smooth(const std::vector<double>& t, double sigma,
            const std::vector<int>& valid, const Local& local, const At& at,
            Eigen::Ref<RowMatrixXd> q, Eigen::Ref<RowMatrixXd> qd) {
  std::vector<bool> known(t.size(), false);
  for (size_t i = 0; i < valid.size(); ++i) {
    const int k = valid[i];
    const std::vector<int> around = Neighbours(t, valid, i);
    std::vector<double> times;
    RowMatrixXd y(around.size(), qd.cols());
    for (size_t m = 0; m < around.size(); ++m) {
      times.push_back(t[around[m]]);
      y.row(m) = local(k, around[m]);
    }
    Eigen::RowVectorXd value, slope;
    FitPolynomial(times, y, t[k], sigma, &value, &slope);
    q.row(k) = at(k, value);
    qd.row(k) = slope;  // a rotation's: body axes; J_r(value) = 1 to the noise
    known[k] = true;
  }
  BridgeGaps(t, known, q, qd);
}

void SmoothScalar(const std::vector<double>& t, bool wraps, double sigma,
                  const Eigen::VectorXd& measured, Eigen::Ref<RowMatrixXd> q,
                  Eigen::Ref<RowMatrixXd> qd) {
  std::vector<int> valid;
  std::vector<double> unwrapped(t.size(), kNaN);
  for (size_t k = 0; k < t.size(); ++k) {
    if (std::isnan(measured[k])) continue;
    double value = measured[k];
    if (wraps && !valid.empty()) {
      const double before = unwrapped[valid.back()];
      value -= 2 * M_PI * std::round((value - before) / (2 * M_PI));
    }
    unwrapped[k] = value;
    valid.push_back(static_cast<int>(k));
  }
  std::erase_if(valid, [&, spikes = Spikes(unwrapped, valid, sigma)](int k) {
    return spikes[k];
  });
  using Number = Eigen::Matrix<double, 1, 1>;
  Smooth(
      t, sigma, valid, [&](int, int m) { return Number(unwrapped[m]); },
      [](int, const Eigen::RowVectorXd& value) { return value; }, q, qd);
}

void SmoothQuaternion(const std::vector<double>& t, double sigma,
                      const RowMatrixXd& measured, Eigen::Ref<RowMatrixXd> q,
                      Eigen::Ref<RowMatrixXd> qd) {
  std::vector<int> valid;
  for (size_t k = 0; k < t.size(); ++k) {
    if (!std::isnan(measured(k, 0))) valid.push_back(static_cast<int>(k));
  }
  const auto rotation = [&](int k) {
    return Eigen::Quaterniond(Eigen::Vector4d(measured.row(k).transpose()));
  };
  Smooth(
      t, sigma, valid,
      [&](int k, int m) -> Eigen::RowVector3d {
        return Log<double>(Multiply(rotation(k).conjugate(), rotation(m)))
            .transpose();
      },
      [&](int k, const Eigen::RowVectorXd& value) -> Eigen::RowVector4d {
        const Eigen::Vector3d moved = value.transpose();
        return Multiply(rotation(k), Exp<double>(moved))
            .normalized()
            .coeffs()
            .transpose();
      },
      q, qd);
}

// The positions of the measured frames as functions of q, and their derivatives
// by the tangent of q.
class FrameKinematics {
 public:
  FrameKinematics(const ShootingProblem& problem, const Run& run)
      : model_(problem.model()), run_(run) {
    const Eigen::VectorXd theta = problem.InitialTheta();
    const std::vector<Jet24> theta_jet(theta.begin(), theta.end());
    problem.map().Apply<Jet24>(theta_jet.data(), &values_);
  }

  // Moves q (nq) so that the frames at sample k meet their measurements;
  // columns of dq that are not `movable` stay. Damped Gauss-Newton.
  void Solve(int k, const std::vector<bool>& movable,
             Eigen::VectorXd* q) const {
    const StateLayout& at = model_.layout();
    const int nv = at.nv();
    for (int iteration = 0; iteration < 20; ++iteration) {
      Eigen::MatrixXd J;
      Eigen::VectorXd r;
      Evaluate(k, *q, &r, &J);
      if (r.size() == 0) return;
      for (int v = 0; v < nv; ++v) {
        if (!movable[v]) J.col(v).setZero();
      }
      Eigen::MatrixXd H = J.transpose() * J;
      H.diagonal().array() += 1e-6 * std::max(H.trace() / nv, 1e-9);
      const Eigen::VectorXd dq = -H.ldlt().solve(J.transpose() * r);
      Eigen::VectorXd x = Eigen::VectorXd::Zero(at.size());
      Eigen::VectorXd dx = Eigen::VectorXd::Zero(at.tangent_size());
      x.segment(at.q(), at.nq()) = *q;
      const double largest = dq.cwiseAbs().maxCoeff();
      dx.segment(at.dq(), nv) =
          dq * std::min(1.0, 0.5 / std::max(largest, 1e-12));
      BoxPlus<double>(model_, x.data(), dx.data(), x.data());
      *q = x.segment(at.q(), at.nq());
      if (largest < 1e-10) return;
    }
  }

 private:
  void Evaluate(int k, const Eigen::VectorXd& q, Eigen::VectorXd* r,
                Eigen::MatrixXd* J) const {
    std::vector<const Channel*> frames;
    int rows = 0;
    for (const Channel& channel : run_.channels) {
      if (channel.kind == ChannelKind::kFramePosition &&
          !std::isnan(channel.values(k, 0))) {
        frames.push_back(&channel);
        rows += static_cast<int>(channel.axes.size());
      }
    }
    const StateLayout& at = model_.layout();
    const int nv = at.nv();
    r->resize(rows);
    J->resize(rows, nv);
    Workspace<Jet24> ws(model_);
    ws.SetParameters(values_);
    for (int first = 0; first < nv; first += 24) {
      std::vector<Jet24> x(at.size()), dx(at.tangent_size());
      for (int i = 0; i < at.nq(); ++i) x[at.q() + i] = Jet24(q[i]);
      for (int c = 0; c < 24 && first + c < nv; ++c) {
        dx[at.dq() + first + c].v[c] = 1.0;
      }
      BoxPlus<Jet24>(model_, x.data(), dx.data(), x.data());
      ForwardKinematics<Jet24>(&ws, x.data() + at.q());
      int row = 0;
      for (const Channel* frame : frames) {
        const Vector3<Jet24> p = LinkPosition<Jet24>(ws, frame->target);
        for (size_t i = 0; i < frame->axes.size(); ++i, ++row) {
          const Jet24& along = p[frame->axes[i]];
          (*r)[row] = along.a - frame->values(k, i);
          for (int c = 0; c < 24 && first + c < nv; ++c) {
            (*J)(row, first + c) = along.v[c];
          }
        }
      }
    }
  }

  const Model& model_;
  const Run& run_;
  MechanismParameters<Jet24> values_;
};

// Positions of the joints that no channel measures, from frames.
void SolveUnmeasured(const ShootingProblem& problem, const Run& run,
                     const std::vector<bool>& movable, RowMatrixXd* states) {
  const Model& model = problem.model();
  const StateLayout& at = model.layout();
  const FrameKinematics kinematics(problem, run);
  Eigen::VectorXd q = states->row(0).segment(at.q(), at.nq()).transpose();
  RowMatrixXd solved(run.size(), at.nq());
  for (int k = 0; k < run.size(); ++k) {
    for (const Body& body : model.movers()) {
      if (movable[body.v_index]) continue;
      const int size = ConfigurationSize(body.type);
      q.segment(body.q_index, size) =
          states->row(k).segment(at.q(body), size).transpose();
    }
    kinematics.Solve(k, movable, &q);
    solved.row(k) = q.transpose();
  }
  for (const Body& body : model.movers()) {
    if (!movable[body.v_index]) continue;
    const double sigma = problem.data().JointSigma(body.joint);
    if (body.type == JointType::kSpherical) {
      SmoothQuaternion(run.t, sigma, solved.middleCols(body.q_index, 4),
                       states->middleCols(at.q(body), 4),
                       states->middleCols(at.qd(body), 3));
    } else {
      SmoothScalar(run.t, false, sigma, solved.col(body.q_index),
                   states->middleCols(at.q(body), 1),
                   states->middleCols(at.qd(body), 1));
    }
  }
}

// Internal states of effects: as they start, or as the way since the sample
// before says.
void FollowStates(const ShootingProblem& problem, const Run& run,
                  RowMatrixXd* states) {
  const Model& model = problem.model();
  if (model.layout().nz() == 0) return;
  const Eigen::VectorXd theta = problem.InitialTheta();
  MechanismParameters<double> values;
  problem.map().Apply<double>(theta.data(), &values);
  Workspace<double> ws(model);
  ws.SetParameters(values);
  std::vector<double> held(model.held_size());
  for (int k = 0; k < run.size(); ++k) {
    const int row = std::min(k, run.size() - 2);
    ActingInputs<double>(run, ws, row, run.t[row], run.t[row + 1] - run.t[row],
                         held.data());
    double* x = states->row(k).data();
    StartStates(&ws, held.data(), x);
    if (k > 0) MoveStates(&ws, states->row(k - 1).data(), x);
  }
}

}  // namespace

RowMatrixXd StatesFromData(const ShootingProblem& problem, int run_index) {
  const Model& model = problem.model();
  const Run& run = problem.runs()[run_index]->run;
  const StateLayout& at = model.layout();
  RowMatrixXd states = NeutralState(model).transpose().replicate(run.size(), 1);
  std::vector<bool> unmeasured(model.nv(), false);
  bool any_unmeasured = false, any_frame = false;
  for (const Channel& channel : run.channels) {
    any_frame |= channel.kind == ChannelKind::kFramePosition;
  }
  for (const Body& body : model.movers()) {
    auto q = states.middleCols(at.q(body), ConfigurationSize(body.type));
    auto qd = states.middleCols(at.qd(body), VelocitySize(body));
    const Channel* position = nullptr;
    const Channel* velocity = nullptr;
    const Channel* motor = nullptr;
    for (const Channel& channel : run.channels) {
      if (channel.target != body.joint ||
          channel.kind == ChannelKind::kFramePosition) {
        continue;
      }
      (channel.kind == ChannelKind::kMotorPosition ? motor
       : IsPositionLike(channel.kind)              ? position
                                                   : velocity) = &channel;
    }
    // The motor is where the joint is, but for what bends.
    if (position == nullptr) position = motor;
    const double sigma = problem.data().JointSigma(body.joint);
    if (position != nullptr && body.type == JointType::kSpherical) {
      SmoothQuaternion(run.t, sigma, position->values, q, qd);
    } else if (position != nullptr) {
      SmoothScalar(run.t, IsRotation1(body.type), sigma,
                   position->values.col(0), q, qd);
    } else if (velocity != nullptr && body.type != JointType::kSpherical) {
      // Only the speed is measured: its integral, from neutral.
      for (int k = 0; k < run.size(); ++k) {
        const double value = velocity->values(k, 0);
        qd(k, 0) = std::isnan(value) ? (k > 0 ? qd(k - 1, 0) : 0.0) : value;
        if (k > 0) {
          q(k, 0) = q(k - 1, 0) +
                    0.5 * (run.t[k] - run.t[k - 1]) * (qd(k, 0) + qd(k - 1, 0));
        }
      }
    } else {
      any_unmeasured = true;
      for (int i = 0; i < VelocitySize(body); ++i) {
        unmeasured[body.v_index + i] = true;
      }
    }
  }
  if (any_unmeasured && any_frame) {
    SolveUnmeasured(problem, run, unmeasured, &states);
  }
  FollowStates(problem, run, &states);
  return states;
}

std::vector<RowMatrixXd> AllStatesFromData(const ShootingProblem& problem) {
  std::vector<RowMatrixXd> states(problem.runs().size());
  ParallelFor(static_cast<int>(states.size()), problem.options().threads,
              [&](int r) {
                states[r] = StatesFromData(problem, r);
                return true;
              });
  return states;
}

}  // namespace sysid
