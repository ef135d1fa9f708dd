#include "sysid/hypotheses/explanation.h"

#include <algorithm>
#include <cmath>

#include "models/effects/catalogue.h"
#include "sysid/hypotheses/constants.h"
#include "sysid/hypotheses/secants.h"

namespace sysid {
namespace {

using namespace hypotheses;

// An angle whose "noise" is a good part of a turn is no smooth motion as it was
// read (degrees that wrap at every sample): any model is within such a noise.
bool IsRough(const RunData& data, const Mechanism& mechanism) {
  for (size_t c = 0; c < data.sigma.size(); ++c) {
    const Channel& channel = data.run.channels[c];
    if (channel.kind == ChannelKind::kPosition &&
        IsRotation1(mechanism.joints[channel.target].type) &&
        data.sigma[c] > kRough) {
      return true;
    }
  }
  return false;
}

// A gain below zero is another sign of an effort, which is a hypothesis.
void KeepSigns(CoarseModel* model) {
  for (FreeParameter& free : model->free) {
    if (!free.parameter.name.ends_with(".effort_gain")) continue;
    free.lower = std::max(free.lower, 0.0);
    free.initial = std::max(free.initial, free.lower);
  }
}

// Whether masses, inertias or lengths move with an effect of this kind.
bool IsOfBodies(const std::string& name) {
  const std::string kind = name.substr(0, name.find('@'));
  return kind == "mass" || kind == "com" || kind == "inertia" ||
         kind == "effort_gain";
}

}  // namespace

Competition::Competition(const CheckInput& input, double budget, int samples)
    : input_(input),
      budget_(budget),
      fitter_(input, samples, std::isinf(budget)),
      model_(WithFriction(*input.model, *input.free, input.runs)),
      all_(AllHypotheses(input)) {}

double Competition::FitWork(const CoarseModel& model, int iterations) const {
  return fitter_.WorkOf(
      static_cast<int>(model.free.size()) + model.model.tangent_size(),
      iterations);
}

bool Competition::Spend(double work) {
  if (!Affords(work)) return false;
  fitter_.AddWork(work);
  return true;
}

void AddKind(const DataHypothesis& hypothesis,
             std::vector<std::string>* kinds) {
  const std::string kind = ToString(hypothesis.fault);
  if (std::find(kinds->begin(), kinds->end(), kind) == kinds->end()) {
    kinds->push_back(kind);
  }
}

void Competition::LeaveOut(const DataHypothesis& hypothesis) {
  AddKind(hypothesis, &not_asked_);
}

Explanation Competition::AsRead(const std::string& name, bool of_bodies,
                                const CoarseModel& model, int iterations) {
  Explanation explanation;
  explanation.name = name;
  explanation.of_bodies = of_bodies;
  explanation.fit = fitter_.Fit(model, {}, iterations);
  fitter_.Judge(&explanation.fit);
  return explanation;
}

void Competition::FitAsGiven() {
  rivals_.push_back(AsRead("", false, model_, kIterations));
  rough_ =
      IsRough(*as_given().fit.train->runs().front(), input_.model->mechanism());
}

void Competition::FitAugmented() {
  const CoarseFit& base = as_given().fit;
  const CoarseModel start = std::isfinite(base.train_error)
                                ? StartingAt(model_, base.values)
                                : model_;
  for (const bool bodies : {true, false}) {
    const CoarseModel augmented = Augmented(start, bodies);
    if (!Affords(FitWork(augmented, kAugmentedIterations))) continue;
    rivals_.push_back(AsRead(bodies
                                 ? "bodies, springs, offsets and armatures free"
                                 : "springs, offsets and armatures free",
                             bodies, augmented, kAugmentedIterations));
    explained_ = explained_ || (!rough_ && rivals_.back().fit.error <= kWorth);
  }
}

void Competition::FitEffects() {
  const CoarseFit base = as_given().fit;  // a copy: further rivals move it
  if (!std::isfinite(base.train_error)) return;
  const Secants secants(fitter_, base);
  if (!secants.Valid()) return;
  const Catalogue catalogue;
  Model fitted = base.train->model();
  MechanismParameters<double> values;
  base.train->map().Apply<double>(base.point.theta.data(), &values);
  fitted.SetNominal(values);
  std::vector<std::shared_ptr<const Effect>> effects;
  for (const std::string& name : catalogue.Candidates(fitted.mechanism())) {
    const auto effect = catalogue.Make(name, fitted.mechanism(), "check");
    // Rollouts of its own, and the small steps that the smoothed friction of
    // pairs takes, cost more than a check has.
    constexpr unsigned kCostly = kPairHook | kInputLagHook;
    if (!(effect->hooks() & kCostly)) effects.push_back(effect);
  }
  if (!Spend(secants.work() * (1.0 + kColumnWork * 2.0 * effects.size()))) {
    return;
  }
  const Screening screened =
      ScreenEffects(secants.linearized(), fitted, effects);
  const CoarseModel model = StartingAt(model_, base.values);
  const int count =
      std::min(kEffects, static_cast<int>(screened.effects.size()));
  for (int i = 0; i < count; ++i) {
    CoarseModel with = WithEffect(model, screened.effects[i]);
    KeepSigns(&with);
    if (!Affords(FitWork(with, kIterations))) return;
    const std::string name = screened.effects[i].name();
    rivals_.push_back(AsRead(name, IsOfBodies(name), with, kIterations));
  }
}

const Explanation& Competition::least() const {
  return *std::min_element(rivals_.begin(), rivals_.end(),
                           [](const Explanation& a, const Explanation& b) {
                             return a.fit.train_error < b.fit.train_error;
                           });
}

std::optional<Explanation> Competition::Fit(const Suspect& suspect,
                                            bool augmented) {
  const DataHypothesis& hypothesis = *suspect.supposed.hypothesis;
  const CoarseModel model = augmented ? Augmented(model_, false) : model_;
  const int iterations = augmented ? kAugmentedIterations : kIterations;
  Explanation found;
  found.place = suspect.place;
  found.augmented = augmented;
  if (!hypothesis.is_continuous()) {
    found.fit = fitter_.Fit(model, suspect.supposed, iterations);
    fitter_.Judge(&found.fit);
    return found;
  }
  // Gauss-Newton in p, the rest fitted anew each time: (10.1) with the change
  // from where p is.
  const DataSet* noise_of = &as_given().fit.train->data();
  found.fit =
      fitter_.Fit(model, suspect.supposed, iterations, nullptr, noise_of);
  for (int step = 0; step < kSteps && std::isfinite(found.fit.train_error);
       ++step) {
    const Secants secants(fitter_, found.fit);
    if (!secants.Valid()) break;
    fitter_.AddWork(FitWork(model, 1) + secants.work());
    Supposition next = found.fit.supposed;
    next.p += hypothesis.probe;
    const Secants::Columns change = secants.Change(next);
    if (change.empty()) break;
    const Secant secant = secants.Test(change, hypothesis.probe);
    found.std_error = secant.std_error;
    const double enough =
        std::max(0.3 * secant.std_error, 0.01 * hypothesis.least);
    if (!(std::abs(secant.value) > enough)) break;
    next.p = std::clamp(found.fit.supposed.p + secant.value, -hypothesis.most,
                        hypothesis.most);
    CoarseFit fit = fitter_.Fit(model, next, kIterations, &found.fit, noise_of);
    if (!(fit.train_error < found.fit.train_error)) break;
    found.fit = std::move(fit);
  }
  const double size = std::abs(found.fit.supposed.p);
  if (size < hypothesis.least || size >= hypothesis.most ||
      size < kSignificance * found.std_error) {
    return std::nullopt;
  }
  fitter_.Judge(&found.fit);
  return found;
}

Difference Competition::Gain(const Explanation& a, const Explanation& b,
                             const std::vector<int>& runs) const {
  return Compare(a.fit, b.fit, fitter_.held_runs(), runs);
}

const Explanation& Competition::BestRival(
    const DataHypothesis& hypothesis) const {
  const Explanation* best = &rivals_.front();
  for (const Explanation& rival : rivals_) {
    if (hypothesis.like_bodies && rival.of_bodies) continue;
    if (Gain(*best, rival, hypothesis.runs).mean > 0.0) best = &rival;
  }
  return *best;
}

DataVerdict Competition::Judge(const Explanation& explanation) const {
  if (!(explanation.fit.unexplained < kUnexplained)) {
    return DataVerdict::kRejected;
  }
  const DataHypothesis& hypothesis = explanation.hypothesis();
  const Difference gain =
      Gain(BestRival(hypothesis), explanation, hypothesis.runs);
  return gain.IsBetter(kSignificance, kWorth) ? DataVerdict::kAccepted
         : gain.IsBetter(kTie, kWorth)        ? DataVerdict::kUndecided
                                              : DataVerdict::kRejected;
}

}  // namespace sysid
