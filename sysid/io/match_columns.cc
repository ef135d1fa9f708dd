#include "sysid/io/match_columns.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/column_names.h"

namespace sysid {
namespace {

bool IsNumber(const std::string& word) {
  return std::isdigit(static_cast<unsigned char>(word[0])) != 0;
}

// A joint as names speak of it.
struct NamedJoint {
  std::string name;
  std::vector<std::string> words;  // those that not all joints have
  bool takes_order = false;        // it moves and follows no other
};

struct Candidate {
  std::string column;
  std::vector<std::string> words;
};

struct Pair {
  int joint, candidate;
  double score;
  bool numbers_only;
};

std::vector<NamedJoint> JointsOf(const Mechanism& mechanism) {
  std::vector<NamedJoint> joints;
  for (const Joint& joint : mechanism.joints) {
    const JointType type = joint.held ? joint.held->type : joint.type;
    if (VelocitySize(type) != 1) continue;
    joints.push_back({joint.name, WordsOf(joint.name),
                      !joint.held && !joint.mimic.has_value()});
  }
  if (joints.size() < 2) return joints;
  const std::vector<std::string> first = joints[0].words;
  for (const std::string& word : first) {
    const bool common = std::all_of(
        joints.begin(), joints.end(),
        [&](const NamedJoint& joint) { return Contains(joint.words, word); });
    if (!common) continue;
    for (NamedJoint& joint : joints) std::erase(joint.words, word);
  }
  return joints;
}

// The kind that a column has once the joint's own name is taken away.
ColumnKind KindBeside(const std::string& column,
                      const std::vector<NamedJoint>& joints) {
  std::string rest = column;
  size_t longest = 0;
  for (const NamedJoint& joint : joints) {
    const size_t at = column.find(joint.name);
    if (at == std::string::npos || joint.name.size() <= longest) continue;
    longest = joint.name.size();
    rest = column;
    rest.replace(at, longest, " ");
  }
  if (Trim(rest).empty()) return ColumnKind::kPosition;
  return KindOf(std::string(Trim(rest)));
}

// How well a column's name says the joint: 0 where it does not.
Pair Score(const NamedJoint& joint, const Candidate& candidate) {
  constexpr size_t kPart = 3;  // letters that are a word within another
  Pair match{-1, -1, 0.0, true};
  bool all = !joint.words.empty();
  for (const std::string& word : joint.words) {
    const auto length = static_cast<double>(word.size());
    const bool is_part =
        !IsNumber(word) && word.size() >= kPart &&
        std::any_of(candidate.words.begin(), candidate.words.end(),
                    [&](const std::string& other) {
                      return other.find(word) != std::string::npos;
                    });
    if (Contains(candidate.words, word)) {
      match.score += IsNumber(word) ? 1.0 : 2.0 * length;
    } else if (is_part) {
      match.score += length;
    } else {
      all = false;
      continue;
    }
    match.numbers_only &= IsNumber(word);
  }
  // A part of the name says less than a shorter name does as a whole, and a
  // number that belongs to other words nothing.
  if (!all) match.score = match.numbers_only ? 0.0 : 0.25 * match.score;
  if (match.score == 0.0) return match;
  // Of those that say it the one with the fewest other words.
  constexpr double kOther = 0.01;
  for (const std::string& word : candidate.words) {
    if (!Contains(joint.words, word)) match.score -= kOther;
  }
  return match;
}

// The best of each joint that is no other joint's: best first.
std::vector<Pair> MatchByName(const std::vector<NamedJoint>& joints,
                              const std::vector<Candidate>& candidates) {
  std::vector<Pair> all;
  for (size_t j = 0; j < joints.size(); ++j) {
    for (size_t c = 0; c < candidates.size(); ++c) {
      Pair match = Score(joints[j], candidates[c]);
      if (match.score <= 0.0) continue;
      match.joint = static_cast<int>(j);
      match.candidate = static_cast<int>(c);
      all.push_back(match);
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Pair& a, const Pair& b) {
    return a.score > b.score;
  });
  std::vector<Pair> matches;
  std::vector<bool> joint_done(joints.size()), done(candidates.size());
  for (const Pair& match : all) {
    // Two joints that it says alike: it says neither.
    const bool twice =
        std::any_of(all.begin(), all.end(), [&](const Pair& other) {
          return other.candidate == match.candidate &&
                 other.joint != match.joint && !joint_done[other.joint] &&
                 other.score == match.score;
        });
    if (joint_done[match.joint] || done[match.candidate] || twice) continue;
    joint_done[match.joint] = done[match.candidate] = true;
    matches.push_back(match);
  }
  const bool left_over =
      matches.size() < joints.size() && matches.size() < candidates.size();
  if (left_over) {
    std::erase_if(matches,
                  [](const Pair& match) { return match.numbers_only; });
  }
  return matches;
}

// Columns whose names differ by numbers alone, by these: q2 before q10.
void SortByNumber(std::vector<Candidate>* candidates) {
  const auto split = [](const Candidate& candidate) {
    std::pair<std::vector<std::string>, std::vector<double>> parts;
    for (const std::string& word : candidate.words) {
      double number;
      if (IsNumber(word) && ParseNumber(word, &number)) {
        parts.second.push_back(number);
      } else {
        parts.first.push_back(word);
      }
    }
    return parts;
  };
  for (const Candidate& candidate : *candidates) {
    if (split(candidate).first != split(candidates->front()).first) return;
  }
  std::stable_sort(candidates->begin(), candidates->end(),
                   [&](const Candidate& a, const Candidate& b) {
                     return split(a).second < split(b).second;
                   });
}

class ColumnMatcher {
 public:
  ColumnMatcher(const Mechanism& mechanism,
                const std::vector<std::string>& columns,
                const std::function<bool(const std::string&)>& wanted)
      : joints_(JointsOf(mechanism)), columns_(columns), wanted_(wanted) {}

