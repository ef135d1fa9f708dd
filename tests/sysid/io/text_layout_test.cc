#include "sysid/io/text_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "sysid/io/csv.h"
#include "sysid/io/read_run.h"
#include "tests/support/error_text.h"
#include "tests/sysid/io/chain.h"
#include "tests/sysid/io/read_columns.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsNan;

CsvFile File(const std::string& text) { return CsvFile("run.csv", text); }

std::string ReadError(const std::string& text) {
  return ErrorText([&] {
    CsvFile file = File(text);
    std::vector<int> all;
    for (size_t i = 0; i < file.header().size(); ++i) {
      all.push_back(static_cast<int>(i));
    }
    ReadColumns(file, all);
  });
}

// Both columns of a file of two, and what was said.
void ExpectPair(const std::string& text, const std::vector<double>& a,
                const std::vector<double>& b,
                const std::vector<std::string>& notices) {
  CsvFile file = File(text);
  ASSERT_THAT(file.header(), ElementsAre("t", "q")) << text;
  const Table table = ReadColumns(file, {0, 1});
  EXPECT_EQ(table.columns[0], a) << text;
  EXPECT_EQ(table.columns[1], b) << text;
  EXPECT_EQ(file.notices(), notices) << text;
}

TEST(PlainLayoutTest, FindsTheSeparator) {
  const std::string is = "the columns are separated by ";
  const std::string comma = "the numbers have decimal commas";
  ExpectPair("t,q\n0,1\n", {0}, {1}, {});
  ExpectPair("t;q\n0;1\n1;1.5\n", {0, 1}, {1, 1.5}, {is + "semicolons"});
  ExpectPair("t;q\n0;1\n1;-1,5e-1\n", {0, 1}, {1, -0.15},
             {is + "semicolons", comma});
  ExpectPair("t\tq\n0\t1\n", {0}, {1}, {is + "tabs"});
  ExpectPair("t\tq\t\n0\t1,25\t\n1\t2\n", {0, 1}, {1.25, 2},
             {is + "tabs", comma});
  ExpectPair("t q\n0 1\n", {0}, {1}, {is + "spaces"});
  ExpectPair("  t    q  \n 0.0 \t 1\n10.0     2\n", {0, 10}, {1, 2},
             {is + "spaces"});
  ExpectPair("\"t\";\"q\"\r\n\"0\";\"1,5\"\r\n", {0}, {1.5},
             {is + "semicolons", comma});
  ExpectPair("# made; by, hand\nt;q\n\n0;1\n", {0}, {1}, {is + "semicolons"});
  // Spaces and tabs around commas are not separators.
  ExpectPair("t,\tq\n0,\t1\n", {0}, {1}, {});
  ExpectPair("t , q\n0 , 1\n", {0}, {1}, {});
}

TEST(PlainLayoutTest, ReadsTheExampleOfTheDocumentation) {
  const sysid::Run run = ParseRun(
      "run.csv",
      "# lines that begin with # are comments\n"
      "Zeit;Winkel 1;\"Moment; Motor\"\n0;0,125;1,5\n0,01;0,126;1,5\n",
      ParseColumnMap("t=Zeit,joint1.q=Winkel 1,joint1.tau='Moment; Motor'"),
      Hinges(), nullptr);
  EXPECT_THAT(run.t, ElementsAre(0, 0.01));
  EXPECT_EQ(run.channels[0].values(1, 0), 0.126);
  EXPECT_EQ(run.effort(1, 0), 1.5);
}

TEST(PlainLayoutTest, NamesMayHoldOtherSeparators) {
  EXPECT_THAT(File("t,a;b\n0,1\n").header(), ElementsAre("t", "a;b"));
  EXPECT_THAT(File("t;pos x,y\n0;1\n").header(), ElementsAre("t", "pos x,y"));
  EXPECT_THAT(File("time s\tpos deg\n0\t1\n").header(),
              ElementsAre("time s", "pos deg"));
  EXPECT_THAT(File("pos 1\n5\n").header(), ElementsAre("pos 1"));
  EXPECT_THAT(File("\"pos 1\" t\n5 6\n").header(), ElementsAre("pos 1", "t"));
}

TEST(PlainLayoutTest, ASemicolonFileWithDecimalCommasIsNotSeparatedByCommas) {
  ExpectPair("t;q\n0,5;1,5\n", {0.5}, {1.5},
             {"the columns are separated by semicolons",
              "the numbers have decimal commas"});
  EXPECT_THAT(File("t;a,b\n0,5;1,5\n").header(), ElementsAre("t", "a,b"));
}

