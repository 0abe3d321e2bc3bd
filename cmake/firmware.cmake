# SPDX-License-Identifier: Apache-2.0
# Builds programs for machines that QEMU emulates (firmware/). QEMU has no machine with a Cortex-M0+, but code for it
# runs on those with another Cortex-M. `./dev firmware` builds and runs them.
find_package(Python3 REQUIRED COMPONENTS Interpreter)

set(firmware_folder "${CMAKE_CURRENT_BINARY_DIR}/firmware")
# compiler flags of a Cortex-M4 with FPU; they stand behind those of the toolchain and override them
set(m4f_flags -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16)

# For each machine: its sources in firmware/machine, and the start addresses of program and RAM.
set(microbit_machine cortex_m microbit)
set(mps2_machine cortex_m mps2)
set(virt_machine virt)
set(begin_of_microbit 0 0x20000000)
set(begin_of_mps2 0 0x20000000)
set(begin_of_virt 0x80000000 0x80400000)

# firmware_program(NAME MACHINE ROM RAM SOURCES... [LIBRARY ...] [FLAGS ...]) builds NAME.elf. ROM and RAM are the sizes
# of these memories in bytes, for example 256K.
function(firmware_program name machine rom ram)
  cmake_parse_arguments(one "" "LIBRARY" "SOURCES;FLAGS" ${ARGN})
  # the sources of a machine are compiled once for each set of flags
  string(MAKE_C_IDENTIFIER "firmware_${machine}${one_FLAGS}" machine_objects)
  if(NOT TARGET ${machine_objects})
    set(machine_sources start machine ${${machine}_machine})
    list(TRANSFORM machine_sources REPLACE "(.+)" "${PROJECT_SOURCE_DIR}/firmware/machine/\\1.cpp")
    add_library(${machine_objects} OBJECT EXCLUDE_FROM_ALL ${machine_sources})
    absenc_settings(${machine_objects})
    target_include_directories(${machine_objects} PRIVATE "${PROJECT_SOURCE_DIR}")
    target_compile_options(${machine_objects} PRIVATE ${one_FLAGS})
  endif()
  list(GET begin_of_${machine} 0 rom_begin)
  list(GET begin_of_${machine} 1 ram_begin)
  add_executable(firmware_${name} EXCLUDE_FROM_ALL ${one_SOURCES})
  absenc_settings(firmware_${name})
  target_include_directories(firmware_${name} PRIVATE "${PROJECT_SOURCE_DIR}")
  target_compile_options(firmware_${name} PRIVATE ${one_FLAGS})
  set(script "${PROJECT_SOURCE_DIR}/firmware/machine/machine.ld")
  target_link_options(firmware_${name} PRIVATE ${one_FLAGS} -nostartfiles
                      "-T${script}" -Wl,--gc-sections,--no-warn-rwx-segments
                      -Wl,--defsym=rom_begin=${rom_begin},--defsym=rom_size=${rom}
                      -Wl,--defsym=ram_begin=${ram_begin},--defsym=ram_size=${ram})
  target_link_libraries(firmware_${name} PRIVATE ${machine_objects} ${one_LIBRARY})
  set_target_properties(firmware_${name} PROPERTIES OUTPUT_NAME "${name}.elf" LINK_DEPENDS "${script}"
                        RUNTIME_OUTPUT_DIRECTORY "${firmware_folder}")
endfunction()

