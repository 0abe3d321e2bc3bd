// SPDX-License-Identifier: Apache-2.0
// What is said of errors, for the person in front of the machine.
#pragma once

#include "absenc/protocol/author/engine.hpp"
#include "absenc/protocol/esl/frame.hpp"
#include "absenc/protocol/sentence.hpp"

namespace absenc::esl {

/// What is wrong with the last exchange of a host, and which profile would make its reply good.
void tell(Sentence& words, const Profile& profile, const author::Engine& host);

/// The same of a captured reply.
[[nodiscard]] Explanation explain(const Profile& profile, Error error, Bytes request, Bytes reply);

/// The alarms that an ID C left, and what clears them (Table 8).
void name_what_remains(Sentence& words, std::uint8_t alarms);

}  // namespace absenc::esl
