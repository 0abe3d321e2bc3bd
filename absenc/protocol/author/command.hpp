// SPDX-License-Identifier: Apache-2.0
// A command is declared with its request and with the conversation that carries it out: how much storage that needs
// and what it reports follow.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string_view>

#include "absenc/protocol/author/line.hpp"
#include "absenc/protocol/make.hpp"
#include "absenc/protocol/sentence.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::author {

/// A conversation that is over before it began: this encoder does not have the command.
template <class Item>
class Refusal final : public Conversation<Item> {
 public:
  explicit Refusal(std::string_view why) : why_(why) {}
  void feed(const Event<Item>&) override {}
  Step<Item> next(Time) override { return {.kind = Step<Item>::Kind::done}; }
  [[nodiscard]] Error error() const override { return Error::unsupported; }
  [[nodiscard]] std::string_view detail() const override { return why_; }
  void report(FieldSink&) const override {}
  [[nodiscard]] Exchange<Item> exchange() const override { return {}; }

 private:
  std::string_view why_;
};

/// What a unit hands out: the conversation, and the words for people that firmware does not link. `Definition` says
/// what is reported: `put(sink, format, found)` of a procedure, `put(sink, format, request, reply)` of a reading; and
/// what the document says of a bad reply: `explain(format, error, request, reply)`, where it says something. Of a
/// procedure that leaves the encoder changed when it fails or is broken off, `left(found)` is what to add to the
/// error's words, and `put_left(sink, found)` puts it.
template <class Definition, class Base>
class Told final : public Base {
 public:
  using Base::Base;

  void report(FieldSink& sink) const override {
    if (this->error() != Error::none) return;
    if constexpr (requires { this->found(); }) {
      Definition::put(sink, this->format(), this->found());
    } else {
      Definition::put(sink, this->format(), this->request(), this->last());
    }
  }
  [[nodiscard]] std::string_view detail() const override {
    words_.clear();
    words_.add(explained().found).add_part(Base::detail()).add_part(left());
    return words_.view();
  }
  [[nodiscard]] std::string_view advice() const override {
    const std::string_view own = Base::advice();
    return own.empty() ? explained().advice : own;
  }
  void report_left(FieldSink& sink) const override {
    if constexpr (requires { Definition::put_left(sink, this->found()); }) Definition::put_left(sink, this->found());
  }

 private:
  [[nodiscard]] Explanation explained() const {
    if constexpr (requires { Definition::explain(this->format(), Error::none, Bytes{}, Bytes{}); }) {
      if (this->error() == Error::none || this->is_noisy()) return {};
      return Definition::explain(this->format(), this->error(), this->exchange().sent, this->exchange().received);
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

template <class P>
struct CommandOf {
  using Format = typename P::Format;
  using Request = typename P::Request;

  Command info;
  /// The one request that does its work; procedures send more.
  Request (*request)(const Format&, Arguments);
  Any<Conversation> (*make)(const Format&, Arguments, std::span<std::byte>);
  std::size_t size;  // bytes of storage, without those of frames
  /// Why an encoder of this format does not have it; empty: it has. Null: every one has.
  std::string_view (*missing)(const Format&) = nullptr;
  /// Of formats of which `is_other` is true, in place of `make`. Null: of none.
  Any<Conversation> (*make_other)(const Format&, Arguments, std::span<std::byte>) = nullptr;
  bool (*is_other)(const Format&) = nullptr;

  [[nodiscard]] constexpr CommandOf unless(std::string_view (*why)(const Format&)) const {
    CommandOf one = *this;
    one.missing = why;
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
  [[nodiscard]] Any<Conversation> run(const Format& format, Arguments arguments, std::span<std::byte> storage) const {
    const std::string_view why = missing != nullptr ? missing(format) : std::string_view{};
    if (!why.empty()) return make_host<Refusal<std::uint8_t>>(storage, why);
    const bool other = is_other != nullptr && is_other(format);
    return (other ? make_other : make)(format, arguments, storage);
  }
};

namespace detail {
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

/// A position, or another value, that one request asks for: `request` makes it of the format. `Reader` is made of both.
template <class Definition, class P, auto request, class Reader = ReadPosition<P>>
[[nodiscard]] constexpr CommandOf<P> reading(const Command& info) {
  using Made = Told<Definition, Reader>;
  return {.info = info,
          .request = [](const typename P::Format& format, Arguments) { return request(format); },
          .make = [](const typename P::Format& format, Arguments,
                     std::span<std::byte> storage) { return make_host<Made>(storage, format, request(format)); },
          .size = sizeof(Made)};
}

/// What a procedure does. `request(format, arguments)`: see CommandOf.
template <class Definition, class P, class Found, auto procedure, auto request, auto... bound>
[[nodiscard]] constexpr CommandOf<P> command(const Command& info) {
  using Made = Told<Definition, Run<P, Found, procedure, bound...>>;
  return {.info = info, .request = request, .make = detail::make_run<Made>, .size = detail::aligned_size<Made>};
}

}  // namespace absenc::author
