#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <list>
#include <mutex>
#include <string>

namespace sysid {

// Lets a socket have a port that was in use a moment ago, but not one that is
// (httplib's own would let a second server have the same).
void ReuseAddress(int socket);
// Whether a port of this machine can be had: it, or 0 with the system's reason.
// Port 0: any free one.
int TryPort(int port, std::string* why);

// The connections that a server has, at most so many. One more closes the
// oldest of those that have not yet asked for anything: who opens many and says
// nothing, or speaks slowly, keeps nobody out. Any thread may call.
class Connections {
 public:
  explicit Connections(size_t most) : most_(most) {}

  // False where all are being answered: the new one is to be closed.
  bool Enter(int socket);
  // All that it asks has come.
  void Asked(int socket);
  void Leave(int socket);
  // Closes those that have asked nothing yet.
  void CloseSilent();

 private:
  struct Connection {
    int socket;
    bool asked;
  };
  std::mutex mutex_;
  std::list<Connection> all_;  // the oldest first
  const size_t most_;
};

// A connected socket whose request has to come as a whole within `request`, and
// whose answer may wait no longer than `answer` for a reader. It stays open.
class BoundedSocket {
 public:
  BoundedSocket(int socket, std::chrono::milliseconds request,
                std::chrono::milliseconds answer);

  bool CanRead() const;
  bool CanWrite() const;
  // As recv(2) and send(2): the number of bytes, 0 at the end, -1 for an error
  // or too late.
  ssize_t Read(char* data, size_t size);
  ssize_t Write(const char* data, size_t size);
  int socket() const { return socket_; }

 private:
  bool Wait(short event, std::chrono::milliseconds patience) const;

  const int socket_;
  const std::chrono::steady_clock::time_point end_;  // of the request
  const std::chrono::milliseconds answer_;
  char buffer_[4096];
  size_t begin_ = 0, filled_ = 0;
};

}  // namespace sysid
