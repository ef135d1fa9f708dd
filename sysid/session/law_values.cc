#include "sysid/session/law_values.h"

#include <cmath>
#include <limits>

#include "models/error.h"
#include "sysid/checks/finding.h"
#include "sysid/estimation/smooth_positions.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

// The window of SmoothScalar, s: errors of what it gives are alike within it,
// so that a shorter stretch may be the noise's.
constexpr double kShortest = 0.1;

// Samples from `first` to `last`; none where last < first.
struct Stretch {
  int first = 0, last = -1;
};

// What the run measures of the motion that a law reads, smoothed.
class MeasuredMotion {
 public:
  MeasuredMotion(const Effect& effect, const Mechanism& mechanism,
                 const Run& run)
      : effect_(effect),
        own_(mechanism.joints[effect.joint()]),
        run_(run),
        own_q_(RowMatrixXd::Zero(run.size(), 1)),
        own_qd_(own_q_),
        q_(RowMatrixXd::Zero(run.size(), mechanism.nq)),
        qd_(RowMatrixXd::Zero(run.size(), mechanism.nv)) {
    // A joint that follows another has no numbers of its own in q and qd.
    known_ = Smooth(effect.joint(), own_q_, own_qd_);
    for (const int joint : effect.other_joints()) {
      const Joint& other = mechanism.joints[joint];
      known_ = known_ && Smooth(joint, q_.middleCols(other.q_index, 1),
                                qd_.middleCols(other.v_index, 1));
    }
  }

  bool known() const { return known_; }

  // Of the law with these parameters.
  bool HasValue(int sample, const std::vector<double>& p) const {
    std::vector<double> inputs;
    for (const EffectInput& input : effect_.inputs()) {
      inputs.push_back(input.name == kTimeInput
                           ? run_.t[sample]
                           : FindInput(run_, input.name)->values[sample]);
    }
    const double effort = own_.mimic ? 0.0 : run_.effort(sample, own_.v_index);
    JointState<double> state{own_.type, 1, &own_q_(sample, 0),
                             &own_qd_(sample, 0)};
    state.effort = &effort;
    state.inputs = inputs.data();
    state.all_q = q_.row(sample).data();
    state.all_qd = qd_.row(sample).data();
    double force = 0.0;
    HooksFor(effect_, ScalarTag<double>()).AddEffort(state, p.data(), &force);
    return std::isfinite(force);
  }

  // The first of a tenth of a second or more without a value.
  Stretch Without(const std::vector<double>& p) const {
    Stretch stretch;
    for (int k = 0; k <= run_.size(); ++k) {
      if (k < run_.size() && !HasValue(k, p)) {
        if (stretch.last < stretch.first) stretch.first = k;
        stretch.last = k;
        continue;
      }
      if (stretch.last > stretch.first &&
          run_.t[stretch.last] - run_.t[stretch.first] >= kShortest) {
        return stretch;
      }
      stretch = {};
    }
    return {};
  }

  // "from 0.4 s to 1.3 s of run.csv, where joint1.q is from -0.6 to -0.1 rad
  // and joint1.qd from 0.2 to 1.1 rad/s".
  std::string Describe(const Stretch& stretch) const {
    const int size = stretch.last - stretch.first + 1;
    const auto range = [&](const RowMatrixXd& values) {
      const auto part = values.col(0).segment(stretch.first, size);
      return ShortNumber(part.minCoeff()) + " to " +
             ShortNumber(part.maxCoeff());
    };
    const std::string unit = own_.type == JointType::kPrismatic ? " m" : " rad";
    return "from " + ShortNumber(run_.t[stretch.first]) + " s to " +
           ShortNumber(run_.t[stretch.last]) + " s of " + run_.name +
           ", where " + own_.name + ".q is from " + range(own_q_) + unit +
           " and " + own_.name + ".qd from " + range(own_qd_) + unit + "/s";
  }

 private:
  // Of a joint's positions; false where they are not measured.
  bool Smooth(int joint, Eigen::Ref<RowMatrixXd> q,
              Eigen::Ref<RowMatrixXd> qd) const {
    const Channel* measured = FindChannel(run_, ChannelKind::kPosition, joint);
    if (measured == nullptr) return false;
    // Whatever the noise, the lowest degree: it is not known yet.
    SmoothScalar(run_.t, false, std::numeric_limits<double>::infinity(),
                 measured->values.col(0), q, qd);
    return true;
  }

  const Effect& effect_;
  const Joint& own_;
  const Run& run_;
  RowMatrixXd own_q_, own_qd_;  // samples x 1
  RowMatrixXd q_, qd_;          // of the others: samples x nq, samples x nv
  bool known_ = true;
};

}  // namespace

void CheckHasValues(const Effect& effect, const Mechanism& mechanism,
                    const std::vector<const Run*>& runs,
                    const std::string& place) {
  if (!effect.IsTyped()) return;
  std::vector<double> p;
  for (const EffectParameter& parameter : effect.parameters()) {
    if (!parameter.grid.empty()) return;
    p.push_back(parameter.null_value);
  }
  for (const Run* run : runs) {
    const MeasuredMotion motion(effect, mechanism, *run);
    if (!motion.known()) continue;
    const Stretch without = motion.Without(p);
    if (without.last < without.first) continue;
    throw InputError(
        place, effect.name() + " has no value " + motion.Describe(without),
        "write it so that it has one wherever the joint moves, as "
        "sqrt(abs(q)) instead of sqrt(q)");
  }
}

}  // namespace sysid
