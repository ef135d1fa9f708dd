#include "models/parameters.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>

#include "glog/logging.h"
#include "models/error.h"
#include "models/math/constants.h"
#include "models/math/types.h"
#include "models/parameters-impl.h"

namespace sysid {
namespace {

constexpr const char* kAxes[3] = {"x", "y", "z"};
constexpr const char* kEntries[6] = {"xx", "yy", "zz", "xy", "xz", "yz"};
using internal::kColumn;
using internal::kRow;

void AddLinkParameters(const Model& model, int link,
                       std::vector<Parameter>* all) {
  const Mechanism& mechanism = model.mechanism();
  const MechanismParameters<double>& nominal = model.nominal();
  const std::string name = mechanism.links[link].name + ".";
  const Inertial<double>& body = nominal.links[link];
  const double length = LinkLength(mechanism, nominal, link);
  const double size = length > 0 ? length : 0.1;
  if (length > 1e-9) {
    all->push_back({name + "length", "m", ParameterKind::kLength, link, 0,
                    length, 1e-3 * length, kInfinity, length});
  }
  // A link without mass may be given one, which is what a payload is.
  const double mass_scale = body.mass > 0 ? body.mass : 1.0;
  all->push_back({name + "mass", "kg", ParameterKind::kMass, link, 0, body.mass,
                  body.mass > 0 ? 1e-6 * body.mass : 0.0, kInfinity,
                  mass_scale});
  for (int k = 0; k < 3; ++k) {
    all->push_back({name + "com_" + kAxes[k], "m", ParameterKind::kCom, link, k,
                    body.com[k], -kInfinity, kInfinity, size});
  }
  // One that is not there: that of a ball as wide as the centre is far.
  const double trace = body.inertia.trace();
  const double moment = std::max(
      trace > 0 ? trace / 3.0 : 0.4 * body.mass * body.com.squaredNorm(), 1e-9);
  for (int k = 0; k < 6; ++k) {
    all->push_back({name + "i" + kEntries[k], "kg m^2", ParameterKind::kInertia,
                    link, k, body.inertia(kRow[k], kColumn[k]),
                    k < 3 ? 0.0 : -kInfinity, kInfinity, moment});
  }
  all->push_back({name + "inertia_scale", "-", ParameterKind::kInertiaScale,
                  link, 0, 1.0, 1e-6, kInfinity, 1.0});
}

}  // namespace

std::vector<Parameter> AllParameters(const Model& model) {
  std::vector<Parameter> all;
  const Mechanism& mechanism = model.mechanism();
  for (size_t i = 1; i < mechanism.links.size(); ++i) {
    AddLinkParameters(model, static_cast<int>(i), &all);
  }
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      all.push_back({mechanism.joints[i].name + "." + kAxes[k], "m",
                     ParameterKind::kJointOrigin, static_cast<int>(i), k,
                     model.nominal().joint_p[i][k], -kInfinity, kInfinity,
                     std::max(0.1, model.nominal().joint_p[i].norm())});
    }
  }
  all.push_back({"gravity", "m/s^2", ParameterKind::kGravity, 0, 0,
                 model.nominal().gravity, 0.0, kInfinity, 9.81});
  const std::vector<EffectParameter>& effects = model.effects().parameters();
  for (size_t i = 0; i < effects.size(); ++i) {
    all.push_back({effects[i].name, effects[i].unit, ParameterKind::kEffect,
                   static_cast<int>(i), 0, model.nominal().effects[i],
                   effects[i].lower, effects[i].upper,
                   effects[i].typical_scale});
  }
  return all;
}

std::vector<Parameter> FindParameters(const Model& model,
                                      const std::vector<std::string>& names,
                                      const std::string& place) {
  const std::vector<Parameter> all = AllParameters(model);
  std::vector<std::string> known;
  for (const Parameter& parameter : all) known.push_back(parameter.name);
  std::vector<Parameter> found;
  std::set<std::string> seen;
  for (const std::string& name : names) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end()) {
      throw InputError(place, "unknown parameter '" + name + "'",
                       NameHint(name, known));
    }
    if (!seen.insert(name).second) {
      throw InputError(place, "parameter '" + name + "' is named twice",
                       "name it once");
    }
    found.push_back(all[at - known.begin()]);
  }
  return found;
}

void SetParameters(const std::vector<Parameter>& parameters,
                   const std::vector<double>& values, Model* model) {
  CHECK_EQ(parameters.size(), values.size());
  std::vector<int> order(parameters.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return internal::ApplyOrder(parameters[a].kind) <
           internal::ApplyOrder(parameters[b].kind);
  });
  MechanismParameters<double> nominal = model->nominal();
  for (const int i : order) {
    internal::ApplyOne<double>(model->mechanism(), parameters[i], values[i],
                               &nominal);
  }
  model->SetNominal(nominal);
}

