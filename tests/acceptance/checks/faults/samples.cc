// Samples of nothing, too rare or too few.

#include <algorithm>
#include <random>

#include "sysid/checks/excerpt.h"
#include "sysid/checks/series.h"
#include "sysid/session/check_session.h"
#include "tests/acceptance/checks/faults/plant.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"
#include "tests/acceptance/checks/resampled.h"

namespace sysid {

std::vector<Fault> SampleFaults() {
  return {
      {"still",
       {},
       [](const CleanCase& clean, std::uint64_t seed) -> Planted {
         std::mt19937_64 engine(seed);
         const CheckInput input = InputOf(clean.session);
         const std::vector<Series> motion = MotionSeries(input);
         Session planted = clean.session;
         for (size_t r = 0; r < planted.runs.size(); ++r) {
           planted.runs[r] = AfterRest(motion, clean.session.runs[r], &engine);
         }
         return planted;
       }},
      // Of so few samples both are true.
      {"slow_sampling",
       {"few_samples"},
       [](const CleanCase& clean, std::uint64_t) -> Planted {
         const CheckInput input = InputOf(clean.session);
         const std::vector<Series> motion = MotionSeries(input);
         Session planted = clean.session;
         for (size_t r = 0; r < planted.runs.size(); ++r) {
           const Run& run = clean.session.runs[r];
           // Two and a half samples a swing of the fastest channel.
           const double swings =
               Swings(clean.session.model.mechanism(), motion, run);
           const int stride = static_cast<int>(run.size() / (1.25 * swings));
           planted.runs[r] = Thinned(run, std::max(1, stride));
           // So slow a motion cannot be sampled too slowly: the reader takes
           // samples more than a second apart for milliseconds.
           if (MedianPeriod(planted.runs[r].t) > 1.0) return std::nullopt;
         }
         return planted;
       }},
      OfRun("few_samples",
            [](Dice*, Run* run) {
              // Of the motion: six that are equal would be another fault.
              const int first = FastestStretch(*run, 6);
              *run = Slice(*run, first, first + 6);
            }),
  };
}

}  // namespace sysid
