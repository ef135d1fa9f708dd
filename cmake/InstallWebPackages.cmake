# cmake -DNPM= -DSOURCE=web -DSTAGE=... -P: the packages of web/package-lock.json
# in STAGE/node_modules, then STAGE/packages.stamp.
file(COPY ${SOURCE}/package.json ${SOURCE}/package-lock.json
  DESTINATION ${STAGE})
execute_process(
  COMMAND ${NPM} ci --prefer-offline --no-audit --no-fund --loglevel=error
  WORKING_DIRECTORY ${STAGE}
  RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT result EQUAL 0)
  file(REMOVE ${STAGE}/packages.stamp)
  message(FATAL_ERROR "npm could not get the packages of "
    "web/package-lock.json:\n${output}\n"
    "The first build of the page needs the network (or npm's cache). Without "
    "it, configure with -DSYSID_WEB=OFF: everything but report.html and the "
    "page of sysid_studio is then built.")
endif()
file(TOUCH ${STAGE}/packages.stamp)