TEST(PlainLayoutTest, ReportsWhatCouldBeTwo) {
  EXPECT_EQ(ReadError("t,note;x\n0,hello;2\n"),
            "run.csv:1:1: the columns could be separated by commas or by "
            "semicolons\n"
            "  hint: put names and texts that hold commas or semicolons in "
            "quotation marks");
  EXPECT_EQ(ReadError("t joint angle\n0 1\n"),
            "run.csv:1:1: the rows are separated by spaces, but the header has "
            "3 words and the first row 2 numbers\n"
            "  hint: put names that hold spaces in quotation marks");
}

TEST(PlainLayoutTest, ReportsPointsAmongDecimalCommas) {
  EXPECT_EQ(ReadError("t;q\n0;1,5\n1;1.5\n"),
            "run.csv:3:2: '1.5' in column 'q' has a decimal point, but numbers "
            "before it decimal commas\n"
            "  hint: write one of them throughout");
  EXPECT_EQ(ReadError("t;q\n0;1.5\n1;1,500\n"),
            "run.csv:3:2: '1,500' in column 'q' has a decimal comma, but "
            "numbers before it decimal points\n"
            "  hint: write one of them throughout, and no commas between "
            "thousands");
  for (const std::string cell : {"1,2,3", "1.000,5", "1,", ",x", "1,e5"}) {
    EXPECT_THAT(ReadError("t;q\n0;" + cell + "\n"),
                HasSubstr("'" + cell + "' in column 'q' is not a number"));
  }
  EXPECT_THAT(ReadError("t;q\n0;1,5e999\n"), HasSubstr("is not finite"));
}

TEST(PlainLayoutTest, ReportsRowsOfAnotherLengthInTheirWords) {
  EXPECT_EQ(ReadError("t;q\n0;1\n0;1;2\n"),
            "run.csv:3:3: 3 cells, but the header has 2 columns\n"
            "  hint: is there a semicolon too many?");
  EXPECT_THAT(ReadError("t\tq\n0\t1\n0\t1\t2\n"),
              HasSubstr("is there a tab too many?"));
  EXPECT_THAT(ReadError("t q\n0 1\n0 1 2\n"),
              HasSubstr("is there a text with spaces in it? Put it in "
                        "quotation marks"));
}

TEST(PlainLayoutTest, KnowsACommentThatIsAHeaderByItsSeparator) {
  EXPECT_THAT(ErrorText([] {
                ParseRun("run.csv", "# t joint1.q\n0 1\n1 2\n", {}, Hinges(),
                         nullptr);
              }),
              HasSubstr("the comment 't joint1.q' reads like the header"));
}

// Rows that cross the borders of the blocks that are held.
TEST(PlainLayoutTest, ReadsFarBeyondWhatItHolds) {
  std::string text = "t;note;q\n";
  double sum = 0.0;
  int rows = 0;
  const std::string note(1000, 'x');
  for (; text.size() < 20u << 20; ++rows) {
    text += std::to_string(rows) + ";" +
            (rows % 3 == 0 ? "\"a\n\"\"" + note + "\"" : note) + ";" +
            std::to_string(0.5 * rows) + (rows % 2 ? "\r\n" : "\n");
    sum += 0.5 * rows;
  }
  CsvFile file = File(text);
  const Table table = ReadColumns(file, {2});
  ASSERT_EQ(table.rows(), rows);
  double read = 0.0;
  for (const double q : table.columns[0]) read += q;
  EXPECT_EQ(read, sum);
  // A row in three has two lines.
  EXPECT_EQ(file.RowName(rows - 1),
            "line " + std::to_string(2 + (rows - 1) + (rows + 1) / 3));
}

constexpr char kMotive[] =
    "Format Version,1.23,Take Name,swing,Export Frame Rate,100.000000,Length "
    "Units,Millimeters,Coordinate Space,Global\n"
    "\n"
    ",Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid "
    "Body,Rigid Body,Rigid Body,Rigid Body Marker,Rigid Body Marker,Rigid Body "
    "Marker,Rigid Body Marker,Marker,Marker,Marker,Marker,Marker,Marker\n"
    ",Name,arm,arm,arm,arm,arm,arm,arm,arm,arm:M 1,arm:M 1,arm:M 1,arm:M 1,"
    "arm:M 1,arm:M 1,arm:M 1,tip,tip,tip\n"
    ",ID,1,1,1,1,1,1,1,1,2,2,2,2,3,3,3,4,4,4\n"
    ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean "
    "Marker Error,Position,Position,Position,Marker Quality,Position,Position,"
    "Position,Position,Position,Position\n"
    "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z,,X,Y,Z,X,Y,Z\n"
    "0,0.000000,0,0,0,1,1,2,3,0.1,4,5,6,1,4.1,5.1,6.1,100,200,300\n"
    "1,0.010000,0,0,0,1,1,2,3,0.1,4,5,6,1,,,,110,210,310\n"
    "2,0.020000,0,0,0,1,1,2,3,0.1,4,5,6,1,4.1,5.1,6.1,,,\n";

