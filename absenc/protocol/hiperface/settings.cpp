// SPDX-License-Identifier: Apache-2.0
// The procedures of procedures.hpp that read and change the address and the baud rate of an encoder.
#include "absenc/protocol/hiperface/procedures.hpp"

namespace absenc::hiperface {

using namespace author;

Procedure read_address(Dialog& dialog, ProcedureResult& found) {
  const Request request{.command = CommandCode::type_label, .address = broadcast_address, .any_resolution = true};
  const Reply label = co_await dialog.ask(request).or_say("every encoder of the line was asked: is there only one?");
  found.new_address = label.address;
  co_return done;
}

Procedure read_baud(Dialog& dialog, ProcedureResult& found) {
  const Reply label = co_await dialog.ask(plain_request(dialog.format(), CommandCode::type_label));
  show_interface(found, label.label[0]);
  co_return done;
}

Procedure set_address(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const Request old_label = plain_request(dialog.format(), CommandCode::type_label);
  const Reply before = co_await dialog.ask(old_label).or_say("nothing was changed");
  found.new_address = byte(arguments[0]);
  found.written = before.address != *found.new_address;
  if (!*found.written) co_return done;
  const Request new_label{.command = CommandCode::type_label, .address = *found.new_address};
  const Result<Reply> other = co_await dialog.attempt(new_label).once();
  if (other.error() != Error::timeout) {
    co_return {Error::invalid_argument, "another encoder has this address, or the line is noisy; nothing was changed"};
  }
  const Request change{.command = CommandCode::set_address,
                       .address = before.address,
                       .subject = *found.new_address,
                       .code = dialog.format().code0};
  const Result<Reply> changed = co_await dialog.attempt(change).changes();
  if (changed.error() == Error::request_rejected) co_return {changed.error(), "the address stays as it was"};
  if (!changed) co_await dialog.rest(store_limit);
  const Result<Reply> now = co_await dialog.attempt(new_label);
  if (now) co_return done;
  const Result<Reply> still = co_await dialog.attempt({.command = CommandCode::type_label, .address = before.address});
  if (!still) co_return {now.error(), "it was sent, but the encoder answers neither at the old nor at the new address"};
  dialog.refused();
  co_return {Error::cross_check_failed, "the encoder still has its old address"};
}

namespace {

void use_rate(Dialog& dialog, std::uint8_t rate) {
  Format format = dialog.format();
  format.rate = rate;
  dialog.set_rate(rates[rate], Protocol::host_times(format));
}

// Switches the line to `rate`, and reads the type label at this rate. Returns whether the encoder reports the interface
// setting `setting`; if not, switches the line back to its old rate.
Part<bool> answers_at(Dialog& dialog, std::uint8_t rate, std::uint8_t setting) {
  const std::uint8_t old_rate = dialog.format().rate;
  use_rate(dialog, rate);
  const Result<Reply> label = co_await dialog.attempt(plain_request(dialog.format(), CommandCode::type_label));
  const bool is = label && label->label[0] == setting;
  if (!is) use_rate(dialog, old_rate);
  co_return is;
}

}  // namespace

Procedure set_baud(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const std::optional<std::uint8_t> rate = rate_index(arguments[0]);
  if (!rate) {
    co_return {Error::invalid_argument, "the rates are 600, 1200, 2400, 4800, 9600, 19200 and 38400"};
  }
  const Request ask_label = plain_request(dialog.format(), CommandCode::type_label);
  const Reply before = co_await dialog.ask(ask_label).or_say("nothing was changed");
  const auto setting = static_cast<std::uint8_t>((before.label[0] & ~rate_bits) | *rate);
  show_interface(found, setting);
  found.written = setting != before.label[0];
  if (!*found.written) co_return done;
  Request change = plain_request(dialog.format(), CommandCode::interface);
  change.subject = setting;
  change.code = dialog.format().code0;
  const Result<Reply> changed = co_await dialog.attempt(change).changes();
  if (changed.error() == Error::request_rejected) co_return {changed.error(), "the baud rate stays as it was"};
  if (!changed) co_await dialog.rest(store_limit);
  const bool at_once = co_await answers_at(dialog, *rate, setting);
  if (at_once) co_return done;
  // No source states when a new interface setting takes effect. If the encoder reports it but still answers at its old
  // rate, the host resets the encoder.
  const Result<Reply> still = co_await dialog.attempt(ask_label);
  if (!still) co_return {still.error(), "it was sent, but the encoder answers at neither baud rate"};
  if (still->label[0] != setting) {
    dialog.refused();
    co_return {Error::cross_check_failed, "the encoder still has its old baud rate"};
  }
  co_await dialog.ask(plain_request(dialog.format(), CommandCode::reset)).changes();
  co_await dialog.rest(2 * start_time);
  const bool after_reset = co_await answers_at(dialog, *rate, setting);
  if (after_reset) co_return done;
  co_return {Error::cross_check_failed, "the encoder stored the baud rate, but does not answer at it after a reset"};
}

}  // namespace absenc::hiperface
