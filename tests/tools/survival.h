#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/tools/programs.h"

namespace sysid {

// What the tests share that kill programs, or take their disk away.

using Files = std::map<std::string, std::string>;

inline bool IsTemporary(const std::string& name) {
  return name.find(".sysid-part-") != std::string::npos;
}

// Whether a file that a program wrote ends as it must.
inline void ExpectWhole(const std::string& name, const std::string& text) {
  SCOPED_TRACE(name);
  ASSERT_FALSE(text.empty());
  if (name.ends_with(".json")) {
    const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
    ASSERT_TRUE(json.is_object());
    EXPECT_TRUE(json.contains("schema"));
  } else if (name.ends_with(".cbor")) {
    EXPECT_TRUE(nlohmann::json::from_cbor(text, true, false).is_object());
  } else if (name.ends_with(".csv")) {
    EXPECT_EQ(text.back(), '\n');
  } else if (name.ends_with(".urdf")) {
    EXPECT_THAT(text, ::testing::EndsWith("</robot>\n"));
  } else if (name.ends_with(".svg")) {
    EXPECT_THAT(text, ::testing::EndsWith("</svg>\n"));
  } else if (name.ends_with(".html")) {
    EXPECT_THAT(text.substr(text.size() - 20), ::testing::HasSubstr("</html>"));
  }
}

// A folder with two runs of a pendulum that rubs.
class SurvivalTest : public ::testing::Test {
 protected:
  SurvivalTest() {
    for (const auto& [name, seed] :
         {std::pair("run.csv", "1"), std::pair("other.csv", "2")}) {
      SimulateInto(
          folder_, name,
          {"--model", "pendulum2_planar", "--add",
           "coulomb_friction@joint1=0.05", "--seed", seed, "--duration", "4"});
    }
  }
  Arguments Model() const {
    return {"--model",   "pendulum2_planar",
            "--traj",    "run.csv",
            "--holdout", "other.csv",
            "--free",    "link1.length=0.4,link2.length=0.4"};
  }

  ProgramFolder folder_;
};

}  // namespace sysid
