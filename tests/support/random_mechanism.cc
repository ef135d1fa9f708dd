#include "tests/support/random_mechanism.h"

#include <cmath>
#include <numbers>
#include <string>

namespace sysid {

double Random::Uniform(double lower, double upper) {
  const double unit = static_cast<double>(engine_() >> 11) * 0x1.0p-53;
  return lower + (upper - lower) * unit;
}

int Random::Integer(int n) {
  return static_cast<int>(engine_() % static_cast<uint64_t>(n));
}

// Box and Muller's.
double Random::Normal() {
  const double u = 1.0 - Uniform(0.0, 1.0);  // never 0
  const double v = Uniform(0.0, 2.0 * std::numbers::pi);
  return std::sqrt(-2.0 * std::log(u)) * std::cos(v);
}

Eigen::VectorXd Random::NormalVector(int n) {
  Eigen::VectorXd x(n);
  for (int i = 0; i < n; ++i) x[i] = Normal();
  return x;
}

Eigen::Vector3d Random::Direction() {
  Eigen::Vector3d d = NormalVector(3);
  return d.normalized();
}

Eigen::Quaterniond Random::Rotation() {
  const Eigen::Vector4d x = NormalVector(4).normalized();
  return Eigen::Quaterniond(x);
}

Inertial<double> RandomInertial(Random* random) {
  Inertial<double> body;
  body.mass = random->Uniform(0.5, 2.0);
  body.com = 0.15 * random->NormalVector(3);
  Eigen::Vector3d moments;
  for (int i = 0; i < 3; ++i) {
    const double radius = random->Uniform(0.02, 0.2);
    moments[i] = body.mass * radius * radius;
  }
  const Eigen::Matrix3d R = random->Rotation().toRotationMatrix();
  Eigen::Matrix3d second = R * moments.asDiagonal() * R.transpose();
  second = 0.5 * (second + second.transpose()).eval();
  body.inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
  return body;
}

Mechanism RandomMechanism(int joints, Random* random) {
  constexpr JointType kTypes[] = {JointType::kRevolute, JointType::kContinuous,
                                  JointType::kPrismatic, JointType::kSpherical,
                                  JointType::kFixed};
  Mechanism mechanism;
  mechanism.name = "random";
  mechanism.AddRoot("base_link");
  for (int i = 0; i < joints; ++i) {
    Joint joint;
    joint.name = "joint" + std::to_string(i + 1);
    joint.type = kTypes[random->Integer(i == 0 ? 4 : 5)];
    joint.parent_link =
        random->Uniform(0.0, 1.0) < 2.0 / 3.0 ? i : random->Integer(i + 1);
    joint.R_PJ = random->Rotation().toRotationMatrix();
    joint.axis = random->Direction();
    Inertial<double> body = RandomInertial(random);
    if (joint.type == JointType::kFixed && random->Integer(3) == 0) {
      body = Inertial<double>();
    }
    mechanism.AddJoint(joint, "link" + std::to_string(i + 1),
                       0.3 * random->NormalVector(3), body);
  }
  return mechanism;
}

Mechanism RandomTree(int number, Random* random) {
  return RandomMechanism(2 + number % 12, random);
}

RandomState::RandomState(const Mechanism& mechanism, Random* random)
    : q(2.0 * random->NormalVector(mechanism.nq)),
      qd(random->NormalVector(mechanism.nv)),
      qdd(5.0 * random->NormalVector(mechanism.nv)),
      tau(5.0 * random->NormalVector(mechanism.nv)) {
  for (const Joint& joint : mechanism.joints) {
    if (joint.type == JointType::kSpherical) {
      q.segment<4>(joint.q_index).normalize();
    }
  }
}

void AddEveryEffect(const Catalogue& catalogue, Random* random, Model* model,
                    unsigned but) {
  for (const std::string& name : catalogue.Candidates(model->mechanism())) {
    const auto effect = catalogue.Make(name, model->mechanism(), "test");
    if (!(effect->hooks() & but)) model->AddEffect(effect);
  }
  MechanismParameters<double> values = model->nominal();
  for (size_t i = 0; i < values.effects.size(); ++i) {
    const EffectParameter& parameter = model->effects().parameters()[i];
    values.effects[i] = parameter.null_value +
                        parameter.typical_scale * random->Uniform(0.5, 1.5);
  }
  model->SetNominal(values);
}

}  // namespace sysid
