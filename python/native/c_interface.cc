#include "python/native/c_interface.h"

#include <cstring>
#include <map>
#include <new>
#include <stdexcept>

#include "glog/logging.h"
#include "models/error.h"
#include "python/native/functions.h"
#include "sysid/estimation/cancelled.h"

struct sysid_object {
  int code = SYSID_DONE;
  sysid::python::Result result;
};

struct sysid_control {
  sysid::python::Control control;
};

namespace sysid::python {
namespace {

using Function = Result (*)(const Call&);

const std::map<std::string, Function>& Functions() {
  static const auto& functions =
      *new std::map<std::string, Function>{{"load", LoadModel},
                                           {"read", ReadRecording},
                                           {"fit", FitRuns},
                                           {"diagnose", DiagnoseRuns},
                                           {"predict", PredictRun},
                                           {"sample", SampleFit},
                                           {"files", FilesOf},
                                           {"text", TextOf},
                                           {"model", ModelOf},
                                           {"simulate", SimulateRun},
                                           {"predictions", Predictions}};
  return functions;
}

Result Dispatch(const char* function, Call* call, const char* request) {
  call->request = Json::parse(request);
  return Functions().at(function)(*call);
}

void Fail(int code, const Json& text, sysid_object* object) {
  object->code = code;
  object->result = {Compact(text)};
}

}  // namespace

Callbacks Call::MakeCallbacks() const {
  if (control == nullptr) return {};
  Callbacks callbacks;
  callbacks.stop = control->stop.get_token();
  callbacks.progress = [control = control](const Progress& progress) {
    const std::lock_guard lock(control->mutex);
    control->progress = progress;
  };
  return callbacks;
}

}  // namespace sysid::python

using sysid::python::Fail;

extern "C" {

sysid_object* sysid_call(const char* function, const char* request,
                         const sysid_object* const* objects,
                         size_t object_count, const sysid_table* tables,
                         size_t table_count, sysid_control* control) {
  FLAGS_minloglevel = google::GLOG_FATAL;  // Ceres reports each bad step.
  auto* const object = new sysid_object;
  try {
    sysid::python::Call call;
    for (size_t i = 0; i < object_count; ++i) {
      call.objects.push_back(&objects[i]->result);
    }
    for (size_t i = 0; i < table_count; ++i) {
      const sysid_table& table = tables[i];
      sysid::python::TableView view{table.name, table.rows, {}};
      for (size_t c = 0; c < table.columns; ++c) {
        view.columns.push_back(
            {table.header[c], table.values[c], table.strides[c]});
      }
      call.tables.push_back(std::move(view));
    }
    if (control != nullptr) call.control = &control->control;
    object->result = sysid::python::Dispatch(function, &call, request);
  } catch (const sysid::InputError& error) {
    Fail(SYSID_INPUT_ERROR,
         {{"place", error.place()},
          {"what", error.detail()},
          {"hint", error.hint()}},
         object);
  } catch (const sysid::Cancelled&) {
    Fail(SYSID_STOPPED, sysid::Json::object(), object);
  } catch (const std::bad_alloc&) {
    Fail(SYSID_NO_MEMORY, sysid::Json::object(), object);
  } catch (const std::exception& error) {
    Fail(SYSID_FAILED, {{"what", error.what()}}, object);
  }
  return object;
}

int sysid_object_code(const sysid_object* object) { return object->code; }

const char* sysid_object_text(const sysid_object* object) {
  return object->result.text.c_str();
}

size_t sysid_object_arrays(const sysid_object* object) {
  return object->result.arrays.size();
}

const char* sysid_array_name(const sysid_object* object, size_t i) {
  return object->result.arrays[i].name.c_str();
}

const double* sysid_array_values(const sysid_object* object, size_t i,
                                 size_t* rows, size_t* columns) {
  const sysid::RowMatrixXd& values = object->result.arrays[i].values;
  *rows = static_cast<size_t>(values.rows());
  *columns = static_cast<size_t>(values.cols());
  return values.data();
}

void sysid_object_free(sysid_object* object) { delete object; }

sysid_control* sysid_control_new(void) { return new sysid_control; }

void sysid_control_stop(sysid_control* control) {
  control->control.stop.request_stop();
}

int sysid_control_progress(sysid_control* control, char* doing, size_t size,
                           int* iteration, int* of, double* error) {
  const std::lock_guard lock(control->control.mutex);
  std::optional<sysid::Progress>& progress = control->control.progress;
  if (!progress || size == 0) return 0;
  std::strncpy(doing, progress->doing.c_str(), size - 1);
  doing[size - 1] = '\0';
  *iteration = progress->iteration;
  *of = progress->of;
  *error = progress->error;
  progress.reset();
  return 1;
}

void sysid_control_free(sysid_control* control) { delete control; }

const char* sysid_version(void) { return SYSID_VERSION; }
}
