# SPDX-License-Identifier: Apache-2.0
# Installation and packages by `cmake --install` and `cpack`. Components: absenc (the command), absenc-serve,
# absenc-hdf5, libabsenc-dev, python3-absenc.
include(CMakePackageConfigHelpers)

set(absenc_package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/absenc")
set(absenc_pkgconfig_dir "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
set(absenc_libraries absenc)
foreach(name IN ITEMS os search client configuration capture captures recording hdf5 ftdi gpio)
  if(TARGET absenc-${name} AND TARGET absenc-client)
    list(APPEND absenc_libraries absenc-${name})
  endif()
endforeach()
if(WIN32)  # packages/windows/pack.py puts the libraries that it has built beside those of absenc
  foreach(name IN ITEMS capture hdf5)
    if(TARGET absenc-${name})
      target_link_directories(absenc-${name} INTERFACE $<INSTALL_INTERFACE:$<INSTALL_PREFIX>/${CMAKE_INSTALL_LIBDIR}>)
    endif()
  endforeach()
endif()
install(TARGETS ${absenc_libraries} EXPORT absenc ARCHIVE COMPONENT libabsenc-dev
        FILE_SET HEADERS COMPONENT libabsenc-dev)
install(EXPORT absenc NAMESPACE absenc:: FILE absencConfig.cmake DESTINATION "${absenc_package_dir}"
        COMPONENT libabsenc-dev)
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/absencConfigVersion.cmake"
                                 COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/absencConfigVersion.cmake" DESTINATION "${absenc_package_dir}"
        COMPONENT libabsenc-dev)

# The .pc files contain the prefix as a path relative to their folder, so that the installed tree can be moved.
cmake_path(RELATIVE_PATH CMAKE_INSTALL_PREFIX BASE_DIRECTORY "${CMAKE_INSTALL_PREFIX}/${absenc_pkgconfig_dir}"
           OUTPUT_VARIABLE absenc_prefix_from_pkgconfig)
# absenc_pkgconfig(NAME DESCRIPTION REQUIRES LIBRARIES...): writes and installs NAME.pc.
function(absenc_pkgconfig name description requires)
  list(TRANSFORM ARGN PREPEND -l OUTPUT_VARIABLE libraries)
  list(JOIN libraries " " libraries)
  configure_file(cmake/absenc.pc.in ${name}.pc @ONLY)
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/${name}.pc" DESTINATION "${absenc_pkgconfig_dir}"
          COMPONENT libabsenc-dev)
endfunction()
absenc_pkgconfig(absenc "${PROJECT_DESCRIPTION}" "" absenc)
if(TARGET absenc-client)
  set(same "= ${PROJECT_VERSION}")
  absenc_pkgconfig(absenc-client "Absolute encoders by address: read, set up, emulate" "absenc ${same}"
                   absenc-client absenc-search absenc-os ${absenc_system_libraries})
  absenc_pkgconfig(absenc-configuration "Names of absenc.toml for absenc-client" "absenc-client ${same}"
                   absenc-configuration)
  set(zip_libraries)
  if(ABSENC_ZIP)
    set(zip_libraries minizip z ${libdeflate_LIBRARIES})
  endif()
  absenc_pkgconfig(absenc-captures "Captures of logic analysers, decoded" "absenc-client ${same}" absenc-captures
                   absenc-capture ${zip_libraries})
  absenc_pkgconfig(absenc-recording "Recordings of encoders as CSV and JSON lines" "absenc-client ${same}"
                   absenc-recording)
endif()
if(TARGET absenc-hdf5)
  absenc_pkgconfig(absenc-hdf5 "HDF5 for absenc-recording" "absenc-recording ${same}" absenc-hdf5
                   ${absenc_hdf5_libraries})
endif()
if(TARGET absenc-ftdi)
  absenc_pkgconfig(absenc-ftdi "The clock of an FTDI chip for absenc-client" "absenc-client ${same}" absenc-ftdi
                   ${ftdi_LIBRARIES})
