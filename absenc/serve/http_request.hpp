// SPDX-License-Identifier: Apache-2.0
// A request as libmicrohttpd has it, and as it is handed on.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/serve/http.hpp"

struct MHD_Connection;

namespace absenc::serve {

/// Returns why a proxy before us could read this request otherwise, and take a part of it for another one (RFC
/// 9112, 3.2 and 6.3); "" when it could not.
[[nodiscard]] std::string_view ambiguity(MHD_Connection* connection, std::string_view version);

/// Bytes of its body by its header; 0 where that says nothing.
[[nodiscard]] std::uint64_t announced_length(MHD_Connection* connection);

[[nodiscard]] std::string peer_of(MHD_Connection* connection);
[[nodiscard]] int socket_of(MHD_Connection* connection);
[[nodiscard]] Request request_of(MHD_Connection* connection, const char* path, const char* method);

}  // namespace absenc::serve
