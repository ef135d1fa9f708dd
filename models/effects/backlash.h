#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "models/effects/elastic_drive.h"

namespace sysid {

// A drive behind a gap of 2 b: joint elasticity (elastic_drive.h) whose spring
// and damper bend where the teeth touch alone (Nordin and Gutman 2002),
//   g(x) = x + (r(x - b) - r(x + b)) / 2,   r(y) = sqrt(y^2 + s^2),
// which is x - b beyond the gap, x + b before it, 0 within; s, a tenth of b,
// rounds its corners.
class Backlash : public ElasticDrive<Backlash> {
 public:
  static constexpr char kName[] = "backlash";
  static constexpr char kLaw[] =
      "joint elasticity whose spring and damper have a gap between them and "
      "the joint";
  static constexpr char kShowsIn[] =
      "reversals of the effort, where the drive crosses the gap";

  Backlash(const Mechanism& mechanism, const std::string& joint)
      : ElasticDrive(kName, mechanism, joint) {
    AddParameter(joint + ".backlash", "{position}", 0.01, 0.0, 10.0);
    SetStart(kOwn, IsPrismatic() ? 0.001 : 0.01);
  }

  template <typename T>
  void Spring(const JointState<T>& joint, const T* p, T* g, T* slope) const {
    using std::sqrt;
    constexpr double kLeast = 1e-6;  // of s: the slope by b at b = 0
    const T b = Slack(p);
    const T s2 = 0.01 * b * b + T(kLeast * kLeast);
    const T before = joint.z[0] - b, beyond = joint.z[0] + b;
    const T r_before = sqrt(before * before + s2);
    const T r_beyond = sqrt(beyond * beyond + s2);
    *g = joint.z[0] + 0.5 * (r_before - r_beyond);
    *slope = T(1.0) + 0.5 * (before / r_before - beyond / r_beyond);
  }
  template <typename T>
  T Slack(const T* p) const {
    return 0.5 * p[kOwn];
  }

  std::vector<ProbeSet> ProbeSets() const override {
    std::vector<ProbeSet> sets;
    for (const double gap : {0.003, 0.03}) {
      for (ProbeSet& set : ProbesFor({0.0, 0.0, 0.0, gap})) {
        sets.push_back(std::move(set));
      }
    }
    return sets;
  }
};

}  // namespace sysid
