#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/program_folder.h"

// What the tests of the programs share. SYSID_COMPARE, SYSID_DIAGNOSE,
// SYSID_FIT and SYSID_SIMULATE are the programs' files, SYSID_SOURCE the
// project's folder, SYSID_PAGE_MISSING says why this build makes no
// report.html (empty: it does); all from CMake.

namespace sysid {

// Two rods that swing about y: their inertia shows.
inline constexpr char kRods[] = R"(<robot name="rods"><link name="base"/>
<joint name="joint1" type="continuous"><parent link="base"/>
<child link="link1"/><axis xyz="0 1 0"/></joint>
<link name="link1"><inertial><origin xyz="0 0 -0.25"/><mass value="1"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.001"/>
</inertial></link>
<joint name="joint2" type="continuous"><origin xyz="0 0 -0.5"/>
<parent link="link1"/><child link="link2"/><axis xyz="0 1 0"/></joint>
<link name="link2"><inertial><origin xyz="0 0 -0.25"/><mass value="1"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.001"/>
</inertial></link></robot>)";

using Arguments = std::vector<std::string>;

// What a program says on standard error of a report.html that it cannot write.
inline std::string NoReportNote() {
  const std::string missing = SYSID_PAGE_MISSING;
  return missing.empty() ? "" : "note: no report.html: " + missing + "\n";
}

// That a folder has a report.html with the document of this schema in it, or
// none where the build has no page.
inline void ExpectReport(const ProgramFolder& folder, const std::string& file,
                         const std::string& program) {
  ASSERT_EQ(folder.Has(file), NoReportNote().empty());
  if (!folder.Has(file)) return;
  const std::string html = folder.Read(file);
  EXPECT_THAT(html, ::testing::StartsWith("<!doctype html>"));
  EXPECT_THAT(html, ::testing::HasSubstr(
                        "<script id=\"page-data\" type=\"application/json\">{"
                        "\"schema\":\"sysid.page/1\",\"program\":\"" +
                        program + "\""));
  EXPECT_LT(html.size(), 3u << 20);
}

inline Arguments operator+(Arguments a, const Arguments& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// A run by sysid_simulate, in the folder as `name`.
inline void SimulateInto(const ProgramFolder& folder, const std::string& name,
                         const Arguments& arguments) {
  const ProgramResult result =
      folder.Run(SYSID_SIMULATE, arguments + Arguments{"--out_csv", name});
  ASSERT_EQ(result.exit_code, 0) << result.err;
}

// That a program refuses its input as docs/interface.md section 1 demands: exit
// code 2; the place, what is wrong and a hint on standard error and nothing
// else; no file made or changed.
inline void ExpectRefused(const ProgramFolder& folder,
                          const std::string& program,
                          const Arguments& arguments, const std::string& place,
                          const std::string& what, const std::string& hint) {
  SCOPED_TRACE(::testing::PrintToString(arguments));
  const auto before = folder.Contents();
  const ProgramResult result = folder.Run(program, arguments);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, ::testing::StartsWith("error: " + place + ": "));
  EXPECT_THAT(result.err, ::testing::HasSubstr(what));
  const size_t at = result.err.find("\n  hint: ");
  ASSERT_NE(at, std::string::npos) << result.err;
  EXPECT_THAT(result.err.substr(at), ::testing::HasSubstr(hint));
  EXPECT_EQ(result.err.find("***"), std::string::npos);  // glog's stack trace
  EXPECT_EQ(result.err.find("\033"), std::string::npos);
  EXPECT_EQ(folder.Contents(), before);
}

// Of sysid_fit, asked for every output; fit.json is there already.
inline void ExpectFitRefused(const ProgramFolder& folder,
                             const Arguments& arguments,
                             const std::string& place, const std::string& what,
                             const std::string& hint) {
  Arguments all = arguments;
  const auto add = [&](const std::string& flag, const std::string& value) {
    const bool given = std::any_of(
        arguments.begin(), arguments.end(), [&](const std::string& argument) {
          return argument == flag || argument.rfind(flag + "=", 0) == 0;
        });
    if (!given) all = Arguments{flag, value} + all;
  };
  add("--json", "fit.json");
  add("--out", "result");
  folder.Write("fit.json", "of an earlier fit");
  ExpectRefused(folder, SYSID_FIT, all, place, what, hint);
}

// That --help fits 80 columns and 40 lines, and that its example, the first
// command in it, runs. The example's data/ is the source's.
inline void ExpectHelp(const ProgramFolder& folder, const std::string& program,
                       const std::string& name) {
  const ProgramResult help = folder.Run(program, {"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_EQ(help.err, "");
  std::istringstream lines(help.out);
  std::string line, example;
  int count = 0;
  bool within = false;
  while (std::getline(lines, line)) {
    ++count;
    EXPECT_LE(line.size(), 80u) << line;
    if (example.empty() && line.rfind("  " + name + " ", 0) == 0) within = true;
    within = within && !line.empty();
    if (within) example += line + " ";
  }
  EXPECT_LE(count, 40);
  std::istringstream words(example);
  Arguments arguments;
  for (std::string word; words >> word;) {
    if (word == "\\") continue;  // the line goes on
    if (word.rfind("data/", 0) == 0) {
      word = std::string(SYSID_SOURCE) + "/" + word;
    }
    arguments.push_back(word);
  }
  ASSERT_GT(arguments.size(), 2u);
  arguments.erase(arguments.begin());
  const ProgramResult result = folder.Run(program, arguments);
  EXPECT_EQ(result.exit_code, 0) << example << result.err;
}

}  // namespace sysid
