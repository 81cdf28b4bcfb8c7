# trammel_module(NAME SOURCES … [LINK …] [HOT] [COLD] [COMMANDS] [LEAN] [NUMERIC])   a library target trammel_NAME
#   HOT: measured code, -O3 in a release, unless TRAMMEL_QUICK is on. COLD: code that words, waits and calls, -O0 by clang and where TRAMMEL_QUICK
#   is on, else -O1: to optimise it takes a third of a build and gains nothing that a user can feel. COMMANDS: COLD, and CLI11 is precompiled
#   for it. All else is compiled with -O2.
#   LEAN (and COLD): nothing is inlined that makes the code longer, which clang takes a fifth of its time for: code that waits for
#   the network or a disk, called seldom.
#   NUMERIC (and HOT): in the fuzz targets it is optimised, and its comparisons, of pixels and numbers, are not
#   traced: they take half of the time and teach nothing.
# trammel_test(NAME SOURCES … LINK … [LABELS …] [TIMEOUT s] [LOCK NAME] [BUSY] [WAITS] [SIDE_BY_SIDE])   a GoogleTest
#   executable, one ctest entry per TEST; with SIDE_BY_SIDE one for all of them, where they share what takes long, or where
#   imgcodecs behind them takes longer to start than most of them.
#   BUSY: it computes for long, and is optimised; the linker may take its templates in place of the module's.
#   WAITS: a printer's clock rules it, not the processor: it begins early, as what is SIDE_BY_SIDE, and takes a third of the room
#   (all of it with a sanitizer, by which the virtual machine and its camera are slow).
#   Labels: unit (default) property sim golden fuzz slow. What is slow is a study, built where TRAMMEL_STUDIES is on.
# trammel_loaded(NAME SOURCES … LINK …)   lib/trammel/trammel-NAME.so, loaded on demand (machine/module/module.h)
# Warnings that a batch or a precompiled header makes false. A local name may be that of another file's constant. With
# precompiled headers GCC 12 says of the string's own operator+ what is not so (array-bounds), in a batch of the string's move
# (stringop-overread), and takes each unnamed namespace for a header's.
set(TRAMMEL_SHADOW -Wshadow)
set(TRAMMEL_COMPILER_FLAGS)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  if(TRAMMEL_PRECOMPILE)
    list(APPEND TRAMMEL_COMPILER_FLAGS -Wno-array-bounds)
  endif()
  if(TRAMMEL_BATCH)
    set(TRAMMEL_SHADOW -Wshadow=local)
    list(APPEND TRAMMEL_COMPILER_FLAGS -Wno-subobject-linkage -Wno-stringop-overread)
  endif()
else()
  list(APPEND TRAMMEL_COMPILER_FLAGS -Wno-bitwise-instead-of-logical)  # no branch in a loop over samples
  if(TRAMMEL_BATCH)
    set(TRAMMEL_SHADOW -Wno-shadow)
  endif()
endif()

