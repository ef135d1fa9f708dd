#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace sysid {

// What a user's data or flags did wrong: thrown where it is found, caught once
// by the programs, printed on standard error, exit code 2. A developer's
// mistake is a glog CHECK instead; a numerical failure is a `false` that the
// summaries count. See docs/decisions/0001-errors.md.
//
// The text reads "<place>: <what>\n  hint: <hint>".
class InputError : public std::runtime_error {
 public:
  // `place` is a file with line and column ("run.csv:12:3"), or a flag
  // ("--free"); `hint` says what to do and may be empty.
  InputError(const std::string& place, const std::string& what,
             const std::string& hint = "");

  const std::string& place() const { return place_; }
  const std::string& detail() const { return detail_; }  // what, alone
  const std::string& hint() const { return hint_; }
  std::string WithoutHint() const;  // "<place>: <what>"

 private:
  std::string place_;
  std::string detail_;
  std::string hint_;
};

// The member of `names` nearest to `name` by edit distance, or "" where none is
// near enough to be a slip of the fingers (more than a third of its letters).
std::string NearestName(const std::string& name,
                        const std::vector<std::string>& names);

// "did you mean 'x'?" where there is a near name, else "known: a, b, c".
std::string NameHint(const std::string& name,
                     const std::vector<std::string>& names);

// "a, b, c".
std::string Join(const std::vector<std::string>& parts,
                 const std::string& separator = ", ");

}  // namespace sysid
