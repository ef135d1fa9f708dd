// Requests to the studio's server, over loopback: what stands between lines
// "====" is sent on a connection each; ":8080" stands for the server's port. A
// session of its own for each input.

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <set>
#include <string_view>
#include <thread>

#include "sysid/studio/server.h"
#include "sysid/studio/studio.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/studio_doubles.h"

namespace sysid {
namespace {

constexpr char kPage[] = "<!doctype html><title>fuzz</title>";

// One server for all inputs; the session behind it is made anew in its place
// while no connection is open.
struct Fixture {
  std::optional<Studio> studio;
  StudioServer server{kPage};
  int port = 0;
  std::thread serving;

  Fixture() {
    port = server.Listen(0, "--port");
    studio.emplace(FuzzStudioSetup(""));
    serving = std::thread([this] { server.Serve(&*studio); });
    serving.detach();
  }
};

Fixture& TheFixture() {
  static auto& fixture = *new Fixture;
  return fixture;
}

// By libFuzzer's own clock, of a call that returned this.
bool WasInterrupted(ssize_t result) { return result < 0 && errno == EINTR; }

int Connect(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  while (true) {
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    FUZZ_EXPECT(fd >= 0);
    if (connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) ==
        0) {
      return fd;
    }
    const int error = errno;
    close(fd);
    // Closed connections keep their ports for a minute: several fuzzers beside
    // each other use up all there are.
    if (error != EADDRNOTAVAIL && error != EINTR) {
      std::fprintf(stderr, "connect: %s\n", std::strerror(error));
      FUZZ_EXPECT(error == 0);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

// The answer to a connection's bytes. While nothing comes, first the client
// says that it has no more to send (a request that is not complete; httplib
// does not answer one who has hung up so), then the session is closed, which
// ends a stream of events.
std::string Ask(Fixture* fixture, const std::string& request) {
  constexpr int kQuiet = 5, kHung = 200'000;  // ms
  const int fd = Connect(fixture->port);
  for (size_t at = 0; at < request.size();) {
    const ssize_t sent =
        send(fd, request.data() + at, request.size() - at, MSG_NOSIGNAL);
    if (WasInterrupted(sent)) continue;
    if (sent <= 0) break;  // refused before all was read
    at += static_cast<size_t>(sent);
  }
  std::string answer;
  for (int silences = 0;;) {
    pollfd waiting{fd, POLLIN, 0};
    const int ready = poll(&waiting, 1, silences < 2 ? kQuiet : kHung);
    if (WasInterrupted(ready)) continue;
    if (ready == 0) {
      FUZZ_EXPECT(silences < 2);
      if (++silences == 1) shutdown(fd, SHUT_WR);
      if (silences == 2) fixture->studio->Close();
      continue;
    }
    char buffer[4096];
    const ssize_t got = recv(fd, buffer, sizeof(buffer), 0);
    if (WasInterrupted(got)) continue;
    if (got <= 0) break;
    answer.append(buffer, static_cast<size_t>(got));
  }
  close(fd);
  return answer;
}

// The status of a whole answer; 0: the connection was closed without one. One
// who expects it is told to go on before the answer.
int StatusOf(std::string answer) {
  constexpr std::string_view kGoOn = "HTTP/1.1 100 Continue\r\n\r\n";
  if (answer.starts_with(kGoOn)) answer.erase(0, kGoOn.size());
  if (answer.empty()) return 0;
  int status = 0;
  FUZZ_EXPECT(std::sscanf(answer.c_str(), "HTTP/1.1 %3d ", &status) == 1);
  FUZZ_EXPECT(answer.find("\r\n\r\n") != std::string::npos);
  return status;
}

bool IsGoodHost(const std::string& request, int port) {
  const std::string at = ":" + std::to_string(port);
  return request.find("127.0.0.1" + at) != std::string::npos ||
         request.find("localhost" + at) != std::string::npos;
}

// Whether the request may have started a fit: it was accepted, or its answer
// was lost.
bool ExpectAnswer(Fixture* fixture, const std::string& request) {
  static const auto& known =
      *new std::set<int>{0,   200, 202, 206, 400, 403, 404, 405,
                         409, 411, 413, 414, 415, 416, 417, 503};
  const std::string answer = Ask(fixture, request);
  const int status = StatusOf(answer);
  if (!known.contains(status)) {
    std::fprintf(stderr, "%s\n", answer.c_str());
    FUZZ_EXPECT(known.contains(status));
  }
  // Nobody who names us otherwise is answered.
  const bool is_answered = status == 200 || status == 202 || status == 206;
  if (is_answered) FUZZ_EXPECT(IsGoodHost(request, fixture->port));
  if (is_answered) {
    FUZZ_EXPECT(answer.find("X-Frame-Options: DENY") != std::string::npos);
  }
  return status == 202 || status == 0;
}

}  // namespace
}  // namespace sysid

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  using namespace sysid;
  constexpr size_t kMost = 4;  // connections
  const std::string kLine = "\n====\n", kPort = ":8080";
  Fixture& fixture = TheFixture();
  std::string text = TextOf(data, size);
  const std::string port = ":" + std::to_string(fixture.port);
  for (size_t at = text.find(kPort); at != std::string::npos;
       at = text.find(kPort, at + port.size())) {
    text.replace(at, kPort.size(), port);
  }
  std::vector<std::string> requests;
  for (size_t begin = 0; begin <= text.size() && requests.size() < kMost;) {
    const size_t end = std::min(text.find(kLine, begin), text.size());
    requests.push_back(text.substr(begin, end - begin));
    begin = end + kLine.size();
  }
  fixture.studio.emplace(FuzzStudioSetup(""));
  int accepted = 0;
  for (const std::string& request : requests) {
    accepted += ExpectAnswer(&fixture, request) ? 1 : 0;
  }
  fixture.studio->Close();
  // What was refused did nothing.
  FUZZ_EXPECT(fixture.studio->models() <= accepted);
  // The page is what the session's models say.
  const Json page = Json::parse(fixture.studio->Page());
  FUZZ_EXPECT(page.at("models").size() ==
              static_cast<size_t>(fixture.studio->models()));
  return 0;
}
