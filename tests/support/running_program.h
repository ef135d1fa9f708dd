#pragma once

#include <sys/types.h>

#include <functional>
#include <string>
#include <vector>

#include "tests/support/program_folder.h"

namespace sysid {

// A program that goes on until it ends or is told to; killed where a test
// forgets. Its standard output is a pipe to the test. It may work as much as
// limits.h allows.
class RunningProgram {
 public:
  RunningProgram(const ProgramFolder& folder, const std::string& program,
                 std::vector<std::string> arguments);
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  // The next line that it prints; empty where none comes.
  std::string Line();
  // All that it has printed and will print.
  std::string Rest();
  // Nobody reads what it prints any more.
  void ClosePipe();

  void Signal(int signal);
  // Whether it has ended.
  bool HasEnded();
  // For how many seconds of the processor it has worked; 0 once it has ended.
  double Worked();
  // Waits until it has worked for so many seconds of the processor: false where
  // it ended before.
  bool WorksFor(double cpu_s);
  // Waits until that holds: false where it ended before.
  bool RunsUntil(const std::function<bool()>& holds);
  // Waits for its end: its exit code, 128 + the signal that ended it, -1 where
  // it hung.
  int Await();
  // Its exit code after the signal.
  int End(int signal);
  // What it said on standard error, once it has ended.
  std::string Errors() const;

 private:
  pid_t child_ = -1;
  int out_ = -1;
  int status_ = 0;
  bool hung_ = false;
  std::string errors_;  // the file
};

}  // namespace sysid
