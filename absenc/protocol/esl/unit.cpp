// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/unit.hpp"

#include <array>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/esl/device.hpp"
#include "absenc/protocol/esl/fields.hpp"
#include "absenc/protocol/esl/host.hpp"
#include "absenc/protocol/esl/options.hpp"
#include "absenc/protocol/esl/probe.hpp"
#include "absenc/protocol/esl/vectors.hpp"
#include "absenc/protocol/esl/words.hpp"

namespace absenc::esl {

namespace {

using namespace author;

constexpr Argument address{"address", "of the byte", 0, last_address, 0, true, Role::address};
constexpr Argument page{"page", "0 to 6, 8 or 14", 0, last_page, 0, false, Role::page};
constexpr std::array<Argument, 3> read_arguments{
    {address, page, {"count", "bytes from the address on", 1, last_address + 1, 1, false, Role::count}}};
constexpr std::array<Argument, 4> write_arguments{
    {address,
     {"value", "the byte", 0, 255, 0, true, Role::value},
     page,
     {"force", "1: also pages with calibration, lock bits and undescribed commands", 0, 1, 0, false, Role::force}}};
constexpr std::array<Argument, 1> page_arguments{{{"page", "0 to 6, 8 or 14", 0, last_page}}};

constexpr std::uint8_t byte_of(std::int64_t argument) { return static_cast<std::uint8_t>(argument); }

// ---- Commands: the one request that does the work of each; procedures send more (page select, repetitions)

template <DataId data>
constexpr Request ask(const Profile& profile) {
  return {data, profile.address};
}
template <DataId data>
constexpr Request ask_by(const Profile& profile, Arguments) {
  return {data, profile.address};
}
constexpr Request read_at(const Profile& profile, Arguments arguments) {
  return {DataId::read_memory, profile.address, byte_of(arguments[0])};
}
constexpr Request write_at(const Profile& profile, Arguments arguments) {
  return {DataId::write_memory, profile.address, byte_of(arguments[0]), byte_of(arguments[1])};
}
constexpr Request read_info(const Profile& profile, Arguments) {
  return {DataId::read_memory, profile.address, error_info_address};
}
constexpr Request select(const Profile& profile, Arguments arguments) {
  return {DataId::write_memory, profile.address, page_select_address, byte_of(arguments[0])};
}
constexpr std::string_view no_memory(const Profile& profile) {
  if (profile.bus != sharing_yes) return {};
  return "memory cannot be reached by broadcast or with several encoders on the line (Figure 18): connect this one "
         "alone "
         "and say bus=false; nothing was sent";
}

struct Definition;

template <DataId data>
constexpr CommandOf<Protocol> read(std::string_view name, Verb verb, std::string_view meaning) {
  return reading<Definition, Protocol, ask<data>>({name, verb, 0, meaning});
}
template <class Found, auto procedure, auto request, auto... bound>
constexpr CommandOf<Protocol> run(const Command& info) {
  return command<Definition, Protocol, Found, procedure, request, bound...>(info);
}
template <DataId data>
constexpr CommandOf<Protocol> reset_by(std::string_view name, Verb verb, std::string_view meaning) {
  return run<AfterReset, reset, ask_by<data>, data>({name, verb, 0, meaning, {}, true, false});
}

struct Definition {
  using Protocol = esl::Protocol;
  using Encoder = VirtualEncoder;
  static constexpr std::string_view id = "esl", name = "QS35 ESL (safety encoder, two channels)",
                                    document = "QS35 ESL Protocol Specification, rev 1.5";
  static constexpr LinkKind link = LinkKind::half_duplex;
  static constexpr LineSettings line(const Profile&) { return line_settings; }
  static constexpr std::size_t frames_size = 1200;

