// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/http_request.hpp"

#include <microhttpd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <utility>

namespace absenc::serve {

namespace {

std::string header_of(MHD_Connection* connection, const char* name) {
  const char* value = ::MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name);
  return value == nullptr ? std::string() : value;
}

std::size_t headers_named(MHD_Connection* connection, std::string_view name) {
  std::pair<std::string_view, std::size_t> wanted{name, 0};
  const auto count = [](void* found, MHD_ValueKind, const char* header, const char*) {
    auto& [own_name, number] = *static_cast<std::pair<std::string_view, std::size_t>*>(found);
    const std::string_view other = header;
    const bool same = std::equal(own_name.begin(), own_name.end(), other.begin(), other.end(), [](char a, char b) {
      return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
    });
    if (same) ++number;
    return MHD_YES;
  };
  ::MHD_get_connection_values(connection, MHD_HEADER_KIND, count, &wanted);
  return wanted.second;
}

MHD_Result add_argument(void* query, MHD_ValueKind, const char* name, const char* value) {
  static_cast<std::multimap<std::string, std::string>*>(query)->emplace(name, value == nullptr ? "" : value);
  return MHD_YES;
}

}  // namespace

std::string Request::value(const std::string& name) const {
  const auto found = query.find(name);
  return found == query.end() ? std::string() : found->second;
}

std::string_view ambiguity(MHD_Connection* connection, std::string_view version) {
  bool has_wrong_name = false;
  const auto look = [](void* found, MHD_ValueKind, const char* header, const char*) {
    const std::string_view name = header;
    if (name.empty() || name.find_first_of(" \t") != std::string_view::npos) *static_cast<bool*>(found) = true;
    return MHD_YES;
  };
  ::MHD_get_connection_values(connection, MHD_HEADER_KIND, look, &has_wrong_name);
  if (has_wrong_name) return "a space in the name of a header";
  const std::size_t lengths = headers_named(connection, "Content-Length");
  const std::size_t encodings = headers_named(connection, "Transfer-Encoding");
  if (lengths > 1) return "two Content-Length";
  if (lengths != 0 && encodings != 0) return "Content-Length and Transfer-Encoding";
  if (encodings > 1) return "two Transfer-Encoding";
  if (encodings != 0 && header_of(connection, "Transfer-Encoding") != "chunked") return "an unknown Transfer-Encoding";
  if (encodings != 0 && version != "HTTP/1.1") return "Transfer-Encoding in HTTP/1.0";
  if (version == "HTTP/1.1" && headers_named(connection, "Host") == 0) return "no Host";
  if (headers_named(connection, "Host") > 1) return "two Host";
  if (header_of(connection, "Host").find('@') != std::string::npos) return "a user in Host";
  return {};
}

std::uint64_t announced_length(MHD_Connection* connection) {
  return std::strtoull(header_of(connection, "Content-Length").c_str(), nullptr, 10);
}

std::string peer_of(MHD_Connection* connection) {
  const MHD_ConnectionInfo* info = ::MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
  return info != nullptr && info->client_addr != nullptr ? os::host_text(*info->client_addr) : std::string();
}

int socket_of(MHD_Connection* connection) {
  const MHD_ConnectionInfo* info = ::MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
  return info != nullptr ? info->connect_fd : -1;
}

Request request_of(MHD_Connection* connection, const char* path, const char* method) {
  Request request{.method = method,
                  .path = path,
                  .query = {},
                  .peer = {},
                  .host = {},
                  .origin = {},
                  .fetch_site = {},
                  .authorization = {},
                  .forwarded_for = {}};
  ::MHD_get_connection_values(connection, MHD_GET_ARGUMENT_KIND, add_argument, &request.query);
  request.host = header_of(connection, "Host");
  request.origin = header_of(connection, "Origin");
  request.fetch_site = header_of(connection, "Sec-Fetch-Site");
  request.authorization = header_of(connection, "Authorization");
  constexpr std::array names{"Forwarded",         "Via",      "X-Forwarded-For", "X-Forwarded-Host",
                             "X-Forwarded-Proto", "X-Real-IP"};
  request.is_forwarded =
      std::any_of(names.begin(), names.end(), [&](const char* name) { return headers_named(connection, name) != 0; });
  // Of two, one may be the client's own.
  if (headers_named(connection, "X-Forwarded-For") == 1) {
    request.forwarded_for = header_of(connection, "X-Forwarded-For");
  }
  request.peer = peer_of(connection);
  return request;
}

}  // namespace absenc::serve
