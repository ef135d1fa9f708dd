#pragma once

#include <string>
#include <vector>

namespace sysid {

// The faults of one URDF file, gathered so that a user sees them all at once.
class UrdfFaults {
 public:
  // `path` is what messages call the file.
  explicit UrdfFaults(const std::string& path) : path_(path) {}

  // Row and column count from 1; a row of 0 is the file as a whole.
  void Add(int row, int column, const std::string& what,
           const std::string& hint = "");
  bool empty() const { return faults_.empty(); }

  // Throws InputError where there are faults. One: with its place and hint.
  // Several: the file as the place, then one line per fault, in the order of
  // the file, each "file:line:column: what (hint)".
  void Throw() const;

 private:
  struct Fault {
    int row;
    int column;
    std::string what;
    std::string hint;
  };
  std::string Place(const Fault& fault) const;

  std::string path_;
  std::vector<Fault> faults_;
};

}  // namespace sysid
