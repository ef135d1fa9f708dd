// The contract of every format: the same run, whatever it is written in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "sysid/io/read_run.h"
#include "sysid/io/table_file.h"
#include "tests/support/error_text.h"
#include "tests/sysid/io/bag_writer.h"
#include "tests/sysid/io/chain.h"
#include "tests/sysid/io/scratch_file.h"
#ifdef SYSID_TEST_MATIO
#include <matio.h>
#endif

namespace sysid {
namespace {

using ::testing::HasSubstr;

constexpr int kRows = 20;
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// t, joint1.q (missing in row 3), joint2.q, joint1.tau. Binary fractions, so
// that every format holds them to the last bit.
std::vector<double> Row(int k) {
  return {0.25 * k, k == 3 ? kMissing : 0.5 * k - 2.0, 1.0 - 0.125 * k,
          k % 2 ? 0.75 : -1.5};
}

std::string Text(char separator, char point) {
  const std::string s(1, separator);
  std::string text = "t" + s + "joint1.q" + s + "joint2.q" + s + "joint1.tau\n";
  for (int k = 0; k < kRows; ++k) {
    std::string row;
    for (const double value : Row(k)) {
      // Between spaces nothing can be empty.
      std::string cell = std::isnan(value) ? (separator == ' ' ? "nan" : "")
                                           : std::to_string(value);
      for (char& c : cell) c = c == '.' ? point : c;
      row += (row.empty() ? "" : s) + cell;
    }
    text += row + "\n";
  }
  return text;
}

std::string Bag() {
  using W = BagWriter;
  std::string records = W::Connection(0, "/js", "sensor_msgs/JointState");
  for (int k = 0; k < kRows; ++k) {
    const std::vector<double> row = Row(k);
    const int ns = static_cast<int>((k % 4) * 250000000);
    records += W::Message(0, 100 + k,
                          W::JointState(50 + k / 4, ns, {"joint1", "joint2"},
                                        {row[1], row[2]}, {}, {row[3], 0.0}));
  }
  return W::Bag(W::Chunk("none", records, records.size()));
}

struct Format {
  std::string name;
  std::function<void(const std::string& path)> write;
  std::string columns;  // --columns
};

void PrintTo(const Format& format, std::ostream* out) { *out << format.name; }

std::vector<Format> Formats() {
  const auto file = [](const std::string& bytes) {
    return [bytes](const std::string& path) {
      std::ofstream(path, std::ios::binary) << bytes;
    };
  };
  std::vector<Format> formats = {{"commas", file(Text(',', '.')), ""},
                                 {"semicolons", file(Text(';', ',')), ""},
                                 {"tabs", file(Text('\t', ',')), ""},
                                 {"spaces", file(Text(' ', '.')), ""},
                                 {"bag", file(Bag()), ""}};
#ifdef SYSID_TEST_MATIO
  formats.push_back(
      {"matlab",
       [](const std::string& path) {
         mat_t* const mat = Mat_CreateVer(path.c_str(), nullptr, MAT_FT_MAT5);
         std::vector<double> numbers(4 * kRows);
         for (int k = 0; k < kRows; ++k) {
           for (int i = 0; i < 4; ++i) numbers[i * kRows + k] = Row(k)[i];
         }
         size_t dims[2] = {kRows, 4};
         matvar_t* const v = Mat_VarCreate("log", MAT_C_DOUBLE, MAT_T_DOUBLE, 2,
                                           dims, numbers.data(), 0);
         EXPECT_EQ(Mat_VarWrite(mat, v, MAT_COMPRESSION_ZLIB), 0);
         Mat_VarFree(v);
         Mat_Close(mat);
       },
       "t=log(:,1),joint1.q=log(:,2),joint2.q=log(:,3),joint1.tau=log(:,4)"});
#endif
  return formats;
}

class OpenTableTest : public testing::TestWithParam<Format> {};

TEST_P(OpenTableTest, GivesTheSameRun) {
  // The name says nothing.
  const ScratchFile file("run.data");
  GetParam().write(file.path());
  const sysid::Run run = ReadRun(
      file.path(), ParseColumnMap(GetParam().columns), Hinges(), nullptr);
  EXPECT_EQ(run.name, file.path());
  ASSERT_EQ(run.size(), kRows);
  ASSERT_EQ(run.channels.size(), 2u);
  for (int k = 0; k < kRows; ++k) {
    const std::vector<double> row = Row(k);
    EXPECT_EQ(run.t[k], row[0]);
    const double q = run.channels[0].values(k, 0);
    EXPECT_TRUE(q == row[1] || (std::isnan(q) && std::isnan(row[1]))) << k;
    EXPECT_EQ(run.channels[1].values(k, 0), row[2]);
    EXPECT_EQ(run.effort(k, 0), row[3]);
    EXPECT_EQ(run.effort(k, 1), 0.0);
  }
}

TEST_P(OpenTableTest, ReportsAColumnThatIsNotThere) {
  const ScratchFile file("run.data");
  GetParam().write(file.path());
  EXPECT_THAT(ErrorText([&] {
                ReadRun(file.path(),
                        ParseColumnMap(GetParam().columns.empty()
                                           ? "t=joint3.q"
                                           : "t=joint3.q,joint1.q=log(:,2)"),
                        Hinges(), nullptr);
              }),
              HasSubstr("has no column 'joint3.q' (for 't'"));
}

INSTANTIATE_TEST_SUITE_P(Formats, OpenTableTest, testing::ValuesIn(Formats()),
                         [](const auto& info) { return info.param.name; });

TEST(OpenTablePipeTest, TextMayBeAPipeAndBagsMayNot) {
  // The reader may be gone before the writer has written.
  signal(SIGPIPE, SIG_IGN);
  for (const bool is_bag : {false, true}) {
    const ScratchFile place("pipe");
    std::filesystem::remove(place.path());
    ASSERT_EQ(mkfifo(place.path().c_str(), 0600), 0);
    std::thread writer([&] {
      std::ofstream(place.path(), std::ios::binary)
          << (is_bag ? Bag().substr(0, 1000) : Text(',', '.'));
    });
    const std::string text =
        ErrorText([&] { ReadRun(place.path(), {}, Hinges(), nullptr); });
    writer.join();
    EXPECT_EQ(text, is_bag ? place.path() +
                                 ": is a ROS bag, which cannot be a pipe\n"
                                 "  hint: save it as a file"
                           : "no error");
  }
}

TEST(OpenTableTopicTest, OnlyBagsHaveTopics) {
  const ScratchFile file("text.bag", Text(',', '.'));
  EXPECT_EQ(ErrorText([&] { OpenTable(file.path() + ":/js"); }),
            file.path() +
                ":/js: is no ROS bag, and has no topics\n"
                "  hint: name it without ':/js'");
  EXPECT_EQ(ErrorText([] { OpenTable("/nowhere/run.bag:/js"); }),
            "/nowhere/run.bag: there is no such file\n"
            "  hint: check the name and the folder that you are in");
}

}  // namespace
}  // namespace sysid
