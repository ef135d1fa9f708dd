// Every message that a wrong URDF gives, by its text.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "models/error.h"
#include "models/urdf/load_urdf.h"

namespace sysid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string Message(const std::string& text) {
  try {
    LoadUrdfText(text, "r.urdf");
  } catch (const InputError& error) {
    return error.what();
  }
  return "(loads)";
}

constexpr char kGoodLink[] =
    "<inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' "
    "iyz='0' izz='1'/></inertial>";

// A robot whose link a holds `link` and whose joint j holds `joint`; line 3 is
// the link, line 4 the joint, line 5 `more`.
std::string Robot(const std::string& link, const std::string& joint,
                  const std::string& type = "type='revolute'",
                  const std::string& more = "") {
  return "<robot name='r'>\n<link name='base'/>\n<link name='a'>" + link +
         "</link>\n<joint name='j' " + type +
         "><parent link='base'/><child link='a'/>" + joint + "</joint>\n" +
         more + "</robot>\n";
}

std::string LinkMessage(const std::string& link) {
  return Message(Robot(link, ""));
}

std::string JointMessage(const std::string& joint) {
  return Message(Robot(kGoodLink, joint));
}

std::string TypeMessage(const std::string& type) {
  return Message(Robot(kGoodLink, "", type));
}

std::string MoreMessage(const std::string& more) {
  return Message(Robot(kGoodLink, "", "type='revolute'", more));
}

TEST(UrdfMessages, TheGoodRobotLoads) {
  EXPECT_EQ(JointMessage(""), "(loads)");
}

TEST(UrdfMessages, MissingFile) {
  try {
    LoadUrdf("/nonexistent/robot.urdf");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.place(), "/nonexistent/robot.urdf");
    EXPECT_STREQ(error.what(),
                 "/nonexistent/robot.urdf: cannot be read: No such file or "
                 "directory\n  hint: give a URDF file or the name of a shipped "
                 "model");
  }
}

TEST(UrdfMessages, Folder) {
  const std::string folder = testing::TempDir();
  try {
    LoadUrdf(folder);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.what(), folder +
                                ": is a folder, not a URDF file\n"
                                "  hint: name a file in it");
  }
}

TEST(UrdfMessages, EmptyFile) {
  EXPECT_EQ(Message(" \n"),
            "r.urdf: the file is empty\n  hint: a URDF is XML with <robot> as "
            "its root element");
}

