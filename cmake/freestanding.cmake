# SPDX-License-Identifier: Apache-2.0
# The freestanding layers as firmware would take them. Every header is compiled on its own, and what all of it
# together wants from outside is held against a list.
set_target_properties(absenc PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON)

add_library(freestanding OBJECT tests/freestanding.cpp)
absenc_settings(freestanding)
target_link_libraries(freestanding PRIVATE absenc)

set(linked "${CMAKE_CURRENT_BINARY_DIR}/freestanding.o")
set(objects "$<TARGET_OBJECTS:absenc>;$<TARGET_OBJECTS:freestanding>")
separate_arguments(machine_flags UNIX_COMMAND "${CMAKE_CXX_FLAGS}")
add_custom_command(
  OUTPUT "${linked}.checked"
  COMMAND ${CMAKE_CXX_COMPILER} ${machine_flags} -r -nostdlib -o "${linked}" "${objects}"
  COMMAND "${PROJECT_SOURCE_DIR}/tests/freestanding.sh" "${linked}" "${objects}"
  COMMAND ${CMAKE_COMMAND} -E touch "${linked}.checked"
  DEPENDS "${objects}" "${PROJECT_SOURCE_DIR}/tests/freestanding.sh"
  COMMAND_EXPAND_LISTS VERBATIM
  COMMENT "Checking what the freestanding objects want")
add_custom_target(freestanding-check ALL DEPENDS "${linked}.checked")
add_custom_target(freestanding-headers ALL)
add_dependencies(freestanding-headers all_verify_interface_header_sets)

# Firmware that reads positions and nothing else: ./dev firmware-sizes prints what of the library it links.
file(GLOB firmware_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/bench/firmware/*.cpp")
set(firmware_programs)
foreach(source IN LISTS firmware_sources)
  cmake_path(GET source STEM name)
  add_executable(firmware_${name} "${source}")
  absenc_settings(firmware_${name})
  target_include_directories(firmware_${name} PRIVATE "${PROJECT_SOURCE_DIR}")
  target_link_libraries(firmware_${name} PRIVATE absenc)
  target_link_options(firmware_${name} PRIVATE --specs=nano.specs --specs=nosys.specs -nostartfiles
                                               -Wl,--gc-sections,--entry=main,--no-warn-rwx-segments)
  set_target_properties(firmware_${name} PROPERTIES OUTPUT_NAME "${name}.elf"
                        RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/firmware")
  list(APPEND firmware_programs "$<TARGET_FILE:firmware_${name}>")
endforeach()
add_custom_target(firmware-sizes COMMAND "${PROJECT_SOURCE_DIR}/bench/firmware/sizes.sh" ${firmware_programs}
                  DEPENDS ${firmware_programs} COMMAND_EXPAND_LISTS VERBATIM)