ParameterMap::ParameterMap(const Model& model,
                           std::vector<Parameter> parameters,
                           bool keep_possible)
    : model_(&model),
      parameters_(std::move(parameters)),
      transformed_(parameters_.size(), false) {
  if (!keep_possible) return;
  for (size_t link = 0; link < model.mechanism().links.size(); ++link) {
    Cholesky block{static_cast<int>(link), {-1, -1, -1, -1, -1, -1}, 1.0};
    int count = 0;
    for (int i = 0; i < size(); ++i) {
      const Parameter& parameter = parameters_[i];
      if (parameter.kind != ParameterKind::kInertia) continue;
      if (parameter.index != static_cast<int>(link)) continue;
      block.place[parameter.component] = i;
      ++count;
    }
    const Matrix3<double>& I = model.nominal().links[link].inertia;
    const bool diagonal_only = count == 3 && block.place[0] >= 0 &&
                               block.place[1] >= 0 && block.place[2] >= 0 &&
                               I(1, 0) == 0 && I(2, 0) == 0 && I(2, 1) == 0;
    if (count != 6 && !diagonal_only) continue;
    block.scale = std::sqrt(std::max(SecondMoments<double>(I).trace(), 1e-12));
    for (const int place : block.place) {
      if (place >= 0) transformed_[place] = true;
    }
    cholesky_.push_back(block);
  }
}

std::vector<std::string> ParameterMap::names() const {
  std::vector<std::string> names;
  for (const Parameter& parameter : parameters_) {
    names.push_back(parameter.name);
  }
  return names;
}

bool ParameterMap::ThetaOf(const Eigen::VectorXd& values,
                           Eigen::VectorXd* theta) const {
  *theta = values;
  for (const Cholesky& block : cholesky_) {
    Eigen::Matrix3d I = Eigen::Matrix3d::Zero();
    for (int k = 0; k < 6; ++k) {
      if (block.place[k] < 0) continue;
      I(kRow[k], kColumn[k]) = values[block.place[k]];
      I(kColumn[k], kRow[k]) = values[block.place[k]];
    }
    Eigen::Matrix3d S = SecondMoments<double>(I);
    // A thin rod has a zero second moment across it: it starts a little inside.
    S.diagonal().array() += 1e-9 * S.trace();
    const Eigen::LLT<Eigen::Matrix3d> llt(S);
    if (llt.info() != Eigen::Success) return false;
    const Eigen::Matrix3d L = llt.matrixL();
    for (int k = 0; k < 6; ++k) {
      if (block.place[k] < 0) continue;
      const double entry = L(kRow[k], kColumn[k]) / block.scale;
      (*theta)[block.place[k]] = k < 3 ? std::log(entry) : entry;
    }
  }
  return true;
}

Eigen::MatrixXd ParameterMap::ValueJacobian(
    const Eigen::VectorXd& theta) const {
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Identity(size(), size());
  for (const Cholesky& block : cholesky_) {
    std::vector<Jet8> theta_jet(size()), values(size());
    for (int i = 0; i < size(); ++i) theta_jet[i] = Jet8(theta[i]);
    for (int k = 0; k < 6; ++k) {
      if (block.place[k] >= 0) theta_jet[block.place[k]].v[k] = 1.0;
    }
    ValuesOf<Jet8>(theta_jet.data(), values.data());
    for (const int row : block.place) {
      for (int k = 0; k < 6; ++k) {
        if (row >= 0 && block.place[k] >= 0) {
          jacobian(row, block.place[k]) = values[row].v[k];
        }
      }
    }
  }
  return jacobian;
}

std::string ParameterMap::FirstImpossibleLink(const double* theta) const {
  MechanismParameters<double> values;
  Apply<double>(theta, &values);
  for (int i = 0; i < size(); ++i) {
    const Parameter& parameter = parameters_[i];
    const bool sign_matters =
        parameter.kind == ParameterKind::kLength ||
        parameter.kind == ParameterKind::kInertiaScale ||
        (parameter.kind == ParameterKind::kMass && parameter.nominal > 0);
    if (sign_matters && theta[i] < parameter.lower) {
      return model_->mechanism().links[parameter.index].name;
    }
    if (parameter.kind != ParameterKind::kInertia || transformed_[i]) continue;
    const Matrix3<double> S =
        SecondMoments<double>(values.links[parameter.index].inertia);
    Eigen::Matrix3d shifted = S;
    shifted.diagonal().array() += 1e-9 * std::abs(S.trace());
    if (Eigen::LLT<Eigen::Matrix3d>(shifted).info() != Eigen::Success) {
      return model_->mechanism().links[parameter.index].name;
    }
  }
  return "";
}

#define SYSID_INSTANTIATE(T)                                              \
  template void ParameterMap::Apply<T>(const T*, MechanismParameters<T>*) \
      const;                                                              \
  template void ParameterMap::ValuesOf<T>(const T*, T*) const;
SYSID_FOR_EACH_SCALAR(SYSID_INSTANTIATE)
#undef SYSID_INSTANTIATE

}  // namespace sysid
