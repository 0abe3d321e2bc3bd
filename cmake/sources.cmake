# SPDX-License-Identifier: Apache-2.0
# Lists of sources, for this build and for other build systems that use a part of the repository (packages/).
get_filename_component(absenc_root "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)

# Folders that need no operating system, and compiler flags that keep firmware small by linking only functions in use.
set(absenc_firmware_folders absenc/core absenc/link absenc/protocol absenc/host)
set(absenc_firmware_flags -ffunction-sections -fdata-sections -fno-exceptions -fno-rtti -fno-threadsafe-statics)

# Returns the sources of folders, without tests, fuzzers and benchmarks.
function(absenc_sources result)
  set(found)
  foreach(folder IN LISTS ARGN)
    file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${absenc_root}/${folder}/*.cpp")
    list(APPEND found ${sources})
  endforeach()
  list(FILTER found EXCLUDE REGEX "_(test|fuzz|bench)\\.cpp$")
  if(NOT "absenc/os/cuse" IN_LIST ARGN)
    list(FILTER found EXCLUDE REGEX "/absenc/os/cuse/")
  endif()
  set(${result} "${found}" PARENT_SCOPE)
endfunction()
