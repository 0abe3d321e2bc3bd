// SPDX-License-Identifier: Apache-2.0
// A command is declared with its request and with the conversation that carries it out: how much storage that needs
// and what it reports follow.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string_view>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/make.hpp"
#include "absenc/protocol/sentence.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::author {

/// A conversation that is over before it began.
template <class Item>
class Refusal final : public Conversation<Item> {
 public:
  explicit Refusal(Error error, std::string_view why) : error_(error), why_(why) {}
  void feed(const Event<Item>&) override {}
  Step<Item> next(Time) override { return {.kind = Step<Item>::Kind::done}; }
  [[nodiscard]] Error error() const override { return error_; }
  [[nodiscard]] std::string_view detail() const override { return why_; }
  void report(FieldSink&) const override {}
  [[nodiscard]] Exchange<Item> exchange() const override { return {}; }

 private:
  Error error_;
  std::string_view why_;
};

/// Puts the fields of what `values` are made of: a request, a request and its reply, what a procedure found. A
/// Definition has `values(format, ...)`, whose result its `fields` show; or `put(sink, format, ...)`, where one table
/// cannot say it.
template <class Definition, class Format, class... What>
constexpr void put_values(FieldSink& sink, const Format& format, const What&... what) {
  if constexpr (requires { Definition::put(sink, format, what...); }) {
    Definition::put(sink, format, what...);
  } else {
    Definition::fields.put(sink, Definition::values(format, what...));
  }
}

/// What a unit hands out: the conversation, and the words for people that firmware does not link. What the document
/// says of a bad reply is `Definition::explain(format, error, request, reply)`, where it says something and the
/// procedure has not said what to do. `noise_advice`, where a line that is never silent means something. What a
/// procedure that is broken off leaves: `put_left(sink, format, found)`, and `left(found)` in words. Of what only the
/// conversation knows `put(sink, conversation)` and `explain(conversation)`; where words must be put together,
/// `tell(sentence, format, engine)` of the exchange that went wrong.
template <class Definition, class Base>
class Told final : public Base {
 public:
  using Base::Base;

  void report(FieldSink& sink) const override {
    if (this->error() != Error::none) return;
    if constexpr (requires { Definition::put(sink, self()); }) {
      Definition::put(sink, self());
    } else if constexpr (requires { this->found(); }) {
      put_values<Definition>(sink, this->format(), this->found());
    } else {
      put_values<Definition>(sink, this->format(), this->request(), this->last());
    }
    if (const Reading* reading = this->reading()) sink.put_reading(*reading);
  }
  void report_left(FieldSink& sink) const override {
    if constexpr (requires { Definition::put_left(sink, this->format(), this->found()); }) {
      Definition::put_left(sink, this->format(), this->found());
    }
  }
  [[nodiscard]] std::string_view detail() const override {
    words_.clear();
    const std::string_view own = Base::detail();
    if (this->error() != Error::none && this->is_noisy()) {
      if (own != endless_noise.detail) words_.add(endless_noise.detail);
    } else if constexpr (requires { Definition::tell(words_, this->format(), *this); }) {
      if (this->error() != Error::none) Definition::tell(words_, this->format(), *this);
    } else {
      words_.add(explained().detail);
    }
    words_.add_part(own).add_part(left());
    return words_.view();
  }
  [[nodiscard]] std::string_view advice() const override {
    const std::string_view own = Base::advice();
    if (!own.empty()) return own;
    if (!this->is_noisy()) return explained().advice;
    if constexpr (requires { Definition::noise_advice; }) return Definition::noise_advice;
    return endless_noise.advice;
  }

 private:
  [[nodiscard]] const Base& self() const { return *this; }
  [[nodiscard]] Explanation explained() const {
    const auto exchange = this->exchange();
    if constexpr (requires { Definition::explain(self()); }) {
      return this->error() == Error::none || this->is_alone() || !Base::advice().empty() ? Explanation{}
                                                                                         : Definition::explain(self());
    } else if constexpr (requires {
                           Definition::explain(this->format(), Error::none, exchange.sent, exchange.received);
                         }) {
      if (this->error() == Error::none || this->is_alone() || !Base::advice().empty()) return {};
      return Definition::explain(this->format(), this->error(), exchange.sent, exchange.received);
    } else {
      return {};
    }
  }

