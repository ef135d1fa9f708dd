#include "tools/interrupt.h"

#include <pthread.h>
#include <unistd.h>

#include <cstdio>
#include <thread>

namespace sysid {
namespace {

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

sigset_t BlockInterrupts() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

Interrupt::Interrupt() {
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

void Interrupt::SayKept(const std::string& what, bool into_files) const {
  if (!source_.stop_requested()) return;
  std::fprintf(stderr, "interrupted: %s is %s\n", what.c_str(),
               into_files ? "written" : "printed");
}

}  // namespace sysid
