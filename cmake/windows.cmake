# SPDX-License-Identifier: Apache-2.0
# Provides a build for Windows with packages of Debian: headers that suit any system, and the sources of GoogleTest. Only
# these folders are linked into the build tree, because /usr/include has the C library of Linux.
set(absenc_foreign_headers "${CMAKE_CURRENT_BINARY_DIR}/include")
file(MAKE_DIRECTORY "${absenc_foreign_headers}")
foreach(folder IN ITEMS fmt hwy nlohmann toml++)
  if(NOT IS_DIRECTORY "/usr/include/${folder}")
    message(FATAL_ERROR "/usr/include/${folder} is missing: ./dev windows installs its package")
  endif()
  file(CREATE_LINK "/usr/include/${folder}" "${absenc_foreign_headers}/${folder}" SYMBOLIC)
endforeach()

add_library(absenc-foreign-headers INTERFACE)
target_include_directories(absenc-foreign-headers SYSTEM INTERFACE "${absenc_foreign_headers}")
add_library(fmt::fmt-header-only ALIAS absenc-foreign-headers)
add_library(nlohmann_json::nlohmann_json ALIAS absenc-foreign-headers)

# Windows 10; without names that collide with ours; with M_PI.
add_compile_definitions(_WIN32_WINNT=0x0A00 WIN32_LEAN_AND_MEAN NOMINMAX _USE_MATH_DEFINES FMT_HEADER_ONLY=1)
set(absenc_system_libraries ws2_32 setupapi)

# Libraries without a mingw package in Debian, each in a folder (packages/windows/libraries.py). Only what includes their
# headers links this target, so that a new version of one of them does not compile everything anew.
if(NOT ABSENC_WINDOWS_LIBRARIES AND (ABSENC_COMMAND OR ABSENC_ZIP OR ABSENC_HDF5))
  message(FATAL_ERROR "ABSENC_WINDOWS_LIBRARIES is empty: ./dev windows builds these libraries and sets it")
endif()
add_library(absenc-windows-libraries INTERFACE)
list(TRANSFORM ABSENC_WINDOWS_LIBRARIES APPEND /include OUTPUT_VARIABLE folders)
target_include_directories(absenc-windows-libraries SYSTEM INTERFACE ${folders})
list(TRANSFORM ABSENC_WINDOWS_LIBRARIES APPEND /lib OUTPUT_VARIABLE folders)
target_link_directories(absenc-windows-libraries INTERFACE ${folders})
target_compile_definitions(absenc-windows-libraries INTERFACE LIBMOSQUITTO_STATIC NCURSES_STATIC)
set(absenc_built_libraries $<BUILD_INTERFACE:absenc-windows-libraries>)
set(libdeflate_LIBRARIES deflate)
set(microhttpd_LIBRARIES microhttpd ws2_32 ${absenc_built_libraries})
set(mosquitto_LIBRARIES mosquitto ws2_32)
set(absenc_hdf5_libraries hdf5 ${absenc_built_libraries})
set(CURSES_LIBRARIES ncursesw ${absenc_built_libraries})

if(ABSENC_TESTS)
  set(BUILD_GMOCK ON)
  set(INSTALL_GTEST OFF)
  set(gtest_disable_pthreads ON)
  add_subdirectory(/usr/src/googletest "${CMAKE_CURRENT_BINARY_DIR}/googletest" EXCLUDE_FROM_ALL)
endif()
