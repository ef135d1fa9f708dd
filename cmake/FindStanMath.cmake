# Stan Math's headers, which Debian has in the package r-cran-stanheaders:
#   StanMath_FOUND, StanMath_INCLUDE_DIR, StanMath_VERSION.
# Headers only; they need those of Boost and Eigen.
find_path(StanMath_INCLUDE_DIR stan/math/rev/core.hpp
  PATHS
    /usr/lib/R/site-library/StanHeaders/include
    /usr/local/lib/R/site-library/StanHeaders/include
    /usr/lib/R/library/StanHeaders/include)
if(StanMath_INCLUDE_DIR)
  file(STRINGS ${StanMath_INCLUDE_DIR}/stan/math/version.hpp version_lines
    REGEX "#define STAN_MATH_(MAJOR|MINOR|PATCH) ")
  string(REGEX REPLACE "[^0-9;]" "" version_parts "${version_lines}")
  string(REPLACE ";" "." StanMath_VERSION "${version_parts}")
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(StanMath
  REQUIRED_VARS StanMath_INCLUDE_DIR
  VERSION_VAR StanMath_VERSION)
mark_as_advanced(StanMath_INCLUDE_DIR)
