#include "sysid/estimation/cancelled.h"
#include "sysid/linearization/residual_tests.h"
#include "sysid/report/page_parts.h"

namespace sysid {

Json ResidualsJson(const PageSource& source, const PageFit& fit) {
  // That leaves efforts; it does not fit states to what was measured.
  if (fit.fit->solver == "inverse_dynamics") return nullptr;
  try {
    const LinearizedFit linearized(*fit.problem, fit.fit->point);
    if (!linearized.Valid()) return nullptr;
    const auto channel = [](const Whiteness& white) -> Json {
      Json json = white.autocorrelation;
      json["channel"] = white.channel;
      return json;
    };
    const auto pair = [](const InputCorrelation& input) -> Json {
      Json json = input.over_lags;
      json["channel"] = input.channel;
      json["input"] = input.input;
      return json;
    };
    return {{"channels", List(TestWhiteness(linearized), channel)},
            {"inputs", List(CorrelateInputs(linearized), pair)}};
  } catch (const Cancelled&) {
    // Of a program that is interrupted the report has what there was.
    if (source.live) throw;
    return nullptr;
  }
}

}  // namespace sysid
