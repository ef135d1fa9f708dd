#include "sysid/checks/find_skew.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "sysid/checks/equation_error.h"
#include "sysid/checks/knobs.h"
#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

constexpr int kSamples = 6000;  // of an excerpt
// Delays that are tried: what the margin of windows has.
constexpr double kStep = 8e-3;  // s
constexpr int kEachSide = 5;
// What friction and compliance that the model lacks make of a recording whose
// columns are in step: up to 3 ms on a real machine (docs/checks.md).
constexpr double kLeast = 6e-3;  // s
constexpr double kGain = 1.03;   // of the equations' error
// Others this near to the best are named with it, and an effort's delay this
// near is believed: what tells whether one column is late or the other early is
// an effort, whose own delay is the machine's as often as the recording's.
constexpr double kNearlyEqual = 1.1, kAlike = 1.02;

bool AllJointsMeasured(const CheckInput& input) {
  const Mechanism& mechanism = input.model->mechanism();
  int joints = 0;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    if (joint.type == JointType::kFixed) continue;
    if (!IsSimple(joint)) return false;
    for (const Run* run : input.runs) {
      if (FindChannel(*run, ChannelKind::kPosition, static_cast<int>(j)) ==
          nullptr) {
        return false;
      }
    }
    ++joints;
  }
  return joints >= 2;
}

// Without efforts bodies of no mass satisfy the equations of any motion.
bool IsAnyDriven(const CheckInput& input) {
  const auto& joints = input.model->mechanism().joints;
  return std::any_of(joints.begin(), joints.end(), [&](const Joint& joint) {
    return IsSimple(joint) && IsDriven(input, joint);
  });
}

EquationError::Widths WidthsOf(const CheckInput& input) {
  double period = 0.0;
  for (const Run* run : input.runs) {
    period = std::max(period, MedianPeriod(run->t));
  }
  // Wide enough for the noise of encoders, and for a sample or two.
  constexpr double kMotion = 0.01, kAverage = 0.03;  // s
  return {std::max(kMotion, 2.0 * period), std::max(kAverage, 3.0 * period)};
}

// A delay and the error of the equations with it.
struct Delay {
  const Knob* knob = nullptr;
  double value = 0.0, std_error = INFINITY, error = INFINITY;
};

// Where a parabola through the squares of three errors, a step apart, is least,
// in steps from the middle one; nothing where it is not between them.
// `without`: a block.
std::optional<double> LeastOf(const std::vector<EquationError>& three,
                              int without) {
  const auto square = [&](int k) {
    const double error = three[k].Least(without);
    return error * error;
  };
  const double before = square(0), after = square(2);
  const double curvature = before - 2.0 * square(1) + after;
  const double at = 0.5 * (before - after) / curvature;
  if (!(curvature > 0.0) || !(std::abs(at) <= 1.0)) return std::nullopt;
  return at;
}

// Its standard error by the jackknife over blocks, in steps; infinite where a
// block decides whether there is any.
double Jackknife(const std::vector<EquationError>& three) {
  constexpr int n = EquationError::kBlocks;
  double sum = 0.0, squares = 0.0;
  for (int block = 0; block < n; ++block) {
    const auto at = LeastOf(three, block);
    if (!at) return INFINITY;
    sum += *at;
    squares += *at * *at;
  }
  return std::sqrt(std::max(0.0, squares - sum * sum / n) * (n - 1) / n);
}

// The delays that a model's equations ask for.
class Search {
 public:
  Search(LooseModel model, const AsRead& as_read, const Excerpt& excerpt,
         const std::vector<Knob>& knobs)
      : model_(std::move(model)),
        excerpt_(excerpt),
        widths_(WidthsOf(as_read.input())),
        given_(At(knobs.front(), 0.0).Least()) {
    for (const Knob& knob : knobs) delays_.push_back(Best(knob));
  }

  double given() const { return given_; }  // error of what was read
  const std::vector<Delay>& delays() const { return delays_; }
  double LeastError() const {
    double least = given_;
    for (const Delay& delay : delays_) least = std::min(least, delay.error);
    return least;
  }

 private:
  EquationError At(const Knob& knob, double delay) const {
    return EquationError(model_, excerpt_.WideWindows([&](Run* run) {
      if (delay != 0.0) knob.change(delay, run);
    }),
                         Excerpt::kMargin, widths_);
  }

