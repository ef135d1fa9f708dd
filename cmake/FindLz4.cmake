# lz4 with its frames, which Debian has in the package liblz4-dev: Lz4_FOUND,
# Lz4_INCLUDE_DIR, Lz4_LIBRARY.
find_path(Lz4_INCLUDE_DIR lz4frame.h)
find_library(Lz4_LIBRARY lz4)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Lz4
  REQUIRED_VARS Lz4_LIBRARY Lz4_INCLUDE_DIR)
mark_as_advanced(Lz4_INCLUDE_DIR Lz4_LIBRARY)
