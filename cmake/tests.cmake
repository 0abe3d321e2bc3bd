# SPDX-License-Identifier: Apache-2.0
# Unit tests: one executable per layer and per protocol folder. Cross-cutting tests: one per file of tests/.
find_package(GTest REQUIRED)
find_package(rapidcheck REQUIRED)
include(GoogleTest)

# GoogleTest is parsed once for all tests. Under sanitizers the tests themselves are not optimised: they compile
# in half the time.
function(absenc_test_settings target)
  absenc_settings(${target})
  target_include_directories(${target} PRIVATE "${PROJECT_SOURCE_DIR}")
  target_compile_definitions(${target} PRIVATE ABSENC_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  if(ABSENC_SANITIZE)
    target_compile_options(${target} PRIVATE -O0)
  endif()
  target_link_libraries(${target} PRIVATE absenc::absenc absenc::os rapidcheck GTest::gtest_main GTest::gmock)
endfunction()

file(CONFIGURE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp" CONTENT "")
add_library(test_headers OBJECT "${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp")
absenc_test_settings(test_headers)
target_precompile_headers(test_headers PRIVATE <gtest/gtest.h>)

function(absenc_test name)
  add_executable(${name}_test ${ARGN})
  absenc_test_settings(${name}_test)
  set_target_properties(${name}_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/tests")
  if(name STREQUAL "command")
    target_link_libraries(${name}_test PRIVATE absenc-command-objects)  # other settings than the shared headers
  else()
    target_precompile_headers(${name}_test REUSE_FROM test_headers)
  endif()
  gtest_discover_tests(${name}_test TEST_PREFIX "${name}." DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60)
endfunction()

function(absenc_folder_test name folder)
  file(GLOB sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/${folder}/*_test.cpp")
  if(sources)
    absenc_test(${name} ${sources})
  endif()
endfunction()

foreach(layer IN ITEMS core link protocol host sim os)
  absenc_folder_test(${layer} absenc/${layer})
endforeach()
file(GLOB unit_folders CONFIGURE_DEPENDS LIST_DIRECTORIES true "${PROJECT_SOURCE_DIR}/absenc/protocol/*")
foreach(folder IN LISTS unit_folders)
  if(IS_DIRECTORY "${folder}")
    cmake_path(GET folder FILENAME unit)
    absenc_folder_test(${unit} absenc/protocol/${unit})
  endif()
endforeach()
if(TARGET absenc-command-objects)
  absenc_folder_test(command tools/absenc)
endif()

file(GLOB cross_tests CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tests/*_test.cpp")
foreach(source IN LISTS cross_tests)
  cmake_path(GET source STEM stem)
  string(REGEX REPLACE "_test$" "" name "${stem}")
  absenc_test(${name} "${source}")
endforeach()

# Every fuzz body as a plain test: over all vectors, what is near them, and noise.
file(GLOB_RECURSE fuzz_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/absenc/*_fuzz.cpp")
foreach(source IN LISTS fuzz_sources)
  cmake_path(GET source STEM stem)
  set(target ${stem}_seeds)
  add_executable(${target} "${source}" tests/fuzz_seeds_main.cpp)
  absenc_settings(${target})
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/tests")
  target_link_libraries(${target} PRIVATE absenc::absenc)
  add_test(NAME fuzz_seeds.${stem} COMMAND ${target})
endforeach()

# Tests in Python: of the command as a user types it, and of the sources.
if(ABSENC_COMMAND)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  file(GLOB python_tests CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tests/*_test.py")
  foreach(source IN LISTS python_tests)
    cmake_path(GET source STEM stem)
    string(REGEX REPLACE "_test$" "" name "${stem}")
    add_test(NAME ${name}.py COMMAND "${Python3_EXECUTABLE}" -B "${source}")
    set_tests_properties(${name}.py PROPERTIES
      ENVIRONMENT "ABSENC=${absenc_bin_dir}/absenc;ABSENC_SOURCE_DIR=${PROJECT_SOURCE_DIR}")
  endforeach()
endif()

# Examples end by themselves and tell by their exit status whether they worked.
file(GLOB examples CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/examples/*.cpp")
foreach(source IN LISTS examples)
  cmake_path(GET source STEM name)
  add_executable(example_${name} "${source}")
  absenc_settings(example_${name})
  set_target_properties(example_${name} PROPERTIES OUTPUT_NAME ${name}
                        RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/examples")
  target_link_libraries(example_${name} PRIVATE absenc::absenc absenc::os)
  add_test(NAME example.${name} COMMAND example_${name})
endforeach()
