// SPDX-License-Identifier: Apache-2.0
// What the sources of the Python module share: waiting that Ctrl-C ends, exceptions, values.
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

/// Whether a signal handler of Python wants to end what waits without the GIL. Python runs handlers in its main thread
/// only, so in others this is never so.
class SignalWatch {
 public:
  /// Looks every 20 ms at the most. Without the GIL.
  [[nodiscard]] bool wants_end();
  /// Throws what the handler raised. With the GIL.
  void rethrow();

 private:
  Time look_at_{};
  std::optional<py::error_already_set> raised_;
};

/// What the library throws becomes a class of absenc.errors.
void register_exceptions();

/// The object of absenc.errors for a failed command.
[[nodiscard]] py::object error_object(const client::Trouble& trouble);

/// Numbers, texts and bytes; of flags the names; None for nothing, for what does not hold and for what is not reported.
[[nodiscard]] py::object to_python(const client::Value& value);
/// A dict of them by column.
[[nodiscard]] py::dict to_python(const client::Answer& answer);
[[nodiscard]] py::dict to_python(const std::vector<client::Column>& columns, const std::vector<client::Value>& values);
/// The names of those that are raised, of all channels.
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