  static constexpr const auto& options = esl::options;
  static constexpr std::array models{
      ModelText{"QS35-M40M-E12F", "24 bits, 65536 turns, two channels (SIL3)", 10'000, ""}};
  static constexpr const auto& fields = esl::fields;
  static constexpr const FieldInfo* status = fields.of<&Values::ch1_status>();
  static constexpr const FieldInfo* alarms = fields.of<&Values::ch1_alarms>();
  static constexpr const auto& vectors = esl::vectors;
  static constexpr const auto& conditions = esl::conditions;
  static BitRanges bits(const Options& values, Frame, Frame reply, const FieldInfo& field) {
    return place_of(options.format(values), reply.bytes, field);
  }
  static constexpr LineTiming timing{.pause_bits = 1, .turnaround = answer_time, .turnaround_limit = answer_limit};
  static constexpr Resolution resolution(const Profile&) { return {singleturn_bits, multiturn_bits}; }

  static constexpr std::array commands{
      read<DataId::position>("position", Verb::read, "position, turns and alarms of both channels"),
      read<DataId::singleturn>("singleturn", Verb::read_part, "position within the turn, both channels"),
      read<DataId::position_short>("position-short", Verb::read_part, "position and turns, one channel, no alarms"),
      read<DataId::singleturn_short>("singleturn-short", Verb::read_part,
                                     "position within the turn, one channel, no alarms"),
      read<DataId::calibration>("calibration", Verb::read_part, "position within the turn as each channel sees it"),
      run<Safe, read_safely, ask_by<DataId::position>>(
          {"safe-position", Verb::run, 0,
           "a position that passed every check of a safety reader (not a certified safety function)"}),
      run<Identity, read_encoder_id, ask_by<DataId::encoder_id>>(
          {"encoder-id", Verb::info, 0, "encoder id", {}, false, false}),
      read<DataId::alarms>("alarms", Verb::info, "alarms of both channels"),
      read<DataId::temperature>("temperature", Verb::temperature, "temperature inside the encoder"),
      run<ErrorInfo, read_error_info, read_info>(
          {"led-or-lissajous", Verb::run, 0, "which of the two is behind led_or_lissajous_error"})
          .unless(no_memory),
      run<Nodes, scan, ask_by<DataId::singleturn_short>>(
          {"scan", Verb::scan, 0, "who answers on the line", {}, false, false}),
      reset_by<DataId::zero>("zero", Verb::zero, "make this the zero of the turn"),
      reset_by<DataId::clear_alarms>("clear-alarms", Verb::clear_alarms, "clear the alarms that can be cleared"),
      reset_by<DataId::reset_multiturn>("reset-multiturn", Verb::reset_multiturn, "set the turns to zero"),
      run<MemoryBytes, read_memory, read_at>(
          {"memory-read", Verb::memory_read, 0, "read EEPROM, MTP or registers", read_arguments})
          .unless(no_memory),
      run<Written, write_memory, write_at>(
          {"memory-write", Verb::memory_write, 0, "write a byte of the memory", write_arguments, true, false})
          .unless(no_memory),
      run<Selected, select_page, select>(
          {"select-page", Verb::run, 0, "select a memory page", page_arguments, true, true})
          .unless(no_memory),
  };

  // ---- What frames and procedures report

  static constexpr std::size_t reply_size(const Profile& profile, Bytes begin) {
    return Protocol::request_size(profile, begin) == 0 ? 0 : reply_length(*data_id(begin[0]));
  }
  static constexpr Result<Request> guess_request(const Profile& profile, Bytes reply) {
    return asked_by(profile, {}, reply);
  }
  static constexpr void put(FieldSink& sink, const Profile& profile, const Request& request) {
    fields.put(sink, values_of(profile, request));
  }
  static constexpr void put(FieldSink& sink, const Profile&, const Request&, const Reply& reply) {
    fields.put(sink, values_of(reply));
  }
  static void put(FieldSink& sink, const Profile&, const Identity& found) { fields.put(sink, values_of(found.reply)); }
  static void put(FieldSink& sink, const Profile&, const AfterReset& found) {
    fields.put(sink, values_of(found.reply));
  }
  static void put(FieldSink& sink, const Profile&, const Safe& found) {
    Values values = values_of(found.reply);
    values.safe_singleturn = found.position->singleturn();
    fields.put(sink, values);
  }
  static void put(FieldSink& sink, const Profile&, const MemoryBytes& found) {
    Values values{.page = found.page, .memory_address = found.address, .value = found.data[0]};
    if (found.data.size() > 1) values.data = found.data.view();
    fields.put(sink, values);
  }
  static void put(FieldSink& sink, const Profile&, const Written& found) {
    fields.put(sink,
               {.page = found.page, .memory_address = found.address, .value = found.value, .written = found.sent});
  }
  static void put(FieldSink& sink, const Profile&, const Selected& found) { fields.put(sink, {.page = found.page}); }
  static void put(FieldSink& sink, const Profile&, const ErrorInfo& found) {
    Values values{.led_error = (found.flags & error_info_led) != 0,
                  .lissajous_error = (found.flags & error_info_lissajous) != 0};
    if (found.page_left) values.page_left = register_page;
    fields.put(sink, values);
  }
  static void put(FieldSink& sink, const Profile&, const Nodes& found) {
    for (std::uint8_t node = 0; node < most_encoders; ++node) {
      const std::optional<Reply>& reply = found.answers[node];
      if (!reply && !found.disturbed[node]) continue;
      Values values{.encoder_address = node, .clash = !reply};
      if (reply) values.ch1_status = reply->one.status;
      if (reply) values.singleturn = reply->singleturn;
      fields.put(sink, values);
      if (reply) sink.put_reading(to_reading(*reply));
    }
  }
  static void tell(Sentence& words, const Profile& profile, const Engine& host) { esl::tell(words, profile, host); }
  static Explanation explain(const Profile& profile, Error error, Bytes request, Bytes reply) {
    return esl::explain(profile, error, request, reply);
  }
};

// ---- What few units have

// Permissible writing cycles (notes 6 and 7 of Table 11), which do not say of what.
constexpr std::uint32_t write_life(MemoryArea::Kind kind) {
  if (kind == MemoryArea::Kind::registers) return 0;
  return kind == MemoryArea::Kind::eeprom ? 1'000'000 : 100'000;
}

// Table 11 in the order of pages.
constexpr std::array<absenc::MemoryArea, memory_map.size()> memory_areas = [] {
  std::array<absenc::MemoryArea, memory_map.size()> areas{};
  for (std::size_t i = 0; i < areas.size(); ++i) {
    const MemoryArea& area = memory_map[i];
    areas[i] = {.page = area.page,
                .first = area.first,
                .count = area.last - area.first + 1u,
                .meaning = area.meaning,
                .in_dump = area.page == 0,
                .write_life = write_life(area.kind),
                .protection = area.user ? "" : "what is written there can spoil the encoder"};
  }
  return areas;
}();

bool probe_captures(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  const ProbeResult result = probe(options.format(values), captures);
  for (std::size_t option = 0; option < open_options; ++option) {
    for (std::size_t value = 0; value < options.infos[option].choices.size(); ++value) {
      const Evidence& evidence = result.values[option][value];
      sink.put({option, static_cast<std::int64_t>(value), evidence.possible, evidence.capture,
                sentence(result, option, value)});
    }
    if (result.profiles != 0) values.values[option] = options.get(result.best, option);
  }
  return result.profiles != 0;
}

}  // namespace

constinit const Unit unit = [] {
  Unit made = UnitOf<Definition>::make();
  made.memory = memory_areas;
  made.second_status = fields.of<&Values::ch2_status>();
  made.second_alarms = fields.of<&Values::ch2_alarms>();
  made.probe = probe_captures;
  return made;
}();

}  // namespace absenc::esl
