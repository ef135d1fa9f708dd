#include "sysid/studio/studio_folder.h"

#include <gmock/gmock.h>

#include <fstream>

#include "models/error.h"
#include "tests/support/program_folder.h"
#include "tests/sysid/studio/studio_setup.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using Json = nlohmann::json;

constexpr char kFriction[] = "coulomb_friction@joint1";

// Runs a change to its end.
void Await(Studio* studio, const std::function<void()>& change) {
  StudioCursor cursor;
  studio->NextEvents(kPatience, &cursor);
  change();
  std::string last;
  while (last.find("\"progress\"") != std::string::npos || last.empty()) {
    const auto events = studio->NextEvents(kPatience, &cursor);
    ASSERT_FALSE(events.empty());
    last = events.back();
  }
  EXPECT_THAT(last, HasSubstr("\"done\""));
}

// The session goes on where it was, with nothing fitted again.
TEST(StudioFolder, ContinuesWhereItWas) {
  const ProgramFolder folder;
  Json page;
  std::string urdf;
  {
    Studio studio(RubbingPendulum(folder.Path("session")));
    Await(&studio, [&] { studio.Start(); });
    EXPECT_TRUE(folder.Has("session/model-0.json"));  // at once
    Await(&studio, [&] { studio.Add(0, kFriction); });
    page = Json::parse(studio.Page());
    urdf = *studio.File(1, "identified.urdf");
  }
  const auto saved = folder.Contents();
  EXPECT_EQ(Json::parse(saved.at("session/studio.json"))["models"],
            Json({"model-0.json", "model-1.json"}));
  Studio studio(RubbingPendulum(folder.Path("session")));
  EXPECT_EQ(Json::parse(studio.Page()), page);
  EXPECT_EQ(*studio.File(1, "identified.urdf"), urdf);
  EXPECT_EQ(folder.Contents(), saved);
  // And it does go on.
  Await(&studio, [&] { studio.Remove(1, kFriction); });
  EXPECT_EQ(Json::parse(studio.Page())["models"].size(), 3u);
  EXPECT_TRUE(folder.Has("session/model-2.json"));
}

void ExpectRefused(const ProgramFolder& folder, StudioSetup setup,
                   const std::string& file, const std::string& what) {
  const auto before = folder.Contents();
  try {
    Studio studio(std::move(setup));
    FAIL() << what;
  } catch (const InputError& error) {
    EXPECT_EQ(error.place(), folder.Path(file));
    EXPECT_THAT(error.what(), HasSubstr(what));
    EXPECT_THAT(error.hint(), HasSubstr("--out"));
  }
  EXPECT_EQ(folder.Contents(), before);
}

TEST(StudioFolder, IsNoPlaceForAnotherSession) {
  const ProgramFolder folder;
  const StudioSetup own = RubbingPendulum(folder.Path("s"));
  Studio{own};
  {
    StudioSetup other = own;
    other.session.model_name = "pendulum3_planar";
    other.session.model_file = FindModel("pendulum3_planar");
    ExpectRefused(folder, other, "s/studio.json",
                  "is a session of another model: pendulum2_planar");
  }
  {
    StudioSetup other = own;
    other.session.runs[0].channels[0].values(7, 0) += 1e-9;
    ExpectRefused(folder, other, "s/studio.json",
                  "was begun with other numbers in run1.csv, which has "
                  "changed since");
  }
  {
    StudioSetup other = own;
    other.session.runs.pop_back();
    ExpectRefused(folder, other, "s/studio.json",
                  "is a session of other runs: run1.csv, run2.csv");
  }
  {
    StudioSetup other = own;
    other.session.holdout.clear();
    ExpectRefused(folder, other, "s/studio.json",
                  "is a session of other held-out runs: run3.csv");
  }
  {
    StudioSetup other = own;
    other.session.free.pop_back();
    ExpectRefused(folder, other, "s/studio.json", "was begun with other free");
  }
  {
    StudioSetup other = own;
    other.session.options.segment = 0.5;
    ExpectRefused(folder, other, "s/studio.json",
                  "was begun with another --segment");
  }
  {
    StudioSetup other = own;
    other.seed = 2;
    ExpectRefused(folder, other, "s/studio.json",
                  "was begun with another --seed");
  }
  Studio{own};
}

TEST(StudioFolder, IsOneStudiosAtATime) {
  const ProgramFolder folder;
  const StudioSetup setup = RubbingPendulum(folder.Path("s"));
  {
    const Studio studio(setup);
    ExpectRefused(folder, setup, "s", "another sysid_studio saves");
  }
  Studio{setup};
}

TEST(StudioFolder, NamesTheFileThatIsBroken) {
  const ProgramFolder folder;
  const StudioSetup own = RubbingPendulum(folder.Path("s"));
  {
    Studio studio(own);
    Await(&studio, [&] { studio.Start(); });
  }
  const std::string index = folder.Read("s/studio.json");
  const std::string model = folder.Read("s/model-0.json");
  const auto with = [](const std::string& text, const std::string& from,
                       const std::string& to) {
    std::string changed = text;
    return changed.replace(changed.find(from), from.size(), to);
  };
  folder.Write("s/studio.json", index.substr(0, index.size() / 2));
  ExpectRefused(folder, own, "s/studio.json", "is broken: it is no JSON");
  const std::string deep =
      std::string(1000000, '[') + std::string(1000000, ']');
  folder.Write("s/studio.json", with(index, "\"sysid.studio/1\"", deep));
  ExpectRefused(folder, own, "s/studio.json", "nested too deep");
  folder.Write("s/studio.json", "{}");
  ExpectRefused(folder, own, "s/studio.json",
                "is broken: parts of a session are missing");
  folder.Write("s/studio.json", with(index, "studio/1", "studio/2"));
  ExpectRefused(folder, own, "s/studio.json", "is of another version");
  folder.Write("s/studio.json", with(index, "model-0.json", "../a.json"));
  ExpectRefused(folder, own, "s/studio.json",
                "'../a.json' is no name of a model");
  folder.Write("s/studio.json", index);
  folder.Write("s/model-0.json", model.substr(0, model.size() / 2));
  ExpectRefused(folder, own, "s/model-0.json", "is broken: it is no JSON");
  folder.Write("s/model-0.json", with(model, "\"candidates\"", "\"c\""));
  ExpectRefused(folder, own, "s/model-0.json",
                "is broken: parts of a model are missing");
  folder.Write("s/model-0.json", with(model, "\"id\": 0", "\"id\": 1"));
  ExpectRefused(folder, own, "s/model-0.json", "is broken");
  for (const char* id : {"0.5", "1e300", "false", "4294967296"}) {
    folder.Write("s/model-0.json",
                 with(model, "\"id\": 0", std::string("\"id\": ") + id));
    ExpectRefused(folder, own, "s/model-0.json", "of another kind");
  }
  folder.Write("s/model-0.json", model);
  EXPECT_EQ(Studio(own).models(), 1);
}

TEST(StudioFolder, ReplacesNoModelOfAnUnknownSession) {
  const ProgramFolder folder;
  folder.Write("model-0.json", "of somebody");
  ExpectRefused(folder, RubbingPendulum(folder.Path("")), "model-0.json",
                "would be replaced");
}

}  // namespace
}  // namespace sysid
