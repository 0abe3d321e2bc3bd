// SPDX-License-Identifier: Apache-2.0
// Who may what. On loopback everybody of this computer may look; elsewhere, behind a proxy, and to change an encoder,
// it takes a token.
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
  enum class To : std::uint8_t {
    anybody,  // the page itself, and whether the server lives
    look,
    ask,  // of an encoder what costs its time, or keeps it from being read; changes nothing
    change,
  };

  struct Choices {
    std::string token_file{};  // lines of a name and a token; "": there is none, which is for loopback only
    std::string public_url{};  // where a proxy on this computer shows the page to others; "": there is none
    bool on_loopback = false;  // nobody on another computer can reach the server itself
  };
  /// Throws Failure when the file cannot be read, others may read it, or a token is shorter than 16 characters;
  /// UsageError. `server_events` outlives it.
  Access(const Choices& choices, ServerEvents& server_events);

  /// Reads the file again: tokens that are no longer in it end at once. Throws Failure as the constructor; then those
  /// of before count.
  void reload();

  /// Why this is refused; nothing: it is not.
  [[nodiscard]] std::optional<Response> refusal(const Request& request, To what) const;
  /// The address of whoever asks: by the word of a proxy on this computer where there is one.
  [[nodiscard]] std::string client_of(const Request& request) const;
  /// The name of the token that came with it, or "".
  [[nodiscard]] std::string who(const Request& request) const;
  /// What answers a request whose token is missing or wrong; a wrong one is counted.
  [[nodiscard]] Response refuse_token(const Request& request) const;
  [[nodiscard]] bool has_tokens() const { return !token_file_.empty(); }
  /// How many requests came with a wrong token.
  [[nodiscard]] std::uint64_t wrong_tokens() const;

 private:
  struct Guesses {
    Time since{};
    unsigned count = 0;
  };
  [[nodiscard]] bool may_guess_on(const std::string& peer) const;
  [[nodiscard]] bool names_us(std::string_view host) const;
  [[nodiscard]] bool is_from_own_page(const Request& request) const;
  [[nodiscard]] bool needs_token(const Request& request, To what) const;

  std::string token_file_;
  std::string public_origin_;  // "https://encoders.example:8443"; "": there is no proxy
  bool on_loopback_;
  ServerEvents* server_events_;
  mutable std::mutex mutex_;  // guards what follows
  std::vector<Secret> tokens_;
  mutable std::map<std::string, Guesses> guesses_;  // by address
  mutable std::uint64_t wrong_tokens_ = 0;
};

/// {"error":"..."}
[[nodiscard]] Response error_response(unsigned status, std::string_view sentence);

}  // namespace absenc::serve
