# How the project's targets are made:
#   sysid_add_library(io SOURCES a.cc DEPENDS ...)          -> sysid::io
#   sysid_add_library(models PHYSICS SOURCES ...), with -O3
#   sysid_add_program(sysid_fit SOURCES fit.cc DEPENDS ...)
# Both are installed. Folders include only downwards (scripts/check_includes):
# tools -> sysid -> residuals -> models.

# Off in the preset `portable`, which so finds what a file forgets to include.
option(SYSID_PRECOMPILE "Parse the libraries' headers once for all files"
  ${PROJECT_IS_TOP_LEVEL})

# Off in `portable` for the same reason, and in `debug`, where one file at a time
# is changed: a batch is compiled again for each of its files.
option(SYSID_UNITY "Compile the files of a library in batches"
  ${PROJECT_IS_TOP_LEVEL})

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # The sloppiness that ccache's manual asks for with precompiled headers; paths
  # from here, so that another clone finds what this one compiled.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env
    CCACHE_SLOPPINESS=pch_defines,time_macros
    CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=true
    ${CCACHE_PROGRAM})
endif()

set(SYSID_SANITIZE "" CACHE STRING
  "Sanitizer: empty, address (with undefined behaviour), thread or fuzzer")
set_property(CACHE SYSID_SANITIZE PROPERTY STRINGS "" address thread fuzzer)
if(SYSID_SANITIZE STREQUAL "address")
  # Not what asks at every use of a pointer: g++ takes twice as long then, and
  # nulls and ends of objects are what the address sanitizer sees as well.
  set(sysid_sanitize_flags -fsanitize=address,undefined
    -fno-sanitize=alignment,null,object-size,vptr
    -fno-sanitize-recover=all -fno-omit-frame-pointer)
elseif(SYSID_SANITIZE STREQUAL "thread")
  set(sysid_sanitize_flags -fsanitize=thread -fno-omit-frame-pointer)
elseif(SYSID_SANITIZE STREQUAL "fuzzer")
  # libFuzzer's counters with the address and undefined-behaviour sanitizers. Not
  # vptr: it takes for wrong that EffectOf's base part keeps a reference to the
  # effect that is made.
  set(sysid_sanitize_flags -fsanitize=fuzzer-no-link,address,undefined
    -fno-sanitize=vptr -fno-sanitize-recover=all -fno-omit-frame-pointer)
elseif(SYSID_SANITIZE)
  message(FATAL_ERROR "SYSID_SANITIZE is '${SYSID_SANITIZE}'; it can be empty, "
    "address, thread or fuzzer")
endif()

# The instruction set that the whole build is for, as in the preset x86-64-v3.
string(REGEX MATCH "-march=[^ ]+" sysid_march "${CMAKE_CXX_FLAGS}")

