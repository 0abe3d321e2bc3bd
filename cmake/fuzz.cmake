# SPDX-License-Identifier: Apache-2.0
# Builds one libFuzzer executable per *_fuzz.cpp in build/sanitize/fuzzers, and a tool that writes the vectors as seeds.
if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  message(FATAL_ERROR "ABSENC_FUZZ needs clang: cmake --preset sanitize")
endif()
add_custom_target(fuzzers)

file(GLOB_RECURSE fuzz_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/absenc/*_fuzz.cpp"
       "${PROJECT_SOURCE_DIR}/tests/*_fuzz.cpp")
foreach(source IN LISTS fuzz_sources)
  cmake_path(GET source STEM name)
  add_executable(${name} "${source}")
  absenc_settings(${name})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/fuzzers")
  target_link_libraries(${name} PRIVATE absenc::absenc absenc::capture ${libzip_LIBRARIES})
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  if(name STREQUAL "units_fuzz")
    target_sources(${name} PRIVATE tests/kit/frames.cpp)
  endif()
  add_dependencies(fuzzers ${name})
endforeach()

add_executable(write_fuzz_seeds tests/write_fuzz_seeds.cpp)
absenc_settings(write_fuzz_seeds)
target_link_libraries(write_fuzz_seeds PRIVATE absenc::absenc)
add_dependencies(fuzzers write_fuzz_seeds)
