#include <algorithm>

#include "residuals/structured_walk.h"

namespace sysid {

struct SegmentScratch::Kept {
  internal::StructuredWalk walk;
  const Model* model;
  const ParameterMap* map;
  Integrator integrator;
  internal::ColumnLayout columns;
  std::vector<double> theta;
};

SegmentScratch::SegmentScratch() = default;
SegmentScratch::~SegmentScratch() = default;
SegmentScratch::SegmentScratch(SegmentScratch&&) = default;
SegmentScratch& SegmentScratch::operator=(SegmentScratch&&) = default;

bool SegmentRollout::LinearizeStructured(const double* x0, const double* theta,
                                         bool by_state, bool by_theta,
                                         double* errors, double* x_end,
                                         RowMatrixXd* J, RowMatrixXd* J_end,
                                         SegmentScratch* scratch) const {
  const internal::ColumnLayout columns{by_state, by_theta, false};
  std::unique_ptr<SegmentScratch::Kept>& kept = scratch->kept_;
  if (kept == nullptr || kept->model != model_ || kept->map != parameters_ ||
      kept->integrator != options_.integrator || kept->columns != columns) {
    kept.reset(new SegmentScratch::Kept{
        {*model_, *parameters_, options_.integrator, columns},
        model_,
        parameters_,
        options_.integrator,
        columns,
        {}});
    kept->walk.SetTheta(theta);
    kept->theta.assign(theta, theta + parameters_->size());
  } else if (!std::equal(kept->theta.begin(), kept->theta.end(), theta)) {
    kept->walk.SetTheta(theta);
    kept->theta.assign(theta, theta + parameters_->size());
  }
  internal::StructuredWalk& walk = kept->walk;
  walk.Start(*this);
  walk.SeedState(x0);
  std::copy(x0, x0 + model_->state_size(), x_end);
  for (int k = first_;; ++k) {
    walk.Measure(k, x_end);
    if (k == last_) break;
    if (!walk.Advance(k, x_end)) return false;
  }
  walk.ReadErrors(errors, J);
  walk.ReadState(x_end, J_end);
  return true;
}

}  // namespace sysid
