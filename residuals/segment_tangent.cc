#include "residuals/segment_tangent.h"

#include <algorithm>
#include <optional>

#include "models/dry_friction.h"
#include "models/state.h"
#include "residuals/segment-impl.h"
#include "residuals/structured_walk.h"

namespace sysid {
namespace {

using internal::SegmentWalk;

// Columns [first, first + columns) of [A_k B_k] and of C.
template <typename T>
bool LinearizeColumns(const SegmentRollout& rollout, const double* theta,
                      int first, int columns, SegmentTangent* out) {
  const Model& model = rollout.model();
  const int tangent = model.tangent_size(), nv = model.nv();
  const int size = model.state_size();
  const std::vector<T> constants(theta, theta + rollout.parameters().size());
  SegmentWalk<T> walk(rollout, constants.data());
  std::vector<T> errors(rollout.num_residuals());
  std::vector<T> center(size), x(size), dx(tangent), f(nv), moved(tangent);
  const std::vector<SegmentRow>& rows = rollout.rows();
  size_t row = 0;
  for (int k = rollout.first(); k <= rollout.last(); ++k) {
    const int i = k - rollout.first();
    for (int s = 0; s < size; ++s) center[s] = T(out->states(i, s));
    std::fill(dx.begin(), dx.end(), T(0.0));
    std::fill(f.begin(), f.end(), T(0.0));
    for (int c = 0; c < columns; ++c) {
      const int column = first + c;
      T& seed = column < tangent ? dx[column] : f[column - tangent];
      seed.v[c] = 1.0;
    }
    BoxPlus<T>(model, center.data(), dx.data(), x.data());
    walk.Measure(k, x.data(), errors.data());
    for (; row < rows.size() && rows[row].sample == k; ++row) {
      for (int e = rows[row].first; e < rows[row].first + rows[row].size; ++e) {
        for (int c = 0; c < columns && first + c < tangent; ++c) {
          out->C(e, first + c) = errors[e].v[c];
        }
      }
    }
    if (k == rollout.last()) break;
    if (!walk.Advance(k, 1.0, f.data(), x.data())) return false;
    for (int s = 0; s < size; ++s) center[s] = T(out->states(i + 1, s));
    BoxMinus<T>(model, x.data(), center.data(), moved.data());
    for (int m = 0; m < tangent; ++m) {
      for (int c = 0; c < columns; ++c) {
        const int column = first + c;
        if (column < tangent) {
          out->A[i](m, column) = moved[m].v[c];
        } else {
          out->B[i](m, column - tangent) = moved[m].v[c];
        }
      }
    }
  }
  return true;
}

bool LinearizeByJets(const SegmentRollout& rollout, const double* theta,
                     SegmentTangent* out) {
  return internal::ForEachPass(
      rollout.model().tangent_size() + rollout.model().nv(),
      [&]<typename T>(ScalarTag<T>, int first, int columns) {
        return LinearizeColumns<T>(rollout, theta, first, columns, out);
      });
}

}  // namespace

bool LinearizeAlong(const SegmentRollout& rollout, const double* x0,
                    const double* theta, SegmentTangent* tangent) {
  const Model& model = rollout.model();
  const int count = rollout.last() - rollout.first();
  const StateLayout& at = model.layout();
  const int size = at.size(), n = at.tangent_size(), nv = at.nv();
  tangent->states.resize(count + 1, size);
  tangent->middle.resize(count, size);
  tangent->acceleration.resize(count, nv);
  tangent->A.assign(count, RowMatrixXd(n, n));
  tangent->B.assign(count, RowMatrixXd(n, nv));
  tangent->C.setZero(rollout.num_residuals(), n);
  tangent->r.resize(rollout.num_residuals());
  SegmentWalk<double> walk(rollout, theta);
  std::optional<internal::StructuredWalk> columns;
  if (rollout.linearization() == LinearizationPath::kStructured) {
    columns.emplace(model, rollout.parameters(), rollout.options().integrator,
                    internal::ColumnLayout{.state = true, .efforts = true});
    columns->SetTheta(theta);
    columns->Start(rollout);
  }
  const Run& run = *rollout.measurements().run;
  RowMatrixXd by_state(n, n + nv);
  std::vector<double> x(x0, x0 + size), half(size), held(model.held_size());
  for (int k = rollout.first();; ++k) {
    const int i = k - rollout.first();
    tangent->states.row(i) = Eigen::Map<Eigen::RowVectorXd>(x.data(), size);
    if (columns) {
      columns->SeedState(x.data());
      columns->Measure(k, x.data());
    } else {
      walk.Measure(k, x.data(), tangent->r.data());
    }
    if (k == rollout.last()) break;
    half = x;
    const bool passed = columns && rollout.StepsAfter(k) % 2 == 0;
    if (!passed && !walk.Advance(k, 0.5, nullptr, half.data())) return false;
    if (columns) {
      if (!columns->Advance(k, x.data(), half.data())) return false;
      columns->ReadState(x.data(), &by_state);
      tangent->A[i] = by_state.leftCols(n);
      tangent->B[i] = by_state.rightCols(nv);
    } else if (!walk.Advance(k, 1.0, nullptr, x.data())) {
      return false;
    }
    tangent->middle.row(i) = Eigen::Map<Eigen::RowVectorXd>(half.data(), size);
    const double start = run.t[k], span = run.t[k + 1] - start;
    ActingInputs<double>(run, *walk.workspace(), k, start, span, held.data());
    if (at.nz() > 0) walk.workspace()->z = half.data() + at.z();
    if (!RestOrSlip<double>(walk.workspace(), half.data() + at.q(),
                            half.data() + at.qd(), held.data(),
                            tangent->acceleration.row(i).data())) {
      return false;
    }
  }
  if (!columns) return LinearizeByJets(rollout, theta, tangent);
  RowMatrixXd by_errors(rollout.num_residuals(), n + nv);
  columns->ReadErrors(tangent->r.data(), &by_errors);
  tangent->C = by_errors.leftCols(n);
  return true;
}

}  // namespace sysid
