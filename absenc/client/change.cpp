// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/change.hpp"

#include <fmt/format.h>

#include <array>

#include "absenc/client/trouble.hpp"

namespace absenc::client {

namespace {

struct StateText {
  std::string_view word;
  std::string_view sentence;
};
constexpr std::array<StateText, 5> words{{
    {"", ""},
    {"not_sent", "not sent: the encoder is as it was"},
    {"confirmed", "sent and confirmed"},
    {"refused", "sent and refused: the encoder did not do it"},
    {"unknown", "sent, result unknown"},
}};

const StateText& words_of(ChangeState state) { return words[static_cast<std::size_t>(state)]; }

}  // namespace

std::string_view word_of(ChangeState state) { return words_of(state).word; }

std::string Change::text() const {
  const std::string_view sentence = words_of(state).sentence;
  std::string text = advice.empty() ? std::string(sentence) : fmt::format("{}: {}", sentence, advice);
  if (!note.empty()) text += fmt::format("; {}", note);
  return text;
}

std::string with_change(std::string_view what, const Change& change) {
  if (change.state == ChangeState::none) return std::string(what);
  return fmt::format("{}\n  Change: {}", what, change.text());
}

const Change* change_of(const std::exception& failure) {
  const Change* change = nullptr;
  if (const auto* of_encoder = dynamic_cast<const EncoderFailure*>(&failure)) change = &of_encoder->trouble.change;
  if (const auto* changing = dynamic_cast<const Changing*>(&failure)) change = &changing->change;
  return change != nullptr && change->state != ChangeState::none ? change : nullptr;
}

void rethrow_with(const Change& change) {
  try {
    throw;
  } catch (const std::exception& failure) {
    if (change.state == ChangeState::none || change_of(failure) != nullptr) throw;
  }
  try {
    throw;
  } catch (const EncoderFailure& failure) {
    Trouble trouble = failure.trouble;
    trouble.change = change;
    throw EncoderFailure(std::move(trouble));
  } catch (const os::Failure& failure) {
    throw OfChange<os::Failure>(failure, change);
  } catch (const Failure& failure) {
    throw OfChange<Failure>(failure, change);
  } catch (const os::Interrupted& interrupted) {
    throw OfChange<os::Interrupted>(interrupted, change);
  } catch (const os::Ended& ended) {
    throw OfChange<os::Ended>(ended, change);
  }
}

}  // namespace absenc::client
