# `cmake --install` gives headers, libraries, programs, the shipped robots, and
# a package for find_package(sysid). Included after every target is made.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

get_property(sysid_libraries GLOBAL PROPERTY SYSID_LIBRARIES)
get_property(sysid_programs GLOBAL PROPERTY SYSID_PROGRAMS)
set(sysid_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/sysid)
set(sysid_robots_dir ${CMAKE_INSTALL_DATADIR}/sysid/robots)

install(TARGETS ${sysid_libraries} sysid EXPORT sysidTargets)
if(sysid_programs)
  install(TARGETS ${sysid_programs})
endif()
install(DIRECTORY models residuals sysid
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sysid
  FILES_MATCHING PATTERN "*.h")
install(DIRECTORY data/robots/ DESTINATION ${sysid_robots_dir}
  FILES_MATCHING PATTERN "*.urdf" PATTERN "*.yaml")

install(EXPORT sysidTargets NAMESPACE sysid::
  DESTINATION ${sysid_package_dir})
configure_package_config_file(cmake/sysidConfig.cmake.in
  ${CMAKE_CURRENT_BINARY_DIR}/sysidConfig.cmake
  INSTALL_DESTINATION ${sysid_package_dir}
  PATH_VARS sysid_robots_dir)
write_basic_package_version_file(
  ${CMAKE_CURRENT_BINARY_DIR}/sysidConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${CMAKE_CURRENT_BINARY_DIR}/sysidConfig.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/sysidConfigVersion.cmake
  DESTINATION ${sysid_package_dir})
