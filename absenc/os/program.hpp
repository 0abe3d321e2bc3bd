// SPDX-License-Identifier: Apache-2.0
// The program of this process, other programs that take its place, and plug-ins.
#pragma once

#include <span>
#include <string>

namespace absenc::os {

/// Returns the folder of this program's file. Throws Failure.
[[nodiscard]] std::string folder_of_program();

[[nodiscard]] bool is_file(const std::string& path);

/// Replaces this process by another program, which is told that its name is `name`. Throws Failure.
[[noreturn]] void become_program(const std::string& path, const std::string& name, std::span<char* const> words);

/// Loads the plug-in at `path`, which stays loaded, and returns the address of its symbol `symbol`. Throws Failure.
[[nodiscard]] const void* load_symbol(const std::string& path, const char* symbol);

}  // namespace absenc::os
