#include "sysid/inverse_dynamics/coordinates.h"

#include <algorithm>
#include <set>
#include <utility>

namespace sysid {
namespace {

constexpr const char* kBodyNames[] = {"m",   "mx",  "my",  "mz",  "Jxx",
                                      "Jyy", "Jzz", "Jxy", "Jxz", "Jyz"};
constexpr int kBodySize = 10;
constexpr int kRow[] = {0, 1, 2, 0, 0, 1}, kColumn[] = {0, 1, 2, 1, 2, 2};

// (11.1) of a body.
template <typename T>
Eigen::Matrix<T, kBodySize, 1> BodyCoordinates(const Inertial<T>& body) {
  Eigen::Matrix<T, kBodySize, 1> xi;
  xi[0] = body.mass;
  xi.template segment<3>(1) = body.com * body.mass;
  const Matrix3<T> about_origin =
      body.inertia + (Matrix3<T>::Identity() * body.com.squaredNorm() -
                      body.com * body.com.transpose()) *
                         body.mass;
  for (int i = 0; i < 6; ++i) xi[4 + i] = about_origin(kRow[i], kColumn[i]);
  return xi;
}

// The body that has these coordinates.
template <typename T>
Inertial<T> BodyOf(const Eigen::Matrix<T, kBodySize, 1>& xi) {
  Inertial<T> body;
  body.mass = xi[0];
  body.com = xi.template segment<3>(1) / xi[0];
  for (int i = 0; i < 6; ++i) {
    body.inertia(kRow[i], kColumn[i]) = xi[4 + i];
    body.inertia(kColumn[i], kRow[i]) = xi[4 + i];
  }
  body.inertia -= (Matrix3<T>::Identity() * body.com.squaredNorm() -
                   body.com * body.com.transpose()) *
                  body.mass;
  return body;
}

}  // namespace

EquationCoordinates::EquationCoordinates(
    const Model& model, const std::vector<Parameter>& parameters)
    : model_(&model) {
  std::set<int> links, effects;
  std::set<std::pair<int, int>> origins;
  bool gravity = false;
  for (const Parameter& parameter : parameters) {
    switch (parameter.kind) {
      case ParameterKind::kLength:
        for (const int j :
             model.mechanism().links[parameter.index].child_joints) {
          for (int c = 0; c < 3; ++c) origins.insert({j, c});
        }
        [[fallthrough]];
      case ParameterKind::kMass:
      case ParameterKind::kCom:
      case ParameterKind::kInertia:
      case ParameterKind::kInertiaScale:
        links.insert(parameter.index);
        break;
      case ParameterKind::kJointOrigin:
        origins.insert({parameter.index, parameter.component});
        break;
      case ParameterKind::kGravity:
        gravity = true;
        break;
      case ParameterKind::kEffect:
        effects.insert(parameter.index);
        break;
    }
  }
  for (const int link : links) {
    for (int c = 0; c < kBodySize; ++c) {
      coordinates_.push_back({kBody, link, c});
    }
  }
  for (const auto& [joint, c] : origins) {
    coordinates_.push_back({kOrigin, joint, c});
  }
  if (gravity) coordinates_.push_back({kGravityValue, 0, 0});
  for (const int i : effects) coordinates_.push_back({kEffectValue, i, 0});
}

std::string EquationCoordinates::Name(int i) const {
  const Coordinate& at = coordinates_[i];
  const Mechanism& mechanism = model_->mechanism();
  switch (at.of) {
    case kBody:
      return mechanism.links[at.index].name + "." + kBodyNames[at.component];
    case kOrigin:
      return mechanism.joints[at.index].name + "." + "xyz"[at.component];
    case kGravityValue:
      return "gravity";
    case kEffectValue:
      break;
  }
  return model_->effects().parameters()[at.index].name;
}

std::string EquationCoordinates::Unit(int i) const {
  const Coordinate& at = coordinates_[i];
  switch (at.of) {
    case kBody:
      return at.component == 0 ? "kg" : at.component < 4 ? "kg m" : "kg m^2";
    case kOrigin:
      return "m";
    case kGravityValue:
      return "m/s^2";
    case kEffectValue:
      break;
  }
  return model_->effects().parameters()[at.index].unit;
}

std::vector<int> EquationCoordinates::Links() const {
  std::vector<int> links;
  for (const Coordinate& at : coordinates_) {
    if (at.of == kBody && at.component == 0) links.push_back(at.index);
  }
  return links;
}

int EquationCoordinates::PlaceOf(int link) const {
  for (int i = 0; i < size(); ++i) {
    if (coordinates_[i].of == kBody && coordinates_[i].index == link) return i;
  }
  return -1;
}

std::vector<std::string> EquationCoordinates::Names() const {
  std::vector<std::string> names;
  for (int i = 0; i < size(); ++i) names.push_back(Name(i));
  return names;
}

Inertial<double> EquationCoordinates::BodyAt(const double* xi) {
  return BodyOf<double>(
      Eigen::Map<const Eigen::Matrix<double, kBodySize, 1>>(xi));
}

template <typename T>
void EquationCoordinates::Read(const MechanismParameters<T>& values,
                               T* xi) const {
  Eigen::Matrix<T, kBodySize, 1> body;
  for (int i = 0; i < size(); ++i) {
    const Coordinate& at = coordinates_[i];
    switch (at.of) {
      case kBody:
        if (at.component == 0) body = BodyCoordinates(values.links[at.index]);
        xi[i] = body[at.component];
        break;
      case kOrigin:
        xi[i] = values.joint_p[at.index][at.component];
        break;
      case kGravityValue:
        xi[i] = values.gravity;
        break;
      case kEffectValue:
        xi[i] = values.effects[at.index];
        break;
    }
  }
}

template void EquationCoordinates::Read<double>(
    const MechanismParameters<double>&, double*) const;
template void EquationCoordinates::Read<Jet24>(
    const MechanismParameters<Jet24>&, Jet24*) const;

void EquationCoordinates::Seed(const MechanismParameters<double>& values,
                               int begin,
                               MechanismParameters<Jet24>* out) const {
  values.CastTo(out);
  for (int c = 0; c < kWidth && begin + c < size(); ++c) {
    const Coordinate& at = coordinates_[begin + c];
    switch (at.of) {
      case kBody: {
        Inertial<double> body = values.links[at.index];
        if (!(body.mass > 0.0)) {
          body.mass = 1.0;
          body.com.setZero();
        }
        // All of the link that these Jets have place for, at once.
        const int first = begin + c - at.component;
        Eigen::Matrix<Jet24, kBodySize, 1> xi =
            BodyCoordinates(body).cast<Jet24>();
        for (int k = 0; k < kBodySize; ++k) {
          const int variable = first + k - begin;
          if (variable >= 0 && variable < kWidth) xi[k].v[variable] = 1.0;
        }
        out->links[at.index] = BodyOf(xi);
        c += kBodySize - 1 - at.component;
        break;
      }
      case kOrigin:
        out->joint_p[at.index][at.component].v[c] = 1.0;
        break;
      case kGravityValue:
        out->gravity.v[c] = 1.0;
        break;
      case kEffectValue:
        out->effects[at.index].v[c] = 1.0;
        break;
    }
  }
}

CoordinatesAt DifferentiateCoordinates(const EquationCoordinates& coordinates,
                                       const ParameterMap& map,
                                       const double* theta) {
  constexpr int kWidth = EquationCoordinates::kWidth;
  CoordinatesAt at;
  const int n = coordinates.size(), p = map.size();
  at.xi.resize(n);
  at.D.resize(n, p);
  std::vector<Jet24> seeded(theta, theta + p), xi(n);
  MechanismParameters<Jet24> values;
  for (int begin = 0; begin == 0 || begin < p; begin += kWidth) {
    const int count = std::min(kWidth, p - begin);
    for (int c = 0; c < count; ++c) {
      seeded[begin + c] = Jet24(theta[begin + c], c);
    }
    map.Apply<Jet24>(seeded.data(), &values);
    coordinates.Read<Jet24>(values, xi.data());
    for (int i = 0; i < n; ++i) {
      at.xi[i] = xi[i].a;
      for (int c = 0; c < count; ++c) at.D(i, begin + c) = xi[i].v[c];
    }
    for (int c = 0; c < count; ++c) {
      seeded[begin + c] = Jet24(theta[begin + c]);
    }
  }
  return at;
}

}  // namespace sysid
