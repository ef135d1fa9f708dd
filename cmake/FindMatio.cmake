# matio, which Debian has in the package libmatio-dev: Matio_FOUND,
# Matio_INCLUDE_DIR, Matio_LIBRARY.
find_path(Matio_INCLUDE_DIR matio.h)
find_library(Matio_LIBRARY matio)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Matio
  REQUIRED_VARS Matio_LIBRARY Matio_INCLUDE_DIR)
mark_as_advanced(Matio_INCLUDE_DIR Matio_LIBRARY)
