#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>

#include "glog/logging.h"
#include "models/effects/coulomb_friction.h"
#include "mujoco/mujoco.h"
#include "tests/acceptance/hidden/plant.h"
#include "tests/support/mjcf.h"
#include "tests/support/mujoco_model.h"

namespace sysid {
namespace {

// Adds its force to data->qfrc_passive.
using Force = std::function<void(const mjModel*, mjData*)>;

// MuJoCo calls one function for all models; each thread steps one at a time.
thread_local const std::vector<Force>* acting_forces = nullptr;

void AddActingForces(const mjModel* model, mjData* data) {
  if (acting_forces == nullptr) return;
  for (const Force& force : *acting_forces) force(model, data);
}

class Acting {
 public:
  explicit Acting(const std::vector<Force>* forces) {
    static const bool installed = [] {
      mjcb_passive = AddActingForces;
      // Advance says what is lost; else it would go into a file of MuJoCo's.
      mju_user_warning = [](const char*) {};
      return true;
    }();
    CHECK(installed);
    acting_forces = forces;
  }
  ~Acting() { acting_forces = nullptr; }
};

std::string Digits(double value) {
  std::ostringstream out;
  out.precision(17);
  out << value;
  return out.str();
}

// Adds attributes to the joint element of a link in ToMjcf's text.
void AddJointAttributes(int link, const std::string& attributes,
                        std::string* text) {
  const std::string element = "<joint name=\"j" + std::to_string(link) + "\"";
  const size_t at = text->find(element);
  CHECK(at != std::string::npos);
  text->insert(at + element.size(), " " + attributes);
}

class MujocoPlant : public Plant {
 public:
  MujocoPlant(const Model& truth, const std::vector<PlantedEffect>& planted,
              const MujocoPlantOptions& options)
      : mechanism_(truth.mechanism()), options_(options) {
    mechanism_.nominal = truth.nominal();
    for (const PlantedEffect& effect : planted) ChangeBody(effect);
    std::vector<double> armature(mechanism_.joints.size(), 0.0);
    for (const PlantedEffect& effect : planted) {
      if (effect.kind() == "armature") {
        armature[JointOf(effect)] = effect.Get("armature");
      }
    }
    std::string text = ToMjcf(mechanism_, armature);
    for (const PlantedEffect& effect : planted) ChangeText(effect, &text);
    model_ = LoadMjcf(text);
    data_ = mj_makeData(model_);
    for (const Joint& joint : mechanism_.joints) {
      const std::string name = "j" + std::to_string(joint.child_link);
      const int id = mj_name2id(model_, mjOBJ_JOINT, name.c_str());
      q_address_.push_back(id < 0 ? -1 : model_->jnt_qposadr[id]);
      dof_address_.push_back(id < 0 ? -1 : model_->jnt_dofadr[id]);
    }
    model_->opt.integrator = mjINT_RK4;
    model_->opt.tolerance = 1e-14;
    gain_.assign(model_->nv, 1.0);
    for (const PlantedEffect& effect : planted) Install(effect);
  }
  MujocoPlant(const MujocoPlant&) = delete;
  MujocoPlant& operator=(const MujocoPlant&) = delete;
  ~MujocoPlant() override {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }

  void SetState(const Eigen::VectorXd& x) override {
    mj_resetData(model_, data_);
    for (Lag& lag : lags_) lag.y = std::numeric_limits<double>::quiet_NaN();
    for (size_t i = 0; i < mechanism_.joints.size(); ++i) {
      const Joint& joint = mechanism_.joints[i];
      if (joint.type == JointType::kFixed) continue;
      const double* q = x.data() + joint.q_index;
      double* qpos = data_->qpos + q_address_[i];
      if (joint.type == JointType::kSpherical) {
        qpos[0] = q[3];
        for (int k = 0; k < 3; ++k) qpos[k + 1] = q[k];
      } else {
        qpos[0] = q[0];
      }
      const double* qd = x.data() + mechanism_.nq + joint.v_index;
      for (int k = 0; k < VelocitySize(joint.type); ++k) {
        data_->qvel[dof_address_[i] + k] = qd[k];
      }
    }
  }

