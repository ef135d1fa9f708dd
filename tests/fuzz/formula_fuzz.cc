// Laws that a user types, over names of every kind.

#include <cmath>
#include <string>
#include <vector>

#include "models/formula/formula.h"
#include "models/scalars.h"
#include "tests/fuzz/fuzz.h"

namespace sysid {
namespace {

const std::vector<KnownName>& Known() {
  static const auto& known = *new std::vector<KnownName>{
      {"q", "rad"},         {"qd", "rad/s"},
      {"t", "s"},           {"joint2.q", "m"},
      {"joint2.qd", "m/s"}, {"my joint.q", "rad"},
      {"arm-1.q", "rad"},   {"joint1.cmd", ""},
      {"ratio", "-"},       {"heat", "N m/(s degC^2)"}};
  return known;
}

bool Same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

void ExpectFormula(const Formula& formula) {
  FUZZ_EXPECT(!formula.parameters.empty());
  FUZZ_EXPECT(formula.units.size() == formula.parameters.size());
  for (const std::string& unit : formula.units) ExpectPrintable(unit);
  for (const std::string& name : formula.parameters) {
    FUZZ_EXPECT(!name.empty());
    ExpectPrintable(name);
  }
  std::vector<double> numbers;
  std::vector<Jet8> jets;
  const size_t names = formula.known.size() + formula.parameters.size();
  for (size_t i = 0; i < names; ++i) {
    numbers.push_back(0.75 * static_cast<double>(i) - 1.0);
    jets.emplace_back(numbers.back(), static_cast<int>(i % 8));
  }
  std::vector<double> scratch(formula.tree.size());
  std::vector<Jet8> jet_scratch(formula.tree.size());
  // Not compared: a Jet divides by a product, so its number may differ in the
  // last digit, which a sign or a root of 0 makes any.
  formula.tree.Evaluate(jets.data(), jet_scratch.data());
  const double value = formula.tree.Evaluate(numbers.data(), scratch.data());
  FUZZ_EXPECT(
      Same(value, formula.tree.Evaluate(numbers.data(), scratch.data())));
}

}  // namespace
}  // namespace sysid

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  using namespace sysid;
  const std::string text = TextOf(data, size);
  Formula formula;
  FormulaFault fault;
  const bool parsed = ParseFormula(text, Known(), "N m", &formula, &fault);
  if (parsed) {
    ExpectFormula(formula);
  } else {
    FUZZ_EXPECT(fault.at <= text.size());
    FUZZ_EXPECT(!fault.what.empty() && !fault.hint.empty());
    ExpectPrintable(PointedAt(text, fault.at));
    ExpectReadable(InputError(
        "--add", fault.what + "\n" + PointedAt(text, fault.at), fault.hint));
  }
  // Blanks around it change nothing.
  Formula again;
  FormulaFault other;
  FUZZ_EXPECT(ParseFormula(" " + text + "\t", Known(), "N m", &again, &other) ==
              parsed);
  FUZZ_EXPECT(!parsed ||
              (again.parameters == formula.parameters &&
               again.units == formula.units && again.known == formula.known));
  return 0;
}
