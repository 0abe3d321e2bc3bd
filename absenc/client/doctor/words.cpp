// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/doctor/words.hpp"

#include <fmt/args.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>

#include "absenc/client/text/unit_text.hpp"

namespace absenc::client {

namespace {

struct Words {
  FindingKind finding_kind;
  std::string_view id;
  Severity severity;
  std::string_view evidence;
  std::string_view cause;
  std::string_view action;
};

using enum Severity;

// In the texts of `table`, {0}, {1} ... are replaced by the values that the judge passes to `finding`.
constexpr auto table = std::to_array<Words>({
    // In findings about a port or bus, a text of "{0}" alone is the operating system's error message with its advice.
    {FindingKind::port_missing, "port_missing", fault, "{0}",
     "the adapter is not plugged in, or the name is another one",
     "plug it in, or correct the name; `absenc ports` lists the adapters"},
    {FindingKind::port_forbidden, "port_forbidden", fault, "{0}", "this user may not use the port",
     "get access to the port as the error says, or start absenc as a user who has it"},
    {FindingKind::port_in_use, "port_in_use", fault, "{0}",
     "another program has it open, and both would take each other's bytes", "{1}"},
    {FindingKind::port_unsuitable, "port_unsuitable", fault, "{0}", "the encoder cannot be connected to such a port",
     "name the port of the adapter; `absenc ports` lists them"},
    {FindingKind::port_is_modem, "port_is_modem", fault, "the driver of {0} is {1}, the driver of mobile modems",
     "this is the port of a modem, not of the adapter", "name the port of the adapter: `absenc ports`"},
    {FindingKind::port_rate, "port_rate", fault, "{0}", "the adapter's clock has no divisor near this baud rate",
     "use an adapter that reaches the rate"},
    {FindingKind::port_lost, "port_lost", fault, "{0}", "the cable or the supply of the adapter has a loose contact",
     "plug it in again, at another port of the computer and without a hub between"},
    {FindingKind::port_failed, "port_failed", fault, "{0}", "the system refused to open or use it",
     "do what its message says"},
    {FindingKind::latency_timer, "latency_timer", warning, "the latency timer of {0} is {1} ms",
     "the USB adapter delays received bytes by this time, which limits the readings per second", "shorten it: {2}"},
    {FindingKind::direction_unswitched, "direction_unswitched", fault,
     "nothing came back, and {0} is a UART of the computer (driver {1}) whose kernel switches no direction",
     "the RS-485 transceiver is never switched to sending, or never back to receiving",
     "let RTS switch it by the driver (rs485=on) or by absenc (rs485=rts), or use an adapter that switches by itself"},

    {FindingKind::can_bus_off, "can_bus_off", fault, "{0}", "the controller's own frames were destroyed repeatedly",
     "check the bit rate, CANH and CANL and 120 ohms at both ends, then bring the interface up again"},
    {FindingKind::can_not_acknowledged, "can_not_acknowledged", fault, "{0}",
     "no other node on the bus receives at this bit rate",
     "check the encoder's supply, CANH and CANL, 120 ohms at both ends, and the bit rate"},
    {FindingKind::can_errors, "can_errors", fault,
     "{0} frames were destroyed or refused on the bus while {1} readings were tried, {2} with success",
     "no node acknowledges, or nodes have different bit rates",
     "check the encoder's supply, CANH and CANL, 120 ohms at both ends, and the bit rate"},

    {FindingKind::never_silent, "never_silent", fault,
     "{0} bytes arrived in {1} while nothing was requested, {3}, such as {2}",
     "another host or an encoder that sends by itself uses the line, so that its frames may pass for replies; or the "
     "line is open and picks up noise",
     "disconnect other senders; set the mode in which the encoder sends by itself; bias the idle line"},
    {FindingKind::line_inverted, "line_inverted", fault, "the idle line is low: {0}",
     "A and B (or the two wires of a pair) are exchanged, so that every level is inverted",
     "exchange A and B at one end: makers disagree on the names"},
    {FindingKind::wrong_baud, "wrong_baud", fault, "{4} with {0}, but {2} of {3} with {1}",
     "the encoder has another rate than the given one", "set {1}"},
    {FindingKind::wrong_spi_mode, "wrong_spi_mode", fault, "{4} with {0}, but {2} of {3} with {1}",
     "bits are sampled at the wrong edge of the clock", "set {1}"},
    {FindingKind::clock_too_fast, "clock_too_fast", fault, "{4} with {0}, but {2} of {3} with {1}",
     "the cable or the encoder is too slow for this clock", "set {1}, or shorten the cable"},
    {FindingKind::miso_stuck, "miso_stuck", fault, "in {0} transfers every bit from the encoder was {1}",
     "no encoder drives the data line: no supply, not selected, a broken or shorted wire",
     "check the supply, MISO (of clocked encoders DATA), the chip select and which wires are a pair"},
    {FindingKind::transceiver_missing, "transceiver_missing", fault,
     "in {0} transfers every bit from the encoder was {1}, and the data pin keeps whatever level the chip leaves on it",
     "nothing drives the data pin ADBUS2: no transceiver, no supply of the transceiver, its receiver switched off, or "
     "a "
     "broken wire",
     "check the transceiver's supply, the wire from its output RO to ADBUS2 and its enable inputs "
     "(docs/clock-cable.md)"},
    {FindingKind::data_at_rest, "data_at_rest", warning,
     "in {0} transfers every bit from the encoder was {1}, as on a line at rest",
     "no encoder drives the data line, the clock does not reach it, or the shaft rests at its last position: the "
     "replies "
     "have no checksum that tells",
     "turn the shaft and run doctor again; if every bit stays the same, check supply and the pairs of clock and data"},
    {FindingKind::clock_range, "clock_range", note, "readings were good with clocks of {0} to {1} Hz{2}", "{3}", "{4}"},
    {FindingKind::wrong_echo, "wrong_echo", fault, "{4} with {0}, but {2} of {3} with {1}",
     "the adapter's echo is not as given", "set {1}"},
    {FindingKind::wrong_address, "wrong_address", fault, "{4} with {0}, but {2} of {3} with {1}",
     "the encoder has another address than the given one", "set {1}"},
    {FindingKind::other_protocol, "other_protocol", fault, "{4} of {0}, but {2} of {3} of {1}",
     "the encoder speaks another protocol", "`absenc read \"{5}\"`"},
    {FindingKind::only_echo, "only_echo", fault, "{0} times only the request itself came back: {1}",
     "the adapter receives its own request, but no encoder replies",
     "check the encoder's supply and ground, exchange A and B, and check address and baud rate"},
    {FindingKind::modem_answers, "modem_answers", fault, "the received bytes are text: {0}",
     "this port leads to a modem, a console, a GPS receiver or another device that sends text, not to an encoder",
     "name the port of the adapter: `absenc ports`"},
    {FindingKind::no_answer, "no_answer", fault, "nothing came back to {0} requests{1}",
     "no supply, exchanged wires, another address or rate, or an adapter that does not send",
     "check the encoder's supply and ground, A and B (or TX and RX), the address and the rate; `absenc identify` tries "
     "every protocol"},
    {FindingKind::baud_pattern, "baud_pattern", fault, "the received bytes look like bits at another rate: {0}",
     "the sender is many times slower or faster than the rate of the port",
     "set the rate of the encoder with baud=RATE"},

    {FindingKind::byte_before, "byte_before", fault,
     "{0} of {1} replies are good without the {2} before each of them, such as {3}",
     "the adapter switches its direction too late, or receives while it still sends",
     "use an adapter that switches its direction by itself, or rs485=on; bias the idle line"},
    {FindingKind::byte_after, "byte_after", fault,
     "{0} of {1} replies are good ones with {2} after each of them, such as {3}",
     "the encoder's driver or the adapter switches off too late, and the idle line is not biased",
     "bias the idle line, 120 ohms at both ends, and use an adapter that switches its direction by itself"},
    {FindingKind::flow_control, "flow_control", fault,
     "no reply has a byte 11 or 13, and {0} of {1} are good with {2} put back, such as {3}",
     "software flow control (XON/XOFF) of an adapter or driver removes these bytes from the replies",
     "switch it off in the adapter, the device server or its driver"},
    {FindingKind::newline_translated, "newline_translated", fault,
     "before each byte 0A stands a 0D, and {0} of {1} replies are good without these, such as {3}",
     "a program or device server between computer and encoder treats bytes as text and turns LF into CR LF",
     "set it to raw bytes: a device server's text or console mode, socat's crnl, a terminal's onlcr"},
    {FindingKind::telnet_doubled, "telnet_doubled", fault,
     "each byte FF comes twice, and {0} of {1} replies are good with one of each two, such as {3}",
     "the device server speaks telnet, which doubles FF",
     "set the server's port to raw TCP instead of telnet or RFC 2217"},
    {FindingKind::seven_bits, "seven_bits", fault,
     "no reply has a byte above 7F, and {0} of {1} are good with the 8th bit of {2} set, such as {3}",
     "the port or the device server is set to 7 data bits, or removes the 8th bit",
     "set 8 data bits at the port and at the device server"},
    {FindingKind::nul_lost, "nul_lost", fault,
     "no reply has a byte 00, and {0} of {1} are good with {2} put back, such as {3}",
     "a driver or program between computer and encoder drops bytes 00, as those for text do",
     "set it to raw bytes, or use another adapter or driver"},
    {FindingKind::two_answer, "two_answer", fault, "{0} of {1} replies held more than one frame, such as {2}",
     "two encoders reply one after the other", "give each an address of its own, or disconnect one"},
    {FindingKind::extra_bytes, "extra_bytes", warning,
     "{0} of {1} replies are good frames with other bytes before or after them, such as {2}",
     "the adapter switches its direction too late, the idle line has noise, or a reply arrives twice",
     "bias the idle line, use an adapter that switches its direction by itself, and disconnect other senders"},
    {FindingKind::bytes_missing, "bytes_missing", warning,
     "{0} of {1} replies end before the frame is whole, such as {2}",
     "bytes are lost: by an adapter that switches its direction, or by a driver that takes some for control "
     "characters",
     "try another adapter or driver, without flow control and with its direction switched by itself"},
    {FindingKind::same_address, "same_address", fault,
     "every reply is damaged, and so is every reply from {0} in a scan",
     "two encoders have one address and send at the same time",
     "disconnect one and give the other an address of its own"},
    {FindingKind::wrong_settings, "wrong_settings", fault, "{4} with {0}, but {2} of {3} with {1}",
     "the encoder is another model, or has other settings", "set {1}"},
    {FindingKind::other_checksum, "other_checksum", fault, "the checksum of {0} replies is wrong, but {1} explains all",
     "the encoder uses a variant of the protocol",
     "look for the document of this variant; `absenc crc find` describes its checksum"},
    {FindingKind::contradictory, "contradictory", fault,
     "{0} of {1} replies are whole, but contradict themselves or their request ({2}){3}",
     "the encoder is faulty: its channels disagree, or it repeats an old reply", "{4}"},
    {FindingKind::always_damaged, "always_damaged", fault, "none of {0} replies is good: {1}, such as {2}",
     "a line that damages every reply, another protocol, model or rate, or two encoders that reply at once",
     "check protocol, model and rate; `absenc identify` tries every protocol; check termination and wiring"},
    {FindingKind::damaged_bits, "damaged_bits", warning, "{0} of {1} replies are damaged ({2}): single bits, {3}",
     "reflections or noise on the edges of the signal",
     "120 ohms at both ends of the line and nowhere else, twisted and shielded pairs, a common ground"},
    {FindingKind::damaged_bursts, "damaged_bursts", warning,
     "{0} of {1} replies are damaged ({2}): many bits at once, {3}",
     "something nearby that switches, such as a motor's bridge, a loose contact, or lost bytes",
     "keep the cable away from the motor's, ground its shield, check the plugs"},
    {FindingKind::sometimes_damaged, "sometimes_damaged", warning, "{0} of {1} replies are damaged ({2})",
     "noise, reflections or a loose contact",
     "check termination, shielding and plugs; run doctor again at standstill to see which bits"},
    {FindingKind::sometimes_silent, "sometimes_silent", warning, "{0} of {1} {2}",
     "some requests do not arrive, or a contact is loose",
     "check plugs, supply and termination; a busy computer needs latency=MS behind the encoder"},
    {FindingKind::comes_and_goes, "comes_and_goes", warning, "{0} of {1} readings failed, in {2} bursts{3}",
     "a loose contact, or something nearby that is switched on and off",
     "move cable and plugs while `absenc monitor` runs; find the cause with this period"},
    {FindingKind::requests_damaged, "requests_damaged", warning, "{0} of {1} requests were refused: {2}",
     "the request is damaged between computer and encoder",
     "check termination, shielding and plugs, and that no other device sends on the line"},
    {FindingKind::refused, "refused", fault, "the encoder refuses to be read: {0}", "its state does not allow it",
     "{1}"},

    {FindingKind::counter_stands, "counter_stands", fault, "the counter {0} was {1} in all of {2} replies",
     "the encoder repeats an old reply",
     "switch it off and on; if the counter still does not change, replace the encoder; do not use its position"},

    {FindingKind::reply_late, "reply_late", fault,
     "{0} of {1} replies arrived after their timeout, up to {2} after the request",
     "something delays replies: a network, a latency timer, a busy computer",
     "allow this delay with latency={3} behind the encoder, or find its cause"},
    {FindingKind::sometimes_late, "sometimes_late", warning,
     "{0} of {1} replies arrived after their timeout, up to {2} after the request",
     "something delays single replies: a busy computer, a network, or the encoder itself",
     "allow this delay with latency={3} behind the encoder, or find its cause"},
    {FindingKind::reply_slow, "reply_slow", note,
     "even the fastest replies take {0} more than the {1} that the protocol allows",
     "something between computer and line delays them: a network, a hub, the latency timer of an adapter",
     "for more readings per second connect the adapter directly"},

    {FindingKind::starting, "starting", warning, "{0}",
     "it was switched on just now, or its supply is too weak to come up", "wait, then look again; measure the supply"},
    // In the findings `alarm` and `status`, {1} is the meaning from the encoder's document, and {2} the action, if the
    // document states one.
    {FindingKind::alarm, "alarm", warning, "the encoder reports {0}", "{1}", "{2}"},
    {FindingKind::status, "status", warning, "the status of the encoder has {0}", "{1}", "{2}"},
    {FindingKind::position_invalid, "position_invalid", fault,
     "in {0} of {1} readings the encoder reports that its {2} is invalid{3}",
     "a fault for which the encoder has no alarm",
     "do not use the position; switch the encoder off and on, and run doctor again"},

    {FindingKind::position_noise, "position_noise", warning, "at standstill the position varies by {0} counts ({1})",
     "the magnet or scale is too far or off centre, or the supply is noisy",
     "check air gap and centring, the supply at the encoder, and that nothing vibrates"},
    {FindingKind::position_jumps, "position_jumps", fault, "{0}",
     "a damaged track or magnet, or a fault of the encoder", "turn it slowly past this position; replace the encoder"},
    {FindingKind::position_frozen, "position_frozen", fault,
     "the position stayed within {0} counts in {1} readings over {2}, in which the shaft should have turned",
     "the shaft was not turned, its coupling or magnet is loose, or the encoder repeats one position",
     "turn the shaft by more than a degree; check coupling, magnet and gap"},
    {FindingKind::turns_stand, "turns_stand", fault,
     "the number of turns stayed at {0} while the position passed zero {1} times",
     "turns are not counted: a single-turn encoder, no battery, a counter that is switched off, or a fault of the "
     "encoder",
     "select its model if it is a single-turn encoder; otherwise check battery and alarms, and reset the turns with "
     "the protocol's command (`absenc run`)"},
    {FindingKind::turns_jump, "turns_jump", fault,
     "{0} times turns and position together moved further than a shaft can turn, by up to {1}, though the position "
     "within the turn did not",
     "turns are counted wrongly: backwards, away from zero of the position, or at random",
     "check battery and alarms; reset the turns with the protocol's command (`absenc run`); do not use turns that "
     "jump"},
    {FindingKind::stuck_bits, "stuck_bits", fault, "{0} of the position never changed while it moved {1} counts",
     "the resolution is another one, or codes are missing", "check the resolution of the model; replace the encoder"},

    {FindingKind::few_readings, "few_readings", warning, "only {0} in {1}, too few to call it good",
     "each reading takes long: the encoder is slow, or absenc waits for the latency that it assumes for the way to it",
     "take at least 10, as with --for 30; if the latency of the way is known, set latency=MS behind the encoder"},
});

/// Texts of a finding for one kind of port, which replace the texts in `table`; "": the text of `table` stays.
struct Elsewhere {
  FindingKind finding_kind;
  PortKind place;
  std::string_view cause;
  std::string_view action;
};
constexpr auto elsewhere = std::to_array<Elsewhere>({
    {FindingKind::port_missing, PortKind::tcp, "the device server is off, or its host or port is another one",
     "check the server's supply and cable, host and port"},
    {FindingKind::port_missing, PortKind::can, "the interface is not there, or its name is another one",
     "correct the name; `ip link` lists the interfaces"},
    {FindingKind::port_missing, PortKind::spi, "the kernel has no such SPI device, or its name is another one",
     "correct the name; `ls /dev/spidev*` lists the devices"},
    {FindingKind::port_unsuitable, PortKind::tcp, "", "name host and port of the device server's serial side"},
    {FindingKind::port_unsuitable, PortKind::can, "", "name a CAN interface; `ip link` lists them"},
    {FindingKind::port_unsuitable, PortKind::spi, "", "name an SPI device; `ls /dev/spidev*` lists them"},
    {FindingKind::port_forbidden, PortKind::spi, "the user is not in the group that owns the device",
     "join the group that `ls -l /dev/spidev*` shows, and log in again"},
    {FindingKind::port_missing, PortKind::ftdi, "the chip is not plugged in, or its serial number is another one",
     "plug it in, or correct the serial number; `absenc ports` lists the chips"},
    {FindingKind::port_unsuitable, PortKind::ftdi, "", "name a chip with an MPSSE; `absenc ports` lists them"},
    {FindingKind::port_forbidden, PortKind::ftdi, "no udev rule lets users open the chip",
     "install the rule of the package absenc (docs/clock-cable.md), and plug the chip in again"},
    {FindingKind::port_lost, PortKind::ftdi, "", "check the USB cable"},
    {FindingKind::wrong_spi_mode, PortKind::ftdi, "the two wires of the clock pair are exchanged", ""},
    {FindingKind::reply_late, PortKind::ftdi, "this computer or its USB is busy", "reduce the load of the computer"},
    {FindingKind::sometimes_late, PortKind::ftdi, "this computer or its USB is busy",
     "reduce the load of the computer"},
    {FindingKind::reply_slow, PortKind::ftdi, "this computer or its USB is busy", "reduce the load of the computer"},
    {FindingKind::modem_answers, PortKind::ftdi, "another device than an encoder is behind this chip",
     "name the chip of the encoder; `absenc ports` lists them"},
    {FindingKind::sometimes_silent, PortKind::ftdi, "", "check plugs, supply and wires"},
    {FindingKind::port_lost, PortKind::tcp, "the network or the device server ended the connection",
     "check cable and supply of the server, and whether another client took its port"},
    {FindingKind::port_lost, PortKind::can, "the interface was taken down, or its adapter was unplugged",
     "bring it up again: `ip link` shows its state"},
    {FindingKind::modem_answers, PortKind::tcp, "", "name host and port of the device server's serial side"},
    {FindingKind::no_answer, PortKind::tcp,
     "no supply, exchanged wires, another address, or another rate of the device server",
     "check the encoder's supply and ground, A and B, its address, and the rate of the device server's serial side; "
     "`absenc identify` tries every protocol"},
    {FindingKind::no_answer, PortKind::can,
     "no supply, exchanged wires, another number of the node or another bit rate",
     "check the encoder's supply, CANH and CANL, 120 ohms at both ends, the number of the node and the bit rate"},
    {FindingKind::no_answer, PortKind::slcan,
     "no supply, exchanged wires, another number of the node or another bit rate",
     "check the encoder's supply, CANH and CANL, 120 ohms at both ends, the number of the node and the bit rate"},
    {FindingKind::no_answer, PortKind::sim, "the virtual encoder has such a fault", "leave the fault out"},
    {FindingKind::baud_pattern, PortKind::tcp, "the device server's serial side has another rate than the encoder",
     "set the rate of the device server's serial side"},
    {FindingKind::byte_before, PortKind::tcp, "the device server switches its direction too late",
     "use a device server that switches its direction in time; bias the idle line"},
    {FindingKind::reply_late, PortKind::tcp,
     "the network or the device server delays replies; the server may wait for more bytes before it sends them", ""},
    {FindingKind::reply_late, PortKind::can, "a busy bus, the adapter or a busy computer delays replies", ""},
    {FindingKind::reply_late, PortKind::sim, "the virtual encoder has such a fault, or this computer is busy",
     "leave the fault out, or reduce the load of the computer"},
    {FindingKind::sometimes_late, PortKind::tcp,
     "the network, the device server or a busy computer delays single replies", ""},
    {FindingKind::sometimes_late, PortKind::sim, "the virtual encoder has such a fault, or this computer is busy",
     "leave the fault out, or reduce the load of the computer"},
    {FindingKind::reply_slow, PortKind::tcp,
     "the network or the device server delays them; the server may wait for more bytes before it sends them",
     "for more readings per second shorten the time for which the server waits, or use a serial port of the computer"},
    {FindingKind::reply_slow, PortKind::can, "the bus, the adapter or the computer is busy",
     "check what else is on the bus"},
    {FindingKind::reply_slow, PortKind::sim, "the virtual encoder has such a fault, or this computer is busy",
     "leave the fault out, or reduce the load of the computer"},
    {FindingKind::reply_late, PortKind::spi, "this computer is busy", "reduce the load of the computer"},
    {FindingKind::sometimes_late, PortKind::spi, "this computer is busy", "reduce the load of the computer"},
    {FindingKind::sometimes_late, PortKind::can, "a busy bus, the adapter or a busy computer delays single replies",
     ""},
    {FindingKind::reply_slow, PortKind::spi, "this computer is busy", "reduce the load of the computer"},
    {FindingKind::modem_answers, PortKind::spi, "another device than an encoder is behind this controller",
     "name the SPI device of the encoder; `ls /dev/spidev*` lists them"},
    {FindingKind::modem_answers, PortKind::can, "another device than an encoder is on this bus",
     "name another interface"},
    {FindingKind::sometimes_silent, PortKind::spi, "", "check plugs, supply and wires"},
    {FindingKind::few_readings, PortKind::spi, "the encoder needs long for each reading",
     "take at least 10, as with --for 30"},
    {FindingKind::few_readings, PortKind::ftdi, "the encoder needs long for each reading",
     "take at least 10, as with --for 30"},
    {FindingKind::few_readings, PortKind::sim, "the encoder needs long for each reading, or this computer is busy",
     "take at least 10, as with --for 30"},
    {FindingKind::sometimes_silent, PortKind::sim, "the virtual encoder has such a fault, or this computer is busy",
     "leave the fault out, or reduce the load of the computer"},
});

constexpr bool is_in_order() {
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table[i].finding_kind != static_cast<FindingKind>(i)) return false;
  }
  return true;
}
static_assert(is_in_order() && table.size() == static_cast<std::size_t>(FindingKind::few_readings) + 1);

