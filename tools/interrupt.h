#pragma once

#include <csignal>
#include <stop_token>
#include <string>

namespace sysid {

// Ctrl-C, or a polite kill (SIGINT, SIGTERM), asks long work to stop: the
// programs that fit then write the best point so far, marked. What is asked a
// second time ends the program at once, as if it had never been watched; files
// are whole or absent all the same (sysid/io/write_file.h).
//
// One in a program, made before the threads that it is to cover: the signals
// are blocked in the thread that makes it and in those that this starts, and
// one thread waits for them. A signal that whoever started the program ignores
// (nohup) stays ignored.
class Interrupt {
 public:
  // The first signal is only said to have come: whether there is anything to
  // keep by then is known where the work ends.
  Interrupt();
  std::stop_token token() const { return source_.get_token(); }
  // If a signal came: says on standard error that `what` ("the best point so
  // far") is written, or printed where it went into no file. After that.
  void SayKept(const std::string& what, bool into_files) const;

 private:
  std::stop_source source_;
};

// The signals, blocked in this thread and in those that it starts from here on.
sigset_t BlockInterrupts();

}  // namespace sysid
