# Run after a test program is linked: writes into OUTPUT the tests that CTest
# sees of PROGRAM, one a suite, or one a case where EACH_CASE.
execute_process(COMMAND ${PROGRAM} --gtest_list_tests
  OUTPUT_VARIABLE listed RESULT_VARIABLE failed)
if(failed)
  file(REMOVE ${PROGRAM})  # so that the next build tries again
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests failed: ${failed}")
endif()

set(text "")
function(add_entry name filter)
  string(APPEND text
    "add_test([=[${name}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${filter}]=])\n"
    "set_tests_properties([=[${name}]=] PROPERTIES LABELS [=[${LABEL}]=] "
    "TIMEOUT ${TIMEOUT} COST ${COST})\n")
  set(text "${text}" PARENT_SCOPE)
endfunction()

string(REPLACE ";" "," listed "${listed}")
string(REPLACE "\n" ";" lines "${listed}")
foreach(line IN LISTS lines)
  string(REGEX REPLACE " *#.*$" "" name "${line}")  # of which parameter
  if(line MATCHES "^ " AND EACH_CASE)
    string(STRIP "${name}" case)
    add_entry("${PREFIX}.${suite}${case}" "${suite}${case}")
  elseif(name MATCHES "^[A-Za-z0-9_/]+\\.$")
    set(suite "${name}")
    if(NOT EACH_CASE)
      string(REGEX REPLACE "\\.$" "" bare "${suite}")
      add_entry("${PREFIX}.${bare}" "${suite}*")
    endif()
  endif()
endforeach()
file(WRITE ${OUTPUT} "${text}")
