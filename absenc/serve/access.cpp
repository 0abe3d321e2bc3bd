// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/access.hpp"

#include <fmt/format.h>

#include <array>

#include "absenc/client/error.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr std::size_t least_token = 16;

// How long it takes tells nothing about how much of it is right.
bool same_secret(std::string_view one, std::string_view other) {
  if (one.size() != other.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < one.size(); ++i) difference |= static_cast<unsigned char>(one[i] ^ other[i]);
  return difference == 0;
}

// "localhost" of "localhost:8420", "[::1]" of "[::1]:8420"
std::string_view name_in(std::string_view host) {
  const std::size_t bracket = host.find(']');
  const std::size_t end = host.find(':', bracket == std::string_view::npos ? 0 : bracket);
  return host.substr(0, end);
}

// A page of another site can make a browser ask us under that site's own name, for which it has the answer read.
bool names_loopback(std::string_view host) {
  const std::string_view name = name_in(host);
  return name == "localhost" || name == "127.0.0.1" || name == "[::1]";
}

bool from_own_page(const Request& request) {
  if (!request.fetch_site.empty() && request.fetch_site != "same-origin" && request.fetch_site != "none") return false;
  if (request.origin.empty()) return true;  // no browser
  return request.origin == "http://" + request.host || request.origin == "https://" + request.host;
}

}  // namespace

Response error_response(unsigned status, std::string_view sentence) {
  return {status, "application/json", Json::object().set("error", sentence).line() + "\n"};
}

Access::Access(const std::string& token_file, bool on_loopback) : on_loopback_(on_loopback) {
  if (token_file.empty()) {
    if (on_loopback) return;
    throw UsageError("whoever can reach this address could read the encoders: give --token-file too");
  }
  tokens_ = read_secrets("token", token_file, least_token);
}

std::string Access::who(const Request& request) const {
  constexpr std::string_view scheme = "Bearer ";
  const std::string_view given = request.authorization;
  std::string name;
  if (!given.starts_with(scheme)) return name;
  for (const Secret& token : tokens_) {
    if (same_secret(given.substr(scheme.size()), token.secret)) name = token.name;
  }
  return name;
}

std::optional<Response> Access::refusal(const Request& request, To what) const {
  if (on_loopback_ && !names_loopback(request.host)) {
    return error_response(403, "this server answers to localhost, 127.0.0.1 and [::1] only");
  }
  if (what >= To::ask && !from_own_page(request)) {
    return error_response(403, "no other site may change anything here, or have an encoder asked");
  }
  if (what == To::anybody || (what != To::change && on_loopback_)) return {};
  if (tokens_.empty()) {
    return error_response(403, "nothing can be changed here: the server was started without --token-file");
  }
  if (!who(request).empty()) return {};
  Response response = error_response(
      401, request.authorization.empty() ? "this needs a token: Authorization: Bearer TOKEN" : wrong_token);
  response.headers.emplace_back("WWW-Authenticate", "Bearer");
  return response;
}

}  // namespace absenc::serve
