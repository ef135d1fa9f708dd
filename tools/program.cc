#include "tools/program.h"

#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <map>
#include <new>
#include <system_error>
#include <thread>

#include "gflags/gflags.h"
#include "glog/logging.h"
#include "models/error.h"
#include "models/printable.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/shooting_stage.h"
#include "sysid/io/cell.h"
#include "sysid/io/csv.h"
#include "sysid/session/gather_notices.h"
#include "tools/version.h"

namespace sysid {
namespace {

// Name and text of each.
std::map<std::string, std::string>& GivenFlags() {
  static std::map<std::string, std::string> given;
  return given;
}

std::vector<std::string>& Arguments() {
  static std::vector<std::string> arguments;
  return arguments;
}

// The flags of our programs; gflags and glog define many of their own.
std::vector<std::string> OwnFlags() {
  std::vector<gflags::CommandLineFlagInfo> all;
  gflags::GetAllFlags(&all);
  std::vector<std::string> names{"help", "version"};
  for (const gflags::CommandLineFlagInfo& flag : all) {
    if (flag.filename.find("tools/sysid_") != std::string::npos ||
        flag.filename.find("tools/fit_flags") != std::string::npos ||
        flag.filename.find("tools/stochastic_flags") != std::string::npos) {
      names.push_back(flag.name);
    }
  }
  return names;
}

bool IsOwn(const std::string& name, const std::vector<std::string>& own) {
  return std::find(own.begin(), own.end(), name) != own.end();
}

bool IsBoolean(const std::string& name) {
  gflags::CommandLineFlagInfo info;
  return gflags::GetCommandLineFlagInfo(name.c_str(), &info) &&
         info.type == "bool";
}

void SetFlag(const std::string& name, const std::string& value) {
  if (value.empty()) {
    throw InputError("--" + name, "has no value",
                     "write --" + name + " value, or leave the flag out");
  }
  if (!GivenFlags().emplace(name, value).second) {
    throw InputError("--" + name, "is given twice", "give it once");
  }
  if (gflags::SetCommandLineOption(name.c_str(), value.c_str()).empty()) {
    gflags::CommandLineFlagInfo info;
    gflags::GetCommandLineFlagInfo(name.c_str(), &info);
    const std::string kind = info.type == "double"   ? "a number"
                             : info.type == "bool"   ? "true or false"
                             : info.type == "string" ? "a text"
                             : info.type == "uint64" ? "a whole number from 0"
                                                     : "a whole number";
    throw InputError("--" + name, "cannot be '" + value + "'",
                     "it takes " + kind);
  }
}

// What std::thread throws where there is none to be had.
bool IsOfThreads(const std::exception& error) {
  const auto* const fault = dynamic_cast<const std::system_error*>(&error);
  return fault != nullptr &&
         fault->code() == std::errc::resource_unavailable_try_again;
}

std::string What(const std::exception& error) {
  if (!IsOfThreads(error)) return error.what();
  return std::string("no thread can be started: ") + error.what() +
         "\n  hint: " + (FlagText("threads") == "1" ? "" : "--threads 1, or ") +
         "allow more: ulimit -u (threads), ulimit -v (memory)";
}

bool IsIgnored(int signal) {
  struct sigaction action {};
  return sigaction(signal, nullptr, &action) == 0 &&
         action.sa_handler == SIG_IGN;
}

int Await(const sigset_t& signals) {
  int signal = 0;
  while (sigwait(&signals, &signal) != 0) {
  }
  return signal;
}

}  // namespace

bool FlagGiven(const std::string& name) { return GivenFlags().count(name) > 0; }

std::string FlagText(const std::string& name) {
  const auto at = GivenFlags().find(name);
  return at == GivenFlags().end() ? "" : at->second;
}

void AdoptFlag(const std::string& name, const std::string& value) {
  GivenFlags()[name] = value;
}

std::string ShellWord(const std::string& text) {
  bool plain = !text.empty();
  for (const unsigned char c : text) {
    plain = plain && (std::isalnum(c) != 0 ||
                      std::string("_-./,=:@+").find(c) != std::string::npos);
  }
  return plain ? text : ShellQuoted(text);
}

std::string ArgumentsText() {
  std::string text;
  for (const std::string& word : Arguments()) text += " " + ShellWord(word);
  return text;
}

bool IsStdout(const std::string& file) {
  return file == "-" || file == "/dev/stdout";
}

void WriteStdout(const std::string& text) {
  const bool written =
      std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!written || std::fflush(stdout) != 0) {
    throw InputError("standard output",
                     std::string("cannot be written: ") + std::strerror(errno),
                     "is the disk full?");
  }
}

void PrintNotices(const std::vector<std::string>& notices,
                  const std::vector<std::string>& runs, size_t from) {
  for (const std::string& notice :
       GatherNotices({notices.begin() + from, notices.end()}, runs)) {
    std::fprintf(stderr, "note: %s\n", Printable(notice).c_str());
  }
}

void CheckPositive(const std::string& flag, double value, double most) {
  if (value > 0 && value <= most) return;
  throw InputError("--" + flag, "cannot be " + ShortestText(value),
                   "it lies above 0 and not above " + ShortestText(most));
}

void CheckCount(const std::string& flag, int value, int most) {
  if (value >= 1 && value <= most) return;
  throw InputError("--" + flag, "cannot be " + std::to_string(value),
                   "it lies between 1 and " + std::to_string(most));
}