const Words& words_of(FindingKind finding_kind) { return table[static_cast<std::size_t>(finding_kind)]; }

// Returns the text in which {0}, {1} ... are replaced by these values.
std::string filled(std::string_view text, const std::vector<std::string>& values) {
  fmt::dynamic_format_arg_store<fmt::format_context> arguments;
  for (const std::string& value : values) arguments.push_back(value);
  return fmt::vformat(text, arguments);
}

}  // namespace

std::string_view id_of(FindingKind finding_kind) { return words_of(finding_kind).id; }

std::string_view name_of(Severity severity) {
  constexpr std::array<std::string_view, 3> names{"note", "warning", "fault"};
  return names[static_cast<std::size_t>(severity)];
}

Finding finding(FindingKind finding_kind, const std::vector<std::string>& values) {
  const Words& words = words_of(finding_kind);
  return {finding_kind,
          words.id,
          words.severity,
          filled(words.evidence, values),
          filled(words.cause, values),
          filled(words.action, values)};
}

void suit(Finding& finding, PortKind place) {
  for (const Elsewhere& one : elsewhere) {
    if (one.finding_kind != finding.finding_kind || one.place != place) continue;
    if (!one.cause.empty()) finding.cause = one.cause;
    if (!one.action.empty()) finding.action = one.action;
  }
}

