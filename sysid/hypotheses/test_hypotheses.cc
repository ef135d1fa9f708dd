#include "sysid/hypotheses/test_hypotheses.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "models/effects/catalogue.h"
#include "models/error.h"
#include "sysid/checks/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/hypotheses/constants.h"
#include "sysid/hypotheses/data_hypothesis.h"
#include "sysid/hypotheses/equation_error.h"
#include "sysid/hypotheses/families/families.h"
#include "sysid/hypotheses/secants.h"

namespace sysid {
namespace {

using namespace hypotheses;

std::string TimesText(double error) {
  return std::isfinite(error) ? ShortNumber(error) + " times the noise"
                              : "more than can be computed";
}

// To the decimal place in which its standard error begins; to a multiple of the
// grain that is within its 95 % interval (recorders are late by whole samples).
double Rounded(double value, double std_error, double grain) {
  if (!(std_error > 0.0)) return value;
  const double whole = grain > 0.0 ? grain * std::round(value / grain) : 0.0;
  if (whole != 0.0 &&
      std::abs(value - whole) <= std::max(kInterval * std_error, 0.1 * grain)) {
    return whole;
  }
  const double place = std::pow(10.0, std::floor(std::log10(std_error)));
  const double rounded = place * std::round(value / place);
  return rounded != 0.0 ? rounded : value;
}

// Another explanation than the data: as read, by a model that is no more than
// the user's, or the user's with more physics.
struct Rival {
  std::string name;  // "spring@joint1"; empty: the model as it is
  bool of_bodies = false;
  CoarseFit fit;
};

struct Candidate {
  int place = 0;  // in the list of all: the likelier kinds first
  DataHypothesis hypothesis;
  double start = 0.0;    // where p is sought from
  double promise = 1.0;  // predicted error over that as read
};

struct Refit {
  Candidate candidate;
  double p = 0.0, std_error = 0.0;
  CoarseFit fit;
  bool augmented = false;  // the model is, too: data and model are wrong
};

class Search {
 public:
  Search(const CheckInput& input, double budget, int samples)
      : input_(input),
        budget_(budget),
        fitter_(input.runs, samples, input.options),
        model_(WithFriction(*input.model, *input.free, input.runs)),
        all_(AllHypotheses(input)) {}

  HypothesisReport Run();

 private:
  Excerpt::Change ChangeOf(const DataHypothesis& hypothesis, double p) const {
    if (!hypothesis.change) return {};
    return [&hypothesis, p](int run, sysid::Run* window) {
      Undo(hypothesis, p, run, window);
    };
  }
  CoarseModel ModelOf(const CoarseModel& model,
                      const DataHypothesis& hypothesis) const {
    CoarseModel changed = model;
    if (hypothesis.change_model) hypothesis.change_model(&changed.model);
    return changed;
  }
  int Columns(const CoarseModel& model) const {
    return static_cast<int>(model.free.size()) + model.model.tangent_size();
  }
  bool Affords(double work) const { return fitter_.work() + work <= budget_; }
  void Judge(const CoarseModel& model, const DataHypothesis& hypothesis,
             double p, CoarseFit* fit);
  CoarseFit AsRead(const CoarseModel& model, int iterations);
  bool IsRough() const;
  bool EquationsTell() const;

  // First looks.
  std::vector<Candidate> Look();
  void Consider(int place, const std::vector<int>& runs, double start,
                double promise, std::vector<Candidate>* candidates) const;
  void LookByEquations(std::vector<Candidate>* candidates);
  void LookByCoarseFits(std::vector<Candidate>* candidates);
  void LookBySecants(const Secants& secants,
                     std::vector<Candidate>* candidates);
  std::vector<std::vector<int>> RunSets() const;

  // The best of what competes.
  void FitEffects();
  const Rival& BestRival(bool like_bodies, const std::vector<int>& runs) const;

  std::optional<Refit> RefitOf(const Candidate& candidate,
                               const CoarseModel& unchanged, int iterations);
  bool Wins(const Refit& refit) const;
  std::optional<Refit> Best(const std::vector<Refit>& refits) const;
  void ExtendRuns(Refit* best);
  Finding Report(const Refit& best, const std::vector<Refit>& refits) const;
  Difference Gain(const CoarseFit& a, const CoarseFit& b,
                  const std::vector<int>& runs) const {
    return Compare(a, b, fitter_.held_runs(), runs);
  }

