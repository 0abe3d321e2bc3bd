// SPDX-License-Identifier: Apache-2.0
// The table of the verb `serve`, which the program of tools/serve runs, so that the command links no server.
#include <array>

#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/verbs/serve.hpp"

namespace absenc::tool {

namespace {

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
     "history.sqlite in $STATE_DIRECTORY or ~/.local/state/absenc; on Windows in %LOCALAPPDATA%\\absenc"},
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
    "one. Prints the address of the page. On Linux, SIGHUP reads absenc.toml again: encoders that it describes as\n"
    "before are not disturbed. What changes an encoder needs a token, always.",
    serve_parameters,
    serve_examples,
    nullptr,
    "absenc-serve",
    "absenc-serve"};

}  // namespace absenc::tool
