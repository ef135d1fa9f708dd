#include "sysid/io/mat_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <matio.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "models/error.h"
#include "sysid/io/read_run.h"
#include "tests/support/error_text.h"
#include "tests/sysid/io/chain.h"
#include "tests/sysid/io/read_columns.h"
#include "tests/sysid/io/scratch_file.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

matvar_t* Matrix(const char* name, size_t rows, size_t columns,
                 std::vector<double> numbers) {
  size_t dims[2] = {rows, columns};
  return Mat_VarCreate(name, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims,
                       numbers.data(), 0);
}

struct Kind {
  mat_ft version;
  matio_compression compression;
};

// Writes a file with the variables that `fill` puts into it.
void WriteMat(const std::string& path, Kind kind,
              const std::vector<matvar_t*>& variables) {
  mat_t* const file = Mat_CreateVer(path.c_str(), nullptr, kind.version);
  ASSERT_NE(file, nullptr);
  for (matvar_t* const v : variables) {
    EXPECT_EQ(Mat_VarWrite(file, v, kind.compression), 0);
    Mat_VarFree(v);
  }
  Mat_Close(file);
}

std::string Bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(in), {});
}

class MatFileTest : public testing::TestWithParam<Kind> {
 protected:
  void Write(const std::vector<matvar_t*>& variables) {
    WriteMat(file_.path(), GetParam(), variables);
  }
  std::unique_ptr<TableFile> Open() { return OpenTable(file_.path()); }

  ScratchFile file_{"run.mat"};
};

TEST_P(MatFileTest, ReadsVectorsAndMatricesByTheirNames) {
  int8_t small[3] = {-1, 0, 1};
  size_t dims[2] = {3, 1};
  // In the order of their names, which is that of version 7.3.
  Write({Mat_VarCreate("i", MAT_C_INT8, MAT_T_INT8, 2, dims, small, 0),
         Matrix("m", 1, 1, {5}), Matrix("pos", 3, 2, {1, 2, 3, 4, 5, 6}),
         Matrix("t", 1, 3, {0, 0.5, 1}),
         Matrix("wide", 2, 3, {1, 2, 3, 4, 5, 6})});
  const auto file = Open();
  EXPECT_THAT(file->header(), ElementsAre("i", "m", "pos(:,1)", "pos(:,2)", "t",
                                          "wide(1,:)", "wide(2,:)"));
  const Table table = ReadColumns(*file, {4, 3, 5, 6, 0});
  EXPECT_THAT(table.columns[0], ElementsAre(0, 0.5, 1));
  EXPECT_THAT(table.columns[1], ElementsAre(4, 5, 6));
  EXPECT_THAT(table.columns[2], ElementsAre(1, 3, 5));
  EXPECT_THAT(table.columns[3], ElementsAre(2, 4, 6));
  EXPECT_THAT(table.columns[4], ElementsAre(-1, 0, 1));
  EXPECT_EQ(file->Place(1, 3), file_.path() + ":pos(:,2): sample 2");
}

TEST_P(MatFileTest, ReadsARun) {
  Write({Matrix("t", 3, 1, {0, 0.5, 1}),
         Matrix("pos", 3, 2, {0, 90, NAN, 4, 5, 6})});
  const sysid::Run run = ReadRun(
      file_.path(),
      ParseColumnMap("joint1.q=pos(:,1)*0.0174532925,joint2.q=pos(:,2)*1"),
      Hinges(), nullptr);
  EXPECT_NEAR(run.channels[0].values(1, 0), 1.5707963, 1e-6);
  EXPECT_TRUE(std::isnan(run.channels[0].values(2, 0)));
  EXPECT_EQ(run.channels[1].values(2, 0), 6.0);
}

TEST_P(MatFileTest, ReadsStructures) {
  const char* fields[] = {"Time", "Data"};
  size_t one[2] = {1, 1}, two[2] = {1, 2};
  matvar_t* const log = Mat_VarCreateStruct("log", 2, one, fields, 2);
  Mat_VarSetStructFieldByName(log, "Time", 0, Matrix("Time", 2, 1, {0, 1}));
  Mat_VarSetStructFieldByName(log, "Data", 0,
                              Matrix("Data", 2, 2, {1, 2, 3, 4}));
  const char* value[] = {"v"};
  matvar_t* const array = Mat_VarCreateStruct("y", 2, two, value, 1);
  Mat_VarSetStructFieldByName(array, "v", 0, Matrix("v", 2, 1, {5, 6}));
  Mat_VarSetStructFieldByName(array, "v", 1, Matrix("v", 2, 1, {7, 8}));
  Write({log, array});
  const auto file = Open();
  EXPECT_THAT(file->header(), ElementsAre("log.Time", "log.Data(:,1)",
                                          "log.Data(:,2)", "y(1).v", "y(2).v"));
  const Table table = ReadColumns(*file, {0, 2, 4});
  EXPECT_THAT(table.columns[0], ElementsAre(0, 1));
  EXPECT_THAT(table.columns[1], ElementsAre(3, 4));
  EXPECT_THAT(table.columns[2], ElementsAre(7, 8));
}

