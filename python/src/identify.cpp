// SPDX-License-Identifier: Apache-2.0
// Binds the identification of an encoder on a line to Python.
#include "absenc/client/identify.hpp"

#include "absenc/os/signals.hpp"
#include "python/src/bind.hpp"

namespace absenc::python {

namespace {

py::dict to_dict(const client::FoundEncoder& found) {
  py::dict one;
  one["unit"] = std::string(found.unit->id);
  one["settings"] = found.settings;
  one["address"] = found.address;
  one["encoder"] = found.encoder;
  one["line"] = found.line;
  one["tried"] = found.tried;
  one["explained"] = found.explained;
  one["log10_chance"] = found.log10_chance;
  one["sure"] = found.sure;
  one["identity"] = to_python(found.identity.columns, found.identity.values);
  return one;
}

py::tuple to_tuple(const client::Identified& identified) {
  py::list found;
  for (const client::FoundEncoder& one : identified.found) found.append(to_dict(one));
  return py::make_tuple(found, identified.notes, identified.is_complete);
}

/// Searches the line. A Python signal handler may end the search between two attempts.
py::tuple identify(const std::string& place, double limit_s) {
  SignalWatch watch;
  try {
    client::Identified identified;
    {
      const py::gil_scoped_release released;
      identified =
          client::identify(place, {.limit = std::chrono::duration_cast<Time>(std::chrono::duration<double>(limit_s)),
                                   .progress = [&](const std::string&) {
                                     if (watch.wants_end()) throw os::Interrupted{};
                                   }});
    }
    watch.rethrow();
    return to_tuple(identified);
  } catch (const os::Interrupted&) {
    watch.rethrow();
    throw;
  }
}

}  // namespace

void bind_identify(py::module_& module) { module.def("identify", &identify); }

}  // namespace absenc::python
