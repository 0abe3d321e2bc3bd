# SPDX-License-Identifier: Apache-2.0
# Which files belong to what: for the build of this checkout, and for those of others that take part of it (packages/).
get_filename_component(absenc_root "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)

# What needs no operating system, and what of a compiler makes that small: what nobody calls is not linked.
set(absenc_firmware_folders absenc/core absenc/link absenc/protocol absenc/host)
set(absenc_firmware_flags -ffunction-sections -fdata-sections -fno-exceptions -fno-rtti -fno-threadsafe-statics)

# Sources of folders, without what stands beside them for testing.
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
