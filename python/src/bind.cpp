// SPDX-License-Identifier: Apache-2.0
#include "python/src/bind.hpp"

#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::python {

bool SignalWatch::wants_end() {
  constexpr Time check_interval = std::chrono::milliseconds(20);
  if (raised_) return true;
  const Time now = os::now();
  if (now < next_check_) return false;
  next_check_ = now + check_interval;
  const py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) raised_.emplace();
  return raised_.has_value();
}

void SignalWatch::rethrow() {
  if (raised_) throw *std::exchange(raised_, std::nullopt);
}

namespace {

py::module_ errors() { return py::module_::import("absenc.errors"); }

void raise(const py::object& error) { PyErr_SetObject(py::type::of(error).ptr(), error.ptr()); }

void raise(const char* name, const std::string& sentence) { raise(errors().attr(name)(sentence)); }

py::object changed(py::object error, const std::exception& failure) {
  if (const client::Change* change = client::change_of(failure)) {
    error.attr("change") = py::str(std::string(client::word_of(change->state)));
  }
  return error;
}

std::string_view name_of(os::Failure::Kind kind) {
  using Kind = os::Failure::Kind;
  switch (kind) {
    case Kind::not_found:
      return "not_found";
    case Kind::no_permission:
      return "no_permission";
    case Kind::in_use:
      return "in_use";
    case Kind::unsupported:
      return "unsupported";
    case Kind::bad_rate:
      return "bad_rate";
    case Kind::lost:
      return "lost";
    case Kind::system:
      break;
  }
  return "system";
}

void translate(std::exception_ptr thrown) {
  try {
    std::rethrow_exception(std::move(thrown));
  } catch (const client::EncoderFailure& failure) {
    raise(changed(error_object(failure.trouble), failure));
  } catch (const client::Failure& failure) {
    raise(changed(errors().attr("Failure")(failure.what()), failure));
  } catch (const client::UsageError& error) {
    raise("UsageError", error.what());
  } catch (const os::Failure& failure) {
    raise(changed(errors().attr("PortError")(failure.what(), name_of(failure.kind())), failure));
  } catch (const client::Cancelled& cancelled) {
    raise(changed(errors().attr("Cancelled")("another thread cancelled it"), cancelled));
  } catch (const os::Interrupted&) {
    PyErr_SetNone(PyExc_KeyboardInterrupt);
  }
}

struct ToPython {
  py::object operator()(std::monostate) const { return py::none(); }
  py::object operator()(client::Invalid) const { return py::none(); }
  py::object operator()(client::Unknown) const { return py::none(); }
  py::object operator()(const client::Flags& flags) const { return py::tuple(names_of({flags})); }
  py::object operator()(const client::ByteVector& bytes) const { return to_bytes(bytes); }
  py::object operator()(const std::string& text) const { return py::str(text); }
  template <class Number>
  py::object operator()(Number value) const {
    return py::cast(value);
  }
};

}  // namespace

void register_exceptions() { py::register_exception_translator(&translate); }

py::object error_object(const client::Trouble& trouble) {
  const py::object type = errors().attr("by_name")[py::str(std::string(text_of(trouble.error).name))];
  return type(trouble.text(), trouble.message, trouble.exchange, trouble.advice, trouble.sent, trouble.received);
}

py::object to_python(const client::Value& value) { return std::visit(ToPython{}, value); }

py::dict to_python(const std::vector<client::Column>& columns, const std::vector<client::Value>& values) {
  py::dict fields;
  for (std::size_t i = 0; i < columns.size(); ++i) fields[py::str(std::string(columns[i].name))] = to_python(values[i]);
  return fields;
}

py::dict to_python(const client::Answer& answer) { return to_python(answer.columns, answer.values); }

py::list names_of(const std::vector<client::Flags>& flags) {
  py::list names;
  for (const client::Flags& channel : flags) {
    for (const std::string_view name : client::flag_names(*channel.field, channel.bits)) {
      names.append(py::str(std::string(name)));
    }
  }
  return names;
}

}  // namespace absenc::python