  const CheckInput& input_;
  const double budget_;
  CoarseFitter fitter_;
  const CoarseModel model_;
  const std::vector<DataHypothesis> all_;
  std::vector<Rival> rivals_;  // the first: the model as it is
  bool explained_ = false;     // by the augmented model
  std::vector<std::string> not_asked_;
};

void Search::Judge(const CoarseModel& model, const DataHypothesis& hypothesis,
                   double p, CoarseFit* fit) {
  std::function<double(const Channel&)> log_unit;
  if (hypothesis.log_unit) {
    log_unit = [&](const Channel& channel) {
      return hypothesis.log_unit(channel, p);
    };
  }
  fitter_.Judge(model, ChangeOf(hypothesis, p), log_unit, fit);
}

CoarseFit Search::AsRead(const CoarseModel& model, int iterations) {
  CoarseFit fit = fitter_.Fit(model, {}, iterations);
  fitter_.Judge(model, {}, {}, &fit);
  return fit;
}

// An angle whose "noise" is a good part of a turn is no smooth motion as it was
// read (degrees that wrap at every sample): any model is within such a noise.
bool Search::IsRough() const {
  constexpr double kRough = 0.2;  // rad; encoders have a hundredth of it
  const RunData& data = *rivals_.front().fit.train->runs().front();
  const Mechanism& mechanism = input_.model->mechanism();
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

// Of mechanisms whose joints are all simple, measured in every run, and driven:
// the equation of a joint without effort holds with no mass at all.
bool Search::EquationsTell() const {
  const Mechanism& mechanism = input_.model->mechanism();
  const std::vector<int> driven = DrivenJoints(input_);
  for (int j = 0; j < static_cast<int>(mechanism.joints.size()); ++j) {
    if (mechanism.joints[j].type == JointType::kFixed) continue;
    if (!IsSimple(mechanism.joints[j]) ||
        std::find(driven.begin(), driven.end(), j) == driven.end()) {
      return false;
    }
    for (const sysid::Run* run : input_.runs) {
      if (FindChannel(*run, ChannelKind::kPosition, j) == nullptr) return false;
    }
  }
  return true;
}

// All runs (empty), and each of several alone; of many those that the model
// misses most.
std::vector<std::vector<int>> Search::RunSets() const {
  constexpr size_t kMost = 4;
  std::vector<std::vector<int>> sets = {{}};
  const int count = static_cast<int>(input_.runs.size());
  if (count < 2) return sets;
  const CoarseFit& fit = rivals_.front().fit;
  std::vector<std::pair<double, int>> errors;
  for (int r = 0; r < count; ++r) {
    double sum = 0.0;
    int windows = 0;
    for (size_t w = 0; w < fitter_.held_runs().size(); ++w) {
      if (fitter_.held_runs()[w] != r) continue;
      for (const double e : fit.log_errors.row(w)) sum += std::isnan(e) ? 0 : e;
      ++windows;
    }
    if (windows >= kFewestWindows) errors.push_back({-sum / windows, r});
  }
  std::stable_sort(errors.begin(), errors.end());
  if (errors.size() > kMost) errors.resize(kMost);
  for (const auto& [error, r] : errors) sets.push_back({r});
  return sets;
}

void Search::Consider(int place, const std::vector<int>& runs, double start,
                      double promise,
                      std::vector<Candidate>* candidates) const {
  if (!(promise < kPromise)) return;
  for (Candidate& known : *candidates) {
    if (known.place != place || known.hypothesis.runs != runs) continue;
    if (promise < known.promise) {
      known.promise = promise;
      known.start = start;
    }
    return;
  }
  candidates->push_back({place, OfRuns(all_[place], runs), start, promise});
}

void Search::LookByEquations(std::vector<Candidate>* candidates) {
  // Springs and armatures free: nothing that is missing there looks like data.
  const CoarseModel given_bodies = Augmented(model_, false);
  const Excerpt& excerpt = fitter_.excerpt();
  const EquationRows as_read(given_bodies, excerpt, {});
  fitter_.AddWork(as_read.work());
  // Of windows as they are read, but for those of these runs.
  const auto least = [&](const EquationRows* changed,
                         const std::vector<int>& runs) {
    std::vector<const std::vector<EquationPart>*> windows;
    for (int w = 0; w < excerpt.count(); ++w) {
      const bool is_changed =
          changed != nullptr &&
          (runs.empty() ||
           std::find(runs.begin(), runs.end(), excerpt.run(w)) != runs.end());
      windows.push_back(is_changed ? &changed->window(w) : &as_read.window(w));
    }
    return LeastEquationError(windows);
  };
  const double given = least(nullptr, {});
  const int nv = model_.model.nv();
  for (int i = 0; i < static_cast<int>(all_.size()); ++i) {
    const DataHypothesis& hypothesis = all_[i];
    // What takes an effort away leaves nothing to be missed.
    if (hypothesis.fault == DataFault::kEffortIdle) continue;
    std::vector<double> starts = {0.0};
    if (hypothesis.is_continuous()) starts = hypothesis.starts;
    for (const double p : starts) {
      if (!Affords(as_read.work())) return;
      const CoarseModel model = ModelOf(given_bodies, hypothesis);
      const EquationRows changed(model, excerpt, ChangeOf(hypothesis, p));
      fitter_.AddWork(changed.work());
      double log_unit = 0.0;
      for (int v = 0; v < nv && hypothesis.log_effort; ++v) {
        log_unit += hypothesis.log_effort(v, p) / nv;
      }
      for (const std::vector<int>& runs : RunSets()) {
        if (!runs.empty() && hypothesis.change_model) continue;
        const double part =
            runs.empty() ? 1.0 : 1.0 / static_cast<double>(input_.runs.size());
        const double error = least(&changed, runs) * std::exp(-part * log_unit);
        double promise = error / given;
        // The least squares take bodies of negative mass: all efforts the
        // other way round, or all motions, leave the same error. A fit tells.
        if (!hypothesis.is_continuous() && promise >= kPromise &&
            promise <= 1.0 / kPromise) {
          promise = kUntold;
        }
        Consider(i, runs, p, promise, candidates);
      }
    }
  }
}

void Search::LookByCoarseFits(std::vector<Candidate>* candidates) {
  CoarseFitter look(input_.runs, kLookSamples, input_.options);
  if (look.excerpt().count() < 2) return;
  CoarseFit base = look.Fit(model_, {}, kLookIterations);
  look.Judge(model_, {}, {}, &base);
  fitter_.AddWork(look.work());
  const double each = look.work();
  for (int i = 0; i < static_cast<int>(all_.size()); ++i) {
    const DataHypothesis& hypothesis = all_[i];
    if (hypothesis.is_continuous()) continue;
    for (const std::vector<int>& runs : RunSets()) {
      if (!runs.empty() && hypothesis.change_model) continue;
      if (!Affords(each)) {
        not_asked_.push_back(ToString(hypothesis.fault));
        break;
      }
      const DataHypothesis of_runs = OfRuns(hypothesis, runs);
      const CoarseModel model = ModelOf(model_, of_runs);
      const double before = look.work();
      CoarseFit fit = look.Fit(model, ChangeOf(of_runs, 0.0), kLookIterations);
      std::function<double(const Channel&)> log_unit;
      if (of_runs.log_unit) {
        log_unit = [&](const Channel& c) { return of_runs.log_unit(c, 0.0); };
      }
      look.Judge(model, ChangeOf(of_runs, 0.0), log_unit, &fit);
      fitter_.AddWork(look.work() - before);
      const Difference gain = Compare(base, fit, look.held_runs(), runs);
      // What is wrong with a body shows less in a few iterations.
      const double slack = hypothesis.like_bodies ? 0.8 : 1.0;
      Consider(i, runs, 0.0, slack * std::exp(-gain.mean), candidates);
    }
  }
}

void Search::LookBySecants(const Secants& secants,
                           std::vector<Candidate>* candidates) {
  const std::vector<std::vector<int>> sets = RunSets();
  for (int i = 0; i < static_cast<int>(all_.size()); ++i) {
    const DataHypothesis& hypothesis = all_[i];
    if (!hypothesis.is_continuous()) continue;
    std::vector<double> values = hypothesis.starts;
    values.insert(values.begin(), hypothesis.probe);
    for (const double p : values) {
      if (!Affords(secants.work())) return;
      const Secants::Columns change = secants.Change(ChangeOf(hypothesis, p));
      fitter_.AddWork(secants.work());
      if (change.empty()) continue;
      for (const std::vector<int>& runs : sets) {
        const Secants::Columns of_runs =
            runs.empty() ? change : secants.OfRun(change, runs.front());
        if (p != hypothesis.probe) {
          Consider(i, runs, p, secants.Ratio(of_runs), candidates);
          continue;
        }
        const Secant secant = secants.Test(of_runs, p);
        const double size = std::abs(secant.value);
        if (size < hypothesis.least ||
            size < kSignificance * secant.std_error) {
          continue;
        }
        Consider(i, runs,
                 std::clamp(secant.value, -hypothesis.most, hypothesis.most),
                 secant.ratio, candidates);
      }
    }
  }
}

std::vector<Candidate> Search::Look() {
  std::vector<Candidate> candidates;
  const CoarseFit& base = rivals_.front().fit;
  if (EquationsTell()) {
    LookByEquations(&candidates);
  } else {
    LookByCoarseFits(&candidates);
  }
  // Secants at the fit that misses least: what it lacks bends them least.
  const CoarseFit* least = &base;
  for (const Rival& rival : rivals_) {
    if (rival.fit.train_error < least->train_error) least = &rival.fit;
  }
  if (std::isfinite(least->train_error)) {
    const Secants secants(fitter_, *least);
    if (secants.Valid()) LookBySecants(secants, &candidates);
  }
  if (std::isfinite(base.train_error)) FitEffects();
  // Of an effort without influence only a fit tells.
  for (int i = 0; i < static_cast<int>(all_.size()); ++i) {
    if (all_[i].fault == DataFault::kEffortIdle) {
      Consider(i, {}, 0.0, kUntold, &candidates);
    }
  }
  if (explained_) {
    std::erase_if(candidates, [](const Candidate& candidate) {
      return !candidate.hypothesis.like_bodies;
    });
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.promise < b.promise;
                   });
  return candidates;
}

void Search::FitEffects() {
  // A copy: further rivals move the first.
  const CoarseFit base = rivals_.front().fit;
  const Secants secants(fitter_, base);
  if (!secants.Valid()) return;
  const Catalogue catalogue;
  Model fitted = base.train->model();
  MechanismParameters<double> values;
  base.train->map().Apply<double>(base.point.theta.data(), &values);
  fitted.SetNominal(values);
  std::vector<std::shared_ptr<const Effect>> effects;
  for (const std::string& name : catalogue.Candidates(fitted.mechanism())) {
    effects.push_back(catalogue.Make(name, fitted.mechanism(), "check"));
  }
  const double screening =
      secants.work() * (1.0 + kColumnWork * 2.0 * effects.size());
  if (!Affords(screening)) return;
  fitter_.AddWork(screening);
  const Screening screened =
      ScreenEffects(secants.linearized(), fitted, effects);
  const CoarseModel model = StartingAt(model_, base.values);
  for (int i = 0; i < kEffects && i < static_cast<int>(screened.effects.size());
       ++i) {
    const CoarseModel with = WithEffect(model, screened.effects[i]);
    if (!Affords(fitter_.WorkOf(Columns(with), kIterations))) return;
    const std::string name = screened.effects[i].name();
    const std::string kind = name.substr(0, name.find('@'));
    const bool of_bodies = kind == "mass" || kind == "com" ||
                           kind == "inertia" || kind == "effort_gain";
    rivals_.push_back({name, of_bodies, AsRead(with, kIterations)});
  }
}

// In the windows of these runs.
const Rival& Search::BestRival(bool like_bodies,
                               const std::vector<int>& runs) const {
  const Rival* best = &rivals_.front();
  for (const Rival& rival : rivals_) {
    if (like_bodies && rival.of_bodies) continue;
    if (Gain(best->fit, rival.fit, runs).mean > 0.0) best = &rival;
  }
  return *best;
}

std::optional<Refit> Search::RefitOf(const Candidate& candidate,
                                     const CoarseModel& unchanged,
                                     int iterations) {
  const DataHypothesis& hypothesis = candidate.hypothesis;
  Refit refit;
  refit.candidate = candidate;
  const CoarseModel model = ModelOf(unchanged, hypothesis);
  if (!hypothesis.is_continuous()) {
    refit.fit = fitter_.Fit(model, ChangeOf(hypothesis, 0.0), iterations);
    Judge(model, hypothesis, 0.0, &refit.fit);
    return refit;
  }
  // Gauss-Newton in p, the rest fitted anew each time: (10.1) with the change
  // from where p is.
  const DataSet* noise_of = &rivals_.front().fit.train->data();
  double p = candidate.start;
  CoarseFit fit = fitter_.Fit(model, ChangeOf(hypothesis, p), iterations,
                              nullptr, noise_of);
  refit.fit = fit;
  refit.p = p;
  for (int step = 0; step < kSteps && std::isfinite(fit.train_error); ++step) {
    const Secants secants(fitter_, fit);
    if (!secants.Valid()) break;
    fitter_.AddWork(fitter_.WorkOf(Columns(model), 1) + secants.work());
    const Secants::Columns change =
        secants.Change(ChangeOf(hypothesis, p + hypothesis.probe));
    if (change.empty()) break;
    const Secant secant = secants.Test(change, hypothesis.probe);
    refit.std_error = secant.std_error;
    const double enough =
        std::max(0.3 * secant.std_error, 0.01 * hypothesis.least);
    if (!(std::abs(secant.value) > enough)) break;
    p = std::clamp(p + secant.value, -hypothesis.most, hypothesis.most);
    CoarseFit next = fitter_.Fit(model, ChangeOf(hypothesis, p), kIterations,
                                 &fit, noise_of);
    if (!(next.train_error < fit.train_error)) break;
    fit = next;
    refit.fit = fit;
    refit.p = p;
  }
  const double size = std::abs(refit.p);
  if (size < hypothesis.least || size >= hypothesis.most ||
      size < kSignificance * refit.std_error) {
    return std::nullopt;
  }
  Judge(model, hypothesis, refit.p, &refit.fit);
  return refit;
}

bool Search::Wins(const Refit& refit) const {
  const DataHypothesis& hypothesis = refit.candidate.hypothesis;
  const Rival& rival = BestRival(hypothesis.like_bodies, hypothesis.runs);
  return refit.fit.unexplained < kUnexplained &&
         Gain(rival.fit, refit.fit, hypothesis.runs)
             .IsBetter(kSignificance, kWorth);
}

// The one with the least error over all windows; of those that are tied with it
// the likelier kind.
std::optional<Refit> Search::Best(const std::vector<Refit>& refits) const {
  const Refit* best = nullptr;
  for (const Refit& refit : refits) {
    if (best == nullptr || Gain(best->fit, refit.fit, {}).mean > 0.0) {
      best = &refit;
    }
  }
  if (best == nullptr) return std::nullopt;
  const Refit* likeliest = best;
  for (const Refit& refit : refits) {
    if (Gain(refit.fit, best->fit, {}).IsTie() &&
        refit.candidate.place < likeliest->candidate.place) {
      likeliest = &refit;
    }
  }
  return *likeliest;
}

// A fault that one run has another may have too.
void Search::ExtendRuns(Refit* best) {
  if (best->candidate.hypothesis.runs.empty()) return;
  const int count = static_cast<int>(input_.runs.size());
  for (int r = 0; r < count; ++r) {
    std::vector<int> runs = best->candidate.hypothesis.runs;
    if (std::find(runs.begin(), runs.end(), r) != runs.end()) continue;
    runs.push_back(r);
    std::sort(runs.begin(), runs.end());
    Candidate candidate = best->candidate;
    if (static_cast<int>(runs.size()) == count) runs.clear();
    candidate.hypothesis = OfRuns(candidate.hypothesis, runs);
    candidate.start = best->p;
    if (!Affords(fitter_.WorkOf(Columns(model_), kIterations))) return;
    const std::optional<Refit> wider =
        best->augmented
            ? RefitOf(candidate, Augmented(model_, false), kAugmentedIterations)
            : RefitOf(candidate, model_, kIterations);
    if (wider &&
        Gain(best->fit, wider->fit, {r}).IsBetter(kSignificance, kWorth)) {
      *best = *wider;
    }
  }
}

Finding Search::Report(const Refit& best,
                       const std::vector<Refit>& refits) const {
  const DataHypothesis& hypothesis = best.candidate.hypothesis;
  const Rival& rival = BestRival(hypothesis.like_bodies, hypothesis.runs);
  const CoarseFit& base = rivals_.front().fit;
  const double value = Rounded(best.p, best.std_error, hypothesis.grain);
  Finding finding;
  finding.fault = ToString(hypothesis.fault);
  finding.severity = Severity::kWrong;
  finding.weight = std::exp(Gain(base, best.fit, hypothesis.runs).mean);
  finding.error_left = best.fit.error;
  if (hypothesis.change_model) {
    finding.file = input_.model_file;
  } else if (input_.runs.size() == 1) {
    finding.file = input_.runs.front()->name;
  } else {
    std::vector<std::string> files;
    for (const int r : hypothesis.runs) files.push_back(input_.runs[r]->name);
    finding.file = Join(files);
  }
  finding.subject = hypothesis.subject();
  finding.evidence =
      "of windows that were not fitted the model misses the data by " +
      TimesText(base.error) + " as it was read, " +
      hypothesis.says(value, kInterval * best.std_error) + " by " +
      TimesText(best.fit.error);
  if (best.augmented) {
    finding.evidence += " (with springs, offsets and armatures beside)";
  } else if (!rival.name.empty()) {
    finding.evidence +=
        ", with " + rival.name + " instead by " + TimesText(rival.fit.error);
  }
  finding.consequence = hypothesis.consequence;
  finding.remedies = FixTexts(input_, hypothesis, value);
  for (const Refit& other : refits) {
    const DataHypothesis& its = other.candidate.hypothesis;
    if (other.augmented != best.augmented ||
        (other.candidate.place == best.candidate.place &&
         its.runs == hypothesis.runs) ||
        !Gain(other.fit, best.fit, {}).IsTie()) {
      continue;
    }
    const double its_value = Rounded(other.p, other.std_error, its.grain);
    NameAlso(its.says(its_value, kInterval * other.std_error),
             FixTexts(input_, its, its_value), &finding);
  }
  return finding;
}

HypothesisReport Search::Run() {
  HypothesisReport report;
  if (fitter_.held_runs().empty()) return report;
  const auto done = [&] {
    report.not_asked = not_asked_;
    report.work = fitter_.work();
    return report;
  };
  rivals_.push_back({"", false, AsRead(model_, kIterations)});
  const CoarseFit base = rivals_.front().fit;
  const bool rough = IsRough();
  if (!rough) report.error = base.error;
  if (!rough && base.error <= kExplained) return done();
  const CoarseModel start = std::isfinite(base.train_error)
                                ? StartingAt(model_, base.values)
                                : model_;
  for (const bool bodies : {true, false}) {
    const CoarseModel augmented = Augmented(start, bodies);
    if (!Affords(fitter_.WorkOf(Columns(augmented), kAugmentedIterations))) {
      continue;
    }
    rivals_.push_back({bodies ? "bodies, springs, offsets and armatures free"
                              : "springs, offsets and armatures free",
                       bodies, AsRead(augmented, kAugmentedIterations)});
    explained_ = explained_ || (!rough && rivals_.back().fit.error <= kWorth);
  }
  std::vector<Candidate> candidates = Look();
  std::vector<Refit> winners;
  int refits = 0;
  for (const Candidate& candidate : candidates) {
    const double each = (candidate.hypothesis.is_continuous() ? 2.0 : 1.0) *
                        fitter_.WorkOf(Columns(model_), kIterations);
    if (refits >= kRefits) break;
    if (!Affords(each)) {
      not_asked_.push_back(ToString(candidate.hypothesis.fault));
      continue;
    }
    ++refits;
    const std::optional<Refit> refit = RefitOf(candidate, model_, kIterations);
    if (!refit) continue;
    if (Wins(*refit)) winners.push_back(*refit);
  }
  // Where model and data are both wrong: the augmented model with what promises
  // most.
  for (size_t i = 0; i < candidates.size() && winners.empty(); ++i) {
    if (static_cast<int>(i) == kAugmentedRefits) break;
    const CoarseModel augmented = Augmented(model_, false);
    if (!Affords(2.0 *
                 fitter_.WorkOf(Columns(augmented), kAugmentedIterations))) {
      break;
    }
    std::optional<Refit> refit =
        RefitOf(candidates[i], augmented, kAugmentedIterations);
    if (!refit) continue;
    refit->augmented = true;
    if (Wins(*refit)) winners.push_back(*refit);
  }
  std::optional<Refit> best = Best(winners);
  if (best) {
    ExtendRuns(&*best);
    report.findings.push_back(Report(*best, winners));
  }
  return done();
}

}  // namespace

HypothesisReport TestHypotheses(const CheckInput& input, double budget) {
  if (input.runs.empty()) return {};
  // With a budget an excerpt that leaves work for all its parts: the models
  // that compete take about three fits, a hypothesis one.
  constexpr double kParts = 12.0;
  constexpr int kLeast = 300;  // samples: of fewer windows nothing is told
  int samples = kSamples;
  if (std::isfinite(budget)) {
    const double columns = static_cast<double>(input.free->size()) +
                           3.0 * input.model->nv() +
                           input.model->tangent_size();
    const double affords =
        budget / (kParts * kIterations * (1.0 + kColumnWork * columns));
    samples = static_cast<int>(std::min<double>(kSamples, affords));
    if (samples < kLeast) {
      HypothesisReport report;
      for (const DataHypothesis& hypothesis : AllHypotheses(input)) {
        report.not_asked.push_back(ToString(hypothesis.fault));
      }
      return report;
    }
  }
  return Search(input, budget, samples).Run();
}

}  // namespace sysid
