// SPDX-License-Identifier: Apache-2.0
// Parts of EnDat procedures: words of the memory, additional information, resolution, position. Each part ends the
// procedure with an error if it fails. `step` states for that error what could not be done.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/endat/procedures.hpp"

namespace absenc::endat {

/// Returns the number whose lower and upper half are in two words.
[[nodiscard]] constexpr std::uint32_t double_word(std::uint16_t low, std::uint16_t high) {
  return std::uint32_t{high} << 16 | low;
}

/// Selects an area by a command of EnDat 2.1, unless `selected` has its MRS code: that of the last area which this
/// procedure selected, 0 for none. Errors: unsupported (the encoder does not have the area), or that of an exchange.
author::Part<bool> select(Dialog& dialog, std::uint8_t& selected, std::uint8_t mrs, std::string_view step);
/// Reads a word by commands of EnDat 2.1. `selected` and errors as for `select`.
author::Part<std::uint16_t> read_word_21(Dialog& dialog, std::uint8_t& selected, WordPlace word, std::string_view step);
/// Writes a word by commands of EnDat 2.1 and returns it as it is read back. `selected` and errors as for `select`.
author::Part<std::uint16_t> write_word_21(Dialog& dialog, std::uint8_t& selected, WordPlace word, std::uint16_t value,
                                          std::string_view step);

/// Additional information that the encoder sent when a procedure began: MRS codes; 0: none.
struct SelectedInfos {
  std::uint8_t info1 = 0;  ///< MRS code of additional information 1.
  std::uint8_t info2 = 0;  ///< MRS code of additional information 2.

  /// Returns whether two selections are equal.
  friend bool operator==(const SelectedInfos&, const SelectedInfos&) = default;
};

/// Finds out which additional information is selected: a supplement would collide with one that the host does not know
/// of. Errors: cross_check_failed if it changes from position to position, or that of an exchange.
author::Part<SelectedInfos> find_selection(Dialog& dialog);
/// Selects a memory area or, with an MRS code from 40 to 5F, an additional information (EnDat 2.2).
author::Part<bool> select_22(Dialog& dialog, std::uint8_t mrs, std::string_view step);
/// Selects what was selected when the procedure began.
author::Part<bool> restore(Dialog& dialog, SelectedInfos before);
/// Selects and reads additional information 1 with the MRS code `wanted`. Errors: busy, unexpected_reply (the encoder
/// sends none), request_rejected (it sends another one), or that of an exchange.
author::Part<std::uint16_t> read_info_1(Dialog& dialog, std::uint8_t wanted, std::string_view step);
/// Reads a position until the encoder is no longer busy with its memory. Returns additional information 1. Errors:
/// busy, unexpected_reply (the encoder sends no additional information), or that of an exchange.
author::Part<Info> wait_until_ready(Dialog& dialog, std::string_view step);

/// Prepares for accesses to the memory: EnDat 2.2 needs to know what is selected, and the length of a position.
author::Part<SelectedInfos> begin_access(Dialog& dialog);
/// Reads a word by the commands of the format's version, between `begin_access` and `end_access`. `selected` as for
/// `select`. Errors: unsupported, request_rejected, busy, unexpected_reply, or that of an exchange.
author::Part<std::uint16_t> read_word(Dialog& dialog, std::uint8_t& selected, WordPlace word, std::string_view step);
/// Restores the selection from before the accesses.
author::Part<bool> end_access(Dialog& dialog, SelectedInfos before);

/// Asks the encoder for its resolution, if the options do not state it. Errors: unsupported, cross_check_failed, or
/// that of an exchange.
author::Part<bool> know_resolution(Dialog& dialog);
/// Reads the position into `found`.
author::Part<Reading> look(Dialog& dialog, ProcedureResult& found);

}  // namespace absenc::endat
