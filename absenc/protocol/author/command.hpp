// SPDX-License-Identifier: Apache-2.0
// Declares a command by its request and the conversation that executes it. Its storage and its report follow from them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string_view>
#include <type_traits>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/make.hpp"
#include "absenc/protocol/sentence.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::author {

/// A conversation that has already ended with an error.
template <class Item>
class Refusal final : public Conversation<Item> {
 public:
  /// Ends at once with this error and its reason.
  explicit Refusal(Error error, std::string_view why) : error_(error), why_(why) {}
  /// Takes an event of the port.
  void feed(const Event<Item>&) override {}
  /// Returns the next step of the port.
  Step<Item> next(Time) override { return {.kind = Step<Item>::Kind::done}; }
  [[nodiscard]] Error error() const override { return error_; }
  [[nodiscard]] std::string_view detail() const override { return why_; }
  void report(FieldSink&) const override {}
  /// Returns the items of the last exchange.
  [[nodiscard]] Exchange<Item> exchange() const override { return {}; }

 private:
  Error error_;
  std::string_view why_;
};

namespace detail {
template <class P>
struct ItemOf {
  using Item = std::uint8_t;
};
template <class P>
requires requires { typename P::Item; }
struct ItemOf<P> {
  using Item = typename P::Item;
};
}  // namespace detail

/// The item that the lines of a protocol carry: `P::Item`, or characters without one.
template <class P>
using ItemOf = typename detail::ItemOf<P>::Item;

/// The fields of a unit's requests and replies, and its texts for people, which firmware does not link. All
/// conversations of the unit derive from `Host`.
template <class P, class Host = Conversation<ItemOf<P>>>
struct Report {
  /// The protocol.
  using Protocol = P;
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// A request of the protocol.
  using Request = typename P::Request;
  /// A reply of the protocol.
  using Reply = typename P::Reply;
  /// Items of the line.
  using Items = std::span<const ItemOf<P>>;

  /// Puts the fields of a request. `put_values<fields, values>` makes such a function.
  void (*put_request)(FieldSink&, const Format&, const Request&) = nullptr;
  /// Puts the fields of a valid reply to the request.
  void (*put_reply)(FieldSink&, const Format&, const Request&, const Reply&) = nullptr;
  /// Explains an invalid or missing reply by the document. Not called if a procedure has an advice of its own.
  Explanation (*explain)(const Format&, Error, Items request, Items reply) = nullptr;
  /// Used instead of `explain` for conversations, if only they know the reason.
  Explanation (*explain_host)(const Host&) = nullptr;
  /// Used instead of `explain` for conversations, to put an explanation together. The last exchange of `host` failed.
  void (*tell)(Sentence&, const Host& host) = nullptr;
  /// Advice about a line that is never silent.
  std::string_view noise_advice = endless_noise.advice;
};

/// The fields of the result of a procedure, `Found`. `Subject` is the format, or a class that the conversation derives
/// from if the format alone is not enough.
template <class Subject, class T>
struct Finding {
  /// The format, or the class that the conversation derives from.
  using Of = Subject;
  /// Type of the result.
  using Found = T;

  /// Puts the values of a finding into fields.
  void (*put)(FieldSink&, const Subject&, const T&) = nullptr;
  /// Puts the fields of the changes that an interrupted procedure leaves behind.
  void (*put_left)(FieldSink&, const Subject&, const T&) = nullptr;
  /// Returns the same changes in words.
  std::string_view (*left)(const T&) = nullptr;
};

/// Puts the fields of the values that `values(format, ...)` returns.
template <const auto& fields, auto values, class... What>
constexpr void put_values(FieldSink& sink, const What&... what) {
  fields.put(sink, values(what...));
}

/// A conversation of a unit, which reports fields and texts of `unit_report`. A procedure has a `finding`; without one
/// the last reply is reported.
template <const auto& unit_report, class Base, const auto&... finding>
class Reported final : public Base {
 public:
  using Base::Base;
  static_assert(sizeof...(finding) == 1 || unit_report.put_reply != nullptr, "a report needs put_reply");
  static_assert(((finding.put != nullptr) && ...), "a finding needs put");

