// The flag --columns against a header of awkward names.

#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/fuzz_mechanism.h"
#include "tests/fuzz/run_properties.h"

namespace sysid {
namespace {

constexpr char kRun[] =
    "time_ms,pos,pos-1,vel,/joint_states/position[0],q w,qx,qy,qz,1,e\n"
    "0,0.5,0.25,1,-1,1,0,0,0,3,2\n"
    "10,0.75,0.5,,-2,1,0,0,0,4,1e-3\n"
    "20,,0.75,-1,-3,-1,0,0,0,5,7\n";

// What is written of a map is read as that map.
void ExpectSameMap(const ColumnMap& map) {
  std::string text;
  for (const ColumnMapping& entry : map) {
    FUZZ_EXPECT(!entry.name.empty() && !entry.expression.empty());
    text += (text.empty() ? "" : ",") + entry.name + "=" + entry.expression;
  }
  const ColumnMap again = ParseColumnMap(text);
  FUZZ_EXPECT(again.size() == map.size());
  for (size_t i = 0; i < map.size(); ++i) {
    FUZZ_EXPECT(again[i].name == map[i].name);
    FUZZ_EXPECT(again[i].expression == map[i].expression);
  }
  const ColumnMap merged = MergeByName(map, again);
  FUZZ_EXPECT(merged.size() == map.size());
}

}  // namespace
}  // namespace sysid

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  using namespace sysid;
  std::vector<std::string> notices;
  try {
    const ColumnMap map = ParseColumnMap(TextOf(data, size));
    ExpectSameMap(map);
    const Run run = ParseRun("run.csv", kRun, map, FuzzMechanism(), &notices);
    ExpectValid(run, FuzzMechanism());
  } catch (const InputError& error) {
    ExpectReadable(error);
  }
  for (const std::string& notice : notices) ExpectPrintable(notice);
  return 0;
}
