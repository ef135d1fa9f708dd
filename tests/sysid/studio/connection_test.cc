#include "sysid/studio/connection.h"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <unistd.h>

namespace sysid {
namespace {

using std::chrono::milliseconds;

// Two ends that are connected.
struct Pair {
  Pair() { EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0); }
  ~Pair() {
    close(ends[0]);
    close(ends[1]);
  }
  void Say(const std::string& text) {
    EXPECT_EQ(write(ends[1], text.data(), text.size()),
              static_cast<ssize_t>(text.size()));
  }
  // Whether the other end was closed; 0 bytes are the end.
  bool IsClosed() {
    char byte;
    return recv(ends[1], &byte, 1, MSG_DONTWAIT) == 0;
  }
  int ends[2];
};

TEST(Connections, CloseTheOldestThatSaysNothing) {
  Connections connections(2);
  Pair first, second, third, fourth;
  EXPECT_TRUE(connections.Enter(first.ends[0]));
  EXPECT_TRUE(connections.Enter(second.ends[0]));
  connections.Asked(first.ends[0]);
  EXPECT_TRUE(connections.Enter(third.ends[0]));
  EXPECT_FALSE(first.IsClosed());
  EXPECT_TRUE(second.IsClosed());
  connections.Leave(second.ends[0]);
  EXPECT_FALSE(third.IsClosed());
  connections.Leave(first.ends[0]);
  EXPECT_TRUE(connections.Enter(fourth.ends[0]));
  EXPECT_FALSE(third.IsClosed());
}

TEST(Connections, RefuseOneMoreWhereAllAreAnswered) {
  Connections connections(1);
  Pair first, second;
  EXPECT_TRUE(connections.Enter(first.ends[0]));
  connections.Asked(first.ends[0]);
  EXPECT_FALSE(connections.Enter(second.ends[0]));
  EXPECT_FALSE(first.IsClosed());
}

TEST(Connections, CloseAllThatSayNothingAtTheEnd) {
  Connections connections(2);
  Pair asked, silent;
  EXPECT_TRUE(connections.Enter(asked.ends[0]));
  EXPECT_TRUE(connections.Enter(silent.ends[0]));
  connections.Asked(asked.ends[0]);
  connections.CloseSilent();
  EXPECT_FALSE(asked.IsClosed());
  EXPECT_TRUE(silent.IsClosed());
}

TEST(BoundedSocket, ReadsWhatComesInTime) {
  Pair pair;
  BoundedSocket socket(pair.ends[0], milliseconds(60'000), milliseconds(1));
  pair.Say("ab");
  char text[3] = {};
  EXPECT_EQ(socket.Read(text, 1), 1);
  EXPECT_EQ(socket.Read(text + 1, 5), 1);
  EXPECT_STREQ(text, "ab");
  shutdown(pair.ends[1], SHUT_WR);
  EXPECT_EQ(socket.Read(text, 1), 0);
}

// Of a client that sends byte after byte, too: its time is that of the whole
// request.
TEST(BoundedSocket, ReadsNothingThatComesTooLate) {
  Pair pair;
  BoundedSocket socket(pair.ends[0], milliseconds(0), milliseconds(1));
  pair.Say("a");
  char byte;
  EXPECT_EQ(socket.Read(&byte, 1), -1);
}

TEST(BoundedSocket, WaitsForNoRequestLongerThanItMay) {
  Pair pair;
  BoundedSocket socket(pair.ends[0], milliseconds(20), milliseconds(1));
  char byte;
  EXPECT_EQ(socket.Read(&byte, 1), -1);
}

TEST(BoundedSocket, WritesNothingToWhoReadsNothing) {
  Pair pair;
  BoundedSocket socket(pair.ends[0], milliseconds(1), milliseconds(20));
  const std::string text(1 << 16, 'x');
  // Until the other end is full.
  const timeval soon{0, 20'000};
  setsockopt(pair.ends[0], SOL_SOCKET, SO_SNDTIMEO, &soon, sizeof(soon));
  ssize_t wrote = 0;
  for (int i = 0; i < 1000 && wrote >= 0; ++i) {
    wrote = socket.Write(text.data(), text.size());
  }
  EXPECT_EQ(wrote, -1);
}

}  // namespace
}  // namespace sysid
