// SPDX-License-Identifier: Apache-2.0
// Classes that present a reading and a sample to Python.
#pragma once

#include <algorithm>
#include <vector>

#include "absenc/client/reading.hpp"
#include "absenc/client/row.hpp"
#include "python/src/bind.hpp"

namespace absenc::python {

[[nodiscard]] inline double seconds(Time time) { return std::chrono::duration<double>(time).count(); }

struct PyReading {
  const Unit* unit;
  Reading reading;

  [[nodiscard]] bool is_valid() const { return reading.ready && reading.singleturn_valid(); }
  [[nodiscard]] py::object singleturn_valid() const {
    return to_python(client::value_of(reading.ready ? reading.singleturn_validity() : Validity::invalid));
  }
  [[nodiscard]] py::object multiturn_valid() const { return to_python(client::value_of(reading.multiturn_validity())); }
  [[nodiscard]] std::optional<double> angle_deg() const {
    if (!is_valid() || reading.unit_um > 0) return {};
    return degrees(reading.singleturn, reading.singleturn_bits);
  }
  [[nodiscard]] std::optional<double> position_mm() const {
    if (!is_valid() || reading.unit_um <= 0) return {};
    return micrometres(reading.singleturn, reading.unit_um) / 1000;
  }
  [[nodiscard]] std::optional<std::uint64_t> singleturn() const {
    if (!is_valid()) return {};
    return reading.singleturn;
  }
  [[nodiscard]] std::optional<std::int64_t> multiturn() const {
    if (!reading.ready || reading.multiturn_bits == 0 || !reading.multiturn_valid) return {};
    return reading.turns();
  }
  [[nodiscard]] py::object alarms() const { return names_or_none(client::alarms_of(*unit, reading)); }
  [[nodiscard]] py::object status() const { return names_or_none(client::status_of(*unit, reading)); }
  // Returns the names of the raised flags. Returns None if no flag is raised and not all flags are reported.
  [[nodiscard]] static py::object names_or_none(const std::vector<client::Flags>& channels) {
    const py::list names = names_of(channels);
    const bool is_complete = !channels.empty() && std::all_of(channels.begin(), channels.end(),
                                                              [](const auto& flags) { return flags.is_complete(); });
    return names.empty() && !is_complete ? py::object(py::none()) : py::object(names);
  }
  [[nodiscard]] py::str text() const {
    const auto position =
        is_valid() ? py::object(py::cast(reading.unit_um > 0 ? position_mm() : angle_deg())) : py::none();
    return py::str("Reading({}={}, multiturn={}, alarms={})")
        .format(reading.unit_um > 0 ? "position_mm" : "angle_deg", position, py::cast(multiturn()), alarms());
  }
};

struct PySample {
  const Unit* unit;
  client::Sample sample;

  [[nodiscard]] std::string_view kind() const {
    using Kind = client::Sample::Kind;
    switch (sample.kind) {
      case Kind::reading:
        return "reading";
      case Kind::failed:
        return "failed";
      case Kind::lost:
        return "lost";
      case Kind::back:
        return "back";
      case Kind::absent:
        break;
    }
    return "absent";
  }
  [[nodiscard]] std::optional<PyReading> reading() const {
    if (sample.kind != client::Sample::Kind::reading) return {};
    return PyReading{unit, sample.reading};
  }
  template <class T>
  [[nodiscard]] std::optional<T> when(bool valid, T value) const {
    return valid ? std::optional<T>(value) : std::nullopt;
  }
  [[nodiscard]] py::str repr() const {
    const py::object contents = sample.kind == client::Sample::Kind::reading
                                    ? py::object(PyReading{unit, sample.reading}.text())
                                    : py::object(py::str(sample.text()));
    return py::str("Sample({}, time_s={}, {})").format(kind(), seconds(sample.at), contents);
  }
  [[nodiscard]] py::object error() const {
    return sample.kind == client::Sample::Kind::failed ? error_object(sample.trouble) : py::none();
  }
};

}  // namespace absenc::python
