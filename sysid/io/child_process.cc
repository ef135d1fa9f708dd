#include "sysid/io/child_process.h"

#include <fcntl.h>
#include <glog/logging.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace sysid {
namespace {

[[noreturn]] void Work(const std::function<void(std::FILE* out)>& work, int fd,
                       int64_t cpu_seconds) {
  // As it was before the program had a say: a broken pipe ends it, and so does
  // what ends the program.
  for (const int number : {SIGPIPE, SIGINT, SIGTERM, SIGSEGV, SIGABRT, SIGBUS,
                           SIGFPE, SIGILL, SIGXCPU}) {
    signal(number, SIG_DFL);
  }
  const rlimit no_core = {0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const rlimit cpu = {static_cast<rlim_t>(cpu_seconds),
                      static_cast<rlim_t>(cpu_seconds + 1)};
  setrlimit(RLIMIT_CPU, &cpu);
  const int null = open("/dev/null", O_WRONLY);
  if (null >= 0) dup2(null, STDERR_FILENO);
  std::FILE* const out = fdopen(fd, "w");
  if (out == nullptr) _exit(1);
  work(out);
  _exit(std::fflush(out) == 0 ? 0 : 1);
}

}  // namespace

ChildProcess::ChildProcess(const std::function<void(std::FILE* out)>& work,
                           int64_t cpu_seconds) {
  int ends[2];
  PCHECK(pipe2(ends, O_CLOEXEC) == 0);
  pid_ = fork();
  if (pid_ < 0) failure_ = std::strerror(errno);
  if (pid_ == 0) {
    close(ends[0]);
    Work(work, ends[1], cpu_seconds);
  }
  close(ends[1]);
  out_ = fdopen(ends[0], "r");
  PCHECK(out_ != nullptr);
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    Finish();
  }
  std::fclose(out_);
}

std::string ChildProcess::Finish() {
  if (pid_ < 0) return failure_;
  int status = 0;
  pid_t ended;
  do {
    ended = waitpid(pid_, &status, 0);
  } while (ended < 0 && errno == EINTR);
  pid_ = -1;
  if (ended < 0) return "its end was not seen";
  if (WIFSIGNALED(status)) {
    return WTERMSIG(status) == SIGXCPU ? "it found no end"
                                       : strsignal(WTERMSIG(status));
  }
  return WEXITSTATUS(status) == 0 ? "" : "it could not write";
}

}  // namespace sysid
