// SPDX-License-Identifier: Apache-2.0
// A file that grows by whole lines, for what must still be readable after the disk was full or the process killed.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/os/descriptor.hpp"

namespace absenc::os {

class LineFile {
 public:
  /// Makes the file. Throws Failure: `in_use` when there is one already, `no_permission`, `not_found`, `system`.
  explicit LineFile(const std::string& path);

  /// Hands `lines` to the system at once, which costs a few us, so that they survive the end of this process (not of
  /// the power: `sync`). When they do not all fit, none of them stays. Throws Failure, as `require_there` too.
  void append(std::string_view lines);
  /// Waits for the disk. Throws as `append`.
  void sync();
  /// Throws Failure, `lost`, when the file is no longer what its path leads to, or was cut: what is written then is
  /// nowhere to be found.
  void require_there() const;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }

 private:
  std::string path_;
  Descriptor file_;
  std::uint64_t size_ = 0;
};

}  // namespace absenc::os