TEST(UrdfMessages, NotXml) {
  EXPECT_EQ(Message("t,q\n0,1\n"),
            "r.urdf:1:1: not XML: text outside of an element\n  hint: a URDF "
            "is XML with <robot> as its root element");
  EXPECT_EQ(Message("<robot name='r'>\n <link name='b'>\n</robot>\n"),
            "r.urdf:3:1: not XML: </robot> where <link> (line 2) is open\n"
            "  hint: close it first, by </link> or />");
  EXPECT_EQ(Message("<robot name='r'>\n<link name='b'/>\n"),
            "r.urdf:3:1: not XML: the file ends inside of <robot> (line 1)\n"
            "  hint: close it by </robot>");
  EXPECT_EQ(Message("<robot name='r'>\n <link name=b/></robot>"),
            "r.urdf:2:8: not XML: the value of name in <link> is not in quotes"
            "\n  hint: name=\"value\"");
  EXPECT_EQ(Message("<robot name='r'>\n <link name='b/>\n<a/></robot>"),
            "r.urdf:2:8: not XML: the value of name in <link> has no closing "
            "quote\n  hint: name=\"value\"");
  EXPECT_EQ(Message("<robot name='r'>\n <link name/></robot>"),
            "r.urdf:2:8: not XML: an attribute of <link> without a value\n"
            "  hint: name=\"value\"");
  EXPECT_EQ(Message("<robot name='r'>\n <link <a/></robot>"),
            "r.urdf:2:2: not XML: the tag <link is not closed by >");
  EXPECT_EQ(Message("<robot name='r'>\n < 3</robot>"),
            "r.urdf:2:2: not XML: a < that begins no element\n  hint: write it "
            "as &lt;");
  EXPECT_EQ(Message("<robot name='r'>\n <!-- </robot>"),
            "r.urdf:2:2: not XML: the comment is not closed\n  hint: it ends "
            "with -->");
  EXPECT_EQ(Message("</robot>"),
            "r.urdf:1:1: not XML: </robot> closes nothing");
  EXPECT_EQ(Message("<robot name='r'></robot"),
            "r.urdf:1:17: not XML: the end tag </robot is not closed by >");
  const std::string nul("<robot name='r'>\n <link name='a\0b'/></robot>", 42);
  EXPECT_EQ(Message(nul),
            "r.urdf:2:15: not XML: a NUL byte\n  hint: save it as text in "
            "UTF-8");
  EXPECT_EQ(Message("<robot name='r'>\n <link name='a\x1b[2Jb'/></robot>"),
            "r.urdf:2:15: not XML: a control character\n  hint: leave it out");
  // NUL, ESC, half of a letter, none, and what has no end.
  for (const std::string number :
       {"0;", "256", "27;", "x1b;", "xD800;", "x110000;", "xFFFF;", ";", "x;",
        "-1;", "99999999999;", "x4294967361;"}) {
    EXPECT_EQ(
        Message("<robot name='r'>\n <link name='a&#" + number + "'/></robot>"),
        "r.urdf:2:15: not XML: a &# that is no letter\n  hint: &#233; or "
        "&#xE9;, for example");
    EXPECT_THAT(Message("<robot name='r'>&#" + number + "</robot>"),
                HasSubstr("r.urdf:1:17: not XML: a &# that is no letter"));
  }
  // Latin-1, a letter that is cut off, one longer than it must be.
  for (const std::string bytes : {"caf\xE9", "\xE2\x82", "\xC0\xAF"}) {
    EXPECT_EQ(
        Message("<robot name='r'>\n <link name='" + bytes + "'/></robot>"),
        "r.urdf:2:8: not XML: the value of name in <link> is not UTF-8\n"
        "  hint: save it as text in UTF-8");
  }
  EXPECT_EQ(Message("<robot name='r'>\n<author>Jos\xE9</author></robot>"),
            "r.urdf:2:9: not XML: text that is not UTF-8\n  hint: save it as "
            "text in UTF-8");
  EXPECT_EQ(Message("<\xF0>\xE0</\xF0>"),
            "r.urdf:1:1: not XML: a name that is not UTF-8\n  hint: save it "
            "as text in UTF-8");
  EXPECT_EQ(Message("<!DOCTYPE x>\n<robot name='r'/>"),
            "r.urdf:1:1: not XML: a document type declaration\n  hint: leave "
            "it out");
  EXPECT_THAT(Message("<robot name='r' name='s'/>"),
              HasSubstr("not XML: Error parsing Element"));
}

TEST(UrdfMessages, ControlCharactersInNames) {
  const std::string fault = "a control character in the name";
  for (const std::string control :
       {"\n", "&#10;", "&#9;", "\x7f", "&#x7F;", "&#x9B;", "\u009b"}) {
    EXPECT_THAT(MoreMessage("<link name='b" + control + "'/>"),
                AllOf(HasSubstr("r.urdf:5:7: link 'b"),
                      HasSubstr("': " + fault + " (leave it out)")));
    EXPECT_THAT(
        Message("<robot name='r" + control + "'><link name='b'/></robot>"),
        HasSubstr("r.urdf:1:8: robot: " + fault));
  }
}

TEST(UrdfMessages, LettersByTheirNumber) {
  const Mechanism mechanism = LoadUrdfText(
      "<robot name='&#x20AC;&#233;'><link name='b&amp;&#65;&amp;#66;'/>"
      "<link name='a'>" +
          std::string(kGoodLink) +
          "</link><joint name='j' type='revolute'><parent "
          "link='b&#38;A&#x26;#66;'/><child link='a'/></joint></robot>",
      "r.urdf");
  EXPECT_EQ(mechanism.name, "\u20ac\u00e9");
  EXPECT_EQ(mechanism.links[0].name, "b&A&#66;");
}

