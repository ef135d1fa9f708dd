#include "sysid/estimation/initial_states.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "glog/logging.h"
#include "models/internal_state.h"
#include "models/math/decompositions.h"
#include "models/state.h"
#include "residuals/acting_inputs.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/smooth_positions.h"

namespace sysid {
namespace {

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
      const Eigen::VectorXd dq =
          -SolveSymmetric(H, Eigen::VectorXd(J.transpose() * r));
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

// A motor as its own sensor says it, beside one of its joint.
struct MotorMotion {
  int body;
  RowMatrixXd q, qd;  // samples x 1, on the joint's side of the gear
};

// Moves z of a state x (the model's) to the nearest at which the motor is where
// its sensor at sample k says, and as fast: Gauss-Newton steps of least norm in
// z of the effects between the joint and its motor, ToMotor's derivatives by
// Jets.
void MeetMotor(const Workspace<Jet24>& ws, const MotorMotion& motor, int k,
               double* x) {
  constexpr int kIterations = 3;  // ToMotor is close to linear in z
  const StateLayout& at = ws.model().layout();
  const Body& body = ws.model().bodies()[motor.body];
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Jet24 q(x[at.q(body)]), qd(x[at.qd(body)]), qdd(0.0);
    std::vector<int> moved;
    for (const auto& effect : ws.motor_effects) {
      if (effect.body != motor.body) continue;
      std::vector<Jet24> z, no_rate(effect.states, Jet24(0.0));
      CHECK_LE(moved.size() + effect.states, 24u);  // a Jet's
      for (int i = 0; i < effect.states; ++i) {
        z.emplace_back(x[at.z() + effect.first_z + i],
                       static_cast<int>(moved.size()));
        moved.push_back(effect.first_z + i);
      }
      effect.hooks->ToMotor(z.data(), no_rate.data(), effect.p, &q, &qd, &qdd);
    }
    double off = motor.q(k, 0) - q.a;
    if (IsRotation1(body.type)) off = std::remainder(off, 2 * M_PI);
    const Eigen::Vector2d r(off, motor.qd(k, 0) - qd.a);
    Eigen::Matrix<double, 2, 24> J;
    J << q.v.transpose(), qd.v.transpose();
    const Eigen::VectorXd dz = ShortestLeastSquares(J, r);
    for (size_t i = 0; i < moved.size(); ++i) x[at.z() + moved[i]] += dz[i];
  }
}

// The motors whose sensors say z: of joints that have a sensor of their own.
std::vector<MotorMotion> MotorMotions(const ShootingProblem& problem,
                                      const Run& run,
                                      const Workspace<Jet24>& ws) {
  const std::vector<Body>& bodies = problem.model().bodies();
  std::vector<MotorMotion> motors;
  for (const Channel& channel : run.channels) {
    if (channel.kind != ChannelKind::kMotorPosition) continue;
    const auto body = std::find_if(
        bodies.begin(), bodies.end(),
        [&](const Body& other) { return other.joint == channel.target; });
    const int index = static_cast<int>(body - bodies.begin());
    const bool joint = std::any_of(
        run.channels.begin(), run.channels.end(), [&](const Channel& other) {
          return other.kind == ChannelKind::kPosition &&
                 other.target == channel.target;
        });
    const bool bends =
        std::any_of(ws.motor_effects.begin(), ws.motor_effects.end(),
                    [&](const auto& effect) { return effect.body == index; });
    if (!joint || !bends || body->leader >= 0) continue;
    MotorMotion motor{index, RowMatrixXd::Zero(run.size(), 1),
                      RowMatrixXd::Zero(run.size(), 1)};
    SmoothScalar(run.t, IsRotation1(body->type),
                 problem.data().JointSigma(channel.target),
                 channel.values.col(0), motor.q, motor.qd);
    motors.push_back(std::move(motor));
  }
  return motors;
}

// The first state, where Run::start knows it.
void StartAsKnown(const Model& model, const Run& run, RowMatrixXd* states) {
  if (run.start == RunStart::kEstimated) return;
  const StateLayout& at = model.layout();
  for (const Body& body : model.movers()) {
    auto q = states->row(0).segment(at.q(body), ConfigurationSize(body.type));
    auto qd = states->row(0).segment(at.qd(body), VelocitySize(body));
    qd.setZero();
    if (run.start == RunStart::kRest) continue;
    for (const Channel& channel : run.channels) {
      if (channel.target != body.joint ||
          channel.kind == ChannelKind::kFramePosition ||
          channel.kind == ChannelKind::kMotorPosition) {
        continue;
      }
      const auto first = channel.values.row(0);
      if (IsPositionLike(channel.kind)) {
        q = first;
      } else {
        qd = first;
      }
    }
  }
}

// Internal states of effects: as the sensors of motors say, else as they start,
// or as the way since the sample before says.
void FollowStates(const ShootingProblem& problem, const Run& run,
                  RowMatrixXd* states) {
  const Model& model = problem.model();
  if (model.layout().nz() == 0) return;
  const Eigen::VectorXd theta = problem.InitialTheta();
  MechanismParameters<double> values;
  problem.map().Apply<double>(theta.data(), &values);
  Workspace<double> ws(model);
  ws.SetParameters(values);
  const std::vector<Jet24> theta_jet(theta.begin(), theta.end());
  MechanismParameters<Jet24> values_jet;
  problem.map().Apply<Jet24>(theta_jet.data(), &values_jet);
  Workspace<Jet24> ws_jet(model);
  ws_jet.SetParameters(values_jet);
  const std::vector<MotorMotion> motors = MotorMotions(problem, run, ws_jet);
  std::vector<double> held(model.held_size());
  for (int k = 0; k < run.size(); ++k) {
    const int row = std::min(k, run.size() - 2);
    ActingInputs<double>(run, ws, row, run.t[row], run.t[row + 1] - run.t[row],
                         held.data());
    double* x = states->row(k).data();
    StartStates(&ws, held.data(), x);
    if (k > 0) MoveStates(&ws, states->row(k - 1).data(), x);
    for (const MotorMotion& motor : motors) MeetMotor(ws_jet, motor, k, x);
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
  StartAsKnown(model, run, &states);
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
