// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>

#include "absenc/os/hangup.hpp"
#include "absenc/os/realtime.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/serve/server.hpp"
#include "absenc/serve/state_file.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/rate.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

constexpr std::string_view usual_host = "127.0.0.1";
constexpr std::uint16_t usual_port = 8420;
constexpr std::string_view no_history = "none";
// Time after which the main thread checks again for a signal, because another thread may receive it.
constexpr Time between_looks = std::chrono::milliseconds(100);

// Sets host and port of the server from "HOST:PORT", "HOST" or ":PORT". Throws UsageError.
void set_place(serve::Choices& choices, std::string_view written) {
  const std::size_t bracket = written.rfind(']');
  const std::size_t colon = written.find(':', bracket == std::string_view::npos ? 0 : bracket);
  const std::string_view host = written.substr(0, colon);
  choices.host = host.empty() ? usual_host : host;
  choices.port = usual_port;
  if (colon == std::string_view::npos) return;
  const Result<std::int64_t> port = parse_number(written.substr(colon + 1));
  if (!port || *port < 0 || *port > 65535) {
    throw UsageError(fmt::format("--listen is \"{}\", but must be HOST:PORT; an IPv6 address in brackets", written));
  }
  choices.port = static_cast<std::uint16_t>(*port);
}

// --home-assistant is the only option in `outlet_parameters` that takes no value.
constexpr std::string_view home_assistant = "--home-assistant";

// An option that sets the same value as a setting in absenc.toml, and the section of that file.
struct OutletParameter {
  std::string_view option;
  std::string_view section;
  std::string_view setting;
};
constexpr std::array<OutletParameter, 8> outlet_parameters{{
    {"--mqtt", "mqtt", "broker"},
    {"--mqtt-login-file", "mqtt", "login_file"},
    {"--mqtt-ca-file", "mqtt", "ca_file"},
    {"--mqtt-prefix", "mqtt", "prefix"},
    {"--mqtt-spool", "mqtt", "spool"},
    {"--mqtt-spool-mb", "mqtt", "spool_mb"},
    {home_assistant, "mqtt", "home_assistant"},
    {"--udp", "udp", "to"},
}};

void reload(serve::Server& server) {
  try {
    print_message("absenc.toml was read again: " + server.reload());
  } catch (const UsageError& error) {
    print_message(fmt::format("everything goes on as it was, because absenc.toml or the file of tokens is wrong: {}",
                              error.what()));
  } catch (const Failure& failure) {
    print_message(fmt::format("absenc.toml was read again, but not all of it can be sent: {}", failure.what()));
  } catch (const os::Failure& failure) {
    print_message(fmt::format("absenc.toml was read again, but not all of it can be sent: {}", failure.what()));
  }
}

