// SPDX-License-Identifier: Apache-2.0
#include "python/src/sample.hpp"

#include <type_traits>

#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::python {

namespace {

// Calls `act` for each member of a reading except the two times, whose type is different.
template <class Act>
void each_member(Reading& reading, const Act& act) {
  act(reading.singleturn);
  act(reading.multiturn);
  act(reading.singleturn_bits);
  act(reading.multiturn_bits);
  act(reading.singleturn_valid_bits);
  act(reading.multiturn_valid);
  act(reading.singleturn_known);
  act(reading.multiturn_known);
  act(reading.multiturn_signed);
  act(reading.unit_um);
  act(reading.ready);
  act(reading.status);
  act(reading.alarms);
  act(reading.status_reported);
  act(reading.alarms_reported);
}

// Returns the state of a reading for `pickle`: id of the unit, the members, and the two times.
py::tuple state_of(const PyReading& one) {
  py::list state;
  state.append(std::string(one.unit->id));
  Reading reading = one.reading;
  const auto append = [&](auto value) { state.append(value); };
  each_member(reading, append);
  state.append(reading.latched.count());
  state.append(reading.received.count());
  return py::tuple(state);
}

std::optional<double> value_of(const std::optional<client::Estimate>& measured) {
  return measured ? std::optional(measured->value) : std::nullopt;
}

std::optional<double> uncertainty_of(const std::optional<client::Estimate>& measured) {
  return measured ? std::optional(measured->uncertainty) : std::nullopt;
}

PyReading reading_of(const py::tuple& state) {
  PyReading one{&client::require_unit(py::cast<std::string>(state[0])), {}};
  std::size_t next = 1;
  const auto take = [&](auto& value) { value = py::cast<std::decay_t<decltype(value)>>(state[next++]); };
  each_member(one.reading, take);
  one.reading.latched = Time(py::cast<Time::rep>(state[next++]));
  one.reading.received = Time(py::cast<Time::rep>(state[next++]));
  if (next != state.size()) throw client::Failure("this reading was pickled by another version of absenc");
  return one;
}

}  // namespace

