// Runs the suite "data with a hidden effect" of issue 3 and prints its table
// (docs/hidden_effects.md); or writes cases as files for the programs. Not a
// test: it takes an hour.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <mutex>
#include <thread>

#include "gflags/gflags.h"
#include "sysid/io/write_file.h"
#include "tests/acceptance/hidden/export_case.h"
#include "tests/acceptance/hidden/score.h"

DEFINE_int32(seeds, 1, "of each experiment with hidden effects");
DEFINE_int32(complete_seeds, 12, "of each complete model: 18 cases a seed");
DEFINE_string(filter, "", "only cases whose name has this in it");
DEFINE_int32(threads, 2, "cases at once");
DEFINE_string(out, "", "file of the table");
DEFINE_string(csv, "", "file with a line a case");
DEFINE_bool(oracle, false, "fit with what was planted instead of finding it");
DEFINE_bool(withhold, false, "without the planted laws among the candidates");
DEFINE_string(way, "given",
              "two_wrong, one_more, shuffled or perturbed: of ways that must "
              "lead to the same answer (hidden/outcome.h)");
DEFINE_double(friction_time, 0, "time constant of MuJoCo's frictionloss, s");
DEFINE_bool(list, false, "only list the cases");
DEFINE_string(export_to, "",
              "write each case as it was run, a folder each, in this one");

namespace sysid {
namespace {

void Export(const HiddenData& data) {
  std::string folder = data.info.name;
  std::replace(folder.begin(), folder.end(), '/', '_');
  ExportCase(data, (std::filesystem::path(FLAGS_export_to) / folder).string());
}

// An effect that the fitted model hides in its parameters is planted again,
// larger, until it shows, or is as large as it may be.
Scored RunCase(HiddenCase info) {
  constexpr int kAttempts = 4;
  Scored scored{info, {}, {}, {}};
  for (int attempt = 1; attempt <= kAttempts; ++attempt) {
    Scored next{info, {}, {}, {}};
    bool at_most = false;
    try {
      const HiddenData data = MakeHiddenData(info);
      at_most = data.at_most;
      next.magnitudes = data.magnitudes;
      if (!FLAGS_export_to.empty()) Export(data);
      if (data.planted.size() == 2) {
        for (const int other : {1, 0}) {
          next.without.push_back(ErrorWith(data, {data.planted[other]}));
        }
      }
      const bool weak = std::any_of(next.without.begin(), next.without.end(),
                                    [](double error) { return error < 1.5; });
      if (weak && !at_most && attempt < kAttempts) {
        info.strength *= 2.0;
        continue;
      }
      next.outcome = FLAGS_oracle
                         ? AskOracle(data)
                         : DiagnoseCase(data, FLAGS_withhold, WayOf(FLAGS_way));
    } catch (const std::exception& error) {
      if (attempt > 1 && scored.outcome.fault.empty() &&
          !scored.outcome.verdict.empty()) {
        return scored;  // too strong to be recorded
      }
      next.outcome.fault = error.what();
    }
    scored = std::move(next);
    if (scored.complete() || scored.Shows() || at_most ||
        !scored.outcome.fault.empty()) {
      break;
    }
    info.strength *= 2.0;
  }
  return scored;
}

std::vector<HiddenCase> Chosen() {
  std::vector<HiddenCase> cases = HiddenCases(FLAGS_seeds);
  for (const HiddenCase& c : CompleteCases(FLAGS_complete_seeds)) {
    cases.push_back(c);
  }
  for (HiddenCase& c : cases) {
    if (FLAGS_friction_time > 0 && c.friction_time > 0) {
      c.friction_time = FLAGS_friction_time;
    }
  }
  std::erase_if(cases, [](const HiddenCase& c) {
    return c.name.find(FLAGS_filter) == std::string::npos;
  });
  return cases;
}

template <typename Work>
void InParallel(int count, const Work& work) {
  std::atomic<int> next = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < FLAGS_threads; ++i) {
    threads.emplace_back([&] {
      for (int k = next++; k < count; k = next++) work(k);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

int Main() {
  const std::vector<HiddenCase> cases = Chosen();
  if (FLAGS_list) {
    for (const HiddenCase& c : cases) std::printf("%s\n", c.name.c_str());
    return 0;
  }
  std::vector<Scored> scored;
  std::mutex mutex;
  InParallel(static_cast<int>(cases.size()), [&](int k) {
    const Scored one = RunCase(cases[k]);
    const Outcome& o = one.outcome;
    const std::lock_guard<std::mutex> lock(mutex);
    scored.push_back(one);
    std::string found;
    for (const Outcome::Step& step : o.added) found += " " + step.added.name;
    for (const std::string& name : o.stand_ins) found += " (not " + name + ")";
    std::fprintf(stderr, "%zu/%zu %s: %s %.2f -> %.2f%s,%s, %.1f s %s\n",
                 scored.size(), cases.size(), cases[k].name.c_str(),
                 o.verdict.c_str(), o.train_before, o.train_after,
                 one.complete() || one.Hit() ? "" : " MISSED", found.c_str(),
                 o.seconds, o.fault.c_str());
    // What is done is kept, whatever comes after.
    if (!FLAGS_csv.empty()) WriteFileAtomically(FLAGS_csv, SuiteCsv(scored));
    if (!FLAGS_out.empty()) WriteFileAtomically(FLAGS_out, SuiteTable(scored));
  });
  const std::string table = SuiteTable(scored);
  std::printf("%s", table.c_str());
  return 0;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return sysid::Main();
}
