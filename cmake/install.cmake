# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` and `cpack` make of a build tree.
include(CMakePackageConfigHelpers)

set(absenc_package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/absenc")
set(absenc_pkgconfig_dir "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
set(absenc_libraries absenc absenc-os)
if(TARGET absenc-capture)
  list(APPEND absenc_libraries absenc-capture)
endif()
install(TARGETS ${absenc_libraries} EXPORT absenc FILE_SET HEADERS)
install(EXPORT absenc NAMESPACE absenc:: FILE absencConfig.cmake DESTINATION "${absenc_package_dir}")
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/absencConfigVersion.cmake"
                                 COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/absencConfigVersion.cmake" DESTINATION "${absenc_package_dir}")

# The way from the folder of the .pc files to the prefix, so that the tree may be moved.
cmake_path(RELATIVE_PATH CMAKE_INSTALL_PREFIX BASE_DIRECTORY "${CMAKE_INSTALL_PREFIX}/${absenc_pkgconfig_dir}"
           OUTPUT_VARIABLE absenc_prefix_from_pkgconfig)
foreach(library IN LISTS absenc_libraries)
  configure_file("cmake/${library}.pc.in" ${library}.pc @ONLY)
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/${library}.pc" DESTINATION "${absenc_pkgconfig_dir}")
endforeach()

install(FILES README.md LICENSE DESTINATION "${CMAKE_INSTALL_DOCDIR}")

# The man page and the bash completion are written by a program that knows the tables of the command.
if(TARGET absenc-command)
  install(TARGETS absenc-command)
  if(NOT CMAKE_CROSSCOMPILING OR CMAKE_CROSSCOMPILING_EMULATOR)
    add_library(absenc-manual-objects OBJECT tools/manual/completion.cpp tools/manual/man_page.cpp)
    absenc_settings(absenc-manual-objects)
    target_link_libraries(absenc-manual-objects PUBLIC absenc-command-objects)
    add_executable(absenc-write-manual tools/manual/main.cpp)
    absenc_settings(absenc-write-manual)
    target_compile_definitions(absenc-write-manual PRIVATE ABSENC_VERSION="${PROJECT_VERSION}")
    target_link_libraries(absenc-write-manual PRIVATE absenc-manual-objects absenc-command-objects)

    set(absenc_man_page "${CMAKE_CURRENT_BINARY_DIR}/manual/absenc.1")
    set(absenc_completion "${CMAKE_CURRENT_BINARY_DIR}/manual/absenc")
    file(MAKE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/manual")
    add_custom_command(OUTPUT "${absenc_man_page}" "${absenc_completion}"
                       COMMAND absenc-write-manual "${absenc_man_page}" "${absenc_completion}"
                       DEPENDS absenc-write-manual
                       COMMENT "Writing the man page and the bash completion")
    add_custom_target(absenc-manual ALL DEPENDS "${absenc_man_page}" "${absenc_completion}")
    install(FILES "${absenc_man_page}" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1")
    install(FILES "${absenc_completion}" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions")
  endif()
endif()

if(PROJECT_IS_TOP_LEVEL)
  file(TOUCH "${CMAKE_BINARY_DIR}/install_manifest.txt")  # it stays ours when root installs
  include(package)
endif()
