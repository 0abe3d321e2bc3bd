// SPDX-License-Identifier: Apache-2.0
// The program that the verb `absenc serve` starts with the same command line; apart, because only it needs the
// libraries of the server.
#include <string>

#include "absenc/client/configuration.hpp"  // the server reads absenc.toml
#include "tools/absenc/command_line.hpp"
#include "tools/absenc/optional_ports.hpp"
#include "tools/absenc/verbs/serve.hpp"
#include "tools/serve/run.hpp"

int main(int argument_count, char** arguments) {
  using namespace absenc::tool;
  const std::span<char* const> words = std::span(arguments, static_cast<std::size_t>(argument_count))
                                           .subspan(argument_count > 0 ? 1 : 0);  // POSIX allows that argc is 0
  return run_guarded([&] { return run_server(words); }, std::string(serve_subcommand.name));
}
