# SPDX-License-Identifier: Apache-2.0
# Builds one executable per bench/*.cpp in build/release/bench. Each has its own main (BENCHMARK_MAIN).
find_package(benchmark REQUIRED)

add_custom_target(benchmarks)
file(GLOB bench_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/bench/*.cpp")
foreach(source IN LISTS bench_sources)
  cmake_path(GET source STEM name)
  add_executable(bench_${name} "${source}")
  absenc_settings(bench_${name})
  set_target_properties(bench_${name} PROPERTIES OUTPUT_NAME ${name}
                        RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/bench")
  target_link_libraries(bench_${name} PRIVATE absenc::absenc absenc::os absenc::capture ${libzip_LIBRARIES} benchmark::benchmark)
  add_dependencies(benchmarks bench_${name})
endforeach()