  Eigen::VectorXd State() const override {
    Eigen::VectorXd x(mechanism_.nq + mechanism_.nv);
    for (size_t i = 0; i < mechanism_.joints.size(); ++i) {
      const Joint& joint = mechanism_.joints[i];
      if (joint.type == JointType::kFixed) continue;
      double* q = x.data() + joint.q_index;
      const double* qpos = data_->qpos + q_address_[i];
      if (joint.type == JointType::kSpherical) {
        for (int k = 0; k < 3; ++k) q[k] = qpos[k + 1];
        q[3] = qpos[0];
      } else {
        q[0] = qpos[0];
      }
      double* qd = x.data() + mechanism_.nq + joint.v_index;
      for (int k = 0; k < VelocitySize(joint.type); ++k) {
        qd[k] = data_->qvel[dof_address_[i] + k];
      }
    }
    return x;
  }

  // In pieces between which the held efforts change, with the delay.
  bool Advance(const Run& run, int sample) override {
    const Acting acting(&forces_);
    const double begin = run.t[sample], end = run.t[sample + 1];
    const double tiny = 1e-9 * (end - begin);
    std::vector<double> cuts{begin};
    for (const double t : run.t) {
      if (t + delay_ > begin + tiny && t + delay_ < end - tiny) {
        cuts.push_back(t + delay_);
      }
    }
    cuts.push_back(end);
    for (size_t i = 0; i + 1 < cuts.size(); ++i) {
      const double middle = (cuts[i] + cuts[i + 1]) / 2 - delay_;
      const auto after = std::upper_bound(run.t.begin(), run.t.end(), middle);
      for (Lag& lag : lags_) lag.Hold(data_);
      Apply(run, std::max(0, static_cast<int>(after - run.t.begin()) - 1));
      for (Lag& lag : lags_) lag.Begin(data_);
      const double length = cuts[i + 1] - cuts[i];
      const int steps = std::max(
          1, static_cast<int>(std::ceil(length / options_.step * (1 - 1e-9))));
      model_->opt.timestep = length / steps;
      for (int s = 0; s < steps; ++s) mj_step(model_, data_);
    }
    for (int i = 0; i < mjNWARNING; ++i) {
      if (data_->warning[i].number > 0) return false;
    }
    return true;
  }

 private:
  // lag y' = u - y, u the effort that is applied, held from `since`; y is the
  // first u before.
  struct Lag {
    int dof;
    double lag;
    double y = std::numeric_limits<double>::quiet_NaN(), since = 0.0;

    double Acting(const mjData* data) const {
      const double u = data->qfrc_applied[dof];
      return u + (y - u) * std::exp((since - data->time) / lag);
    }
    void Hold(const mjData* data) {
      y = Acting(data);
      since = data->time;
    }
    void Begin(const mjData* data) {
      if (std::isnan(y)) y = data->qfrc_applied[dof];
    }
  };

  int JointOf(const PlantedEffect& effect) const {
    const int joint = mechanism_.FindJoint(effect.target());
    CHECK_GE(joint, 0) << effect.name;
    return joint;
  }

  void Apply(const Run& run, int row) {
    for (size_t i = 0; i < mechanism_.joints.size(); ++i) {
      const Joint& joint = mechanism_.joints[i];
      for (int k = 0; k < VelocitySize(joint.type); ++k) {
        const int dof = dof_address_[i] + k;
        data_->qfrc_applied[dof] =
            gain_[dof] * run.effort(row, joint.v_index + k);
      }
    }
  }

  void ChangeBody(const PlantedEffect& effect) {
    const std::string kind = effect.kind();
    if (kind != "mass" && kind != "com" && kind != "inertia") return;
    Inertial<double>& body =
        mechanism_.nominal.links[mechanism_.FindLink(effect.target())];
    if (kind == "mass") {
      body.mass = effect.Get("mass");
    } else if (kind == "com") {
      body.com.x() = effect.Get("com_x");
      body.com.y() = effect.Get("com_y");
    } else {
      body.inertia(0, 0) = effect.Get("ixx");
      body.inertia(1, 1) = effect.Get("iyy");
      body.inertia(2, 2) = effect.Get("izz");
    }
  }

  void ChangeText(const PlantedEffect& effect, std::string* text) {
    if (effect.kind() == "spring") {
      const Joint& joint = mechanism_.joints[JointOf(effect)];
      std::string attributes =
          "stiffness=\"" + Digits(effect.Get("stiffness")) + "\"";
      if (joint.type != JointType::kSpherical) {
        attributes +=
            " springref=\"" + Digits(effect.Get("spring_reference")) + "\"";
      }
      AddJointAttributes(joint.child_link, attributes, text);
    } else if (effect.kind() == "coulomb_friction" &&
               options_.friction_time > 0.0) {
      const Joint& joint = mechanism_.joints[JointOf(effect)];
      CHECK(joint.type != JointType::kSpherical) << effect.name;
      AddJointAttributes(joint.child_link,
                         "frictionloss=\"" + Digits(effect.Get("friction")) +
                             "\" solreffriction=\"" +
                             Digits(options_.friction_time) + " 1\"",
                         text);
    }
  }

