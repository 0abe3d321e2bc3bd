# SPDX-License-Identifier: Apache-2.0
# Unit tests: one executable per layer and per protocol folder. Cross-cutting tests: one executable per file of tests/.
# A build with only some units (ABSENC_UNITS) has only the tests of these units and those that test every unit, because
# all other tests name units.
if(NOT WIN32)  # cmake/windows.cmake builds GoogleTest
  find_package(GTest REQUIRED)
  find_package(rapidcheck REQUIRED)
  find_package(PkgConfig REQUIRED)
  set(absenc_test_libraries ${libzip_LIBRARIES} rapidcheck)
  include(GoogleTest)
endif()

# Tests with the label `long`: `./dev test` skips them, `./dev test --all` runs them.
set(absenc_long_python_tests
    can_peers modbus_peers wave  # these tests run clients, nodes and decoders of other projects
    # these tests inject many faults, load the machine, or repeat exchanges on every line
    doctor_faults doctor_healthy identify speed
    # these tests compile, install or configure the project
    docs install mutants_script new_protocol packages python_wheel windows_library
    python python_units record_hdf5  # these tests need mypy, pytest, pandas, matplotlib and h5py
    # these tests need MQTT brokers, HTTP proxies and full disks
    serve_broker serve_cluster serve_history serve_mqtt serve_others serve_proxy serve_spool
    serve_browser serve_client serve_look  # these tests need a browser and npm
    mqtt_failures_abuse mqtt_packets_abuse mqtt_spool_abuse serve_history_abuse serve_http_abuse)
# GoogleTest filters that select the long tests, for each executable. In the executable kit all series of faults but the
# first are long.
set(absenc_long_kit_tests)
foreach(series RANGE 1 9)
  list(APPEND absenc_long_kit_tests "Seeds/*/${series}_*")
endforeach()
set(absenc_long_client_tests Models/Confirmed.* Units/ChangingClauses.* Units/LiveAndCaptured.* Units/HealthyEncoder.*
    Units/Matrix.* Units/HostileEncoders.* Encoders/LatchTimes.*)
set(absenc_long_capture_tests Seeds/RandomStream.*)
set(absenc_long_host_tests Velocity.ErrorIsWithinItsUncertainty)
foreach(name IN ITEMS kit client capture host)
  list(JOIN absenc_long_${name}_tests ":" absenc_long_${name}_tests)
endforeach()

# Most tests are not optimised, so that they compile in half the time.
function(absenc_test_settings target)
  absenc_settings(${target})
  target_include_directories(${target} PRIVATE "${PROJECT_SOURCE_DIR}")
  # g++ 12 for mingw and for s390x wrongly sees memory of coroutines that was not allocated being freed
  target_compile_options(${target} PRIVATE -O0 $<$<BOOL:${CMAKE_CROSSCOMPILING}>:-Wno-free-nonheap-object>)
  # A fuzzer needs coverage instrumentation in the code that it runs, but not in the tests, where the instrumentation
  # takes a quarter of the compile time.
  if(ABSENC_FUZZ)
    target_compile_options(${target} PRIVATE -fsanitize-coverage=0)
  endif()
  target_link_libraries(${target} PRIVATE absenc::absenc absenc::os absenc::capture ${absenc_test_libraries}
                                          GTest::gtest_main GTest::gmock)
endfunction()