# What every target of the project is compiled with.
function(sysid_compile_options target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  # g++ 12 takes the undefined registers of its own AVX-512 intrinsics for
  # uninitialised variables (its bug 105593), their loads of a 3-vector for reads
  # beyond it, and inlined operations of std::string for overlaps (105651) and,
  # with precompiled headers, for copies beyond the text.
  target_compile_options(${target} PRIVATE -Wall -Wextra
    $<$<CXX_COMPILER_ID:GNU>:-Wno-uninitialized>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overread>)
  # Collecting no garbage below a GB takes g++ 2 to 5 % less time, but up to
  # 1.5 GB instead of one.
  target_compile_options(${target} PRIVATE
    "$<$<CXX_COMPILER_ID:GNU>:SHELL:--param ggc-min-heapsize=300000>")
  if(SYSID_PRECOMPILE)  # as ccache's manual asks
    target_compile_options(${target} PRIVATE
      $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>
      "$<$<CXX_COMPILER_ID:Clang>:SHELL:-Xclang -fno-pch-timestamp>")
  endif()
  if(SYSID_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  # Users are compiled for the same instructions: their effects are part of the
  # kernel. And matrices pass between them and us: Eigen's allocator must not
  # differ where theirs are compiled for others all the same
  # (docs/decisions/0003-native-build.md).
  if(SYSID_NATIVE)
    target_compile_options(${target} PRIVATE -march=native)
    target_compile_definitions(${target} PUBLIC EIGEN_MALLOC_ALREADY_ALIGNED=0)
    if(PROJECT_IS_TOP_LEVEL)
      target_compile_options(${target} INTERFACE
        $<INSTALL_INTERFACE:-march=native>)
    else()
      target_compile_options(${target} INTERFACE -march=native)
    endif()
  elseif(sysid_march)  # a project around us has it, too
    target_compile_definitions(${target} INTERFACE
      $<INSTALL_INTERFACE:EIGEN_MALLOC_ALREADY_ALIGNED=0>)
    target_compile_options(${target} INTERFACE
      $<INSTALL_INTERFACE:${sysid_march}>)
  endif()
  if(sysid_sanitize_flags)
    target_compile_options(${target} PRIVATE ${sysid_sanitize_flags})
    target_link_options(${target} PUBLIC ${sysid_sanitize_flags})
  endif()
  if(SYSID_NAN_MATRICES)
    target_compile_definitions(${target} PUBLIC
      $<BUILD_INTERFACE:EIGEN_INITIALIZE_MATRICES_BY_NAN>)
  endif()
  # Debian's libceres is built for SSE2: Eigen's objects must agree with it about
  # alignment, whatever we compile for, and its inline functions must not be
  # taken from our objects (hence hidden). Public: who links the library agrees
  # too (docs/decisions/0003-native-build.md).
  target_compile_definitions(${target} PUBLIC EIGEN_MAX_ALIGN_BYTES=16)
  set_target_properties(${target} PROPERTIES
    CXX_EXTENSIONS OFF
    CXX_VISIBILITY_PRESET hidden
    VISIBILITY_INLINES_HIDDEN ON)
endfunction()

# What calls the physics, and reads and writes: its time goes into the physics and
# the decompositions (models/, -O3). -O3 here takes a seventh more of the
# compiler's time; whether it runs faster was not measured.
set(sysid_optimisation $<$<CONFIG:Release>:-O2>)

# sysid_add_precompiled(SET LIBRARY...): the headers of cmake/SET.h, parsed once;
# parsing is half of the compiler's time for most files.
function(sysid_add_precompiled set)
  if(SYSID_PRECOMPILE)
    set(source ${CMAKE_CURRENT_BINARY_DIR}/${set}.cc)
    file(WRITE ${source} "")
    add_library(precompiled_${set} OBJECT ${source})
    target_include_directories(precompiled_${set} PRIVATE ${sysid_SOURCE_DIR})
    target_link_libraries(precompiled_${set} PRIVATE ${ARGN})
    sysid_compile_options(precompiled_${set})
    target_compile_options(precompiled_${set} PRIVATE ${sysid_optimisation})
    target_precompile_headers(precompiled_${set} PRIVATE
      ${sysid_SOURCE_DIR}/cmake/${set}.h)
  endif()
endfunction()

# sysid_precompile(TARGET SET): lets a target read them.
function(sysid_precompile target set)
  if(SYSID_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM precompiled_${set})
  endif()
endfunction()

# sysid_batches(TARGET SIZE): its files are compiled some at a time, in half of the
# compiler's time (headers, and templates that all of them instantiate, once a
# batch); as many as take about 1 GB. Files with options of their own stay alone.
function(sysid_batches target size)
  if(SYSID_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON
      UNITY_BUILD_BATCH_SIZE ${size})
  endif()
endfunction()

function(sysid_add_library name)
  cmake_parse_arguments(arg "PHYSICS" "BATCH" "SOURCES;DEPENDS" ${ARGN})
  add_library(sysid_${name} STATIC ${arg_SOURCES})
  add_library(sysid::${name} ALIAS sysid_${name})
  set_target_properties(sysid_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(sysid_${name} PUBLIC
    $<BUILD_INTERFACE:${sysid_SOURCE_DIR}>
    $<INSTALL_INTERFACE:include/sysid>)
  target_link_libraries(sysid_${name} PUBLIC ${arg_DEPENDS})
  sysid_compile_options(sysid_${name})
  if(NOT arg_PHYSICS)
    target_compile_options(sysid_${name} PRIVATE ${sysid_optimisation})
    sysid_precompile(sysid_${name} library_headers)
  endif()
  if(NOT arg_BATCH)
    set(arg_BATCH 5)
  endif()
  sysid_batches(sysid_${name} ${arg_BATCH})
  set_property(GLOBAL APPEND PROPERTY SYSID_LIBRARIES sysid_${name})
endfunction()

function(sysid_add_program name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_DEPENDS})
  sysid_compile_options(${name})
  target_compile_options(${name} PRIVATE ${sysid_optimisation})
  sysid_precompile(${name} library_headers)
  set_property(GLOBAL APPEND PROPERTY SYSID_PROGRAMS ${name})
endfunction()

# Files that instantiate the physics on Jets: g++'s limits on inlining would
# leave calls to Eigen's one-line loops in every product (measured for an ABA on
# Jets of 24: 25 against 5 microseconds; docs/decisions/0002-jet-widths.md). A
# precompiled header brings the limits that it was compiled with, and g++ takes
# those, without a word.
function(sysid_kernel_sources)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT SYSID_SANITIZE)
    set_source_files_properties(${ARGN} PROPERTIES
      COMPILE_OPTIONS
        "--param=inline-unit-growth=1000;--param=large-function-growth=10000;--param=large-stack-frame-growth=10000;--param=max-inline-insns-single=2000;--param=max-inline-insns-auto=400;--param=large-unit-insns=100000"
      SKIP_PRECOMPILE_HEADERS ON)
  endif()
endfunction()

# Files whose time goes into 3-by-3 products of doubles: Eigen asks g++ to inline
# its one-line functions, but does not insist as it does with other compilers
# (docs/decisions/0019-inlined-eigen.md).
function(sysid_inline_eigen)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT SYSID_SANITIZE)
    set_source_files_properties(${ARGN} PROPERTIES
      COMPILE_DEFINITIONS
        "EIGEN_STRONG_INLINE=inline __attribute__((always_inline))"
      SKIP_PRECOMPILE_HEADERS ON)  # theirs are Eigen's own
  endif()
endfunction()
