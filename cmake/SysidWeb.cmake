# The page of report.html and sysid_studio: one file that npm builds from web/,
# to be embedded in sysid::report. Sets
#   sysid_PAGE          the file, or empty
#   sysid_PAGE_MISSING  why it is empty, in a sentence for users
# npm works on a copy in the build tree; it needs the network once, for the
# packages of web/package-lock.json.
option(SYSID_WEB "Build the page (report.html); needs npm"
  ${PROJECT_IS_TOP_LEVEL})

# Internal to the cache: the tests ask for them, too.
set(sysid_PAGE "" CACHE INTERNAL "The page")
set(sysid_PAGE_MISSING "" CACHE INTERNAL "Why there is none")
find_program(NPM_PROGRAM npm)
find_program(NODE_PROGRAM NAMES node nodejs)
mark_as_advanced(NPM_PROGRAM NODE_PROGRAM)
set(missing "")
if(NOT SYSID_WEB)
  set(missing "sysid was built without it (SYSID_WEB=OFF)")
elseif(NOT EXISTS ${sysid_SOURCE_DIR}/web/package.json)
  set(missing "sysid was built without its sources, the folder web/")
elseif(NOT NPM_PROGRAM OR NOT NODE_PROGRAM)
  set(missing "sysid was built without npm, which makes it")
endif()
if(missing)
  set_property(CACHE sysid_PAGE_MISSING PROPERTY VALUE "${missing}")
  message(STATUS "No page, so no report.html: ${missing}")
  return()
endif()

set(web_source ${sysid_SOURCE_DIR}/web)
set(web_stage ${sysid_BINARY_DIR}/web/stage)
set_property(CACHE sysid_PAGE PROPERTY VALUE ${sysid_BINARY_DIR}/web/page.html)
file(GLOB_RECURSE web_files CONFIGURE_DEPENDS
  ${web_source}/src/* ${web_source}/build.mjs ${web_source}/tsconfig.json)
set(web_packages ${web_source}/package.json ${web_source}/package-lock.json)

add_custom_command(OUTPUT ${web_stage}/packages.stamp
  COMMAND ${CMAKE_COMMAND} -DNPM=${NPM_PROGRAM} -DSOURCE=${web_source}
    -DSTAGE=${web_stage} -P ${CMAKE_CURRENT_LIST_DIR}/InstallWebPackages.cmake
  DEPENDS ${web_packages} ${CMAKE_CURRENT_LIST_DIR}/InstallWebPackages.cmake
  COMMENT "Getting the page's packages with npm"
  VERBATIM)
add_custom_command(OUTPUT ${sysid_PAGE}
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${web_stage}/src
  COMMAND ${CMAKE_COMMAND} -E copy_directory ${web_source}/src ${web_stage}/src
  COMMAND ${CMAKE_COMMAND} -E copy ${web_source}/build.mjs
    ${web_source}/tsconfig.json ${web_stage}
  COMMAND ${CMAKE_COMMAND} -E chdir ${web_stage}
    ${NPM_PROGRAM} run --silent build -- --out ${sysid_PAGE}
  DEPENDS ${web_files} ${web_stage}/packages.stamp
  COMMENT "Building the page"
  VERBATIM)
