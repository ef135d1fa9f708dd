#pragma once

#include <map>
#include <string>
#include <vector>

namespace sysid {

// What a program did.
struct ProgramResult {
  int exit_code = -1;  // 128 + the signal that ended it; -1: it hung
  std::string out, err;
  double cpu_s = 0.0;  // of it and those that it waited for
};

// A fresh temporary folder in which programs are run, as a user does; it is
// removed at the end.
class ProgramFolder {
 public:
  ProgramFolder();
  ~ProgramFolder();
  ProgramFolder(const ProgramFolder&) = delete;
  ProgramFolder& operator=(const ProgramFolder&) = delete;

  // Names are relative to the folder.
  std::string Path(const std::string& name) const;
  void Write(const std::string& name, const std::string& text) const;
  std::string Read(const std::string& name) const;
  bool Has(const std::string& name) const;
  // Every file, by its relative name, with its text; folders end in '/'.
  std::map<std::string, std::string> Contents() const;

  // Runs the program in the folder, off a terminal, for as much processor time
  // as limits.h allows (SIGXCPU ends it then). `stdout_file` takes its standard
  // output instead of the result.
  ProgramResult Run(const std::string& program,
                    const std::vector<std::string>& arguments,
                    const std::string& stdout_file = "") const;

 private:
  std::string folder_;   // in which the programs run
  std::string outputs_;  // what they say, beside it
};

}  // namespace sysid
