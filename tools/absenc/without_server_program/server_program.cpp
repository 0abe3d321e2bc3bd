// SPDX-License-Identifier: Apache-2.0
// In place of tools/absenc/server_program.cpp where the command is one file, which contains the server.
#include "tools/absenc/parts.hpp"
#include "tools/serve/run.hpp"

namespace absenc::tool {

int run_program(const Subcommand&, std::span<char* const> words) { return run_server(words); }

}  // namespace absenc::tool
