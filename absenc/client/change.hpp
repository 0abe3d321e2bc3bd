// SPDX-License-Identifier: Apache-2.0
// Reports whether a command changed its encoder.
#pragma once

#include <cstdint>
#include <exception>
#include <string>
#include <string_view>
#include <utility>

#include "absenc/os/error.hpp"

namespace absenc::client {

/// Whether a change of the encoder was made, as far as it is known.
enum class ChangeState : std::uint8_t {
  none,       ///< the command changes no encoder
  not_sent,   ///< no request was sent, so the encoder is unchanged
  confirmed,  ///< the request was sent; the reply and, where there is one, the read-back confirm the change
  refused,    ///< the request was sent, but the encoder refused it or its read-back shows no change
  /// the request was sent, but no good reply or read-back came, or the read-back would be the same without the change
  unknown,
};

/// Returns the state as a word: "not_sent", "confirmed", "refused" or "unknown"; "" for `none`.
[[nodiscard]] std::string_view word_of(ChangeState state);

/// State of a change of the encoder, with advice for the user.
struct Change {
  ChangeState state = ChangeState::none;  ///< Whether the encoder was changed, as far as it is known.
  /// Advice for the user; "": none.
  std::string advice{};
  /// A side effect of the change, the reason for an unknown result, or why the journal has no entry; "": none.
  std::string note{};

  /// Returns state, advice and note as text, "sent, result unknown: ADVICE; NOTE"; "" for `none`.
  [[nodiscard]] std::string text() const;
};

/// Returns the text `what`, followed by a line that says whether the encoder was changed, unless the state of the
/// change is `none`.
[[nodiscard]] std::string with_change(std::string_view what, const Change& change);

/// Base class of exceptions that carry the state of a change.
struct Changing {
  /// Stores `what_became`: the change, and its state at the time when the exception is thrown.
  explicit Changing(Change what_became) : change(std::move(what_became)) {}
  virtual ~Changing() = default;
  Change change;  ///< The change and its state when the exception was thrown.
};

/// An exception of type `Base` that also carries the state of a change.
template <class Base>
class OfChange final : public Base, public Changing {
 public:
  /// Copies `failure`. `text` is the whole text of the exception, as `with_change` returns it.
  OfChange(const Base& failure, std::string text, Change what_became)
      : Base(failure), Changing(std::move(what_became)), text_(std::move(text)) {}
  /// Copies `failure` and adds to its text the sentence that says whether the encoder was changed.
  OfChange(const Base& failure, const Change& what_became)
      : OfChange(failure, with_change(failure.what(), what_became), what_became) {}
  /// Returns the text of the failure, followed by the sentence that says whether the encoder was changed.
  [[nodiscard]] const char* what() const noexcept override { return text_.c_str(); }

 private:
  std::string text_;
};

/// Returns the change that the exception carries; null if there is none or its state is `none`.
[[nodiscard]] const Change* change_of(const std::exception& failure);

/// Rethrows the exception that is being handled, with `change` added if the type of the exception can carry a change
/// and it carries none yet. Call this only in a catch block.
[[noreturn]] void rethrow_with(const Change& change);

/// Returns the result of `work`, which runs before a change is sent and changes no encoder. Exceptions of `work` get
/// the state `not_sent`.
template <class Work>
auto before_change(const Work& work) {
  try {
    return work();
  } catch (...) {
    rethrow_with({ChangeState::not_sent});
  }
}

}  // namespace absenc::client
