# Every library trammel stands on, as a target. packages.txt and packages-whole.txt name the Debian package and the reason.
find_package(PkgConfig REQUIRED)
find_package(fmt REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(tl-expected REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(CLI11 REQUIRED)
find_package(Threads REQUIRED)
find_package(OpenSSL REQUIRED)
find_package(Boost 1.81 REQUIRED)
find_package(JPEG REQUIRED)
pkg_check_modules(png REQUIRED IMPORTED_TARGET libpng)
pkg_check_modules(cairo REQUIRED IMPORTED_TARGET cairo)
# By name: SQLiteCpp's own target brings -pthread, with which no precompiled header matches.
pkg_check_modules(sqlite REQUIRED IMPORTED_TARGET sqlite3)
find_library(SQLITECPP_LIBRARY SQLiteCpp REQUIRED)
add_library(sqlite_cpp INTERFACE)
target_link_libraries(sqlite_cpp INTERFACE ${SQLITECPP_LIBRARY} PkgConfig::sqlite)

# Those of single instruments.
if(TRAMMEL_PART_ALIGNMENT AND TRAMMEL_TESTS)
  find_package(Ceres REQUIRED)  # a second opinion on the adjustment of a survey
endif()
if(TRAMMEL_TOOL_OFFSET OR TRAMMEL_PART_ALIGNMENT)
  pkg_check_modules(tiff REQUIRED IMPORTED_TARGET libtiff-4)
  pkg_check_modules(qpdf REQUIRED IMPORTED_TARGET libqpdf)
endif()

# Those of modules that are loaded on demand, and the packages to name where they are not installed.
if(TRAMMEL_ARAVIS)
  pkg_check_modules(aravis REQUIRED IMPORTED_TARGET aravis-0.8)
  # Its -pthread defines _REENTRANT, with which no precompiled header matches; threads are linked
  # apart.
  set_property(TARGET PkgConfig::aravis PROPERTY INTERFACE_COMPILE_OPTIONS "")
endif()
if(TRAMMEL_PHONE_PICTURES)
  pkg_check_modules(webp REQUIRED IMPORTED_TARGET libwebp)
  pkg_check_modules(heif REQUIRED IMPORTED_TARGET libheif)
endif()
set(TRAMMEL_STEP_PACKAGES "")
if(TRAMMEL_STEP AND TRAMMEL_PART_ALIGNMENT)
  # By name: its CMake files want every library of it, Tk's among them.
  find_path(OCCT_INCLUDE_DIR STEPControl_Reader.hxx PATH_SUFFIXES opencascade REQUIRED)
  add_library(occt INTERFACE IMPORTED)
  target_include_directories(occt SYSTEM INTERFACE ${OCCT_INCLUDE_DIR})
  set(occt_step TKSTEP TKSTEPBase TKSTEPAttr)
  find_library(OCCT_TKDESTEP_LIBRARY TKDESTEP)
  if(OCCT_TKDESTEP_LIBRARY)  # from 7.8 on, as in Debian 13
    set(occt_step TKDESTEP)
  endif()
  foreach(library ${occt_step} TKXSBase TKMesh TKTopAlgo TKBRep TKG3d TKMath TKernel)
    find_library(OCCT_${library}_LIBRARY ${library} REQUIRED)
    target_link_libraries(occt INTERFACE ${OCCT_${library}_LIBRARY})
  endforeach()
  file(STRINGS ${OCCT_INCLUDE_DIR}/Standard_Version.hxx occt_version REGEX "define OCC_VERSION_(MAJOR|MINOR) ")
  string(REGEX REPLACE "[^0-9]*([0-9]+)[^0-9]+([0-9]+).*" "\\1.\\2" occt_version "${occt_version}")
  set(TRAMMEL_STEP_PACKAGES "libocct-data-exchange-${occt_version}")
endif()

# Debian puts OpenCV's CMake files into libopencv-dev, which pulls in Qt, VTK and Java; the modules in
# use are linked by name instead. imgcodecs, which drags 134 libraries, only judges image/ in tests.
find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
set(opencv_modules core imgproc)
if(TRAMMEL_TESTS OR TRAMMEL_BENCH)
  list(APPEND opencv_modules imgcodecs)
endif()
foreach(module ${opencv_modules})
  if(TRAMMEL_OPENCV_STATIC)
    find_library(OPENCV_${module}_LIBRARY libopencv_${module}.a REQUIRED)
    add_library(opencv_${module} STATIC IMPORTED)  # of which CMake knows that order counts
    set_target_properties(opencv_${module} PROPERTIES IMPORTED_LOCATION ${OPENCV_${module}_LIBRARY})
  else()
    find_library(OPENCV_${module}_LIBRARY opencv_${module} REQUIRED)
    add_library(opencv_${module} INTERFACE IMPORTED)
    target_link_libraries(opencv_${module} INTERFACE ${OPENCV_${module}_LIBRARY})
  endif()
  target_include_directories(opencv_${module} SYSTEM INTERFACE ${OPENCV_INCLUDE_DIR})
endforeach()
if(TRAMMEL_OPENCV_STATIC)
  if(TRAMMEL_TESTS OR TRAMMEL_BENCH)
    message(FATAL_ERROR "TRAMMEL_OPENCV_STATIC is for the program alone: the tests' imgcodecs brings the shared core along")
  endif()
  # What Debian's OpenCV was built with, and in place of libGL those functions of it that are never called.
  find_package(LAPACK REQUIRED)
  find_package(ZLIB REQUIRED)
  pkg_check_modules(tbb REQUIRED IMPORTED_TARGET tbb)
  add_library(trammel_without_opengl STATIC ${CMAKE_CURRENT_LIST_DIR}/without_opengl.cc)
  set_target_properties(trammel_without_opengl PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden)
  target_link_libraries(opencv_core INTERFACE trammel_without_opengl PkgConfig::tbb LAPACK::LAPACK ZLIB::ZLIB
                                              Threads::Threads ${CMAKE_DL_LIBS})
  target_link_libraries(opencv_imgproc INTERFACE opencv_core)
endif()

if(TRAMMEL_TESTS)
  find_package(GTest REQUIRED)
  find_package(rapidcheck REQUIRED)
  include(GoogleTest)
endif()
if(TRAMMEL_BENCH)
  find_package(benchmark REQUIRED)
endif()

# What Python has to be started with, to load a library that the address sanitizer is in.
set(TRAMMEL_ASAN_RUNTIME libasan.so.8)
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=libclang_rt.asan-x86_64.so
                  OUTPUT_VARIABLE TRAMMEL_ASAN_RUNTIME OUTPUT_STRIP_TRAILING_WHITESPACE)
endif()