void bind_sample(py::module_& module) {
  py::class_<PyReading>(module, "Reading", "One position as an encoder reported it.")
      .def_property_readonly(
          "angle_deg", &PyReading::angle_deg,
          "Position in degrees, 0 to below 360; None: not known to be valid, or the encoder is linear.")
      .def_property_readonly(
          "position_mm", &PyReading::position_mm,
          "Position of a linear encoder in millimetres; None: not known to be valid, or the encoder is rotary.")
      .def_property_readonly("singleturn", &PyReading::singleturn,
                             "Single-turn position in counts; None: not known to be valid.")
      .def_property_readonly("multiturn", &PyReading::multiturn, "Revolutions; None: none, or not known to be valid.")
      .def_property_readonly(
          "singleturn_bits", [](const PyReading& one) { return one.reading.singleturn_bits; },
          "Bits of the single-turn position; 0: the reply has no position.")
      .def_property_readonly(
          "singleturn_valid_bits", [](const PyReading& one) { return one.reading.singleturn_valid_bits; },
          "Number of valid bits, from the highest; some encoders have fewer while they turn fast.")
      .def_property_readonly(
          "multiturn_bits", [](const PyReading& one) { return one.reading.multiturn_bits; },
          "Bits of the revolutions; 0: the reply has none.")
      .def_property_readonly(
          "ready", [](const PyReading& one) { return one.reading.ready; },
          "False while the encoder reports that it is starting.")
      .def_property_readonly("valid", &PyReading::is_valid, "Whether the position is known to be valid.")
      .def_property_readonly("singleturn_valid", &PyReading::singleturn_valid,
                             "Whether the position is valid; None: not reported.")
      .def_property_readonly("multiturn_valid", &PyReading::multiturn_valid,
                             "Whether the revolutions are valid; None: not reported, or the encoder has none.")
      .def_property_readonly(
          "alarms", &PyReading::alarms,
          "Names of the raised alarms; []: all are reported clear; None: none is raised, and not all are "
          "reported.")
      .def_property_readonly(
          "status", &PyReading::status,
          "Names of the status flags that are set; []: all are reported clear; None: none is set, and "
          "not all are reported.")
      .def_property_readonly(
          "time_s", [](const PyReading& one) { return seconds(one.reading.latched); },
          "Time at which the position was latched, in seconds of time.monotonic().")
      .def(py::pickle(&state_of, &reading_of))
      .def("__repr__", &PyReading::text);
  py::class_<PySample>(module, "Sample", "Result of one attempt to read.")
      .def_property_readonly("kind", &PySample::kind,
                             "Kind of sample: \"reading\"; \"failed\": see `error`; \"lost\": the port has just "
                             "disappeared; \"absent\"; \"back\".")
      .def_property_readonly(
          "time_s", [](const PySample& one) { return seconds(one.sample.at); },
          "Seconds of time.monotonic(); for a reading, when its position was latched.")
      .def_property_readonly("reading", &PySample::reading, "The reading, or None: see `kind`.")
      .def_property_readonly(
          "position", [](const PySample& one) { return one.when(one.sample.position_valid, one.sample.position); },
          "Position in counts, continued past the end of the counter.")
      .def_property_readonly(
          "speed", [](const PySample& one) { return one.when(one.sample.speed_valid, one.sample.speed); },
          "Speed in rpm, for linear encoders mm/s: `speed_rpm` or `speed_mm_s`.")
      .def_property_readonly(
          "speed_rpm", [](const PySample& one) { return value_of(one.sample.speed_rpm()); },
          "Mean speed over a short window, as it was `speed_delay_s` before `time_s`; None: not known yet, or the "
          "encoder "
          "is linear.")
      .def_property_readonly(
          "speed_uncertainty_rpm", [](const PySample& one) { return uncertainty_of(one.sample.speed_rpm()); },
          "Greatest difference of the true mean speed from `speed_rpm`.")
      .def_property_readonly(
          "speed_mm_s", [](const PySample& one) { return value_of(one.sample.speed_mm_s()); },
          "Like `speed_rpm`, for a linear encoder; None for a rotary one.")
      .def_property_readonly(
          "speed_uncertainty_mm_s", [](const PySample& one) { return uncertainty_of(one.sample.speed_mm_s()); },
          "Greatest difference of the true mean speed from `speed_mm_s`.")
      .def_property_readonly(
          "speed_delay_s",
          [](const PySample& one) { return one.when(one.sample.speed_valid, seconds(one.sample.speed_delay)); },
          "Seconds.")
      .def_property_readonly(
          "joint_deg", [](const PySample& one) { return one.sample.angles.joint_deg; },
          "Angle of the joint: direction * (continued degrees - offset_deg) / gear; None: none of these is set, the "
          "position is invalid, or the turns are unknown.")
      .def_property_readonly(
          "joint_mm", [](const PySample& one) { return one.sample.angles.joint_mm; },
          "Position of the joint of a linear encoder: direction * (position - offset_mm).")
      .def_property_readonly(
          "joint_speed_rpm", [](const PySample& one) { return value_of(one.sample.angles.joint_speed_rpm); },
          "Speed of the joint.")
      .def_property_readonly(
          "joint_speed_uncertainty_rpm",
          [](const PySample& one) { return uncertainty_of(one.sample.angles.joint_speed_rpm); },
          "Greatest difference of the true mean speed from the speed of the joint.")
      .def_property_readonly(
          "joint_speed_mm_s", [](const PySample& one) { return value_of(one.sample.angles.joint_speed_mm_s); },
          "Speed of the joint of a linear encoder.")
      .def_property_readonly(
          "joint_speed_uncertainty_mm_s",
          [](const PySample& one) { return uncertainty_of(one.sample.angles.joint_speed_mm_s); },
          "Greatest difference of the true mean speed from the speed of the joint.")
      .def_property_readonly(
          "electrical_deg", [](const PySample& one) { return one.sample.angles.electrical_deg; },
          "Electrical angle of the motor, 0 to below 360; None: invalid, or pole_pairs or pole_pair_mm is not set.")
      .def_property_readonly(
          "confirmed", [](const PySample& one) { return one.sample.confirmed; },
          "Whether the position agrees with that of another reading, within the speed limit.")
      .def_property_readonly(
          "restarted", [](const PySample& one) { return one.sample.restarted; },
          "The position jumped, or the travel since the last reading is unknown: `position` starts again.")
      .def_property_readonly(
          "text", [](const PySample& one) { return one.sample.text(); },
          "Why the sample has no reading, or why `position` starts again; \"\" otherwise.")
      .def_property_readonly("error", &PySample::error, "The absenc.errors.EncoderError of a failed attempt, or None.")
      .def("__copy__", [](const PySample& one) { return one; })
      .def("__deepcopy__", [](const PySample& one, const py::dict&) { return one; })
      .def("__repr__", &PySample::repr);
}

}  // namespace absenc::python
