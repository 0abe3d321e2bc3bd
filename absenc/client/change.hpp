// SPDX-License-Identifier: Apache-2.0
// A command that changes an encoder ends in one of four states. Programs compare its word, people read its sentence,
// and each exception of such a command carries it.
#pragma once

#include <cstdint>
#include <exception>
#include <string>
#include <string_view>
#include <utility>

#include "absenc/os/error.hpp"

namespace absenc::client {

enum class ChangeState : std::uint8_t {
  none,       // the command changes no encoder
  not_sent,   // the encoder is as it was
  confirmed,  // sent, and as far as the encoder tells it was done
  refused,    // sent, and the encoder said, or showed when it was read back, that it is as it was
  unknown,    // sent, and nothing good came back: it was done or not
};

/// "not_sent", "confirmed", "refused", "unknown"; "" of none
[[nodiscard]] std::string_view word_of(ChangeState state);

/// State of a change of the encoder, with the evidence.
struct Change {
  ChangeState state = ChangeState::none;  ///< How far the change came.
  std::string
      advice{};  ///< unknown: how to see what the encoder is now; confirmed: how it is reached from now on, or ""

  std::string note{};  ///< why the journal does not have it, or ""

  /// "sent, result unknown: ..."; "" of none
  [[nodiscard]] std::string text() const;
};

/// Adds the change to the text of a failure, in a line of its own.
[[nodiscard]] std::string with_change(std::string_view what, const Change& change);

/// A failure that knows what became of a change.
struct Changing {
  /// Adds the state of the change to an exception.
  explicit Changing(Change what_became) : change(std::move(what_became)) {}
  virtual ~Changing() = default;
  Change change;  ///< The change and its state when the exception was thrown.
};

/// A failure of a changing command, caught as `Base` as ever.
template <class Base>
class OfChange final : public Base, public Changing {
 public:
  /// `text`: all of it, as of `with_change`.
  OfChange(const Base& failure, std::string text, Change what_became)
      : Base(failure), Changing(std::move(what_became)), text_(std::move(text)) {}
  /// Takes the text of `failure` and adds that of the change.
  OfChange(const Base& failure, const Change& what_became)
      : OfChange(failure, with_change(failure.what(), what_became), what_became) {}
  /// Returns the text of the failure, followed by that of the change.
  [[nodiscard]] const char* what() const noexcept override { return text_.c_str(); }

 private:
  std::string text_;
};

/// Null: it is no failure of a changing command.
[[nodiscard]] const Change* change_of(const std::exception& failure);

/// Throws the exception that is being handled with `change`, if nothing was said of a change yet. From within a catch.
[[noreturn]] void rethrow_with(const Change& change);

/// `work` comes before anything is sent that changes the encoder: what it throws says so.
template <class Work>
auto before_change(const Work& work) {
  try {
    return work();
  } catch (...) {
    rethrow_with({ChangeState::not_sent});
  }
}

}  // namespace absenc::client
