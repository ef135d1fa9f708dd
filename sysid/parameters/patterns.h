#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "models/effects/catalogue.h"
#include "models/model.h"

namespace sysid {

// Few words for many names: wherever parameters, effects or joints are named, a
// group ("inertial") or a pattern of fnmatch(3) (* ? [..]) stands for all that
// it meets (docs/interface.md section 3).

// What a list may name.
struct Vocabulary {
  std::string kind;                // "parameter", for errors
  std::vector<std::string> names;  // that may be written out
  // Those of them that patterns meet, in the order in which they then come.
  std::vector<std::string> met;
  std::map<std::string, std::vector<std::string>> groups;
  // Those that only a pattern with all before the '@' written out meets.
  std::set<std::string> by_kind;
  std::string unmet;  // why a name may be none that patterns meet; "" for none
};

// Parameters of the model, those of its effects included, and the group
// `inertial`: mass, centre of mass and inertia of each link behind a joint that
// moves. Patterns meet neither links that cannot move nor inertias of frames
// (links without mass that are fixed to another), which the motion does not
// depend on or cannot tell from others; and no whole numbers, which no fit
// moves.
Vocabulary ParameterVocabulary(const Model& model);

// Effects, each on every target where it has a meaning.
Vocabulary EffectVocabulary(const Catalogue& catalogue,
                            const Mechanism& mechanism,
                            const std::vector<std::string>& beside = {});

// Joints of one degree of freedom.
Vocabulary JointVocabulary(const Mechanism& mechanism);

// Whether a text is a group or a pattern, and no name of its own.
bool IsPattern(const std::string& text, const Vocabulary& vocabulary);

// Whether the name is this, or met by this pattern.
bool Matches(const std::string& pattern, const std::string& name);

// The names that a group or pattern stands for. Throws InputError at `place`,
// with the nearest names, where there are none.
std::vector<std::string> Expand(const std::string& pattern,
                                const std::string& place,
                                const Vocabulary& vocabulary);

// A list of entries with a name (the member `name`) and a place: each group and
// pattern is replaced by copies of its entry, one for each name that it stands
// for. A name that is written out keeps its own entry, of patterns that meet
// the same name the later wins. Names that the vocabulary does not have, and
// those that are written out twice, are left for others to refuse.
template <class Entry>
std::vector<Entry> ExpandPatterns(const std::vector<Entry>& list,
                                  std::string Entry::*name,
                                  const Vocabulary& vocabulary) {
  std::vector<std::vector<std::string>> means(list.size());
  std::map<std::string, size_t> by;  // the entry that decides
  for (size_t i = 0; i < list.size(); ++i) {
    if (!IsPattern(list[i].*name, vocabulary)) continue;
    means[i] = Expand(list[i].*name, list[i].place, vocabulary);
    for (const std::string& one : means[i]) by[one] = i;
  }
  for (size_t i = 0; i < list.size(); ++i) {
    if (means[i].empty()) by[list[i].*name] = i;
  }
  std::vector<Entry> expanded;
  for (size_t i = 0; i < list.size(); ++i) {
    if (means[i].empty()) expanded.push_back(list[i]);
    for (const std::string& one : means[i]) {
      if (by[one] != i) continue;
      expanded.push_back(list[i]);
      expanded.back().*name = one;
    }
  }
  return expanded;
}

}  // namespace sysid
