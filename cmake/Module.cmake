# trammel_module(NAME SOURCES … [LINK …])   a library target trammel_NAME
# trammel_test(NAME SOURCES … LINK … [LABELS …] [TIMEOUT s] [SIDE_BY_SIDE])   a GoogleTest executable, one ctest entry
#   per TEST; with SIDE_BY_SIDE one for all of them, where they share what takes long. Labels: unit (default) property sim golden fuzz slow.
function(trammel_flags target)
  target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR}/src)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wconversion
                         -Wno-sign-conversion -Wno-psabi $<$<BOOL:${TRAMMEL_WERROR}>:-Werror>)
  if(TRAMMEL_SANITIZE)
    target_compile_options(${target} PUBLIC -fsanitize=${TRAMMEL_SANITIZE} -fno-sanitize-recover=all
                           -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${TRAMMEL_SANITIZE})
  endif()
endfunction()

function(trammel_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_library(trammel_${name} STATIC ${ARG_SOURCES})
  trammel_flags(trammel_${name})
  target_link_libraries(trammel_${name} PUBLIC ${ARG_LINK})
endfunction()

function(trammel_test name)
  if(NOT TRAMMEL_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "SIDE_BY_SIDE" "TIMEOUT" "SOURCES;LINK;LABELS" ${ARGN})
  if(NOT ARG_LABELS)
    set(ARG_LABELS unit)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  trammel_flags(${name})
  target_link_libraries(${name} PRIVATE ${ARG_LINK} GTest::gtest GTest::gmock GTest::gtest_main)
  if(ARG_SIDE_BY_SIDE)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT})
    return()
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60
                       PROPERTIES LABELS "${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT})
endfunction()
