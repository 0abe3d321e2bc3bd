# SPDX-License-Identifier: Apache-2.0
# Applies Debian's policy to each package: compressed man pages, files "copyright" and "changelog", and folders that are
# readable for all, independent of the umask. Each component has the name of its package.
foreach(package IN LISTS CPACK_COMPONENTS_ALL)
  set(root "${CPACK_TEMPORARY_DIRECTORY}/${package}/usr")
  file(GLOB_RECURSE man_pages "${root}/share/man/*.[1-9]")
  if(man_pages)
    execute_process(COMMAND gzip -9n ${man_pages} COMMAND_ERROR_IS_FATAL ANY)
  endif()
  # CPack strips only files that are installed as targets of CMake, so Python modules are stripped here
  file(GLOB_RECURSE modules "${root}/lib/python3/*.so")
  foreach(module IN LISTS modules)
    execute_process(COMMAND "${CPACK_ABSENC_STRIP}" --strip-unneeded --remove-section=.comment "${module}"
                    COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
  set(documents "${root}/share/doc/${package}")
  # the package needs no text of its licence, because Debian has it in /usr/share/common-licenses
  file(REMOVE "${documents}/LICENSE")
  file(COPY "${CMAKE_CURRENT_LIST_DIR}/copyright" DESTINATION "${documents}"
       FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
  # the date is the environment variable SOURCE_DATE_EPOCH if it is set, otherwise the present time
  string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
  file(WRITE "${documents}/changelog"
       "absenc (${CPACK_PACKAGE_VERSION}) stable; urgency=medium\n\n"
       "  * CHANGELOG.md of the project says what changed.\n\n"
       " -- ${CPACK_PACKAGE_CONTACT}  ${date}\n")
  execute_process(COMMAND gzip -9nf "${documents}/changelog" COMMAND_ERROR_IS_FATAL ANY)
  file(CHMOD "${documents}/changelog.gz" PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
  if(EXISTS "${CMAKE_CURRENT_LIST_DIR}/${package}.lintian-overrides")
    file(COPY_FILE "${CMAKE_CURRENT_LIST_DIR}/${package}.lintian-overrides" "${CPACK_TEMPORARY_DIRECTORY}/overrides")
    file(MAKE_DIRECTORY "${root}/share/lintian/overrides")
    file(RENAME "${CPACK_TEMPORARY_DIRECTORY}/overrides" "${root}/share/lintian/overrides/${package}")
    file(CHMOD "${root}/share/lintian/overrides/${package}" PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
  endif()
  file(CHMOD_RECURSE "${root}" DIRECTORY_PERMISSIONS
       OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
endforeach()
