// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/access.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/client/text/json.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr std::size_t shortest_token = 16;
constexpr unsigned most_guesses = 10;  // greatest number of wrong tokens from one IP address within `time_of_guesses`
constexpr Time time_of_guesses = std::chrono::seconds(60);
constexpr std::size_t most_addresses = 1000;
constexpr std::string_view wrong_token = "the token is wrong: the server's token file has no such token";

// Returns whether two texts are equal if the case of ASCII letters is ignored.
bool equals_ignoring_case(std::string_view one, std::string_view other) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(one.begin(), one.end(), other.begin(), other.end(),
                    [&](char a, char b) { return lower(a) == lower(b); });
}

// Returns whether two secrets are equal; the time that this takes does not show at which byte they differ.
bool same_secret(std::string_view one, std::string_view other) {
  if (one.size() != other.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < one.size(); ++i) difference |= static_cast<unsigned char>(one[i] ^ other[i]);
  return difference == 0;
}

// Returns the host name without its port: "localhost" of "localhost:8420".
std::string_view host_name_in(std::string_view host) {
  const std::size_t bracket = host.find(']');
  const std::size_t end = host.find(':', bracket == std::string_view::npos ? 0 : bracket);
  return host.substr(0, end);
}

bool names_loopback(std::string_view host) {
  const std::string_view name = host_name_in(host);
  return equals_ignoring_case(name, "localhost") || name == "127.0.0.1" || name == "[::1]";
}

bool is_loopback_address(std::string_view address) { return address.starts_with("127.") || address == "::1"; }

// Returns the part of an origin behind "//": its host and port.
std::string_view authority_of(std::string_view origin) {
  return origin.substr(std::min(origin.find("//") + 2, origin.size()));
}

// Returns the origin of a URL (scheme, host, port), without the port if it is 443 for https or 80 for http; "" for "".
// Throws UsageError.
std::string origin_of(std::string_view url) {
  if (url.empty()) return {};
  const std::size_t host = url.starts_with("https://") ? 8 : url.starts_with("http://") ? 7 : 0;
  const std::size_t end = std::min(url.find('/', host), url.size());
  if (host == 0 || host == end || url.find_first_of("@?# ") != std::string_view::npos) {
    throw UsageError(fmt::format(
        "--public-url is \"{}\", but must be where browsers find the page, as https://encoders.example", url));
  }
  std::string_view origin = url.substr(0, end);
  const std::string_view usual = host == 8 ? ":443" : ":80";
  if (origin.ends_with(usual)) origin.remove_suffix(usual.size());
  return std::string(origin);
}

}  // namespace

Response error_response(unsigned status, std::string_view sentence) {
  return {status, "application/json", Json::object().set("error", sentence).line() + "\n"};
}

Access::Access(const Choices& choices, ServerEvents& server_events)
    : token_file_(choices.token_file),
      public_origin_(origin_of(choices.public_url)),
      on_loopback_(choices.on_loopback),
      server_events_(&server_events) {
  if (token_file_.empty()) {
    if (on_loopback_) return;
    throw UsageError("anyone who can reach this address could read the encoders: add --token-file FILE");
  }
  tokens_ = read_secrets("token", token_file_, shortest_token);
}

void Access::reload() {
  if (token_file_.empty()) return;
  std::vector<Secret> tokens = read_secrets("token", token_file_, shortest_token);
  const std::lock_guard lock(mutex_);
  tokens_ = std::move(tokens);
}

std::uint64_t Access::wrong_tokens() const {
  const std::lock_guard lock(mutex_);
  return wrong_tokens_;
}