TEST(UrdfMessages, NestedTooDeep) {
  std::string text = "<robot name='r'>\n";
  for (int i = 0; i < 100000; ++i) text += "<a>";
  EXPECT_THAT(Message(text), HasSubstr("more than 100 elements inside each "
                                       "other"));
}

TEST(UrdfMessages, NoRobot) {
  EXPECT_EQ(Message("<html/>"),
            "r.urdf:1:1: no <robot> element: the root element is <html>\n"
            "  hint: a URDF is XML with <robot> as its root element");
  EXPECT_EQ(Message("<sdf/>"),
            "r.urdf:1:1: no <robot> element: the root element is <sdf>\n"
            "  hint: this is SDF, Gazebo's format, which is not read: give the "
            "URDF that it was made from");
  EXPECT_THAT(Message("<?xml version='1.0'?>"),
              HasSubstr("r.urdf: no <robot> element"));
  EXPECT_EQ(Message("<robot name='r'/>\n<robot name='s'/>"),
            "r.urdf:2:1: a second root element, <robot>\n  hint: a file holds "
            "one robot");
  EXPECT_EQ(Message("<robot name='r'/>"), "r.urdf:1:1: robot: no links");
}

TEST(UrdfMessages, NoMovingJoint) {
  EXPECT_EQ(TypeMessage("type='fixed'"),
            "r.urdf: no moving joint: there is nothing to identify\n  hint: "
            "joints are revolute, continuous, prismatic or spherical");
}

TEST(UrdfMessages, Names) {
  EXPECT_EQ(MoreMessage("<link name='a'/>"),
            "r.urdf:5:7: link 'a': the name is used twice, first in line 3");
  EXPECT_EQ(MoreMessage("<link/>"),
            "r.urdf:5:1: link without a name: every link needs one\n  hint: "
            "<link name=\"...\">");
  EXPECT_THAT(MoreMessage("<joint name='j' type='fixed'><parent link='base'/>"
                          "<child link='b'/></joint><link name='b'/>"),
              HasSubstr("r.urdf:5:8: joint 'j': the name is used twice, first "
                        "in line 4"));
  EXPECT_THAT(Message("<robot><link name='a'/></robot>"),
              HasSubstr("r.urdf:1:1: robot: no name (<robot name=\"...\">)"));
}

TEST(UrdfMessages, EndsOfJoints) {
  EXPECT_EQ(MoreMessage("<joint name='k' type='fixed'><parent link='bas'/>"
                        "<child link='a'/></joint>")
                .substr(0, 17),
            "r.urdf: 2 faults\n");
  EXPECT_THAT(MoreMessage("<joint name='k' type='fixed'><parent link='bas'/>"
                          "<child link='a'/></joint>"),
              HasSubstr("r.urdf:5:38: joint 'k': the parent link 'bas' is not "
                        "in the file (did you mean 'base'?)"));
  EXPECT_EQ(MoreMessage("<joint name='k' type='fixed'><parent link='a'/>"
                        "<child link='tool'/></joint>"),
            "r.urdf:5:55: joint 'k': the child link 'tool' is not in the file\n"
            "  hint: known: base, a");
  EXPECT_EQ(MoreMessage("<joint name='k' type='fixed'><parent link='a'/>"
                        "</joint>"),
            "r.urdf:5:1: joint 'k': no child link\n  hint: <child "
            "link=\"...\"/>");
  EXPECT_EQ(MoreMessage("<link name='b'/><joint name='k' type='fixed'><parent/>"
                        "<child link='b'/></joint>"),
            "r.urdf:5:46: joint 'k': no parent link\n  hint: <parent "
            "link=\"...\"/>");
}

TEST(UrdfMessages, TwoRoots) {
  EXPECT_EQ(MoreMessage("<link name='other'/>"),
            "r.urdf:5:1: 2 root links: 'base', 'other'\n  hint: only one link "
            "may be without a parent: join the others to it, by fixed joints "
            "for example");
}

