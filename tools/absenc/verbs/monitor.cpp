// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>

#include "absenc/client/port/realtime.hpp"
#include "absenc/client/port/shared_link.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/process.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/monitor/monitor_view.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/rate.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

using namespace std::chrono_literals;

using Watches = std::vector<std::unique_ptr<Watch>>;

constexpr Time refresh = 100ms;

std::vector<MonitoredEncoder> look_at(const Watches& watches, std::size_t selected) {
  std::vector<MonitoredEncoder> shown;
  for (const auto& watch : watches) shown.push_back({watch.get(), watch->snapshot(shown.size() == selected)});
  return shown;
}

// ---- Output on a terminal

/// Handles the keys of the interactive screen. Keys that change an encoder ask first.
class Controls {
 public:
  explicit Controls(Watches& watches) : watches_(&watches) {}

  /// Handles a key; returns false if the key ends the program.
  bool take(KeyPress key) {
    const bool answers = !view_.question.empty() && key != KeyPress::none && key != KeyPress::resized;
    if (answers) {
      if (key == KeyPress::yes) selected().run(*asked_);
      view_.question.clear();
      return true;
    }
    switch (key) {
      case KeyPress::quit:
        return false;
      case KeyPress::pause:
        view_.paused = !view_.paused;
        for (const auto& watch : *watches_) watch->pause(view_.paused);
        break;
      case KeyPress::zero:
        ask_for(Verb::zero);
        break;
      case KeyPress::clear_alarms:
        ask_for(Verb::clear_alarms);
        break;
      case KeyPress::next:
        view_.selected = (view_.selected + 1) % watches_->size();
        break;
      case KeyPress::previous:
        view_.selected = (view_.selected + watches_->size() - 1) % watches_->size();
        break;
      case KeyPress::errors:
        toggle(View::Below::errors);
        break;
      case KeyPress::help:
        toggle(View::Below::help);
        break;
      default:
        break;
    }
    return true;
  }

  const View& view() {
    view_.encoders = look_at(*watches_, view_.selected);
    return view_;
  }

 private:
  Watch& selected() { return *(*watches_)[view_.selected]; }

  void toggle(View::Below below) { view_.below = view_.below == below ? View::Below::trace : below; }

  void ask_for(Verb verb) {
    const Unit& unit = *selected().uri().unit;
    asked_ = find_command(unit, verb);
    if (asked_ == nullptr) {
      const std::string_view what = verb == Verb::zero ? "sets a zero" : "clears alarms";
      return selected().notify(fmt::format("{} has no command that {}", unit.id, what));
    }
    view_.question = fmt::format(" {}? y: yes, any other key: no", asked_->meaning);
  }

  Watches* watches_;
  View view_;
  const Command* asked_ = nullptr;  // command that the user is asked about; used only while a question is shown
};

void run_on_screen(Screen& screen, Watches& watches, Time end) {
  Controls controls(watches);
  while (!os::interrupted() && os::now() < end) {
    draw(screen, controls.view());
    if (!controls.take(screen.key(refresh))) return;
  }
}

// ---- Output without a terminal

/// Prints a line to standard error whenever the state of an encoder changes.
class StateChanges {
 public:
  void tell(const std::vector<MonitoredEncoder>& encoders) {
    for (const MonitoredEncoder& shown : encoders) {
      Snapshot::State& before = states_.try_emplace(shown.watch, Snapshot::State::opening).first->second;
      const Snapshot& now = shown.snapshot;
      if (now.state == before) continue;
      const bool says_why = now.state != Snapshot::State::live && now.state != Snapshot::State::silent;
      before = now.state;
      print_message(fmt::format("{} is {}{}{}", shown.watch->name(), name_of(now.state), says_why ? ": " : "",
                                says_why ? now.message : ""));
    }
  }

 private:
  std::map<const Watch*, Snapshot::State> states_;
};

void print_lines(const Watches& watches, bool json, Time interval, Time end) {
  StateChanges changes;
  // Time at which the first lines are printed: until then the encoders have up to half a second to reply.
  Time next = os::now() + std::min<Time>(interval, 500ms);
  try {
    while (os::now() < end) {
      os::sleep_until(std::min({next, end, os::now() + refresh}));
      if (os::interrupted()) return;
      const std::vector<MonitoredEncoder> encoders = look_at(watches, watches.size());
      changes.tell(encoders);
      if (os::now() < next) continue;
      next += interval;
      for (const MonitoredEncoder& shown : encoders) print_line(json ? to_json(shown).line() : to_line(shown));
    }
  } catch (const os::Interrupted&) {
  }
}

