// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "absenc/client/text/unit_text.hpp"

namespace absenc::client {

namespace {

bool is_good(const Unit& unit, const Options& options, const Frame& request, const Frame& reply) {
  return unit.check(options, request, reply) == Error::none;
}

std::string bytes_text(std::size_t count) { return fmt::format("{} byte{}", count, count == 1 ? "" : "s"); }

Diagnosis surrounded(const Unit& unit, const Options& options, const Frame& request, Bytes reply) {
  const Bytes sent = request.bytes;
  const bool echoed =
      !sent.empty() && reply.size() >= sent.size() && std::equal(sent.begin(), sent.end(), reply.begin());
  if (echoed && reply.size() == sent.size()) {
    return {"only the request itself came back (the adapter's echo), and nothing from the encoder",
            std::string(text_of(Error::timeout).advice)};
  }
  if (echoed && is_good(unit, options, request, {.bytes = reply.subspan(sent.size())})) {
    return {"it is a good reply after the adapter's echo of the request", "set echo=on or echo=auto"};
  }
  for (std::size_t size = reply.size() - 1; size > 0; --size) {
    if (!is_good(unit, options, request, {.bytes = reply.first(size)})) continue;
    return {fmt::format("the first {} are a good reply, but {} more came behind it", bytes_text(size),
                        bytes_text(reply.size() - size)),
            {}};
  }
  for (std::size_t before = 1; before < reply.size(); ++before) {
    if (!is_good(unit, options, request, {.bytes = reply.subspan(before)})) continue;
    return {fmt::format("the last {} are a good reply, but {} came before it", bytes_text(reply.size() - before),
                        bytes_text(before)),
            {}};
  }
  return {};
}

Diagnosis other_settings(const Unit& unit, const Options& options, const Frame& request, const Frame& reply) {
  for (const Model& model : unit.models) {
    Options other;
    if (&model == options.model || resolve_options(unit, model.name, {}, other).kind != OptionError::Kind::none)
      continue;
    if (!is_good(unit, other, request, reply)) continue;
    const std::string setting = fmt::format("model={}", model.name);
    return {fmt::format("it is a good reply of the model {}", model.name), fmt::format("set {}", setting), setting};
  }
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const Option& option = unit.options[i];
    for (std::size_t value = 0; value < option.choices.size(); ++value) {
      Options other = options;
      other.values[i] = static_cast<std::int64_t>(value);
      if (other.values[i] == options[i] || !is_good(unit, other, request, reply)) continue;
      const std::string setting = fmt::format("{}={}", option.name, option.choices[value]);
      return {fmt::format("it is a good reply with {}", setting), {}, setting};
    }
  }
  return {};
}

std::string meaning(LinkKind link, Subject subject, Error error) {
  const std::string_view frame = carries_bits(link) || link == LinkKind::can ? "frame"
                                 : subject == Subject::request               ? "request"
                                                                             : "reply";
  switch (error) {
    case Error::wrong_length:
      return fmt::format("the {} has the wrong number of {}", frame,
                         carries_bits(link)      ? "bits"
                         : link == LinkKind::can ? "data bytes"
                                                 : "bytes");
    case Error::bad_checksum:
      return fmt::format("the checksum of the {} is wrong", frame);
    case Error::cross_check_failed:
      return fmt::format("parts of the {} contradict each other", frame);
    case Error::out_of_range:
      if (carries_bits(link)) return "the word is outside its range";
      break;
    case Error::unexpected_reply:
      if (subject == Subject::request) return "this encoder knows no such request";
      break;
    default:
      break;
  }
  return std::string(text_of(error).description);
}

}  // namespace

Diagnosis diagnose(const Unit& unit, const Options& options, const Frame& request, const Frame& reply) {
  // A good reply needs no explanation: a procedure of several requests can fail although its last reply is good.
  if (reply.empty() || is_good(unit, options, request, reply)) return {};
  if (!reply.bytes.empty() && reply.bits == 0) {
    Diagnosis found = surrounded(unit, options, request, reply.bytes);
    if (!found.finding.empty()) return found;
  }
  return other_settings(unit, options, request, reply);
}

Subject subject_of(const Unit& unit, const Options& options, const Frame& request, const Frame& reply) {
  const bool bad_request = !request.empty() && !is_good(unit, options, request, {});
  return reply.empty() || bad_request ? Subject::request : Subject::reply;
}

std::string describe(LinkKind link, Subject subject, Error error, std::string_view detail, const Diagnosis& diagnosis) {
  std::string text = meaning(link, subject, error);
  if (!detail.empty()) text += fmt::format(": {}", detail);
  const bool said = !diagnosis.setting.empty() && detail.find(diagnosis.setting) != std::string_view::npos;
  if (!diagnosis.finding.empty() && !said) text += fmt::format("; {}", diagnosis.finding);
  return text;
}

std::string sentence_for(const Unit& unit, const Options& options, Error error, const Frame& request,
                         const Frame& reply) {
  const Diagnosis diagnosis = diagnose(unit, options, request, reply);
  const Explanation explanation =
      unit.explain != nullptr ? unit.explain(options, error, request, reply) : Explanation{};
  const Subject subject = subject_of(unit, options, request, reply);
  const std::string message = describe(unit.link, subject, error, explanation.detail, diagnosis);
  const std::string_view advice = diagnosis.advice.empty() ? explanation.advice : diagnosis.advice;
  return advice.empty() ? message : fmt::format("{}: {}", message, advice);
}

}  // namespace absenc::client
