#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "sysid/studio/studio_folder.h"
#include "sysid/studio/studio_model.h"

namespace sysid {

// A change while another is fitted.
class StudioBusy : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Where a reader of the events is.
struct StudioCursor {
  bool begun = false;
  size_t ended = 0;  // fits whose end it knows
  int progress = 0;  // the newest report it knows
};

// The live session behind the page: models, each the model as given with
// effects added or removed, and at most one fit at a time on a thread of its
// own. All members may be called from any thread. One mutex guards what
// changes; it is never held during a fit, nor while text is made of a model.
class Studio {
 public:
  // Opens the folder and what was saved there; fits nothing yet. Throws
  // InputError.
  explicit Studio(StudioSetup setup);
  ~Studio();  // as Close()
  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;

  // Each starts a fit and returns. They throw StudioBusy while another runs,
  // InputError for a model that is not there and a change that cannot be made.
  // The model as given, where it is not yet there.
  void Start();
  // `effects`: one name, or several separated by commas.
  void Add(int model, const std::string& effects);
  void Remove(int model, const std::string& effect);

  // Stops the fit that runs, if any; "cancelled" tells when it has ended.
  void Cancel();
  // Cancels, waits for the fit to end, and sends the readers of events home.
  void Close();

  int models() const;  // how many there are
  // PageData of web/src/page_data.ts, as JSON.
  std::string Page() const;
  // A file of a model ("identified.urdf"); none where there is no such thing.
  std::optional<std::string> File(int model, const std::string& name) const;

  // The StudioEvents of page_data.ts that a reader does not know, as JSON;
  // waits for one, at most `patience`. The first says what is so now. Of
  // progress only the newest is kept, so that no reader holds up a fit. None
  // after Close().
  std::vector<std::string> NextEvents(std::chrono::milliseconds patience,
                                      StudioCursor* cursor) const;
  bool closed() const;

 private:
  using Model = std::shared_ptr<const StudioModel>;

  // The model to be changed. Throws StudioBusy, InputError.
  Model Admit(int id) const;
  void Change(StudioChange change);  // checked
  void Launch(StudioChange change);
  void Work(const std::stop_token& stop, const StudioChange& change, int id);
  void Report(const std::string& title, double start_s,
              const Progress& progress);

  const StudioSetup setup_;
  const Json header_;  // PageData without models

  StudioFolder folder_;       // the worker's
  mutable std::mutex mutex_;  // of all below
  mutable std::condition_variable changed_;
  std::vector<Model> models_;  // by id
  bool running_ = false;
  bool closed_ = false;
  Json progress_;  // of the fit that runs
  int reports_ = 0;
  double reported_s_ = 0.0;
  std::vector<Json> ended_;  // how each fit ended
  std::jthread worker_;
};

}  // namespace sysid
