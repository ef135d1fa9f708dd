#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sysid/studio/studio_model.h"

namespace sysid {

// A folder that is this program's alone, as long as it lives (flock(2) on the
// folder itself: nothing is left there, however the program ends).
class FolderLock {
 public:
  // Throws InputError where another program holds it.
  explicit FolderLock(const std::string& folder);
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  ~FolderLock();

 private:
  const int descriptor_;
};

// The folder in which a session is saved as it happens: studio.json says of
// what model and runs, and lists the models; model-0.json, model-1.json, ...
// are those. Every file is written whole or not at all, a model before the list
// that names it.
class StudioFolder {
 public:
  // Opens the folder of the setup, which is made where it is not there yet (an
  // empty name: nothing is saved). Throws InputError for one that holds another
  // session, or broken files, or in which another studio saves; nothing is then
  // written.
  explicit StudioFolder(const StudioSetup& setup);

  // Those that were saved, which are the first of the session. Once.
  std::vector<std::shared_ptr<const StudioModel>> TakeModels() {
    return std::move(models_);
  }
  // The next model. Throws InputError where it cannot be written; the folder is
  // then as it was before.
  void Save(const StudioModel& model);

 private:
  std::string File(const std::string& name) const;
  std::string NameOf(int id) const;
  void Read();
  void CheckSame(const Json& saved) const;
  void WriteIndex(int models) const;

  std::string folder_;
  std::optional<FolderLock> lock_;
  Json session_;  // what it is a session of
  std::vector<std::shared_ptr<const StudioModel>> models_;
};

}  // namespace sysid
