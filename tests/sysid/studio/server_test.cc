#include "sysid/studio/server.h"

#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "models/error.h"
#include "tests/sysid/studio/studio_setup.h"

namespace sysid {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Json = nlohmann::json;

constexpr char kFriction[] = "coulomb_friction@joint1";

Json Change(int model, const std::string& effect) {
  return {{"model", model}, {"effect", effect}};
}

// What a browser is told of a refusal.
void ExpectRefused(const httplib::Result& result, int status,
                   const std::string& what, const std::string& hint = "") {
  ASSERT_TRUE(result);
  EXPECT_EQ(result->status, status) << result->body;
  const Json json = Json::parse(result->body);
  EXPECT_THAT(json["error"].get<std::string>(), HasSubstr(what));
  EXPECT_THAT(json["hint"].get<std::string>(), HasSubstr(hint));
}

// What a user does: look, add what is missing, see the error fall, take it out
// again.
TEST(StudioServer, GoesTheWholeWay) {
  Served served(RubbingPendulum());
  EXPECT_THAT(served.Page()["models"], IsEmpty());
  Reader reader(served);
  EXPECT_EQ(reader.Next(), Json({{"type", "idle"}}));
  ASSERT_EQ(served.Post("/api/start", Json::object())->status, 202);
  Json event = reader.Next();
  EXPECT_EQ(event["type"], "progress");
  EXPECT_EQ(event["title"], "as given");
  EXPECT_EQ(reader.NextEnd(), Json({{"type", "done"}, {"model", 0}}));

  Json page = served.Page();
  ASSERT_EQ(page["models"].size(), 1u);
  EXPECT_EQ(page["schema"], "sysid.page/1");
  EXPECT_EQ(page["live"], true);
  EXPECT_EQ(page["models"][0]["title"], "as given");
  EXPECT_EQ(page["models"][0]["verdict"], "missing_effect");
  EXPECT_EQ(page["models"][0]["candidates"][0]["effect"], "coulomb_friction");
  EXPECT_EQ(page["models"][0]["candidates"][0]["target"], "joint1");
  const double before = page["models"][0]["trainError"];
  EXPECT_GT(before, 3.0);

  ASSERT_EQ(served.Post("/api/add", Change(0, kFriction))->status, 202);
  event = reader.Next();
  EXPECT_EQ(event["title"], "+ coulomb_friction@joint1");
  EXPECT_EQ(reader.NextEnd(), Json({{"type", "done"}, {"model", 1}}));
  page = served.Page();
  ASSERT_EQ(page["models"].size(), 2u);
  const Json& after = page["models"][1];
  EXPECT_EQ(after["effects"], Json({kFriction}));
  EXPECT_EQ(after["verdict"], "adequate");
  EXPECT_LT(after["trainError"], 1.15);
  EXPECT_LT(after["holdoutError"], 1.15);
  EXPECT_EQ(page["current"], 1);
  EXPECT_EQ(page["compared"], 0);
  ASSERT_EQ(page["steps"].size(), 1u);
  EXPECT_EQ(page["steps"][0]["title"], "+ coulomb_friction@joint1");
  EXPECT_EQ(page["steps"][0]["model"], 1);
  EXPECT_NEAR(page["steps"][0]["trainBefore"], before, 1e-9);
  EXPECT_LT(page["steps"][0]["predicted"], 0.5 * before);

  ASSERT_EQ(served.Post("/api/remove", Change(1, kFriction))->status, 202);
  EXPECT_EQ(reader.NextEnd(), Json({{"type", "done"}, {"model", 2}}));
  page = served.Page();
  EXPECT_THAT(page["models"][2]["effects"], IsEmpty());
  EXPECT_NEAR(page["models"][2]["trainError"], before, 0.01 * before);
  EXPECT_EQ(page["steps"][1]["title"], "- coulomb_friction@joint1");
}

// What was no candidate is screened when it is added.
TEST(StudioServer, AddsALawThatAUserTyped) {
  Served served(RubbingPendulum());
  Reader reader(served);
  ASSERT_EQ(reader.Next()["type"], "idle");
  served.studio().Start();
  ASSERT_EQ(reader.NextEnd()["type"], "done");
  const std::string law = "custom@joint1: -c*tanh(qd/v)";
  ASSERT_EQ(served.Post("/api/add", Change(0, law))->status, 202);
  EXPECT_EQ(reader.NextEnd(), Json({{"type", "done"}, {"model", 1}}));
  const Json page = served.Page();
  const Json& after = page["models"][1];
  EXPECT_EQ(after["effects"], Json({law}));
  const double before = page["models"][0]["trainError"];
  EXPECT_LT(after["trainError"], 0.5 * before);
  bool found = false;
  for (const Json& p : after["parameters"]) {
    if (p["name"] != "joint1.c") continue;
    found = true;
    EXPECT_NEAR(p["value"].get<double>(), 0.05, 0.01);
  }
  EXPECT_TRUE(found);
  EXPECT_EQ(page["steps"][0]["title"], "+ " + law);
  ExpectRefused(served.Post("/api/add", Change(1, law)), 400, "is in model 1",
                "add another");
  ExpectRefused(served.Post("/api/add", Change(1, "custom@joint1: -k*")), 400,
                "custom@joint1: -k*");
  ExpectRefused(served.Post("/api/add", Change(1, "thermal_friction@joint1")),
                400, "reads joint1.temperature of", "record the column");
  // Nothing drives it.
  ASSERT_EQ(served.Post("/api/add", Change(1, "effort_gain@joint1"))->status,
            202);
  const Json failed = reader.NextEnd();
  EXPECT_EQ(failed["type"], "failed");
  EXPECT_THAT(failed["error"].get<std::string>(),
              HasSubstr("the data say nothing of 'effort_gain@joint1'"));
}

TEST(StudioServer, GivesTheFilesOfEachModel) {
  Served served(RubbingPendulum());
  Reader reader(served);
  ASSERT_EQ(reader.Next()["type"], "idle");
  served.studio().Start();
  ASSERT_EQ(reader.NextEnd()["type"], "done");
  httplib::Client client = served.Client();
  for (const Json& file : served.Page()["models"][0]["files"]) {
    const std::string name = file["name"];
    SCOPED_TRACE(name);
    const auto result = client.Get("/api/models/0/" + name);
    ASSERT_EQ(result->status, 200);
    EXPECT_EQ(result->get_header_value("Content-Type"), file["type"]);
    EXPECT_EQ(result->get_header_value("Content-Disposition"),
              "attachment; filename=\"" + name + "\"");
    EXPECT_EQ(result->body, *served.studio().File(0, name));
  }
  EXPECT_THAT(client.Get("/api/models/0/identified.urdf")->body,
              HasSubstr("</robot>"));
  ExpectRefused(client.Get("/api/models/1/fit.json"), 404, "nothing at");
  ExpectRefused(client.Get("/api/models/0/fit.jso"), 404, "nothing at");
}

// A long fit, so that the requests come while it runs.
TEST(StudioServer, FitsOneAtATimeAndCancels) {
  Served served(RubbingPendulum("", 30.0));
  Reader reader(served);
  EXPECT_EQ(reader.Next()["type"], "idle");
  served.Post("/api/start", Json::object());
  EXPECT_EQ(reader.Next()["type"], "progress");
  ExpectRefused(served.Post("/api/start", Json::object()), 409,
                "a fit is running", "cancel");
  ExpectRefused(served.Post("/api/add", Change(0, kFriction)), 409,
                "a fit is running", "cancel");
  ExpectRefused(served.Post("/api/remove", Change(0, kFriction)), 409,
                "a fit is running", "cancel");
  {
    Reader late(served);  // what is so now
    EXPECT_EQ(late.Next()["type"], "progress");
  }
  EXPECT_EQ(served.Post("/api/cancel", Json::object())->status, 202);
  EXPECT_EQ(reader.NextEnd(), Json({{"type", "cancelled"}}));
  EXPECT_THAT(served.Page()["models"], IsEmpty());
  // Nothing runs: no harm, and all begins anew.
  EXPECT_EQ(served.Post("/api/cancel", Json::object())->status, 202);
  EXPECT_EQ(served.Post("/api/start", Json::object())->status, 202);
  EXPECT_EQ(reader.Next()["type"], "progress");
}

TEST(StudioServer, RefusesForeignHostsAndOrigins) {
  Served served(RubbingPendulum());
  httplib::Client client = served.Client();
  const std::string port = ":" + std::to_string(served.port());
  const std::string ours = "127.0.0.1" + port;
  const auto get = [&](const httplib::Headers& headers) {
    return client.Get("/api/page", headers);
  };
  for (const std::string& host : {ours, "localhost" + port}) {
    EXPECT_EQ(get({{"Host", host}})->status, 200) << host;
    EXPECT_EQ(get({{"Host", host}, {"Origin", "http://" + host}})->status, 200);
  }
  for (const std::string& host :
       {std::string("127.0.0.1"), std::string("evil.example"),
        "evil.example" + port, std::string("127.0.0.1:1"), ours + ".evil"}) {
    ExpectRefused(get({{"Host", host}}), 403, "foreign Host", "http://" + ours);
    ExpectRefused(client.Get("/", {{"Host", host}}), 403, "foreign Host");
  }
  for (const std::string& origin :
       {std::string("null"), std::string("http://evil.example"),
        "https://" + ours, "http://" + ours + "1", ours}) {
    ExpectRefused(get({{"Host", ours}, {"Origin", origin}}), 403,
                  "another site");
    ExpectRefused(
        client.Post("/api/start", {{"Host", ours}, {"Origin", origin}}, "{}",
                    "application/json"),
        403, "another site");
  }
  ExpectRefused(get({{"Host", ours}, {"Sec-Fetch-Site", "cross-site"}}), 403,
                "another site");
  EXPECT_EQ(get({{"Host", ours}, {"Sec-Fetch-Site", "same-origin"}})->status,
            200);
  EXPECT_EQ(served.studio().models(), 0);
  Reader reader(served);
  EXPECT_EQ(reader.Next()["type"], "idle");  // nothing was started
}

TEST(StudioServer, RefusesWhatItDoesNotUnderstand) {
  Served served(RubbingPendulum());
  httplib::Client client = served.Client();
  for (const char* type :
       {"text/plain", "application/x-www-form-urlencoded", ""}) {
    ExpectRefused(client.Post("/api/start", "{}", type), 415, "Content-Type");
  }
  ExpectRefused(client.Post("/api/add", "{", "application/json"), 400,
                "JSON object", "effect");
  ExpectRefused(
      client.Post("/api/add", R"({"model": )" + std::string(60000, '['),
                  "application/json"),
      400, "JSON object");
  ExpectRefused(served.Post("/api/add", Json::array()), 400, "JSON object");
  ExpectRefused(served.Post("/api/add", {{"effect", "a"}}), 400, "\"model\"");
  ExpectRefused(served.Post("/api/add", {{"model", 0}}), 400, "\"effect\"");
  ExpectRefused(served.Post("/api/add", {{"model", 0.5}, {"effect", "a"}}), 400,
                "whole number");
  ExpectRefused(served.Post("/api/add", Change(0, kFriction)), 400,
                "no model 0", "none is fitted yet");
  ExpectRefused(client.Post("/api/add", std::string((64 << 10) + 1, ' '),
                            "application/json"),
                413, "64 kB");
  const std::string json = "application/json";
  ExpectRefused(
      client.Post("/api/start", {{"Transfer-Encoding", "chunked"}}, "", json),
      411, "its length");
  ExpectRefused(
      client.Post("/api/start", {{"Content-Encoding", "gzip"}}, "", json), 415,
      "compressed");
  ExpectRefused(client.Put("/api/start", "", json), 405, "only GET and POST");
  ExpectRefused(client.Get("/api/start"), 404, "nothing at /api/start");
  ExpectRefused(client.Post("/api/page", "{}", "application/json"), 404, "");
  for (const char* path :
       {"/etc/passwd", "/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd",
        "/api/models/0/../../../etc/passwd", "/api/models/0/..",
        "/api/models/0/%2e%2e%2fstudio.json", "/api/models/-1/fit.json",
        "/api/models/99999999999999999999/fit.json", "/index.html"}) {
    ExpectRefused(client.Get(path), 404, "nothing at");
  }
}

TEST(StudioServer, RefusesChangesThatCannotBeMade) {
  Served served(RubbingPendulum());
  Reader reader(served);
  EXPECT_EQ(reader.Next()["type"], "idle");
  served.studio().Start();
  ASSERT_EQ(reader.NextEnd()["type"], "done");
  const auto add = [&](const std::string& effect) {
    return served.Post("/api/add", Change(0, effect));
  };
  ExpectRefused(add("coulomb_fricton@joint1"), 400, "coulomb_fricton",
                "did you mean");
  ExpectRefused(add("coulomb_friction@joint7"), 400, "joint7");
  ExpectRefused(add("coulomb_friction"), 400, "coulomb_friction");
  ExpectRefused(add(std::string(kFriction) + "," + kFriction), 400, "already");
  ExpectRefused(add(""), 400, "names none");
  ExpectRefused(served.Post("/api/add", Change(1, kFriction)), 400,
                "no model 1", "the last is model 0");
  ExpectRefused(served.Post("/api/add", Change(-1, kFriction)), 400,
                "no model -1");
  ExpectRefused(served.Post("/api/remove", Change(0, kFriction)), 400,
                "was not added to model 0", "beyond the model as given");
  ExpectRefused(served.Post("/api/start", Json::object()), 400, "already");
  EXPECT_EQ(served.studio().models(), 1);
}

TEST(StudioServer, SendsTheHeadersThatKeepAPageToItself) {
  Served served(RubbingPendulum());
  for (const char* path : {"/", "/api/page", "/nothing"}) {
    const auto result = served.Client().Get(path);
    ASSERT_TRUE(result);
    EXPECT_THAT(result->get_header_value("Content-Security-Policy"),
                HasSubstr("connect-src 'self'"));
    EXPECT_EQ(result->get_header_value("X-Content-Type-Options"), "nosniff");
    EXPECT_EQ(result->get_header_value("Cache-Control"), "no-store");
    EXPECT_FALSE(result->has_header("Access-Control-Allow-Origin"));
  }
  EXPECT_EQ(served.Client().Get("/")->body, "<html>the page</html>");
}

// httplib 0.11 reads beyond the end of what it is to send, for a range that
// ends there (found by fuzzing).
TEST(StudioServer, AnswersWholeWhateverRangeIsAskedFor) {
  Served served(RubbingPendulum());
  const std::string page = "<html>the page</html>";
  for (const char* range :
       {"bytes=0-3", "bytes=0-3,5-80", "bytes=90-99", "bytes=5-", "bytes=-7"}) {
    const auto result = served.Client().Get("/", {{"Range", range}});
    ASSERT_TRUE(result) << range;
    EXPECT_EQ(result->status, 200) << range;
    EXPECT_EQ(result->body, page) << range;
  }
}

TEST(StudioServer, SurvivesABrowserThatGoesAway) {
  Served served(RubbingPendulum());
  Reader stays(served);
  EXPECT_EQ(stays.Next()["type"], "idle");
  {
    Reader leaves(served);
    EXPECT_EQ(leaves.Next()["type"], "idle");
    served.Post("/api/start", Json::object());
    EXPECT_EQ(leaves.Next()["type"], "progress");
  }
  EXPECT_EQ(stays.NextEnd()["type"], "done");
}

// However many streams there are, the rest is answered; those that are gone
// make room.
TEST(StudioServer, BoundsTheStreams) {
  constexpr int kMost = 8;
  Served served(RubbingPendulum());
  std::vector<std::unique_ptr<Reader>> readers;
  for (int i = 0; i < kMost; ++i) {
    readers.push_back(std::make_unique<Reader>(served));
    EXPECT_EQ(readers.back()->Next()["type"], "idle");
  }
  ExpectRefused(served.Client().Get("/api/events"), 503, "too many pages");
  EXPECT_EQ(served.Client().Get("/api/page")->status, 200);
  readers.clear();
  const auto end = std::chrono::steady_clock::now() + kPatience;
  int status = 503;
  while (status == 503 && std::chrono::steady_clock::now() < end) {
    status = Reader(served).status();
  }
  EXPECT_EQ(status, 200);
}

// Whoever opens connections and says nothing keeps nobody out: with more of
// them than there may be, the oldest go.
TEST(StudioServer, AnswersBesideManyThatSayNothing) {
  constexpr int kSilent = 300;
  Served served(RubbingPendulum());
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(served.port()));
  std::vector<int> silent;
  for (int i = 0; i < kSilent; ++i) {
    silent.push_back(socket(AF_INET, SOCK_STREAM, 0));
    ASSERT_EQ(connect(silent.back(), reinterpret_cast<sockaddr*>(&address),
                      sizeof(address)),
              0);
  }
  EXPECT_EQ(served.Client().Get("/api/page")->status, 200);
  char byte;
  EXPECT_EQ(recv(silent.front(), &byte, 1, 0), 0);
  for (const int fd : silent) close(fd);
}

TEST(StudioServer, NamesAFreePortWhereOneIsInUse) {
  StudioServer first("");
  const int port = first.Listen(0, "--port");
  StudioServer second("");
  try {
    second.Listen(port, "--port");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.place(), "--port");
    EXPECT_THAT(error.what(),
                HasSubstr("port " + std::to_string(port) +
                          " cannot be had: Address already in use"));
    EXPECT_THAT(error.hint(), HasSubstr(" is free"));
  }
  EXPECT_THROW(second.Listen(70000, "--port"), InputError);
}

}  // namespace
}  // namespace sysid