std::string Finding::sentence() const {
  return fmt::format("{}: {}. Likely: {}. Try: {}", id, evidence, cause, action);
}

const Finding* Examination::first() const {
  const auto worst = std::max_element(findings.begin(), findings.end(), [](const Finding& one, const Finding& other) {
    return one.severity < other.severity;
  });
  return worst == findings.end() || worst->severity == note ? nullptr : &*worst;
}

bool Examination::healthy() const { return complete && first() == nullptr; }

std::string Examination::verdict() const {
  if (const Finding* one = first()) return fmt::format("first: {}: {}", one->id, one->action);
  if (!complete) return "interrupted: nothing was found until then";
  std::string evidence = fmt::format("good: {} of {} readings in {:.3g} s", good, tried,
                                     std::chrono::duration<double>(measured.time).count());
  if (measured.rate > 0) evidence += fmt::format(", {:.{}f} a second", measured.rate, measured.rate < 100 ? 1 : 0);
  if (good < tried) {
    evidence += fmt::format(" ({} failed", tried - good);
    if (measured.computer_late > Time{}) {
      evidence += fmt::format("; this computer itself was up to {} late", to_text(measured.computer_late));
    }
    evidence += ")";
  }
  evidence += fmt::format(" (95 %: less than {:.2g} % fail)", 100 * measured.failures);
  const bool no_alarm = good != 0 && reported.alarms == good;
  if (reported.valid == good) {
    evidence += fmt::format(", each with a valid position{}", no_alarm ? " and no alarm" : "");
  } else {
    if (no_alarm) evidence += ", each without an alarm";
    if (reported.valid != 0) evidence += fmt::format(", {} with a valid position", reported.valid);
    evidence += fmt::format("; whether the {}positions are valid is not reported", reported.valid != 0 ? "other " : "");
  }
  if (!reported.missing.empty()) evidence += fmt::format("; not reported: {}", reported.missing);
  if (measured.slowest > Time{}) {
    const auto ms = [](Time time) { return std::chrono::duration<double, std::milli>(time).count(); };
    evidence += fmt::format("; replies took {:.3f} to {:.3f} ms", ms(measured.quickest), ms(measured.slowest));
    if (good == tried && measured.computer_late >= std::chrono::milliseconds(1)) {
      evidence += fmt::format(", and this computer itself was up to {} late", to_text(measured.computer_late));
    }
  }
  if (!measured.echo.empty()) evidence += fmt::format("; {}", measured.echo);
  if (measured.latency) evidence += fmt::format("; latency of the port up to {}", to_text(*measured.latency));
  if (!not_looked_at.empty()) evidence += fmt::format("; not looked at: {}", fmt::join(not_looked_at, ", "));
  return evidence;
}

}  // namespace absenc::client
