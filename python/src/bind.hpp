// SPDX-License-Identifier: Apache-2.0
// Shared parts of the Python module: waits that Ctrl-C ends, exceptions, conversion of values.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/encoder.hpp"
#include "absenc/client/row.hpp"

namespace absenc::python {

namespace py = pybind11;

/// Watches for exceptions that handlers of signals in Python raise. Such handlers run only in the main thread.
class SignalWatch {
 public:
  /// Returns whether a signal handler has raised an exception. Call it without holding Python's global lock (GIL).
  [[nodiscard]] bool wants_end();
  /// Throws the exception that the signal handler has raised, if any. Call it while holding the GIL.
  void rethrow();

 private:
  Time next_check_{};
  std::optional<py::error_already_set> raised_;
};

/// Registers the conversion of the library's exceptions to classes of absenc.errors.
void register_exceptions();

/// Returns an exception object of absenc.errors that describes a failed command.
[[nodiscard]] py::object error_object(const client::Trouble& trouble);

/// Converts a value to Python; flags become a tuple of names, missing and invalid values None.
[[nodiscard]] py::object to_python(const client::Value& value);
/// Returns the values of an answer as a dict by column name.
[[nodiscard]] py::dict to_python(const client::Answer& answer);
[[nodiscard]] py::dict to_python(const std::vector<client::Column>& columns, const std::vector<client::Value>& values);
/// Returns the names of the flags that are set, for all channels of the encoder.
[[nodiscard]] py::list names_of(const std::vector<client::Flags>& flags);

[[nodiscard]] inline py::bytes to_bytes(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
[[nodiscard]] inline Bytes bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

void bind_sample(py::module_& module);
void bind_encoder(py::module_& module);
void bind_emulation(py::module_& module);
void bind_decode(py::module_& module);
void bind_protocol(py::module_& module);
void bind_identify(py::module_& module);
void bind_verdicts(py::module_& module);

}  // namespace absenc::python
