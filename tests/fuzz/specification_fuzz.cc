// Fit specifications, YAML.

#include <algorithm>
#include <cmath>

#include "sysid/parameters/fit_specification.h"
#include "tests/fuzz/fuzz.h"

namespace sysid {
namespace {

bool IsFinite(const std::optional<double>& value) {
  return !value || std::isfinite(*value);
}

// "specification.yaml:LINE:COLUMN", within the text.
void ExpectPlace(const std::string& place, int lines) {
  int line = 0, column = 0, end = 0;
  const int read = std::sscanf(place.c_str(), "specification.yaml:%d:%d%n",
                               &line, &column, &end);
  FUZZ_EXPECT(read == 2 && end == static_cast<int>(place.size()));
  FUZZ_EXPECT(line >= 1 && line <= lines && column >= 1);
}

void ExpectPositive(const std::optional<Located<double>>& value, int lines) {
  if (!value) return;
  FUZZ_EXPECT(value->value > 0 && std::isfinite(value->value));
  ExpectPlace(value->place, lines);
}

void ExpectWord(const std::optional<Located<std::string>>& word,
                const std::string& key, int lines) {
  if (!word) return;
  const std::vector<std::string>& known = KnownWords(key);
  FUZZ_EXPECT(std::find(known.begin(), known.end(), word->value) !=
              known.end());
  ExpectPlace(word->place, lines);
}

void ExpectValid(const FitSpecification& spec, int lines) {
  for (const FitSpecification::Free& free : spec.free) {
    FUZZ_EXPECT(!free.name.empty());
    FUZZ_EXPECT(IsFinite(free.initial) && IsFinite(free.lower) &&
                IsFinite(free.upper));
    FUZZ_EXPECT(!free.lower || !free.upper || *free.lower < *free.upper);
    FUZZ_EXPECT(!free.lower || !free.initial || *free.lower <= *free.initial);
    FUZZ_EXPECT(!free.upper || !free.initial || *free.initial <= *free.upper);
    FUZZ_EXPECT(!free.prior ||
                (std::isfinite(free.prior->mean) &&
                 std::isfinite(free.prior->std) && free.prior->std > 0));
    ExpectPlace(free.place, lines);
  }
  for (const NamedValue& fix : spec.fix) {
    FUZZ_EXPECT(!fix.name.empty() && IsFinite(fix.value));
    ExpectPlace(fix.place, lines);
  }
  for (const ColumnMapping& column : spec.columns) {
    FUZZ_EXPECT(!column.name.empty() && !column.expression.empty());
    ExpectPlace(column.place, lines);
  }
  ExpectPositive(spec.noise, lines);
  ExpectPositive(spec.step, lines);
  ExpectPositive(spec.segment, lines);
  ExpectWord(spec.integrator, "integrator", lines);
  ExpectWord(spec.residual, "residual", lines);
  ExpectWord(spec.solver, "solver", lines);
  ExpectWord(spec.loss, "loss", lines);
  FUZZ_EXPECT(!spec.loss_scale || *spec.loss_scale > 0);
}

}  // namespace
}  // namespace sysid

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  using namespace sysid;
  const std::string text = TextOf(data, size);
  // A carriage return ends a line, too.
  const int lines =
      1 + static_cast<int>(std::count_if(text.begin(), text.end(), [](char c) {
        return c == '\n' || c == '\r';
      }));
  try {
    ExpectValid(ParseFitSpecification("specification.yaml", text), lines);
  } catch (const InputError& error) {
    ExpectReadable(error);
    FUZZ_EXPECT(error.place().starts_with("specification.yaml"));
  }
  return 0;
}
