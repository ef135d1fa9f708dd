#include "models/dynamics.h"

#include <Eigen/Eigenvalues>
#include <cstdio>

#include "models/dynamics-impl.h"

namespace sysid {

SYSID_INSTANTIATE_DYNAMICS(double)

double KineticEnergy(Workspace<double>* ws, const double* q, const double* qd) {
  Eigen::MatrixXd M;
  MassMatrix<double>(ws, q, &M);
  const Eigen::Map<const Eigen::VectorXd> rate(qd, ws->model().nv());
  return 0.5 * rate.dot(M * rate);
}

double PotentialEnergy(Workspace<double>* ws, const double* q) {
  ForwardKinematics<double>(ws, q);
  double energy = 0.0;
  for (const BodyData<double>& b : ws->bodies) {
    energy -= ws->gravity.dot(b.mass * b.p_WB + b.R_WB * b.h_B);
  }
  return energy;
}

namespace {

// One that is nothing beside the body's whole moment is rounding.
constexpr double kSingular = 1e-10;

// A configuration without accidental alignment.
Eigen::VectorXd AnyConfiguration(const Model& model) {
  Eigen::VectorXd q = model.mechanism().NeutralConfiguration();
  for (const Body& body : model.movers()) {
    if (body.type == JointType::kSpherical) {
      const Eigen::Quaterniond tilted =
          Exp<double>(Eigen::Vector3d(0.3 + 0.1 * body.joint, -0.5, 0.7));
      q.segment<4>(body.q_index) = tilted.coeffs();
    } else {
      q[body.q_index] = 0.4 + 0.3 * body.joint;
    }
  }
  return q;
}

// Of a model with followers: the inertia that is left of each joint's in M(q)
// while those that come later give way.
std::vector<SingularJoint> SingularWithFollowers(const Model& model) {
  Workspace<double> ws(model);
  Eigen::MatrixXd M;
  MassMatrix<double>(&ws, AnyConfiguration(model).data(), &M);
  // All that a joint carries, whatever its axis.
  const auto whole = [&](const Body& body) {
    const BodyData<double>& b =
        ws.bodies[model
                      .placement(
                          model.mechanism().joints[body.joint].child_link)
                      .body];
    const double inertia =
        body.type == JointType::kPrismatic ? b.M.trace() : b.I.trace();
    return body.multiplier * body.multiplier * std::abs(inertia);
  };
  std::vector<SingularJoint> faults;
  for (int i = static_cast<int>(model.movers().size()) - 1; i >= 0; --i) {
    const Body& body = model.movers()[i];
    double most = whole(body);
    for (const Body& follower : model.followers()) {
      if (model.bodies()[follower.leader].joint == body.joint) {
        most += whole(follower);
      }
    }
    const Joint& joint = model.mechanism().joints[body.joint];
    bool singular = false;
    for (int k = VelocitySize(body) - 1; k >= 0; --k) {
      const int v = body.v_index + k;
      const double D = M(v, v);
      if (!(D > kSingular * most)) {
        singular = true;  // as if it were locked
        continue;
      }
      const Eigen::VectorXd U = M.col(v).head(v);
      M.topLeftCorner(v, v) -= U * U.transpose() / D;
    }
    if (!singular) continue;
    faults.push_back(
        {body.joint,
         "joint '" + joint.name + "': link '" +
             model.mechanism().links[joint.child_link].name +
             "', what it carries and what follows have no, or less than no, " +
             (body.type == JointType::kPrismatic   ? "mass along"
              : body.type == JointType::kSpherical ? "inertia about one of"
                                                   : "inertia about") +
             (body.type == JointType::kSpherical ? " its axes" : " its axis")});
  }
  return faults;
}

}  // namespace

std::vector<SingularJoint> SingularJoints(const Model& model) {
  if (!model.followers().empty()) return SingularWithFollowers(model);
  // The articulated inertia that each joint feels.
  Workspace<double> ws(model);
  const Eigen::VectorXd q = AnyConfiguration(model);
  internal::PlaceBodies<double>(&ws, q.data());
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(model.nv());
  internal::MoveBodies<double>(&ws, zero.data(), false);
  for (BodyData<double>& b : ws.bodies) internal::InertiaAndBias<double>(&b);
  // Bodies that are singular are handed on as if they were locked, so that the
  // pass reaches the root and every singular joint is named.
  std::vector<SingularJoint> faults;
  for (int i = static_cast<int>(ws.bodies.size()) - 1; i >= 0; --i) {
    const Body& body = model.bodies()[i];
    BodyData<double>& b = ws.bodies[i];
    const Joint& joint = model.mechanism().joints[body.joint];
    const std::string& link = model.mechanism().links[joint.child_link].name;
    const bool ball = body.type == JointType::kSpherical;
    const bool slide = body.type == JointType::kPrismatic;
    Eigen::Matrix3d D3 = b.I;
    D3.diagonal().array() += b.armature;
    const Eigen::Vector3d S = ball ? Eigen::Vector3d(0, 0, 0) : b.axis;
    const Eigen::Vector3d U_n = slide ? b.H * S : b.I * S;
    const Eigen::Vector3d U_f =
        (slide ? b.M : Eigen::Matrix3d(b.H.transpose())) * S;
    const double D = S.dot(slide ? U_f : U_n) + b.armature;
    const double least = kSingular * std::abs((slide ? b.M : D3).trace());
    bool singular = !(D > least);
    std::string text;
    const auto negative = [&](double inertia) {
      char number[32];
      std::snprintf(number, sizeof(number), "%.3g", inertia);
      return "the inertia that it moves is negative, " + std::string(number) +
             (slide ? " kg" : " kg m^2") + ": link '" + link +
             "' or what it carries is no possible body";
    };
    if (ball) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(D3);
      const double smallest = eigen.eigenvalues()[0];
      singular = !(smallest > least);
      if (smallest < -least) {
        text = negative(smallest);
      } else if (singular) {
        const Eigen::Vector3d axis =
            b.R_WB.transpose() * eigen.eigenvectors().col(0);
        char numbers[96];
        std::snprintf(numbers, sizeof(numbers), "(%.3g, %.3g, %.3g)", axis[0],
                      axis[1], axis[2]);
        text = "link '" + link + "' has no inertia about its axis " + numbers +
               ", so its spin is undefined (a point mass on a massless rod?); "
               "give it a small inertia about that axis";
      }
    } else if (D < -least) {
      text = negative(D);
    } else if (singular) {
      text = "link '" + link + "' and what it carries have no " +
             (slide ? "mass along" : "inertia about") + " its axis";
    }
    if (singular) {
      faults.push_back({body.joint, "joint '" + joint.name + "': " + text});
    }
    if (body.parent < 0) continue;
    BodyData<double>& parent = ws.bodies[body.parent];
    if (singular) {
      internal::AddToParent<double>(b.r, b.I, b.H, b.M, b.n, b.f, &parent);
    } else if (ball) {
      const Eigen::Matrix3d Di = D3.inverse();
      internal::AddToParent<double>(
          b.r, b.I - b.I * Di * b.I, b.H - b.I * Di * b.H,
          b.M - b.H.transpose() * Di * b.H, b.n, b.f, &parent);
    } else {
      internal::AddToParent<double>(
          b.r, b.I - U_n * U_n.transpose() / D, b.H - U_n * U_f.transpose() / D,
          b.M - U_f * U_f.transpose() / D, b.n, b.f, &parent);
    }
  }
  return faults;
}

std::vector<std::string> TextsOf(const std::vector<SingularJoint>& joints) {
  std::vector<std::string> texts;
  for (const SingularJoint& joint : joints) texts.push_back(joint.text);
  return texts;
}

}  // namespace sysid
