#include "sysid/inverse_dynamics/effort_audit.h"

#include <cmath>

#include "models/math/decompositions.h"

namespace sysid {

bool EffortAudit::IsEffort() const {
  constexpr double kLeastExplained = 0.3;
  // Bodies a tenth or ten times as heavy are another machine's. The scale tells
  // where so much of the effort is what bodies need.
  constexpr double kAnotherMachine = 10.0, kTells = 0.2;
  if (explained < kLeastExplained) return false;
  return rigid < kTells || (std::abs(scale) > 1.0 / kAnotherMachine &&
                            std::abs(scale) < kAnotherMachine);
}

std::vector<EffortAudit> AuditEfforts(const std::vector<EquationRows>& runs) {
  constexpr int kTerms = 4;
  const int nv = runs.empty() ? 0 : runs.front().nv;
  int times = 0;
  for (const EquationRows& run : runs) times += run.times();
  std::vector<EffortAudit> audits(nv);
  if (times < 10 * kTerms) return audits;
  for (int v = 0; v < nv; ++v) {
    Eigen::MatrixXd A(times, kTerms);
    Eigen::VectorXd u(times);
    int at = 0;
    for (const EquationRows& run : runs) {
      for (int t = 0; t < run.times(); ++t, ++at) {
        const double qd = run.qd(t, v);
        u[at] = run.effort(t, v);
        A.row(at) << u[at] - run.rows(t * nv + v, run.rows.cols() - 1), qd,
            std::copysign(1.0, qd), run.qdd(t, v);
      }
    }
    const double all = u.norm();
    if (!(all > 0.0)) continue;  // not measured
    const Eigen::VectorXd b = LeastSquares(A, u);
    audits[v].explained = 1.0 - std::pow((u - A * b).norm() / all, 2);
    audits[v].scale = b[0];
    audits[v].rigid = std::abs(b[0]) * A.col(0).norm() / all;
  }
  return audits;
}

}  // namespace sysid