TEST_P(MatFileTest, LeavesOutWhatIsNoArrayOfNumbers) {
  size_t dims[2] = {1, 5};
  char text[] = "hello";
  Write({Mat_VarCreate("note", MAT_C_CHAR, MAT_T_UINT8, 2, dims, text, 0),
         Matrix("t", 2, 1, {0, 1})});
  const auto file = Open();
  EXPECT_THAT(file->header(), ElementsAre("t"));
  EXPECT_THAT(file->notices(),
              ElementsAre("left out what is no array of real numbers: note"));
}

// A data element: MAT-File Format, MathWorks, chapter 1.
std::string Element(char type, std::string data) {
  std::string tag(8, '\0');
  tag[0] = type;
  tag[4] = static_cast<char>(data.size());
  data.resize((data.size() + 7) / 8 * 8);
  return tag + data;
}

std::string Flags(char array_class) {
  return Element(6, std::string({array_class, 0, 0, 0, 0, 0, 0, 0}));
}

// As MATLAB saves a timeseries: a variable without dimensions, and after all
// variables the objects' bytes, without a name.
TEST(MatFileObjectTest, LeavesOutObjects) {
  const ScratchFile plain("plain.mat"), file("run.mat");
  WriteMat(plain.path(), {MAT_FT_MAT5, MAT_COMPRESSION_NONE},
           {Matrix("t", 2, 1, {0, 1}), Matrix("q", 2, 1, {5, 6})});
  const std::string object = Element(
      14, Flags(17) + Element(1, "ts") + Element(1, "MCOS") +
              Element(1, "timeseries") +
              Element(14, Flags(13) +
                              Element(5, std::string("\1\0\0\0\1\0\0\0", 8)) +
                              Element(1, "") + Element(6, "abcd")));
  const std::string data =
      Element(14, Flags(9) + Element(5, std::string("\1\0\0\0\4\0\0\0", 8)) +
                      Element(1, "") + Element(2, "data"));
  const std::string all = Bytes(plain.path());
  const size_t second = 128 + (all.size() - 128) / 2;
  std::ofstream(file.path(), std::ios::binary)
      << all.substr(0, second) << object << all.substr(second) << object
      << data;
  const auto table = OpenTable(file.path());
  EXPECT_THAT(table->header(), ElementsAre("t", "q"));
  EXPECT_THAT(table->notices(),
              ElementsAre("left out what is no array of real numbers: 2 "
                          "objects (timeseries, table, string, ...)"));
  EXPECT_THAT(ReadColumns(*table, {0, 1}).columns[1], ElementsAre(5, 6));
}

TEST_P(MatFileTest, LeavesOutCells) {
  size_t two[2] = {2, 1};
  matvar_t* const cell =
      Mat_VarCreate("c", MAT_C_CELL, MAT_T_CELL, 2, two, nullptr, 0);
  Mat_VarSetCell(cell, 0, Matrix("", 2, 1, {0, 1}));
  Mat_VarSetCell(cell, 1, Matrix("", 2, 1, {0, 1}));
  const char* fields[] = {"q", "c"};
  size_t one[2] = {1, 1};
  matvar_t* const log = Mat_VarCreateStruct("log", 2, one, fields, 2);
  Mat_VarSetStructFieldByName(log, "q", 0, Matrix("q", 2, 1, {3, 4}));
  matvar_t* const inner =
      Mat_VarCreate("c", MAT_C_CELL, MAT_T_CELL, 2, one, nullptr, 0);
  Mat_VarSetCell(inner, 0, Matrix("", 2, 1, {0, 1}));
  Mat_VarSetStructFieldByName(log, "c", 0, inner);
  Write({Matrix("t", 2, 1, {0, 1}), cell, log});
  const auto file = Open();
  EXPECT_THAT(file->header(), UnorderedElementsAre("t", "log.q"));
  EXPECT_THAT(
      file->notices(),
      ElementsAre("left out what is no array of real numbers: c, log.c"));
}

TEST_P(MatFileTest, ReportsColumnsOfOtherLengths) {
  Write({Matrix("q", 2, 1, {0, 1}), Matrix("t", 3, 1, {0, 1, 2})});
  EXPECT_EQ(ErrorText([&] {
              ReadColumns(*Open(), {0, 1});
            }),
            file_.path() +
                ":t: has 3 samples, but 'q' 2\n"
                "  hint: columns that are read together have one length");
  EXPECT_THAT(ReadColumns(*Open(), {0}).columns[0], ElementsAre(0, 1));
}

TEST_P(MatFileTest, ReportsAnInfiniteNumber) {
  Write({Matrix("t", 3, 1, {0, INFINITY, 2})});
  EXPECT_EQ(ErrorText([&] { ReadColumns(*Open(), {0}); }),
            file_.path() +
                ":t: sample 2: is not finite\n"
                "  hint: NaN is a missing measurement");
}

