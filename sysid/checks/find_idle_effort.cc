#include "sysid/checks/find_idle_effort.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "sysid/checks/knobs.h"
#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"

namespace sysid {
namespace {

// Gains of an effort that does nothing: two efforts of some seconds are alike
// to a half by chance. A small gain that is positive may be a body's that is
// too light.
constexpr double kLeastGain = -0.6, kMostGain = 0.3;
// With that gain, than with a gain of one. Planted ones made 1.09 and more.
constexpr double kBetter = 1.05;
// With that gain, than without: two efforts that are alike to a half by chance
// make 1.15 of it. Of more it is the motion's own, in another unit.
constexpr double kAlike = 1.15;

// Of the short fits: bodies that cannot give way take longer.
constexpr int kIterations = 40;

// The model of the fit with its bodies as they are given: only what effects
// have is free.
LooseModel WithGivenBodies(const LooseModel& lean) {
  LooseModel stiff = lean;
  std::erase_if(stiff.free, [](const FreeParameter& free) {
    return free.parameter.kind != ParameterKind::kEffect;
  });
  return stiff;
}

// Gains of efforts, asked one by one while some count as nothing.
class GainSearch {
 public:
  struct Gain {
    const Joint* joint = nullptr;
    double value = 1.0, std_error = 0.0;
    // Of short segments: with a gain of one, of this value, of nothing.
    double one = 0.0, best = INFINITY, none = INFINITY;

    bool IsIdle() const {
      return value > kLeastGain && value < kMostGain &&
             1.0 - value > kSignificance * std_error && one > kBetter * best &&
             none <= kAlike * best;
    }
  };

  explicit GainSearch(const AsRead& as_read)
      : as_read_(as_read), model_(WithGivenBodies(as_read.lean())) {
    // A strong spring that the model lacks makes efforts look idle.
    constexpr double kSurely = 1.5;  // 1.2 by chance where efforts are idle
    const double given = Short(nullptr, as_read.fit()).error;
    LooseModel without = std::exchange(model_, WithSprings(model_));
    if (!(Short(nullptr, as_read.fit()).error * kSurely < given)) {
      model_ = std::move(without);
    }
    for (const Joint& joint : as_read.input().model->mechanism().joints) {
      if (IsSimple(joint) && IsDriven(as_read.input(), joint)) {
        rest_.push_back(&joint);
      }
    }
  }

  // The one whose gain mends most, if it is idle: it counts as nothing from
  // here on. What another's wrong effort does to the motion spoils the gain of
  // one that works.
  std::optional<Gain> Next() {
    const QuickFit given = Short(nullptr, as_read_.fit());
    Gain most;
    for (const Joint* joint : rest_) {
      const Gain gain = GainOf(joint, given);
      if (gain.best < most.best) most = gain;
    }
    if (!most.IsIdle()) return std::nullopt;
    idle_.push_back(most.joint);
    std::erase(rest_, most.joint);
    return most;
  }

 private:
  void Silence(Run* run) const {
    for (const Joint* joint : idle_) run->effort.col(joint->v_index).setZero();
  }

  // Without that effort, if any, too.
  QuickFit Short(const Joint* without, const QuickFit& like) const {
    return FitShort(model_, as_read_.excerpt().Windows([&](Run* run) {
      Silence(run);
      if (without != nullptr) run->effort.col(without->v_index).setZero();
    }),
                    as_read_.options(), kIterations, &like);
  }

  // From several gains, for a motion that is far from the model's has more than
  // one end: the best.
  Gain GainOf(const Joint* joint, const QuickFit& given) const {
    Knob knob;  // tau turned into (1 + p) tau
    knob.probe = 1e-3;
    knob.least = 0.01;
    knob.most = 3.0;
    const int v = joint->v_index;
    knob.change = [this, v](double p, Run* run) {
      Silence(run);
      run->effort.col(v) *= 1.0 + p;
    };
    Gain gain;
    gain.joint = joint;
    gain.one = given.error;
    for (const double start : {0.0, -0.5, -1.0}) {
      const TurnedKnob turned =
          TurnShort(model_, as_read_.excerpt(), as_read_.options(), knob, start,
                    kIterations, given);
      if (!(turned.fit.error < gain.best)) continue;
      gain.value = 1.0 + turned.value;
      gain.std_error = turned.std_error;
      gain.best = turned.fit.error;
      // On from there, too: a fit of its own may end elsewhere.
      gain.none = FitOn(model_, as_read_.excerpt().Windows([&](Run* run) {
                    knob.change(-1.0, run);
                  }),
                        as_read_.options(), turned.fit)
                      .error;
    }
    gain.none = std::min(gain.none, Short(joint, given).error);
    return gain;
  }

  const AsRead& as_read_;
  LooseModel model_;  // its bodies as given
  std::vector<const Joint*> rest_, idle_;
};

}  // namespace

bool FindIdleEffort(const AsRead& as_read, std::vector<Finding>* findings) {
  const CheckInput& input = as_read.input();
  GainSearch search(as_read);
  NewColumns columns;
  std::string names, gains;
  double with = 0.0, without = 0.0;
  while (const auto gain = search.Next()) {
    const std::string column = gain->joint->name + ".tau";
    const std::string comma = names.empty() ? "" : ", ";
    if (names.empty()) with = gain->one;
    without = gain->none;
    columns.push_back({column, Times(SourceOf(input, column), "1e-9")});
    names += comma + column;
    gains += comma + ShortNumber(gain->value) + " (+- " +
             ShortNumber(1.96 * gain->std_error) + ")";
  }
  if (columns.empty()) return false;
  Finding finding;
  finding.fault = "effort_idle";
  finding.severity = Severity::kWrong;
  finding.weight = with / without;
  finding.error_left = without;
  if (input.runs.size() == 1) finding.file = input.runs.front()->name;
  finding.subject = names;
  finding.evidence = "the motion follows it by a factor of " + gains +
                     " where 1 is meant; over " + ShortNumber(kShortSegment) +
                     " s and with its bodies as they are given, the model "
                     "misses the data by " +
                     TimesText(with) + " with it, by " + TimesText(without) +
                     " without";
  finding.consequence =
      "what was recorded there is not what moved the mechanism";
  finding.remedies = {ColumnsFlag(input, columns)};
  findings->push_back(finding);
  return true;
}

}  // namespace sysid
