#include "sysid/io/csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/error_text.h"
#include "tests/sysid/io/read_columns.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsNan;

CsvFile File(const std::string& text) { return CsvFile("run.csv", text); }

Table Read(const std::string& text, const std::vector<int>& wanted) {
  return ReadColumns(File(text), wanted);
}

std::string ReadError(const std::string& text, const std::vector<int>& wanted) {
  return ErrorText([&] { Read(text, wanted); });
}

TEST(CsvTest, ReadsHeaderNumbersAndLineNumbers) {
  CsvFile file = File("# made by hand\nt,a, b \n0,1,2\n\n1,3,4\n\n");
  EXPECT_THAT(file.header(), ElementsAre("t", "a", "b"));
  EXPECT_EQ(file.HeaderPlace(0), "run.csv:2:1");
  const Table table = ReadColumns(file, {0, 2});
  EXPECT_EQ(file.Place(0, 2), "run.csv:3:3");
  EXPECT_EQ(file.Place(1, 0), "run.csv:5:1");
  EXPECT_EQ(file.RowName(1), "line 5");
  EXPECT_THAT(table.columns[0], ElementsAre(0, 1));
  EXPECT_THAT(table.columns[1], ElementsAre(2, 4));
}

TEST(CsvTest, TakesEveryKindOfLineEnd) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    CsvFile file = File("t,a" + end + "# c" + end + "0,1" + end + "1,2");
    const Table table = ReadColumns(file, {0, 1});
    EXPECT_EQ(file.RowName(0), "line 3");
    EXPECT_EQ(file.RowName(1), "line 4");
    EXPECT_THAT(table.columns[1], ElementsAre(1, 2));
  }
}

TEST(CsvTest, DropsTheByteOrderMark) {
  EXPECT_THAT(File("\xEF\xBB\xBFt,a\n0,1\n").header(), ElementsAre("t", "a"));
}

TEST(CsvTest, ReadsQuotedCells) {
  CsvFile file = File(
      "\"t\",\"a, \"\"b\"\"\",c\n\"0\",\"1.5\",\"two\nlines\"\n1, \"2\" ,x\n");
  EXPECT_THAT(file.header(), ElementsAre("t", "a, \"b\"", "c"));
  const Table table = ReadColumns(file, {0, 1});
  EXPECT_THAT(table.columns[1], ElementsAre(1.5, 2));
  EXPECT_EQ(file.RowName(0), "line 2");
  EXPECT_EQ(file.RowName(1), "line 4");
}

TEST(CsvTest, ReadsEveryFormOfNumber) {
  const Table table = Read("a\n-1.5e-3\n+2\n .5\n1E3\n1e-999\nnan\nNaN\n", {0});
  EXPECT_THAT(table.columns[0],
              ElementsAre(-1.5e-3, 2, 0.5, 1000, 0, IsNan(), IsNan()));
  EXPECT_THAT(Read("a,b\n1,\n,2\n", {0, 1}).columns[1],
              ElementsAre(IsNan(), 2));
}

TEST(CsvTest, ReadsAColumnTwiceWhereItIsAskedTwice) {
  const Table table = Read("a,b\n1,2\n3,4\n", {1, 1});
  EXPECT_THAT(table.columns[0], ElementsAre(2, 4));
  EXPECT_THAT(table.columns[1], ElementsAre(2, 4));
}

TEST(CsvTest, IgnoresTextInColumnsThatAreNotWanted) {
  EXPECT_THAT(Read("t,note\n0,hello\n1,inf\n", {0}).columns[0],
              ElementsAre(0, 1));
}

TEST(CsvTest, ReportsTextInANumberWithLineFieldAndName) {
  EXPECT_EQ(ReadError("t,a\n0,1\n1,1.2.3\n", {0, 1}),
            "run.csv:3:2: '1.2.3' in column 'a' is not a number\n"
            "  hint: a number looks like -1.5e-3; leave the cell empty where "
            "nothing was measured");
  EXPECT_THAT(ReadError("t,a\n0,0x10\n", {0, 1}),
              ::testing::HasSubstr("run.csv:2:2: '0x10' in column 'a' is not"));
}

