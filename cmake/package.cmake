# SPDX-License-Identifier: Apache-2.0
# Debian packages, one for each component: cpack --config build/release/CPackConfig.cmake
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME absenc)
set(CPACK_PACKAGE_CONTACT "absenc developers <absenc@localhost.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # no common description, because each package has its own
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_ABSENC_STRIP "${CMAKE_STRIP}")
set(CPACK_PRE_BUILD_SCRIPTS "${PROJECT_SOURCE_DIR}/cmake/debian/build.cmake")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_COMPONENTS_ALL)
set(same_version "(= ${PROJECT_VERSION})")

# absenc_package(NAME SECTION SUMMARY DESCRIPTION_LINE...): declares the package of the component NAME.
macro(absenc_package name section summary)
  list(APPEND CPACK_COMPONENTS_ALL ${name})
  string(TOUPPER "${name}" upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  string(JOIN "\n" CPACK_DEBIAN_${upper}_DESCRIPTION "${summary}" ${ARGN})
endmacro()

if(TARGET absenc-command)
  absenc_package(absenc electronics "${PROJECT_DESCRIPTION}"
    "One command for the absolute encoders of servo motors: read them, set them up,"
    "emulate them, decode what was captured on their wires.")
  set(CPACK_DEBIAN_ABSENC_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_ABSENC_PACKAGE_SUGGESTS "absenc-serve, absenc-hdf5")
endif()

if(TARGET absenc-serve)
  absenc_package(absenc-serve electronics "${PROJECT_DESCRIPTION} (server)"
    "Shows absolute encoders to many: a page, HTTP with JSON, history, MQTT and"
    "Prometheus. The service starts when /etc/absenc/absenc.toml lists encoders.")
  set(CPACK_DEBIAN_ABSENC-SERVE_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_ABSENC-SERVE_PACKAGE_DEPENDS "absenc ${same_version}, adduser")
  set(CPACK_DEBIAN_ABSENC-SERVE_PACKAGE_BREAKS "absenc (<< 1.0.0)")
  # before 1.0.0 the package absenc contained the systemd service, which is now in absenc-serve
  set(CPACK_DEBIAN_ABSENC-SERVE_PACKAGE_REPLACES "absenc (<< 1.0.0)")
  set(scripts "${PROJECT_SOURCE_DIR}/cmake/debian/serve")
  set(CPACK_DEBIAN_ABSENC-SERVE_PACKAGE_CONTROL_EXTRA "${scripts}/postinst;${scripts}/prerm;${scripts}/postrm")
  set(CPACK_DEBIAN_ABSENC-SERVE_PACKAGE_CONTROL_STRICT_PERMISSION ON)
endif()

if(TARGET absenc-hdf5-plugin)
  absenc_package(absenc-hdf5 electronics "${PROJECT_DESCRIPTION} (HDF5)"
    "The plug-in by which the command absenc records readings in HDF5, the format"
    "that h5py and MATLAB read.")
  set(CPACK_DEBIAN_ABSENC-HDF5_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_ABSENC-HDF5_PACKAGE_DEPENDS "absenc ${same_version}")
endif()

absenc_package(libabsenc-dev libdevel "${PROJECT_DESCRIPTION} (development files)"
  "One C++20 library for the absolute encoders of servo motors: read them, set"
  "them up, emulate them, decode what was captured on their wires."
  "This package holds the static libraries with their headers, and the files for"
  "CMake and pkg-config.")
if(TARGET absenc-client)
  # absenc::client needs none of the suggested packages: they are for absenc::captures, absenc::ftdi, absenc::gpio and
  # absenc::hdf5
  string(JOIN ", " CPACK_DEBIAN_LIBABSENC-DEV_PACKAGE_SUGGESTS
         libdeflate-dev libftdi1-dev libgpiod-dev libhdf5-dev libminizip-dev libusb-1.0-0-dev)
endif()

if(TARGET absenc-python)
  math(EXPR python3_next_minor "${Python3_VERSION_MINOR} + 1")
  absenc_package(python3-absenc python "${PROJECT_DESCRIPTION} (Python)"
    "Absolute encoders of servo motors where tests are written and data is looked"
    "at: read them, emulate them in tests, decode captures into NumPy arrays.")
  set(CPACK_DEBIAN_PYTHON3-ABSENC_PACKAGE_CONTROL_EXTRA "${PROJECT_SOURCE_DIR}/cmake/debian/python/prerm")
  set(CPACK_DEBIAN_PYTHON3-ABSENC_PACKAGE_CONTROL_STRICT_PERMISSION ON)
  set(CPACK_DEBIAN_PYTHON3-ABSENC_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON3-ABSENC_PACKAGE_DEPENDS
      "python3 (>= ${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}), python3 (<< ${Python3_VERSION_MAJOR}.${python3_next_minor}), python3-numpy")
endif()
include(CPack)
