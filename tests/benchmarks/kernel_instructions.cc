// Evaluates the forward dynamics so often: for Callgrind, whose count of
// instructions is the same on every run (scripts/benchmark takes the difference
// of two counts, so that loading the model does not show).
//
//   kernel_instructions MODEL double|Jet8|Jet16|Jet24 COUNT

#include <cstdio>
#include <cstdlib>
#include <string>
#include <type_traits>
#include <vector>

#include "glog/logging.h"
#include "models/dynamics.h"
#include "models/effects/catalogue.h"
#include "models/find_model.h"
#include "models/model.h"
#include "models/urdf/load_urdf.h"

namespace sysid {
namespace {

template <typename T>
int Evaluate(const std::string& name, int count) {
  const Model model = MakeModel(LoadUrdf(FindModel(name)), Catalogue());
  std::vector<T> x(model.state_size(), T(0.0)), tau(model.nv()),
      qdd(model.nv());
  const Eigen::VectorXd neutral = model.mechanism().NeutralConfiguration();
  for (int i = 0; i < model.nq(); ++i) x[i] = T(neutral[i]);
  for (int i = 0; i < model.nv(); ++i) {
    x[model.nq() + i] = T(0.5 + 0.1 * i);
    tau[i] = T(0.02 * (i + 1));
    if constexpr (!std::is_same_v<T, double>) {
      x[model.nq() + i].v[i % T::DIMENSION] = 1.0;
    }
  }
  Workspace<T> ws(model);
  for (int i = 0; i < count; ++i) {
    if (!ForwardDynamics<T>(&ws, x.data(), x.data() + model.nq(), tau.data(),
                            qdd.data())) {
      return 1;
    }
  }
  return 0;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  if (argc != 4) {
    std::fprintf(stderr, "usage: %s MODEL double|Jet8|Jet16|Jet24 COUNT\n",
                 argv[0]);
    return 2;
  }
  const std::string model = argv[1], scalar = argv[2];
  const int count = std::atoi(argv[3]);
  if (scalar == "double") return sysid::Evaluate<double>(model, count);
  if (scalar == "Jet8") return sysid::Evaluate<sysid::Jet8>(model, count);
  if (scalar == "Jet16") return sysid::Evaluate<sysid::Jet16>(model, count);
  return sysid::Evaluate<sysid::Jet24>(model, count);
}
