// SPDX-License-Identifier: Apache-2.0
// Binds doctor, conform, probe, ports and wave to Python.
#include "absenc/client/captures/probe.hpp"
#include "absenc/client/conform/conform_text.hpp"
#include "absenc/client/doctor/examine.hpp"
#include "absenc/client/port/ports.hpp"
#include "absenc/client/wave.hpp"
#include "absenc/os/error.hpp"
#include "python/src/bind.hpp"

namespace absenc::python {

namespace {

using SettingTexts = std::vector<std::string>;

Time duration_of(double seconds) { return std::chrono::duration_cast<Time>(std::chrono::duration<double>(seconds)); }

/// Runs `work` without holding the GIL. `work` gets a function that returns whether a Python signal handler has raised
/// an exception.
template <class Work>
std::string watched(const Work& work) {
  SignalWatch watch;
  try {
    std::string json;
    {
      const py::gil_scoped_release released;
      json = work([&watch] { return watch.wants_end(); });
    }
    watch.rethrow();
    return json;
  } catch (const os::Ended&) {
    watch.rethrow();
    throw;
  }
}

std::string doctor(const std::string& text, const SettingTexts& settings, double seconds, std::size_t readings,
                   double turning_s) {
  return watched([&](const std::function<bool()>& over) {
    const client::DoctorChoices choices{
        .readings = readings, .limit = duration_of(seconds), .turning = duration_of(turning_s), .over = over};
    return client::to_json(client::examine(text, settings, choices)).line();
  });
}

std::string conform(const std::string& text, const SettingTexts& settings, std::size_t readings, bool changes,
                    bool resets) {
  return watched([&](const std::function<bool()>& over) {
    const client::ConformChoices choices{.readings = readings, .changes = changes, .resets = resets, .over = over};
    return client::to_json(client::conform(text, settings, choices)).line();
  });
}

std::string probe(const std::string& protocol, const std::string& model, const SettingTexts& settings,
                  const SettingTexts& replies, const SettingTexts& requests) {
  return client::to_json(client::probe(protocol, model, settings, replies, requests)).line();
}

py::tuple wave(const std::string& text, const SettingTexts& settings, const std::string& file,
               const SettingTexts& commands, std::uint64_t count, double rate, std::uint64_t samples_per_second,
               bool replaces) {
  SignalWatch watch;
  try {
    client::Waved waved;
    {
      const py::gil_scoped_release released;
      waved = client::draw_wave(text, settings, file,
                                {.commands = commands,
                                 .count = count,
                                 .rate = rate,
                                 .samples_per_second = samples_per_second,
                                 .replaces = replaces,
                                 .progress = [&](const std::string&) {
                                   if (watch.wants_end()) throw os::Ended{};
                                 }});
    }
    watch.rethrow();
    return py::make_tuple(waved.results, waved.failures, std::chrono::duration<double>(waved.time).count(),
                          waved.wires);
  } catch (const os::Ended&) {
    watch.rethrow();
    throw;
  }
}

std::vector<std::string> ports() {
  std::vector<std::string> all;
  for (const client::FoundPort& port : client::ports()) all.push_back(client::to_json(port).line());
  return all;
}

}  // namespace

void bind_verdicts(py::module_& module) {
  module.def("doctor", &doctor);
  module.def("conform", &conform);
  module.def("probe", &probe);
  module.def("wave", &wave);
  module.def("ports", &ports);
}

}  // namespace absenc::python
