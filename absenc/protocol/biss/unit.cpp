// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/unit.hpp"

#include <array>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/biss/device.hpp"
#include "absenc/protocol/biss/fields.hpp"
#include "absenc/protocol/biss/host.hpp"
#include "absenc/protocol/biss/vectors.hpp"
#include "absenc/protocol/word_options.hpp"

namespace absenc::biss {

namespace {

using namespace author;

using Settings = WordSettings<Format>;
constexpr std::array<std::string_view, 2> check_choices{"crc6", "crc16"};

struct Definition {
  using Protocol = biss::Protocol;
  using Encoder = VirtualEncoder;
  static constexpr std::string_view id = "biss", name = "BiSS-C (unidirectional)",
                                    document = "RLS E201-9S Decoding the BiSS information";
  static constexpr LinkKind link = LinkKind::clocked;
  static constexpr std::size_t frames_size = 0;

  static constexpr OptionsOf options{
      OptionOf<&Settings::singleturn_bits>{singleturn_bits_option},
      OptionOf<&Settings::multiturn_bits>{multiturn_bits_option},
      OptionOf<&Settings::multiturn_first>{multiturn_first_option},
      OptionOf<&Settings::position_bits>{position_bits_option},
      OptionOf<&Settings::unit_pm>{unit_um_option},
      probeable(option<&Settings::check>("check", "crc16: BiSS Safety's life counter and CRC-16 behind the status bits",
                                         check_choices)),
      option<&Settings::ma_khz>("ma_khz", "clock, kHz", 10, 10'000),
      decimal<3>(option<&Settings::latency>(
          "latency_us",
          "the longest time until the position is ready, us: of the encoder, and of the line there and back", 0,
          1'000'000)),
      option<&Settings::line_delay>("line_delay_ns", "virtual encoder: delay of the line, there and back", 0, 100'000),
      decimal<3>(option<&Settings::ready>(
          "ready_us", "virtual encoder: the time that it needs itself, us; 0: as latency_us, but at most 10", 0,
          1'000'000)),
  };
  static constexpr auto models = position_models;
  static constexpr struct {
    decltype(joined_fields(word_fields, own_fields)) infos;
  } fields{joined_fields(word_fields, own_fields)};
  static constexpr const FieldInfo* alarms = &fields.infos[word_field_alarms];
  static constexpr auto vectors = biss::vectors;

  static constexpr Format format(const Options& values) {
    const Settings given = options.format(values);
    return given.with_word(values, word_with_status(given.bits()), given.position_bits != 0);
  }
  static constexpr LineSettings line(const Format&) { return line_settings; }  // the conversation sets its rate
  static constexpr Resolution resolution(const Format& format) { return resolution_of(format.word, format.scale); }
  static constexpr bool is_usable(const Format& format) { return absenc::is_usable(format.word); }
  static constexpr bool is_readable(const Format& format) {
    return is_usable(format) && absenc::is_usable(format.scale);
  }

  static constexpr std::array commands{
      clocked_reading<Definition, Protocol, ReadPosition>(
          {"position", Verb::read, 0, "position, turns, error and warning"})
          .only_if(is_readable),
  };

  // In the order of the wire.
  static constexpr void put(FieldSink& sink, const Format& format, const Reply& reply) {
    sink.put({&own_fields[field_ack_bits], reply.ack_bits});
    put_word(sink, format.word, reply.word, format.scale);
    if (format.check == Check::crc16) sink.put({&own_fields[field_life_counter], reply.life_counter});
    sink.put({&own_fields[field_crc], reply.crc});
  }

  static Explanation explain(const Format& format, Error error, Bytes, Bytes) {
    switch (error) {
      case Error::invalid_argument:
        if (Protocol::clocks(format) <= Protocol::most_clocks) return {};
        return {"a frame of more than 512 clocks: lower latency_us or ma_khz"};
      case Error::truncated:
        return {"ACK and line take longer than latency_us allows at this clock: raise it, or lower the MA clock"};
      case Error::bad_checksum:
        return {"the delay of the line may not suit this MA clock: try another one"};
      default:
        return {};
    }
  }

  // Around the end of the idle line a flip only changes the length of the ACK. Within the ACK, and at the start bit, it
  // moves the frame, which a CRC of 6 bits misses once in 64 times.
  static bool is_checked(const Options&, Frame, Frame reply, std::size_t bit) {
    const BitView samples = to_bits(reply);
    const std::size_t idle = samples[0] ? samples.end_of_run(0) : 0;
    return bit + 1 < idle || bit > samples.end_of_run(idle);
  }
  // Behind the start bit and CDS.
  static BitRanges bits(const Options& values, Frame, Frame reply, const FieldInfo& field) {
    const BitView samples = to_bits(reply);
    const std::size_t start = samples.end_of_run(samples[0] ? samples.end_of_run(0) : 0);
    return place_in_word(format(values).word, field, start + 2);
  }
};

}  // namespace

constinit const Unit unit = UnitOf<Definition>::make();

}  // namespace absenc::biss
