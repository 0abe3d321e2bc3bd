// SPDX-License-Identifier: Apache-2.0
// Decides which requests are allowed, and which need a token.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/time.hpp"
#include "absenc/serve/http.hpp"
#include "absenc/serve/secret_file.hpp"
#include "absenc/serve/server_event.hpp"

namespace absenc::serve {

class Access {
 public:
  enum class Right : std::uint8_t {
    open,    // requests for the page itself or the health check, which need no token
    read,    // requests for data that the server has already read
    poll,    // requests that poll the encoder or interrupt its readings, without changing it
    change,  // requests that run a command of the encoder or acknowledge an alarm
  };

  struct Choices {
    std::string token_file{};  // file with lines of a name and a token; "": no tokens, allowed on loopback only
    std::string public_url{};  // URL at which a proxy on this computer shows the page; "": no proxy
    bool on_loopback = false;  // whether the server listens on loopback, so no other computer can reach it directly
  };
  /// Throws Failure if the token file cannot be used, and UsageError. `server_events` must outlive this object.
  Access(const Choices& choices, ServerEvents& server_events);

  /// Reads the token file again. Throws Failure; the previous tokens then stay valid.
  void reload();

  /// Returns the response that refuses the request; nothing if it is allowed.
  [[nodiscard]] std::optional<Response> refusal(const Request& request, Right right) const;
  /// Returns the IP address of the client: that of the connection, or the one that a proxy on this computer reports.
  [[nodiscard]] std::string client_of(const Request& request) const;
  /// Returns the name of the token in the request; "" without a valid token.
  [[nodiscard]] std::string token_name(const Request& request) const;
  /// Returns the response to a request with a missing or wrong token, and counts a wrong token.
  [[nodiscard]] Response refuse_token(const Request& request) const;
  [[nodiscard]] bool has_tokens() const { return !token_file_.empty(); }
  /// Returns the number of requests with a wrong token since the server started.
  [[nodiscard]] std::uint64_t wrong_tokens() const;

 private:
  struct Guesses {
    Time since{};
    unsigned count = 0;
  };
  [[nodiscard]] bool may_try_again(const std::string& peer) const;
  [[nodiscard]] bool names_this_server(std::string_view host) const;
  [[nodiscard]] bool is_from_own_page(const Request& request) const;
  [[nodiscard]] bool needs_token(const Request& request, Right right) const;

  std::string token_file_;
  std::string public_origin_;  // origin of `public_url`, for example "https://encoders.example:8443"; "": no proxy
  bool on_loopback_;
  ServerEvents* server_events_;
  mutable std::mutex mutex_;  // mutex that guards all members below
  std::vector<Secret> tokens_;
  mutable std::map<std::string, Guesses> guesses_;  // counts of wrong tokens, by the IP address of the client
  mutable std::uint64_t wrong_tokens_ = 0;
};

/// Returns a response whose JSON body is {"error":"..."}.
[[nodiscard]] Response error_response(unsigned status, std::string_view sentence);

}  // namespace absenc::serve
