# cmake -DSOURCE=... -DHEADER=... -P: HEADER with the commit of the folder SOURCE,
# empty where it is no repository (a release's archive). Written only where that
# has changed, so that only the file that includes it is compiled again.
cmake_minimum_required(VERSION 3.25)
set(commit "")
if(EXISTS ${SOURCE}/.git)  # not that of a repository around it
  find_program(GIT_PROGRAM git)
  if(GIT_PROGRAM)
    execute_process(
      COMMAND ${GIT_PROGRAM} --no-optional-locks
        describe --always --dirty --exclude=*
      WORKING_DIRECTORY ${SOURCE}
      OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  endif()
endif()
file(CONFIGURE OUTPUT ${HEADER}
  CONTENT "inline constexpr char kCommit[] = \"@commit@\";\n" @ONLY)
