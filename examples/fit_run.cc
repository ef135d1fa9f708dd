// fit_run: identifies the three lengths of a pendulum from a recording, and
// says how well each is known. The model starts with 0.5 m for all of them.
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "models/error.h"
#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/estimation/fit.h"
#include "sysid/io/read_run.h"

int main() {
  using namespace sysid;
  try {
    // Topology and nominal values, from a URDF.
    const Catalogue catalogue;
    const Model model = MakeModel(LoadUrdf(FindModel("pendulum3")), catalogue);

    // A recording. Notices say what of the file was ignored.
    std::vector<std::string> notices;
    std::vector<Run> runs;
    runs.push_back(
        ReadRun("data/runs/pendulum3.csv", {}, model.mechanism(), &notices));
    for (const std::string& notice : notices) {
      std::printf("note: %s\n", notice.c_str());
    }

    // What is free, from where, within what.
    std::vector<FreeParameter> free;
    for (const Parameter& parameter : FindParameters(
             model, {"link1.length", "link2.length", "link3.length"}, "here")) {
      FreeParameter wanted;
      wanted.parameter = parameter;
      wanted.initial = parameter.nominal;
      wanted.lower = 0.05;
      wanted.upper = 2.0;
      free.push_back(wanted);
    }

    // The noise, the length of segments and the integration step are chosen
    // from the data unless the options say otherwise.
    EstimationOptions options;
    options.threads = 2;
    ShootingProblem problem(model, free, std::move(runs), options);
    const Fit fit = FitLevenbergMarquardt(problem);

    for (const ParameterEstimate& p : fit.parameters) {
      std::printf("%s = %.5f %s, from %.5f to %.5f with 95 %%\n",
                  p.name.c_str(), p.value, p.unit.c_str(), p.ci95[0],
                  p.ci95[1]);
    }
    std::printf("error %.2f times the noise of %.2g; %d iterations: %s\n",
                fit.train.total.normalized_rms, fit.noise, fit.iterations,
                fit.termination.c_str());
    // fit.model is the model with the estimates in it.
    return fit.converged ? 0 : 1;
  } catch (const InputError& error) {  // a file or a name is wrong
    std::fprintf(stderr, "error: %s\n", error.what());
    return 2;
  }
}
