#include "sysid/parameters/patterns.h"

#include <fnmatch.h>

#include <algorithm>
#include <limits>

#include "models/error.h"
#include "models/parameters.h"

namespace sysid {
namespace {

bool IsLinkParameter(ParameterKind kind) {
  return kind == ParameterKind::kLength || kind == ParameterKind::kMass ||
         kind == ParameterKind::kCom || kind == ParameterKind::kInertia ||
         kind == ParameterKind::kInertiaScale;
}

// Whether the link is the one behind its body's joint, not fixed to it.
bool IsBehindJoint(const Model& model, int link) {
  const int body = model.placement(link).body;
  return body >= 0 &&
         model.mechanism().joints[model.bodies()[body].joint].child_link ==
             link;
}

bool IsMet(const Model& model, const Parameter& parameter) {
  if (parameter.kind == ParameterKind::kEffect) {
    return !model.effects().parameters()[parameter.index].whole;
  }
  if (!IsLinkParameter(parameter.kind)) return true;
  const int link = parameter.index;
  return model.placement(link).body >= 0 &&
         (parameter.kind == ParameterKind::kLength ||
          model.nominal().links[link].mass > 0 || IsBehindJoint(model, link));
}

// The index behind the bracket expression that begins at `at`, as fnmatch reads
// it: "]" stands for itself where it comes first. `at` + 1 where none ends.
size_t EndOfBracket(const std::string& pattern, size_t at) {
  size_t from = at + 1;
  if (from < pattern.size() && (pattern[from] == '!' || pattern[from] == '^')) {
    ++from;
  }
  const size_t end = pattern.find(']', from + 1);
  return end == std::string::npos ? at + 1 : end + 1;
}

// The edits that a name is away from being met: Levenshtein's distance, in
// which * stands for any letters, and ? and [..] for any one.
int Distance(const std::string& pattern, const std::string& name) {
  std::vector<int> row(name.size() + 1);
  for (size_t j = 0; j <= name.size(); ++j) row[j] = static_cast<int>(j);
  for (size_t i = 0; i < pattern.size();) {
    const char letter = pattern[i];
    const size_t next = letter == '[' ? EndOfBracket(pattern, i) : i + 1;
    const bool any = letter == '?' || next > i + 1;
    i = next;
    int diagonal = row[0];
    if (letter != '*') ++row[0];
    for (size_t j = 1; j <= name.size(); ++j) {
      const int above = row[j];
      row[j] =
          letter == '*'
              ? std::min(above, row[j - 1])
              : std::min({above + 1, row[j - 1] + 1,
                          diagonal + (any || letter == name[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row.back();
}

// The names with the fewest edits, as many as a line holds.
std::vector<std::string> NearNames(const std::string& pattern,
                                   const std::vector<std::string>& names) {
  constexpr size_t kMost = 6;
  int least = std::numeric_limits<int>::max();
  std::vector<std::string> near;
  for (const std::string& name : names) {
    const int distance = Distance(pattern, name);
    if (distance < least) near.clear();
    least = std::min(least, distance);
    if (distance == least && near.size() < kMost) near.push_back(name);
  }
  return near;
}

}  // namespace

Vocabulary ParameterVocabulary(const Model& model) {
  Vocabulary vocabulary;
  vocabulary.kind = "parameter";
  for (const Parameter& parameter : AllParameters(model)) {
    vocabulary.names.push_back(parameter.name);
    if (IsMet(model, parameter)) vocabulary.met.push_back(parameter.name);
  }
  for (const Body& body : model.bodies()) {
    const Mechanism& mechanism = model.mechanism();
    const int link = mechanism.joints[body.joint].child_link;
    for (const char* entry : {"mass", "com_x", "com_y", "com_z", "ixx", "iyy",
                              "izz", "ixy", "ixz", "iyz"}) {
      vocabulary.groups["inertial"].push_back(mechanism.links[link].name + "." +
                                              entry);
    }
  }
  vocabulary.unmet =
      "parameters of effects are there where the effect is (--add), those of "
      "links where they move";
  return vocabulary;
}

Vocabulary EffectVocabulary(const Catalogue& catalogue,
                            const Mechanism& mechanism,
                            const std::vector<std::string>& beside) {
  Vocabulary vocabulary;
  vocabulary.kind = "effect";
  vocabulary.names = catalogue.Names(mechanism);
  vocabulary.names.insert(vocabulary.names.end(), beside.begin(), beside.end());
  vocabulary.met = vocabulary.names;
  for (const std::string& name : vocabulary.names) {
    const auto effect = catalogue.Make(name, mechanism, "effects");
    if (!effect->IsCandidate() || effect->Extends()) {
      vocabulary.by_kind.insert(name);
    }
  }
  vocabulary.unmet =
      "joints and links that are fixed or held (--lock) have none";
  return vocabulary;
}

Vocabulary JointVocabulary(const Mechanism& mechanism) {
  Vocabulary vocabulary;
  vocabulary.kind = "joint of one degree of freedom";
  for (const Joint& joint : mechanism.joints) {
    if (VelocitySize(joint) == 1) vocabulary.names.push_back(joint.name);
  }
  vocabulary.met = vocabulary.names;
  return vocabulary;
}

bool IsPattern(const std::string& text, const Vocabulary& vocabulary) {
  const std::vector<std::string>& names = vocabulary.names;
  if (std::find(names.begin(), names.end(), text) != names.end()) return false;
  // A typed law (custom@joint1: -k*q^3) is none.
  const std::string name = text.substr(0, text.find(':'));
  return vocabulary.groups.count(text) > 0 ||
         name.find_first_of("*?[") != std::string::npos;
}

bool Matches(const std::string& pattern, const std::string& name) {
  return pattern == name || fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
}

std::vector<std::string> Expand(const std::string& pattern,
                                const std::string& place,
                                const Vocabulary& vocabulary) {
  const auto group = vocabulary.groups.find(pattern);
  if (group != vocabulary.groups.end()) return group->second;
  std::vector<std::string> expanded;
  const bool has_kind =
      pattern.substr(0, pattern.find('@')).find_first_of("*?[") ==
      std::string::npos;
  for (const std::string& name : vocabulary.met) {
    if (!has_kind && vocabulary.by_kind.contains(name)) continue;
    if (Matches(pattern, name)) expanded.push_back(name);
  }
  if (!expanded.empty()) return expanded;
  const std::vector<std::string> near = NearNames(pattern, vocabulary.met);
  throw InputError(
      place, "'" + pattern + "' meets no " + vocabulary.kind + " of this model",
      (near.empty() ? "there is none" : "near names: " + Join(near)) +
          (vocabulary.unmet.empty() ? "" : "; " + vocabulary.unmet));
}

}  // namespace sysid
