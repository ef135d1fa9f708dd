#include "tests/support/running_program.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "tests/support/limits.h"

namespace sysid {
namespace {

// A file for a program's standard error, outside of its folder.
std::string TemporaryFile() {
  std::string name = "/tmp/sysid-errors-XXXXXX";
  const int fd = mkstemp(name.data());
  if (fd < 0) throw std::runtime_error("no temporary file: " + name);
  close(fd);
  return name;
}

}  // namespace

RunningProgram::RunningProgram(const ProgramFolder& folder,
                               const std::string& program,
                               std::vector<std::string> arguments)
    : errors_(TemporaryFile()) {
  arguments.insert(arguments.begin(), program);
  std::vector<char*> argv;
  for (std::string& word : arguments) argv.push_back(word.data());
  argv.push_back(nullptr);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  const std::string where = folder.Path("");
  child_ = fork();
  if (child_ < 0) throw std::runtime_error("cannot fork");
  if (child_ == 0) {
    LimitWork();
    const int null = open("/dev/null", O_RDONLY);
    const int errors = open(errors_.c_str(), O_WRONLY | O_TRUNC);
    if (dup2(null, 0) == 0 && dup2(ends[1], 1) == 1 && dup2(errors, 2) == 2 &&
        chdir(where.c_str()) == 0) {
      execv(argv[0], argv.data());
    }
    _exit(127);
  }
  close(ends[1]);
  out_ = ends[0];
}

RunningProgram::~RunningProgram() {
  if (child_ > 0) {
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }
  ClosePipe();
  unlink(errors_.c_str());
}

std::string RunningProgram::Line() {
  std::string line;
  char c = 0;
  pollfd ready{out_, POLLIN, 0};
  constexpr int kPatience_ms = std::chrono::milliseconds(kHang).count();
  while (poll(&ready, 1, kPatience_ms) == 1 && read(out_, &c, 1) == 1 &&
         c != '\n') {
    line += c;
  }
  return line;
}

std::string RunningProgram::Rest() {
  std::string text;
  char buffer[4096];
  for (ssize_t got = 0; (got = read(out_, buffer, sizeof(buffer))) > 0;) {
    text.append(buffer, static_cast<size_t>(got));
  }
  return text;
}

void RunningProgram::ClosePipe() {
  if (out_ >= 0) close(out_);
  out_ = -1;
}

void RunningProgram::Signal(int signal) {
  if (child_ > 0) kill(child_, signal);
}

bool RunningProgram::HasEnded() {
  if (child_ > 0 && waitpid(child_, &status_, WNOHANG) == child_) child_ = -1;
  return child_ < 0;
}

bool RunningProgram::RunsUntil(const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + kHang;
  while (!HasEnded()) {
    if (holds()) return true;
    if (std::chrono::steady_clock::now() > end) {
      Signal(SIGKILL);
      waitpid(child_, nullptr, 0);
      child_ = -1;
      hung_ = true;
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

double RunningProgram::Worked() {
  clockid_t clock;
  timespec spent{};
  if (HasEnded() || clock_getcpuclockid(child_, &clock) != 0 ||
      clock_gettime(clock, &spent) != 0) {
    return 0.0;
  }
  return static_cast<double>(spent.tv_sec) + 1e-9 * spent.tv_nsec;
}

bool RunningProgram::WorksFor(double cpu_s) {
  return RunsUntil([&] { return Worked() >= cpu_s; });
}

int RunningProgram::Await() {
  RunsUntil([] { return false; });
  if (hung_) return -1;
  return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
}

int RunningProgram::End(int signal) {
  Signal(signal);
  return Await();
}

std::string RunningProgram::Errors() const {
  std::ostringstream text;
  text << std::ifstream(errors_).rdbuf();
  return text.str();
}

}  // namespace sysid
