# SPDX-License-Identifier: Apache-2.0
# Lists of sources, for this build and for other build systems that use a part of the repository (packages/).
get_filename_component(absenc_root "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)

# Folders that need no operating system, and compiler flags that keep firmware small by linking only functions in use.
set(absenc_firmware_folders absenc/core absenc/link absenc/protocol absenc/host)
set(absenc_firmware_flags -ffunction-sections -fdata-sections -fno-exceptions -fno-rtti -fno-threadsafe-statics)

# Returns the sources of folders, given by their paths from the root, without tests, fuzzers and benchmarks; and sources
# that are given themselves.
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
  if(NOT "absenc/os/cuse" IN_LIST ARGN)
    list(FILTER found EXCLUDE REGEX "/absenc/os/cuse/")
  endif()
  set(${result} "${found}" PARENT_SCOPE)
endfunction()

# Returns what every protocol needs: the folders of core, link, host and of what protocols are made from, and the sources
# beside these.
function(absenc_base result)
  file(GLOB beside CONFIGURE_DEPENDS RELATIVE "${absenc_root}" "${absenc_root}/absenc/protocol/*.cpp")
  list(REMOVE_ITEM beside absenc/protocol/all.cpp)
  set(${result} absenc/core absenc/link absenc/protocol/author absenc/host ${beside} PARENT_SCOPE)
endfunction()

# Returns the names of all folders of protocols.
function(absenc_all_protocols result)
  file(GLOB folders CONFIGURE_DEPENDS LIST_DIRECTORIES true RELATIVE "${absenc_root}/absenc/protocol"
       "${absenc_root}/absenc/protocol/*/")
  list(FILTER folders EXCLUDE REGEX "\\.|^author$")
  set(${result} "${folders}" PARENT_SCOPE)
endfunction()

# Returns the protocols whose code the protocol `name` uses: those in the line "Built on:" of its README.md.
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

# Returns the folders of protocols of this build: those in ABSENC_UNITS and those that they are built on, or all.
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

# Returns the lines of the list of units (protocol/all.cpp) for the units of these folders.
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
