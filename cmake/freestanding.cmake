# SPDX-License-Identifier: Apache-2.0
# Compiles the freestanding layers with the compiler and flags of firmware. Every header is compiled on its own. The
# build fails if the objects need external symbols other than those that tests/freestanding.sh allows.
set_target_properties(absenc PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON)

add_library(freestanding OBJECT tests/freestanding.cpp)
absenc_settings(freestanding)
target_link_libraries(freestanding PRIVATE absenc)

set(linked "${CMAKE_CURRENT_BINARY_DIR}/freestanding.o")
set(objects "$<TARGET_OBJECTS:absenc>;${absenc_objects};$<TARGET_OBJECTS:freestanding>")
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
