#include "tests/benchmarks/engine.h"

#include <dlfcn.h>

#include "glog/logging.h"
#include "tests/support/mjcf.h"

namespace sysid {

std::unique_ptr<Engine> LoadEngine(const std::string& path,
                                   const Mechanism& mechanism) {
  // Its symbols for itself alone. It stays open: engines live in it.
  void* module = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  CHECK(module != nullptr) << dlerror();
  auto* make =
      reinterpret_cast<MakeEngineFunction*>(dlsym(module, "MakeEngine"));
  CHECK(make != nullptr) << path;
  return std::unique_ptr<Engine>(make(mechanism, ToMjcf(mechanism, {})));
}

}  // namespace sysid