TEST_P(MatFileTest, ReportsAFileWithoutNumbers) {
  size_t dims[2] = {1, 5};
  char text[] = "hello";
  Write({Mat_VarCreate("note", MAT_C_CHAR, MAT_T_UINT8, 2, dims, text, 0)});
  EXPECT_EQ(ErrorText([&] { Open(); }),
            file_.path() +
                ": holds no arrays of real numbers\n"
                "  hint: it has note; save vectors and matrices, such as t = "
                "ts.Time; q = ts.Data");
}

TEST_P(MatFileTest, ReportsAFileThatIsCut) {
  std::vector<double> numbers(1000);
  std::iota(numbers.begin(), numbers.end(), 0.5);
  Write({Matrix("t", 1000, 1, numbers), Matrix("q", 1000, 1, numbers)});
  const std::string bytes = Bytes(file_.path());
  Open();
  for (const size_t size : {size_t{20}, size_t{131}, bytes.size() / 3,
                            bytes.size() * 3 / 4, bytes.size() - 1}) {
    std::ofstream(file_.path(), std::ios::binary) << bytes.substr(0, size);
    const std::string error = ErrorText([&] { Open(); });
    EXPECT_THAT(error,
                HasSubstr(file_.path() + ": is cut off: it has " +
                          std::to_string(size) + " bytes, and should have "));
    EXPECT_THAT(error, HasSubstr(" or more\n  hint: copy it again, or save it "
                                 "again; was the disk full?"));
  }
}

// As a machine of the other byte order writes it.
TEST(MatFileCutTest, KnowsTheLengthOfAForeignByteOrder) {
  std::string bytes = "MATLAB 5.0 MAT-file";
  bytes.resize(124, ' ');
  bytes += std::string("\1\0MI\0\0\0\16\0\0\1\0", 12);
  const ScratchFile file("run.mat");
  std::ofstream(file.path(), std::ios::binary) << bytes;
  EXPECT_THAT(ErrorText([&] { OpenTable(file.path()); }),
              HasSubstr("it has 136 bytes, and should have 392 or more"));
}

INSTANTIATE_TEST_SUITE_P(
    Versions, MatFileTest,
    testing::Values(Kind{MAT_FT_MAT5, MAT_COMPRESSION_NONE},
                    Kind{MAT_FT_MAT5, MAT_COMPRESSION_ZLIB},
                    Kind{MAT_FT_MAT73, MAT_COMPRESSION_NONE},
                    Kind{MAT_FT_MAT73, MAT_COMPRESSION_ZLIB}));

TEST(MatFileSizeTest, RefusesWhatTheFileCannotHold) {
  const ScratchFile file("run.mat");
  WriteMat(file.path(), {MAT_FT_MAT5, MAT_COMPRESSION_NONE},
           {Matrix("t", 3, 1, {0, 1, 2})});
  std::string bytes = Bytes(file.path());
  // The tag of the array, its flags (16 bytes), the tag of its dimensions.
  const size_t dims = 128 + 8 + 16 + 8;
  ASSERT_EQ(bytes[dims], 3);
  bytes[dims + 3] = 0x40;
  std::ofstream(file.path(), std::ios::binary) << bytes;
  EXPECT_EQ(ErrorText([&] { OpenTable(file.path()); }),
            file.path() +
                ":t: claims 1073741827 x 1 numbers, more than a file of " +
                std::to_string(bytes.size()) +
                " bytes can hold\n"
                "  hint: is it damaged? Save it again, by save('run.mat')");
}

// Cuts and random bytes: read, or refused in our words. matio and HDF5 crash on
// some of them, and hang on others.
TEST(MatFileSizeTest, SurvivesDamage) {
  for (const Kind kind : {Kind{MAT_FT_MAT5, MAT_COMPRESSION_NONE},
                          Kind{MAT_FT_MAT73, MAT_COMPRESSION_NONE}}) {
    const ScratchFile file("run.mat");
    WriteMat(file.path(), kind,
             {Matrix("pos", 5, 2, {1, 2, 3, 4, 5, 6, 7, 8, 9, 0}),
              Matrix("t", 5, 1, {0, 1, 2, 3, 4})});
    const std::string bytes = Bytes(file.path());
    std::mt19937 random(1);
    int refused = 0;
    for (int i = 0; i < 100; ++i) {
      std::string damaged = bytes;
      if (i % 4 == 0) damaged.resize(random() % bytes.size());
      for (int k = 0; k < 3 && damaged.size() > 128; ++k) {
        damaged[128 + random() % (damaged.size() - 128)] =
            static_cast<char>(random());
      }
      std::ofstream(file.path(), std::ios::binary) << damaged;
      try {
        ReadColumns(*OpenTable(file.path()), {0});
      } catch (const InputError&) {
        ++refused;
      }
    }
    EXPECT_GT(refused, 10);
  }
}

}  // namespace
}  // namespace sysid
