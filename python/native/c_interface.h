#pragma once

// What the Python package calls by ctypes: one function that does everything,
// by name, on plain values. A request is a JSON text, a recording a table of
// pointers; what comes back is a JSON text, arrays, and what later calls may
// ask on. docs/decisions/0030-python-by-a-c-interface.md says why.

#include <stddef.h>

#define SYSID_EXPORT __attribute__((visibility("default")))

extern "C" {

struct sysid_object;   // a result: a model, a run, a fit, a diagnosis, an error
struct sysid_control;  // of a call that runs: progress, and a way to end it

// Named columns of `rows` numbers each that lie `strides` numbers apart.
struct sysid_table {
  const char* name;
  size_t rows, columns;
  const char* const* header;
  const double* const* values;
  const ptrdiff_t* strides;
};

enum sysid_code {
  SYSID_DONE = 0,
  SYSID_INPUT_ERROR = 1,  // text: {"place", "what", "hint"}
  SYSID_STOPPED = 2,      // before there was anything to keep
  SYSID_NO_MEMORY = 3,
  SYSID_FAILED = 4  // text: {"what"}
};

// Calls a function of python/native/functions.h. Never throws, never null.
// `control` may be null. From any thread; objects may be shared by threads.
SYSID_EXPORT sysid_object* sysid_call(const char* function, const char* request,
                                      const sysid_object* const* objects,
                                      size_t object_count,
                                      const sysid_table* tables,
                                      size_t table_count,
                                      sysid_control* control);

SYSID_EXPORT int sysid_object_code(const sysid_object* object);
// Lives as long as the object, as its arrays do.
SYSID_EXPORT const char* sysid_object_text(const sysid_object* object);
SYSID_EXPORT size_t sysid_object_arrays(const sysid_object* object);
SYSID_EXPORT const char* sysid_array_name(const sysid_object* object, size_t i);
// rows x columns numbers, row by row.
SYSID_EXPORT const double* sysid_array_values(const sysid_object* object,
                                              size_t i, size_t* rows,
                                              size_t* columns);
SYSID_EXPORT void sysid_object_free(sysid_object* object);

SYSID_EXPORT sysid_control* sysid_control_new(void);
// Asks the call to end with what there is.
SYSID_EXPORT void sysid_control_stop(sysid_control* control);
// The last report since this was asked: its iteration, how many there are at
// most (0: unknown) and the error in multiples of the noise; `doing` gets what
// is done, at most `size` bytes with the end. 0 where there was no report.
SYSID_EXPORT int sysid_control_progress(sysid_control* control, char* doing,
                                        size_t size, int* iteration, int* of,
                                        double* error);
SYSID_EXPORT void sysid_control_free(sysid_control* control);

SYSID_EXPORT const char* sysid_version(void);
}
