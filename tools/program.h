#pragma once

#include <csignal>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "sysid/estimation/shooting_problem.h"
#include "sysid/report/progress_line.h"

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
// twice, and for arguments that belong to no flag. `unused`: flags that this
// program shares with others but refuses itself (no hint names them). Ends with
// the first --help or --version, and says which came.
enum class Asked { kWork, kHelp, kVersion };
Asked ParseFlags(int argc, char** argv,
                 const std::vector<std::string>& unused = {});

// Whether a flag was given, and how it was written ("" where it was not).
bool FlagGiven(const std::string& name);
std::string FlagText(const std::string& name);
// As if the flag had been given so, in the commands that are proposed.
void AdoptFlag(const std::string& name, const std::string& value);
// A word as a shell reads it back.
std::string ShellWord(const std::string& text);
// The arguments of the program, each behind a blank, as a shell reads them.
std::string ArgumentsText();

// Whether a file's name means standard output: "-", "/dev/stdout".
bool IsStdout(const std::string& file);

// Writes to standard output; throws InputError where that fails (a full disk).
void WriteStdout(const std::string& text);

// What was assumed or ignored, a line each, on standard error, those from one
// on; gathered where many runs have some (gather_notices.h).
void PrintNotices(const std::vector<std::string>& notices,
                  const std::vector<std::string>& runs = {}, size_t from = 0);

// Throw InputError for a flag's number that is not above 0 and at most `most`,
// or no count from 1 to `most`.
void CheckPositive(const std::string& flag, double value, double most);
void CheckCount(const std::string& flag, int value, int most);

// Throws InputError where the file that `flag` names is one of the inputs.
void CheckIsNoInput(const std::string& flag, const std::string& file,
                    const std::vector<std::string>& inputs);

// Runs a program's work: prints `help` for --help, and for --version a line
// with the program's name, which `help` begins with ("sysid_fit: ..."), and
// version; turns InputError into its text on standard error and exit code 2,
// and any other exception (Cancelled: nothing came of an interrupted fit) into
// one line and exit code 1.
int RunProgram(int argc, char** argv, const std::string& help,
               const std::function<int()>& work,
               const std::vector<std::string>& unused = {});

// Long work that its user watches and may stop.
//
// A live progress line stands on standard error where that is a terminal.
// Ctrl-C, or a polite kill (SIGINT, SIGTERM), asks the work to stop: the
// programs that fit then write the best point so far, marked. What is asked a
// second time ends the program at once, as if it had never been watched; files
// are whole or absent all the same (sysid/io/write_file.h).
//
// One in a program, begun before the threads that it is to cover: the signals
// are blocked in the thread that begins it and in those that this starts, and
// one thread waits for them. A signal that whoever started the program ignores
// (nohup) stays ignored.
class Watch {
 public:
  // Not begun: signals end the program as ever.
  Watch() : start_s_(0.0) {}
  // Has what these options are for report its progress, stop, and keep the best
  // point, and begins; the options must not be used longer than this lives.
  explicit Watch(EstimationOptions* options);
  // For work that is yet to begin. Asks it to stop; shows how far it is (empty
  // where that is not shown, else not to be called longer than this lives).
  std::stop_token stop() const { return source_.get_token(); }
  std::function<void(const Progress&)> progress();
  // From here on the first signal asks the work to stop, and is only said to
  // have come: whether there is anything to keep by then is known where the
  // work ends.
  void Begin();
  ~Watch() { ClearLine(); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  // Before other output.
  void ClearLine();
  // If a signal came: says on standard error that `what` ("the best point so
  // far") is written, or printed where it went into no file. After that.
  void SayKept(const std::string& what, bool into_files) const;

 private:
  void Show(const Progress& progress);

  std::stop_source source_;
  ProgressLine line_;
  bool shown_ = false;
  double start_s_;
  double last_s_ = 0.0;
};

// The signals, blocked in this thread and in those that it starts from here on.
sigset_t BlockInterrupts();

}  // namespace sysid
