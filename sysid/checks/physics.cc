#include "sysid/checks/physics.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "sysid/checks/excerpt.h"
#include "sysid/checks/quick_fit.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/estimation/shooting_stage.h"

namespace sysid {
namespace {

bool Debug() { return std::getenv("SYSID_CHECK_DEBUG") != nullptr; }

}  // namespace

void CheckPhysics(const CheckInput& input, std::vector<Finding>* /*findings*/) {
  const Excerpt excerpt(input.runs, 1200);
  if (excerpt.empty()) return;
  EstimationOptions options = input.options;
  options.rollout.step = 0.0;
  const LooseModel lean = WithFriction(*input.model, *input.free, input.runs);
  double t0 = Now();
  const QuickFit given =
      FitQuickly(lean.model, lean.free, excerpt.Windows({}), options, nullptr);
  if (Debug()) {
    std::fprintf(stderr, "window %g s, period %g, windows %zu\n",
                 excerpt.window_s(), excerpt.period_s(),
                 excerpt.Windows({}).size());
    std::fprintf(stderr, "given %.4g  (%.3f s, corr %.3g)\n", given.error,
                 Now() - t0, given.correlation);
    for (size_t i = 0; i < lean.free.size(); ++i)
      std::fprintf(stderr, "   %s %g\n", lean.free[i].parameter.name.c_str(),
                   given.values[i]);
    t0 = Now();
    const LooseModel rich = WithEverything(lean);
    const QuickFit all =
        FitQuickly(rich.model, rich.free, excerpt.Windows({}), options, nullptr);
    std::fprintf(stderr, "rich %.4g  (%.3f s) %zu\n", all.error, Now() - t0,
                 rich.free.size());
  }
  std::vector<Reading> readings;
  for (const ReadingFamily family : kReadingFamilies) family(input, &readings);
  for (const Reading& reading : readings) {
    t0 = Now();
    LooseModel as_read = lean;
    if (reading.change_model) reading.change_model(&as_read.model);
    const QuickFit fit = FitQuickly(as_read.model, as_read.free,
                                    excerpt.Windows(reading.change), options,
                                    nullptr);
    if (Debug()) {
      std::fprintf(stderr, "%-20s %-50s %10.4g  (%.3f s)\n",
                   reading.fault.c_str(), reading.says.c_str(), fit.error,
                   Now() - t0);
    }
  }
  if (std::getenv("SYSID_CHECK_SHIFT")) {
    for (const Joint& joint : input.model->mechanism().joints) {
      if (joint.type == JointType::kFixed) continue;
      for (const char* suffix : {".q", ".tau"}) {
        for (double tau : {-0.02, -0.01, -0.005, -0.002, 0.002, 0.005, 0.01, 0.02}) {
          t0 = Now();
          ChannelEdits edits;
          edits.shifts = {{joint.name + suffix, tau, ""}};
          const QuickFit fit = FitQuickly(
              lean.model, lean.free, excerpt.Windows([&](Run* run) {
                ApplyEdits(edits, input.model->mechanism(), run, nullptr);
              }),
              options, &given.point);
          std::fprintf(stderr, "shift %s%s %g: %.4g (%.3f s)\n",
                       joint.name.c_str(), suffix, tau, fit.error, Now() - t0);
        }
      }
    }
  }
}

}  // namespace sysid
