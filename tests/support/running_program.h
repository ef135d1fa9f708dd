#pragma once

#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

#include "tests/support/program_folder.h"

namespace sysid {

// A program that goes on until it ends or is told to; killed where a test
// forgets. Its standard output is a pipe to the test.
class RunningProgram {
 public:
  RunningProgram(const ProgramFolder& folder, const std::string& program,
                 std::vector<std::string> arguments);
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  // The next line that it prints, within a minute; empty where none comes.
  std::string Line();
  // All that it has printed and will print.
  std::string Rest();
  // Nobody reads what it prints any more.
  void ClosePipe();

  void Signal(int signal);
  // Whether it ended within that time.
  bool EndsWithin(std::chrono::milliseconds time);
  // Waits, at most two minutes: its exit code, 128 + the signal that ended it,
  // -1 where it had to be killed.
  int Await();
  // Its exit code after the signal.
  int End(int signal);
  // What it said on standard error, once it has ended.
  std::string Errors() const;

 private:
  pid_t child_ = -1;
  int out_ = -1;
  int status_ = 0;
  std::string errors_;  // the file
};

}  // namespace sysid