function(trammel_flags target)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>)
  target_compile_options(${target} PRIVATE -Wall -Wextra ${TRAMMEL_SHADOW} -Wnon-virtual-dtor -Wconversion
                         -Wno-sign-conversion -Wno-psabi ${TRAMMEL_COMPILER_FLAGS}
                         -fno-math-errno  # which nobody reads: square roots without a call, sine and cosine in one
                         $<$<BOOL:${TRAMMEL_WERROR}>:-Werror>)
  if(TRAMMEL_PRECOMPILE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC frees no memory below 800 MB: a precompiled header fills what it would keep, and it searched in vain.
    target_compile_options(${target} PRIVATE "SHELL:--param ggc-min-heapsize=800000")
  endif()
  if(TRAMMEL_SANITIZE)
    target_compile_options(${target} PUBLIC -fsanitize=${TRAMMEL_SANITIZE} -fno-sanitize-recover=all
                           -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${TRAMMEL_SANITIZE})
    target_compile_definitions(${target} PRIVATE TRAMMEL_SANITIZED)  # handlers of its own, terabytes of addresses
  endif()
endfunction()

# How far code is optimised that words, waits and calls: clang takes half of its time for it.
set(TRAMMEL_COLD_LEVEL -O1)
if(TRAMMEL_QUICK OR CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  set(TRAMMEL_COLD_LEVEL -O0)
endif()

function(trammel_cold target)
  if(NOT TRAMMEL_SANITIZE)
    target_compile_options(${target} PRIVATE $<$<NOT:$<CONFIG:Debug>>:${TRAMMEL_COLD_LEVEL}>)
  endif()
  trammel_lean(${target})
endfunction()

function(trammel_lean target)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    target_compile_options(${target} PRIVATE "SHELL:-mllvm -inline-threshold=0")
  endif()
endfunction()

function(trammel_numeric target)
  if(TRAMMEL_FUZZ)
    target_compile_options(${target} PRIVATE -O2 -fno-sanitize-coverage=trace-cmp)
  endif()
endfunction()

function(trammel_module name)
  cmake_parse_arguments(ARG "HOT;COLD;COMMANDS;LEAN;NUMERIC" "" "SOURCES;LINK" ${ARGN})
  add_library(trammel_${name} STATIC ${ARG_SOURCES})
  trammel_flags(trammel_${name})
  target_link_libraries(trammel_${name} PUBLIC ${ARG_LINK})
  if(ARG_HOT AND NOT TRAMMEL_QUICK)
    target_compile_options(trammel_${name} PRIVATE $<$<CONFIG:Release>:-O3>)
  endif()
  if(ARG_COMMANDS OR ARG_COLD)
    trammel_cold(trammel_${name})
  elseif(ARG_LEAN)
    trammel_lean(trammel_${name})
  endif()
  if(ARG_HOT OR ARG_NUMERIC)
    trammel_numeric(trammel_${name})
  endif()
  if(ARG_COMMANDS)
    trammel_precompile(trammel_${name} trammel_app <CLI/CLI.hpp>)
  elseif(ARG_COLD)
    trammel_precompile(trammel_${name} trammel_cold_headers)
  else()
    trammel_precompile(trammel_${name} trammel_base)
  endif()
  cmake_language(EVAL CODE "cmake_language(DEFER CALL trammel_batch trammel_${name})")
endfunction()

function(trammel_loaded name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  set(target trammel_${name}_module)
  add_library(${target} MODULE ${ARG_SOURCES})
  trammel_flags(${target})
  target_compile_options(${target} PRIVATE -fvisibility=hidden)
  target_compile_definitions(${target} PRIVATE TRAMMEL_VERSION="${PROJECT_VERSION}")
  target_link_options(${target} PRIVATE -Wl,--as-needed)
  if(NOT TRAMMEL_SANITIZE)  # whose symbols are the program's
    target_link_options(${target} PRIVATE -Wl,-z,defs)
  endif()
  target_link_libraries(${target} PRIVATE trammel_module_parts ${ARG_LINK})
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME trammel-${name}
                        LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib/trammel)
  trammel_batch(${target})
endfunction()

# Headers that most files of a module read, precompiled once in the first module of their kind, OWNER: in base, and with
# CLI11's, which take three seconds of each file, in app for the commands.
set(TRAMMEL_COMMON_HEADERS <algorithm> <array> <atomic> <chrono> <cmath> <complex> <condition_variable> <filesystem>
                           <fstream> <functional> <map> <memory> <mutex> <numbers> <optional> <random> <set> <span>
                           <sstream> <stop_token> <string> <thread> <variant> <vector> <Eigen/Core> <fmt/format.h>
                           ${PROJECT_SOURCE_DIR}/src/base/json_instance.h <tl/expected.hpp>
                           ${PROJECT_SOURCE_DIR}/src/base/check.h ${PROJECT_SOURCE_DIR}/src/base/frame.h
                           ${PROJECT_SOURCE_DIR}/src/base/measured.h ${PROJECT_SOURCE_DIR}/src/base/result.h)
function(trammel_precompile_in owner)
  target_precompile_headers(${owner} PRIVATE ${TRAMMEL_COMMON_HEADERS} ${ARGN})
  target_include_directories(
    ${owner} SYSTEM PRIVATE $<TARGET_PROPERTY:Eigen3::Eigen,INTERFACE_INCLUDE_DIRECTORIES>)
endfunction()
function(trammel_precompile target owner)
  if(NOT TRAMMEL_PRECOMPILE)
    return()
  endif()
  if(target STREQUAL owner)
    trammel_precompile_in(${target} ${ARGN})
  else()
    target_precompile_headers(${target} REUSE_FROM ${owner})
  endif()
endfunction()

# Sources in which the network's waits dwarf the processor's: optimising Boost's headers takes
# minutes and gains nothing, and gigabytes with sanitizers.
function(trammel_quick_to_compile)
  set(level -O1)
  if(TRAMMEL_SANITIZE OR CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    set(level -O0)  # clang takes half of the time then; g++ as long as ever
  endif()
  set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS ${level} SKIP_PRECOMPILE_HEADERS ON)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    # clang 16 takes Beast's async_teardown and its declaration as a friend for two functions.
    set_property(SOURCE ${ARGN} APPEND PROPERTY COMPILE_DEFINITIONS BOOST_ASIO_DISABLE_CONCEPTS)
  endif()
endfunction()

# The common headers, precompiled for the modules that are COLD: neither compiler takes those of -O2.
function(trammel_cold_headers)
  if(NOT TRAMMEL_PRECOMPILE)
    return()
  endif()
  file(CONFIGURE OUTPUT cold_headers.cc CONTENT "")  # written only where it is not there
  add_library(trammel_cold_headers OBJECT ${PROJECT_BINARY_DIR}/cold_headers.cc)
  trammel_flags(trammel_cold_headers)
  trammel_cold(trammel_cold_headers)
  target_link_libraries(trammel_cold_headers PRIVATE fmt::fmt tl::expected nlohmann_json::nlohmann_json)
  trammel_precompile_in(trammel_cold_headers)
endfunction()

# What every test is compiled with. Little runs in the tests' own files: to compile them takes longer.
function(trammel_test_options target)
  trammel_flags(${target})
  trammel_cold(${target})
endfunction()

# GoogleTest's headers and those of base, precompiled for all tests that do not count on speed.
function(trammel_test_headers)
  if(NOT TRAMMEL_PRECOMPILE)
    return()
  endif()
  file(CONFIGURE OUTPUT test_headers.cc CONTENT "")  # written only where it is not there
  add_library(trammel_test_headers OBJECT ${PROJECT_BINARY_DIR}/test_headers.cc)
  trammel_test_options(trammel_test_headers)
  target_link_libraries(trammel_test_headers PRIVATE trammel_base GTest::gtest GTest::gmock)
  trammel_precompile_in(trammel_test_headers <gmock/gmock.h> <gtest/gtest.h>)
endfunction()

function(trammel_test name)
  if(NOT TRAMMEL_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "BUSY;WAITS;SIDE_BY_SIDE" "TIMEOUT;LOCK" "SOURCES;LINK;LABELS" ${ARGN})
  if(NOT ARG_LABELS)
    set(ARG_LABELS unit)
  endif()
  if("slow" IN_LIST ARG_LABELS AND NOT TRAMMEL_STUDIES)
    return()
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
    if(ARG_SIDE_BY_SIDE)  # many tests: 27 of them took more beside eight busy loops
      set(ARG_TIMEOUT 1200)
    endif()
  endif()
  set(properties LABELS "${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT})
  if(NOT ARG_WAITS OR TRAMMEL_SANITIZE)
    list(APPEND properties PROCESSORS 3)
  endif()
  if(ARG_SIDE_BY_SIDE OR ARG_WAITS)
    list(APPEND properties COST 30)
  endif()
  if(ARG_LOCK)
    list(APPEND properties RESOURCE_LOCK ${ARG_LOCK})
  endif()
  add_executable(${name} ${ARG_SOURCES})
  if("slow" IN_LIST ARG_LABELS)
    trammel_flags(${name})
  elseif(ARG_BUSY)
    trammel_flags(${name})
    trammel_precompile(${name} trammel_base)
  else()
    trammel_test_options(${name})
    if(TRAMMEL_PRECOMPILE)
      target_precompile_headers(${name} REUSE_FROM trammel_test_headers)
    endif()
  endif()
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${name} PRIVATE ${ARG_LINK} GTest::gtest GTest::gmock GTest::gtest_main)
  cmake_language(EVAL CODE "cmake_language(DEFER CALL trammel_batch ${name})")
  if(ARG_SIDE_BY_SIDE)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES ${properties})
    return()
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES ${properties})
endfunction()
