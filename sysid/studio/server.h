#pragma once

#include <memory>
#include <string>

#include "sysid/studio/studio.h"

namespace sysid {

// The HTTP server of sysid_studio; web/src/page_data.ts has its API. It listens
// on 127.0.0.1 alone, and answers only what names it so: a request with a
// foreign Host (a name that somebody made point here) or Origin (a page of
// another site) is refused with 403. What changes something is a POST of JSON,
// which no page of another site can send unasked. No file is ever opened for a
// request.
class StudioServer {
 public:
  // `page` is the HTML that GET / gives.
  explicit StudioServer(const std::string& page);
  ~StudioServer();

  // Takes a port; 0: any free one. Returns it. Throws InputError at `place` for
  // one that cannot be had, and names a free one.
  int Listen(int port, const std::string& place);
  // Answers for the studio until Stop(), which another thread calls, once; what
  // was begun is ended. Streams of events end with Studio::Close(), which is to
  // come first.
  void Serve(Studio* studio);
  void Stop();

 private:
  struct Http;
  std::unique_ptr<Http> http_;
};

}  // namespace sysid