  // A force along the velocity of a joint: -level(speed) qd.
  void InstallAlongVelocity(int joint,
                            const std::function<double(double speed)>& level) {
    const int dof = dof_address_[joint];
    const int count = VelocitySize(mechanism_.joints[joint].type);
    forces_.push_back([=](const mjModel*, mjData* data) {
      double speed = 0.0;
      for (int k = 0; k < count; ++k) {
        speed = std::hypot(speed, data->qvel[dof + k]);
      }
      const double factor = level(speed);
      for (int k = 0; k < count; ++k) {
        data->qfrc_passive[dof + k] -= factor * data->qvel[dof + k];
      }
    });
  }

  void InstallFriction(const PlantedEffect& effect, double fast, double slow,
                       double between) {
    const int joint = JointOf(effect);
    const bool slides = mechanism_.joints[joint].type == JointType::kPrismatic;
    const double smooth = FrictionSmoothingSpeed(slides);
    InstallAlongVelocity(joint, [=](double speed) {
      const double level =
          fast + (slow - fast) * std::exp(-std::pow(speed / between, 2));
      return level / std::hypot(speed, smooth);
    });
  }

  void InstallAtLink(const PlantedEffect& effect) {
    const int link = mechanism_.FindLink(effect.target());
    const int body =
        mj_name2id(model_, mjOBJ_BODY, ("l" + std::to_string(link)).c_str());
    const double drag = effect.Get("drag");
    forces_.push_back([=](const mjModel* model, mjData* data) {
      double velocity[6];  // angular, linear; of the centre of mass
      mj_objectVelocity(model, data, mjOBJ_BODY, body, velocity, 0);
      const double speed = std::hypot(velocity[3], velocity[4], velocity[5]);
      double force[3];
      for (int k = 0; k < 3; ++k) force[k] = -drag * speed * velocity[3 + k];
      const double torque[3] = {0.0, 0.0, 0.0};
      mj_applyFT(model, data, force, torque, data->xipos + 3 * body, body,
                 data->qfrc_passive);
    });
  }

  void Install(const PlantedEffect& effect) {
    const std::string kind = effect.kind();
    if (kind == "mass" || kind == "com" || kind == "inertia" ||
        kind == "armature" || kind == "spring" ||
        kind == "transmission_error" || kind.starts_with("sensor_")) {
      return;
    }
    if (kind == "effort_delay") {
      delay_ = effect.Get("effort_delay");
    } else if (kind == "gravity_tilt") {
      const Eigen::Vector3d turn(effect.Get("gravity_tilt_x"),
                                 effect.Get("gravity_tilt_y"), 0.0);
      const Eigen::Vector3d down(0.0, 0.0, -mechanism_.nominal.gravity);
      Eigen::Map<Eigen::Vector3d>(model_->opt.gravity) =
          Eigen::AngleAxisd(turn.norm(), turn.normalized()) * down;
    } else if (kind == "aerodynamic_drag") {
      InstallAtLink(effect);
    } else if (kind == "gear_coupling") {
      InstallBetween(effect);
    } else {
      InstallOnJoint(effect);
    }
  }

  // Damping and friction of q_1 + s q_2 of two joints.
  void InstallBetween(const PlantedEffect& effect) {
    const std::string names = effect.target();
    const size_t comma = names.find(',');
    const int first = mechanism_.FindJoint(names.substr(0, comma));
    const int second = mechanism_.FindJoint(names.substr(comma + 1));
    const int a = dof_address_[first], b = dof_address_[second];
    const double smooth = FrictionSmoothingSpeed(false);
    const double s = effect.Get("coupling_sign"),
                 d = effect.Get("coupling_damping"),
                 c = effect.Get("coupling_friction");
    forces_.push_back([=](const mjModel*, mjData* data) {
      const double rate = data->qvel[a] + s * data->qvel[b];
      const double force = -d * rate - c * rate / std::hypot(rate, smooth);
      data->qfrc_passive[a] += force;
      data->qfrc_passive[b] += s * force;
    });
  }

