#include "tests/acceptance/checks/clean_case.h"

#include <filesystem>

#include "sysid/simulation/simulate.h"
#include "tests/acceptance/checks/resampled.h"

namespace sysid {
namespace {

CleanCase Simulated(const std::string& model, bool driven, std::uint64_t seed,
                    const std::string& effect, const std::string& free) {
  const Catalogue catalogue;
  FitRequest request;
  request.model = model;
  request.fits_nothing = true;
  request.free = free;
  request.traj = {"simulated.csv"};
  CleanCase clean{model, OpenModelSession(request, catalogue), false};
  Model truth = clean.session.model;
  if (!effect.empty()) {
    clean.name += " with " + effect;
    const auto made = catalogue.Make(effect, truth.mechanism(), "test");
    truth.AddEffect(made, "test");
    for (const EffectParameter& p : made->parameters()) {
      if (!p.whole) truth.SetEffectParameter(p.name, p.typical_scale);
    }
  }
  SimulationOptions options;
  options.duration = 8.0;
  options.noise = 1e-3;
  options.seed = seed;
  options.excitation = driven ? Excitation::kMultisine : Excitation::kNone;
  options.excitation_level = 0.5;
  const Eigen::VectorXd x0 = RandomState(truth, 1.0, seed);
  clean.session.runs = {Simulate(truth, x0, options)};
  clean.session.runs.front().name = model + ".csv";
  return clean;
}

}  // namespace

std::vector<CleanCase> SimulatedCases(std::uint64_t seed, bool missing) {
  const auto effect = [&](const std::string& name) {
    return missing ? name : std::string();
  };
  std::vector<CleanCase> cases;
  const std::vector<std::string> of_hinge = {
      "coulomb_friction@joint1", "viscous_damping@joint2", "spring@joint1",
      "quadratic_drag@joint2", "armature@joint1"};
  const std::string drawn = of_hinge[seed % of_hinge.size()];
  cases.push_back(Simulated("pendulum2_planar", true, seed, effect(drawn), ""));
  cases.push_back(
      Simulated("pendulum3_planar", false, seed, effect(drawn), ""));
  cases.push_back(
      Simulated("cartpole", true, seed, effect("viscous_damping@slider"), ""));
  cases.push_back(Simulated("pendulum3", false, seed,
                            effect("viscous_damping@joint2"), ""));
  return cases;
}

std::vector<CleanCase> RecordedCases(const std::string& folder) {
  namespace fs = std::filesystem;
  std::vector<CleanCase> cases;
  const Catalogue catalogue;
  const auto add = [&](const std::string& model,
                       const std::vector<std::string>& files, double until) {
    FitRequest request;
    request.model = model;
    for (const std::string& file : files) {
      if (!fs::exists(fs::path(folder) / file)) return;
      request.traj.push_back(fs::path(folder) / file);
    }
    CleanCase clean{model, OpenSession(request, catalogue), true};
    for (Run& run : clean.session.runs) {
      int last = run.size();
      while (last > 2 && run.t[last - 1] > until) --last;
      run = WithoutRows(run, last, run.size());
    }
    cases.push_back(std::move(clean));
  };
  const std::string dfki = "double_pendulum_dfki/traj_";
  // The first two drive both joints, the others one: in pairs that drive both.
  add("double_pendulum_dfki", {dfki + "143339.csv", dfki + "143524.csv"}, 1e9);
  add("double_pendulum_dfki", {dfki + "143704.csv", dfki + "144003.csv"}, 1e9);
  add("double_pendulum_dfki", {dfki + "143747.csv", dfki + "144115.csv"}, 1e9);
  add("emps", {"emps/emps.csv"}, 1e9);
  const std::string simple = "simple_pendulum_dfki/";
  add("simple_pendulum_dfki", {simple + "ddp.csv"}, 6.0);
  add("simple_pendulum_dfki", {simple + "direct_collocation.csv"}, 3.5);
  add("simple_pendulum_dfki", {simple + "energy_shaping.csv"}, 3.8);
  add("video_pendulum", {"video_pendulum/pendulum.csv"}, 1e9);
  return cases;
}

}  // namespace sysid