TEST(CsvTest, TakesARowOfUnits) {
  for (const std::string header : {"t,a", "t;a", "t\ta", "t a", "# c\n\nt,a"}) {
    const char separator = header[header.size() - 2];
    const std::string rows =
        std::string("\n0") + separator + "1\n1" + separator + "2\n";
    for (const std::string unit : {"deg", "[\u00b0]", "(rad)"}) {
      CsvFile file = File(header + "\ns" + separator + unit + rows);
      EXPECT_THAT(file.units(), ElementsAre("s", unit));
      EXPECT_THAT(ReadColumns(file, {0, 1}).columns[1], ElementsAre(1, 2));
    }
    // Words that are no units.
    const std::string line = header[0] == '#' ? "4" : "2";
    EXPECT_EQ(ReadError(header + "\ns" + separator + "oops" + rows, {0, 1}),
              "run.csv:" + line +
                  ":1: 's' in column 't' is not a number, nor is any cell of "
                  "this row: are they units?\n"
                  "  hint: delete line " +
                  line +
                  "; what is not in SI is mapped by --columns "
                  "joint1.q=column*factor");
  }
}

TEST(CsvTest, TextAmongNumbersIsNoRowOfUnits) {
  for (const std::string text : {"t,a\ns,1\n", "t,a\n0,1\ns,rad\n"}) {
    EXPECT_THAT(ReadError(text, {0, 1}),
                ::testing::HasSubstr("is not a number\n"));
  }
}

TEST(CsvTest, ReportsCommentsOfOthers) {
  const auto check = [](const std::string& text) {
    CsvFile file = File(text);
    file.CheckHeader();
    ReadColumns(file, {0, 1});
  };
  for (const std::string text :
       {"% by me\nt,a\n0,1\n", "% by me, twice\n% on 3, 4\nt,a\n0,1\n",
        "% by me\n\n# so\nt a\n0 1\n"}) {
    EXPECT_EQ(ErrorText([&] { check(text); }),
              "run.csv:1:1: this line begins with '%', and is no header\n"
              "  hint: if this line is a comment, begin it with '#', not '%'");
  }
  EXPECT_EQ(ErrorText([&] { check("t,a\n0,1\n// on\n1,2\n"); }),
            "run.csv:3:1: '// on' in column 't' is not a number\n"
            "  hint: if this line is a comment, begin it with '#', not '//'");
  EXPECT_EQ(ReadError("x,t,a\n% on\n0,1,2\n", {1, 2}),
            "run.csv:2:2: 1 cell, but the header has 3 columns\n"
            "  hint: if this line is a comment, begin it with '#', not '%'");
  check("%duty,t\n0,1\n");
}

TEST(CsvTest, ReportsUtf16) {
  for (const std::string mark : {"\xFF\xFE", "\xFE\xFF"}) {
    EXPECT_EQ(ErrorText([&] { File(mark + std::string("t\0,\0", 4)); }),
              "run.csv: is text in UTF-16, not UTF-8\n"
              "  hint: iconv -f UTF-16 -t UTF-8 FILE > NEW, or save it as "
              "UTF-8");
  }
}

TEST(CsvTest, ReportsAnInfiniteNumber) {
  for (const std::string cell : {"inf", "-Infinity", "1e999"}) {
    EXPECT_EQ(ReadError("t,a\n0," + cell + "\n", {0, 1}),
              "run.csv:2:2: '" + cell +
                  "' in column 'a' is not finite\n"
                  "  hint: leave the cell empty where nothing was measured");
  }
}

TEST(CsvTest, ReportsARowOfAnotherLength) {
  EXPECT_EQ(ReadError("t,a,b\n0,1,2\n1,2\n", {0}),
            "run.csv:3:3: 2 cells, but the header has 3 columns\n"
            "  hint: the row ends before column 'b'; is the file cut off?");
  EXPECT_EQ(ReadError("t\n0,5\n", {0}),
            "run.csv:2:2: 2 cells, but the header has 1 column\n"
            "  hint: is there a comma too many, or a decimal comma?");
}

TEST(CsvTest, ReportsAColumnNameThatAppearsTwice) {
  EXPECT_EQ(ErrorText([] { File("t,a,b,a\n0,1,2,3\n"); }),
            "run.csv:1:4: column 'a' appears twice: it is field 2 too\n"
            "  hint: rename or remove one of them");
  EXPECT_THAT(File("t,,\n0,1,2\n").header(), ElementsAre("t", "", ""));
}

TEST(CsvTest, ReportsTooManyColumns) {
  std::string header = "c0";
  for (int i = 1; i < 10001; ++i) header += ",c" + std::to_string(i);
  EXPECT_EQ(
      ErrorText([&] { File(header + "\n"); }),
      "run.csv:1:10001: 10001 columns; 10000 are the most\n"
      "  hint: is this a run, with a row a sample? Keep the columns that are "
      "used");
}

