#include "sysid/hypotheses/first_looks.h"

#include <algorithm>
#include <cmath>

#include "sysid/hypotheses/constants.h"
#include "sysid/hypotheses/equation_error.h"
#include "sysid/hypotheses/families/families.h"
#include "sysid/hypotheses/secants.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

using namespace hypotheses;

// Of mechanisms whose joints are all simple, measured in every run, and driven:
// the equation of a joint without effort holds with no mass at all.
bool EquationsTell(const CheckInput& input) {
  const Mechanism& mechanism = input.model->mechanism();
  const std::vector<int> driven = DrivenJoints(input);
  for (int j = 0; j < static_cast<int>(mechanism.joints.size()); ++j) {
    if (VelocitySize(mechanism.joints[j]) == 0) continue;
    if (std::find(driven.begin(), driven.end(), j) == driven.end()) {
      return false;
    }
    for (const Run* run : input.runs) {
      if (FindChannel(*run, ChannelKind::kPosition, j) == nullptr) return false;
    }
  }
  return true;
}

class FirstLook {
 public:
  explicit FirstLook(Competition* competition)
      : all_(*competition), hypotheses_(competition->all()) {}

  std::vector<Suspect> Run();

 private:
  std::vector<std::vector<int>> RunSets() const;
  void Consider(int place, const std::vector<int>& runs, double p,
                double promise);
  // Whether they tell: of a short recording there are too few rows.
  bool ByEquations();
  void ByCoarseFits();
  void BySecants(const Secants& secants);

  Competition& all_;
  const std::vector<DataHypothesis>& hypotheses_;
  std::vector<Suspect> suspects_;
};

// All runs (empty), and each of several alone; of many those that the model
// misses most.
std::vector<std::vector<int>> FirstLook::RunSets() const {
  std::vector<std::vector<int>> sets = {{}};
  const int count = static_cast<int>(all_.input().runs.size());
  if (count < 2) return sets;
  const CoarseFit& fit = all_.as_given().fit;
  const std::vector<int>& held_runs = all_.fitter().held_runs();
  std::vector<std::pair<double, int>> errors;
  for (int r = 0; r < count; ++r) {
    double sum = 0.0;
    int windows = 0;
    for (size_t w = 0; w < held_runs.size(); ++w) {
      if (held_runs[w] != r) continue;
      for (const double e : fit.log_errors.row(w)) sum += std::isnan(e) ? 0 : e;
      ++windows;
    }
    if (windows >= kFewestWindows) errors.push_back({-sum / windows, r});
  }
  std::stable_sort(errors.begin(), errors.end());
  if (errors.size() > kMostRuns) errors.resize(kMostRuns);
  for (const auto& [error, r] : errors) sets.push_back({r});
  return sets;
}

void FirstLook::Consider(int place, const std::vector<int>& runs, double p,
                         double promise) {
  if (!(promise < kPromise)) return;
  for (Suspect& known : suspects_) {
    if (known.place != place || known.supposed.hypothesis->runs != runs) {
      continue;
    }
    if (promise < known.promise) {
      known.promise = promise;
      known.supposed.p = p;
    }
    return;
  }
  suspects_.push_back({place, Suppose(hypotheses_[place], runs, p), promise});
}

bool FirstLook::ByEquations() {
  // Springs and armatures free: nothing that is missing there looks like data.
  const CoarseModel given_bodies = Augmented(all_.model(), false);
  CoarseFitter& fitter = all_.fitter();
  const Excerpt& excerpt = fitter.excerpt();
  const EquationWindows as_read(given_bodies, excerpt, {});
  fitter.AddWork(as_read.work());
  // Of windows as they are read, but for those of these runs.
  const auto least = [&](const EquationWindows* changed,
                         const std::vector<int>& runs) {
    std::vector<const std::vector<EquationPart>*> windows;
    for (int w = 0; w < excerpt.count(); ++w) {
      const bool is_changed =
          changed != nullptr && IsOfRun(runs, excerpt.run(w));
      windows.push_back(is_changed ? &changed->window(w) : &as_read.window(w));
    }
    return LeastEquationError(windows);
  };
  const double given = least(nullptr, {});
  if (!std::isfinite(given)) return false;
  const std::vector<int> driven = DrivenJoints(all_.input());
  for (int i = 0; i < static_cast<int>(hypotheses_.size()); ++i) {
    const DataHypothesis& hypothesis = hypotheses_[i];
    // What takes an effort away leaves nothing to be missed.
    if (hypothesis.fault == DataFault::kEffortIdle) continue;
    std::vector<double> starts = {0.0};
    if (hypothesis.is_continuous()) starts = hypothesis.starts;
    for (const double p : starts) {
      if (!all_.Affords(as_read.work())) {
        // Secants look at the continuous ones, too.
        if (!hypothesis.is_continuous()) all_.LeaveOut(hypothesis);
        break;
      }
      const Supposition supposed = Suppose(hypothesis, {}, p);
      const EquationWindows changed(Without(given_bodies, supposed), excerpt,
                                    fitter.ChangeOf(supposed));
      fitter.AddWork(changed.work());
      double log_unit = 0.0;
      for (const int j : driven) {
        const std::string& name =
            all_.input().model->mechanism().joints[j].name;
        log_unit += LogUnit(supposed, name + ".tau") / driven.size();
      }
      for (const std::vector<int>& runs : RunSets()) {
        if (!runs.empty() && hypothesis.change_model) continue;
        const double part =
            runs.empty() ? 1.0
                         : 1.0 / static_cast<double>(all_.input().runs.size());
        const double error = least(&changed, runs) * std::exp(-part * log_unit);
        double promise = error / given;
        // The least squares take bodies of negative mass: all efforts the
        // other way round, or all motions, leave the same error. A fit tells.
        if (!hypothesis.is_continuous() && promise >= kPromise &&
            promise <= 1.0 / kPromise) {
          promise = kUntold;
        }
        Consider(i, runs, p, promise);
      }
    }
  }
  return true;
}

