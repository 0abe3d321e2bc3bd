// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/bug_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/files/zip_archive.hpp"
#include "absenc/capture/files/zip_writer.hpp"
#include "absenc/client/doctor/examine.hpp"
#include "absenc/client/port/diagnosis.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/serial_ports.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/reading_text.hpp"
#include "tools/absenc/version.hpp"

namespace absenc::tool {

namespace {

constexpr std::string_view report_title = "absenc report 1";
constexpr const char* about_file = "report.txt";
constexpr const char* doctor_file = "doctor.json";
constexpr const char* exchanges_file = "exchanges.txt";
constexpr std::string_view no_frame = "-";
constexpr std::string_view masked_frame = "masked";
constexpr std::size_t longest_part = 1 << 24;  // greatest size of a file in a report, in bytes

std::string wire_text(LinkKind link, const Frame& frame) {
  return frame.empty() ? std::string(no_frame) : to_compact_wire_text(link, frame);
}

// Returns the part of `text` before the first `separator`, and removes both from `text`.
std::string_view take_part(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view part = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return part;
}

std::string read_part(capture::ZipArchive& archive, const std::string& path, const char* name) {
  capture::ZipArchive::Entry entry;
  if (!archive.find(name, entry) || entry.size > longest_part || !archive.open(entry)) {
    throw Failure(
        fmt::format("{} is no whole report of absenc: {} in it is missing or damaged. Ask for it again", path, name));
  }
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(entry.size));
  if (archive.read(bytes) != bytes.size() || !archive.at_good_end()) {
    throw Failure(fmt::format("{} is damaged: {} in it, {}. Ask for it again", path, name, archive.problem()));
  }
  return {bytes.begin(), bytes.end()};
}

// Returns the properties of the adapter as text, with its serial number only if `serial_numbers` allows that.
std::string adapter_text(const EncoderAddress& address, ReportedExchanges::SerialNumbers serial_numbers) {
  if (address.port_kind != PortKind::serial) return "adapter: not a serial port\n";
  const os::ListedPort port = os::inspect_port(address.path);
  std::string text = fmt::format("driver: {}\n", port.driver.empty() ? "unknown" : port.driver);
  if (port.latency_timer) text += fmt::format("latency timer: {} ms\n", *port.latency_timer);
  if (port.highest_rate) text += fmt::format("greatest rate: {} bit/s\n", *port.highest_rate);
  if (serial_numbers == ReportedExchanges::SerialNumbers::shown && !port.lasting_path.empty()) {
    text += fmt::format("by its serial number: {}\n", port.lasting_path);
  }
  return text;
}

// Returns the part of the address that contains the serial number of an adapter: the name in /dev/serial/by-id, or the
// serial number of an FTDI chip; empty if there is none.
std::string_view adapter_name(const EncoderAddress& address) {
  constexpr std::string_view folder = "/dev/serial/by-id/";
  const std::string_view path = address.path;
  if (address.port_kind == PortKind::ftdi) return path.substr(0, path.find('/'));
  return path.starts_with(folder) ? path.substr(folder.size()) : std::string_view();
}

void mask(std::string& text, std::string_view secret) {
  if (secret.empty()) return;
  for (std::size_t at = text.find(secret); at != std::string::npos; at = text.find(secret, at + masked_frame.size())) {
    text.replace(at, secret.size(), masked_frame);
  }
}

}  // namespace

bool is_serial_number(std::string_view field) { return field.starts_with("serial"); }

void ReportedExchanges::add(const DoctorExchange& exchange) {
  if (first_ == Time{}) first_ = exchange.sent;
  bool masked = false;
  if (serial_numbers_ == SerialNumbers::masked && judge_.decode(exchange.request, exchange.reply) == Error::none) {
    masked = std::ranges::any_of(judge_.contents().fields,
                                 [](const FieldValue& field) { return is_serial_number(field.info->name); });
  }
  const std::string reply = masked ? std::string(masked_frame) : wire_text(unit_->link, exchange.reply);
  lines_.push_back({fmt::format("{:.6f} {} {} {:.1f}\n", static_cast<double>((exchange.sent - first_).count()) / 1e9,
                                wire_text(unit_->link, exchange.request), reply,
                                static_cast<double>(exchange.answered_after.count()) / 1e3),
                    masked});
  masked_ += masked ? 1 : 0;
  if (lines_.size() > most) {
    masked_ -= lines_.front().masked ? 1 : 0;
    lines_.pop_front();
  }
}