  // What a drive does with the effort u that it is told, instead of u.
  void InstallDrive(int dof,
                    const std::function<double(double u, double qd)>& acting) {
    forces_.push_back([=](const mjModel*, mjData* data) {
      const double u = data->qfrc_applied[dof];
      data->qfrc_passive[dof] += acting(u, data->qvel[dof]) - u;
    });
  }

  void InstallOnJoint(const PlantedEffect& effect) {
    const std::string kind = effect.kind();
    const int joint = JointOf(effect);
    const int dof = dof_address_[joint];
    const int count = VelocitySize(mechanism_.joints[joint].type);
    const double smooth = FrictionSmoothingSpeed(
        mechanism_.joints[joint].type == JointType::kPrismatic);
    if (kind == "viscous_damping") {
      for (int k = 0; k < count; ++k) {
        model_->dof_damping[dof + k] = effect.Get("damping");
      }
    } else if (kind == "coulomb_friction") {
      const double c = effect.Get("friction");
      if (options_.friction_time == 0.0) InstallFriction(effect, c, c, 1.0);
    } else if (kind == "stribeck_friction") {
      InstallFriction(effect, effect.Get("friction"),
                      effect.Get("static_friction"),
                      effect.Get("stribeck_velocity"));
    } else if (kind == "quadratic_drag") {
      const double b = effect.Get("quadratic_drag");
      InstallAlongVelocity(joint, [=](double speed) { return b * speed; });
    } else if (kind == "effort_bias") {
      const double bias = effect.Get("effort_bias");
      forces_.push_back([=](const mjModel*, mjData* data) {
        data->qfrc_passive[dof] += bias;
      });
    } else if (kind == "effort_gain") {
      for (int k = 0; k < count; ++k) {
        gain_[dof + k] += effect.Get("effort_gain");
      }
    } else if (kind == "cogging") {
      const int q = q_address_[joint];
      const double s = effect.Get("cogging_sin"), c = effect.Get("cogging_cos"),
                   n = effect.Get("cogging_order");
      forces_.push_back([=](const mjModel*, mjData* data) {
        data->qfrc_passive[dof] +=
            s * std::sin(n * data->qpos[q]) + c * std::cos(n * data->qpos[q]);
      });
    } else if (kind == "cubic_damping") {
      const double b = effect.Get("cubic_damping");
      InstallAlongVelocity(joint,
                           [=](double speed) { return b * speed * speed; });
    } else if (kind == "asymmetric_friction") {
      const double c = effect.Get("friction"), d = effect.Get("damping"),
                   more_c = effect.Get("friction_asymmetry"),
                   more_d = effect.Get("damping_asymmetry");
      InstallAlongVelocity(joint, [=](double speed) {
        return c / std::hypot(speed, smooth) + d;
      });
      forces_.push_back([=](const mjModel*, mjData* data) {
        data->qfrc_passive[dof] -= more_c + more_d * std::abs(data->qvel[dof]);
      });
    } else if (kind == "load_friction") {
      const double mu = effect.Get("load_friction");
      InstallDrive(dof, [=](double u, double qd) {
        return u - mu * std::abs(u) * qd / std::hypot(qd, smooth);
      });
    } else if (kind == "effort_limit") {
      const double most = effect.Get("effort_limit"),
                   r = effect.Get("inverse_no_load_speed");
      InstallDrive(dof, [=](double u, double qd) {
        return std::clamp(u, -std::clamp(most * (1 + r * qd), 0.0, most),
                          std::clamp(most * (1 - r * qd), 0.0, most));
      });
    } else if (kind == "actuator_lag") {
      lags_.push_back({dof, effect.Get("actuator_lag")});
      const size_t i = lags_.size() - 1;
      forces_.push_back([=, this](const mjModel*, mjData* data) {
        data->qfrc_passive[dof] +=
            lags_[i].Acting(data) - data->qfrc_applied[dof];
      });
    } else {
      LOG(FATAL) << "MuJoCo has no way to plant " << effect.name;
    }
  }

  Mechanism mechanism_;
  const MujocoPlantOptions options_;
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
  std::vector<int> q_address_, dof_address_;  // per joint of ours
  std::vector<Force> forces_;
  std::vector<Lag> lags_;
  std::vector<double> gain_;  // per MuJoCo dof
  double delay_ = 0.0;        // s
};

}  // namespace

std::unique_ptr<Plant> MakeMujocoPlant(
    const Model& truth, const std::vector<PlantedEffect>& planted,
    const MujocoPlantOptions& options) {
  return std::make_unique<MujocoPlant>(truth, planted, options);
}

}  // namespace sysid
