# SPDX-License-Identifier: Apache-2.0
# A program that tests in the virtual machine use beside the command. `./dev` builds it before it starts the virtual
# machine, so it needs no GoogleTest and is not part of the target `all`.
add_executable(vm_can_emulation EXCLUDE_FROM_ALL tests/vm/can_emulation.cpp)
absenc_settings(vm_can_emulation)
set_target_properties(vm_can_emulation PROPERTIES OUTPUT_NAME can_emulation
                      RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/vm")
target_link_libraries(vm_can_emulation PRIVATE absenc::client absenc::configuration ${absenc_fmt})