TEST(MotiveLayoutTest, NamesColumnsByObjectAndAxis) {
  CsvFile file = File(kMotive);
  EXPECT_THAT(
      file.header(),
      ElementsAre("Frame", "t", "arm.Rotation.X", "arm.Rotation.Y",
                  "arm.Rotation.Z", "arm.Rotation.W", "arm.X", "arm.Y", "arm.Z",
                  "arm.Mean Marker Error", "arm:M 1 (Rigid Body Marker).X",
                  "arm:M 1 (Rigid Body Marker).Y",
                  "arm:M 1 (Rigid Body Marker).Z", "arm:M 1.Marker Quality",
                  "arm:M 1 (Marker).X", "arm:M 1 (Marker).Y",
                  "arm:M 1 (Marker).Z", "tip.X", "tip.Y", "tip.Z"));
  const Table table = ReadColumns(file, {1, 14, 19});
  EXPECT_THAT(table.columns[0], ElementsAre(0, 0.01, 0.02));
  EXPECT_THAT(table.columns[1], ElementsAre(4.1, IsNan(), 4.1));
  EXPECT_THAT(table.columns[2], ElementsAre(300, 310, IsNan()));
  EXPECT_THAT(file.notices(),
              ElementsAre("an export of Motive: t is its time, lengths are in "
                          "Millimeters (map them by *0.001), and Y is up "
                          "unless another axis was chosen: tip.px=NAME.X, "
                          "tip.py=-NAME.Z, tip.pz=NAME.Y make z up"));
  EXPECT_EQ(file.HeaderPlace(19), "run.csv:7:20");
  EXPECT_EQ(file.Place(0, 1), "run.csv:8:2");
}

TEST(MotiveLayoutTest, AMarkerIsAFrame) {
  const sysid::Run run =
      ParseRun("run.csv", kMotive,
               ParseColumnMap(
                   "tip.px=tip.X*0.001,tip.py=-tip.Z*0.001,tip.pz=tip.Y*0.001"),
               Hinges(), nullptr);
  ASSERT_EQ(run.channels.size(), 1u);
  EXPECT_EQ(run.channels[0].kind, ChannelKind::kFramePosition);
  EXPECT_EQ(run.channels[0].name, "tip");
  EXPECT_TRUE(run.channels[0].values.row(1).isApprox(
      Eigen::RowVector3d(0.11, -0.31, 0.21), 1e-12));
  EXPECT_TRUE(run.channels[0].values.row(2).array().isNaN().all());
}

TEST(MotiveLayoutTest, HintsAtTheFramesOfAModel) {
  EXPECT_THAT(
      ErrorText([] { ParseRun("run.csv", kMotive, {}, Hinges(), nullptr); }),
      HasSubstr("run.csv:7:1: no column measures anything of chain\n"
                "  hint: a marker is a frame: --columns tip.px=arm.X*0.001,"
                "tip.py=arm.Y*0.001,tip.pz=arm.Z*0.001 if it is in mm and z "
                "is up"));
}

TEST(MotiveLayoutTest, ReadsOtherVersions) {
  // Motive 3 has a row of parents and may have time codes; some files lack the
  // words of the rows.
  EXPECT_THAT(
      File("Format Version,1.25,Length Units,Meters\n\n"
           ",Type,,Marker,Marker,Marker\n"
           ",Name,,\"a, b\",\"a, b\",\"a, b\"\n,ID,,9,9,9\n"
           ",Parent,,,,\n,,,Position,Position,Position\n"
           "Frame,Time (Seconds),TimeCode,X,Y,Z\n0,0,1:2,1,2,3\n")
          .header(),
      ElementsAre("Frame", "t", "TimeCode", "a, b.X", "a, b.Y", "a, b.Z"));
  EXPECT_THAT(File("Format Version,1.23\n\n,,Marker,Marker,Marker\n"
                   ",,a,a,a\n,,1,1,1\n,,Position,Position,Position\n"
                   "Frame,Time (Seconds),X,Y,Z\n")
                  .header(),
              ElementsAre("Frame", "t", "a.X", "a.Y", "a.Z"));
}

