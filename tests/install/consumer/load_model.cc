// load_model FILE.urdf: the accelerations of a pendulum let go tilted, by the
// library as a user has it.
#include <cmath>
#include <iostream>

#include "models/dynamics.h"
#include "models/error.h"
#include "models/urdf/load_urdf.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    const sysid::Model model =
        sysid::MakeModel(sysid::LoadUrdf(argv[1]), sysid::Catalogue());
    sysid::Workspace<double> workspace(model);

    // Every spherical joint turned by 0.3 rad about x. Quaternions are x, y, z,
    // w in memory.
    Eigen::VectorXd q = Eigen::VectorXd::Zero(model.nq());
    for (const sysid::Body& body : model.bodies()) {
      if (body.type != sysid::JointType::kSpherical) continue;
      q[body.q_index] = std::sin(0.15);
      q[body.q_index + 3] = std::cos(0.15);
    }
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(model.nv());
    Eigen::VectorXd qdd(model.nv());
    if (!sysid::ForwardDynamics(&workspace, q.data(), rest.data(), rest.data(),
                                qdd.data())) {
      return 1;
    }
    std::cout << argv[1] << ": qdd = " << qdd.transpose() << '\n';
    return qdd.norm() > 1 ? 0 : 1;
  } catch (const sysid::InputError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}
