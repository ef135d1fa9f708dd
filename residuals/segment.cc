#include "residuals/segment.h"

#include <algorithm>
#include <cmath>

#include "glog/logging.h"
#include "models/dynamics_tangent.h"
#include "residuals/segment-impl.h"

namespace sysid {

std::string ToString(LinearizationPath path) {
  return path == LinearizationPath::kStructured ? "structured" : "jets";
}

LinearizationPath PathOf(const Model& model, const RolloutOptions& options) {
  return DynamicsTangent::Covers(model) ? options.linearization
                                        : LinearizationPath::kJets;
}

SegmentRollout::SegmentRollout(const Model* model,
                               const ParameterMap* parameters,
                               const Measurements* measurements, int first,
                               int last, const RolloutOptions& options)
    : model_(model),
      parameters_(parameters),
      measurements_(measurements),
      first_(first),
      last_(last),
      options_(options),
      linearization_(PathOf(*model, options)) {
  const Run& run = *measurements->run;
  CHECK_LT(first, last);
  CHECK_LT(last, run.size());
  const int end = last == run.size() - 1 ? last + 1 : last;
  for (int k = first; k < end; ++k) {
    for (size_t c = 0; c < run.channels.size(); ++c) {
      if (std::isnan(run.channels[c].values(k, 0))) continue;
      const int size = ResidualSize(measurements->residuals[c]);
      rows_.push_back({k, static_cast<int>(c), num_residuals_, size});
      num_residuals_ += size;
      const ChannelKind kind = run.channels[c].kind;
      needs_kinematics_ |= kind == ChannelKind::kFramePosition;
      needs_motors_ |= kind == ChannelKind::kMotorPosition;
    }
  }
}

int SegmentRollout::StepsAfter(int k) const {
  if (options_.step <= 0) return 1;
  const std::vector<double>& t = measurements_->run->t;
  // 1e-9: a step equal to the sample period but for rounding is one step.
  return std::max(1, static_cast<int>(std::ceil((t[k + 1] - t[k]) /
                                                options_.step * (1 - 1e-9))));
}

namespace {

// Of the columns of the state and then theta those from `first_column` on, so
// many, with a Jet's derivatives; they go to J and J_end from column `place`.
template <typename T>
bool LinearizePass(const SegmentRollout& rollout, const double* x0,
                   const double* theta, int first_column, int columns,
                   int place, double* errors, double* x_end, RowMatrixXd* J,
                   RowMatrixXd* J_end) {
  const Model& model = rollout.model();
  const int tangent = model.tangent_size(), size = model.state_size();
  const std::vector<T> center(x0, x0 + size);
  std::vector<T> theta_jet(theta, theta + rollout.parameters().size());
  std::vector<T> dx(tangent, T(0.0)), start(size);
  for (int c = 0; c < columns; ++c) {
    const int column = first_column + c;
    T& seed = column < tangent ? dx[column] : theta_jet[column - tangent];
    seed.v[c] = 1.0;
  }
  BoxPlus<T>(model, center.data(), dx.data(), start.data());
  std::vector<T> r(rollout.num_residuals()), end(size);
  if (!rollout(start.data(), theta_jet.data(), r.data(), end.data())) {
    return false;
  }
  for (size_t i = 0; i < r.size(); ++i) {
    errors[i] = r[i].a;
    for (int c = 0; c < columns; ++c) (*J)(i, place + c) = r[i].v[c];
  }
  for (int i = 0; i < size; ++i) x_end[i] = end[i].a;
  const std::vector<T> end_center(x_end, x_end + size);
  BoxMinus<T>(model, end.data(), end_center.data(), dx.data());
  for (int i = 0; i < tangent; ++i) {
    for (int c = 0; c < columns; ++c) (*J_end)(i, place + c) = dx[i].v[c];
  }
  return true;
}

}  // namespace

bool SegmentRollout::LinearizeBy(bool by_state, bool by_theta, const double* x0,
                                 const double* theta, double* errors,
                                 double* x_end, RowMatrixXd* J,
                                 RowMatrixXd* J_end,
                                 SegmentScratch* scratch) const {
  const int tangent = model_->tangent_size();
  const int total =
      (by_state ? tangent : 0) + (by_theta ? parameters_->size() : 0);
  J->resize(num_residuals_, total);
  J_end->resize(tangent, total);
  bool ok = true;
  if (linearization_ == LinearizationPath::kStructured) {
    SegmentScratch own;
    ok = LinearizeStructured(x0, theta, by_state, by_theta, errors, x_end, J,
                             J_end, scratch != nullptr ? scratch : &own);
  } else {
    const int first = by_state ? 0 : tangent;
    ok = internal::ForEachPass(
        total, [&]<typename T>(ScalarTag<T>, int place, int columns) {
          return LinearizePass<T>(*this, x0, theta, first + place, columns,
                                  place, errors, x_end, J, J_end);
        });
  }
  // A step too long for the model may leave finite values and not derivatives.
  return ok && J->allFinite() && J_end->allFinite();
}

#define SYSID_INSTANTIATE(T)                                              \
  template bool SegmentRollout::operator()<T>(const T*, const T*, T*, T*, \
                                              std::vector<T>*) const;
SYSID_FOR_EACH_SCALAR(SYSID_INSTANTIATE)
#undef SYSID_INSTANTIATE

}  // namespace sysid
