#pragma once

#include <array>
#include <string>
#include <vector>

#include "residuals/costs.h"
#include "sysid/estimation/processes.h"
#include "sysid/estimation/shooting_problem.h"
#include "sysid/inverse_dynamics/coordinates.h"
#include "sysid/inverse_dynamics/equation_rows.h"

namespace sysid {

// Least squares on the equations of motion of all runs. Of every joint v, with
// rows J_v and r_v of (11.2) in the coordinates xi, it keeps the triangle
//
//   [R_v z_v; 0 e_v] = qr(W_v [J_v r_v]),                              (11.3)
//
// W_v the weights of a robust loss. Every estimate that follows, whatever its
// parameters and constraints, minimises
//
//   sum_v |R_v d + z_v|^2 / s_v^2,   d = xi - xi_0,                    (11.4)
//
// which costs nothing that grows with the samples. s_v is the standard
// deviation of what is left of joint v, found by iteration. Where a joint with
// dry friction may rest, no law says what holds it: where twice as much is left
// there as where it slips, those rows have a standard deviation of their own.
class EquationRegression {
 public:
  // The runs' rows with derivatives by the coordinates, so many of both; `all`
  // processes share out the runs, and must outlive this.
  EquationRegression(int joints, int columns, std::vector<EquationRows> runs,
                     std::vector<int> undriven, RobustLoss loss,
                     double loss_scale, int threads,
                     const Processes& all = Alone());

  int columns() const { return columns_; }
  int joints() const { return joints_; }
  const std::vector<EquationRows>& runs() const { return runs_; }

  // Whether there are no efforts, R xi = 0, which tells ratios only.
  bool IsHomogeneous(const Eigen::VectorXd& xi0) const;
  int times() const { return times_; }  // of all runs, a row for each joint
  // Of all runs, `gains` by joint, at xi0.
  void NormaliseByGain(const std::vector<int>& gains,
                       const Eigen::VectorXd& xi0);
  // (11.11): holds the scale of `inertial` by a row that nothing outweighs.
  void HoldScale(const EquationRegression& inertial,
                 const Eigen::VectorXd& xi0);
  // Weighs joints and rows by what this change leaves of them.
  void Reweigh(const Eigen::VectorXd& d);
  // [R z] of (11.4), all joints together, square but for z.
  RowMatrixXd Triangle() const;
  // Of one process: E, with E E^T the covariance of z beside R of `triangle`,
  // which is Triangle(), by (11.6), the estimates without each of some blocks
  // of time: errors are correlated over time and between joints.
  RowMatrixXd ErrorRoot(const RowMatrixXd& triangle,
                        const Eigen::VectorXd& d) const;
  // s_v, N m and N; of undriven joints rad/s^2 and m/s^2.
  const Eigen::VectorXd& sigma() const { return sigma_; }
  // Root mean square of what is left, by joint.
  Eigen::VectorXd Left(const Eigen::VectorXd& d) const;
  // Half of (11.4) of rows like those of the runs: a vector each, times x
  // joints.
  double HalfSquares(const std::vector<Eigen::VectorXd>& rows) const;

 private:
  Eigen::VectorXd EffortSize() const;  // root mean square of g * u, by joint
  RowMatrixXd Merge() const;
  // Of a row, in the unit of its s_v.
  double Sigma(const EquationRows& run, int time, int v) const {
    return run.rests(time, v) ? sigma_[v] * wider_[v] : sigma_[v];
  }
  void Triangularise();

  std::vector<EquationRows> runs_;
  RobustLoss loss_;
  double loss_scale_;
  int threads_;
  const Processes* all_;
  int columns_, joints_, times_ = 0;
  Eigen::VectorXd sigma_;
  Eigen::VectorXd wider_;  // by joint, where it may rest: times sigma_
  std::vector<Eigen::VectorXd> weights_;  // of a run: times x joints
  // By joint; of the times when it slips, and when it may rest.
  std::vector<std::array<RowMatrixXd, 2>> triangles_;
  Eigen::RowVectorXd held_;  // a, of one sample's size, or empty
};

// Joints (of nv) without a measured effort.
std::vector<int> UndrivenJoints(const ShootingProblem& problem);

// By joint (of nv), where its effort is measured: the place in `names` of the
// parameter g of a law, true = (1 + g) measured effort, or -1.
std::vector<int> EffortGains(const Model& model,
                             const std::vector<int>& undriven,
                             const std::vector<std::string>& names);

// Of driven joints with a gain, by how much the measured effort exceeds what
// the model needs, r_v / (1 + g), in place of r_v: that is least for 1 + g = 0,
// with all that the effort moves. At these values of the columns.
void NormaliseByGain(const std::vector<int>& gains, const Eigen::VectorXd& xi0,
                     EquationRows* rows);

// The rows of a regression that are kept in memory at most, of all processes
// together: 0.8 GB, and about as much for the motion.
inline constexpr double kMostNumbers = 1e8;

// The problem itself, or where the rows of its regression would be larger, with
// a part of its runs (DataSet::Part): enough to begin a fit, and to tell which
// combinations of parameters show.
ShootingProblem WithRowsInMemory(const ShootingProblem& problem,
                                 double most = kMostNumbers);

// The filter (filter_choice.h) of a problem's runs, or of such a part of them,
// from the first one; `values` as there.
EquationFilter ChooseFilter(const ShootingProblem& problem,
                            const MechanismParameters<double>& values);

// Makes the equations of these joints (of nv) say nothing.
void Silence(const std::vector<int>& joints, EquationRows* rows);

// The runs of a problem on even times; and their regression, linearised at
// these values.
std::vector<SampledMotion> SampleRuns(const ShootingProblem& problem,
                                      const EquationFilter& filter);
EquationRegression RegressEquations(const ShootingProblem& problem,
                                    const EquationCoordinates& coordinates,
                                    const std::vector<SampledMotion>& sampled,
                                    const MechanismParameters<double>& values,
                                    const std::vector<int>& undriven);

// The least change of the coordinates that solves (11.4): what the data does
// not determine stays. `rank` is how many combinations it does.
Eigen::VectorXd SolveUnconstrained(const RowMatrixXd& triangle,
                                   int* rank = nullptr);

}  // namespace sysid