TEST(CsvTest, ReportsAnEmptyFile) {
  const std::string hint =
      "\n  hint: a run is a header such as t,joint1.q and a row a sample";
  EXPECT_EQ(ErrorText([] { File(""); }),
            "run.csv:1:1: the file is empty" + hint);
  EXPECT_EQ(ErrorText([] { File("\xEF\xBB\xBF"); }),
            "run.csv:1:1: the file is empty" + hint);
  EXPECT_EQ(ErrorText([] { File("# only this\n \n"); }),
            "run.csv:1:1: the file has no header and no rows, only comments or "
            "blanks" +
                hint);
}

TEST(CsvTest, ReportsAQuotationMarkThatIsNotClosed) {
  EXPECT_EQ(ReadError("t,a\n0,\"1\n1,2\n", {0, 1}),
            "run.csv:2:2: a quotation mark that is not closed: \"1\n"
            "  hint: close it, or drop the quotation marks");
}

TEST(CsvTest, ReportsAnEndlessLine) {
  const std::string text =
      "run.csv:2:1: a line of more than 1 MiB\n"
      "  hint: this is not a separated text with one row a line";
  EXPECT_EQ(ReadError("a\n" + std::string((1 << 20) + 1, '1'), {0}), text);
  EXPECT_EQ(ReadError("a\n\"" + std::string((1 << 20) + 1, '1') + "\"", {0}),
            text);
}

TEST(CsvTest, NumbersColumnsWithoutAHeader) {
  for (const char* text :
       {"0,1.5,nan\n", "0,0,0\n", "0\t0\t0\n", "2024-05-01 12:00:00.5,1,2\n",
        "0;1,5;2\n1;1,5;2\n"}) {
    CsvFile file = File(text);
    EXPECT_THAT(file.header(), ElementsAre("#1", "#2", "#3"));
    EXPECT_THAT(file.no_header(), ::testing::StartsWith("there is no header"));
  }
  EXPECT_EQ(File("t,1\n").no_header(), "");
  const auto table = Read("0,1\n2,3\n4,5\n", {0, 1});
  EXPECT_THAT(table.columns[0], ElementsAre(0, 2, 4));
  EXPECT_THAT(table.columns[1], ElementsAre(1, 3, 5));
}

TEST(CsvTest, ReadsDatesInSeconds) {
  const auto table = Read(
      "t,a\n1970-01-02 00:00:01.5,1\n1970-01-02T01:00:00Z,2\n"
      "02.01.1970 02:00:00,3\n1970-01-02T05:00:00+02:00,4\n",
      {0});
  EXPECT_THAT(table.columns[0], ElementsAre(86401.5, 90000, 93600, 97200));
  EXPECT_THAT(ReadError("t,a\n1970-13-02 00:00:01,1\n", {0}),
              ::testing::HasSubstr("is not a number"));
}

TEST(CsvTest, ReportsFilesThatCannotBeRead) {
  EXPECT_EQ(ErrorText([] { CsvFile("/nowhere/run.csv"); }),
            "/nowhere/run.csv: there is no such file\n"
            "  hint: check the name and the folder that you are in");
  EXPECT_EQ(ErrorText([] { CsvFile("/tmp"); }),
            "/tmp: is a folder, not a file\n  hint: name a file in it");
  EXPECT_EQ(ErrorText([] { CsvFile("/dev/zero"); }),
            "/dev/zero: is not a text file: it holds a NUL byte\n"
            "  hint: save it as text in UTF-8");
  EXPECT_EQ(ErrorText([] { CsvFile("/dev/null/run.csv"); }),
            "/dev/null/run.csv: cannot be opened: Not a directory");
}

TEST(CsvTest, ShowsCellsSafely) {
  EXPECT_EQ(Shown("a\x1b[31mb"), "'a?[31mb'");
  EXPECT_EQ(Shown(std::string(50, 'x')), "'" + std::string(40, 'x') + "...'");
}

TEST(CsvTest, WritesCellsThatReadBack) {
  for (const std::string text : {"a", "a,b", "say \"a\"", " a "}) {
    CsvFile file = File(CsvCell(text) + ",x\n");
    EXPECT_EQ(file.header()[0], std::string(Trim(text)));
  }
  EXPECT_EQ(ShortestText(0.1), "0.1");
  EXPECT_EQ(std::stod(ShortestText(1.0 / 3.0)), 1.0 / 3.0);
}

}  // namespace
}  // namespace sysid
