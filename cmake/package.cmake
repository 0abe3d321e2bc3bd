# SPDX-License-Identifier: Apache-2.0
# Debian packages, one for each component: cpack --config build/release/CPackConfig.cmake
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME absenc)
set(CPACK_PACKAGE_CONTACT "absenc developers <absenc@localhost.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # no common description, because each package has its own
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PRE_BUILD_SCRIPTS "${PROJECT_SOURCE_DIR}/cmake/debian.cmake")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL)

if(TARGET absenc-command)
  list(APPEND CPACK_COMPONENTS_ALL absenc)
  set(CPACK_DEBIAN_ABSENC_PACKAGE_NAME absenc)
  set(CPACK_DEBIAN_ABSENC_PACKAGE_SECTION electronics)
  set(CPACK_DEBIAN_ABSENC_PACKAGE_SHLIBDEPS ON)
  string(JOIN "\n" CPACK_DEBIAN_ABSENC_DESCRIPTION
    "${PROJECT_DESCRIPTION}"
    "One command for the absolute encoders of servo motors: read them, set them up,"
    "emulate them, decode what was captured on their wires.")
endif()

list(APPEND CPACK_COMPONENTS_ALL libabsenc-dev)
set(CPACK_DEBIAN_LIBABSENC-DEV_PACKAGE_NAME libabsenc-dev)
set(CPACK_DEBIAN_LIBABSENC-DEV_PACKAGE_SECTION libdevel)
if(TARGET absenc-client)
  set(CPACK_DEBIAN_LIBABSENC-DEV_PACKAGE_DEPENDS
      "libdeflate-dev, libfmt-dev, libftdi1-dev, libgpiod-dev, libhdf5-dev, libhwy-dev, libtomlplusplus-dev, libusb-1.0-0-dev, libzip-dev")
endif()
string(JOIN "\n" CPACK_DEBIAN_LIBABSENC-DEV_DESCRIPTION
  "${PROJECT_DESCRIPTION} (development files)"
  "One C++20 library for the absolute encoders of servo motors: read them, set them"
  "up, emulate them, decode what was captured on their wires."
  "This package holds the static libraries with their headers, and the files for"
  "CMake and pkg-config.")

if(TARGET absenc-python)
  math(EXPR python3_next_minor "${Python3_VERSION_MINOR} + 1")
  list(APPEND CPACK_COMPONENTS_ALL python3-absenc)
  set(CPACK_DEBIAN_PYTHON3-ABSENC_PACKAGE_NAME python3-absenc)
  set(CPACK_DEBIAN_PYTHON3-ABSENC_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON3-ABSENC_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON3-ABSENC_PACKAGE_DEPENDS
      "python3 (>= ${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}), python3 (<< ${Python3_VERSION_MAJOR}.${python3_next_minor}), python3-numpy")
  string(JOIN "\n" CPACK_DEBIAN_PYTHON3-ABSENC_DESCRIPTION
    "${PROJECT_DESCRIPTION} (Python)"
    "Absolute encoders of servo motors where tests are written and data is looked at:"
    "read them, emulate them in tests, decode captures into NumPy arrays.")
endif()
include(CPack)