TEST(UrdfMessages, Loops) {
  EXPECT_EQ(MoreMessage("<link name='b'/><joint name='k' type='fixed'><parent "
                        "link='base'/><child link='b'/></joint>\n"
                        "<joint name='l' type='fixed'><parent link='b'/><child "
                        "link='a'/></joint>"),
            "r.urdf:6:1: joint 'l': closes a loop: its child 'a' is already "
            "carried by joint 'j' (line 4)\n  hint: a URDF is a tree: leave "
            "out one joint of every loop");
  EXPECT_EQ(MoreMessage("<joint name='k' type='fixed'><parent link='a'/><child "
                        "link='base'/></joint>"),
            "r.urdf:2:1: a loop without a root: links 'a', 'base' carry each "
            "other\n  hint: a URDF is a tree: leave out one joint of every "
            "loop");
  EXPECT_THAT(
      MoreMessage("<link name='b'/><joint name='k' type='fixed'><parent "
                  "link='b'/><child link='b'/></joint>"),
      HasSubstr("a loop without a root: link 'b' carries itself"));
}

TEST(UrdfMessages, JointTypes) {
  EXPECT_EQ(TypeMessage("type='revolut'"),
            "r.urdf:4:17: joint 'j': unknown joint type 'revolut'\n  hint: did "
            "you mean 'revolute'?");
  EXPECT_EQ(TypeMessage("type='ball'"),
            "r.urdf:4:17: joint 'j': unknown joint type 'ball'\n  hint: known: "
            "revolute, continuous, prismatic, spherical, fixed");
  EXPECT_EQ(TypeMessage(""),
            "r.urdf:4:1: joint 'j': no type\n  hint: type=\"revolute\", for "
            "example");
  EXPECT_EQ(TypeMessage("type='planar'"),
            "r.urdf:4:17: joint 'j': planar joints are not supported\n  hint: "
            "use two prismatic joints and a revolute one, each carrying a part "
            "of the mass");
  EXPECT_EQ(TypeMessage("type='floating'"),
            "r.urdf:4:17: joint 'j': floating joints are not supported\n  "
            "hint: the root link is fixed in the world");
}

TEST(UrdfMessages, Mimics) {
  EXPECT_EQ(JointMessage("<mimic/>"),
            "r.urdf:4:71: joint 'j': <mimic> has no joint\n  hint: <mimic "
            "joint=\"...\"/>");
  const auto more = [](const std::string& k) {
    return "<link name='b'>" + std::string(kGoodLink) +
           "</link><joint name='k' type='revolute'><parent link='base'/>"
           "<child link='b'/>" +
           k + "</joint>";
  };
  EXPECT_EQ(MoreMessage(more("<mimic joint='jj'/>")),
            "r.urdf:5:189: joint 'k': follows joint 'jj', which is not in the "
            "file\n  hint: known: j, k");
  EXPECT_EQ(MoreMessage(more("<mimic joint='k'/>")),
            "r.urdf:5:189: joint 'k': follows joints that follow each other\n"
            "  hint: one of them moves by itself: leave its <mimic> out");
  EXPECT_THAT(MoreMessage(more("<mimic joint='j' multiplier='twice'/>")),
              HasSubstr("'twice' in <mimic multiplier=\"twice\"> is not a"));
  EXPECT_EQ(MoreMessage(more("<mimic joint='j' multiplier='2'/>")), "(loads)");
  EXPECT_THAT(Message(Robot(kGoodLink, "<mimic joint='k'/>", "type='spherical'",
                            more(""))),
              HasSubstr("joint 'j': a spherical joint cannot follow another"));
  EXPECT_THAT(Message(Robot(kGoodLink, "", "type='spherical'",
                            more("<mimic joint='j'/>"))),
              HasSubstr("joint 'k': follows joint 'j', which is spherical"));
  EXPECT_THAT(Message(Robot(kGoodLink, "<mimic joint='k'/>", "type='revolute'",
                            "<link name='b'/><joint name='k' type='fixed'>"
                            "<parent link='a'/><child link='b'/></joint>")),
              HasSubstr("no moving joint"));
}

