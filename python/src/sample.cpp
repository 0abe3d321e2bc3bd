// SPDX-License-Identifier: Apache-2.0
#include "python/src/sample.hpp"

namespace absenc::python {

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
          "rpm, of linear encoders mm/s, as it was `speed_delay_s` before `time_s`.")
      .def_property_readonly(
          "speed_delay_s",
          [](const PySample& one) { return one.when(one.sample.speed_valid, seconds(one.sample.speed_delay)); },
          "Seconds.")
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
      .def("__repr__", &PySample::repr);
}

}  // namespace absenc::python