// Counts a wrong token of an IP address, and returns whether the address may try again.
bool Access::may_try_again(const std::string& peer) const {
  const Time now = os::now();
  const std::lock_guard lock(mutex_);
  ++wrong_tokens_;
  std::erase_if(guesses_, [&](const auto& one) { return now - one.second.since > time_of_guesses; });
  if (guesses_.size() >= most_addresses && !guesses_.contains(peer)) return false;
  Guesses& guesses = guesses_.try_emplace(peer, Guesses{now, 0}).first->second;
  ++guesses.count;
  if (guesses.count == 1) server_events_->add({calendar_ms(), "", "access", "a request had a wrong token", peer});
  if (guesses.count == most_guesses + 1) {
    server_events_->add(
        {calendar_ms(), "", "access",
         fmt::format(
             "more than {} wrong tokens within a minute: further ones are refused with 429 until the minute is over",
             most_guesses),
         peer});
  }
  return guesses.count <= most_guesses;
}

std::string Access::token_name(const Request& request) const {
  constexpr std::string_view scheme = "Bearer ";
  const std::string_view given = request.authorization;
  std::string name;
  if (!equals_ignoring_case(given.substr(0, scheme.size()), scheme)) return name;
  const std::lock_guard lock(mutex_);
  for (const Secret& token : tokens_) {
    if (same_secret(given.substr(scheme.size()), token.secret)) name = token.name;
  }
  return name;
}

// Returns whether the header Host names this server: the check against DNS rebinding.
bool Access::names_this_server(std::string_view host) const {
  return names_loopback(host) || (!public_origin_.empty() &&
                                  equals_ignoring_case(host_name_in(host), host_name_in(authority_of(public_origin_))));
}

bool Access::is_from_own_page(const Request& request) const {
  if (!request.fetch_site.empty() && request.fetch_site != "same-origin" && request.fetch_site != "none") return false;
  // Without the header Origin, nothing shows that a page of another site sent the request.
  if (request.origin.empty()) return true;
  return equals_ignoring_case(request.origin, "http://" + request.host) ||
         equals_ignoring_case(request.origin, "https://" + request.host) ||
         (!public_origin_.empty() && equals_ignoring_case(request.origin, public_origin_));
}

bool Access::needs_token(const Request& request, Right right) const {
  if (right == Right::open || right == Right::change || !on_loopback_) return right != Right::open;
  return has_tokens() && (request.is_forwarded || !public_origin_.empty());
}

// Returns the IP address of the client. Behind a proxy on this computer, this is the last entry of X-Forwarded-For: the
// proxy wrote it, while the client may have written the entries before it.
std::string Access::client_of(const Request& request) const {
  if (public_origin_.empty() || !is_loopback_address(request.peer)) return request.peer;
  const std::string& list = request.forwarded_for;
  const std::string last = list.substr(list.find_last_of(", ") + 1);
  const bool is_address = last.size() <= 45 && last.find_first_not_of("0123456789abcdefABCDEF.:") == std::string::npos;
  return last.empty() || !is_address ? request.peer : last;
}

std::optional<Response> Access::refusal(const Request& request, Right right) const {
  if (on_loopback_ && !names_this_server(request.host)) {
    return error_response(
        403, public_origin_.empty()
                 ? "this server accepts requests to localhost, 127.0.0.1 and [::1] only: behind a proxy, start it "
                   "with --public-url"
                 : fmt::format("this server accepts requests to localhost, 127.0.0.1, [::1] and the name in {} only",
                               public_origin_));
  }
  if (right >= Right::poll && !is_from_own_page(request)) {
    return error_response(403,
                          "requests from other sites may not change or poll an encoder: if a proxy shows this page, "
                          "start the server with --public-url");
  }
  if (!needs_token(request, right)) return {};
  if (token_file_.empty()) {
    return error_response(403, "this server changes nothing: it was started without --token-file");
  }
  if (!token_name(request).empty()) return {};
  return refuse_token(request);
}

Response Access::refuse_token(const Request& request) const {
  if (!request.authorization.empty() && !may_try_again(request.peer)) {
    Response response = error_response(429, "too many wrong tokens from this address: try again in a minute");
    response.headers.emplace_back("Retry-After", "60");
    return response;
  }
  Response response = error_response(
      401, request.authorization.empty() ? "this needs a token: Authorization: Bearer TOKEN" : wrong_token);
  response.headers.emplace_back("WWW-Authenticate", "Bearer");
  return response;
}

}  // namespace absenc::serve
