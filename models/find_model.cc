#include "models/find_model.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <set>

#include "models/error.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;

// In the order in which they are searched; they need not exist.
std::vector<fs::path> RobotFolders() {
  std::vector<fs::path> folders;
  const char* data_dir = std::getenv("SYSID_DATA_DIR");
  if (data_dir && *data_dir) folders.push_back(fs::path(data_dir) / "robots");
  folders.push_back(fs::path(SYSID_SOURCE_DATADIR) / "robots");
  const auto add_beside = [&](const fs::path& file) {
    folders.push_back(file.parent_path().parent_path() / "share/sysid/robots");
  };
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) add_beside(program);
  // Part of a shared library, in a program of others (Python).
  Dl_info here;
  if (dladdr(reinterpret_cast<void*>(&RobotFolders), &here) != 0) {
    const fs::path library = fs::canonical(here.dli_fname, error);
    if (!error) add_beside(library);
  }
  folders.push_back(fs::path(SYSID_INSTALL_DATADIR) / "robots");
  return folders;
}

}  // namespace

std::string FindModel(const std::string& name_or_file) {
  if (name_or_file.find('/') != std::string::npos ||
      name_or_file.ends_with(".urdf")) {
    return name_or_file;
  }
  if (name_or_file.empty()) {
    throw InputError("--model", "no model is named",
                     "a URDF file, or one of: " + Join(ShippedModels()));
  }
  std::error_code error;
  for (const fs::path& folder : RobotFolders()) {
    const fs::path file = folder / (name_or_file + ".urdf");
    if (fs::is_regular_file(file, error)) return file.string();
  }
  const bool yaml =
      name_or_file.ends_with(".yaml") || name_or_file.ends_with(".yml");
  throw InputError("--model",
                   "no shipped model is named '" + name_or_file + "'",
                   yaml ? "a fit specification is given by --spec"
                        : NameHint(name_or_file, ShippedModels()));
}

std::vector<std::string> ShippedModels() {
  std::set<std::string> names;
  for (const fs::path& folder : RobotFolders()) {
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end;
         it.increment(error)) {
      if (it->path().extension() == ".urdf") {
        names.insert(it->path().stem().string());
      }
    }
  }
  return {names.begin(), names.end()};
}

}  // namespace sysid
