// SPDX-License-Identifier: Apache-2.0
// Tests of engine, procedures, scan, reports, texts and standstill with a toy protocol.
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "absenc/protocol/author/command.hpp"
#include "absenc/protocol/author/scan.hpp"
#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/author/text.hpp"

namespace absenc::author {
namespace {

using namespace std::chrono_literals;

struct Toy {
  struct Format {
    bool ends_by_silence = false;
    Time silence{};
  };
  using Request = std::uint8_t;
  using Reply = std::uint8_t;
  static constexpr std::size_t longest_reply = 1;
  static HostTimes host_times(const Format& format) {
    return {.answer_limit = 1ms, .gap_limit = 100us, .silence = format.silence};
  }
  static Manner manner(const Format& format, const Request& request) {
    return {.repeats = 2,
            .pause = 2ms,
            .expects_reply = request != 0x7F,
            .ends_by_silence = format.ends_by_silence,
            .hold = 5ms};
  }
  static ByteBuffer<1> encode(const Format&, const Request& request) {
    ByteBuffer<1> bytes;
    bytes.push_back(request);
    return bytes;
  }
  static std::size_t expected(const Format&, const Request& request, Bytes) { return request == 0x7F ? 0 : 1; }
  static Result<Reply> decode(const Format&, const Request& request, Bytes bytes) {
    if (bytes.empty()) return Error::timeout;
    if (bytes.size() != 1) return Error::wrong_length;
    if (bytes[0] == 0xFF) return Error::busy;
    if (bytes[0] != (request | 0x80)) return Error::bad_checksum;
    return bytes[0];
  }
  static bool is_whole(const Format&, Error error) { return error == Error::busy; }
};

using ToyDialog = DialogOf<Toy>;
struct Found {
  unsigned sum = 0;
};
using Wire = std::vector<std::uint8_t>;

constexpr std::uint8_t damaged = 0x55;  // a reply byte of this value reaches the host as a damaged character

/// Runs a conversation in virtual time; `encoder` returns the reply to the n-th request.
struct Bench {
  using Encoder = std::function<Wire(std::uint8_t, unsigned)>;
  explicit Bench(Encoder answers) : encoder(std::move(answers)) {}

  void run(Conversation<std::uint8_t>& host) {
    using Kind = Event<std::uint8_t>::Kind;
    for (int steps = 0; steps < 100'000; ++steps) {
      const Step<std::uint8_t> step = host.next(now);
      switch (step.kind) {
        case Step<std::uint8_t>::Kind::done:
          return;
        case Step<std::uint8_t>::Kind::emit:
          log += "emit ";
          break;
        case Step<std::uint8_t>::Kind::configure:
          log += "rate=" + std::to_string(step.rate) + " ";
          break;
        case Step<std::uint8_t>::Kind::transfer: {
          now = std::max(now, step.at);
          sent.push_back(now);
          const std::uint8_t request = step.out[0];
          host.feed({.kind = Kind::sent, .at = now});
          for (const std::uint8_t byte : encoder(request, static_cast<unsigned>(sent.size()))) {
            now += 10us;
            if (byte == damaged) {
              host.feed({.kind = Kind::line_error, .at = now});
            } else {
              host.feed({.kind = Kind::received, .at = now, .items = {&byte, 1}});
            }
          }
          break;
        }
        default:
          if (step.at != never && step.at > now) {
            now = step.at;
            host.feed({.kind = Kind::timer, .at = now});
          } else {
            now += step.answer;
            host.feed({.kind = Kind::silence, .at = now});
          }
      }
    }
    FAIL() << "it never ends";
  }

