#pragma once

#include <pthread.h>

#include <csignal>

namespace sysid {

// While it lives, new threads take no signals: a program that awaits one
// elsewhere (Ctrl-C) would be ended by it there.
class NoSignals {
 public:
  NoSignals() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~NoSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  NoSignals(const NoSignals&) = delete;
  NoSignals& operator=(const NoSignals&) = delete;

 private:
  sigset_t before_;
};

}  // namespace sysid
