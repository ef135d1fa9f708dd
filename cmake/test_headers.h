// Precompiled for the tests (cmake/SysidTarget.cmake).
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "cmake/library_headers.h"