  /// Puts the fields that were found.
  void report(FieldSink& sink) const override {
    if (this->error() != Error::none) return;
    if constexpr (sizeof...(finding) == 0) {
      unit_report.put_reply(sink, this->format(), this->request(), this->last());
    } else {
      (finding.put(sink, subject<finding>(), this->found()), ...);
    }
    if (const Reading* reading = this->reading()) sink.put_reading(*reading);
  }
  /// Puts the fields that are found when a command ends early.
  void report_left(FieldSink& sink) const override { (put_left<finding>(sink), ...); }
  /// Returns a sentence about the result; empty: none.
  [[nodiscard]] std::string_view detail() const override {
    words_.clear();
    const std::string_view own = Base::detail();
    if (this->error() != Error::none && this->is_noisy()) {
      if (own != endless_noise.detail) words_.add(endless_noise.detail);
    } else if constexpr (unit_report.tell != nullptr) {
      if (this->error() != Error::none) unit_report.tell(words_, *this);
    } else {
      words_.add(explained().detail);
    }
    words_.add_part(own);
    (words_.add_part(left<finding>()), ...);
    return words_.view();
  }
  /// Returns what the user can try, "" for nothing.
  [[nodiscard]] std::string_view advice() const override {
    const std::string_view own = Base::advice();
    if (!own.empty()) return own;
    return this->is_noisy() ? unit_report.noise_advice : explained().advice;
  }

 private:
  [[nodiscard]] Explanation explained() const {
    const bool open = this->error() != Error::none && !this->is_alone() && Base::advice().empty();
    if constexpr (unit_report.explain_host != nullptr) {
      if (open) return unit_report.explain_host(*this);
    } else if constexpr (unit_report.explain != nullptr) {
      const auto exchange = this->exchange();
      if (open) return unit_report.explain(this->format(), this->error(), exchange.sent, exchange.received);
    }
    return {};
  }
  template <const auto& one>
  [[nodiscard]] const auto& subject() const {
    using Of = typename std::remove_cvref_t<decltype(one)>::Of;
    if constexpr (std::is_base_of_v<Of, Base>) {
      return static_cast<const Of&>(*this);
    } else {
      return this->format();
    }
  }
  template <const auto& one>
  void put_left(FieldSink& sink) const {
    if constexpr (one.put_left != nullptr) one.put_left(sink, subject<one>(), this->found());
  }
  template <const auto& one>
  [[nodiscard]] std::string_view left() const {
    if constexpr (one.left != nullptr) {
      if (this->error() != Error::none) return one.left(this->found());
    }
    return {};
  }

  mutable Sentence words_;
};

/// Returns whether the request is a pulse on a wire of its own.
template <class P>
constexpr bool asks_by_pulse(const typename P::Format& format, const typename P::Request& request) {
  return P::manner(format, request).pulse != Time{};
}

/// Request of a protocol whose host sends nothing but clocks.
struct NoRequest {};

/// A command with the request or procedure that executes it.
template <class P>
struct CommandOf {
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// A request of the protocol.
  using Request = typename P::Request;

  Command info;  ///< Description of the command.
  /// Returns the request that does the work of the command; procedures send more. It returns an error, or a request
  /// that P::encode refuses, if the arguments allow none. Null: the requests are not known beforehand.
  Result<Request> (*request)(const Format&, Arguments);
  /// Makes its conversation in storage of `size` bytes.
  Any<Conversation> (*make)(const Format&, Arguments, std::span<std::byte>);
  std::size_t size;  ///< bytes of storage, without the frames of coroutines
  /// Returns why an encoder of this format lacks the command, "" if it has it. Null: every encoder has it.
  std::string_view (*missing)(const Format&) = nullptr;
  /// Used instead of `make` for formats for which `is_other` is true. Null: for none.
  Any<Conversation> (*make_other)(const Format&, Arguments, std::span<std::byte>) = nullptr;
  /// Returns whether `make_other` makes the conversation for this format; null: never.
  bool (*is_other)(const Format&) = nullptr;
  /// Returns whether the options of this format are consistent; no conversation is made otherwise. Null: always.
  bool (*possible)(const Format&) = nullptr;