// Prints a summary for each encoder. Returns whether every encoder was read at least once and no thread has given up.
bool summarize(const Watches& watches, Time start, Time processor) {
  std::uint64_t readings = 0;
  bool all_read = true;
  for (const auto& watch : watches) {
    const Snapshot snapshot = watch->snapshot(false);
    readings += snapshot.readings;
    all_read = all_read && snapshot.readings != 0 && snapshot.state != Snapshot::State::ended;
    print_message(fmt::format("{}: {} readings; {}; the port went away: {}{}", watch->name(), snapshot.readings,
                              exchanges_text(snapshot.counters, snapshot.readings), snapshot.losses,
                              snapshot.readings == 0 ? "; " + snapshot.message : ""));
  }
  if (readings != 0) {
    print_message(fmt::format("{} readings in {}, {} of processor time each", readings, to_text(os::now() - start),
                              to_text(processor / static_cast<std::int64_t>(readings))));
  }
  return all_read;
}

Watches make_watches(const Invocation& invocation, double rate) {
  const std::span<const std::string> names = invocation.texts("encoder");
  std::vector<EncoderAddress> uris;
  for (const std::string& name : names) uris.push_back(parse_address(name, reading_settings(invocation)));
  require_different(uris, names);
  check_realtime(uris);
  Watches watches;
  for (std::size_t i = 0; i < uris.size(); ++i) {
    // With a rate, the first readings are spread, so that the encoders are not read at the same time.
    const double share = rate > 0 ? static_cast<double>(i) / (rate * static_cast<double>(uris.size())) : 0;
    const Time offset(static_cast<std::int64_t>(1e9 * share));
    watches.push_back(std::make_unique<Watch>(names[i], uris[i], rate, offset));
  }
  return watches;
}

int run_monitor(const Invocation& invocation) {
  os::catch_interrupts();
  const double rate = readings_a_second(invocation, 50);
  const double interval = invocation.real("--interval", 1, 0.1, 1e6);
  const double seconds = invocation.real("--for", 0, 0.001, 1e9);
  const bool json = invocation.has("--json");
  Watches watches = make_watches(invocation, rate);
  const Time start = os::now();
  const Time processor = os::processor_time();
  const Time end = seconds > 0 ? start + Time(static_cast<std::int64_t>(seconds * 1e9)) : never;
  if (const std::unique_ptr<Screen> screen = json ? nullptr : Screen::open()) {
    run_on_screen(*screen, watches, end);
  } else {
    print_lines(watches, json, Time(static_cast<std::int64_t>(interval * 1e9)), end);
  }
  const Time used = os::processor_time() - processor;
  for (const auto& watch : watches) watch->stop();
  return summarize(watches, start, used) ? exit_good : exit_failed;
}

constexpr std::array<Parameter, 8> monitor_parameters{{
    {"encoder", "", "as for `absenc read`; several may be given", "", true, true},
    {"--rate", "HZ", "readings a second of each; 0: as many as the line allows", "50"},
    {"--interval", "SECONDS", "without a screen: how often to print a line for each", "1"},
    {"--for", "SECONDS", "end by itself", "until q or Ctrl-C"},
    {"--json", "", "no screen: one JSON object a line"},
    parameter::read_command,
    parameter::realtime,
    parameter::option,
}};

constexpr std::array<Example, 3> monitor_examples{{
    {"absenc monitor tformat:/dev/ttyUSB0", "one encoder on the screen; h shows the keys"},
    {"absenc monitor tformat:/dev/ttyUSB0 tformat:/dev/ttyUSB1 --json --interval 10 >> log.jsonl",
     "two, a line for each every ten seconds"},
    {"absenc monitor \"esl:/dev/ttyUSB0?address=0\" \"esl:/dev/ttyUSB0?address=3\"", "two on one line, asked in turn"},
}};

}  // namespace

const Subcommand monitor_subcommand{
    "monitor",
    "watch encoders live: position, speed, rate, latency, errors, alarms",
    "On a terminal a screen, otherwise lines. An encoder that is unplugged is waited for; a value that is not live\n"
    "is never shown as one. Colours are left away where the terminal has none, or NO_COLOR is set.",
    monitor_parameters,
    monitor_examples,
    run_monitor};

}  // namespace absenc::tool