void FirstLook::ByCoarseFits() {
  CoarseFitter look(all_.input(), kLookSamples, /*patient=*/false);
  if (look.excerpt().count() < 2) return;
  const auto fit = [&](const Supposition& supposed) {
    const double before = look.work();
    CoarseFit found = look.Fit(all_.model(), supposed, kLookIterations);
    look.Judge(&found);
    all_.fitter().AddWork(look.work() - before);
    return found;
  };
  const CoarseFit base = fit({});
  const double each = look.work();
  for (int i = 0; i < static_cast<int>(hypotheses_.size()); ++i) {
    const DataHypothesis& hypothesis = hypotheses_[i];
    if (hypothesis.is_continuous()) continue;
    for (const std::vector<int>& runs : RunSets()) {
      if (!runs.empty() && hypothesis.change_model) continue;
      if (!all_.Affords(each)) {
        all_.LeaveOut(hypothesis);
        break;
      }
      const Difference gain = Compare(base, fit(Suppose(hypothesis, runs, 0.0)),
                                      look.held_runs(), runs);
      // What is wrong with a body shows less in a few iterations.
      const double slack = hypothesis.like_bodies ? 0.8 : 1.0;
      Consider(i, runs, 0.0, slack * std::exp(-gain.mean));
    }
  }
}

void FirstLook::BySecants(const Secants& secants) {
  const std::vector<std::vector<int>> sets = RunSets();
  for (int i = 0; i < static_cast<int>(hypotheses_.size()); ++i) {
    const DataHypothesis& hypothesis = hypotheses_[i];
    if (!hypothesis.is_continuous()) continue;
    std::vector<double> values = hypothesis.starts;
    values.insert(values.begin(), hypothesis.probe);
    for (const double p : values) {
      if (!all_.Spend(secants.work())) {
        all_.LeaveOut(hypothesis);
        break;
      }
      const Secants::Columns change =
          secants.Change(Suppose(hypothesis, {}, p));
      if (change.empty()) continue;
      for (const std::vector<int>& runs : sets) {
        const Secants::Columns of_runs =
            runs.empty() ? change : secants.OfRun(change, runs.front());
        if (p != hypothesis.probe) {
          Consider(i, runs, p, secants.Ratio(of_runs));
          continue;
        }
        const Secant secant = secants.Test(of_runs, p);
        const double size = std::abs(secant.value);
        // One that leads beyond what is sought foretells nothing within it.
        if (size < hypothesis.least || size > hypothesis.most ||
            size < kSignificance * secant.std_error) {
          continue;
        }
        Consider(i, runs, secant.value, secant.ratio);
      }
    }
  }
}

std::vector<Suspect> FirstLook::Run() {
  if (!EquationsTell(all_.input()) || !ByEquations()) ByCoarseFits();
  // Secants at the fit that misses least: what it lacks bends them least.
  const CoarseFit& least = all_.least().fit;
  if (std::isfinite(least.train_error)) {
    const Secants secants(all_.fitter(), least);
    if (secants.Valid()) BySecants(secants);
  }
  // Of an effort without influence only a fit tells.
  for (int i = 0; i < static_cast<int>(hypotheses_.size()); ++i) {
    if (hypotheses_[i].fault == DataFault::kEffortIdle) {
      Consider(i, {}, 0.0, kUntold);
    }
  }
  if (all_.explained()) {
    std::erase_if(suspects_, [](const Suspect& suspect) {
      return !suspect.supposed.hypothesis->like_bodies;
    });
  }
  std::stable_sort(
      suspects_.begin(), suspects_.end(),
      [](const Suspect& a, const Suspect& b) { return a.promise < b.promise; });
  return std::move(suspects_);
}

}  // namespace

std::vector<Suspect> FirstLooks(Competition* competition) {
  return FirstLook(competition).Run();
}

}  // namespace sysid
