#include "sysid/report/arm_text.h"

#include <algorithm>
#include <vector>

#include "models/error.h"
#include "sysid/report/text.h"

namespace sysid {
namespace {

// "joint1 89.9 %, joint2 59.7 %": of the efforts, by the equations of motion.
std::string LeftOfEfforts(const Fit& fit) {
  std::vector<std::string> joints;
  for (const EffortError& error : fit.effort) {
    joints.push_back(error.joint + Format(" %.3g %%", error.percent));
  }
  return Join(joints);
}

}  // namespace

std::string ArmSentence(const Diagnosis& diagnosis) {
  std::string text = "The equations of motion leave of the efforts " +
                     LeftOfEfforts(diagnosis.base.fit) + " (rms)";
  if (diagnosis.verdict != Verdict::kUnexplained) {
    text += ": missing are " + ListEffects(diagnosis.proposed, " and ");
  } else if (diagnosis.look.given_laws.empty()) {
    text += ", and no effects of the catalogue explain most of that";
  }
  if (!diagnosis.look.given_laws.empty()) {
    std::vector<std::string> names;
    for (const FreeParameter& law : diagnosis.look.given_laws) {
      names.push_back(law.parameter.name);
    }
    text += ", and the friction of the URDF is not this machine's (free " +
            Join(names) + ")";
  }
  if (!diagnosis.look.bodies.empty()) {
    text += ", and the bodies are not those of the URDF";
  }
  if (diagnosis.steps.empty()) return text + ".";
  return text + ". With " + ListEffects(diagnosis.added(), " and ") +
         " they leave " + LeftOfEfforts(diagnosis.last().fit) + ".";
}

std::string ArmText(const Diagnosis& diagnosis) {
  size_t width = 6;
  for (const CandidateEffect& c : diagnosis.candidates) {
    width = std::max(width, c.screened.name().size());
  }
  std::string text = Format(
      "effects by the equations of motion (p-values corrected for %d "
      "tests)\n",
      diagnosis.tests);
  for (const CandidateEffect& c : diagnosis.candidates) {
    text += Format("  %-*s %8s ", static_cast<int>(width),
                   c.screened.name().c_str(),
                   Probability(c.screened.p_value).c_str());
    for (const ParameterEstimate& p : c.confirmed->parameters) {
      text += " " + p.name + " " + Value(p.value, p.std_error) + Behind(p.unit);
    }
    text += "\n";
  }
  return text;
}

}  // namespace sysid
