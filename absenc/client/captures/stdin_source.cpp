// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/captures/stdin_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "absenc/client/error.hpp"

namespace absenc::client {

std::size_t StdinSource::read(std::uint64_t offset, std::span<std::uint8_t> into) {
  std::size_t done = 0;
  while (done < into.size()) {
    const std::uint64_t at = offset + done;
    if (at >= end_ && !pull(at + 1)) break;
    if (at + capacity < end_) break;
    const std::size_t place = static_cast<std::size_t>(at % capacity);
    const std::uint64_t here = std::min<std::uint64_t>({into.size() - done, end_ - at, capacity - place});
    std::copy_n(window_.begin() + static_cast<std::ptrdiff_t>(place), here,
                into.begin() + static_cast<std::ptrdiff_t>(done));
    done += static_cast<std::size_t>(here);
  }
  return done;
}

// Reads until `until` bytes of the input have been read in total; returns false if the input ends before that. Throws
// Failure.
bool StdinSource::pull(std::uint64_t until) {
  while (!ended_ && end_ < until) {
    const std::size_t place = static_cast<std::size_t>(end_ % capacity);
    const std::size_t most = std::min<std::size_t>(capacity - place, 1 << 16);
    const std::size_t got = std::fread(window_.data() + place, 1, most, stdin);
    if (std::ferror(stdin) != 0) {
      throw Failure(fmt::format("standard input cannot be read: {}", std::strerror(errno)));
    }
    ended_ = got == 0;
    end_ += got;
  }
  return end_ >= until;
}

}  // namespace absenc::client
