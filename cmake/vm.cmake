# SPDX-License-Identifier: Apache-2.0
# Programs that tests in the virtual machine use beside the command. `./dev` builds them before it starts the virtual
# machine, so they need no GoogleTest and are not part of the target `all`.
add_custom_target(vm_programs)
function(absenc_vm_program name)
  add_executable(vm_${name} EXCLUDE_FROM_ALL ${ARGN})
  absenc_settings(vm_${name})
  set_target_properties(vm_${name} PROPERTIES OUTPUT_NAME ${name} RUNTIME_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/vm")
  target_link_libraries(vm_${name} PRIVATE absenc::client absenc::configuration ${absenc_fmt} Threads::Threads)
  add_dependencies(vm_programs vm_${name})
endfunction()
absenc_vm_program(can_emulation tests/vm/can_emulation.cpp)
absenc_vm_program(ftdi_device tests/vm/ftdi_device.cpp tests/ftdi/mpsse.cpp tests/ftdi/wires.cpp)
