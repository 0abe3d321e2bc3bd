// SPDX-License-Identifier: Apache-2.0
// Explains a bad exchange in words and suggests the setting that would make it good.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// The explanation of a bad reply; all texts are empty if none fits.
struct Diagnosis {
  std::string finding;    // what the reply really is
  std::string advice;     // what to try
  std::string setting{};  // "NAME=VALUE", the setting with which the reply would be good
};

/// Explains a failed reply: an echo, a good reply with other bytes around it, or a good one of another model or option.
[[nodiscard]] Diagnosis diagnose(const Unit& unit, const Options& options, const Frame& request, const Frame& reply);

/// The frame that an error is about.
enum class Subject : std::uint8_t { request, reply };

/// Returns the frame of an error of `decode`: the reply, or a bad request.
[[nodiscard]] Subject subject_of(const Unit& unit, const Options& options, const Frame& request, const Frame& reply);

/// Returns "<meaning of the error for this frame and line>: <detail>; <finding>", without empty parts, and without the
/// finding if the detail already names its setting.
[[nodiscard]] std::string describe(LinkKind link, Subject subject, Error error, std::string_view detail = {},
                                   const Diagnosis& diagnosis = {});

/// Explains a reply that failed with this error (or a missing reply) in one sentence, with the document's explanation
/// and what to try.
[[nodiscard]] std::string sentence_for(const Unit& unit, const Options& options, Error error, const Frame& request,
                                       const Frame& reply);

}  // namespace absenc::client
