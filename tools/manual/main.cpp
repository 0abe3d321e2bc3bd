// SPDX-License-Identifier: Apache-2.0
// Writes the man page and the bash completion of absenc; runs while absenc is built.
#include <cstdio>
#include <fstream>

#include "absenc/protocol/all.hpp"
#include "tools/manual/completion.hpp"
#include "tools/manual/man_page.hpp"

namespace {

bool write(const char* path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  if (!file) std::perror(path);
  return file.good();
}

}  // namespace

int main(int argument_count, char** arguments) {
  using namespace absenc::tool;
  if (argument_count != 3) {
    std::fputs("usage: absenc-manual <man page> <bash completion>\n", stderr);
    return 2;
  }
  const auto subcommands = all_subcommands();
  const auto units = absenc::all_units();
  const bool good = write(arguments[1], man_page(ABSENC_VERSION, subcommands, units)) &&
                    write(arguments[2], bash_completion(subcommands, units));
  return good ? 0 : 1;
}