  // The best of what is tried; of no error where it is at an end, or nowhere.
  Delay Best(const Knob& knob) const {
    Delay best;
    best.knob = &knob;
    double middle = 0.0, least = INFINITY;
    for (int k = -kEachSide; k <= kEachSide; ++k) {
      const double error = At(knob, k * kStep).Least();
      if (!(error < least)) continue;
      least = error;
      middle = k * kStep;
    }
    if (std::abs(middle) > (kEachSide - 0.5) * kStep) return best;
    // Of a fast motion it is narrow: ever nearer, until the parabola holds.
    constexpr double kFinest = 2e-3;  // s
    for (double step = kStep; step >= kFinest; step *= 0.5) {
      const std::vector<EquationError> three = {
          At(knob, middle - step), At(knob, middle), At(knob, middle + step)};
      if (const auto at = LeastOf(three, -1)) {
        best.value = middle + step * *at;
        best.error = At(knob, best.value).Least();
        best.std_error = step * Jackknife(three);
        if (best.error <= three[1].Least()) return best;
      }
      if (three[0].Least() < three[1].Least()) middle -= step;
      if (three[2].Least() < three[1].Least()) middle += step;
    }
    return best;
  }

  const LooseModel model_;
  const Excerpt& excerpt_;
  const EquationError::Widths widths_;
  const double given_;
  std::vector<Delay> delays_;
};

// With springs where they surely are: else they only make up for a part of a
// delay.
Search WithSpringsIfAny(const AsRead& as_read, const Excerpt& excerpt,
                        const std::vector<Knob>& knobs) {
  constexpr double kSurely = 1.5;  // 1.2 by chance
  const LooseModel bodies = WithBodies(as_read.lean());
  Search plain(bodies, as_read, excerpt, knobs);
  Search sprung(WithSprings(bodies), as_read, excerpt, knobs);
  return sprung.LeastError() * kSurely < plain.LeastError() ? sprung : plain;
}

// To whole samples.
double ValueOf(const Delay& delay) {
  const double grain = delay.knob->grain;
  return grain * std::round(delay.value / grain);
}

std::string TextOf(const Delay& delay) {
  return delay.knob->says(ValueOf(delay), kInterval * delay.std_error);
}

// What the blocks do not agree on tells nothing.
bool IsSignificant(const Delay& delay) {
  return std::abs(delay.value) >= kSignificance * delay.std_error;
}

bool IsColumn(const Delay& delay) {
  return delay.knob->subject.ends_with(".q");
}

}  // namespace

bool FindSkew(const AsRead& as_read, std::vector<Finding>* findings) {
  const CheckInput& input = as_read.input();
  if (!AllJointsMeasured(input) || !IsAnyDriven(input)) return false;
  const Excerpt excerpt(input.runs, kSamples);
  if (excerpt.empty()) return false;
  std::vector<Knob> knobs;
  FindDelays(input, &knobs);
  const Search search = WithSpringsIfAny(as_read, excerpt, knobs);
  std::vector<Delay> columns;
  double least_of_efforts = INFINITY;
  for (const Delay& delay : search.delays()) {
    if (!IsSignificant(delay)) continue;
    if (IsColumn(delay)) {
      columns.push_back(delay);
    } else {
      least_of_efforts = std::min(least_of_efforts, delay.error);
    }
  }
  if (columns.empty()) return false;
  std::stable_sort(
      columns.begin(), columns.end(),
      [](const Delay& a, const Delay& b) { return a.error < b.error; });
  const Delay& best = columns.front();
  const double given = search.given();
  if (std::abs(best.value) < std::max(kLeast, best.knob->least) ||
      given < kGain * best.error || least_of_efforts < kAlike * best.error) {
    return false;
  }
  Finding finding;
  finding.fault = best.knob->fault;
  finding.severity = Severity::kWrong;
  finding.weight = given / best.error;
  finding.error_left = as_read.missed();
  if (input.runs.size() == 1) finding.file = input.runs.front()->name;
  finding.subject = best.knob->subject;
  finding.evidence =
      "the error of the equations of motion, between the efforts that the "
      "motion needs and those recorded, falls by a factor of " +
      ShortNumber(given / best.error) + " " + TextOf(best);
  finding.consequence = best.knob->consequence;
  finding.remedies = best.knob->remedies(ValueOf(best));
  for (size_t i = 1;
       i < columns.size() && columns[i].error < kNearlyEqual * best.error;
       ++i) {
    NameAlso(TextOf(columns[i]), columns[i].knob->remedies(ValueOf(columns[i])),
             &finding);
  }
  findings->push_back(finding);
  return true;
}

}  // namespace sysid
