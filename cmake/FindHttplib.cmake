# cpp-httplib, which Debian has in the package libcpp-httplib-dev, compiled:
#   Httplib_FOUND, Httplib_INCLUDE_DIR, Httplib_LIBRARY, Httplib_DEFINITIONS.
# Its types depend on the definitions, which must be those of the library.
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(PC_Httplib QUIET cpp-httplib)
endif()
find_path(Httplib_INCLUDE_DIR httplib.h HINTS ${PC_Httplib_INCLUDE_DIRS})
find_library(Httplib_LIBRARY cpp-httplib HINTS ${PC_Httplib_LIBRARY_DIRS})
set(Httplib_DEFINITIONS ${PC_Httplib_CFLAGS_OTHER})
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Httplib
  REQUIRED_VARS Httplib_LIBRARY Httplib_INCLUDE_DIR PC_Httplib_FOUND
  VERSION_VAR PC_Httplib_VERSION)
mark_as_advanced(Httplib_INCLUDE_DIR Httplib_LIBRARY)
