// Whether the way does not matter to the diagnosis of a recording: takes flags
// of sysid_diagnose (--model, --traj, --holdout, --columns, --free, --spec) and
// prints the answer of each way of tests/acceptance/hidden/way.h. What the
// first found is the truth of `one_more`. Exit code 1 where they differ.

#include <cstdio>
#include <set>
#include <string>

#include "gflags/gflags.h"
#include "models/error.h"
#include "sysid/diagnosis/effect_search.h"
#include "sysid/session/diagnosis_session.h"
#include "tests/acceptance/hidden/way.h"
#include "tools/fit_flags.h"

namespace sysid {
namespace {

struct Found {
  std::set<std::string> effects;
  std::set<std::set<std::string>> other_names;  // of the same force
  double error = 0.0;
  bool explains = false;
};

Found Search(const FitRequest& request, Way way, const Found& truth) {
  const Catalogue catalogue;
  Session session = OpenSession(request, catalogue);
  if (way == Way::kPerturbed) {
    Perturb(&session.runs);
    Perturb(&session.holdout);
  }
  std::vector<std::string> notices;
  const DiagnosisProblem problem = OpenDiagnosis(session, &notices);
  Candidates candidates = ChooseCandidates(catalogue, session, {}, "test");
  constexpr uint64_t kSeed = 1;
  const std::vector<int> start = BeginOn(
      way, kSeed, {truth.effects.begin(), truth.effects.end()}, &candidates);
  EffectSearch search(problem, candidates, [](const std::string&, double) {});
  const EffectSearch::Answer answer = search.Run(start);
  const auto names = [&](const std::vector<int>& effects) {
    std::set<std::string> all;
    for (const int e : effects) all.insert(candidates[e]->name());
    return all;
  };
  Found found{
      names(answer.found->effects), {}, answer.found->error(), answer.explains};
  for (const auto& effects : answer.same_force) {
    found.other_names.insert(names(effects));
  }
  return found;
}

int Main() {
  FitRequest request = RequestFromFlags();
  request.may_free_nothing = true;
  request.assumes_inertia = true;
  Found first;
  bool same = true;
  for (const Way way : kAllWays) {
    const Found found = Search(request, way, first);
    const char* is = "";
    if (way == Way::kGiven) {
      first = found;
    } else if (found.effects != first.effects) {
      const bool name = first.other_names.contains(found.effects);
      is = name ? " (the same force)" : " (another)";
      same &= name;
    }
    std::printf("%-10s %s %.4g %s%s\n", NameOf(way),
                found.explains ? "explained  " : "unexplained", found.error,
                Join({found.effects.begin(), found.effects.end()}).c_str(), is);
    std::fflush(stdout);
  }
  return same ? 0 : 1;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  try {
    return sysid::Main();
  } catch (const sysid::InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