  Encoder encoder;
  Time now{};
  std::vector<Time> sent;
  std::string log;
};

Wire echo(std::uint8_t request, unsigned) { return {static_cast<std::uint8_t>(request | 0x80)}; }
Wire nothing(std::uint8_t, unsigned) { return {}; }
Wire endless_noise_of_bytes(std::uint8_t, unsigned) { return Wire(20'000, 0x11); }

template <auto procedure>
struct Case {
  explicit Case(Bench::Encoder encoder, Toy::Format format = {}, Arguments arguments = {}, std::size_t size = 16384)
      : host(format, arguments, std::span(arena).first(size)), bench(std::move(encoder)) {
    bench.run(host);
  }
  alignas(std::max_align_t) std::array<std::byte, 16384> arena;
  Run<Toy, Found, procedure> host;
  Bench bench;
};

Procedure two_questions(ToyDialog& dialog, Found& found) {
  const std::uint8_t first = co_await dialog.ask(1);
  found.sum += first;
  const std::uint8_t second = co_await dialog.ask(2).after(10ms).or_say("the second");
  found.sum += second;
  co_return done;
}

TEST(Procedures, ContinueAfterEachReply) {
  Case<two_questions> good(echo);
  EXPECT_EQ(good.host.error(), Error::none);
  EXPECT_EQ(good.host.found().sum, 0x81u + 0x82u);
  // The pause of 10 ms begins after the last received character.
  EXPECT_EQ(good.bench.sent[1] - good.bench.sent[0], 10ms + 10us);
}

TEST(Procedures, EndWithoutAValidReply) {
  Case<two_questions> bad([](std::uint8_t request, unsigned n) { return request == 2 ? Wire{} : echo(request, n); });
  EXPECT_EQ(bad.host.error(), Error::timeout);
  EXPECT_EQ(bad.host.detail(), "the second");
  ASSERT_EQ(bad.bench.sent.size(), 4u);  // the first request is sent once, and the second three times
  // The pause of 2 ms before the third attempt includes the 1 ms in which the host waited for the missing reply.
  EXPECT_EQ(bad.bench.sent[3] - bad.bench.sent[2], 1ms + 2ms - 1ms);
  // After the last attempt the conversation ends 5 ms later, by Manner::hold of the request.
  EXPECT_EQ(bad.bench.now, bad.bench.sent[3] + 5ms);
}

TEST(Procedures, DamagedCharactersAreNoTimeout) {
  Case<two_questions> bad([](std::uint8_t, unsigned) { return Wire{damaged}; });
  EXPECT_EQ(bad.host.error(), Error::bad_framing);
  EXPECT_EQ(bad.bench.sent.size(), 3u);
  Case<two_questions> beside([](std::uint8_t, unsigned) { return Wire{damaged, 0x81}; });
  EXPECT_EQ(beside.host.error(), Error::wrong_length);
}

TEST(Procedures, RepeatAfterDamageWhenTheLineIsSilent) {
  Case<two_questions> bad([](std::uint8_t request, unsigned n) { return n == 1 ? Wire{3, 4} : echo(request, n); });
  EXPECT_EQ(bad.host.error(), Error::none);
  EXPECT_EQ(bad.bench.sent.size(), 3u);
}

TEST(Procedures, RefusalEndsTheExchangeAtOnce) {
  Case<two_questions> refused([](std::uint8_t, unsigned) { return Wire{0xFF}; });
  EXPECT_EQ(refused.host.error(), Error::busy);
  // After a reply that refuses the request, the engine does not wait for silence.
  EXPECT_EQ(refused.bench.sent[1] - refused.bench.sent[0], 10us + 2ms);
}

TEST(Engine, WeakChecksumNeedsSilence) {
  const auto longer = [](std::uint8_t request, unsigned) { return Wire{static_cast<std::uint8_t>(request | 0x80), 0}; };
  // without `ends_by_silence` the host ignores bytes after a complete reply
  EXPECT_EQ(Case<two_questions>(longer).host.error(), Error::none);
  EXPECT_EQ(Case<two_questions>(longer, {.ends_by_silence = true}).host.error(), Error::wrong_length);
  EXPECT_EQ(Case<two_questions>(echo, {.ends_by_silence = true}).host.error(), Error::none);
}

TEST(Engine, TheLineIsSilentBeforeEachRequest) {
  Case<two_questions> good(echo, {.silence = 20ms});
  EXPECT_EQ(good.bench.sent[0], 20ms);
  // The second request follows the first reply after the longer of the pause (10 ms) and the silence (20 ms).
  EXPECT_EQ(good.bench.sent[1] - good.bench.sent[0], 20ms + 10us);
}

Procedure attempts(ToyDialog& dialog, Found& found) {
  const Result<std::uint8_t> first = co_await dialog.attempt(1).once();
  if (first) co_return {Error::invalid_argument};
  co_await dialog.ask(0x7F);  // the encoder does not answer the request 7F
  dialog.emit();
  dialog.set_rate(9600, Toy::host_times(dialog.format()));
  const std::uint8_t last = co_await dialog.ask(3);
  found.sum = last;
  co_return done;
}

TEST(Procedures, AttemptsMayFail) {
  Case<attempts> good([](std::uint8_t request, unsigned n) { return n < 3 ? Wire{} : echo(request, n); });
  EXPECT_EQ(good.host.error(), Error::none);
  EXPECT_EQ(good.host.found().sum, 0x83u);
  EXPECT_EQ(good.bench.sent.size(), 3u);
  EXPECT_EQ(good.bench.sent[1] - good.bench.sent[0], 1ms);
  EXPECT_EQ(good.bench.sent[2] - good.bench.sent[1], 0ms);
  EXPECT_EQ(good.bench.log, "rate=9600 emit ");
}

Part<unsigned> deeper(ToyDialog& dialog, unsigned depth) {
  if (depth == 0) {
    const std::uint8_t reply = co_await dialog.ask(5);
    co_return reply;
  }
  const unsigned below = co_await deeper(dialog, depth - 1);
  if (below > 1000) co_await dialog.stop({Error::out_of_range, "too deep"});
  co_return below + 100;
}

Procedure many_parts(ToyDialog& dialog, Found& found, Arguments arguments) {
  // The procedure awaits 500 parts one after the other. Its storage could not hold the coroutine frames of all parts at
  // once.
  for (int i = 0; i < 500; ++i) {
    const unsigned sum = co_await deeper(dialog, static_cast<unsigned>(arguments[0]));
    found.sum = sum;
  }
  co_return done;
}

struct FoundReading {
  Reading reading{};
};

Procedure read_turns(ToyDialog& dialog, FoundReading& found, unsigned bits) {
  found.reading.multiturn = co_await dialog.ask(1);
  found.reading.multiturn_bits = bits;
  co_return done;
}

TEST(Procedures, DeliverReadingThatHasOnlyTurns) {
  alignas(std::max_align_t) std::array<std::byte, 4096> arena;
  author::Run<Toy, FoundReading, read_turns, 8u> turns({}, {}, arena);
  Bench(echo).run(turns);
  ASSERT_NE(turns.reading(), nullptr);
  EXPECT_EQ(turns.reading()->multiturn, 0x81u);
  author::Run<Toy, FoundReading, read_turns, 0u> none({}, {}, arena);
  Bench(echo).run(none);
  EXPECT_EQ(none.reading(), nullptr);
}

TEST(Procedures, PartsReleaseTheirStorage) {
  const std::array<std::int64_t, 1> depth{3};
  Case<many_parts> good(echo, {}, depth);
  EXPECT_EQ(good.host.error(), Error::none);
  EXPECT_EQ(good.host.found().sum, 0x85u + 300);
  EXPECT_EQ(good.bench.sent.size(), 500u);
  EXPECT_GT(good.host.frames_size(), 0u);
}

TEST(Procedures, StopFromAnyDepth) {
  const std::array<std::int64_t, 1> depth{12};
  Case<many_parts> stopped(echo, {}, depth);
  EXPECT_EQ(stopped.host.error(), Error::out_of_range);
  EXPECT_EQ(stopped.host.detail(), "too deep");
  EXPECT_EQ(stopped.bench.sent.size(), 1u);
}

TEST(Procedures, ReportStorageThatIsTooSmall) {
  const std::array<std::int64_t, 1> depth{12};
  const std::size_t needed = Case<many_parts>(echo, {}, depth).host.frames_size();
  // The storage is just large enough for all nested parts, so the procedure itself stops with out_of_range.
  EXPECT_EQ(Case<many_parts>(echo, {}, depth, needed).host.error(), Error::out_of_range);
  // With one byte less, there is no room for the coroutine frame of the last part.
  EXPECT_EQ(Case<many_parts>(echo, {}, depth, needed - 1).host.error(), Error::buffer_too_small);
  // 16 bytes are too small for the coroutine frame of the procedure.
  EXPECT_EQ(Case<many_parts>(echo, {}, depth, 16).host.error(), Error::buffer_too_small);
}

Procedure endless(ToyDialog& dialog, Found& found) {
  dialog.restores();
  while (!dialog.is_aborted()) {
    co_await dialog.ask(1);
    if (++found.sum == 10) dialog.abort();
  }
  co_await dialog.rest(1s);
  co_return done;
}

TEST(Procedures, RestoreTheEncoderWhenAborted) {
  Case<endless> aborted(echo);
  EXPECT_EQ(aborted.host.found().sum, 10u);
  EXPECT_GE(aborted.bench.now, 1s);
}

constexpr std::uint8_t request_to(std::size_t index) { return static_cast<std::uint8_t>(index); }

TEST(Scan, RequestsEachAddress) {
  using Host = author::Run<Toy, Nodes<8>, scan<Toy, 8, request_to>>;
  alignas(std::max_align_t) std::array<std::byte, 4096> arena;
  Host host({}, {}, arena);
  Bench bench([](std::uint8_t request, unsigned n) {
    return request == 3 ? Wire{1} : request == 6 ? echo(request, n) : Wire{};
  });
  bench.run(host);
  EXPECT_EQ(host.error(), Error::none);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(host.found().there[i], i == 3 || i == 6);
    EXPECT_EQ(host.found().clash[i], i == 3);
  }
  Host alone({}, {}, arena);
  Bench silent(nothing);
  silent.run(alone);
  EXPECT_EQ(alone.error(), Error::timeout);
}

constexpr std::uint8_t same_request(std::size_t) { return 1; }

// Eight encoders with consecutive addresses are a correct line; noise, and a device that ignores the address, are not.
TEST(Scan, OnlyDamageAndSameRepliesAreNoEncoders) {
  const auto error_with = [](const auto& device) {
    using Host = author::Run<Toy, Nodes<8>, scan<Toy, 8, request_to>>;
    alignas(std::max_align_t) std::array<std::byte, 4096> arena;
    Host host({}, {}, arena);
    Bench bench(device);
    bench.run(host);
    return std::pair(host.error(), std::ranges::count(host.found().there, true));
  };
  EXPECT_EQ(error_with(echo), std::pair(Error::none, std::ptrdiff_t{8}));
  EXPECT_EQ(error_with([](std::uint8_t, unsigned) { return Wire{1}; }).first, Error::wrong_length);
  // By chance, a damaged reply may be followed by a good one.
  EXPECT_EQ(error_with([](std::uint8_t request, unsigned n) { return n % 2 == 0 ? Wire{1} : echo(request, n); }).first,
            Error::wrong_length);
  // An encoder that ignores the address gives the same good reply to each of them.
  using Host = author::Run<Toy, Nodes<8>, scan<Toy, 8, same_request>>;
  alignas(std::max_align_t) std::array<std::byte, 4096> arena;
  Host host({}, {}, arena);
  Bench(echo).run(host);
  EXPECT_EQ(host.error(), Error::wrong_length);
  EXPECT_EQ(host.detail(), "every address gets the same reply: a device that ignores the address");
}

constexpr std::uint8_t request_to_all() { return 9; }

TEST(Scan, AsksNoAddressWhereNobodyAnswersTheOneOfAll) {
  using Host = author::Run<Toy, Nodes<8>, scan<Toy, 8, request_to, request_to_all>>;
  alignas(std::max_align_t) std::array<std::byte, 4096> arena;
  unsigned asked = 0;
  const auto count_all = [&asked](unsigned answered) {
    return [&asked, answered](std::uint8_t request, unsigned n) {
      ++asked;
      return request == 5 || (request == 9 && asked == answered) ? echo(request, n) : Wire{};
    };
  };
  Host nobody({}, {}, arena);
  Bench silent(count_all(0));
  silent.run(nobody);
  EXPECT_EQ(nobody.error(), Error::timeout);
  EXPECT_EQ(asked, 3u);
  asked = 0;
  Host somebody({}, {}, arena);
  Bench third(count_all(3));
  third.run(somebody);
  EXPECT_EQ(somebody.error(), Error::none);
  EXPECT_TRUE(somebody.found().there[5]);
  EXPECT_EQ(asked, 3u + 8u + 1u);
}

constexpr Report<Toy> report{.explain = [](const Toy::Format&, Error, Bytes, Bytes) -> Explanation {
  return {"document", "its advice"};
}};
constexpr Finding<Toy::Format, Found> finding{.put = [](FieldSink&, const Toy::Format&, const Found&) {}};

Procedure end_as_told(ToyDialog& dialog, Found&, Arguments arguments) {
  co_await dialog.ask(1);
  constexpr std::array ways{done, Outcome{Error::busy, "own"}, only(Error::busy, "own"),
                            Outcome{Error::busy, "own", "own advice"}};
  co_return ways[static_cast<std::size_t>(arguments[0])];
}

TEST(Reported, DocumentExplainsIfTheProcedureDoesNot) {
  const std::array<std::string, 4> said{"/", "document; own/its advice", "own/", "own/own advice"};
  for (std::int64_t way = 0; way < 4; ++way) {
    alignas(std::max_align_t) std::array<std::byte, 4096> arena;
    Reported<report, author::Run<Toy, Found, end_as_told>, finding> host({}, {&way, 1}, arena);
    Bench(echo).run(host);
    EXPECT_EQ(std::string(host.detail()) + "/" + std::string(host.advice()), said[static_cast<std::size_t>(way)]);
  }
}

constexpr Report<Toy, ToyDialog> of_host{
    .explain = [](const Toy::Format&, Error, Bytes, Bytes) -> Explanation { return {"of the frame"}; },
    .explain_host = [](const ToyDialog& host) -> Explanation {
      return {host.request() == 1 ? "of the host" : "of another"};
    }};
constexpr Report<Toy, ToyDialog> telling{
    .explain_host = [](const ToyDialog&) -> Explanation {
      return {"of the host", "advice"};
    },
    .tell = [](Sentence& words, const ToyDialog& host) { words.add(text_of(host.error()).name).add(" is told"); },
    .noise_advice = "shield it"};
constexpr Finding<ToyDialog, Found> leaving{
    .put = [](FieldSink&, const ToyDialog&, const Found&) {},
    .put_left = [](FieldSink& sink, const ToyDialog& host,
                   const Found& found) { sink.put({.info = nullptr, .number = host.request() * 1000 + found.sum}); },
    .left = [](const Found& found) -> std::string_view { return found.sum != 0 ? "something is left" : ""; }};

Procedure leave_something(ToyDialog& dialog, Found& found) {
  co_await dialog.ask(1);
  found.sum = 7;
  co_return {Error::busy};
}

struct Numbers final : FieldSink {
  void put(const FieldValue& value) override { seen.push_back(value.number); }
  std::vector<std::int64_t> seen;
};

TEST(Reported, ConversationExplains) {
  alignas(std::max_align_t) std::array<std::byte, 4096> arena;
  Reported<of_host, author::Run<Toy, Found, leave_something>, finding> host({}, {}, arena);
  Bench(echo).run(host);
  EXPECT_EQ(host.detail(), "of the host");
}

TEST(Reported, TextsAndFieldsOfAnInterruptedProcedure) {
  alignas(std::max_align_t) std::array<std::byte, 4096> arena;
  Reported<telling, author::Run<Toy, Found, leave_something>, leaving> host({}, {}, arena);
  Bench(echo).run(host);
  EXPECT_EQ(host.detail(), "busy is told; something is left");
  EXPECT_EQ(host.advice(), "advice");
  Numbers numbers;
  host.report_left(numbers);
  EXPECT_EQ(numbers.seen, std::vector<std::int64_t>{1007});
}

TEST(Reported, AdviceAboutALineThatIsNeverSilent) {
  alignas(std::max_align_t) std::array<std::byte, 4096> arena;
  Reported<telling, author::Run<Toy, Found, leave_something>, leaving> host({}, {}, arena);
  Bench(endless_noise_of_bytes).run(host);
  EXPECT_EQ(host.advice(), "shield it");
}

TEST(Text, ValuesAreNamed) {
  const auto told = [](std::string_view text) {
    std::string all;
    const bool good = for_each_value(text, [&all](std::string_view name, std::string_view value) {
      all += std::string(name) + "=" + std::string(value) + ";";
      return name != "last";
    });
    return all + (good ? "good" : "bad");
  };
  EXPECT_EQ(told(""), "good");
  EXPECT_EQ(told("a=1 name=two words b="), "a=1;name=two words;b=;good");
  EXPECT_EQ(told("a=1 last=2 b=3"), "a=1;last=2;bad");
  for (const std::string_view none : {"a", "a=b=c", "a b=c=d"}) EXPECT_EQ(told(none), "bad") << none;
}

TEST(Text, RealNumbersHaveAPoint) {
  double number = 0;
  EXPECT_TRUE(to_real("-12.25", number));
  EXPECT_EQ(number, -12.25);
  for (const std::string_view none : {"", "12", "1.2.3", "1.5x"}) EXPECT_FALSE(to_real(none, number)) << none;
}

// 0.02 degrees in the 10 ms between two readings are 0.33 rpm.
TEST(Standstill, ShowsAThirdOfARevolutionAMinute) { EXPECT_EQ(standstill_millidegrees * (1s / between_looks), 2000); }

static_assert(is_near(0, 1, 14) && is_near(16383, 0, 14) && !is_near(0, 2, 14));
static_assert(is_near(0, 466, 23) && !is_near(0, 467, 23));  // 466 counts of 23 bits are 0.02 degrees

}  // namespace
}  // namespace absenc::author
