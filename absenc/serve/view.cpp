// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/view.hpp"

#include <algorithm>

#include "absenc/client/reading.hpp"
#include "absenc/client/row.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::serve {

using namespace client;

namespace {

double microseconds_of(Time time) { return static_cast<double>(time.count()) / 1e3; }

void set_acknowledged(Json& json, const std::vector<RaisedAlarm>& raised, const FieldInfo& field,
                      const FlagInfo& flag) {
  const auto known = std::find_if(raised.begin(), raised.end(), [&](const RaisedAlarm& one) {
    return one.channel == field.name && one.name == flag.name;
  });
  const bool is_known = known != raised.end();
  json.set("since_ms", is_known ? Json(known->since_ms) : Json());
  Json acknowledged;
  if (is_known && known->acknowledged_ms != 0) {
    acknowledged = Json::object().set("who", known->acknowledged_by).set("at_ms", known->acknowledged_ms);
  }
  json.set("acknowledged", acknowledged);
}

// Returns the raised alarms as JSON; null if the reading does not report alarms. `known`: acknowledgements of alarms,
// or null.
Json alarms_json(const Unit& unit, const Reading& reading, const std::vector<RaisedAlarm>* known = nullptr) {
  Json all = Json::array();
  const std::vector<Flags> channels = alarms_of(unit, reading);
  const std::optional<Flags> joined = joined_alarms(unit, reading);
  if (!joined || !has_value(value_of(*joined))) return {};
  for (const Flags& flags : channels) {
    for (const FlagInfo* flag : raised(*flags.field, flags.bits)) {
      Json one = flag_to_json(flag);
      if (channels.size() > 1) one.set("channel", flags.field->name);
      if (known != nullptr) set_acknowledged(one, *known, *flags.field, *flag);
      all.append(one);
    }
  }
  return all;
}

// Returns the names of the status flags that are set, as JSON; null if the reading does not report them.
Json status_json(const Unit& unit, const Reading& reading) {
  Json all = Json::array();
  const std::vector<Flags> channels = status_of(unit, reading);
  const bool is_reported =
      std::any_of(channels.begin(), channels.end(), [](const Flags& flags) { return has_value(value_of(flags)); });
  if (!is_reported) return {};
  for (const Flags& flags : channels) {
    for (const std::string_view name : flag_names(*flags.field, flags.bits)) all.append(name);
  }
  return all;
}

void set_place(Json& json, const Reading& reading, bool live) {
  const bool is_valid = live && reading.ready && reading.singleturn_valid();
  const bool linear = reading.unit_um > 0;
  json.set("angle_deg", is_valid && !linear ? Json(degrees(reading.singleturn, reading.singleturn_bits)) : Json());
  json.set("position_mm", is_valid && linear ? Json(micrometres(reading.singleturn, reading.unit_um) / 1000) : Json());
  json.set("counts", is_valid ? Json(reading.singleturn) : Json());
  const Validity singleturn = reading.ready ? reading.singleturn_validity() : Validity::invalid;
  json.set("singleturn_valid", live ? to_json(value_of(singleturn)) : Json());
  const bool has_turns = live && reading.multiturn_bits != 0 && reading.multiturn_valid;
  json.set("turns", has_turns ? Json(reading.turns()) : Json());
  json.set("multiturn_valid", live ? to_json(value_of(reading.multiturn_validity())) : Json());
}

Json arguments_json(const Command& command) {
  return Json::list(command.arguments, [](const Argument& argument) {
    return Json::object()
        .set("name", argument.name)
        .set("meaning", argument.meaning)
        .set("role", client::name_of(argument.role))
        .set("minimum", argument.minimum)
        .set("maximum", argument.maximum)
        .set("default", argument.required ? Json() : Json(argument.default_value));
  });
}

// Returns the name of a kind of command that the page treats in a special way; "" for other kinds.
std::string_view name_of(Verb verb) {
  switch (verb) {
    case Verb::clear_alarms:
      return "clear_alarms";
    case Verb::zero:
      return "zero";
    case Verb::reset_multiturn:
      return "reset_multiturn";
    case Verb::config_set:
      return "config_set";
    case Verb::memory_write:
      return "memory_write";
    default:
      return "";
  }
}

Json commands_json(const Unit& unit) {
  Json all = Json::array();
  for (const Command& command : unit.commands) {
    // the command `scan` searches a line for encoders, so no encoder offers it
    if (command.verb == Verb::scan) continue;
    all.append(Json::object()
                   .set("name", command.name)
                   .set("meaning", command.meaning)
                   .set("verb", name_of(command.verb))
                   .set("reads_back", command.reads_back)
                   .set("changes_encoder", command.changes_encoder)
                   .set("arguments", arguments_json(command)));
  }
  return all;
}

Json errors_json(const host::Counters& counters) {
  Json json = Json::object();
  for (std::size_t i = 0; i < counters.errors.size(); ++i) {
    if (counters.errors[i] != 0) json.set(error_texts[i].name, counters.errors[i]);
  }
  return json;
}

// A bucket of the latencies counts only replies above the limit of the bucket before it; the last bucket has no upper
// limit.
Json latency_json(const LatencyFigures& latency) {
  Json buckets = Json::array();
  std::uint64_t below = 0;
  for (std::size_t i = 0; i <= latency_limits.size(); ++i) {
    const bool limited = i < latency_limits.size();
    const std::uint64_t within = limited ? latency.within[i] : latency.count;
    buckets.append(Json::object()
                       .set("at_most", limited ? Json(microseconds_of(latency_limits[i])) : Json())
                       .set("count", within - below));
    below = within;
  }
  return Json::object()
      .set("p50", microseconds_of(latency.median))
      .set("p99", microseconds_of(latency.percentile_99))
      .set("max", microseconds_of(latency.longest))
      .set("buckets", buckets);
}

Json bad_json(const Details& details) {
  return Json::list(details.bad, [now = os::now()](const BadExchangeText& bad) {
    return Json::object()
        .set("age_s", seconds_of(now - bad.at))
        .set("error", text_of(bad.error).name)
        .set("meaning", text_of(bad.error).description)
        .set("sent", bad.sent)
        .set("received", bad.received);
  });
}

void set_scale(Json& json, const Watch& watch, const Snapshot& snapshot) {
  Resolution known = watch.address().unit->resolution(watch.address().options);
  const Reading& reading = snapshot.last.reading;
  if (snapshot.has_reading && reading.singleturn_bits != 0) {
    known.singleturn_bits = reading.singleturn_bits;
    known.multiturn_bits = reading.multiturn_bits;
    known.unit_um = reading.unit_um;
  }
  const bool is_known = known.singleturn_bits != 0 && known.singleturn_bits < 63;
  const std::int64_t counts = is_known ? std::int64_t{1} << known.singleturn_bits : 0;
  const bool linear = known.unit_um > 0;
  json.set("counts_in_all", is_known ? Json(counts) : Json());
  json.set("length_mm", is_known && linear ? Json(static_cast<double>(counts) * known.unit_um / 1000) : Json());
  json.set("has_turns", known.multiturn_bits != 0);
}

// While the encoder is not live, its last reading must not be shown as the current position.
Json last_reading_json(const Sample& last) {
  const std::int64_t age_ms = std::chrono::duration_cast<std::chrono::milliseconds>(os::now() - last.at).count();
  Json json = Json::object().set("at_ms", calendar_ms() - age_ms);
  set_place(json, last.reading, true);
  return json;
}

}  // namespace