void CheckIsNoInput(const std::string& flag, const std::string& file,
                    const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code error;  // also where a file is not there yet
    if (std::filesystem::equivalent(file, input, error)) {
      throw InputError(flag, "'" + file + "' is read too: it would be replaced",
                       "name another file");
    }
  }
}

Asked ParseFlags(int argc, char** argv,
                 const std::vector<std::string>& unused) {
  const std::vector<std::string> own = OwnFlags();
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument.size() < 2 || argument[0] != '-') {
      throw InputError("argument '" + argument + "'", "belongs to no flag",
                       "flags are --name value; lists are separated by commas "
                       "without spaces; see --help");
    }
    const std::string body = argument.substr(argument[1] == '-' ? 2 : 1);
    const size_t equals = body.find('=');
    std::string name = body.substr(0, equals);
    if (name == "help" || name == "h") return Asked::kHelp;
    if (name == "version") return Asked::kVersion;
    if (!IsOwn(name, own)) {
      const std::string positive =
          name.rfind("no", 0) == 0 ? name.substr(2) : "";
      if (IsOwn(positive, own) && IsBoolean(positive) &&
          equals == std::string::npos) {
        SetFlag(positive, "false");
        continue;
      }
      std::vector<std::string> known;
      for (const std::string& flag : own) {
        if (!IsOwn(flag, unused)) known.push_back(flag);
      }
      throw InputError("--" + name, "unknown flag", NameHint(name, known));
    }
    if (equals != std::string::npos) {
      SetFlag(name, body.substr(equals + 1));
    } else if (IsBoolean(name)) {
      SetFlag(name, "true");
    } else if (i + 1 < argc && std::string(argv[i + 1]).rfind("--", 0) != 0) {
      SetFlag(name, argv[++i]);
    } else {
      throw InputError("--" + name, "has no value",
                       "write --" + name + " value");
    }
  }
  return Asked::kWork;
}

int RunProgram(int argc, char** argv, const std::string& help,
               const std::function<int()>& work,
               const std::vector<std::string>& unused) {
  // A file that outgrows `ulimit -f` is an error of its write, not the end.
  std::signal(SIGXFSZ, SIG_IGN);
  Arguments() = {argv + 1, argv + argc};
  google::InitGoogleLogging(argv[0]);
  FLAGS_logtostderr = true;
  // Ceres reports each bad step. GLOG_vmodule=effect_search=1 shows a search.
  if (FLAGS_vmodule.empty()) FLAGS_minloglevel = google::GLOG_FATAL;
  try {
    switch (ParseFlags(argc, argv, unused)) {
      case Asked::kHelp:
        WriteStdout(help);
        return kExitDone;
      case Asked::kVersion:
        WriteStdout(help.substr(0, help.find(':')) + " " + VersionText() +
                    "\n");
        return kExitDone;
      case Asked::kWork:
        break;
    }
    return work();
  } catch (const InputError& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return kExitBadInput;
  } catch (const Cancelled&) {
    std::fprintf(stderr,
                 "error: stopped before there was a first point: nothing was "
                 "fitted, and no file was written\n");
    return kExitNoResult;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "error: out of memory\n");
    return kExitNoResult;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", What(error).c_str());
    return IsOfThreads(error) ? kExitBadInput : kExitNoResult;
  }
}

sigset_t BlockInterrupts() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

Watch::Watch(EstimationOptions* options) : Watch() {
  options->stop = stop();
  options->keep_best = true;
  options->progress = progress();
  Begin();
}

std::function<void(const Progress&)> Watch::progress() {
  if (isatty(STDERR_FILENO) != 1) return {};
  return [this](const Progress& progress) { Show(progress); };
}

void Watch::Begin() {
  start_s_ = Now();
  const bool no_int = IsIgnored(SIGINT), no_term = IsIgnored(SIGTERM);
  sigset_t signals = BlockInterrupts();
  if (no_int && no_term) return;
  if (no_int) sigdelset(&signals, SIGINT);
  if (no_term) sigdelset(&signals, SIGTERM);
  // Detached: it waits as long as the program lives, and a source may be
  // copied.
  std::thread([signals, source = source_]() mutable {
    Await(signals);
    std::fprintf(
        stderr, "%s: stops with what there is; once more ends at once\n",
        isatty(STDERR_FILENO) == 1 ? "\r\033[Kinterrupted" : "interrupted");
    source.request_stop();
    const int again = Await(signals);
    // Ends by the signal itself: who waits for the program sees that.
    signal(again, SIG_DFL);
    pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
    raise(again);
  }).detach();
}

void Watch::Show(const Progress& progress) {
  constexpr double kQuiet = 0.3;   // s: what is done by then needs no line
  constexpr double kPeriod = 0.1;  // s
  const double now = Now();
  const std::string line = line_.Next(progress, now);
  if (now - start_s_ < kQuiet || now - last_s_ < kPeriod) return;
  last_s_ = now;
  shown_ = true;
  std::fprintf(stderr, "\r\033[K%s", line.c_str());
  std::fflush(stderr);
}

void Watch::ClearLine() {
  if (shown_) std::fputs("\r\033[K", stderr);
  shown_ = false;
}

void Watch::SayKept(const std::string& what, bool into_files) const {
  if (!source_.stop_requested()) return;
  std::fprintf(stderr, "interrupted: %s is %s\n", what.c_str(),
               into_files ? "written" : "printed");
}

}  // namespace sysid
