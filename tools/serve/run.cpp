// SPDX-License-Identifier: Apache-2.0
#include "tools/serve/run.hpp"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <span>

#include "absenc/os/hangup.hpp"
#include "absenc/os/process.hpp"
#include "absenc/os/realtime.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/serve/mqtt_process.hpp"
#include "absenc/serve/server.hpp"
#include "absenc/serve/state_file.hpp"
#include "tools/absenc/command_line.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/help.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/rate.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/verbs/serve.hpp"
#include "tools/absenc/version.hpp"

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
    print_message(fmt::format("absenc.toml was read again, but not all of it can be done: {}", failure.what()));
  } catch (const os::Failure& failure) {
    print_message(fmt::format("absenc.toml was read again, but not all of it can be done: {}", failure.what()));
  }
}

int run_serve(const Invocation& invocation) {
  os::limit_thread_stacks();
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
  print_message(fmt::format("{} encoder{}; Ctrl-C ends{}", server.encoders(), server.encoders() == 1 ? "" : "s",
                            hangups ? ", SIGHUP reads absenc.toml again" : ""));
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

}  // namespace

int run_server(std::span<char* const> words) {
  if (words.size() == 1 && std::string_view(words.front()) == "--version") {
    print_line(version_text());
    return exit_good;
  }
  if (words.empty() || words.front() != serve_subcommand.name) {
    throw UsageError("this is a part of absenc: run `absenc serve`");
  }
  if (words.size() == 2 && words[1] == serve::mqtt_process_word) return serve::run_mqtt_process();
  const std::optional<Invocation> invocation = parse_arguments(serve_subcommand, words.subspan(1));
  if (invocation) return run_serve(*invocation);
  print_line(help(serve_subcommand));
  return exit_good;
}

}  // namespace absenc::tool
