#include <gmock/gmock.h>

#include <string>

#include "sysid/io/table_file.h"
#include "tests/support/error_text.h"
#include "tests/sysid/io/scratch_file.h"

namespace sysid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(ForeignFormat, SaysWhatAFileIsAndHowToGoOn) {
  const struct {
    std::string begins, what, hint;
  } kFiles[] = {
      {std::string("\x93NUMPY\x01\0", 8), "a NumPy array (.npy)", "np.load('"},
      {"PK\x03\x04......q.npy", "an archive of NumPy arrays", "np.load('"},
      {"PK\x03\x04......archive/data.pkl", "a file of PyTorch", "torch.load('"},
      {"PK\x03\x04......[Content_Types].xml", "a workbook", "as CSV"},
      {std::string("SQLite format 3\0...topics", 25), "a ROS 2 bag",
       "ros2 topic echo --csv"},
      {"\x89MCAP0\r\n", "a recording in MCAP", "ros2 bag play"},
      {"{\"t\": 0, \"q\": 1}\n", "JSON", "json.loads"},
      {"<robot name=\"a\"/>", "a model (URDF)", "--model"},
      {"\x1f\x8b\x08", "compressed by gzip", "gunzip"},
  };
  for (const auto& file : kFiles) {
    const ScratchFile run("run", file.begins);
    EXPECT_THAT(ErrorText([&] { OpenTable(run.path()); }),
                AllOf(HasSubstr(run.path() + ": is " + file.what),
                      HasSubstr(file.hint)));
  }
}

}  // namespace
}  // namespace sysid
