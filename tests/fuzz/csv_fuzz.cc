// Runs as CSV: a first line "columns: MAP" (optional) is the flag --columns,
// the rest the file.

#include <string_view>

#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/fuzz_mechanism.h"
#include "tests/fuzz/run_properties.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  using namespace sysid;
  constexpr std::string_view kColumns = "columns: ";
  std::string text = TextOf(data, size), columns;
  if (text.starts_with(kColumns)) {
    const size_t end = std::min(text.find('\n'), text.size());
    columns = text.substr(kColumns.size(), end - kColumns.size());
    text.erase(0, end + 1);
  }
  std::vector<std::string> notices;
  try {
    const Run run = ParseRun("run.csv", text, ParseColumnMap(columns),
                             FuzzMechanism(), &notices);
    ExpectValid(run, FuzzMechanism());
    ExpectSameReadBack(run, FuzzMechanism());
  } catch (const InputError& error) {
    ExpectReadable(error);
  }
  for (const std::string& notice : notices) ExpectPrintable(notice);
  return 0;
}
