#pragma once

#include <httplib.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "models/find_model.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/studio/server.h"
#include "sysid/studio/studio.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {

// Live sessions over real HTTP. Nothing here sleeps: every wait is for an
// event, and ends where something hangs and that does not come.

inline constexpr std::chrono::seconds kPatience{900};

// A pendulum whose first joint rubs, which its model does not know.
inline StudioSetup RubbingPendulum(const std::string& folder = "",
                                   double duration = 2.0) {
  const std::string robot = "pendulum2_planar";
  const Model truth =
      Shipped(robot, {"coulomb_friction@joint1"}, {{"joint1.friction", 0.05}});
  Recording recording;
  recording.duration = duration;
  Session session(Shipped(robot));
  session.model_name = robot;
  session.model_file = FindModel(robot);
  session.free =
      FreeFrom(session.model, {{"link1.length", 0.4}, {"link2.length", 0.4}});
  session.runs = {Record(truth, 1, recording), Record(truth, 2, recording)};
  session.holdout = {Record(truth, 3, recording)};
  session.solver = "lm";
  session.options.noise = kSetupNoise;
  StudioSetup setup(session);
  setup.problem = OpenDiagnosis(session, &setup.session.notices);
  setup.candidates = AllCandidates(session.model);
  setup.page.program = "sysid_studio";
  setup.page.command = "sysid_studio --model pendulum2_planar";
  setup.page.fit_command = [](const std::string& add, const std::string& fix) {
    return "sysid_fit --add " + add + " --fix " + fix;
  };
  setup.folder = folder;
  return setup;
}

// A studio and its server, as sysid_studio has them.
class Served {
 public:
  explicit Served(StudioSetup setup)
      : studio_(std::move(setup)),
        server_("<html>the page</html>"),
        port_(server_.Listen(0, "--port")),
        serving_([this] { server_.Serve(&studio_); }) {}
  ~Served() {
    studio_.Close();
    server_.Stop();
    serving_.join();
  }

  Studio& studio() { return studio_; }
  int port() const { return port_; }
  std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
  httplib::Client Client() const {
    httplib::Client client("127.0.0.1", port_);
    client.set_read_timeout(kPatience);
    return client;
  }
  nlohmann::json Page() const {
    return nlohmann::json::parse(Client().Get("/api/page")->body);
  }
  httplib::Result Post(const std::string& path,
                       const nlohmann::json& body) const {
    return Client().Post(path, body.dump(), "application/json");
  }

 private:
  Studio studio_;
  StudioServer server_;
  const int port_;
  std::thread serving_;
};

// A browser that reads the events.
class Reader {
 public:
  explicit Reader(const Served& served)
      : client_(served.Client()), thread_([this] { Read(); }) {}
  ~Reader() { Leave(); }

  // The next event; null where none came or the stream has ended.
  nlohmann::json Next() {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kPatience,
                      [&] { return !events_.empty() || ended_; });
    if (events_.empty()) return nullptr;
    nlohmann::json event = events_.front();
    events_.pop_front();
    return event;
  }
  // The next that is no progress.
  nlohmann::json NextEnd() {
    nlohmann::json event = Next();
    while (event.is_object() && event["type"] == "progress") event = Next();
    return event;
  }
  // Goes away in the middle of the stream.
  void Leave() {
    leaving_ = true;
    client_.stop();
    if (thread_.joinable()) thread_.join();
  }
  int status() {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kPatience, [&] { return status_ != 0 || ended_; });
    return status_;
  }

 private:
  void Read() {
    client_.Get(
        "/api/events",
        [this](const httplib::Response& response) {
          const std::lock_guard lock(mutex_);
          status_ = response.status;
          changed_.notify_all();
          return true;
        },
        [this](const char* data, size_t size) {
          text_.append(data, size);
          for (size_t end = text_.find("\n\n"); end != std::string::npos;
               end = text_.find("\n\n")) {
            Take(text_.substr(0, end));
            text_.erase(0, end + 2);
          }
          return !leaving_;
        });
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }
  void Take(const std::string& block) {
    constexpr std::string_view kData = "data: ";
    if (!block.starts_with(kData)) return;  // a heartbeat
    const std::lock_guard lock(mutex_);
    events_.push_back(nlohmann::json::parse(block.substr(kData.size())));
    changed_.notify_all();
  }

  httplib::Client client_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<nlohmann::json> events_;
  std::string text_;
  std::atomic<bool> leaving_ = false;
  int status_ = 0;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace sysid
