#include "sysid/studio/server.h"

#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <optional>
#include <thread>
#include <utility>

#include "models/error.h"
#include "sysid/report/json.h"
#include "sysid/report/page_data.h"
#include "sysid/studio/connection.h"

namespace sysid {
namespace {

using httplib::Request;
using httplib::Response;

constexpr char kHost[] = "127.0.0.1";
constexpr size_t kLargestBody = 64 << 10;
constexpr int kMostStreams = 8;
// Each holds a thread, while it lasts; a page needs a few.
constexpr size_t kMostConnections = 256;
constexpr int kMostWaiting = 128;  // for their thread
// A request is some hundred bytes, and comes from this machine.
constexpr std::chrono::milliseconds kRequestTime{3000};
constexpr std::chrono::milliseconds kAnswerTime{5000};
// A browser that went away is noticed when nothing can be written to it.
constexpr std::chrono::milliseconds kHeartbeat{2000};

// The page is one file: its scripts and styles stand in it. It may talk to this
// server and nobody else.
constexpr char kPolicy[] =
    "default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; "
    "worker-src blob:; connect-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'";

void Answer(int status, const Json& json, Response* response) {
  response->status = status;
  response->set_content(Compact(json), "application/json");
}

void Refuse(int status, const std::string& error, const std::string& hint,
            Response* response) {
  Answer(status, {{"error", error}, {"hint", hint}}, response);
}

// Answers are whole, as RFC 9110 (14.2) allows: httplib asks a content provider
// for ranges beyond its end.
void IgnoreRanges(Request& request) { request.ranges.clear(); }

// Large text: what is given as a whole httplib would compress, for minutes.
void Send(std::string text, const std::string& type, Response* response) {
  const auto shared = std::make_shared<const std::string>(std::move(text));
  response->set_content_provider(
      shared->size(), type,
      [shared](size_t offset, size_t length, httplib::DataSink& sink) {
        return sink.write(shared->data() + offset, length);
      });
}

std::string TypeOf(const std::string& name) {
  for (const ModelFile& file : ModelFiles()) {
    if (file.name == name) return file.type;
  }
  return "text/plain";
}

// A number that a body must have, and a text.
int IntegerOf(const Json& body, const char* key) {
  const auto at = body.find(key);
  if (at == body.end() || !at->is_number_integer()) {
    throw InputError("request",
                     std::string("\"") + key + "\" must be a whole number");
  }
  const auto value = at->get<std::int64_t>();
  return value < 0 || value > 1 << 30 ? -1 : static_cast<int>(value);
}

std::string TextOf(const Json& body, const char* key) {
  const auto at = body.find(key);
  if (at == body.end() || !at->is_string()) {
    throw InputError("request", std::string("\"") + key + "\" must be a text");
  }
  return at->get<std::string>();
}

Json BodyOf(const Request& request) {
  std::optional<Json> body = ParseJson(request.body);
  if (!body || !body->is_object()) {
    throw InputError(
        "request", "the body must be a JSON object",
        R"(send {"model": 0, "effect": "coulomb_friction@joint1"})");
  }
  return *std::move(body);
}

// A connection as httplib reads and writes it.
class ConnectionStream final : public httplib::Stream {
 public:
  ConnectionStream(int socket, Connections* connections)
      : socket_(socket, kRequestTime, kAnswerTime), connections_(connections) {}

  bool is_readable() const override { return socket_.CanRead(); }
  bool is_writable() const override { return socket_.CanWrite(); }
  ssize_t read(char* data, size_t size) override {
    return socket_.Read(data, size);
  }
  ssize_t write(const char* data, size_t size) override {
    if (!asked_) connections_->Asked(socket_.socket());
    asked_ = true;
    return socket_.Write(data, size);
  }
  // Nobody asks: all are of this machine.
  void get_remote_ip_and_port(std::string& ip, int& port) const override {
    ip = kHost;
    port = 0;
  }
  void get_local_ip_and_port(std::string& ip, int& port) const override {
    ip = kHost;
    port = 0;
  }
  socket_t socket() const override { return socket_.socket(); }

 private:
  BoundedSocket socket_;
  Connections* connections_;
  bool asked_ = false;
};

// A thread for each connection: what waits in a queue would wait for the slow
// ones before it.
class ThreadEach final : public httplib::TaskQueue {
 public:
  explicit ThreadEach(Connections* connections) : connections_(connections) {}

