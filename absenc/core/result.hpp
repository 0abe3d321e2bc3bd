// SPDX-License-Identifier: Apache-2.0
// Errors between a host and an encoder, and a value-or-error type.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>
#include <utility>

namespace absenc {

/// Errors, grouped by their source.
enum class Error : std::uint8_t {
  none,
  // errors caused by the caller
  invalid_argument,
  unsupported,
  buffer_too_small,
  // errors caused by the line
  timeout,
  line_stuck,
  bad_framing,
  truncated,
  // errors caused by the content of a frame
  wrong_length,
  unexpected_reply,
  bad_checksum,
  out_of_range,
  sequence_mismatch,
  cross_check_failed,
  // errors because the encoder refused the request
  busy,
  request_rejected,
  // errors caused by the shaft
  not_still,
};

/// Name, description and advice for one kind of error.
struct ErrorText {
  std::string_view name;         ///< name of the error, as printed by the command and written in test vectors
  std::string_view description;  ///< sentence that states what usually happened when this error is reported
  std::string_view advice;       ///< advice what the user can try; "" if none
};

/// Names, descriptions and advice for all errors, indexed by Error.
inline constexpr std::array<ErrorText, 17> error_texts{{
    {"none", "no error", ""},
    {"invalid_argument", "this cannot be done as it was asked", "check the value against its range"},
    {"unsupported", "this encoder or model does not have that", "`absenc list` shows what each one supports"},
    {"buffer_too_small", "the caller's buffer is too small", "pass a larger one"},
    {"timeout", "the encoder did not answer", "check supply, A/B polarity, baud rate and that the encoder has started"},
    {"line_stuck", "the data line never changed its level", "check the wiring and the encoder's supply"},
    {"bad_framing", "what came is not a frame of this protocol", "check line settings and wiring"},
    {"truncated", "the frame does not fit into what was sampled", "lower the clock rate"},
    {"wrong_length", "the frame has the wrong length", "check the echo setting and that only one encoder answers"},
    {"unexpected_reply", "the reply does not belong to the request", "check protocol, model and address"},
    {"bad_checksum", "the checksum is wrong", "check shielding, termination and baud rate"},
    {"out_of_range", "bits that must be zero are set", "check the resolution or the model"},
    {"sequence_mismatch", "the sequence counter did not move as it should",
     "do not use the reply; if it stays, find what on the way repeats or delays replies"},
    {"cross_check_failed", "parts of the frame contradict each other",
     "do not use the reply; if it stays, check shielding and termination"},
    {"busy", "the encoder stayed busy", "wait and try again"},
    {"request_rejected", "the encoder refused the request",
     "check that this encoder allows the request, and does in its present state"},
    {"not_still", "the shaft is turning, and this needs it standing still", "stop the shaft, then try again"},
}};

/// Returns whether `error` means that the received bytes are damaged.
[[nodiscard]] constexpr bool is_damage(Error error) {
  return (error >= Error::line_stuck && error <= Error::wrong_length) || error == Error::bad_checksum;
}

/// Returns name, description and advice for `error`.
[[nodiscard]] constexpr const ErrorText& text_of(Error error) { return error_texts[static_cast<std::size_t>(error)]; }

/// A value (initially T{}) or an Error. The value of a failed result must not be read.
template <class T>
class [[nodiscard]] Result {
 public:
  constexpr Result() = default;
  /// Makes a result that holds `value`.
  constexpr Result(const T& value) : value_(value) {}
  /// Makes a result that holds `value`.
  constexpr Result(T&& value) : value_(std::move(value)) {}
  /// Makes a failed result that holds `error`, which is not `Error::none`.
  constexpr Result(Error error) : error_(error) {}
  /// Makes a result in which the value that `make` returns is constructed, without a move.
  template <class Make>
  requires std::is_same_v<std::invoke_result_t<Make>, T>
  [[gnu::always_inline]] constexpr explicit Result(Make make) : value_(make()) {}

  /// Returns whether the result holds a value, and no error.
  [[nodiscard]] constexpr bool has_value() const { return error_ == Error::none; }
  /// Returns whether the result holds a value, and no error.
  constexpr explicit operator bool() const { return has_value(); }
  /// Returns the value of a result that holds one.
  constexpr const T& operator*() const { return value_; }
  /// Returns the value of a result that holds one.
  constexpr T& operator*() { return value_; }
  /// Returns a pointer to the value of a result that holds one.
  constexpr const T* operator->() const { return &value_; }
  /// Returns a pointer to the value of a result that holds one.
  constexpr T* operator->() { return &value_; }
  /// Returns the value of a result that holds one.
  [[nodiscard]] constexpr const T& value() const { return value_; }
  /// Returns the error; `Error::none` if the result holds a value.
  [[nodiscard]] constexpr Error error() const { return error_; }
  /// Returns the value, or `other` if the result holds an error.
  [[nodiscard]] constexpr T value_or(T other) const { return has_value() ? value_ : other; }

 private:
  T value_{};
  Error error_ = Error::none;
};

}  // namespace absenc
