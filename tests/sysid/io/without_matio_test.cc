// The reader of builds without matio, here in the place of the other one.
#include "sysid/io/without_matio.cc"

#include <gtest/gtest.h>

#include "sysid/io/table_file.h"
#include "tests/support/error_text.h"
#include "tests/sysid/io/scratch_file.h"

namespace sysid {
namespace {

TEST(WithoutMatioTest, SaysWhatIsMissing) {
  const ScratchFile file("run.mat", "MATLAB 5.0 MAT-file, Platform: GLNXA64");
  EXPECT_EQ(ErrorText([&] { OpenTable(file.path()); }),
            file.path() +
                ": is a MATLAB file, and this sysid was built without the "
                "library that reads them\n"
                "  hint: install libmatio-dev and build again, or save the "
                "columns as CSV: writetable(table(t, q), 'run.csv')");
}

}  // namespace
}  // namespace sysid
