// SPDX-License-Identifier: Apache-2.0
// A report of doctor as one file, for the developers of absenc: versions, adapter, settings, findings, and the last
// exchanges.
#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/capture/annotate/judge.hpp"
#include "absenc/client/doctor.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/text/wire_text.hpp"

namespace absenc::tool {

using namespace client;

/// Returns whether the field holds a serial number, which identifies one encoder or interface: the name of such a field
/// begins with "serial".
[[nodiscard]] bool is_serial_number(std::string_view field);

/// The last exchanges of an examination, in which serial numbers are masked.
class ReportedExchanges {
 public:
  enum class SerialNumbers : std::uint8_t { masked, shown };

  ReportedExchanges(const Unit& unit, const Options& options, SerialNumbers serial_numbers)
      : unit_(&unit), judge_(unit, options), serial_numbers_(serial_numbers) {}

  void add(const DoctorExchange& exchange);
  /// Returns a line for each exchange: end of the request in seconds since the first exchange, request, reply, and time
  /// from the request to the reply in microseconds.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] std::size_t size() const { return lines_.size(); }
  [[nodiscard]] std::size_t masked() const { return masked_; }

 private:
  static constexpr std::size_t most = 1000;

  const Unit* unit_;
  capture::Judge judge_;
  SerialNumbers serial_numbers_;
  Time first_{};
  std::size_t masked_ = 0;  // number of masked replies among the lines
  struct ReportedLine {
    std::string text;
    bool masked = false;
  };
  std::deque<ReportedLine> lines_;
};

struct BugReport {
  std::string summary;    // versions, adapter, settings and findings, as text for people
  std::string doctor;     // the result of doctor as JSON
  std::string exchanges;  // lines of ReportedExchanges, after lines with protocol and options
};

/// Makes the report of an examination. Serial numbers of adapters are masked, too, unless `serial_numbers` shows them.
[[nodiscard]] BugReport make_report(const EncoderAddress& address, const Examination& examination,
                                    const ReportedExchanges& exchanges,
                                    ReportedExchanges::SerialNumbers serial_numbers);

/// Writes the report as a zip archive. Throws Failure.
void write_report(const std::string& path, const BugReport& report);

/// Returns whether the file is a report, by its content.
[[nodiscard]] bool is_report(const std::string& path);
/// Prints a report: its text, and each exchange decoded. Returns the exit status. Throws Failure.
int show_report(const std::string& path);

}  // namespace absenc::tool
