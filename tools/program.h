#pragma once

#include <exception>
#include <functional>
#include <string>
#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// What every program of docs/interface.md does alike: flags, help, errors, exit
// codes, progress.

inline constexpr int kExitDone = 0;
inline constexpr int kExitNoResult = 1;  // ran, but to no usable result
inline constexpr int kExitBadInput = 2;

// Sets the gflags that are defined in files under tools/ from the command line,
// as --name value and --name=value (boolean ones also --name and --noname).
// Throws InputError, naming the flag, for one that is unknown (with the nearest
// known), has no value (or an empty one) or one that it cannot take, comes
// twice, and for arguments that belong to no flag. True where --help was asked
// for. `unused`: flags that this program shares with others but refuses itself
// (no hint names them).
bool ParseFlags(int argc, char** argv,
                const std::vector<std::string>& unused = {});

// Whether a flag was given, and how it was written ("" where it was not).
bool FlagGiven(const std::string& name);
std::string FlagText(const std::string& name);

// Whether a file's name means standard output: "-", "/dev/stdout".
bool IsStdout(const std::string& file);

// Writes to standard output; throws InputError where that fails (a full disk).
void WriteStdout(const std::string& text);

// What was assumed or ignored, a line each, on standard error.
void PrintNotices(const std::vector<std::string>& notices, size_t from = 0);

// Writes files, whose disk may be full by now, and notes why that failed: so
// that the result can still be printed. Rethrow() once it is.
class FileOutputs {
 public:
  // False where this or an earlier one failed; that then was not called.
  bool Write(const std::function<void()>& write);
  void Rethrow() const;

 private:
  std::exception_ptr failed_;
};

// Throws InputError where the file that `flag` names is one of the inputs.
void CheckIsNoInput(const std::string& flag, const std::string& file,
                    const std::vector<std::string>& inputs);

// Runs a program's work: prints `help` for --help; turns InputError into its
// text on standard error and exit code 2, and any other exception (Cancelled:
// nothing came of an interrupted fit) into one line and exit code 1.
int RunProgram(int argc, char** argv, const std::string& help,
               const std::function<int()>& work,
               const std::vector<std::string>& unused = {});

// A live progress line on standard error where that is a terminal, else
// nothing. Clear() ends it before other output.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  void Show(const Progress& progress);
  void Clear();

 private:
  bool terminal_;
  bool shown_ = false;
  double start_s_;
  double last_s_ = 0.0;
};

}  // namespace sysid
