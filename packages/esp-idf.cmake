# SPDX-License-Identifier: Apache-2.0
# absenc as a component of ESP-IDF 5 and newer. ESP-IDF first runs this file as a script that only collects requirements
# and cannot search for files.
include("${CMAKE_CURRENT_LIST_DIR}/../cmake/sources.cmake")
if(NOT CMAKE_BUILD_EARLY_EXPANSION)
  absenc_sources(absenc_esp_sources ${absenc_firmware_folders})
endif()
idf_component_register(SRCS ${absenc_esp_sources} INCLUDE_DIRS "${absenc_root}")
target_compile_features(${COMPONENT_LIB} PUBLIC cxx_std_20)
target_compile_options(${COMPONENT_LIB} PRIVATE ${absenc_firmware_flags})
