// SPDX-License-Identifier: Apache-2.0
// The files of the web page in absenc/serve/page, which are embedded into the program.
#pragma once

#include <span>
#include <string_view>

namespace absenc::serve {

struct Asset {
  std::string_view path;  // path of the file in the URL: "/app.js"
  std::string_view type;  // content type of the file: "text/javascript; charset=utf-8"
  std::string_view content;
};

[[nodiscard]] std::span<const Asset> assets();

}  // namespace absenc::serve
