// The studio's saved session: "@" in the index stands for what the session is
// of (its model, runs, options), which no fuzzer guesses; what stands behind a
// line "----" is model-0.json, behind the next model-1.json.

#include <filesystem>
#include <fstream>
#include <sstream>

#include "sysid/studio/studio_folder.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/studio_doubles.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;

std::string ReadAll(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

// What a new session writes of itself.
const std::string& SavedSession() {
  static const std::string& saved = *new std::string([] {
    const std::string folder = FuzzFolder() + "/new";
    const StudioFolder made(FuzzStudioSetup(folder));
    return Json::parse(ReadAll(folder + "/studio.json")).at("session").dump();
  }());
  return saved;
}

std::vector<std::string> SplitFiles(const std::string& text) {
  const std::string kLine = "\n----\n";
  std::vector<std::string> files;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(kLine, begin), text.size());
    files.push_back(text.substr(begin, end - begin));
    begin = end + kLine.size();
  }
  return files;
}

std::map<std::string, std::string> Contents(const std::string& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : fs::directory_iterator(folder)) {
    contents[entry.path().filename()] = ReadAll(entry.path());
  }
  return contents;
}

void ExpectSameReadBack(const StudioModel& model) {
  const Json json = ToJson(model);
  const StudioModel again =
      StudioModelFrom(Json::parse(json.dump()), "again.json");
  FUZZ_EXPECT(ToJson(again) == json);
}

}  // namespace
}  // namespace sysid

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  using namespace sysid;
  std::vector<std::string> files = SplitFiles(TextOf(data, size));
  if (files.size() > 3) return -1;
  const size_t at = files[0].find('@');
  if (at != std::string::npos) files[0].replace(at, 1, SavedSession());
  const std::string folder = FuzzFolder() + "/session";
  fs::remove_all(folder);
  fs::create_directories(folder);
  std::ofstream(folder + "/studio.json", std::ios::binary) << files[0];
  for (size_t i = 1; i < files.size(); ++i) {
    std::ofstream(folder + "/model-" + std::to_string(i - 1) + ".json",
                  std::ios::binary)
        << files[i];
  }
  const auto before = Contents(folder);
  try {
    StudioFolder opened(FuzzStudioSetup(folder));
    const auto models = opened.TakeModels();
    FUZZ_EXPECT(models.size() < files.size());
    for (size_t i = 0; i < models.size(); ++i) {
      FUZZ_EXPECT(models[i]->id == static_cast<int>(i));
      FUZZ_EXPECT(models[i]->parent < models[i]->id);
      ExpectSameReadBack(*models[i]);
    }
  } catch (const InputError& error) {
    ExpectReadable(error);
  }
  // Opened or refused: what was saved is as it was.
  FUZZ_EXPECT(Contents(folder) == before);
  return 0;
}
