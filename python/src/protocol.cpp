// SPDX-License-Identifier: Apache-2.0
// Binds the descriptions of protocols, their codecs, and CRCs to Python.
#include <pybind11/numpy.h>

#include <algorithm>
#include <array>

#include "absenc/client/error.hpp"
#include "absenc/client/port/diagnosis.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/protocol/all.hpp"
#include "python/src/bind.hpp"

namespace absenc::python {

namespace {

/// Converts bytes or text to a frame. Throws UsageError.
client::WireFrame frame_of(LinkKind link, const char* what, const py::object& object) {
  if (py::len(object) == 0) return {};
  if (py::isinstance<py::str>(object)) return client::parse_wire_text(link, what, py::cast<std::string>(object));
  if (link == LinkKind::can || carries_bits(link)) {
    throw client::UsageError(std::string(what) + " must be text: \"1FF:022B\" on CAN, \"0001\" on clocked links");
  }
  const std::string text(py::bytes{object});
  const Bytes bytes = bytes_of(text);
  return {.bytes = {bytes.begin(), bytes.end()}, .bits = 0, .can = {}};
}

py::dict decode(const std::string& name, const py::object& reply, const py::object& request, const std::string& model,
                const std::vector<std::string>& settings) {
  const Unit& unit = client::require_unit(name);
  const Options options = client::require_options(unit, model, settings);
  const client::WireFrame request_frame = frame_of(unit.link, "request", request);
  const client::WireFrame reply_frame = frame_of(unit.link, "reply", reply);
  if (request_frame.frame().empty() && reply_frame.frame().empty()) {
    throw client::UsageError("there is nothing to decode: reply and request are empty, and one of them is needed");
  }
  client::AnswerSink sink;
  const Error error = unit.decode(options, request_frame.frame(), reply_frame.frame(), sink);
  if (error == Error::none) return to_python(sink.answer);
  const Explanation explanation = unit.explain != nullptr
                                      ? unit.explain(options, error, request_frame.frame(), reply_frame.frame())
                                      : Explanation{};
  const client::Subject subject = client::subject_of(unit, options, request_frame.frame(), reply_frame.frame());
  const std::string_view advice = explanation.advice.empty() ? text_of(error).advice : explanation.advice;
  throw client::EncoderFailure({.error = error,
                                .message = client::describe(unit.link, subject, error, explanation.detail),
                                .advice = std::string(advice),
                                .sent = client::to_wire_text(unit.link, request_frame.frame()),
                                .received = client::to_wire_text(unit.link, reply_frame.frame())});
}

py::object encode(const std::string& name, const std::string& command_name, const std::vector<std::int64_t>& given,
                  const std::string& model, const std::vector<std::string>& settings) {
  const Unit& unit = client::require_unit(name);
  const Options options = client::require_options(unit, model, settings);
  const Command& command = client::require_command(unit, command_name);
  std::array<std::uint8_t, longest_encoded> bytes{};
  const Result<std::size_t> size =
      unit.encode(options, command, client::complete_arguments(command, given), MutableBytes(bytes));
  if (!size) {
    throw client::UsageError(command_name + " cannot be encoded: " + std::string(text_of(size.error()).description) +
                             ". Try: " + std::string(text_of(size.error()).advice));
  }
  const Bytes encoded = Bytes(bytes).first(*size);
  if (unit.link == LinkKind::can || carries_bits(unit.link))
    return py::str(std::string(encoded.begin(), encoded.end()));
  return to_bytes(encoded);
}

template <class T>
py::list names_of_all(std::span<const T> all) {
  py::list names;
  for (const T& one : all) {
    if (!one.name.empty()) names.append(py::str(std::string(one.name)));
  }
  return names;
}

py::list commands_of(const Unit& unit) {
  py::list commands;
  for (const Command& command : unit.commands) {
    py::dict one;
    one["name"] = std::string(command.name);
    one["verb"] = std::string(client::name_of(command.verb));
    one["meaning"] = std::string(command.meaning);
    one["changes_encoder"] = command.changes_encoder;
    one["arguments"] = names_of_all(command.arguments);
    commands.append(one);
  }
  return commands;
}

py::list flags_of(const Unit& unit) {
  py::list list;
  for (const FieldInfo* field : {unit.alarms, unit.second_alarms, unit.status, unit.second_status}) {
    if (field == nullptr) continue;
    for (std::size_t bit = 0; bit < field->flags.size(); ++bit) {
      const FlagInfo& flag = field->flags[bit];
      if (flag.name.empty()) continue;
      list.append(py::make_tuple(std::string(field->name), bit, std::string(flag.name), std::string(flag.meaning),
                                 std::string(flag.action)));
    }
  }
  return list;
}

py::dict unit_of(const std::string& id) {
  const Unit& unit = client::require_unit(id);
  py::dict one;
  one["id"] = id;
  one["name"] = std::string(unit.name);
  one["document"] = std::string(unit.document);
  one["link"] = std::string(client::name_of(unit.link));
  one["line"] = client::line_of(unit);
  one["options"] = names_of_all(unit.options);
  one["models"] = names_of_all(unit.models);
  one["fields"] = names_of_all(unit.fields);
  one["conditions"] = names_of_all(unit.conditions);
  one["alarms"] = unit.alarms == nullptr ? py::list() : names_of_all(unit.alarms->flags);
  one["commands"] = commands_of(unit);
  one["flags"] = flags_of(unit);
  return one;
}

std::vector<std::string> units() {
  std::vector<std::string> ids;
  for (const Unit* unit : all_units()) ids.emplace_back(unit->id);
  return ids;
}

std::vector<std::string> error_names() {
  std::vector<std::string> names;
  for (std::size_t i = 1; i < error_texts.size(); ++i) names.emplace_back(error_texts[i].name);
  return names;
}

/// Returns an array that contains the CRC of each row of `rows`.
py::array_t<std::uint16_t> crc(const py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>& rows,
                               unsigned width, std::uint16_t poly, std::uint16_t init, bool refin, bool refout,
                               std::uint16_t xorout) {
  if (width < 3 || width > 16) throw client::UsageError("width must be 3 to 16 bits");
  if (std::max({poly, init, xorout}) >> width != 0) {
    throw client::UsageError("poly, init and xorout have at most as many bits as the CRC, which has " +
                             std::to_string(width) + "; the highest term of poly is left out");
  }
  if (rows.ndim() != 2) throw client::UsageError("a CRC is made of bytes, or of an array of rows of them");
  const CrcParameters parameters{width, poly, init, refin, refout, xorout};
  const auto count = static_cast<std::size_t>(rows.shape(0));
  const auto size = static_cast<std::size_t>(rows.shape(1));
  py::array_t<std::uint16_t> sums(rows.shape(0));
  std::uint16_t* const sum = sums.mutable_data();
  const std::uint8_t* const data = rows.data();
  const py::gil_scoped_release released;
  for (std::size_t i = 0; i < count; ++i) sum[i] = crc_bitwise(parameters, Bytes(data + i * size, size));
  return sums;
}

}  // namespace

void bind_protocol(py::module_& module) {
  module.def("units", &units);
  module.def("unit", &unit_of);
  module.def("error_names", &error_names);
  module.def("decode_frame", &decode);
  module.def("encode_request", &encode);
  module.def("crc", &crc);
}

}  // namespace absenc::python