int run_serve(const Invocation& invocation) {
  os::catch_interrupts();
  const os::Descriptor hangups = os::catch_hangups();
  serve::Choices choices;
  const auto names = invocation.texts("encoders");
  choices.encoders.assign(names.begin(), names.end());
  choices.rate = readings_a_second(invocation, 50);
  choices.realtime =
      static_cast<int>(invocation.number(parameter::realtime.name, 0, os::lowest_realtime, os::highest_realtime));
  set_place(choices, invocation.text("--listen", usual_host));
  choices.token_file = invocation.text("--token-file");
  choices.public_url = invocation.text("--public-url");
  choices.history = invocation.has("--history")
                        ? std::string(invocation.text("--history"))
                        : serve::state_file("history.sqlite", "--history FILE, or --history none");
  if (choices.history == no_history) choices.history.clear();
  choices.limits.seconds = invocation.number("--history-days", 30, 1, 36'500) * 24 * 3600;
  choices.limits.bytes = invocation.number("--history-mb", 1024, 1, 1'000'000) * 1'000'000;
  for (const OutletParameter& one : outlet_parameters) {
    if (!invocation.has(one.option)) continue;
    const bool is_flag = one.option == home_assistant;
    choices.outlets.push_back({one.section, one.setting, is_flag ? "true" : std::string(invocation.text(one.option))});
  }

  serve::Server server(choices);
  print_line(server.url());
  print_message(fmt::format("{} encoder{}; Ctrl-C ends, SIGHUP reads absenc.toml again", server.encoders(),
                            server.encoders() == 1 ? "" : "s"));
  if (const std::string trouble = server.history_trouble(); !trouble.empty()) {
    print_message(fmt::format("the encoders are read, but nothing of it is kept: {}", trouble));
  }
  try {
    while (!os::interrupted()) {
      os::Watched watched{.descriptor = hangups.get()};
      if (os::wait_for({&watched, 1}, os::now() + between_looks) && os::take_hangup(hangups)) reload(server);
    }
  } catch (const os::Interrupted&) {
  }
  return exit_good;
}

constexpr std::array<Parameter, 17> serve_parameters{{
    {"encoders", "", "as for `absenc read`", "all of absenc.toml", false, true},
    {"--listen", "HOST:PORT", "where the page is; beyond this computer only with --token-file", "127.0.0.1:8420"},
    {"--rate", "HZ", "readings a second of each for which absenc.toml has no rate_hz; 0: as many as the line allows",
     "50"},
    {parameter::realtime.name, parameter::realtime.value,
     "read each encoder for which absenc.toml has no realtime in a real-time thread (SCHED_FIFO) of this priority, 1 "
     "to 99, with the memory of the program locked; an error if the kernel refuses"},
    {"--token-file", "FILE", "lines of NAME TOKEN: who may change encoders, and look from other computers"},
    {"--public-url", "URL",
     "where a proxy on this computer shows the page to others, as https://encoders.example: looking then needs a "
     "token"},
    {"--history", "FILE", "where the past is kept, in SQLite's format; none: nowhere",
     "history.sqlite in $STATE_DIRECTORY or ~/.local/state/absenc"},
    {"--history-days", "DAYS", "what is older is deleted", "30"},
    {"--history-mb", "MB", "beyond it the oldest is deleted", "1024"},
    {"--mqtt", "BROKER",
     "mqtt://HOST:PORT, or mqtts:// for TLS: readings, alarms and states go there; this and what "
     "follows are also settings of absenc.toml"},
    {"--mqtt-login-file", "FILE", "one line of USER PASSWORD, for its owner alone"},
    {"--mqtt-ca-file", "FILE", "certificates that the broker's must come from", "those that this computer trusts"},
    {"--mqtt-prefix", "TOPIC", "begins all topics", "absenc/ and the name of this computer"},
    {"--mqtt-spool", "FOLDER", "where messages wait until the broker has them",
     "mqtt-spool beside the history's usual place"},
    {"--mqtt-spool-mb", "MB", "beyond it the oldest messages are dropped, counted and told", "256"},
    {home_assistant, "", "tell Home Assistant by MQTT what there is"},
    {"--udp", "HOST:PORT", "every reading goes there as JSON, as PlotJuggler takes it"},
}};

constexpr std::array<Example, 4> serve_examples{{
    {"absenc serve", "all encoders of absenc.toml, at http://127.0.0.1:8420/"},
    {"absenc serve \"sim:tformat?motion=rpm=60\" \"sim:esl?motion=sine=90,0.2\" --history none",
     "try it without hardware"},
    {"absenc serve --listen 0.0.0.0:8420 --token-file /etc/absenc/tokens", "for other computers too"},
    {"absenc serve --mqtt mqtt://broker.example --home-assistant", "to a broker too"},
}};

}  // namespace

const Subcommand serve_subcommand{
    "serve",
    "show encoders to many: a live page, HTTP with JSON, history, Prometheus",
    "Runs until it is ended. An encoder that is unplugged is waited for; a value that is not live is never shown as\n"
    "one. Prints the address of the page. SIGHUP reads absenc.toml again: encoders that it describes as before are\n"
    "not disturbed. What changes an encoder needs a token, always.",
    serve_parameters,
    serve_examples,
    run_serve};

}  // namespace absenc::tool
