// SPDX-License-Identifier: Apache-2.0
#include "python/src/sample.hpp"

#include <type_traits>

#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::python {

namespace {

// Its times are apart: they are no numbers.
template <class Act>
void each_part(Reading& reading, const Act& act) {
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

// What `pickle` keeps: the name of the unit, then the parts.
py::tuple state_of(const PyReading& one) {
  py::list state;
  state.append(std::string(one.unit->id));
  Reading reading = one.reading;
  const auto keep = [&](auto value) { state.append(value); };
  each_part(reading, keep);
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
  each_part(one.reading, take);
  one.reading.latched = Time(py::cast<Time::rep>(state[next++]));
  one.reading.received = Time(py::cast<Time::rep>(state[next++]));
  if (next != state.size()) throw client::Failure("this reading was kept by another version of absenc");
  return one;
}

}  // namespace

void bind_sample(py::module_& module) {
  py::class_<PyReading>(module, "Reading", "One position as an encoder reported it.")
      .def_property_readonly("angle_deg", &PyReading::angle_deg,
                             "Degrees, 0 to below 360; None: it does not hold, or the encoder is linear.")
      .def_property_readonly("position_mm", &PyReading::position_mm,
                             "Of linear encoders, millimetres; None: it does not hold.")
      .def_property_readonly("singleturn", &PyReading::singleturn, "Counts; None: it does not hold.")
      .def_property_readonly("multiturn", &PyReading::multiturn, "Revolutions; None: not told, or they do not hold.")
      .def_property_readonly(
          "singleturn_bits", [](const PyReading& one) { return one.reading.singleturn_bits; },
          "0: the reply carries no position")
      .def_property_readonly(
          "singleturn_valid_bits", [](const PyReading& one) { return one.reading.singleturn_valid_bits; },
          "How many of the highest bits hold; some encoders give fewer while they turn fast.")
      .def_property_readonly(
          "multiturn_bits", [](const PyReading& one) { return one.reading.multiturn_bits; },
          "0: the reply carries no revolutions")
      .def_property_readonly(
          "ready", [](const PyReading& one) { return one.reading.ready; },
          "False while the encoder says that it is starting.")
      .def_property_readonly("valid", &PyReading::holds, "Whether the position is known to hold.")
      .def_property_readonly("singleturn_valid", &PyReading::singleturn_valid,
                             "Whether the position holds; None: nobody has reported it.")
      .def_property_readonly("multiturn_valid", &PyReading::multiturn_valid,
                             "Whether the revolutions hold; None: nobody has reported it, or there are none.")
      .def_property_readonly(
          "alarms", &PyReading::alarms,
          "The names of those that are raised; []: all are reported clear; None: not all are reported.")
      .def_property_readonly("status", &PyReading::status,
                             "The names of the status flags that are set; None: they are not reported.")
      .def_property_readonly(
          "time_s", [](const PyReading& one) { return seconds(one.reading.latched); },
          "When it was latched, seconds of time.monotonic().")
      .def(py::pickle(&state_of, &reading_of))
      .def("__repr__", &PyReading::text);
  py::class_<PySample>(module, "Sample", "What one attempt to read has brought.")
      .def_property_readonly(
          "kind", &PySample::kind,
          "\"reading\"; \"failed\": see `error`; \"lost\": the port has just gone away, \"absent\", \"back\".")
      .def_property_readonly(
          "time_s", [](const PySample& one) { return seconds(one.sample.at); },
          "Seconds of time.monotonic(); of a reading when it was latched.")
      .def_property_readonly("reading", &PySample::reading, "None when there is none: see `kind`.")
      .def_property_readonly(
          "position", [](const PySample& one) { return one.when(one.sample.position_valid, one.sample.position); },
          "Counts, continued past the end of the counter.")
      .def_property_readonly(
          "speed", [](const PySample& one) { return one.when(one.sample.speed_valid, one.sample.speed); },
          "rpm, of linear encoders mm/s: `speed_rpm` or `speed_mm_s`.")
      .def_property_readonly(
          "speed_rpm", [](const PySample& one) { return value_of(one.sample.speed_rpm()); },
          "The mean speed over a short window, as it was `speed_delay_s` before `time_s`; None: it is not known yet, "
          "or "
          "the encoder is linear.")
      .def_property_readonly(
          "speed_uncertainty_rpm", [](const PySample& one) { return uncertainty_of(one.sample.speed_rpm()); },
          "How far the true mean is from `speed_rpm` at most.")
      .def_property_readonly(
          "speed_mm_s", [](const PySample& one) { return value_of(one.sample.speed_mm_s()); },
          "The same of a linear encoder; None of a rotary one.")
      .def_property_readonly(
          "speed_uncertainty_mm_s", [](const PySample& one) { return uncertainty_of(one.sample.speed_mm_s()); },
          "How far the true mean is from `speed_mm_s` at most.")
      .def_property_readonly(
          "speed_delay_s",
          [](const PySample& one) { return one.when(one.sample.speed_valid, seconds(one.sample.speed_delay)); },
          "Seconds.")
      .def_property_readonly(
          "joint_deg", [](const PySample& one) { return one.sample.angles.joint_deg; },
          "Angle of the joint: direction * (degrees past the end of a turn - offset_deg) / gear; None: its address "
          "sets "
          "none of them, it does not hold, or the turns are not known.")
      .def_property_readonly(
          "joint_mm", [](const PySample& one) { return one.sample.angles.joint_mm; },
          "Of linear encoders: direction * (position - offset_mm).")
      .def_property_readonly(
          "joint_speed_rpm", [](const PySample& one) { return value_of(one.sample.angles.joint_speed_rpm); },
          "The speed at the joint.")
      .def_property_readonly(
          "joint_speed_uncertainty_rpm",
          [](const PySample& one) { return uncertainty_of(one.sample.angles.joint_speed_rpm); },
          "How far the true mean is from it at most.")
      .def_property_readonly(
          "joint_speed_mm_s", [](const PySample& one) { return value_of(one.sample.angles.joint_speed_mm_s); },
          "The same of a linear encoder.")
      .def_property_readonly(
          "joint_speed_uncertainty_mm_s",
          [](const PySample& one) { return uncertainty_of(one.sample.angles.joint_speed_mm_s); },
          "How far the true mean is from it at most.")
      .def_property_readonly(
          "electrical_deg", [](const PySample& one) { return one.sample.angles.electrical_deg; },
          "Electrical angle of the motor, 0 to below 360; None: no pole_pairs or pole_pair_mm, or it does not hold.")
      .def_property_readonly(
          "confirmed", [](const PySample& one) { return one.sample.confirmed; },
          "It was compared with another reading, and they agree within the speed limit.")
      .def_property_readonly(
          "restarted", [](const PySample& one) { return one.sample.restarted; },
          "It jumped, or how far it went since the reading before is not known: `position` starts again.")
      .def_property_readonly(
          "text", [](const PySample& one) { return one.sample.text(); },
          "Why there is no reading, or what happened; \"\" of a reading that goes on.")
      .def_property_readonly("error", &PySample::error, "The absenc.errors.EncoderError of a failed attempt, or None.")
      .def("__copy__", [](const PySample& one) { return one; })
      .def("__deepcopy__", [](const PySample& one, const py::dict&) { return one; })
      .def("__repr__", &PySample::repr);
}

}  // namespace absenc::python
