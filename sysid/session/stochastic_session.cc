#include "sysid/session/stochastic_session.h"

#include "sysid/io/csv.h"
#include "sysid/io/memory.h"
#include "sysid/stochastic/transformation.h"

namespace sysid {

void NoteMovedStarts(Session* session) {
  const ShootingProblem problem(session->model, session->free, session->runs,
                                session->options);
  const Transformation transformation(problem);
  for (const int i : transformation.moved()) {
    session->notices.push_back(
        session->free[i].parameter.name + " starts at its bound, where Adam " +
        "has no slope: moved to " + ShortestText(transformation.start()[i]));
  }
}

void CheckMixtureSize(const Session& session, const MixtureOptions& options) {
  // What is kept of every epoch: weights, means and deviations of the kernels;
  // of the epoch that runs: a draw's noise for each kernel.
  const double n = static_cast<double>(session.free.size());
  const double kernels = options.kernels * (2.0 * n + 1.0);
  const double draws = options.draws * options.kernels * (n + 1.0);
  CheckMemory(sizeof(double) * (options.epochs() * kernels + draws), "--epochs",
              "the history of a mixture of that many epochs, kernels and "
              "parameters",
              "give fewer --epochs or --kernels");
}

}  // namespace sysid
