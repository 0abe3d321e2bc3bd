// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/monitor/monitor_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "absenc/client/sample_rows.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "tools/absenc/short_names.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/reading_text.hpp"

namespace absenc::tool {

using namespace client;

namespace {

Style style_of(Snapshot::State state) {
  switch (state) {
    case Snapshot::State::live:
      return Style::good;
    case Snapshot::State::opening:
    case Snapshot::State::paused:
      return Style::warning;
    default:
      return Style::bad;
  }
}

bool is_live(const Snapshot& snapshot) { return snapshot.state == Snapshot::State::live; }

bool has_position(const Snapshot& snapshot) {
  const Reading& reading = snapshot.last.reading;
  return is_live(snapshot) && reading.ready && reading.singleturn_valid();
}

// Returns the age of a reading as "   (0.3 s old)"; "" for an age below a tenth of a second.
std::string age(const Snapshot& snapshot) {
  if (snapshot.age < std::chrono::milliseconds(100)) return {};
  return fmt::format("   ({:.1f} s old)", std::chrono::duration<double>(snapshot.age).count());
}

double unit_um(const MonitoredEncoder& shown) {
  const EncoderAddress& uri = shown.watch->uri();
  return uri.unit->resolution(uri.options).unit_um;
}

// Returns `value` as text. Drops decimals if the text is longer than `width` characters.
std::string short_text(double value, int decimals, std::size_t width = 9) {
  while (decimals > 0 && fmt::formatted_size("{:.{}f}", value, decimals) > width) --decimals;
  std::string text = fmt::format("{:.{}f}", value, decimals);
  for (int digits = 2; text.size() > width && digits >= 0; --digits) text = fmt::format("{:.{}e}", value, digits);
  return text;
}

std::string position_text(const Snapshot& snapshot) {
  if (!is_live(snapshot)) return "-";
  const Reading& reading = snapshot.last.reading;
  if (!has_position(snapshot)) return reading.ready && !reading.singleturn_known ? "unknown" : "INVALID";
  if (reading.unit_um == 0) return fmt::format("{:.3f}", degrees(reading.singleturn, reading.singleturn_bits));
  return short_text(micrometres(reading.singleturn, reading.unit_um) / 1000, 3);
}

std::string turns_text(const Snapshot& snapshot) {
  const Reading& reading = snapshot.last.reading;
  if (!is_live(snapshot) || reading.multiturn_bits == 0) return "-";
  if (!reading.multiturn_valid) return reading.multiturn_known ? "INVALID" : "unknown";
  return short_text(static_cast<double>(reading.turns()), 0, 7);
}

std::string speed_text(const Snapshot& snapshot) {
  if (!is_live(snapshot) || !snapshot.last.speed_valid) return "-";
  const std::string text = value_text(*snapshot.last.measured_speed());
  return text.size() <= 9 ? text : short_text(snapshot.last.speed, 1);
}

// Returns speed and unit as "12.0 +/- 0.3 rpm", or as "- rpm" if no speed is known.
std::string measured_speed_text(const Snapshot& snapshot, std::string_view sign) {
  const Sample& last = snapshot.last;
  const std::string value =
      is_live(snapshot) && last.speed_valid ? to_text(*last.measured_speed(), sign) : std::string("-");
  return fmt::format("{} {}", value, speed_unit(last.reading));
}

// Returns whether an alarm is raised, or a status flag is set that may stand for an alarm.
bool has_alarm(const MonitoredEncoder& shown) {
  const Unit& unit = *shown.watch->uri().unit;
  const Reading& reading = shown.snapshot.last.reading;
  bool is_complete = unit.alarms != nullptr;
  for (const Flags& flags : alarms_of(unit, reading)) {
    if (!raised(*flags.field, flags.bits).empty()) return true;
    is_complete = is_complete && flags.is_complete();
  }
  if (is_complete) return false;
  const std::vector<Flags> status = status_of(unit, reading);
  return std::any_of(status.begin(), status.end(), [](const Flags& flags) {
    const std::vector<const FlagInfo*> set = raised(*flags.field, flags.bits);
    return std::any_of(set.begin(), set.end(), [](const FlagInfo* flag) { return !flag->action.empty(); });
  });
}

std::uint64_t failures(const Snapshot& snapshot) { return snapshot.counters.bad(); }

// ---- The list

constexpr std::size_t turns_width = 7;
constexpr std::size_t failures_width = 6;
constexpr int values_width = 43;  // width of all columns to the right of the column `state`

std::vector<std::string> names_in(const View& view, int width) {
  std::vector<std::string> names;
  for (const MonitoredEncoder& shown : view.encoders) names.push_back(shown.watch->name());
  return short_names(names, static_cast<std::size_t>(std::max(width, 8)));
}

int name_width(const Screen& screen) { return std::clamp(screen.columns() - values_width - 13, 8, 40); }

void draw_list_line(Screen& screen, int row, const MonitoredEncoder& shown, const std::string& name, bool selected) {
  const Snapshot& snapshot = shown.snapshot;
  const int width = name_width(screen);
  screen.put(row, 0, selected ? ">" : " ", Style::bold);
  screen.put(row, 2, name, selected ? Style::bold : Style::plain);
  screen.put(row, width + 3, name_of(snapshot.state), style_of(snapshot.state));
  const auto failed = static_cast<double>(failures(snapshot));
  screen.put(row, width + 11,
             fmt::format("{:>9} {:>{}} {:>9} {:>8} {:>{}}", position_text(snapshot), turns_text(snapshot), turns_width,
                         speed_text(snapshot), short_text(snapshot.rate, 1, 8), short_text(failed, 0, failures_width),
                         failures_width));
  if (is_live(snapshot) && has_alarm(shown)) {
    screen.put(row, width + 12 + values_width, "!", Style::bad);
  }
}

// Returns the headings of the columns of positions and speeds, which are their units.
std::array<std::string_view, 2> units_of(const View& view) {
  const auto linear = std::count_if(view.encoders.begin(), view.encoders.end(),
                                    [](const MonitoredEncoder& one) { return unit_um(one) > 0; });
  if (linear == 0) return {"degrees", "rpm"};
  if (linear < std::ssize(view.encoders)) return {"deg, mm", "rpm, mm/s"};
  return {"mm", "mm/s"};
}

// Draws the list of encoders from the screen row `row` on; at least the selected encoder is drawn. Returns the row
// after the list.
int draw_list(Screen& screen, int row, const View& view) {
  const std::size_t most = std::max<std::size_t>(1, static_cast<std::size_t>(screen.rows() - 14));
  const std::size_t count = std::min(view.encoders.size(), most);
  const std::size_t first = std::min(view.selected - std::min(view.selected, count / 2), view.encoders.size() - count);
  const auto [position, speed] = units_of(view);
  screen.put(row++, 2,
             fmt::format("{:<{}} {:<7} {:>9} {:>{}} {:>9} {:>8} {:>{}}", "encoder", name_width(screen), "state",
                         position, "turns", turns_width, speed, "a second", "failed", failures_width),
             Style::faint);
  const std::vector<std::string> names = names_in(view, name_width(screen));
  for (std::size_t i = first; i < first + count; ++i) {
    draw_list_line(screen, row++, view.encoders[i], names[i], i == view.selected);
  }
  if (count < view.encoders.size()) {
    screen.put(row++, 2, fmt::format("{} to {} of {}", first + 1, first + count, view.encoders.size()), Style::faint);
  }
  return row;
}

// ---- One encoder

// Returns the upper end of the bar that shows the position: "360", or a range in mm.
std::string range_text(const MonitoredEncoder& shown) {
  const EncoderAddress& uri = shown.watch->uri();
  const Resolution resolution = uri.unit->resolution(uri.options);
  if (resolution.unit_um == 0) return "360";
  return fmt::format("{:.6g} mm", std::ldexp(resolution.unit_um, static_cast<int>(resolution.singleturn_bits)) / 1000);
}

void draw_bar(Screen& screen, int row, const MonitoredEncoder& shown) {
  const Snapshot& snapshot = shown.snapshot;
  const std::string range = range_text(shown);
  const int width = std::min(screen.columns() - 9 - static_cast<int>(range.size()), 73);
  std::string bar(static_cast<std::size_t>(width), '-');
  for (const double quarter : {0.25, 0.5, 0.75}) bar[static_cast<std::size_t>(quarter * width)] = '+';
  const Reading& reading = snapshot.last.reading;
  if (has_position(snapshot)) {
    const double share = degrees(reading.singleturn, reading.singleturn_bits) / 360;
    bar[static_cast<std::size_t>(share * width)] = 'O';
  }
  screen.put(row, 2, fmt::format("0 |{}| {}", bar, range), has_position(snapshot) ? Style::plain : Style::faint);
}

void draw_position(Screen& screen, int row, const MonitoredEncoder& shown) {
  const Snapshot& snapshot = shown.snapshot;
  const Unit& unit = *shown.watch->uri().unit;
  if (is_live(snapshot)) {
    // The flags of an encoder with two channels are too long for the line of the position; the screen shows them among
    // the fields.
    const bool has_room = unit.second_status == nullptr && unit.second_alarms == nullptr;
    const Reading& reading = snapshot.last.reading;
    const Doubt doubt = doubt_of(snapshot.last);
    const std::string text =
        (has_room ? reading_text(unit, reading, doubt) : place_text(reading, doubt)) + age(snapshot);
    const bool good = has_position(snapshot);
    return screen.put(row, 2, text, good ? Style::bold : Style::bad);
  }
  std::string text = fmt::format("{}: no reading for {}", name_of(snapshot.state), to_text(snapshot.age));
  if (snapshot.has_reading) {
    text += fmt::format("; the last was: {}", reading_text(unit, snapshot.last.reading));
  }
  screen.put(row, 2, text, style_of(snapshot.state));
}

std::string speed_line(const Snapshot& snapshot) {
  if (!is_live(snapshot) || !snapshot.last.position_valid) return "speed -";
  const Reading& reading = snapshot.last.reading;
  std::string text = fmt::format("position {} counts", snapshot.last.position);
  if (reading.unit_um > 0) {
    const double mm = micrometres(snapshot.last.position, reading.unit_um) / 1000;
    text = fmt::format("position {} mm", millimetres_text(mm, reading.unit_um));
  }
  if (snapshot.last.restarted) {
    return text + (reading.unit_um > 0 ? ", started again: it jumped, or the way before is not known (max_mm_s)"
                                       : ", started again: it jumped, or the turns before are not known (max_rpm)");
  }
  if (!snapshot.last.speed_valid) return text;
  return fmt::format("speed {}, {} ago; {}", measured_speed_text(snapshot, "+/-"), to_text(snapshot.last.speed_delay),
                     text);
}

std::string statistics_line(const Snapshot& snapshot) {
  // Readings without latencies can only come from an encoder that transmits without requests.
  if (snapshot.longest == Time{} && snapshot.readings != 0) {
    return fmt::format("{:.1f} a second, sent without requests", snapshot.rate);
  }
  return fmt::format("{:.1f} a second; latency 50 % {}, 99 % {}, longest {}", snapshot.rate, to_text(snapshot.median),
                     to_text(snapshot.percentile_99), to_text(snapshot.longest));
}

// Draws `text`, wrapped, in the rows before `end`. Returns the row behind the last one.
int draw_words(Screen& screen, int row, int end, std::string_view text, Style style) {
  constexpr int indent = 2;
  const auto width = static_cast<std::size_t>(screen.columns() - indent);
  while (!text.empty() && row < end) {
    std::size_t size = std::min(text.size(), width);
    if (size < text.size()) {
      const std::size_t space = text.rfind(' ', size);
      if (space != std::string_view::npos && space > 0) size = space;
    }
    screen.put(row++, indent, text.substr(0, size), style);
    text.remove_prefix(std::min(text.find_first_not_of(' ', size), text.size()));
  }
  return row;
}

int draw_alarms(Screen& screen, int row, int end, const MonitoredEncoder& shown) {
  const Unit& unit = *shown.watch->uri().unit;
  const std::string words = is_live(shown.snapshot) ? alarms_in_words(unit, shown.snapshot.last.reading) : "";
  std::string_view rest = words;
  while (!rest.empty()) {
    const std::size_t size = std::min(rest.find('\n'), rest.size());
    std::string_view line = rest.substr(0, size);
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    row = draw_words(screen, row, end, line, Style::bad);
    rest.remove_prefix(std::min(size + 1, rest.size()));
  }
  return row;
}

// Draws the fields of a live reading in columns, as far as they fit. Returns the row after them.
int draw_fields(Screen& screen, int row, int end, const Snapshot& snapshot) {
  if (!is_live(snapshot)) return row;
  constexpr int between = 3;
  const int room = screen.columns() - 2 + between;
  int width = 1;  // width of a column, set by the longest field that is at most half as wide as the screen
  for (const std::string& field : snapshot.fields) {
    const int needed = static_cast<int>(field.size()) + between;
    if (needed <= room / 2) width = std::max(width, needed);
  }
  const int columns = room / width;
  int column = 0;
  for (const std::string& field : snapshot.fields) {
    const int needed = std::min(columns, (static_cast<int>(field.size()) + between + width - 1) / width);
    if (column + needed > columns) {
      column = 0;
      ++row;
    }
    if (row >= end - 3) return row;
    screen.put(row, 2 + column * width, field);
    column += needed;
  }
  return column == 0 ? row : row + 1;
}

void draw_trace(Screen& screen, int row, int end, const Snapshot& snapshot) {
  const auto room = static_cast<std::size_t>(std::max(0, end - row));
  const std::size_t count = std::min(room, snapshot.trace.size());
  for (std::size_t i = snapshot.trace.size() - count; i < snapshot.trace.size(); ++i) {
    screen.put(row++, 2, snapshot.trace[i], Style::faint);
  }
}

// Draws the last failed exchanges of the encoder, also those whose request was then repeated with success.
void draw_errors(Screen& screen, int row, int end, const MonitoredEncoder& shown) {
  if (shown.snapshot.bad.empty()) return screen.put(row, 2, "no exchange has failed");
  for (const BadExchangeText& bad : shown.snapshot.bad) {
    const double seconds = std::chrono::duration<double>(bad.at - shown.watch->start()).count();
    const std::string text = fmt::format("{:9.3f}  {}: {} -> {}", seconds, text_of(bad.error).name, bad.sent,
                                         bad.received.empty() ? "nothing" : bad.received);
    row = draw_words(screen, row, end, text, Style::plain);
  }
}

void draw_encoder(Screen& screen, int row, int end, const MonitoredEncoder& shown, bool errors) {
  const Snapshot& snapshot = shown.snapshot;
  draw_position(screen, row++, shown);
  draw_bar(screen, row++, shown);
  screen.put(row++, 2, speed_line(snapshot));
  const std::string angles = is_live(snapshot) ? angles_text(shown.watch->uri().joint, snapshot.last) : "";
  if (!angles.empty()) screen.put(row++, 2, std::string_view(angles).substr(angles.find_first_not_of(' ')));
  screen.put(row++, 2, statistics_line(snapshot));
  const bool flawless = failures(snapshot) == 0 && snapshot.losses == 0;
  row = draw_words(screen, row, end,
                   fmt::format("{}; the port went away: {}", summary(snapshot.counters), snapshot.losses),
                   flawless ? Style::plain : Style::warning);
  if (!is_live(snapshot) && snapshot.state != Snapshot::State::paused) {
    row = draw_words(screen, row, end, snapshot.message, Style::bad);
  }
  row = draw_alarms(screen, row, end, shown);
  if (!snapshot.notice.empty()) row = draw_words(screen, row, end, snapshot.notice, Style::bold);
  row = draw_fields(screen, row, end, snapshot);
  if (errors) return draw_errors(screen, row + 1, end, shown);
  draw_trace(screen, row + 1, end, snapshot);
}

void draw_help(Screen& screen, int row, int end) {
  constexpr std::array<std::string_view, 8> keys{
      "q, Ctrl-C     quit",
      "space, p      pause: nothing is read; again: go on",
      "z             make this position the zero of this encoder: asks first",
      "c             clear the latched alarms of this encoder: asks first",
      "tab, n, down  the next encoder",
      "up            the one before",
      "e             the last bad exchanges, byte by byte; again: the trace",
      "h, ?          this help; again: away with it",
  };
  for (const std::string_view key : keys) screen.put(row++, 4, key);
  draw_words(
      screen, row + 1, end,
      "\"failed\" counts every attempt, repeated ones too. The speed is the mean over a short window, as old as it "
      "says and no farther from the true mean than +/-; \"-\" while the times of the readings leave too much of "
      "it open. What is not live is never shown as a present value.",
      Style::plain);
}

// Returns the question that the screen asks, followed by the short name of the selected encoder.
std::string question_in(const View& view, int columns) {
  const std::string name = names_in(view, columns - static_cast<int>(view.question.size()) - 5)[view.selected];
  const std::string who = fmt::format("  ({})", name);
  const auto width = static_cast<std::size_t>(columns);
  const std::size_t room = width - std::min(width, who.size());
  return view.question.substr(0, room) + who;
}

}  // namespace

void draw(Screen& screen, const View& view) {
  screen.clear();
  if (screen.rows() < least_rows || screen.columns() < least_columns) {
    screen.put(0, 0, "the terminal is too small:", Style::bad);
    screen.put(1, 0, fmt::format("{} x {}, needs {} x {}", screen.columns(), screen.rows(), least_columns, least_rows));
    screen.put(2, 0, "q: quit");
    return screen.show();
  }
  const MonitoredEncoder& selected = view.encoders[view.selected];
  const std::string_view paused = view.paused ? "   PAUSED" : "";
  const int title_width = screen.columns() - 18 - static_cast<int>(paused.size());
  screen.fill(0, fmt::format(" absenc monitor   {}{}", names_in(view, title_width)[view.selected], paused),
              Style::title);
  const int last = screen.rows() - 1;
  const int row = draw_list(screen, 1, view) + 1;
  if (view.below == View::Below::help) {
    draw_help(screen, row, last);
  } else {
    draw_encoder(screen, row, last, selected, view.below == View::Below::errors);
  }
  const std::string_view keys = " q quit  p pause  z zero  c clear  tab next  e errors  h help";
  screen.fill(last, view.question.empty() ? std::string(keys) : question_in(view, screen.columns()), Style::title);
  screen.show();
}

std::string to_line(const MonitoredEncoder& shown) {
  const Snapshot& snapshot = shown.snapshot;
  std::string text = fmt::format("{}: ", shown.watch->name());
  if (is_live(snapshot)) {
    text += fmt::format(
        "{}   {}{}", reading_text(*shown.watch->uri().unit, snapshot.last.reading, doubt_of(snapshot.last)),
        measured_speed_text(snapshot, "±") + angles_text(shown.watch->uri().joint, snapshot.last), age(snapshot));
  } else {
    text += fmt::format("{}, no reading for {}", name_of(snapshot.state), to_text(snapshot.age));
  }
  return text + fmt::format("   {:.1f} a second   {} failed", snapshot.rate, failures(snapshot));
}

Json to_json(const MonitoredEncoder& shown) {
  const Snapshot& snapshot = shown.snapshot;
  const EncoderAddress& uri = shown.watch->uri();
  Json json = Json::object().set("encoder", shown.watch->name()).set("state", name_of(snapshot.state));
  json.set("age_s", std::chrono::duration<double>(snapshot.age).count());
  SampleRows rows(*uri.unit, uri.options, shown.watch->start(), SampleRows::With::reading, uri.joint);
  json.set("reading", is_live(snapshot) ? to_json(rows.of(snapshot.last)) : Json());
  set_motion(json, is_live(snapshot) ? snapshot.last : Sample{}, unit_um(shown));
  set_joint_speed(json, is_live(snapshot) ? snapshot.last : Sample{}, uri.joint, unit_um(shown));
  const auto microseconds = [](Time time) { return static_cast<double>(time.count()) / 1e3; };
  json.set("rate_hz", snapshot.rate).set("readings", snapshot.readings);
  json.set("latency_us", Json::object()
                             .set("p50", microseconds(snapshot.median))
                             .set("p99", microseconds(snapshot.percentile_99))
                             .set("max", microseconds(snapshot.longest)));
  json.set("errors", errors_to_json(snapshot.counters)).set("losses", snapshot.losses);
  json.set("restarts", snapshot.restarts);
  return is_live(snapshot) ? json : json.set("message", snapshot.message);
}

}  // namespace absenc::tool
