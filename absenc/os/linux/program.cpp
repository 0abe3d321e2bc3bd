// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/program.hpp"

#include <dlfcn.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <vector>

#include "absenc/os/error.hpp"

namespace absenc::os {

std::string folder_of_program() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) throw system_failure("finding this program's file in /proc", error.value());
  return program.parent_path().string();
}

bool is_file(const std::string& path) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0 && S_ISREG(found.st_mode);
}

void become_program(const std::string& path, const std::string& name, std::span<char* const> words) {
  std::string own_name = name;
  std::vector<char*> all{own_name.data()};
  all.insert(all.end(), words.begin(), words.end());
  all.push_back(nullptr);
  ::execv(path.c_str(), all.data());
  throw system_failure("starting " + path, errno);
}

const void* load_symbol(const std::string& path, const char* symbol) {
#ifdef ABSENC_STATIC
  throw Failure(Failure::Kind::unsupported, "this program is linked statically, so it cannot load " + path + " for " +
                                                symbol + ": use absenc from its Debian packages");
#else
  void* const plugin = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  const void* const found = plugin == nullptr ? nullptr : ::dlsym(plugin, symbol);
  if (found != nullptr) return found;
  const char* const why = ::dlerror();
  throw Failure(Failure::Kind::unsupported, "loading " + path + ": " + (why == nullptr ? "unknown" : why));
#endif
}

}  // namespace absenc::os