TEST(UrdfMessages, Masses) {
  const std::string inertia =
      "<inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/></inertial>";
  EXPECT_EQ(LinkMessage("<inertial>" + inertia),
            "r.urdf:3:16: link 'a': <inertial> has no <mass>\n  hint: <mass "
            "value=\"kg\"/>");
  EXPECT_EQ(LinkMessage("<inertial><mass/>" + inertia),
            "r.urdf:3:26: link 'a': <mass> has no value");
}

TEST(UrdfMessages, Numbers) {
  const std::string inertia =
      "<inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/></inertial>";
  for (const std::string text :
       {"1.0abc", "heavy", "nan", "inf", "1,5", "1e999", "0x10", "+-1"}) {
    EXPECT_EQ(LinkMessage("<inertial><mass value='" + text + "'/>" + inertia),
              "r.urdf:3:32: link 'a': '" + text + "' in <mass value=\"" + text +
                  "\"> is not a finite number\n  hint: write it with digits "
                  "and a point, such as -1.5e-3");
  }
  EXPECT_EQ(LinkMessage("<inertial><mass value='1e300'/>" + inertia),
            "r.urdf:3:32: link 'a': '1e300' in <mass value=\"1e300\">: 1e12 is "
            "the most\n  hint: the units are m, rad, kg and s");
  EXPECT_EQ(LinkMessage("<inertial><mass value='1e12'/>" + inertia), "(loads)");
  EXPECT_THAT(LinkMessage("<inertial><mass value='1'/><inertia ixx='1' "
                          "ixy='-1e200' ixz='0' iyy='1' iyz='0' izz='1'/>"
                          "</inertial>"),
              HasSubstr("'-1e200' in <inertia ixy=\"-1e200\">: 1e12 is"));
  EXPECT_THAT(JointMessage("<origin xyz='0 0 -0.61e308'/>"),
              HasSubstr("'-0.61e308' in <origin xyz=\"0 0 -0.61e308\">: 1e12"));
  EXPECT_EQ(JointMessage("<limit lower='-1.7e308' upper='1.7e308' effort='1' "
                         "velocity='1'/>"),
            "(loads)");
  EXPECT_EQ(LinkMessage("<inertial><mass value='1 2'/>" + inertia),
            "r.urdf:3:32: link 'a': <mass value=\"1 2\"> has 2 numbers, not 1");
  EXPECT_EQ(LinkMessage("<inertial><mass value=''/>" + inertia),
            "r.urdf:3:32: link 'a': <mass value=\"\"> has 0 numbers, not 1");
  EXPECT_THAT(LinkMessage("<inertial><mass value='${m}'/>" + inertia),
              HasSubstr("hint: this is xacro: xacro file.xacro > file.urdf"));
  EXPECT_THAT(JointMessage("<origin xyz='0 1'/>"),
              HasSubstr("joint 'j': <origin xyz=\"0 1\"> has 2 numbers, not "
                        "3"));
  EXPECT_THAT(JointMessage("<origin quat_xyzw='0 0 0 1'/>"),
              HasSubstr("<origin quat_xyzw> is not supported\n  hint: give the "
                        "rotation as rpy"));
}

// What stands there is taken; findings say that no body has it.
TEST(UrdfMessages, NoneOfInertiasThatNoBodyHas) {
  const auto inertial = [](const std::string& mass, const std::string& ixx) {
    return "<inertial><mass value='" + mass + "'/><inertia ixx='" + ixx +
           "' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>";
  };
  for (const std::string& link :
       {std::string(), inertial("1", "5"), inertial("1", "-1"),
        inertial("-2", "1"), inertial("0", "1"), inertial("0", "0")}) {
    EXPECT_EQ(LinkMessage(link), "(loads)") << link;
  }
}

TEST(UrdfMessages, Inertias) {
  EXPECT_EQ(LinkMessage("<inertial><mass value='1'/><inertia ixx='1' ixy='0' "
                        "ixz='0' iyy='1' iyz='0'/></inertial>"),
            "r.urdf:3:43: link 'a': <inertia> has no izz");
  EXPECT_EQ(LinkMessage("<inertial><mass value='1'/></inertial>"),
            "r.urdf:3:16: link 'a': <inertial> has no <inertia>\n  hint: six "
            "numbers about the centre of mass; zeros make a point mass");
}

