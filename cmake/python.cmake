# SPDX-License-Identifier: Apache-2.0
# Builds the whole Python package in build/release/python: the extension module and the Python sources.
find_package(Python3 3.11 REQUIRED COMPONENTS Interpreter Development.Module)
set(Python_EXECUTABLE "${Python3_EXECUTABLE}")
find_package(pybind11 REQUIRED)

file(GLOB python_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/python/src/*.cpp")
pybind11_add_module(absenc-python MODULE NO_EXTRAS ${python_sources})
absenc_settings(absenc-python)
absenc_unity(absenc-python ${python_sources})
set(absenc_python_dir "${CMAKE_CURRENT_BINARY_DIR}/python/absenc")
set_target_properties(absenc-python PROPERTIES OUTPUT_NAME _absenc LIBRARY_OUTPUT_DIRECTORY "${absenc_python_dir}")
target_include_directories(absenc-python PRIVATE "${PROJECT_SOURCE_DIR}")
target_compile_definitions(absenc-python PRIVATE ABSENC_VERSION="${PROJECT_VERSION}")
target_link_libraries(absenc-python PRIVATE absenc::configuration absenc::captures absenc::recording ${absenc_fmt}
                                            $<TARGET_NAME_IF_EXISTS:absenc-ftdi> $<TARGET_NAME_IF_EXISTS:absenc-gpio>
                                            $<TARGET_NAME_IF_EXISTS:absenc-hdf5>)
foreach(part IN ITEMS FTDI GPIO HDF5)
  if(ABSENC_${part})
    target_compile_definitions(absenc-python PRIVATE ABSENC_${part})
  endif()
endforeach()

file(GLOB python_files CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/python/absenc/*")
list(FILTER python_files EXCLUDE REGEX "/__pycache__$")
foreach(file IN LISTS python_files)
  cmake_path(GET file FILENAME name)
  configure_file("${file}" "${absenc_python_dir}/${name}" COPYONLY)
endforeach()

# Installs into the folder that Debian's Python searches for packages.
if(ABSENC_INSTALL AND NOT ABSENC_SANITIZE)
  install(DIRECTORY "${absenc_python_dir}" DESTINATION lib/python3/dist-packages COMPONENT python3-absenc
          PATTERN __pycache__ EXCLUDE)
endif()
