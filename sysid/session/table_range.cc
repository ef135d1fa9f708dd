#include "sysid/session/table_range.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "models/effects/force_table.h"
#include "sysid/estimation/smooth_positions.h"

namespace sysid {
namespace {

// Of the runs of one process.
struct Covered {
  double below = -std::numeric_limits<double>::infinity();  // 0: -lowest q
  double above = -std::numeric_limits<double>::infinity();
  double speed = 0.0;
};

Covered CoveredBy(const std::vector<Run>& runs, int joint, bool turns) {
  Covered covered;
  for (const Run& run : runs) {
    for (const Channel& channel : run.channels) {
      if (channel.target != joint || !IsScalarPosition(channel.kind)) continue;
      RowMatrixXd q = RowMatrixXd::Constant(
          run.size(), 1, std::numeric_limits<double>::quiet_NaN());
      RowMatrixXd qd = RowMatrixXd::Zero(run.size(), 1);
      // Whatever the noise, the lowest degree: it is not known yet.
      SmoothScalar(run.t, turns, std::numeric_limits<double>::infinity(),
                   channel.values.col(0), q, qd);
      if (!q.allFinite() || !qd.allFinite()) continue;
      covered.below = std::max(covered.below, -q.minCoeff());
      covered.above = std::max(covered.above, q.maxCoeff());
      covered.speed = std::max(covered.speed, qd.cwiseAbs().maxCoeff());
    }
  }
  return covered;
}

// Root mean square of the measured efforts of a joint, or of all (-1).
double EffortSize(const Session& session, const Processes& all, int v) {
  double squares = 0.0, count = 0.0;
  for (const Run& run : session.runs) {
    const auto efforts = v < 0 ? run.effort.middleCols(0, run.effort.cols())
                               : run.effort.middleCols(v, 1);
    squares += efforts.squaredNorm();
    count += static_cast<double>(efforts.size());
  }
  squares = SumOver(all, squares);
  count = SumOver(all, count);
  return count > 0.0 ? std::sqrt(squares / count) : 0.0;
}

void Cover(const ForceTable& table, const Processes& all, Session* session) {
  constexpr double kMargin = 0.025;
  constexpr double kNearlyATurn = 0.8 * 2 * M_PI;
  const Joint& joint = session->model.mechanism().joints[table.joint()];
  Covered covered =
      CoveredBy(session->runs, table.joint(), IsRotation1(joint.type));
  covered.below = MaxOver(all, covered.below);
  covered.above = MaxOver(all, covered.above);
  covered.speed = MaxOver(all, covered.speed);
  double span = covered.below + covered.above;
  if (!(span > 0.0) || !(covered.speed > 0.0)) return;
  if (joint.type == JointType::kContinuous && span > kNearlyATurn) {
    covered.below = covered.above = M_PI;
  } else {
    covered.below += kMargin * span;
    covered.above += kMargin * span;
  }
  covered.speed *= 1.0 + kMargin;
  const auto& own = table.parameters();
  for (const auto& [place, value] :
       {std::pair(ForceTable::kBelow, covered.below),
        std::pair(ForceTable::kAbove, covered.above),
        std::pair(ForceTable::kSpeed, covered.speed)}) {
    const std::string& name = own[place].name;
    const std::vector<std::string>& fixed = session->fixed;
    if (std::find(fixed.begin(), fixed.end(), name) != fixed.end()) continue;
    session->model.SetEffectParameter(name, value);
  }
}

// A fit takes its errors for the sensors' noise, and a table of seven knots
// leaves some ten times that of most laws: with weights as large as the efforts
// rough shapes would make it up between the data. (A prior that is so many
// times tighter is the one of errors so many times larger.)
constexpr double kErrorOfTables = 30.0;

void Believe(const ForceTable& table, const Processes& all, Session* session) {
  const Joint& joint = session->model.mechanism().joints[table.joint()];
  double size = EffortSize(*session, all, joint.v_index);
  if (size == 0.0) size = EffortSize(*session, all, -1);
  if (size == 0.0) size = 1.0;
  for (int k = 0; k < ForceTable::kWeights; ++k) {
    for (FreeParameter& free : session->free) {
      if (free.parameter.name != table.parameters()[k].name || free.prior) {
        continue;
      }
      free.prior = FreeParameter::Prior{0.0, size / kErrorOfTables};
    }
  }
}

}  // namespace

bool IsForceTable(const Effect& effect) {
  return effect.kind() == ForceTable::kName;
}

void CoverTables(Session* session) {
  const Processes& all = ProcessesOf(session->options);
  for (int i = 0; i < session->model.effects().size(); ++i) {
    const std::shared_ptr<const Effect> effect =
        session->model.effects().shared(i);
    if (!IsForceTable(*effect)) continue;
    const auto& table = static_cast<const ForceTable&>(*effect);
    Cover(table, all, session);
    Believe(table, all, session);
  }
}

}  // namespace sysid
