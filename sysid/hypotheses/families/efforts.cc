// Efforts in another unit or of another gear ratio, and efforts without
// influence on the motion.

#include <cmath>

#include "sysid/hypotheses/families/families.h"

namespace sysid {
namespace {

// tau was recorded exp(p) times too large. Bodies that are all exp(-p) times as
// heavy do the same.
DataHypothesis Gain(const std::vector<std::string>& names) {
  DataHypothesis hypothesis;
  hypothesis.fault = DataFault::kEffortScale;
  hypothesis.subjects = names;
  hypothesis.like_bodies = hypothesis.is_effect = true;
  hypothesis.probe = 1e-4;  // far above rounding, and linear there
  // Less than a factor of 2 is a body's or a drive's constant, to be fitted;
  // N mm for N m is 1000.
  hypothesis.least = std::log(2.0);
  hypothesis.most = std::log(2e3);
  for (const double factor : {1e-3, 1e-2, 0.1, 0.4, 2.5, 10.0, 100.0, 1e3}) {
    hypothesis.starts.push_back(std::log(factor));
  }
  hypothesis.corrected = [names](double p) {
    return Scaled(names, std::exp(-p));
  };
  const std::string subject = hypothesis.subject();
  hypothesis.says = [subject](double p, double within) {
    const double factor = std::exp(-p);
    return "with " + subject + " times " + ShortNumber(factor) + " (+- " +
           ShortNumber(within * factor) +
           "; another unit or gear ratio, or bodies that are " +
           ShortNumber(factor > 1.0 ? factor : 1.0 / factor) + " times too " +
           (factor > 1.0 ? "heavy" : "light") + ")";
  };
  hypothesis.consequence =
      "fitted masses, frictions and stiffnesses are scaled by the same factor";
  return hypothesis;
}

// What is left of it moves nothing; a factor of 0 would be no sign that any was
// recorded.
DataHypothesis WithoutInfluence(const std::string& column) {
  DataHypothesis hypothesis;
  hypothesis.fault = DataFault::kEffortIdle;
  hypothesis.subjects = {column};
  hypothesis.corrected = [column](double) { return Scaled({column}, 1e-9); };
  hypothesis.says = Words("without " + column);
  hypothesis.consequence = "the recorded effort did not act on the mechanism";
  return hypothesis;
}

}  // namespace

void EffortHypotheses(const CheckInput& input,
                      std::vector<DataHypothesis>* all) {
  std::vector<std::string> names;
  for (const int j : DrivenJoints(input)) {
    names.push_back(input.model->mechanism().joints[j].name + ".tau");
    all->push_back(Gain({names.back()}));
  }
  if (names.size() > 1) all->push_back(Gain(names));
  for (const std::string& name : names) all->push_back(WithoutInfluence(name));
}

}  // namespace sysid
