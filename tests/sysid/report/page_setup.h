#pragma once

#include <gmock/gmock.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "sysid/report/page_parts.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {

// What tests of the page's document share: its series as numbers, sources, and
// the members that web/src/page_data.ts declares.

inline std::vector<double> Decode(const Json& series) {
  const std::string digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::uint8_t> bytes;
  std::uint32_t bits = 0;
  int count = 0;
  const bool drawn = series.contains("u16");
  const std::string text = series.at(drawn ? "u16" : "f32");
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<std::uint32_t>(digits.find(c));
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::uint8_t>(bits >> count));
  }
  std::vector<double> values;
  for (size_t i = 0; drawn && i + 2 <= bytes.size(); i += 2) {
    const int place = bytes[i] | bytes[i + 1] << 8;
    values.push_back(place == 65535
                         ? NAN
                         : series.at("offset").get<double>() +
                               place * series.at("step").get<double>());
  }
  if (drawn) return values;
  for (size_t i = 0; i + 4 <= bytes.size(); i += 4) {
    const std::uint32_t single = bytes[i] | bytes[i + 1] << 8 |
                                 bytes[i + 2] << 16 |
                                 std::uint32_t{bytes[i + 3]} << 24;
    values.push_back(std::bit_cast<float>(single) +
                     series.value("offset", 0.0));
  }
  return values;
}

inline Session OpenOn(const DiagnosisProblem& problem) {
  Session session(problem.model);
  session.model_name = "pendulum2_planar";
  session.free = problem.free;
  session.runs = RunsOf(*problem.train);
  session.holdout = RunsOf(*problem.holdout);
  session.options = problem.options;
  session.effects = problem.model.effects().names();
  return session;
}

inline PageSource SourceOf(const Session& session,
                           const DiagnosisProblem& problem) {
  PageSource source;
  source.program = "sysid_diagnose";
  source.command = "sysid_diagnose --auto";
  source.session = &session;
  source.train = problem.train.get();
  source.holdout = problem.holdout.get();
  source.fit_command = [](const std::string& add, const std::string& fix) {
    return "sysid_fit --add " + add + (fix.empty() ? "" : " --fix " + fix);
  };
  return source;
}

// The members of the interfaces of page_data.ts, by interface; "?" are
// optional.
inline std::map<std::string, std::set<std::string>> Interfaces() {
  std::ifstream file(SYSID_SOURCE "/web/src/page_data.ts");
  EXPECT_TRUE(file.good());
  std::map<std::string, std::set<std::string>> interfaces;
  std::string line, name;
  std::smatch match;
  const std::regex begin("export interface (\\w+) \\{"), member("  (\\w+): .*");
  while (std::getline(file, line)) {
    if (std::regex_match(line, match, begin)) name = match[1];
    if (line == "}") name.clear();
    if (!name.empty() && std::regex_match(line, match, member)) {
      interfaces[name].insert(match[1]);
    }
  }
  return interfaces;
}

inline void ExpectKeys(const std::string& name, const Json& json) {
  SCOPED_TRACE(name);
  static const auto interfaces = Interfaces();
  const auto keys = interfaces.find(name);
  ASSERT_NE(keys, interfaces.end());
  std::set<std::string> found;
  for (const auto& item : json.items()) found.insert(item.key());
  EXPECT_THAT(found, ::testing::IsSupersetOf(keys->second));
}

}  // namespace sysid
