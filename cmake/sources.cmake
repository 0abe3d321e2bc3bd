# SPDX-License-Identifier: Apache-2.0
# Lists of sources, for this build and for other build systems that use a part of the repository (packages/).
get_filename_component(absenc_root "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)

# Folders of the layers that need no operating system, and compiler flags that keep firmware small.
set(absenc_firmware_folders absenc/core absenc/link absenc/protocol absenc/host)
set(absenc_firmware_flags -ffunction-sections -fdata-sections -fno-exceptions -fno-rtti -fno-threadsafe-statics)

# Folders whose sources belong to libraries of their own, because they need libraries of the system.
set(absenc_separate_folders absenc/os/linux/cuse absenc/os/linux/without_cuse absenc/os/linux/ftdi
    absenc/os/linux/gpio absenc/capture/files/without_zip tools/absenc/monitor/without_screen
    tools/absenc/without_server_program tools/absenc/without_hdf5_plugin)

# Folders of absenc/os for other systems than that of the target, as a regular expression.
if(CMAKE_SYSTEM_NAME STREQUAL "Windows")
  set(absenc_other_systems linux)
else()
  set(absenc_other_systems windows)
endif()

# Sets `result` to the given sources and those in the given folders, without tests, fuzzers and benchmarks. The sources
# in a folder of absenc_separate_folders are included only if exactly that folder is given.
function(absenc_sources result)
  set(found)
  foreach(path IN LISTS ARGN)
    set(sources "${absenc_root}/${path}")
    if(IS_DIRECTORY "${sources}")
      file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${sources}/*.cpp")
    endif()
    list(APPEND found ${sources})
  endforeach()
  list(FILTER found EXCLUDE REGEX "_(test|fuzz|bench)\\.cpp$")
  list(FILTER found EXCLUDE REGEX "/absenc/os/(${absenc_other_systems})/")
  foreach(folder IN LISTS absenc_separate_folders)
    if(NOT folder IN_LIST ARGN)
      list(FILTER found EXCLUDE REGEX "/${folder}/")
    elseif(folder MATCHES "^(.+)/without_[a-z0-9_]+$")  # its sources are in place of those above it
      file(GLOB replaced RELATIVE "${absenc_root}/${folder}" "${absenc_root}/${folder}/*.cpp")
      list(TRANSFORM replaced PREPEND "${absenc_root}/${CMAKE_MATCH_1}/")
      list(REMOVE_ITEM found ${replaced})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES found)
  set(${result} "${found}" PARENT_SCOPE)
endfunction()

function(absenc_base result)
  file(GLOB beside CONFIGURE_DEPENDS RELATIVE "${absenc_root}" "${absenc_root}/absenc/protocol/*.cpp")
  list(REMOVE_ITEM beside absenc/protocol/all.cpp)
  set(${result} absenc/core absenc/link absenc/protocol/author absenc/host ${beside} PARENT_SCOPE)
endfunction()

# Sets `result` to the names of all folders of protocols.
function(absenc_all_protocols result)
  file(GLOB folders CONFIGURE_DEPENDS LIST_DIRECTORIES true RELATIVE "${absenc_root}/absenc/protocol"
       "${absenc_root}/absenc/protocol/*/")
  list(FILTER folders EXCLUDE REGEX "\\.|^author$")
  set(${result} "${folders}" PARENT_SCOPE)
endfunction()

# Sets `result` to the protocols that the README.md of the protocol `name` lists in its line "Built on:".
function(absenc_built_on result name)
  set(readme "${absenc_root}/absenc/protocol/${name}/README.md")
  set(line)
  if(EXISTS "${readme}")
    file(STRINGS "${readme}" line REGEX "^Built on:" LIMIT_COUNT 1)
    set_property(DIRECTORY "${absenc_root}" APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${readme}")
  endif()
  string(REPLACE "Built on:" "" line "${line}")
  string(REGEX MATCHALL "[a-z0-9_]+" others "${line}")
  set(${result} "${others}" PARENT_SCOPE)
endfunction()

# Sets `result` to the folders of the protocols that this build contains, and of those on which they are built.
function(absenc_protocols result)
  absenc_all_protocols(all)
  if(NOT ABSENC_UNITS)
    set(${result} "${all}" PARENT_SCOPE)
    return()
  endif()
  set(wanted ${ABSENC_UNITS})
  set(found)
  while(wanted)
    list(POP_FRONT wanted name)
    if(NOT name IN_LIST all)
      message(FATAL_ERROR "There is no folder absenc/protocol/${name}")
    elseif(NOT name IN_LIST found)
      list(APPEND found ${name})
      absenc_built_on(others ${name})
      list(APPEND wanted ${others})
    endif()
  endwhile()
  set(${result} "${found}" PARENT_SCOPE)
endfunction()

# Sets `result` to the lines of protocol/all.cpp that list the units of the given folders.
function(absenc_entries result)
  set(list_of_units "${absenc_root}/absenc/protocol/all.cpp")
  file(READ "${list_of_units}" text)
  set_property(DIRECTORY "${absenc_root}" APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${list_of_units}")
  set(found)
  foreach(name IN LISTS ARGN)
    string(REGEX MATCHALL "one\\(${name}, [a-z0-9_]+\\)" entries "${text}")
    if(NOT entries)
      message(FATAL_ERROR "absenc/protocol/all.cpp lists no unit of the folder ${name}")
    endif()
    list(APPEND found ${entries})
  endforeach()
  list(JOIN found " " found)
  set(${result} "${found}" PARENT_SCOPE)
endfunction()
