# SPDX-License-Identifier: Apache-2.0
# Determines the commit, the architecture and the optional parts of the build, which `absenc --version` prints.
find_package(Git QUIET)
set(absenc_commit unknown)
if(EXISTS "${PROJECT_SOURCE_DIR}/COMMIT")  # archives of the sources contain this file instead of .git
  file(READ "${PROJECT_SOURCE_DIR}/COMMIT" absenc_commit)
  string(STRIP "${absenc_commit}" absenc_commit)
elseif(GIT_FOUND AND EXISTS "${PROJECT_SOURCE_DIR}/.git")
  execute_process(COMMAND "${GIT_EXECUTABLE}" rev-parse --short=12 HEAD WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
                  OUTPUT_VARIABLE absenc_commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(EXISTS "${PROJECT_SOURCE_DIR}/.git/logs/HEAD")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/.git/logs/HEAD")
  endif()
endif()

set(absenc_built_in)
foreach(part IN ITEMS "GPIO:GPIO lines" "CUSE:emulated SPI devices")
  string(REGEX REPLACE ":.*" "" option "${part}")
  string(REGEX REPLACE ".*:" "" name "${part}")
  if(ABSENC_${option})
    list(APPEND absenc_built_in "${name}")
  endif()
endforeach()
if(ABSENC_STATIC)
  list(APPEND absenc_built_in "all libraries")
endif()
list(JOIN absenc_built_in ", " absenc_built_in)
if(NOT absenc_built_in)
  set(absenc_built_in nothing more)
endif()
set(absenc_version_definitions ABSENC_VERSION="${PROJECT_VERSION}" ABSENC_COMMIT="${absenc_commit}"
    ABSENC_ARCHITECTURE="${CMAKE_SYSTEM_PROCESSOR}" ABSENC_BUILT_IN="${absenc_built_in}")
