# touchstone_library(NAME sources...) makes the library of one folder: target touchstone_NAME, alias Touchstone::NAME.
# touchstone_sources(NAME sources...) adds those of one of its subfolders.
# touchstone_test(NAME LABELS ... SOURCES ... LINKS ... [LONG_CASES SUITE.CASE ...] [COST S] [ALONE]) tells ctest of a test: the
# GoogleTest cases of its sources. A folder's tests are one program, FOLDER_tests, which ctest runs once for each with its
# sources' names; a test that's ALONE is a program of its own name. Its long cases are a test NAME_long. COST, in seconds,
# has ctest begin with those that take long, so that no core waits at the end.

add_library(touchstone_options INTERFACE)
target_compile_features(touchstone_options INTERFACE cxx_std_20)
target_compile_options(touchstone_options INTERFACE
  $<BUILD_INTERFACE:-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wno-psabi>)
if(TOUCHSTONE_WERROR)
  target_compile_options(touchstone_options INTERFACE $<BUILD_INTERFACE:-Werror>)
endif()
# Contraction of a*b+c depends on the surrounding code; off, the same source gives the same bytes in every build.
target_compile_options(touchstone_options INTERFACE $<BUILD_INTERFACE:-ffp-contract=off>)
# Nobody reads errno after std::sqrt; without it a square root is one instruction.
target_compile_options(touchstone_options INTERFACE $<BUILD_INTERFACE:-fno-math-errno>)
# Nobody looks at the flags of floating-point exceptions. With them g++ computes nothing that a bound may leave out, and takes a loop
# with std::max, std::floor or a choice element by element. No value changes.
target_compile_options(touchstone_options INTERFACE $<BUILD_INTERFACE:-fno-trapping-math>)
# g++ searches its memory for what it may give back, an eighth of the time to compile. Where there's enough of it, it begins to
# do so at 1 GB (kB here); then sources take 2.1 GB at most instead of 1.6.
cmake_host_system_information(RESULT memory_MB QUERY TOTAL_PHYSICAL_MEMORY)
cmake_host_system_information(RESULT cores QUERY NUMBER_OF_LOGICAL_CORES)
math(EXPR memory_of_core_MB "${memory_MB} / ${cores}")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND memory_of_core_MB GREATER 4000)
  target_compile_options(touchstone_options INTERFACE $<BUILD_INTERFACE:--param=ggc-min-heapsize=1048576>)
endif()
if(TOUCHSTONE_SANITIZE)
  # UBSan's checks of every access would double and more the time to compile Eigen's templates, and AddressSanitizer
  # finds what they find; its others (overflow, shifts, bounds, conversions, enums, division) cost a tenth.
  set(spared)
  if(TOUCHSTONE_SANITIZE MATCHES "undefined")
    set(spared $<BUILD_INTERFACE:-fno-sanitize=null,alignment,vptr,object-size>)
  endif()
  target_compile_options(touchstone_options INTERFACE
    $<BUILD_INTERFACE:-fsanitize=${TOUCHSTONE_SANITIZE}> ${spared} $<BUILD_INTERFACE:-fno-sanitize-recover=all>
    $<BUILD_INTERFACE:-fno-omit-frame-pointer>)
  target_link_options(touchstone_options INTERFACE $<BUILD_INTERFACE:-fsanitize=${TOUCHSTONE_SANITIZE}>)
endif()

# Two precompiled headers, one for libraries and one for tests: positions and macros differ. Outside headers only, so that a
# change in the project recompiles what it did before. A file must still name what it needs: the preset dev has none.
set(TOUCHSTONE_PCH_HEADERS <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <limits> <memory> <optional>
  <span> <string> <utility> <vector> <Eigen/Core> <Eigen/Geometry> <Eigen/LU> <fmt/format.h> <opencv2/core.hpp>)

# Where TOUCHSTONE_UNITY is on: compiles a target's sources eight at a time, which takes a third of the time from scratch: most of it goes to outside headers'
# templates. cmake/unity_groups.awk keeps those apart that declare the same name. Sources with definitions of their own
# stay alone (CMake sees to that).
function(touchstone_compile_together target)
  if(NOT TOUCHSTONE_UNITY)
    return()
  endif()
  get_target_property(all ${target} SOURCES)
  set(sources)
  foreach(source IN LISTS all)
    if(source MATCHES "\\.cpp$")
      list(APPEND sources "${source}")
    endif()
  endforeach()
  find_program(TOUCHSTONE_AWK awk REQUIRED)
  set(headers)
  foreach(folder IN LISTS TOUCHSTONE_PARTS)
    file(GLOB_RECURSE of_folder "${PROJECT_SOURCE_DIR}/${folder}/*.h")
    list(APPEND headers ${of_folder})
  endforeach()
  execute_process(COMMAND ${TOUCHSTONE_AWK} -v most=8 -f "${PROJECT_SOURCE_DIR}/cmake/unity_groups.awk" ${headers} ${sources}
    WORKING_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" OUTPUT_VARIABLE lines RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "cmake/unity_groups.awk failed on the sources of ${target}")
  endif()
  string(REPLACE "\n" ";" lines "${lines}")
  foreach(line IN LISTS lines)
    if(line MATCHES "^([a-z0-9]+) (.+)$")
      set_source_files_properties("${CMAKE_MATCH_2}" PROPERTIES UNITY_GROUP "${target}_${CMAKE_MATCH_1}")
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  # g++ 12 takes an included source for a header, and warns of strings, lists and variants that it has inlined. The
  # preset dev, where sources are compiled by themselves, has all warnings.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage -Wno-array-bounds -Wno-restrict
      -Wno-maybe-uninitialized -Wno-stringop-overflow -Wno-free-nonheap-object)
  endif()