  [[nodiscard]] std::string_view left() const {
    if constexpr (requires { Definition::left(this->found()); }) {
      if (this->error() != Error::none) return Definition::left(this->found());
    }
    return {};
  }

  mutable Sentence words_;
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

/// What the lines of a protocol carry: characters where it does not say otherwise.
template <class P>
using ItemOf = typename detail::ItemOf<P>::Item;

/// Whether a pulse on a wire of its own is the request.
template <class P>
constexpr bool asks_by_pulse(const typename P::Format& format, const typename P::Request& request) {
  if constexpr (requires { P::manner(format, request).pulse; }) {
    return P::manner(format, request).pulse != Time{};
  } else {
    return false;
  }
}

template <class P>
struct CommandOf {
  using Format = typename P::Format;
  using Request = typename P::Request;

  Command info;
  /// The one request that does its work; procedures send more. Or why there is none with these arguments: an error, or
  /// one that P::encode makes nothing of. Null: what it sends is not known beforehand.
  Result<Request> (*request)(const Format&, Arguments);
  Any<Conversation> (*make)(const Format&, Arguments, std::span<std::byte>);
  std::size_t size;  // bytes of storage, without those of frames
  /// Why an encoder of this format does not have it; empty: it has. Null: every one has.
  std::string_view (*missing)(const Format&) = nullptr;
  /// Of formats of which `is_other` is true, in place of `make`. Null: of none.
  Any<Conversation> (*make_other)(const Format&, Arguments, std::span<std::byte>) = nullptr;
  bool (*is_other)(const Format&) = nullptr;
  /// Of formats of which this is false no conversation is made: the options contradict it. Null: of all one is.
  bool (*possible)(const Format&) = nullptr;

  [[nodiscard]] constexpr CommandOf unless(std::string_view (*why)(const Format&)) const {
    CommandOf one = *this;
    one.missing = why;
    return one;
  }
  [[nodiscard]] constexpr CommandOf only_if(bool (*is_possible)(const Format&)) const {
    CommandOf one = *this;
    one.possible = is_possible;
    return one;
  }
  /// Of these formats `other` carries it out.
  [[nodiscard]] constexpr CommandOf or_when(bool (*is)(const Format&), const CommandOf& other) const {
    CommandOf one = *this;
    one.is_other = is;
    one.make_other = other.make;
    one.size = std::max(size, other.size);
    return one;
  }
  // Whether a request is made of these arguments, or the conversation says why there is none.
  [[nodiscard]] bool can_ask(const Format& format, Arguments arguments) const {
    if constexpr (requires(const Request& asked) { P::encode(format, asked).empty(); }) {
      if (request == nullptr) return true;
      const Result<Request> asked = request(format, arguments);
      return !asked || !P::encode(format, *asked).empty() || asks_by_pulse<P>(format, *asked);
    } else {
      return true;
    }
  }
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
// Made of the format, and of arguments, of which there are none.
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

/// A position, or another value, that one request asks for: `request` makes it of the format, and Reader reads it.
template <class Definition, class P, auto request, class Reader = ReadPosition<P>>
[[nodiscard]] constexpr CommandOf<P> reading(const Command& info) {
  using Made = Told<Definition, Reader>;
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

/// What a procedure does. `request(format, arguments)`: see CommandOf; a Request, or a Result.
template <class Definition, class P, class Found, auto procedure, auto request, auto... bound>
[[nodiscard]] constexpr CommandOf<P> command(const Command& info) {
  using Made = Told<Definition, Run<P, Found, procedure, bound...>>;
  return {.info = info,
          .request = [](const typename P::Format& format, Arguments arguments) -> Result<typename P::Request> {
            return request(format, arguments);
          },
          .make = detail::make_run<Made>,
          .size = detail::aligned_size<Made>};
}

}  // namespace absenc::author
