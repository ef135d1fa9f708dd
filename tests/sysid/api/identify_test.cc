#include "sysid/api/identify.h"

#include <gmock/gmock.h>

#include <stdexcept>

#include "sysid/estimation/cancelled.h"
#include "sysid/report/fit_report.h"
#include "tests/support/error_text.h"
#include "tests/sysid/api/api_test_case.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

IdentifyRequest WithFriction() {
  IdentifyRequest request{RubbingRequest()};
  request.add = {"coulomb_friction@joint1"};
  return request;
}

TEST(Identify, FitsAModelInMemoryToRunsInMemory) {
  const IdentifyResult result = Identify(WithFriction());
  EXPECT_TRUE(result.fit().converged) << result.fit().termination;
  ASSERT_EQ(result.fit().parameters.size(), 3u);
  EXPECT_NEAR(result.fit().parameters[0].value, 0.5, 0.005);
  EXPECT_NEAR(result.fit().parameters[2].value, 0.05, 0.002);
  EXPECT_LT(result.fit().train.total.normalized_rms, 1.1);
  ASSERT_TRUE(result.holdout);
  EXPECT_LT(result.holdout->errors.total.normalized_rms, 1.3);
  ASSERT_TRUE(result.added);
  EXPECT_LT(result.added->train_after, result.added->train_before);
  EXPECT_EQ(result.session.model_name, "pendulum2_planar");
  EXPECT_EQ(result.session.model_file, "");
  EXPECT_THAT(result.session.run_names, ElementsAre("run 1", "run 2"));
  // All of it renders.
  EXPECT_THAT(FitText(result, false), HasSubstr("joint1.friction"));
  EXPECT_THAT(FitJson(result), HasSubstr("\"pendulum2_planar\""));
}

TEST(Identify, GoesOnFromTheModelThatItFound) {
  IdentifyRequest request = WithFriction();
  const IdentifyResult first = Identify(request);
  request.model_in_memory = std::make_shared<const Model>(first.fit().model);
  request.add = {};
  request.free = {};
  request.free_none = true;
  request.model = "mended";
  const IdentifyResult second = Identify(request);
  EXPECT_TRUE(second.fit().parameters.empty());
  EXPECT_LT(second.fit().train.total.normalized_rms, 1.1);
  EXPECT_EQ(second.session.model_name, "mended");
  // Held still without its files, too.
  request.may_free_nothing = true;
  request.lock = {{"joint2", 0.1}};
  const Session locked = OpenSession(request, Catalogue());
  EXPECT_EQ(locked.model.nv(), 1);
  EXPECT_EQ(locked.model.nominal().effects,
            first.fit().model.nominal().effects);
}

TEST(Identify, IsReadyOnceBeforeTheWork) {
  IdentifyRequest request{RubbingRequest()};
  int ready = 0, reports = 0;
  request.callbacks.progress = [&](const Progress&) { ++reports; };
  request.callbacks.ready = [&](const Session& session) {
    ++ready;
    EXPECT_EQ(session.runs.size(), 1u);
    EXPECT_EQ(reports, 0);
  };
  Identify(request);
  EXPECT_EQ(ready, 1);
  EXPECT_GT(reports, 0);
  request.callbacks.ready = [](const Session&) {
    throw std::runtime_error("no place to write to");
  };
  EXPECT_THROW(Identify(request), std::runtime_error);
}

TEST(Identify, IsStopped) {
  IdentifyRequest request{RubbingRequest()};
  std::stop_source source;
  source.request_stop();
  request.callbacks.stop = source.get_token();
  EXPECT_THROW(Identify(request), Cancelled);
}

TEST(Identify, SaysWhatIsWrongWithARequest) {
  const auto error = [](const auto& change) {
    IdentifyRequest request{RubbingRequest()};
    change(&request);
    return ErrorText([&] { Identify(request); });
  };
  EXPECT_THAT(error([](IdentifyRequest* r) { r->free = {{"link9.mass"}}; }),
              HasSubstr("--free: "));
  EXPECT_THAT(error([](IdentifyRequest* r) {
                r->free = {{"link1.length"}, {"link1.length", 0.4}};
              }),
              HasSubstr("--free: 'link1.length' is named twice"));
  EXPECT_THAT(error([](IdentifyRequest* r) { r->solver = "ml"; }),
              HasSubstr("--solver: unknown solver 'ml'"));
  EXPECT_THAT(error([](IdentifyRequest* r) { r->resume = true; }),
              HasSubstr("--resume: has no folder to go on in"));
  EXPECT_THAT(error([](IdentifyRequest* r) { r->runs = {}; }),
              HasSubstr("--traj: is missing"));
}

TEST(Identify, SaysWhatIsWrongWithARunInMemory) {
  const auto error = [](const auto& change) {
    IdentifyRequest request{RubbingRequest()};
    change(&request.runs[0]);
    return ErrorText([&] { Identify(request); });
  };
  EXPECT_THAT(error([](auto* run) { run->t[3] = run->t[2]; }),
              HasSubstr("run 1: the time does not rise at sample 3"));
  EXPECT_THAT(error([](auto* run) { run->effort.resize(601, 1); }),
              HasSubstr("run 1: the effort is 601 x 1, not samples x numbers, "
                        "601 x 2"));
  EXPECT_THAT(error([](auto* run) { run->channels[1].values.resize(5, 1); }),
              HasSubstr("channel 'joint2' is 5 x 1, not"));
  EXPECT_THAT(error([](auto* run) { run->channels[0].target = 7; }),
              HasSubstr("the target of channel 'joint1' is no joint or link"));
  EXPECT_THAT(error([](auto* run) { run->channels.clear(); }),
              HasSubstr("run 1: measures nothing"));
  EXPECT_THAT(error([](auto* run) {
                run->inputs = {{"wind", false, {1.0, 2.0}}};
              }),
              HasSubstr("input 'wind' has 2 values, not 601"));
}

TEST(Identify, TakesRunsWithoutEfforts) {
  IdentifyRequest request{RubbingRequest()};
  request.runs[0].effort.resize(0, 0);
  const Session session = OpenSession(request, Catalogue());
  EXPECT_EQ(session.runs[0].effort.cols(), 2);
  EXPECT_FALSE(HasEffort(session.runs[0], 0, 2));
}

// By a law that a user types, of a run that is in no file.
TEST(Identify, ReadsInputsOfRunsInMemory) {
  IdentifyRequest request{RubbingRequest()};
  for (auto* runs : {&request.runs, &request.holdout_runs}) {
    auto& run = runs->front();
    run.inputs = {{"wind", false, std::vector<double>(run.t.size(), 0.0)}};
  }
  request.add = {"custom@joint1: k*wind"};
  EXPECT_EQ(OpenSession(request, Catalogue()).model.held_size(), 3);
}

}  // namespace
}  // namespace sysid
