#include "sysid/diagnosis/shared_refits.h"

#include <algorithm>
#include <mutex>
#include <string>

#include "sysid/diagnosis/packed_model.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

// Every `of`-th of the refits from place `first` on, in parallel.
void RefitEvery(const DiagnosisProblem& problem, const EvaluatedModel& before,
                int first, int of, std::vector<CandidateRefit>* refits) {
  const int all = static_cast<int>(refits->size());
  const int count = (all - first + of - 1) / of;
  if (count <= 0) return;
  EstimationOptions options = problem.options;
  options.threads = ThreadsOfEach(count, problem.options.threads);
  std::mutex mutex;
  int done = 0;
  const auto report = [&] {
    if (!problem.options.progress) return;
    problem.options.progress(
        {"refitting " + std::to_string(all) + " candidates", done, count,
         before.train_error()});
  };
  report();
  ParallelFor(count, problem.options.threads, [&](int i) {
    CandidateRefit& refit = (*refits)[first + i * of];
    std::vector<const ScreenedEffect*> effects;
    for (const ScreenedEffect& e : refit.expected) effects.push_back(&e);
    refit.after = EvaluateWith(problem, before, effects,
                               TrialOptions(options, refit.predicted));
    refit.refused = WhyRefused(problem, before, refit, all);
    const std::lock_guard lock(mutex);
    ++done;
    report();
    return true;
  });
}

// The share of this process, and to the first one what came of the others'.
void RefitTogether(const DiagnosisProblem& problem,
                   const Candidates& candidates, const EvaluatedModel& before,
                   std::vector<CandidateRefit>* refits) {
  const Processes& all = *problem.helpers;
  const size_t count = refits->size();
  bool cancelled = false;
  try {
    RefitEvery(problem, before, all.rank(), all.size(), refits);
  } catch (const Cancelled&) {
    cancelled = true;
  }
  Packer own;
  own.Put(cancelled ? 1.0 : 0.0);
  for (size_t i = all.rank(); i < count && !cancelled && all.rank() > 0;
       i += all.size()) {
    own.Put(Pack(*(*refits)[i].after));
    own.Put((*refits)[i].refused);
  }
  const std::vector<std::string> parts = all.Gather(own.bytes());
  for (size_t from = 0; from < parts.size(); ++from) {
    Unpacker part(parts[from]);
    cancelled = part.Number() != 0.0 || cancelled;
    for (size_t i = from; i < count && !part.AtEnd(); i += all.size()) {
      (*refits)[i].after = UnpackModel(part.Text(), problem, candidates);
      (*refits)[i].refused = part.Text();
    }
  }
  if (cancelled && all.rank() == 0) throw Cancelled();
}

}  // namespace

void RefitProposals(const DiagnosisProblem& problem,
                    const Candidates& candidates, const EvaluatedModel& before,
                    std::vector<CandidateRefit>* refits) {
  if (refits->size() < 2 || problem.helpers->size() == 1) {
    RefitEvery(problem, before, 0, 1, refits);
    return;
  }
  Packer task;
  task.Put(Pack(before));
  task.Put(Pack(*refits));
  problem.helpers->Share(task.bytes());
  RefitTogether(problem, candidates, before, refits);
}

void HelpToRefit(const DiagnosisProblem& problem,
                 const Candidates& candidates) {
  for (;;) {
    const std::string task = problem.helpers->Share("");
    if (task.empty()) return;
    Unpacker unpacker(task);
    const EvaluatedModel before =
        UnpackModel(unpacker.Text(), problem, candidates);
    std::vector<CandidateRefit> refits =
        UnpackRefits(unpacker.Text(), candidates);
    RefitTogether(problem, candidates, before, &refits);
  }
}

}  // namespace sysid
