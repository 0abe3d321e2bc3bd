// SPDX-License-Identifier: Apache-2.0
// Binds virtual encoders to Python.
#include "absenc/client/emulate.hpp"

#include "python/src/bind.hpp"

namespace absenc::python {

void bind_emulation(py::module_& module) {
  using client::Emulation;
  using Released = py::call_guard<py::gil_scoped_release>;
  py::class_<Emulation>(module, "Emulation")
      .def(py::init([](const std::string& text, const std::string& link, std::optional<std::uint16_t> tcp) {
             return std::make_unique<Emulation>(text, client::EmulateChoices{.link = link, .tcp = tcp});
           }),
           Released())
      .def_property_readonly("path", &Emulation::path)
      .def_property_readonly("tcp_port", &Emulation::tcp_port)
      .def_property_readonly("address", &Emulation::address)
      .def_property_readonly("unit", [](const Emulation& one) { return std::string(one.unit().id); })
      .def("power_off", &Emulation::power_off, Released())
      .def("power_on", &Emulation::power_on, Released())
      .def("raise_alarm", &Emulation::raise_alarm, Released())
      .def("lower_alarm", &Emulation::lower_alarm, Released())
      .def("set_condition", &Emulation::set_condition, Released())
      .def("set_fault", &Emulation::set_fault, Released())
      .def("clear_faults", &Emulation::clear_faults, Released())
      .def("answer_count", &Emulation::answer_count, Released())
      .def("violations", &Emulation::violations, Released())
      .def("first_violation", &Emulation::first_violation, Released());
}

}  // namespace absenc::python