# Converts the reference vectors (tests/*.json) to tables in C++.
file(GLOB vector_files CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tests/vectors*.json")
set(vector_tables "${firmware_folder}/reference_vectors.cpp")
set(vector_script "${PROJECT_SOURCE_DIR}/firmware/vectors.py")
add_custom_command(OUTPUT "${vector_tables}" DEPENDS "${vector_script}" ${vector_files}
                   COMMAND ${CMAKE_COMMAND} -E make_directory "${firmware_folder}"
                   COMMAND "${Python3_EXECUTABLE}" -B "${vector_script}" "${vector_tables}" ${vector_files} VERBATIM)
set(vector_sources "${PROJECT_SOURCE_DIR}/firmware/vectors.cpp" "${vector_tables}")

# for RISC-V, which has a build tree of its own, only the program that decodes all vectors is built
if(CMAKE_SYSTEM_PROCESSOR STREQUAL riscv)
  firmware_program(vectors-rv32 virt 1M 64K SOURCES ${vector_sources} LIBRARY absenc)
  add_custom_target(firmware-all DEPENDS firmware_vectors-rv32)
  return()
endif()

# Builds the whole library for a Cortex-M4 with FPU.
absenc_sources(m4f_sources ${absenc_firmware_folders})
add_library(absenc-m4f STATIC EXCLUDE_FROM_ALL ${m4f_sources})
absenc_settings(absenc-m4f)
target_include_directories(absenc-m4f PUBLIC "${PROJECT_SOURCE_DIR}")
target_compile_options(absenc-m4f PRIVATE ${m4f_flags})

firmware_program(vectors-m0plus mps2 1M 64K SOURCES ${vector_sources} LIBRARY absenc)
firmware_program(vectors-m4f mps2 1M 64K SOURCES ${vector_sources} LIBRARY absenc-m4f FLAGS ${m4f_flags})

# `drive` and `encoder` are programs for the two ends of a T-format line; each of the programs `cycles_...` contains
# both ends of a line.
foreach(program IN ITEMS drive encoder cycles_tformat cycles_biss)
  set(source "${PROJECT_SOURCE_DIR}/firmware/${program}.cpp")
  firmware_program(${program}-microbit microbit 256K 16K SOURCES "${source}" LIBRARY absenc)
  firmware_program(${program}-m0plus mps2 1M 64K SOURCES "${source}" LIBRARY absenc)
  firmware_program(${program}-m4f mps2 1M 64K SOURCES "${source}" LIBRARY absenc-m4f FLAGS ${m4f_flags})
endforeach()

add_custom_target(firmware DEPENDS firmware_vectors-m0plus firmware_drive-microbit firmware_drive-m0plus
                  firmware_encoder-microbit firmware_encoder-m0plus firmware_cycles_tformat-microbit
                  firmware_cycles_biss-microbit firmware_cycles_tformat-m0plus firmware_cycles_biss-m0plus)
add_custom_target(firmware-all DEPENDS firmware firmware_vectors-m4f firmware_drive-m4f firmware_encoder-m4f
                  firmware_cycles_tformat-m4f firmware_cycles_biss-m4f)

# Programs that firmware/figures.py measures: each reads one position or uses one part of absenc/host; a base program
# does neither. `bounds-...` are the same programs, except the base, with many inputs.
set(reading_sources ${m4f_sources})
list(FILTER reading_sources INCLUDE REGEX "(engine|/host)\\.cpp$")
foreach(cpu IN ITEMS m0plus m4f)
  add_library(absenc-reading-${cpu} STATIC EXCLUDE_FROM_ALL ${reading_sources})
  absenc_settings(absenc-reading-${cpu})
  target_include_directories(absenc-reading-${cpu} PUBLIC "${PROJECT_SOURCE_DIR}")
endforeach()
target_compile_options(absenc-reading-m4f PRIVATE ${m4f_flags})
set(flags_of_m4f FLAGS ${m4f_flags})
set(library_of_m0plus absenc)
set(library_of_m4f absenc-m4f)

add_custom_target(firmware-readers)
file(GLOB reader_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/firmware/readers/*.cpp")
foreach(source IN LISTS reader_sources)
  cmake_path(GET source STEM reader)
  string(REGEX REPLACE "_(known|carrier|cyclic)$" "" unit "${reader}")
  string(REPLACE _ - unit "${unit}")
  foreach(cpu IN ITEMS m0plus m4f)
    firmware_program(reader-${reader}-${cpu} mps2 256K 16K SOURCES "${source}" LIBRARY absenc-reading-${cpu}
                     ${flags_of_${cpu}})
    add_dependencies(firmware-readers firmware_reader-${reader}-${cpu})
    if(NOT reader STREQUAL base)
      firmware_program(bounds-${reader}-${cpu} mps2 1M 64K SOURCES "${source}" "${vector_tables}"
                       LIBRARY absenc-reading-${cpu} ${flags_of_${cpu}})
      target_link_libraries(firmware_bounds-${reader}-${cpu} PRIVATE ${library_of_${cpu}})
      target_compile_definitions(firmware_bounds-${reader}-${cpu} PRIVATE ABSENC_UNIT="${unit}")
      add_dependencies(firmware-readers firmware_bounds-${reader}-${cpu})
    endif()
  endforeach()
endforeach()
add_dependencies(firmware firmware-readers)
