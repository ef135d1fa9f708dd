// ROS 1 bags: the file's bytes. (Chunks that are compressed are refused here:
// what decompresses them is not ours.)

#include <sys/mman.h>
#include <unistd.h>

#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/fuzz_mechanism.h"
#include "tests/fuzz/run_properties.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  using namespace sysid;
  const int file = memfd_create("run.bag", MFD_CLOEXEC);
  FUZZ_EXPECT(file >= 0);
  FUZZ_EXPECT(write(file, data, size) == static_cast<ssize_t>(size));
  std::vector<std::string> notices;
  try {
    const Run run = ReadRun("/proc/self/fd/" + std::to_string(file), {},
                            FuzzMechanism(), &notices);
    ExpectValid(run, FuzzMechanism());
    ExpectSameReadBack(run, FuzzMechanism());
  } catch (const InputError& error) {
    ExpectReadable(error);
  }
  for (const std::string& notice : notices) ExpectPrintable(notice);
  close(file);
  return 0;
}