  void enqueue(std::function<void()> answer) override {
    {
      const std::lock_guard lock(mutex_);
      ++running_;
    }
    std::thread([this, answer = std::move(answer)] {
      answer();
      const std::lock_guard lock(mutex_);
      --running_;
      ended_.notify_all();
    }).detach();
  }
  void shutdown() override {
    connections_->CloseSilent();
    std::unique_lock lock(mutex_);
    ended_.wait(lock, [this] { return running_ == 0; });
  }

 private:
  Connections* connections_;
  std::mutex mutex_;
  std::condition_variable ended_;
  int running_ = 0;
};

// httplib's server, but that its connections are bounded, in number and time.
class BoundedServer final : public httplib::Server {
 public:
  BoundedServer() {
    new_task_queue = [this] { return new ThreadEach(&connections_); };
  }

  // httplib lets five wait to be accepted: the next, in a crowd, would try
  // again after a second.
  void LetWait(int connections) { ::listen(svr_sock_, connections); }

 private:
  bool process_and_close_socket(socket_t socket) override {
    bool answered = false;
    if (connections_.Enter(socket)) {
      ConnectionStream stream(socket, &connections_);
      bool closed = false;
      // One request a connection: one that waits for its next would hold a
      // thread.
      answered = process_request(stream, true, closed, IgnoreRanges);
      connections_.Leave(socket);
    }
    ::shutdown(socket, SHUT_RDWR);
    close(socket);
    return answered;
  }

  Connections connections_{kMostConnections};
};

}  // namespace

struct StudioServer::Http {
  explicit Http(const std::string& html) : page(html) {}

  void Configure();
  void Route();
  bool IsOurs(const Request& request, Response* response) const;
  bool IsBounded(const Request& request, Response* response) const;
  void Post(const std::string& path,
            const std::function<void(const Json& body)>& act);
  void StreamEvents(Response* response);

