#include "sysid/studio/connection.h"

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>

namespace sysid {

using std::chrono::milliseconds;

void ReuseAddress(int socket) {
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
}

int TryPort(int port, std::string* why) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  ReuseAddress(fd);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  socklen_t size = sizeof(address);
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  // With SO_REUSEADDR several may bind a port, but only one listens.
  const bool found = fd >= 0 && bind(fd, generic, size) == 0 &&
                     listen(fd, 1) == 0 && getsockname(fd, generic, &size) == 0;
  if (!found) *why = std::strerror(errno);
  if (fd >= 0) close(fd);
  return found ? ntohs(address.sin_port) : 0;
}

bool Connections::Enter(int socket) {
  const std::lock_guard lock(mutex_);
  if (all_.size() >= most_) {
    const auto oldest = std::find_if(
        all_.begin(), all_.end(), [](const Connection& c) { return !c.asked; });
    if (oldest == all_.end()) return false;
    // Its thread sees the end, and closes it.
    shutdown(oldest->socket, SHUT_RDWR);
    all_.erase(oldest);
  }
  all_.push_back({socket, false});
  return true;
}

void Connections::Asked(int socket) {
  const std::lock_guard lock(mutex_);
  for (Connection& c : all_) {
    if (c.socket == socket) c.asked = true;
  }
}

void Connections::Leave(int socket) {
  const std::lock_guard lock(mutex_);
  all_.remove_if([&](const Connection& c) { return c.socket == socket; });
}

void Connections::CloseSilent() {
  const std::lock_guard lock(mutex_);
  for (const Connection& c : all_) {
    if (!c.asked) shutdown(c.socket, SHUT_RDWR);
  }
}

BoundedSocket::BoundedSocket(int socket, milliseconds request,
                             milliseconds answer)
    : socket_(socket),
      end_(std::chrono::steady_clock::now() + request),
      answer_(answer) {}

bool BoundedSocket::Wait(short event, milliseconds patience) const {
  pollfd ready{socket_, event, 0};
  int found = 0;
  do {
    found = poll(
        &ready, 1,
        static_cast<int>(std::max<milliseconds::rep>(0, patience.count())));
  } while (found < 0 && errno == EINTR);
  return found == 1 && (ready.revents & event) != 0;
}

bool BoundedSocket::CanRead() const {
  return begin_ < filled_ ||
         Wait(POLLIN, std::chrono::duration_cast<milliseconds>(
                          end_ - std::chrono::steady_clock::now()));
}

bool BoundedSocket::CanWrite() const { return Wait(POLLOUT, answer_); }

ssize_t BoundedSocket::Read(char* data, size_t size) {
  if (begin_ == filled_) {
    // Who speaks slowly is late, too, though there is something to read.
    if (std::chrono::steady_clock::now() >= end_ || !CanRead()) return -1;
    const ssize_t got = recv(socket_, buffer_, sizeof(buffer_), 0);
    if (got <= 0) return got;
    begin_ = 0;
    filled_ = static_cast<size_t>(got);
  }
  const size_t count = std::min(size, filled_ - begin_);
  std::memcpy(data, buffer_ + begin_, count);
  begin_ += count;
  return static_cast<ssize_t>(count);
}

ssize_t BoundedSocket::Write(const char* data, size_t size) {
  if (!CanWrite()) return -1;
  return send(socket_, data, size, MSG_NOSIGNAL);
}

}  // namespace sysid
