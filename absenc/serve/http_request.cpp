// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/http_request.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <utility>

namespace absenc::serve {

namespace {

bool is_same_name(std::string_view one, std::string_view other) {
  return std::equal(one.begin(), one.end(), other.begin(), other.end(), [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
  });
}

}  // namespace

std::size_t Headers::count(std::string_view name) const {
  return static_cast<std::size_t>(
      std::ranges::count_if(all_, [&](const auto& header) { return is_same_name(header.first, name); }));
}

std::string Headers::first(std::string_view name) const {
  const auto found = std::ranges::find_if(all_, [&](const auto& header) { return is_same_name(header.first, name); });
  return found == all_.end() ? std::string() : found->second;
}

std::string Request::value(const std::string& name) const {
  const auto found = query.find(name);
  return found == query.end() ? std::string() : found->second;
}

std::string_view Headers::ambiguity(std::string_view version) const {
  for (const auto& [name, value] : all_) {
    if (name.empty() || name.find_first_of(" \t") != std::string::npos) return "a space in the name of a header";
  }
  const std::size_t lengths = count("Content-Length");
  const std::size_t encodings = count("Transfer-Encoding");
  if (lengths > 1) return "two Content-Length";
  if (lengths != 0 && encodings != 0) return "Content-Length and Transfer-Encoding";
  if (encodings > 1) return "two Transfer-Encoding";
  if (encodings != 0 && first("Transfer-Encoding") != "chunked") return "an unknown Transfer-Encoding";
  if (encodings != 0 && version != "HTTP/1.1") return "Transfer-Encoding in HTTP/1.0";
  if (version == "HTTP/1.1" && count("Host") == 0) return "no Host";
  if (count("Host") > 1) return "two Host";
  if (first("Host").find('@') != std::string::npos) return "a user in Host";
  return {};
}

std::uint64_t Headers::announced_length() const { return std::strtoull(first("Content-Length").c_str(), nullptr, 10); }

void Headers::copy_to(Request& request) const {
  request.host = first("Host");
  request.origin = first("Origin");
  request.fetch_site = first("Sec-Fetch-Site");
  request.authorization = first("Authorization");
  constexpr std::array names{"Forwarded",         "Via",      "X-Forwarded-For", "X-Forwarded-Host",
                             "X-Forwarded-Proto", "X-Real-IP"};
  request.is_forwarded = std::any_of(names.begin(), names.end(), [&](const char* name) { return count(name) != 0; });
  // A header X-Forwarded-For that occurs twice is ignored: the client may have written one of the two itself.
  if (count("X-Forwarded-For") == 1) request.forwarded_for = first("X-Forwarded-For");
}

}  // namespace absenc::serve