TEST(MotiveLayoutTest, ReportsAHeaderThatIsCut) {
  EXPECT_EQ(ReadError("Format Version,1.23\n\n,Type,Marker\n"),
            "run.csv:1:1: an export of Motive without the row \"Frame,Time "
            "(Seconds),...\"\n"
            "  hint: export it again, with the header on");
  EXPECT_THAT(ReadError("Format Version,1.23\nFrame,Time (Seconds),X\n0,0,1\n"),
              HasSubstr("an export of Motive without the row of names"));
}

constexpr char kVicon[] =
    "Trajectories\n100\n,,arm:tip,,,arm:elbow,,\n"
    "Frame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n"
    "51,0,1,2,3,4,5,6\n52,0,1,2,3,,,\n54,0,1,2,3,4,5,6\n";

TEST(ViconLayoutTest, MakesTimeOfTheFrames) {
  CsvFile file = File(kVicon);
  EXPECT_THAT(
      file.header(),
      ElementsAre("Frame", "Sub Frame", "arm:tip.X", "arm:tip.Y", "arm:tip.Z",
                  "arm:elbow.X", "arm:elbow.Y", "arm:elbow.Z", "t"));
  const Table table = ReadColumns(file, {8, 5});
  EXPECT_THAT(table.columns[0], ElementsAre(0.51, 0.52, 0.54));
  EXPECT_THAT(table.columns[1], ElementsAre(4, IsNan(), 4));
  EXPECT_THAT(file.notices(),
              ElementsAre("an export of Nexus: t is Frame / 100 Hz, lengths "
                          "are in mm (map them by *0.001)"));
  EXPECT_EQ(file.Place(1, 8), "run.csv:7:1");
}

TEST(ViconLayoutTest, ReportsWhatItDoesNotRead) {
  EXPECT_EQ(ReadError(std::string(kVicon) + "\nDevices\n1000\n"),
            "run.csv:10:1: 'Devices' in column 'Frame' is not a number\n"
            "  hint: only trajectories are read: export them alone, without "
            "other sections");
  EXPECT_THAT(ReadError("Trajectories\nfast\n"),
              HasSubstr("run.csv:2:1: 'fast' is not a number of frames a "
                        "second"));
  EXPECT_THAT(ReadError("Trajectories\n100\n"),
              HasSubstr("an export of Nexus that ends in its header"));
  EXPECT_THAT(ReadError("Trajectories\n100\n,,a\nTime,X\nmm\n"),
              HasSubstr("without the row \"Frame,Sub Frame,X,Y,Z,...\""));
}

std::string Qualisys(const std::string& columns, const std::string& rows) {
  return "NO_OF_FRAMES\t3\nNO_OF_CAMERAS\t8\nNO_OF_MARKERS\t2\n"
         "FREQUENCY\t200\nDESCRIPTION\t--\n"
         "TIME_STAMP\t2022-06-03, 10:47:36.627\t94247.45\n"
         "DATA_INCLUDED\t3D\nEVENT\tstart\t1\t0.00500\n"
         "MARKER_NAMES\ttip\tthe elbow\n"
         "TRAJECTORY_TYPES\tMeasured\tMixed\n" +
         columns + rows;
}

TEST(QualisysLayoutTest, ZerosAreAMarkerThatWasNotSeen) {
  CsvFile file = File(Qualisys("",
                               "1\t2\t3\t4\t5\t6\n0.000\t0.000\t0.000\t4\t0"
                               "\t0\n1\t2\t3\t0\t0\t0\t\n"));
  EXPECT_THAT(file.header(),
              ElementsAre("tip.X", "tip.Y", "tip.Z", "the elbow.X",
                          "the elbow.Y", "the elbow.Z", "t"));
  const Table table = ReadColumns(file, {6, 0, 4});
  EXPECT_THAT(table.columns[0], ElementsAre(0, 0.005, 0.01));
  EXPECT_THAT(table.columns[1], ElementsAre(1, IsNan(), 1));
  EXPECT_THAT(table.columns[2], ElementsAre(5, 0, IsNan()));
  EXPECT_THAT(file.notices(),
              ElementsAre("an export of QTM: t is the number of the row / 200 "
                          "Hz, lengths are in mm (map them by *0.001)",
                          "a marker at exactly 0, 0, 0 was not seen, and is "
                          "taken as missing: tip (1 of 3 rows), the elbow (1 "
                          "of 3 rows)"));
}