bool is_linear(const Watch& watch) { return watch.address().unit->resolution(watch.address().options).unit_um > 0; }

Json condition_json(const Watch& watch, const Snapshot& snapshot) {
  const bool live = snapshot.state == State::live;
  const Unit& unit = *watch.address().unit;
  Json json =
      Json::object().set("encoder", watch.name()).set("protocol", unit.id).set("state", name_of(snapshot.state));
  json.set("message", live ? Json() : Json(snapshot.message));
  json.set("alarms", live ? alarms_json(unit, snapshot.last.reading) : Json());
  return json.set("status", live ? status_json(unit, snapshot.last.reading) : Json());
}

namespace {

void set_angles(Json& json, const Watch& watch, const JointAngles& angles) {
  const auto value = [](const std::optional<double>& one) { return one ? Json(*one) : Json(); };
  const std::optional<Estimate>& speed = angles.joint_speed_mm_s ? angles.joint_speed_mm_s : angles.joint_speed_rpm;
  json.set("has_joint", watch.address().joint.is_set).set("has_motor", watch.address().joint.has_motor());
  json.set("joint_deg", value(angles.joint_deg)).set("joint_mm", value(angles.joint_mm));
  json.set("joint_speed", speed ? Json(speed->value) : Json());
  json.set("joint_speed_uncertainty", speed ? Json(speed->uncertainty) : Json());
  json.set("electrical_deg", value(angles.electrical_deg));
}

}  // namespace

