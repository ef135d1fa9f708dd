#pragma once

#include <string>
#include <vector>

#include "models/model.h"

namespace sysid {

// Parameters by name (docs/interface.md section 3) and how they act on the
// values of a mechanism.

enum class ParameterKind {
  kLength,        // <link>.length
  kMass,          // <link>.mass
  kCom,           // <link>.com_x|y|z
  kInertia,       // <link>.ixx|iyy|izz|ixy|ixz|iyz
  kInertiaScale,  // <link>.inertia_scale, 1 at the nominal values
  kJointOrigin,   // <joint>.x|y|z
  kGravity,       // gravity
  kEffect,        // an effect's
};

struct Parameter {
  std::string name;
  std::string unit;
  ParameterKind kind = ParameterKind::kEffect;
  int index = 0;      // link, joint, or place among the effects' parameters
  int component = 0;  // x, y, z; xx, yy, zz, xy, xz, yz
  double nominal = 0.0;
  double lower = 0.0, upper = 0.0;  // physical bounds; +-infinity where none
  double typical_scale = 1.0;       // > 0; a plausible size, for scaling
};

// Every parameter that the model has, whether or not anyone fits it.
std::vector<Parameter> AllParameters(const Model& model);

// Those with the given names, in that order. Throws InputError at `place` for
// an unknown one (nearest name) or one that comes twice.
std::vector<Parameter> FindParameters(const Model& model,
                                      const std::vector<std::string>& names,
                                      const std::string& place);

// Sets nominal values of the model by name; lengths act first (they scale what
// the others set), in the order of ParameterMap::Apply.
void SetParameters(const std::vector<Parameter>& parameters,
                   const std::vector<double>& values, Model* model);

// The map from the vector theta that an estimator moves to the values of the
// mechanism. theta_i is the parameter's value itself, but for the rotational
// inertia of a link whose entries are all free (six, or the diagonal of one
// with a zero off-diagonal): there theta holds the log-Cholesky factor of the
// second moments S = tr(I)/2 - I = L L^T, so that every theta is a possible
// body (Rucker and Wensing 2022, about the centre of mass):
//   theta_xx, theta_yy, theta_zz = log(L_11 / s), log(L_22 / s), log(L_33 / s),
//   theta_xy, theta_xz, theta_yz = L_21 / s, L_31 / s, L_32 / s,
// s^2 = tr(S) at the nominal values.                                   (4.1)
class ParameterMap {
 public:
  // Without `keep_possible` theta is the values themselves, whatever is free:
  // for derivatives, not for searching.
  ParameterMap(const Model& model, std::vector<Parameter> parameters,
               bool keep_possible = true);

  int size() const { return static_cast<int>(parameters_.size()); }
  const std::vector<Parameter>& parameters() const { return parameters_; }
  std::vector<std::string> names() const;

  // The model's nominal values with theta in their place. Order: lengths,
  // masses, centres of mass and inertias, inertia scales, origins, the rest.
  template <typename T>
  void Apply(const T* theta, MechanismParameters<T>* out) const;

  // Parameter values <-> theta. ThetaOf returns false where the values are no
  // possible body.
  template <typename T>
  void ValuesOf(const T* theta, T* values) const;
  bool ThetaOf(const Eigen::VectorXd& values, Eigen::VectorXd* theta) const;
  // d values / d theta, size x size.
  Eigen::MatrixXd ValueJacobian(const Eigen::VectorXd& theta) const;
  // Whether theta_i is not the parameter's own value.
  bool IsTransformed(int i) const { return transformed_[i]; }

  // The name of the first link that theta makes impossible, else "": a length,
  // mass or inertia scale below its physical bound, or free entries of an
  // inertia that is not positive (those that (4.1) does not keep so). A mass
  // that is zero nominally (a payload's) may pass through negative values.
  std::string FirstImpossibleLink(const double* theta) const;

 private:
  // A link whose inertia is parameterised by (4.1): places in theta by entry,
  // -1 for the off-diagonal of a diagonal inertia.
  struct Cholesky {
    int link;
    int place[6];
    double scale;  // s
  };
  template <typename T>
  Matrix3<T> InertiaOf(const Cholesky& block, const T* theta) const;

  const Model* model_;
  std::vector<Parameter> parameters_;
  std::vector<Cholesky> cholesky_;
  std::vector<bool> transformed_;
};

}  // namespace sysid