endif()
if(TARGET absenc-gpio)
  absenc_pkgconfig(absenc-gpio "Pulses on GPIO lines for absenc-client" "absenc-client ${same}" absenc-gpio
                   ${gpiod_LIBRARIES})
endif()

install(FILES README.md LICENSE DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT absenc)

# The man page and the bash completion are written by a program that links the tables of the command.
if(TARGET absenc-command)
  install(TARGETS absenc-command COMPONENT absenc)
  if(TARGET absenc-ftdi)
    install(FILES cmake/debian/60-absenc-ftdi.rules DESTINATION lib/udev/rules.d COMPONENT absenc)
  endif()
  if(TARGET absenc-serve)
    install(TARGETS absenc-serve DESTINATION lib/absenc COMPONENT absenc-serve)
    install(FILES cmake/debian/absenc.service DESTINATION lib/systemd/system COMPONENT absenc-serve)
    install(FILES docs/serve.md docs/mqtt.md docs/mqtt-schema.json docs/grafana-dashboard.json
            DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/absenc-serve" COMPONENT absenc-serve)
  endif()
  if(TARGET absenc-hdf5-plugin)
    install(TARGETS absenc-hdf5-plugin DESTINATION lib/absenc/plugins COMPONENT absenc-hdf5)
  endif()
  if(NOT CMAKE_CROSSCOMPILING OR CMAKE_CROSSCOMPILING_EMULATOR)
    add_library(absenc-manual-objects OBJECT tools/manual/completion.cpp tools/manual/man_page.cpp)
    absenc_settings(absenc-manual-objects)
    target_link_libraries(absenc-manual-objects PUBLIC absenc-command-objects)
    add_executable(absenc-write-manual tools/manual/main.cpp)
    absenc_settings(absenc-write-manual)
    target_compile_definitions(absenc-write-manual PRIVATE ABSENC_VERSION="${PROJECT_VERSION}")
    target_link_libraries(absenc-write-manual PRIVATE absenc-manual-objects absenc-command-objects absenc-shared-objects)

    set(absenc_man_page "${CMAKE_CURRENT_BINARY_DIR}/manual/absenc.1")
    set(absenc_completion "${CMAKE_CURRENT_BINARY_DIR}/manual/absenc")
    file(MAKE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/manual")
    add_custom_command(OUTPUT "${absenc_man_page}" "${absenc_completion}"
                       COMMAND absenc-write-manual "${absenc_man_page}" "${absenc_completion}"
                       DEPENDS absenc-write-manual
                       COMMENT "Writing the man page and the bash completion")
    # Each page of the guide is a man page too: docs/read.md is absenc-read(7).
    file(GLOB absenc_guide CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/docs/*.md")
    set(absenc_guide_pages)
    foreach(page IN LISTS absenc_guide)
      cmake_path(GET page STEM name)
      set(guide_page "${CMAKE_CURRENT_BINARY_DIR}/manual/absenc-${name}.7")
      add_custom_command(OUTPUT "${guide_page}"
                         COMMAND "${Python3_EXECUTABLE}" -B "${PROJECT_SOURCE_DIR}/cmake/guide_page.py"
                                 "${PROJECT_VERSION}" "${page}" "${guide_page}"
                         DEPENDS cmake/guide_page.py "${page}"
                         COMMENT "")
      list(APPEND absenc_guide_pages "${guide_page}")
    endforeach()
    add_custom_target(absenc-manual ALL DEPENDS "${absenc_man_page}" "${absenc_completion}" ${absenc_guide_pages})
    install(FILES ${absenc_guide_pages} DESTINATION "${CMAKE_INSTALL_MANDIR}/man7" COMPONENT absenc)
    install(FILES "${absenc_man_page}" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1" COMPONENT absenc)
    install(FILES "${absenc_completion}" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions"
            COMPONENT absenc)
  endif()
endif()

if(PROJECT_IS_TOP_LEVEL AND NOT WIN32)  # ./dev windows packs archives
  # creates CMake's list of installed files now, as the user who builds: if root created it during an installation, this
  # user could not write it afterwards
  file(TOUCH "${CMAKE_BINARY_DIR}/install_manifest.txt")
  include(package)
endif()
