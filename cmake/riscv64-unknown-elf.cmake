# SPDX-License-Identifier: Apache-2.0
# Toolchain for RV32IMAC. Debian has no C++ library for this target, so it uses the headers of the C++ library for ARM,
# and picolibc.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR riscv)
set(CMAKE_CXX_COMPILER riscv64-unknown-elf-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
file(GLOB cxx_of_arm /usr/include/newlib/c++/*/arm-none-eabi)
cmake_path(GET cxx_of_arm PARENT_PATH cxx_headers)
set(CMAKE_CXX_FLAGS_INIT "-march=rv32imac -mabi=ilp32 --specs=picolibc.specs -isystem ${cxx_headers} -isystem ${cxx_of_arm} -ffreestanding -fno-exceptions -fno-rtti -fno-threadsafe-statics -ffunction-sections -fdata-sections")
set(CMAKE_CXX_STANDARD_LIBRARIES_INIT "-nodefaultlibs -lc -lgcc")
