// SPDX-License-Identifier: Apache-2.0
// Declares commands of a unit.
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

/// A conversation that sends nothing, because it has ended with an error from the start.
template <class Item>
class Refusal final : public Conversation<Item> {
 public:
  /// Constructs a conversation that ends at once with `error`; `why` is the detail of the error, a text for people.
  explicit Refusal(Error error, std::string_view why) : error_(error), why_(why) {}
  /// Ignores every event.
  void feed(const Event<Item>&) override {}
  /// Returns the step `done`, which ends the conversation.
  Step<Item> next(Time) override { return {.kind = Step<Item>::Kind::done}; }
  [[nodiscard]] Error error() const override { return error_; }
  [[nodiscard]] std::string_view detail() const override { return why_; }
  void report(FieldSink&) const override {}
  /// Returns an empty exchange: nothing was sent.
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

/// C++ type of the items that the line of the protocol `P` carries: `P::Item`, or a byte if `P` declares none.
template <class P>
using ItemOf = typename detail::ItemOf<P>::Item;

/// Functions that turn requests and replies into fields, and errors into texts. `Host`: base class of the conversations
/// that use the report.
template <class P, class Host = Conversation<ItemOf<P>>>
struct Report {
  /// Class with the functions of the protocol.
  using Protocol = P;
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// C++ type of the protocol's requests.
  using Request = typename P::Request;
  /// C++ type of the protocol's replies.
  using Reply = typename P::Reply;
  /// C++ type of the items that the line carries: bytes or CAN frames.
  using Items = std::span<const ItemOf<P>>;

  /// Puts the fields of a request into the sink. The template `put_values` makes such a function.
  void (*put_request)(FieldSink&, const Format&, const Request&) = nullptr;
  /// Puts the fields of a valid reply to the request into the sink.
  void (*put_reply)(FieldSink&, const Format&, const Request&, const Reply&) = nullptr;
  /// Returns the unit's explanation of an error, made from the last request and reply. Null: the unit explains no
  /// error.
  Explanation (*explain)(const Format&, Error, Items request, Items reply) = nullptr;
  /// Returns the explanation of the error of a conversation, used instead of `explain`. Null: `explain` is used.
  Explanation (*explain_host)(const Host&) = nullptr;
  /// Writes the detail of the error of `host`, used instead of the details that `explain` and `explain_host` return.
  /// Null: their details are used.
  void (*tell)(Sentence&, const Host& host) = nullptr;
  /// Advice for people when an error is reported because the line is never silent.
  std::string_view noise_advice = endless_noise.advice;
};

/// Functions that report the result, of type `T`, of a procedure. `Subject`: the format, or a base class of the
/// conversation.
template <class Subject, class T>
struct Finding {
  /// C++ type of the object that `put` and `put_left` get besides the result: the format, or a base class of the
  /// conversation.
  using Of = Subject;
  /// C++ type of the procedure's result.
  using Found = T;

  /// Puts the fields of the result of a successful procedure into the sink.
  void (*put)(FieldSink&, const Subject&, const T&) = nullptr;
  /// Puts the fields of the changes that an interrupted procedure leaves in the encoder into the sink. Null: it leaves
  /// none.
  void (*put_left)(FieldSink&, const Subject&, const T&) = nullptr;
  /// Returns a sentence about the changes that a failed procedure leaves; "": it leaves none. Null: no procedure leaves
  /// any.
  std::string_view (*left)(const T&) = nullptr;
};

/// Calls `values(what...)`, which returns a struct, and puts the fields of this struct into `sink`.
template <const auto& fields, auto values, class... What>
constexpr void put_values(FieldSink& sink, const What&... what) {
  fields.put(sink, values(what...));
}

/// The conversation `Base`, which also reports fields and texts by the functions of `unit_report`.
template <const auto& unit_report, class Base, const auto&... finding>
class Reported final : public Base {
 public:
  using Base::Base;
  static_assert(sizeof...(finding) == 1 || unit_report.put_reply != nullptr, "a report needs put_reply");
  static_assert(((finding.put != nullptr) && ...), "a finding needs put");

