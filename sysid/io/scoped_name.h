#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

namespace sysid {

// A name on a flag that edits what is read. It may be meant for one run alone:
// "b.csv/joint1.q" is the joint1.q of b.csv.
struct ScopedName {
  std::string run;  // "" : every run; else a run's file, or its name alone
  std::string name;

  bool IsFor(const std::string& path) const;
};

// Splits at the first '/' behind which there is a name, unless the whole is
// one: names may have slashes too ("robot/joint1.q"). Where nothing is a name,
// at the last '/'.
ScopedName SplitScope(const std::string& text,
                      const std::function<bool(const std::string&)>& is_name);

// Of entries with a `name`: those of `winner`, then those of `base` whose names
// it does not have.
template <typename Entry>
std::vector<Entry> MergeByName(const std::vector<Entry>& base,
                               const std::vector<Entry>& winner) {
  std::vector<Entry> merged = winner;
  for (const Entry& entry : base) {
    const bool overruled =
        std::any_of(winner.begin(), winner.end(),
                    [&](const Entry& w) { return w.name == entry.name; });
    if (!overruled) merged.push_back(entry);
  }
  return merged;
}

// Those that hold for the run at `path`, their names without it, as `split`
// makes ScopedNames of them: of two for the same name that for this run alone.
template <typename Entry, typename Split>
std::vector<Entry> EntriesOf(const std::vector<Entry>& entries,
                             const std::string& path, const Split& split) {
  std::vector<Entry> all, own;
  for (Entry entry : entries) {
    const ScopedName scoped = split(entry.name);
    if (!scoped.IsFor(path)) continue;
    entry.name = scoped.name;
    (scoped.run.empty() ? all : own).push_back(entry);
  }
  return MergeByName(all, own);
}

}  // namespace sysid
