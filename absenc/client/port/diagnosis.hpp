// SPDX-License-Identifier: Apache-2.0
// Explains a bad exchange in words and suggests the setting that would make it good.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Explanation of a bad reply; all texts are empty if no explanation was found.
struct Diagnosis {
  std::string finding;    // origin or kind of the received bytes, such as an echo of the request
  std::string advice;     // action that the user can try
  std::string setting{};  // model or option "NAME=VALUE" with which the reply would be good; "": none was found
};

/// Explains a bad reply, for example by an echo, further bytes, or another model.
[[nodiscard]] Diagnosis diagnose(const Unit& unit, const Options& options, const Frame& request, const Frame& reply);

/// The frame of an exchange that an error is about.
enum class Subject : std::uint8_t { request, reply };

/// Returns which frame the error of an exchange is about: the reply, or a request that is bad or was not answered.
[[nodiscard]] Subject subject_of(const Unit& unit, const Options& options, const Frame& request, const Frame& reply);

/// Returns an error in words: its meaning, the detail and the finding, as "MEANING: DETAIL; FINDING"; empty parts are
/// left out.
[[nodiscard]] std::string describe(LinkKind link, Subject subject, Error error, std::string_view detail = {},
                                   const Diagnosis& diagnosis = {});

[[nodiscard]] std::string sentence_for(const Unit& unit, const Options& options, Error error, const Frame& request,
                                       const Frame& reply);

}  // namespace absenc::client