  /// Puts the fields of the command's result into `sink`; nothing after an error.
  void report(FieldSink& sink) const override {
    if (this->error() != Error::none) return;
    if constexpr (sizeof...(finding) == 0) {
      unit_report.put_reply(sink, this->format(), this->request(), this->last());
    } else {
      (finding.put(sink, subject<finding>(), this->found()), ...);
    }
    if (const Reading* reading = this->reading()) sink.put_reading(*reading);
  }
  /// Puts into `sink` the changes that an interrupted procedure leaves in the encoder.
  void report_left(FieldSink& sink) const override { (put_left<finding>(sink), ...); }
  /// Returns a text for people about the result or the error. May be empty.
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
  /// Returns what the user can try after an error; "": the error's general advice stands.
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

/// Returns whether the request is sent as a pulse on a separate wire instead of bytes.
template <class P>
constexpr bool asks_by_pulse(const typename P::Format& format, const typename P::Request& request) {
  return P::manner(format, request).pulse != Time{};
}

/// C++ type of an empty request, for protocols whose host sends nothing but clocks.
struct NoRequest {};

/// Declaration of a command: its description, its request, and the conversation that executes it.
template <class P>
struct CommandOf {
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// C++ type of the protocol's requests.
  using Request = typename P::Request;

  Command info;  ///< Description of the command.
  /// Returns the main request of the command, or an error. Null: the request is not known before the command runs.
  Result<Request> (*request)(const Format&, Arguments);
  /// Constructs the conversation in the storage. Returns an empty Any if the storage is too small.
  Any<Conversation> (*make)(const Format&, Arguments, std::span<std::byte>);
  std::size_t size;  ///< bytes of storage that the conversation needs, without the frames of coroutines
  /// Returns why an encoder of this format lacks the command; "": it has it. Null: all have it.
  std::string_view (*missing)(const Format&) = nullptr;
  /// Constructs the conversation instead of `make` for formats for which `is_other` is true.
  Any<Conversation> (*make_other)(const Format&, Arguments, std::span<std::byte>) = nullptr;
  /// Returns whether `make_other` makes the conversation for this format. Null: `make` always does.
  bool (*is_other)(const Format&) = nullptr;
  /// Returns whether the command is possible with this format. Null: it always is.
  bool (*possible)(const Format&) = nullptr;

  /// Returns a copy of this command that is refused for formats for which `why` returns a reason.
  [[nodiscard]] constexpr CommandOf unless(std::string_view (*why)(const Format&)) const {
    CommandOf one = *this;
    one.missing = why;
    return one;
  }
  /// Returns a copy of this command that is possible only for formats for which `is_possible` returns true.
  [[nodiscard]] constexpr CommandOf only_if(bool (*is_possible)(const Format&)) const {
    CommandOf one = *this;
    one.possible = is_possible;
    return one;
  }
  /// Returns a copy of this command that runs the conversation of `other` for formats for which `is` returns true.
  [[nodiscard]] constexpr CommandOf or_when(bool (*is)(const Format&), const CommandOf& other) const {
    CommandOf one = *this;
    one.is_other = is;
    one.make_other = other.make;
    one.size = std::max(size, other.size);
    return one;
  }
  /// Returns false if the command's request has neither bytes nor a pulse, so that it cannot be sent. Returns true if
  /// the request is not known before the command runs.
  [[nodiscard]] bool can_ask(const Format& format, Arguments arguments) const {
    if constexpr (std::is_same_v<Request, NoRequest>) {
      return true;
    } else {
      if (request == nullptr) return true;
      const Result<Request> asked = request(format, arguments);
      return !asked || !P::encode(format, *asked).empty() || asks_by_pulse<P>(format, *asked);
    }
  }
  /// Constructs the conversation of the command in `storage`. It is a Refusal if the encoder lacks the command. Returns
  /// an empty Any if the command is impossible with this format or these arguments, or if `storage` is too small.
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
// Returns the request of a command without arguments, made from the format.
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

/// The protocol of the Report `unit_report`.
template <const auto& unit_report>
using ReportedProtocol = typename std::remove_cvref_t<decltype(unit_report)>::Protocol;

/// Returns the declaration of a command that takes no arguments: `Reader` sends the request that `request` makes of the
/// format.
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

/// Returns the declaration of a command that a procedure executes. `finding` (a Finding) reports its result.
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