  ColumnMatches Match() {
    Add(ColumnKind::kPosition, ".q");
    Add(ColumnKind::kVelocity, ".qd");
    if (!Add(ColumnKind::kEffort, ".tau")) {
      Add(ColumnKind::kCommandedEffort, ".tau");
    }
    Add(ColumnKind::kCommand, ".cmd");
    return std::move(found_);
  }

 private:
  // Whether there were columns of this kind.
  bool Add(ColumnKind kind, const std::string& suffix) {
    std::vector<Candidate> candidates;
    for (const std::string& column : columns_) {
      if (!column.empty() && KindBeside(column, joints_) == kind) {
        candidates.push_back({column, WordsOf(column)});
      }
    }
    if (candidates.empty()) return false;
    const auto add = [&](const NamedJoint& joint, const std::string& column) {
      if (!wanted_(joint.name + suffix)) return false;
      found_.map.push_back({joint.name + suffix,
                            QuotedColumn(column) + FactorOf(column, kind), ""});
      return true;
    };
    std::vector<std::string> used;
    std::vector<Pair> matches = MatchByName(joints_, candidates);
    // A single "pos1" beside a column that is joint1's already counts from
    // something else.
    if (candidates.size() == 1) {
      std::erase_if(matches, [&](const Pair& match) {
        const std::string& name = joints_[match.joint].name;
        return match.numbers_only && !wanted_(name + suffix) &&
               candidates[0].column.find(name) == std::string::npos;
      });
    }
    std::sort(matches.begin(), matches.end(),
              [](const Pair& a, const Pair& b) { return a.joint < b.joint; });
    for (const Pair& match : matches) {
      const std::string& column = candidates[match.candidate].column;
      add(joints_[match.joint], column);
      used.push_back(column);
    }
    if (matches.empty()) {
      AddByOrder(candidates, suffix, add);
    } else if (kind == ColumnKind::kPosition) {
      for (const Candidate& candidate : candidates) {
        if (!Contains(used, candidate.column)) {
          found_.left.push_back(candidate.column);
        }
      }
    }
    return true;
  }

  template <typename AddColumn>
  void AddByOrder(std::vector<Candidate> candidates, const std::string& suffix,
                  const AddColumn& add) {
    SortByNumber(&candidates);
    std::vector<const NamedJoint*> open;
    for (const NamedJoint& joint : joints_) {
      if (joint.takes_order && wanted_(joint.name + suffix)) {
        open.push_back(&joint);
      }
    }
    const size_t both = std::min(open.size(), candidates.size());
    const bool certain = open.size() == 1 && candidates.size() == 1;
    for (size_t i = 0; i < both; ++i) {
      if (add(*open[i], candidates[i].column) && !certain) {
        found_.by_order.push_back(open[i]->name + suffix);
      }
    }
  }

  std::vector<NamedJoint> joints_;
  const std::vector<std::string>& columns_;
  const std::function<bool(const std::string&)>& wanted_;
  ColumnMatches found_;
};

}  // namespace

ColumnMatches MatchColumns(
    const Mechanism& mechanism, const std::vector<std::string>& columns,
    const std::function<bool(const std::string& name)>& wanted) {
  return ColumnMatcher(mechanism, columns, wanted).Match();
}

std::string QuotedColumn(const std::string& name) {
  const auto is_one_entry = [&] {
    try {
      const ColumnMap map = ParseColumnMap("t=" + name);
      return map.size() == 1 && map[0].expression == name;
    } catch (const InputError&) {
      return false;
    }
  };
  const bool begins_plain =
      std::string("+-(").find(name[0]) == std::string::npos;
  if (begins_plain && name.find_first_of("'\"") == std::string::npos &&
      is_one_entry()) {
    return name;
  }
  const char mark = name.find('"') == std::string::npos ? '"' : '\'';
  return mark + name + mark;
}

}  // namespace sysid