  Studio* studio = nullptr;
  const std::string page;
  int port = 0;
  std::atomic<int> streams = 0;
  BoundedServer server;
};

void StudioServer::Http::Configure() {
  server.set_socket_options(ReuseAddress);
  server.set_tcp_nodelay(true);
  server.set_payload_max_length(kLargestBody);
  server.set_default_headers({{"Content-Security-Policy", kPolicy},
                              {"X-Content-Type-Options", "nosniff"},
                              {"X-Frame-Options", "DENY"},
                              {"Referrer-Policy", "no-referrer"},
                              {"Cross-Origin-Resource-Policy", "same-origin"},
                              {"Cache-Control", "no-store"}});
  server.set_pre_routing_handler([this](const Request& request,
                                        Response& response) {
    const bool asks = request.method == "GET" || request.method == "HEAD";
    return (asks ? IsOurs(request, &response) : IsBounded(request, &response))
               ? httplib::Server::HandlerResponse::Unhandled
               : httplib::Server::HandlerResponse::Handled;
  });
  server.set_error_handler([](const Request& request, Response& response) {
    if (!response.body.empty()) return;
    const int status = response.status;
    const std::string what = status == 404
                                 ? "there is nothing at " + request.path
                             : status == 413 ? "the body is larger than 64 kB"
                                             : "the request was not understood";
    Refuse(status, what, "", &response);
  });
  server.set_exception_handler(
      [](const Request&, Response& response, std::exception_ptr) {
        Refuse(500, "internal error", "", &response);
      });
}

bool StudioServer::Http::IsOurs(const Request& request,
                                Response* response) const {
  const std::string at = ":" + std::to_string(port);
  const auto is_us = [&](const std::string& host) {
    return host == kHost + at || host == "localhost" + at;
  };
  if (request.get_header_value_count("Host") != 1 ||
      !is_us(request.get_header_value("Host"))) {
    Refuse(403, "refused: foreign Host",
           "open http://" + std::string(kHost) + at, response);
    return false;
  }
  const std::string scheme = "http://";
  const std::string origin = request.get_header_value("Origin");
  const bool foreign_origin =
      request.get_header_value_count("Origin") > 1 ||
      (request.has_header("Origin") &&
       !(origin.starts_with(scheme) && is_us(origin.substr(scheme.size()))));
  // What browsers say of requests without an Origin: of an image, a frame.
  const std::string site = request.get_header_value("Sec-Fetch-Site");
  const bool foreign_site = request.path != "/" && !site.empty() &&
                            site != "same-origin" && site != "none";
  if (foreign_origin || foreign_site) {
    Refuse(403, "refused: asked for by a page of another site", "", response);
    return false;
  }
  return true;
}

// httplib reads a body before it looks for who wants it, and bounds none that
// says no length or is compressed.
bool StudioServer::Http::IsBounded(const Request& request,
                                   Response* response) const {
  if (request.method != "POST") {
    Refuse(405, "only GET and POST are understood", "", response);
    return false;
  }
  if (request.has_header("Transfer-Encoding") ||
      request.get_header_value_count("Content-Length") != 1) {
    Refuse(411, "a body must say its length", "", response);
    return false;
  }
  if (request.has_header("Content-Encoding")) {
    Refuse(415, "a body must not be compressed", "", response);
    return false;
  }
  return true;
}

void StudioServer::Http::Post(
    const std::string& path, const std::function<void(const Json& body)>& act) {
  server.Post(path, [this, act](const Request& request, Response& response) {
    // Here, with its body read: a connection that is closed before loses the
    // answer.
    if (!IsOurs(request, &response)) return;
    std::string type = request.get_header_value("Content-Type");
    type = type.substr(0, type.find(';'));
    if (type != "application/json") {
      Refuse(415, "the Content-Type must be application/json", "", &response);
      return;
    }
    try {
      act(BodyOf(request));
      Answer(202, Json::object(), &response);
    } catch (const StudioBusy& busy) {
      Refuse(409, busy.what(), "wait for it, or cancel it", &response);
    } catch (const InputError& error) {
      Refuse(400, error.WithoutHint(), error.hint(), &response);
    }
  });
}

void StudioServer::Http::StreamEvents(Response* response) {
  if (++streams > kMostStreams) {
    --streams;
    Refuse(503, "too many pages are open", "close one of them", response);
    return;
  }
  const auto cursor = std::make_shared<StudioCursor>();
  response->set_chunked_content_provider(
      "text/event-stream",
      [this, cursor](size_t, httplib::DataSink& sink) {
        std::string text;
        for (const std::string& event :
             studio->NextEvents(kHeartbeat, cursor.get())) {
          text += "data: " + event + "\n\n";
        }
        if (studio->closed()) {
          sink.done();
          return true;
        }
        if (text.empty()) text = ":\n\n";  // the heartbeat, a comment
        return sink.write(text.data(), text.size());
      },
      [this](bool) { --streams; });
}

void StudioServer::Http::Route() {
  server.Get("/", [this](const Request&, Response& response) {
    Send(page, "text/html; charset=utf-8", &response);
  });
  server.Get("/api/page", [this](const Request&, Response& response) {
    Send(studio->Page(), "application/json", &response);
  });
  server.Get(R"(/api/models/(\d{1,6})/([a-z_.]{1,40}))",
             [this](const Request& request, Response& response) {
               const std::string name = request.matches[2];
               std::optional<std::string> file =
                   studio->File(std::stoi(request.matches[1]), name);
               if (!file) {
                 response.status = 404;
                 return;
               }
               response.set_header("Content-Disposition",
                                   "attachment; filename=\"" + name + "\"");
               Send(std::move(*file), TypeOf(name), &response);
             });
  server.Get("/api/events", [this](const Request&, Response& response) {
    StreamEvents(&response);
  });
  Post("/api/start", [this](const Json&) { studio->Start(); });
  Post("/api/add", [this](const Json& body) {
    studio->Add(IntegerOf(body, "model"), TextOf(body, "effect"));
  });
  Post("/api/remove", [this](const Json& body) {
    studio->Remove(IntegerOf(body, "model"), TextOf(body, "effect"));
  });
  Post("/api/cancel", [this](const Json&) { studio->Cancel(); });
}

StudioServer::StudioServer(const std::string& page)
    : http_(std::make_unique<Http>(page)) {
  http_->Configure();
  http_->Route();
}

StudioServer::~StudioServer() = default;

int StudioServer::Listen(int port, const std::string& place) {
  BoundedServer& server = http_->server;
  std::string why = "out of range";
  if (port == 0) {
    http_->port = server.bind_to_any_port(kHost);
  } else if (port > 0 && port < 1 << 16 && TryPort(port, &why) == port &&
             server.bind_to_port(kHost, port)) {
    http_->port = port;
  }
  if (http_->port > 0) {
    server.LetWait(kMostWaiting);
    return http_->port;
  }
  std::string ignored;
  const int free = TryPort(0, &ignored);
  throw InputError(
      place, "port " + std::to_string(port) + " cannot be had: " + why,
      free > 0 ? place + " " + std::to_string(free) + " is free" : "");
}

void StudioServer::Serve(Studio* studio) {
  http_->studio = studio;
  http_->server.listen_after_bind();
}

void StudioServer::Stop() {
  // httplib forgets a stop that comes before it runs.
  while (!http_->server.is_running()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  http_->server.stop();
}

}  // namespace sysid