# Only modes_test.cpp gets the path of the sources as a macro: for a file with such a macro the compiler cache is
# useless in another copy of the sources.
set_source_files_properties(absenc/protocol/raa38/serial/modes_test.cpp PROPERTIES
                            COMPILE_DEFINITIONS ABSENC_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
file(CONFIGURE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp" CONTENT "")
if(WIN32)
  set(CMAKE_CROSSCOMPILING_EMULATOR /usr/lib/wine/wine64)
endif()
add_library(test_headers OBJECT "${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp")
absenc_test_settings(test_headers)
target_precompile_headers(test_headers PRIVATE <gtest/gtest.h>)

# The target for `./dev test` without --all: the command, the Python package, GoogleTest programs, examples.
add_custom_target(change-tests)
foreach(target IN ITEMS absenc-command absenc-manual absenc-python)
  if(TARGET ${target})
    add_dependencies(change-tests ${target})
  endif()
endforeach()

function(absenc_test name)
  add_executable(${name}_test ${ARGN})
  add_dependencies(change-tests ${name}_test)
  absenc_test_settings(${name}_test)
  set_target_properties(${name}_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/tests")
  # these two tests are compiled with other settings than the precompiled headers, so they cannot use those headers
  if(name STREQUAL "command" OR name STREQUAL "manual")
    target_link_libraries(${name}_test PRIVATE absenc-command-objects absenc-shared-objects $<TARGET_NAME_IF_EXISTS:absenc-${name}-objects>)
  else()
    target_precompile_headers(${name}_test REUSE_FROM test_headers)
  endif()
  # the folder of the sources, for tests that compare tables in documents with the code
  set(environment "ABSENC_SOURCE_DIR=${PROJECT_SOURCE_DIR}")
  set(long "${absenc_long_${name}_tests}")
  if(CMAKE_CROSSCOMPILING)  # few starts of wine or qemu, because their start takes longer than most tests
    add_test(NAME ${name} COMMAND ${name}_test --gtest_brief=1 "--gtest_filter=-${long}")
    set_tests_properties(${name} PROPERTIES ENVIRONMENT "${environment}")
    if(long)
      add_test(NAME ${name}_long COMMAND ${name}_test --gtest_brief=1 "--gtest_filter=${long}")
      set_tests_properties(${name}_long PROPERTIES ENVIRONMENT "${environment}" LABELS long TIMEOUT 1500)
    endif()
    return()
  endif()
  set(discovery TEST_PREFIX "${name}." DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60)
  if(long)
    gtest_discover_tests(${name}_test ${discovery} TEST_FILTER "${long}" TEST_LIST ${name}_long_tests
                         PROPERTIES ENVIRONMENT "${environment}" LABELS long)
    list(APPEND discovery TEST_FILTER "-${long}")
  endif()
  gtest_discover_tests(${name}_test ${discovery} PROPERTIES ENVIRONMENT "${environment}")
endfunction()

# Keeps in a list of sources only those with a test that runs for every unit (INSTANTIATE_TEST_SUITE_P).
function(absenc_keep_tests_for_every_unit list_of_sources)
  set(kept)
  foreach(source IN LISTS ${list_of_sources})
    file(STRINGS "${source}" for_every_unit REGEX "INSTANTIATE_TEST_SUITE_P" LIMIT_COUNT 1)
    if(for_every_unit)
      list(APPEND kept "${source}")
    endif()
  endforeach()
  set(${list_of_sources} "${kept}" PARENT_SCOPE)
endfunction()

# Removes from a list of sources those that a build for Windows leaves out: tests with libraries that have no package for
# it, and tests of another system or with functions of POSIX.
function(absenc_keep_tests_for_windows list_of_sources)
  set(kept)
  foreach(source IN LISTS ${list_of_sources})
    file(STRINGS "${source}" needs LIMIT_COUNT 1 REGEX
         "include [<\"](rapidcheck|zip\\.h|unistd\\.h|fcntl\\.h|sys/|pthread\\.h|tests/ftdi|absenc/capture/files/(test_files|zip_archive)|absenc/client/hdf5|absenc/os/(linux|fake_ftdi))|mkdtemp\\(|setenv\\(")
    if(NOT needs AND NOT source MATCHES "/absenc/os/linux/")
      list(APPEND kept "${source}")
    endif()
  endforeach()
  set(${list_of_sources} "${kept}" PARENT_SCOPE)
endfunction()

# With ABSENC_SPLIT_TESTS each source becomes an executable, because tests/mutants.py runs only some of them.
function(absenc_folder_test name folder glob)
  file(${glob} sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/${folder}/*_test.cpp")
  if(ABSENC_UNITS AND NOT folder MATCHES "^absenc/protocol/")
    absenc_keep_tests_for_every_unit(sources)
  endif()
  if(WIN32)
    absenc_keep_tests_for_windows(sources)
  else()
    list(FILTER sources EXCLUDE REGEX "/absenc/os/windows/")
  endif()
  if(ABSENC_SPLIT_TESTS AND folder MATCHES "^absenc/(host|protocol)")
    foreach(source IN LISTS sources)
      cmake_path(RELATIVE_PATH source BASE_DIRECTORY "${PROJECT_SOURCE_DIR}/${folder}" OUTPUT_VARIABLE below)
      string(REGEX REPLACE "_test\\.cpp$" "" below "${below}")
      string(REPLACE "/" "_" below "${below}")
      absenc_test(${name}_${below} "${source}")
    endforeach()
  elseif(sources)
    absenc_test(${name} ${sources})
  endif()
endfunction()

if(ABSENC_LIBRARY_TESTS)
  set(tested_units ${ABSENC_UNITS})
  if(NOT ABSENC_UNITS)
    foreach(layer IN ITEMS core link host sim capture os)
      absenc_folder_test(${layer} absenc/${layer} GLOB_RECURSE)
    endforeach()
    if(NOT WIN32)
      target_sources(os_test PRIVATE tests/ftdi/mpsse.cpp tests/ftdi/wires.cpp)
      target_link_libraries(os_test PRIVATE absenc::gpio)
    endif()
    absenc_folder_test(protocol absenc/protocol GLOB)
    absenc_all_protocols(tested_units)
    list(APPEND tested_units author)
  endif()
  foreach(unit IN LISTS tested_units)
    absenc_folder_test(${unit} absenc/protocol/${unit} GLOB_RECURSE)
  endforeach()
  file(GLOB cross_tests CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tests/*_test.cpp")
  if(ABSENC_UNITS)
    absenc_keep_tests_for_every_unit(cross_tests)
  endif()
  if(WIN32)
    absenc_keep_tests_for_windows(cross_tests)
  endif()
  foreach(source IN LISTS cross_tests)
    cmake_path(GET source STEM stem)
    string(REGEX REPLACE "_test$" "" name "${stem}")
    absenc_test(${name} "${source}")
  endforeach()
endif()
if(TARGET absenc-client)
  absenc_folder_test(client absenc/client GLOB_RECURSE)
  target_sources(client_test PRIVATE tests/kit/frames.cpp)
  target_link_libraries(client_test PRIVATE absenc::client absenc::configuration absenc::captures absenc::recording
                                            $<TARGET_NAME_IF_EXISTS:absenc-hdf5> ${absenc_hdf5_libraries} ${absenc_fmt})
  if(NOT ABSENC_UNITS AND NOT WIN32)  # this test is an executable of its own, because it replaces malloc of glibc
    absenc_test(reading_allocations tests/reading_allocations.cpp)
    target_link_libraries(reading_allocations_test PRIVATE absenc::client)
    # does not count allocations with sanitizers and fuzzers, because these replace malloc themselves
    if(NOT ABSENC_SANITIZE AND NOT ABSENC_FUZZ)
      target_compile_definitions(reading_allocations_test PRIVATE ABSENC_COUNTS_MALLOC)
    endif()
  endif()
endif()
# Writes waveforms for ftdi_wave_test.py.
if(TARGET absenc-client AND NOT ABSENC_UNITS AND NOT WIN32)
  add_executable(ftdi_wave tests/ftdi_wave.cpp tests/ftdi/mpsse.cpp tests/ftdi/wires.cpp)
  absenc_settings(ftdi_wave)
  target_link_libraries(ftdi_wave PRIVATE absenc::client)
  set_target_properties(ftdi_wave PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/tests")
  add_dependencies(change-tests ftdi_wave)
endif()
if(TARGET absenc-server AND NOT ABSENC_UNITS)
  absenc_folder_test(serve absenc/serve GLOB)
  target_link_libraries(serve_test PRIVATE absenc::server absenc::configuration ${absenc_fmt})
endif()
if(TARGET absenc-command-objects AND NOT ABSENC_UNITS)
  absenc_folder_test(command tools/absenc GLOB_RECURSE)
endif()
if(TARGET absenc-manual-objects)
  absenc_folder_test(manual tools/manual GLOB_RECURSE)
endif()

# The test kit for every unit, and toy units with errors that the kit must find.
file(GLOB kit_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tests/kit/*.cpp")
absenc_test(kit ${kit_sources})
list(FILTER kit_sources EXCLUDE REGEX "_test\\.cpp$")
# The kit runs many exchanges, so it is optimised and cannot use the precompiled headers.
set_source_files_properties(${kit_sources} PROPERTIES COMPILE_OPTIONS -O2 SKIP_PRECOMPILE_HEADERS ON)

# Builds the fuzz functions as ordinary tests; not in fuzzer builds, where the fuzzers run them.
if(ABSENC_LIBRARY_TESTS AND NOT ABSENC_FUZZ AND NOT WIN32)
  add_library(fuzz_seeds_main OBJECT tests/fuzz_seeds_main.cpp)
  absenc_settings(fuzz_seeds_main)
  target_link_libraries(fuzz_seeds_main PUBLIC absenc::absenc)
  file(GLOB_RECURSE fuzz_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/absenc/*_fuzz.cpp"
       "${PROJECT_SOURCE_DIR}/tests/*_fuzz.cpp")
  if(ABSENC_UNITS)
    list(JOIN ABSENC_UNITS "|" folders)
    list(FILTER fuzz_sources INCLUDE REGEX "/protocol/(${folders})/|/units_fuzz\\.cpp$")
  endif()
  foreach(source IN LISTS fuzz_sources)
    cmake_path(GET source STEM stem)
    set(target ${stem}_seeds)
    add_executable(${target} "${source}")
    target_include_directories(${target} PRIVATE "${PROJECT_SOURCE_DIR}")
    absenc_settings(${target})
    set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/tests")
    if(stem STREQUAL "units_fuzz")
      target_sources(${target} PRIVATE tests/kit/frames.cpp)
    endif()
    target_link_libraries(${target} PRIVATE fuzz_seeds_main absenc::absenc absenc::capture ${libzip_LIBRARIES})
    add_test(NAME fuzz_seeds.${stem} COMMAND ${target})
    # a test of fuzzer seeds takes about a minute of processor time on an idle machine
    set_tests_properties(fuzz_seeds.${stem} PROPERTIES LABELS long TIMEOUT 400)
  endforeach()
endif()

# Tests in Python, which test the command and the sources.
if(ABSENC_COMMAND AND NOT ABSENC_UNITS AND NOT WIN32)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  file(GLOB python_tests CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tests/*_test.py")
  # firmware_test needs the ARM build, so only ./dev test --all runs it; windows_test needs ./dev windows
  list(FILTER python_tests EXCLUDE REGEX "/(firmware|windows)_test\\.py$")
  if(NOT TARGET absenc-manual OR NOT PROJECT_IS_TOP_LEVEL)
    list(FILTER python_tests EXCLUDE REGEX "/install_test\\.py$")
  endif()
  set(python_environment "ABSENC=${absenc_bin_dir}/absenc")
  if(CMAKE_CROSSCOMPILING)  # a script that runs the command in qemu
    add_library(emulated_termios2 MODULE tests/emulated/termios2.cpp)
    absenc_settings(emulated_termios2)
    set(in_qemu "${CMAKE_CURRENT_BINARY_DIR}/emulated/absenc")
    set(python_environment "ABSENC=${in_qemu}" ABSENC_IN_QEMU=1)
    list(JOIN CMAKE_CROSSCOMPILING_EMULATOR " " emulator)
    # qemu cannot start programs, so the script starts what `absenc serve` would start
    file(GENERATE OUTPUT "${in_qemu}" CONTENT
"#!/bin/sh
program=${absenc_bin_dir}/absenc
[ \"$1\" != serve ] || program=${absenc_private_dir}/absenc-serve
exec ${emulator} -E LD_PRELOAD=$<TARGET_FILE:emulated_termios2> $program \"$@\"
" FILE_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
  endif()
  file(GLOB abuse_lists CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tests/abuse/*_abuse.py")
  foreach(source IN LISTS python_tests abuse_lists)
    cmake_path(GET source STEM stem)
    string(REGEX REPLACE "_test$" "" name "${stem}")
    add_test(NAME ${name}.py COMMAND "${Python3_EXECUTABLE}" -B "${source}")
    set_tests_properties(${name}.py PROPERTIES
      # ABSENC_BUSY_SECONDS relaxes time limits, because other tests run at the same time.
      ENVIRONMENT "${python_environment};ABSENC_SOURCE_DIR=${PROJECT_SOURCE_DIR};ABSENC_BUSY_SECONDS=2"
      COST 100  # Python tests start first, because they mostly wait and leave the processor to others
      TIMEOUT 900)  # time limit in seconds, long enough for a busy machine
    if(name IN_LIST absenc_long_python_tests)
      set_tests_properties(${name}.py PROPERTIES LABELS long)
      list(REMOVE_ITEM absenc_long_python_tests ${name})
    endif()
  endforeach()
  if(PROJECT_IS_TOP_LEVEL AND absenc_long_python_tests AND TARGET absenc-manual)
    message(FATAL_ERROR "No such tests: ${absenc_long_python_tests}")
  endif()
  # Browser tests and tests that load the machine on purpose count as four processes, because they leave little time for
  # others.
  set_tests_properties(serve_browser.py serve_look.py doctor_faults.py PROPERTIES PROCESSORS 4)
  set_tests_properties(speed.py doctor_healthy.py PROPERTIES RUN_SERIAL ON)
endif()

# The examples run as tests: they end by themselves, and their exit status reports success.
file(GLOB examples CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/examples/*.cpp")
if(NOT TARGET absenc-client OR ABSENC_UNITS)
  set(examples)
endif()
if(WIN32)  # this example reads its own virtual encoder through a pseudo-terminal
  list(FILTER examples EXCLUDE REGEX "/virtual_encoder\\.cpp$")
endif()
foreach(source IN LISTS examples)
  cmake_path(GET source STEM name)
  add_executable(example_${name} "${source}")
  absenc_settings(example_${name})
  set_target_properties(example_${name} PROPERTIES OUTPUT_NAME ${name}
                        RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/examples")
  target_link_libraries(example_${name} PRIVATE absenc::client absenc::configuration absenc::captures absenc::recording)
  add_dependencies(change-tests example_${name})
  set(example_arguments)
  if(name STREQUAL "decode_capture")
    set(example_arguments "${PROJECT_SOURCE_DIR}/examples/tformat.txt" tformat)
  endif()
  add_test(NAME example.${name} COMMAND example_${name} ${example_arguments})
endforeach()
