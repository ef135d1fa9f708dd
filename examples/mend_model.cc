// mend_model: reads a model and recordings, asks which effect is missing, adds
// what is found and fits again. The recordings have an effect that the model
// lacks: docs/from_wrong_to_right.md goes the same way by the programs.
#include <cstdio>

#include "models/error.h"
#include "sysid/api/diagnose.h"
#include "sysid/api/identify.h"

int main() {
  using namespace sysid;
  try {
    DiagnoseRequest question;
    question.model = "pendulum2_planar";
    question.traj = {"data/runs/hidden_1.csv", "data/runs/hidden_2.csv"};
    question.holdout = {"data/runs/hidden_3.csv"};
    const DiagnoseResult found = Diagnose(question);
    std::printf("%s, error %.2f times the noise\n",
                ToString(found.diagnosis.verdict).c_str(),
                found.diagnosis.base.train_error());

    const IdentifyResult mended = Identify({WithStep(question, found.next)});
    for (const std::string& effect : found.next.add) {
      std::printf("added %s\n", effect.c_str());
    }
    for (const ParameterEstimate& p : mended.fit().parameters) {
      std::printf("%s = %.5f +- %.5f %s\n", p.name.c_str(), p.value,
                  1.96 * p.std_error, p.unit.c_str());
    }
    const double error = mended.fit().train.total.normalized_rms;
    std::printf("error %.2f times the noise\n", error);
    return mended.fit().converged && error < 1.1 ? 0 : 1;
  } catch (const InputError& error) {  // a file or a name is wrong
    std::fprintf(stderr, "error: %s\n", error.what());
    return 2;
  }
}
