#include "sysid/checks/as_read.h"

#include <algorithm>
#include <cmath>

namespace sysid {
namespace {

constexpr int kSamples = 2000;  // of an excerpt
constexpr int kGlanceSamples = 800;

EstimationOptions OwnSteps(EstimationOptions options) {
  options.rollout.step = 0.0;
  return options;
}

}  // namespace

AsRead::AsRead(const CheckInput& input, double part)
    : input_(input),
      excerpt_(input.runs, static_cast<int>(part * kSamples)),
      glance_(input.runs, static_cast<int>(part * kGlanceSamples)),
      options_(OwnSteps(input.options)),
      lean_(WithFriction(*input.model, *input.free, input.runs)) {
  if (empty()) return;
  short_ = FitShort(lean_, excerpt_.Windows({}), options_, kShortIterations,
                    nullptr);
  fit_ = FitLong(short_);
}

double AsRead::missed() const {
  constexpr double kBeyondNumbers = 300.0;
  return std::isfinite(fit_.error) ? fit_.error : kBeyondNumbers;
}

QuickFit AsRead::Glance(const LooseModel& model,
                        const std::function<void(Run*)>& change) const {
  constexpr int kIterations = 8;
  constexpr double kWorst = 1e9;
  QuickFit fit =
      FitShort(model, glance_.Windows(change), options_, kIterations, nullptr);
  fit.error = std::min(fit.error, kWorst);
  return fit;
}

double AsRead::AnythingOf(const std::function<void(Run*)>& change) const {
  return FitQuickly(WithEverything(lean_), excerpt_.Windows(change), options_)
      .error;
}

double AsRead::Anything() {
  // More freedoms do not always converge as far.
  if (!anything_) anything_ = std::min(fit_.error, AnythingOf({}));
  return *anything_;
}

double AsRead::AnythingShort() {
  constexpr int kIterations = 40;  // so many freedoms take longer
  if (!anything_short_) {
    anything_short_ = std::min(
        short_.error, FitShort(WithEverything(lean_), excerpt_.Windows({}),
                               options_, kIterations, nullptr)
                          .error);
  }
  return *anything_short_;
}

bool AsRead::CouldBeModel() { return Anything() <= kBeyondModel; }

bool AsRead::IsBeyondModel(double error,
                           const std::function<void(Run*)>& change,
                           double scale) {
  if (!std::isfinite(fit_.error)) return std::isfinite(error);
  const double limit = Anything() * scale / kBeyondModel;
  return error < limit || AnythingOf(change) < limit;
}

std::string TimesText(double error) {
  return std::isfinite(error) ? ShortNumber(error) + " times the noise"
                              : "more than can be computed";
}

}  // namespace sysid