Json overview(const Watch& watch, const Snapshot& snapshot) {
  const bool live = snapshot.state == State::live;
  const Unit& unit = *watch.address().unit;
  const Sample& last = snapshot.last;
  Json json = Json::object().set("encoder", watch.name()).set("address", address_of(watch.address()));
  json.set("protocol", unit.id).set("state", name_of(snapshot.state)).set("age_s", seconds_of(snapshot.age));
  json.set("protocol_name", unit.name);
  json.set("linear", is_linear(watch)).set("position_unit", is_linear(watch) ? "mm" : "deg");
  set_scale(json, watch, snapshot);
  set_place(json, last.reading, live);
  json.set("continued_position", live && last.position_valid && snapshot.place ? Json(*snapshot.place) : Json());
  json.set("speed", live && last.speed_valid ? Json(last.speed) : Json());
  json.set("speed_uncertainty", live && last.speed_valid ? Json(last.speed_uncertainty) : Json());
  json.set("speed_unit", is_linear(watch) ? "mm/s" : "rpm");
  set_angles(json, watch, live ? last.angles : JointAngles{});
  json.set("alarms", live ? alarms_json(unit, last.reading, &snapshot.raised) : Json());
  json.set("status", live ? status_json(unit, last.reading) : Json());
  json.set("errors_last_minute", snapshot.errors_last_minute).set("rate_hz", snapshot.rate);
  json.set("last_reading", !live && snapshot.has_reading ? last_reading_json(last) : Json());
  return json.set("message", live ? Json() : Json(snapshot.message));
}

Json details(const Watch& watch) {
  const Snapshot snapshot = watch.snapshot();
  const Details more = watch.details();
  Json json = overview(watch, snapshot);
  json.set("readings", snapshot.readings).set("losses", snapshot.losses).set("restarts", snapshot.restarts);
  json.set("repeated", snapshot.counters.repeated).set("errors", errors_json(snapshot.counters));
  json.set("latency_us", latency_json(snapshot.latency));
  json.set("fields", snapshot.state == State::live ? more.fields : Json());
  json.set("reply", snapshot.state == State::live ? more.reply : Json());
  json.set("bad_exchanges", bad_json(more));
  json.set("readable", readable_json(*watch.address().unit));
  return json.set("commands", commands_json(*watch.address().unit));
}

Json last_minute(const Fleet::Watches& watches) {
  const auto mean = [](const Spread& spread) { return spread.count != 0 ? Json(spread.mean()) : Json(); };
  const Json encoders = Json::list(watches, [&](const auto& watch) {
    const Json seconds = Json::list(watch->last_minute(), [&](const Second& second) {
      return Json::array()
          .append(second.at_s)
          .append(second.last_place ? Json(*second.last_place) : Json())
          .append(mean(second.speed));
    });
    return Json::object().set("encoder", watch->name()).set("seconds", seconds);
  });
  return Json::object().set("encoders", encoders);
}

Json points(const Watch& watch, std::span<const Point> taken) {
  const Json list = Json::list(taken, [](const Point& point) {
    Json json = Json::array().append(point.at_ms).append(point.place);
    json.append(point.speed ? Json(point.speed->value) : Json());
    return json.append(point.speed ? Json(point.speed->uncertainty) : Json());
  });
  return Json::object().set("encoder", watch.name()).set("points", list);
}

}  // namespace absenc::serve
