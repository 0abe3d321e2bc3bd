# SPDX-License-Identifier: Apache-2.0
# A Debian package of everything that is installed: cpack --config build/release/CPackConfig.cmake
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME absenc)
set(CPACK_PACKAGE_CONTACT "absenc developers <absenc@localhost.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PRE_BUILD_SCRIPTS "${PROJECT_SOURCE_DIR}/cmake/debian.cmake")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION electronics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
string(JOIN "\n" CPACK_DEBIAN_PACKAGE_DESCRIPTION
  "One C++20 library and one command for the absolute encoders of servo motors:"
  "read them, set them up, emulate them, decode what was captured on their wires."
  "This package holds both, with the headers and the files for CMake and pkg-config.")
include(CPack)
