// SPDX-License-Identifier: Apache-2.0
// What is wrong with an exchange, in words, and which setting would make it right.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// All are empty when nothing fits.
struct Diagnosis {
  std::string finding;    // what the reply turns out to be
  std::string advice;     // what would make it right
  std::string setting{};  // "NAME=VALUE", where another setting would
};

/// What a reply that failed turns out to be: an echo, a good reply with something around it, one of another model or
/// with another option.
[[nodiscard]] Diagnosis diagnose(const Unit& unit, const Options& options, const Frame& request, const Frame& reply);

/// Which frame an error is about.
enum class Subject : std::uint8_t { request, reply };

/// Of frames that `decode` refuses: a request without a reply, or one that is bad itself.
[[nodiscard]] Subject subject_of(const Unit& unit, const Options& options, const Frame& request, const Frame& reply);

/// "<what the error means for this frame of this link>: <detail>; <finding>", each part only if there is one,
/// and the finding only where the detail does not name its setting already.
[[nodiscard]] std::string describe(LinkKind link, Subject subject, Error error, std::string_view detail = {},
                                   const Diagnosis& diagnosis = {});

/// Of a reply that failed with this error, or with an empty reply of the request, in one sentence: the same with what
/// the document says of it, and what to try.
[[nodiscard]] std::string sentence_for(const Unit& unit, const Options& options, Error error, const Frame& request,
                                       const Frame& reply);

}  // namespace absenc::client