TEST(UrdfMessages, Axes) {
  EXPECT_EQ(JointMessage("<axis xyz='0 0 0'/>"),
            "r.urdf:4:77: joint 'j': the axis is zero\n  hint: it is the "
            "direction about or along which the joint moves");
  EXPECT_EQ(JointMessage("<axis xyz='0 3 4'/>"), "(loads)");
  EXPECT_EQ(JointMessage("<axis/>"),
            "r.urdf:4:71: joint 'j': <axis> has no xyz\n  hint: <axis xyz=\"0 "
            "0 1\"/>");
}

TEST(UrdfMessages, DynamicsAndLimits) {
  EXPECT_EQ(JointMessage("<dynamics damping='-0.1' friction='-2'/>"),
            "(loads)");
  for (const std::string none : {"inf", "-inf", "Infinity"}) {
    EXPECT_EQ(JointMessage("<limit effort='" + none + "'/>"), "(loads)");
  }
  EXPECT_THAT(JointMessage("<limit effort='1e999'/>"),
              HasSubstr("is not a finite number"));
  EXPECT_EQ(JointMessage("<limit lower='2' upper='1'/>"), "(loads)");
}

TEST(UrdfMessages, SlipsOfTheFingersThatWouldBeIgnored) {
  EXPECT_EQ(LinkMessage("<inertal/>"),
            "r.urdf:3:16: link 'a': unknown element <inertal>\n  hint: did you "
            "mean <inertial>?");
  EXPECT_EQ(JointMessage("<dynamic damping='1'/>"),
            "r.urdf:4:71: joint 'j': unknown element <dynamic>\n  hint: did "
            "you mean <dynamics>?");
  EXPECT_EQ(JointMessage("<dynamics dampign='1'/>"),
            "r.urdf:4:81: joint 'j': unknown attribute dampign of <dynamics>\n"
            "  hint: did you mean damping?");
  EXPECT_EQ(JointMessage("<axis xyz='0 0 1'/><axis xyz='0 1 0'/>"),
            "r.urdf:4:90: joint 'j': a second <axis>\n  hint: keep one");
  EXPECT_EQ(MoreMessage("<xacro:include filename='x'/>"),
            "r.urdf:5:1: robot: <xacro:include> is xacro, not URDF\n  hint: "
            "convert it first: xacro file.xacro > file.urdf");
}

TEST(UrdfMessages, EveryFaultIsListedInTheOrderOfTheFile) {
  EXPECT_EQ(
      Message("<robot name='r'>\n<link name='base'/>\n<link name='a'>"
              "<inertial><mass value='x'/><inertia ixx='1' ixy='0' ixz='0' "
              "iyy='1' iyz='0'/></inertial></link>\n<link name='b'/>\n"
              "<joint name='j' type='revolute'><parent link='base'/><child "
              "link='a'/><axis xyz='0 0 0'/></joint>\n<joint name='k' "
              "type='planar'><parent link='a'/><child link='b'/></joint>\n"
              "</robot>\n"),
      "r.urdf: 4 faults\n"
      "  r.urdf:3:32: link 'a': 'x' in <mass value=\"x\"> is not a finite "
      "number (write it with digits and a point, such as -1.5e-3)\n"
      "  r.urdf:3:43: link 'a': <inertia> has no izz\n"
      "  r.urdf:5:77: joint 'j': the axis is zero (it is the direction about "
      "or along which the joint moves)\n"
      "  r.urdf:6:17: joint 'k': planar joints are not supported (use two "
      "prismatic joints and a revolute one, each carrying a part of the "
      "mass)");
}

TEST(UrdfMessages, UrdfdomKeepsOffTheConsole) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  EXPECT_THAT(MoreMessage("<link name='other'/>"), Not(HasSubstr("urdfdom")));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

}  // namespace
}  // namespace sysid
