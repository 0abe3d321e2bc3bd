// SPDX-License-Identifier: Apache-2.0
// Programs and plug-ins that belong to the command but may be installed later, each with the libraries that only it
// needs.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// The plug-in for recordings in HDF5, and the Debian package that has it.
inline constexpr std::string_view hdf5_plugin = "plugins/hdf5.so";
inline constexpr std::string_view hdf5_package = "absenc-hdf5";

/// Returns the path at which the part `name` belongs: lib/absenc/NAME beside the folder of the command.
[[nodiscard]] std::string path_of_part(std::string_view name);

/// Throws the Failure that the part at `path`, of the Debian package `package`, is not there. `purpose`: what needs it.
[[noreturn]] void report_missing(std::string_view purpose, std::string_view path, std::string_view package);

/// Runs the program of the verb with the same command-line words: replaces this process by it, or returns its exit
/// status where it is a part of this program. Throws Failure if it is not installed.
[[nodiscard]] int run_program(const Subcommand& subcommand, std::span<char* const> words);

/// Loads the plug-in for HDF5 unless HDF5 is a part of this program, so that recordings can be written with it. Throws
/// Failure if it is not installed or of another version.
void load_hdf5();

}  // namespace absenc::tool