TEST(QualisysLayoutTest, ReadsFramesAndTimesWhereTheyStand) {
  const std::string row = "1\t2\t3\t4\t5\t6\n";
  EXPECT_THAT(File(Qualisys("", "1\t0.25\t" + row)).header().at(1), "t");
  EXPECT_THAT(
      ReadColumns(
          File(Qualisys("Frame\tTime\ttip X\ttip Y\ttip Z\te X\te Y\te Z\t"
                        "\n",
                        "1\t0.25\t" + row)),
          {1})
          .columns[0],
      ElementsAre(0.25));
  EXPECT_THAT(
      ReadColumns(
          File(Qualisys("Time\t X\t Y\t Z\t X\t Y\t Z\n", "0.25\t" + row)), {0})
          .columns[0],
      ElementsAre(0.25));
  EXPECT_THAT(
      File(Qualisys("Frame\t X\t Y\t Z\t X\t Y\t Z\n", "7\t" + row)).header(),
      testing::Contains("Frame"));
}

TEST(QualisysLayoutTest, ReportsWhatItCannotRead) {
  EXPECT_THAT(ReadError("NO_OF_FRAMES\t3\nDATA_INCLUDED\t2D\nMARKER_NAMES\ta\n"
                        "1\t2\n"),
              HasSubstr("an export of QTM with '2D' data, not 3D"));
  EXPECT_THAT(ReadError("NO_OF_FRAMES\t3\n1\t2\t3\n"),
              HasSubstr("an export of QTM without MARKER_NAMES"));
  EXPECT_THAT(ReadError("NO_OF_FRAMES\t3\nMARKER_NAMES\ta\n1\t2\t3\n"),
              HasSubstr("neither a column Time nor a FREQUENCY"));
  EXPECT_THAT(ReadError(Qualisys("", "1\t2\t3\t4\t5\t6\t7\t8\t9\n")),
              HasSubstr("9 columns for 2 markers"));
}

// Cuts and random bytes, among them those that mean something: read, or refused
// in our words.
TEST(TextLayoutTest, SurvivesDamage) {
  const std::string bytes = ",;\t\"\n\r #.-0eX";
  std::mt19937 random(1);
  for (const std::string& text :
       {std::string(kMotive), std::string(kVicon),
        Qualisys("Frame\tTime\n", "1\t0\t1\t2\t3\t4\t5\t6\n"),
        std::string("t;q\n0;1,5\n1;2,5\n"), std::string("t q\n0 1\n1 2\n")}) {
    int refused = 0;
    for (int i = 0; i < 2000; ++i) {
      std::string damaged = text;
      if (i % 5 == 0) damaged.resize(random() % text.size());
      for (int k = 0; k < 2 && !damaged.empty(); ++k) {
        damaged[random() % damaged.size()] =
            k == 0 ? bytes[random() % bytes.size()]
                   : static_cast<char>(random());
      }
      if (ReadError(damaged) != "no error") ++refused;
    }
    EXPECT_GT(refused, 200) << text;
    EXPECT_LT(refused, 2000) << text;
  }
}

TEST(EchoLayout, ReadsJointStatesByTheNamesInTheRows) {
  const std::string text =
      "1675851234,0,base,joint2,joint1,1,2,3,4,5,6\n"
      "1675851234,500000000,base,joint2,joint1,7,8,9,10,11,12\n";
  std::vector<std::string> notices;
  const sysid::Run run = Parse(text, "", &notices);
  EXPECT_THAT(run.t, ElementsAre(0, 0.5));
  EXPECT_EQ(run.channels[0].name, "joint1");
  EXPECT_EQ(run.channels[0].values(1, 0), 8.0);
  EXPECT_EQ(run.effort(0, 1), 5.0);
  EXPECT_THAT(notices[0], HasSubstr("`ros2 topic echo --csv`"));
  // Of another publisher between them.
  EXPECT_THAT(ErrorText([&] {
                Parse(text + "1675851235,0,base,joint1,joint2,1,2,3,4,5,6\n");
              }),
              HasSubstr("run.csv:3:4: 'joint1' here, but 'joint2' in the first "
                        "row\n  hint: each row has its time"));
}

}  // namespace
}  // namespace sysid
