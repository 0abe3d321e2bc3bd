# SPDX-License-Identifier: Apache-2.0
# Applies Debian's policy to each package: compressed man pages, a file "copyright", and folders that are readable for
# all, independent of the umask. Each component has the name of its package.
foreach(package IN LISTS CPACK_COMPONENTS_ALL)
  set(root "${CPACK_TEMPORARY_DIRECTORY}/${package}/usr")
  file(GLOB_RECURSE man_pages "${root}/share/man/*.[1-9]")
  if(man_pages)
    execute_process(COMMAND gzip -9n ${man_pages} COMMAND_ERROR_IS_FATAL ANY)
  endif()
  set(documents "${root}/share/doc/${package}")
  # the package needs no copy of the licence, whose text is in /usr/share/common-licenses
  file(REMOVE "${documents}/LICENSE")
  file(COPY "${CMAKE_CURRENT_LIST_DIR}/copyright" DESTINATION "${documents}"
       FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
  file(CHMOD_RECURSE "${root}" DIRECTORY_PERMISSIONS
       OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
endforeach()
