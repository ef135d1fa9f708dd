#include "sysid/report/progress_line.h"

#include <gtest/gtest.h>

namespace sysid {
namespace {

TEST(ProgressLine, ExpectsTheTimeLeftFromThePaceOfWhatIsDone) {
  ProgressLine line;
  // However long the program has been running.
  EXPECT_EQ(line.Next({"short segments", 0, 100, 12.5}, 1000.0),
            "short segments: iteration 0, error 12.5 times the noise");
  EXPECT_EQ(line.Next({"short segments", 10, 100, 2.0}, 1005.0),
            "short segments: iteration 10, error 2 times the noise, at most "
            "45 s left");
  // What is done next may begin with the iterations before it.
  EXPECT_EQ(line.Next({"one trajectory", 20, 100, 1.5}, 1010.0),
            "one trajectory: iteration 20, error 1.5 times the noise");
  EXPECT_EQ(line.Next({"one trajectory", 22, 100, 1.25}, 1012.0),
            "one trajectory: iteration 22, error 1.25 times the noise, at most "
            "78 s left");
  // The same again, of another model.
  EXPECT_EQ(line.Next({"one trajectory", 0, 100, 3.0}, 1020.0),
            "one trajectory: iteration 0, error 3 times the noise");
}

TEST(ProgressLine, ExpectsNothingOfWhatHasNoLimit) {
  ProgressLine line;
  line.Next({"screening effects", 0, 0, 1.0}, 0.0);
  EXPECT_EQ(line.Next({"screening effects", 3, 0, 1.0}, 1.0),
            "screening effects: iteration 3, error 1 times the noise");
}

}  // namespace
}  // namespace sysid