std::string ReportedExchanges::text() const {
  std::string text;
  for (const ReportedLine& line : lines_) text += line.text;
  return text;
}

BugReport make_report(const EncoderAddress& address, const Examination& examination, const ReportedExchanges& exchanges,
                      ReportedExchanges::SerialNumbers serial_numbers) {
  const Unit& unit = *address.unit;
  std::string summary = fmt::format("{}\n\n{}\n\nencoder: {}\ngiven as: {}\n", report_title, version_text(),
                                    address_of(address), address.written);
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    summary += fmt::format("  {} = {}\n", unit.options[i].name, to_text(unit.options[i], address.options[i]));
  }
  for (const std::string& setting : address.link_settings) summary += fmt::format("  {}\n", setting);
  summary += adapter_text(address, serial_numbers) + '\n';
  for (const Finding& one : examination.findings)
    summary += fmt::format("{}: {}\n", name_of(one.severity), one.sentence());
  summary += fmt::format("{}\n\n{} exchanges", examination.verdict(), exchanges.size());
  if (exchanges.masked() != 0)
    summary += fmt::format(", of which {} replies with a serial number are masked", exchanges.masked());
  std::string lines = fmt::format("protocol {}\n", unit.id);
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    lines += fmt::format("option {}={}\n", unit.options[i].name, to_text(unit.options[i], address.options[i]));
  }
  BugReport report{summary + '\n', to_json(examination).line() + '\n', lines + exchanges.text()};
  if (serial_numbers == ReportedExchanges::SerialNumbers::masked) {
    for (std::string* text : {&report.summary, &report.doctor}) mask(*text, adapter_name(address));
  }
  return report;
}

void write_report(const std::string& path, const BugReport& report) {
  try {
    capture::ZipWriter archive(os::path_of(path));
    archive.add(about_file, report.summary);
    archive.add(doctor_file, report.doctor);
    archive.add(exchanges_file, report.exchanges);
    archive.finish();
  } catch (const std::runtime_error& error) {
    throw Failure(error.what());
  }
}

bool is_report(const std::string& path) {
  try {
    const std::unique_ptr<capture::Source> source = capture::file_source(os::path_of(path));
    capture::ZipArchive::Entry entry;
    return capture::ZipArchive(*source).find(about_file, entry);
  } catch (const capture::OpenError&) {
    return false;
  }
}

int show_report(const std::string& path) {
  const std::unique_ptr<capture::Source> source = capture::file_source(os::path_of(path));
  capture::ZipArchive archive(*source);
  const std::string summary = read_part(archive, path, about_file);
  if (!summary.starts_with(fmt::format("{}\n", report_title))) {
    throw Failure(fmt::format("{} begins with \"{}\", but this absenc reads \"{}\": use a newer absenc", path,
                              summary.substr(0, summary.find('\n')), report_title));
  }
  print_line(summary);
  const std::string exchanges = read_part(archive, path, exchanges_file);
  std::string_view left = exchanges;
  std::string_view line = take_part(left, '\n');
  take_part(line, ' ');
  const Unit& unit = require_unit(line);
  std::vector<std::string> settings;
  while (left.starts_with("option ")) {
    line = take_part(left, '\n');
    take_part(line, ' ');
    settings.emplace_back(line);
  }
  const Options options = require_options(unit, {}, settings);
  capture::Judge judge(unit, options);
  while (!left.empty()) {
    line = take_part(left, '\n');
    const std::string_view time = take_part(line, ' ');
    const std::string_view request = take_part(line, ' ');
    const std::string_view reply = take_part(line, ' ');
    std::string said = fmt::format("{} s  {}  {}", time, request, reply);
    if (reply != masked_frame) {
      const WireFrame asked = request == no_frame ? WireFrame{} : parse_wire_text(unit.link, "a request", request);
      const WireFrame answered = reply == no_frame ? WireFrame{} : parse_wire_text(unit.link, "a reply", reply);
      const Error error = answered.frame().empty() ? Error::timeout : judge.decode(asked.frame(), answered.frame());
      const capture::Contents contents = judge.contents();
      if (error != Error::none) {
        said += fmt::format("  {}", text_of(error).name);
      } else if (contents.reading != nullptr) {
        said += fmt::format("  {}", reading_text(unit, *contents.reading, Doubt::none));
      }
      said += fmt::format("  after {} us", line);
    }
    print_line(said);
  }
  return exit_good;
}

}  // namespace absenc::tool