  /// Returns this command, refused for formats of which `why` returns a reason.
  [[nodiscard]] constexpr CommandOf unless(std::string_view (*why)(const Format&)) const {
    CommandOf one = *this;
    one.missing = why;
    return one;
  }
  /// Returns this command, made only for formats of which `is_possible` is true.
  [[nodiscard]] constexpr CommandOf only_if(bool (*is_possible)(const Format&)) const {
    CommandOf one = *this;
    one.possible = is_possible;
    return one;
  }
  /// Lets `other` execute the command for formats for which `is` is true.
  [[nodiscard]] constexpr CommandOf or_when(bool (*is)(const Format&), const CommandOf& other) const {
    CommandOf one = *this;
    one.is_other = is;
    one.make_other = other.make;
    one.size = std::max(size, other.size);
    return one;
  }
  /// Returns whether these arguments make a request, or the conversation explains why not.
  [[nodiscard]] bool can_ask(const Format& format, Arguments arguments) const {
    if constexpr (std::is_same_v<Request, NoRequest>) {
      return true;
    } else {
      if (request == nullptr) return true;
      const Result<Request> asked = request(format, arguments);
      return !asked || !P::encode(format, *asked).empty() || asks_by_pulse<P>(format, *asked);
    }
  }
  /// Makes its conversation in `storage`: one that refuses where the encoder does not have the command, none where
  /// options or arguments contradict it.
  [[nodiscard]] Any<Conversation> run(const Format& format, Arguments arguments, std::span<std::byte> storage) const {
    const std::string_view why = missing != nullptr ? missing(format) : std::string_view{};
    if (!why.empty()) return make_host<Refusal<ItemOf<P>>>(storage, Error::unsupported, why);
    if (possible != nullptr && !possible(format)) return {};
    if (!can_ask(format, arguments)) return {};
    const bool other = is_other != nullptr && is_other(format);
    return (other ? make_other : make)(format, arguments, storage);
  }
};

namespace detail {
// Makes a request from the format, for commands without arguments.
template <auto request, class Format>
constexpr auto request_of(const Format& format) {
  if constexpr (std::is_invocable_v<decltype(request), const Format&>) {
    return request(format);
  } else {
    return request(format, Arguments{});
  }
}

template <class Machine>
constexpr std::size_t aligned_size = (sizeof(Machine) + alignof(std::max_align_t) - 1) / alignof(std::max_align_t) *
                                     alignof(std::max_align_t);

template <class Machine>
Any<Conversation> make_run(const typename Machine::Format& format, Arguments arguments, std::span<std::byte> storage) {
  constexpr std::size_t size = aligned_size<Machine>;
  if (storage.size() < size) return {};
  auto* const made = new (storage.data()) Machine(format, arguments, storage.subspan(size));
  return made->error() == Error::buffer_too_small ? Any<Conversation>{} : absenc::detail::any_of<Conversation>(made);
}
}  // namespace detail

/// The protocol of a report.
template <const auto& unit_report>
using ReportedProtocol = typename std::remove_cvref_t<decltype(unit_report)>::Protocol;

/// Declares a command that reads a position, or another value, with one request, which `request` makes from the format.
/// Reader reads it.
template <const auto& unit_report, auto request, class Reader = ReadPosition<ReportedProtocol<unit_report>>>
[[nodiscard]] constexpr CommandOf<ReportedProtocol<unit_report>> reading(const Command& info) {
  using P = ReportedProtocol<unit_report>;
  using Made = Reported<unit_report, Reader>;
  return {.info = info,
          .request = [](const typename P::Format& format, Arguments) -> Result<typename P::Request> {
            return detail::request_of<request>(format);
          },
          .make =
              [](const typename P::Format& format, Arguments, std::span<std::byte> storage) {
                return make_host<Made>(storage, format, detail::request_of<request>(format));
              },
          .size = sizeof(Made)};
}

/// Declares a command that a procedure executes. `request(format, arguments)` returns a Request or a Result; see
/// CommandOf.
template <const auto& unit_report, const auto& finding, auto procedure, auto request, auto... bound>
[[nodiscard]] constexpr CommandOf<ReportedProtocol<unit_report>> command(const Command& info) {
  using P = ReportedProtocol<unit_report>;
  using Found = typename std::remove_cvref_t<decltype(finding)>::Found;
  using Made = Reported<unit_report, Run<P, Found, procedure, bound...>, finding>;
  return {.info = info,
          .request = [](const typename P::Format& format, Arguments arguments) -> Result<typename P::Request> {
            return request(format, arguments);
          },
          .make = detail::make_run<Made>,
          .size = detail::aligned_size<Made>};
}

}  // namespace absenc::author
