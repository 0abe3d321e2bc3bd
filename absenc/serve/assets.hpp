// SPDX-License-Identifier: Apache-2.0
// The files of the page, which are in absenc/serve/page: cmake/embed_page.py puts them into the program.
#pragma once

#include <span>
#include <string_view>

namespace absenc::serve {

struct Asset {
  std::string_view path;  // "/app.js"
  std::string_view type;  // "text/javascript; charset=utf-8"
  std::string_view content;
};

[[nodiscard]] std::span<const Asset> assets();

}  // namespace absenc::serve
