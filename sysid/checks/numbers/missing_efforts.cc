// Efforts that were never measured: of motors by the URDF, zero or absent,
// while the mechanism gains energy as nothing does that is left to itself.

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "models/dynamics.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/estimation/smooth_positions.h"
#include "sysid/io/cell.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

// Smaller is no effort of any machine, and what uninitialised memory holds.
constexpr double kNothing = 1e-100;

// The joints with a motor, where no effort acts in the run and every joint's
// position is measured; else none.
std::vector<std::string> IdleMotors(const Mechanism& mechanism,
                                    const Run& run) {
  std::vector<std::string> motors;
  if (!run.inputs.empty() || run.size() < 5) return {};
  if (run.effort.size() > 0 && run.effort.cwiseAbs().maxCoeff() > kNothing) {
    return {};
  }
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    const int size = VelocitySize(joint);
    if (size == 0) continue;
    const auto target = static_cast<int>(j);
    if (size > 1 ||
        FindChannel(run, ChannelKind::kPosition, target) == nullptr) {
      return {};
    }
    if (joint.effort_limit > 0.0) motors.push_back(joint.name);
  }
  return motors;
}

struct Energies {
  double rise = 0.0;   // the largest, from a time to a later one, J
  double swing = 0.0;  // of the kinetic and the potential energy, J
};

Energies EnergiesOf(const Model& model, const Run& run) {
  const Mechanism& mechanism = model.mechanism();
  const double any = std::numeric_limits<double>::infinity();
  RowMatrixXd q(run.size(), mechanism.nq), qd(run.size(), mechanism.nv);
  q.setZero();
  qd.setZero();
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    const Channel* position =
        FindChannel(run, ChannelKind::kPosition, static_cast<int>(j));
    if (position == nullptr) continue;
    SmoothScalar(run.t, IsRotation1(joint.type), any, position->values.col(0),
                 q.middleCols(joint.q_index, 1),
                 qd.middleCols(joint.v_index, 1));
  }
  Workspace<double> ws(model);
  ws.SetParameters(model.nominal());
  double least = any, low_k = any, high_k = -any, low_v = any, high_v = -any;
  Energies energies;
  for (int k = 0; k < run.size(); ++k) {
    const double kinetic =
        KineticEnergy(&ws, q.row(k).data(), qd.row(k).data());
    const double potential = PotentialEnergy(&ws, q.row(k).data());
    low_k = std::min(low_k, kinetic);
    high_k = std::max(high_k, kinetic);
    low_v = std::min(low_v, potential);
    high_v = std::max(high_v, potential);
    least = std::min(least, kinetic + potential);
    energies.rise = std::max(energies.rise, kinetic + potential - least);
  }
  energies.swing = high_k - low_k + high_v - low_v;
  return energies;
}

}  // namespace

// A mechanism that is left to itself trades the one energy for the other. With
// masses or lengths that are wrong by a factor of up to two, its sum still
// rises by less than half of what the two swing together.
void CheckMissingEfforts(const CheckInput& input,
                         std::vector<Finding>* findings) {
  constexpr double kRise = 0.5;
  const Mechanism& mechanism = input.model->mechanism();
  // In another unit it is another motion.
  std::set<const Run*> misread;
  for (const Series& series : AllSeries(input)) {
    if (series.channel->kind == ChannelKind::kPosition &&
        IsBeyondLimits(series, mechanism.joints[series.channel->target])) {
      misread.insert(series.run);
    }
  }
  for (const Run* run : input.runs) {
    if (misread.contains(run)) continue;
    const std::vector<std::string> motors = IdleMotors(mechanism, *run);
    if (motors.empty()) continue;
    const Energies energies = EnergiesOf(*input.model, *run);
    if (!(energies.rise > kRise * energies.swing)) continue;
    std::vector<std::string> columns;
    for (const std::string& motor : motors) columns.push_back(motor + ".tau");
    Finding finding =
        At(*run, Join(columns), kMissingEfforts, Severity::kWrong);
    finding.weight = 1e6;
    finding.evidence =
        "efforts are not measured: they are zero or absent, and "
        "yet the mechanism gains " +
        ShortNumber(energies.rise) +
        " J, as motors make it and nothing that is left to "
        "itself does";
    finding.consequence =
        "friction and inertia are fitted in place of the motors, to values "
        "that mean nothing";
    finding.remedies = {"record the efforts, or the commands as " +
                        motors.front() + ".cmd with --add position_drive@" +
                        motors.front()};
    findings->push_back(std::move(finding));
  }
}

}  // namespace sysid
