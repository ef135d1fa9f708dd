#include "sysid/processes/supervised.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>

namespace sysid {
namespace {

// How a child that has ended did; -1: it has not.
int ExitCode(pid_t child, const std::string& name) {
  int status = 0;
  if (waitpid(child, &status, WNOHANG) != child) return -1;
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  std::fprintf(stderr, "error: %s was killed by signal %d (%s)\n", name.c_str(),
               WTERMSIG(status), strsignal(WTERMSIG(status)));
  return 1;
}

}  // namespace

void ContinueSupervised(const std::string& name) {
  sigset_t awaited, before;
  sigemptyset(&awaited);
  for (const int signal : {SIGCHLD, SIGINT, SIGTERM}) {
    sigaddset(&awaited, signal);
  }
  sigprocmask(SIG_BLOCK, &awaited, &before);
  const pid_t parent = getpid(), child = fork();
  if (child <= 0) {
    if (child == 0) {
      // An interrupt of the group comes by the parent, once.
      setpgid(0, 0);
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (getppid() != parent) _exit(1);
    }
    sigprocmask(SIG_SETMASK, &before, nullptr);
    return;  // without a child by itself
  }
  for (;;) {
    const int signal = sigwaitinfo(&awaited, nullptr);
    if (signal == SIGCHLD) {
      const int code = ExitCode(child, name);
      if (code >= 0) _exit(code);
    } else if (signal > 0) {
      kill(child, signal);
    }
  }
}

}  // namespace sysid
