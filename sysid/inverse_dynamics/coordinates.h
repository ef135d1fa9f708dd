#pragma once

#include <string>
#include <vector>

#include "models/parameters.h"

namespace sysid {

// Numbers in which the equations of motion are linear, or of which they must be
// differentiated: for each link that a parameter touches
//
//   (m, m c_x, m c_y, m c_z, I_xx, I_yy, I_zz, I_xy, I_xz, I_yz),      (11.1)
//
// kg, kg m and kg m^2, the moments about the link's origin (Khalil and Dombre
// 2002, section 9.3.5: the standard inertial parameters); beside them joint
// origins, gravity and the parameters of effects, as they are. The order is
// that of the links, from the base to the tip, then of the rest.
class EquationCoordinates {
 public:
  // Those that `parameters` move.
  EquationCoordinates(const Model& model,
                      const std::vector<Parameter>& parameters);

  int size() const { return static_cast<int>(coordinates_.size()); }
  // "link1.m", "link1.mx", "link1.Jxx", "joint1.x", "joint1.friction".
  std::string Name(int i) const;
  std::string Unit(int i) const;
  std::vector<std::string> Names() const;

  // Those whose ten come first, in this order.
  std::vector<int> Links() const;
  // The place of the first of a link's ten, or -1.
  int PlaceOf(int link) const;
  // The coordinates of these values; size() numbers.
  template <typename T>
  void Read(const MechanismParameters<T>& values, T* xi) const;

  // The values with coordinate begin + c as variable c of the Jets. A link
  // without mass, of which m c says nothing, is seeded at 1 kg: derivatives by
  // (11.1) are those of any other body.
  void Seed(const MechanismParameters<double>& values, int begin,
            MechanismParameters<Jet24>* out) const;
  static constexpr int kWidth = 24;

  // The body that has the ten coordinates `xi`.
  static Inertial<double> BodyAt(const double* xi);

 private:
  enum Of { kBody, kOrigin, kGravityValue, kEffectValue };
  struct Coordinate {
    Of of;
    int index;      // link, joint or effect parameter
    int component;  // of (11.1), or x, y, z
  };
  const Model* model_;
  std::vector<Coordinate> coordinates_;
};

// xi, and d xi / d theta.
struct CoordinatesAt {
  Eigen::VectorXd xi;
  RowMatrixXd D;
};
CoordinatesAt DifferentiateCoordinates(const EquationCoordinates& coordinates,
                                       const ParameterMap& map,
                                       const double* theta);

}  // namespace sysid