endfunction()

function(touchstone_library name)
  add_library(touchstone_${name} STATIC ${ARGN})
  add_library(Touchstone::${name} ALIAS touchstone_${name})
  set_target_properties(touchstone_${name} PROPERTIES EXPORT_NAME ${name} OUTPUT_NAME touchstone_${name})
  target_include_directories(touchstone_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/touchstone>)
  target_link_libraries(touchstone_${name} PRIVATE $<BUILD_INTERFACE:touchstone_options>)
  target_compile_features(touchstone_${name} PUBLIC cxx_std_20)
  set_property(GLOBAL APPEND PROPERTY TOUCHSTONE_LIBRARIES touchstone_${name})
  # At the folder's end, when its subfolders have added their sources.
  cmake_language(EVAL CODE "cmake_language(DEFER CALL touchstone_compile_together [[touchstone_${name}]])")
  if(TOUCHSTONE_PCH)
    if(name STREQUAL core)
      target_precompile_headers(touchstone_${name} PRIVATE ${TOUCHSTONE_PCH_HEADERS})
    else()
      target_precompile_headers(touchstone_${name} REUSE_FROM touchstone_core)
    endif()
  endif()
endfunction()

function(touchstone_sources name)
  list(TRANSFORM ARGN PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/")
  target_sources(touchstone_${name} PRIVATE ${ARGN})
endfunction()

# What tests do by themselves takes little time, so their own sources have few optimisations: g++ is ready in half of the time.
# What they call in the libraries has all of them.
set(TOUCHSTONE_TEST_OPTIONS $<$<CONFIG:Release>:-Og>)

# A program of tests: its target, before or after it has all of its sources.
function(touchstone_test_program name)
  touchstone_need_gtest()
  add_executable(${name})
  target_compile_options(${name} PRIVATE ${TOUCHSTONE_TEST_OPTIONS})
  target_link_libraries(${name} PRIVATE GTest::gtest GTest::gmock touchstone_options)
  target_include_directories(${name} PRIVATE "${PROJECT_SOURCE_DIR}")
  target_compile_definitions(${name} PRIVATE
    TOUCHSTONE_SOURCE_DIR="${PROJECT_SOURCE_DIR}" TOUCHSTONE_BINARY_DIR="${PROJECT_BINARY_DIR}")
  if(TOUCHSTONE_PCH)
    if(NOT TARGET touchstone_test_pch)
      add_library(touchstone_test_pch OBJECT "${PROJECT_SOURCE_DIR}/cmake/pch.cpp")
      target_link_libraries(touchstone_test_pch PRIVATE touchstone_core GTest::gtest GTest::gmock touchstone_options)
      set_target_properties(touchstone_test_pch PROPERTIES POSITION_INDEPENDENT_CODE OFF)
      target_compile_options(touchstone_test_pch PRIVATE -fPIE ${TOUCHSTONE_TEST_OPTIONS})
      target_precompile_headers(touchstone_test_pch PRIVATE ${TOUCHSTONE_PCH_HEADERS} <gmock/gmock.h> <gtest/gtest.h>)
    endif()
    target_precompile_headers(${name} REUSE_FROM touchstone_test_pch)
  endif()
  if(NOT TARGET touchstone_test_main)
    add_library(touchstone_test_main OBJECT "${PROJECT_SOURCE_DIR}/tests/support/test_main.cpp")
    target_link_libraries(touchstone_test_main PRIVATE GTest::gtest GTest::gmock touchstone_options)
  endif()
  target_link_libraries(${name} PRIVATE touchstone_test_main)
  # At the folder's end: touchstone_compile_together looks at all sources at once.
  cmake_language(EVAL CODE "cmake_language(DEFER CALL touchstone_compile_together [[${name}]])")
endfunction()

function(touchstone_test name)
  cmake_parse_arguments(arg "ALONE" "COST" "LABELS;SOURCES;LINKS;LONG_CASES" ${ARGN})
  if(arg_ALONE)
    set(program ${name})
  else()
    get_filename_component(folder "${CMAKE_CURRENT_SOURCE_DIR}" NAME)
    set(program ${folder}_tests)
  endif()
  if(NOT TARGET ${program})
    touchstone_test_program(${program})
  endif()
  target_sources(${program} PRIVATE ${arg_SOURCES})
  target_link_libraries(${program} PRIVATE ${arg_LINKS})
  # One process a test: what its cases share is set up once.
  if(arg_ALONE)
    add_test(NAME ${name} COMMAND ${name})
  else()
    list(JOIN arg_SOURCES "," sources)
    list(JOIN arg_LONG_CASES "," long_cases)
    set(without)
    if(arg_LONG_CASES)
      set(without --without=${long_cases})
      add_test(NAME ${name}_long COMMAND ${program} --only=${long_cases})
      set_tests_properties(${name}_long PROPERTIES LABELS long TIMEOUT 3600)
    endif()
    add_test(NAME ${name} COMMAND ${program} --sources=${sources} ${without})
  endif()
  set_tests_properties(${name} PROPERTIES LABELS "${arg_LABELS}" TIMEOUT 1500)
  if(arg_COST)
    set_tests_properties(${name} PROPERTIES COST ${arg_COST})
  endif()
  if("fast" IN_LIST arg_LABELS)
    if(NOT TARGET fast_tests)
      add_custom_target(fast_tests)  # what the sanitizers run
    endif()
    add_dependencies(fast_tests ${program})
  endif()
endfunction()
