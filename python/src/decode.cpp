// SPDX-License-Identifier: Apache-2.0
// Converts a capture to NumPy columns, a part of the rows at a time.
#include "absenc/client/decode.hpp"

#include <pybind11/numpy.h>

#include <chrono>
#include <future>
#include <unordered_map>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "python/src/bind.hpp"

namespace absenc::python {

namespace {

using client::Column;
using client::ColumnType;
using client::Value;

/// The values of one column. They are collected without the GIL, and converted to NumPy with it.
struct Values {
  explicit Values(ColumnType of_type) : type(of_type) {}

  void add(const Value& value) {
    const bool is_there = client::has_value(value);
    missing.push_back(is_there ? 0 : 1);
    switch (type) {
      case ColumnType::real:
        reals.push_back(is_there ? std::get<double>(value) : std::numeric_limits<double>::quiet_NaN());
        break;
      case ColumnType::int64:
        integers.push_back(is_there ? static_cast<std::uint64_t>(std::get<std::int64_t>(value)) : 0);
        break;
      case ColumnType::uint64:
        integers.push_back(is_there ? std::get<std::uint64_t>(value) : 0);
        break;
      case ColumnType::boolean:
        integers.push_back(is_there && std::get<bool>(value) ? 1 : 0);
        break;
      case ColumnType::flags:
        integers.push_back(is_there ? std::get<client::Flags>(value).bits : 0);
        break;
      case ColumnType::text:
        if (is_there) characters += std::get<std::string>(value);
        ends.push_back(characters.size());
        break;
      case ColumnType::bytes:
        if (is_there) {
          const client::ByteVector& bytes = std::get<client::ByteVector>(value);
          characters.append(bytes.begin(), bytes.end());
        }
        ends.push_back(characters.size());
        break;
    }
  }

  [[nodiscard]] py::object array() const {
    const auto size = static_cast<py::ssize_t>(missing.size());
    switch (type) {
      case ColumnType::real:
        return py::array_t<double>(size, reals.data());
      case ColumnType::int64:
        return py::array_t<std::uint64_t>(size, integers.data()).attr("view")("int64");
      case ColumnType::uint64:
        return py::array_t<std::uint64_t>(size, integers.data());
      case ColumnType::boolean:
        return py::array_t<std::uint64_t>(size, integers.data()).attr("astype")("bool");
      case ColumnType::flags:
        return py::array_t<std::uint64_t>(size, integers.data()).attr("astype")("uint32");
      case ColumnType::text:
      case ColumnType::bytes:
        break;
    }
    return objects();
  }

  // Returns the texts as Python objects. Equal texts share one object as long as there are few different texts.
  [[nodiscard]] py::object objects() const {
    py::list list(ends.size());
    std::unordered_map<std::string_view, py::object> known;
    constexpr std::size_t most_known = 256;
    std::size_t begin = 0;
    for (std::size_t i = 0; i < ends.size(); begin = ends[i++]) {
      const std::string_view value = std::string_view(characters).substr(begin, ends[i] - begin);
      py::object object;
      if (const auto found = known.find(value); found != known.end()) {
        object = found->second;
      } else {
        object = type == ColumnType::text ? py::object(py::str(value.data(), value.size())) : to_bytes(bytes_of(value));
        if (known.size() < most_known) known.emplace(value, object);
      }
      PyList_SET_ITEM(list.ptr(), static_cast<py::ssize_t>(i), object.release().ptr());
    }
    return list;
  }

  ColumnType type;
  std::vector<std::uint8_t> missing;
  std::vector<double> reals;
  std::vector<std::uint64_t> integers;
  std::string characters;
  std::vector<std::size_t> ends;
};

std::string_view dtype_of(ColumnType type) {
  switch (type) {
    case ColumnType::real:
      return "f8";
    case ColumnType::int64:
      return "i8";
    case ColumnType::uint64:
      return "u8";
    case ColumnType::boolean:
      return "?";
    case ColumnType::flags:
      return "u4";
    case ColumnType::text:
    case ColumnType::bytes:
      break;
  }
  return "O";
}

class Rows {
 public:
  Rows(const std::string& path, const std::string& unit, const client::DecodeChoices& choices)
      : decoded_(path, unit, choices) {}

  /// Returns a list with a tuple (name, unit, dtype, meaning) for each column.
  [[nodiscard]] py::list columns() const {
    py::list list;
    for (const Column& column : decoded_.columns()) {
      list.append(py::make_tuple(std::string(column.name), std::string(column.unit), std::string(dtype_of(column.type)),
                                 std::string(column.meaning)));
    }
    return list;
  }

  /// Decodes the next rows, up to `most`, and returns a tuple (values, missing) for each column; None at the end of the
  /// capture.
  py::object take(std::size_t most) {
    std::vector<Values> columns;
    for (const Column& column : decoded_.columns()) columns.emplace_back(column.type);
    {
      const py::gil_scoped_release released;
      auto filled = std::async(std::launch::async, [&] { fill(columns, most); });
      while (filled.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
        if (watch_.wants_end()) decoded_.cancel();
      }
      try {
        filled.get();
      } catch (const client::Cancelled&) {
      }
    }
    watch_.rethrow();
    if (columns.front().missing.empty()) return py::none();
    py::list list;
    for (const Values& values : columns) {
      const auto size = static_cast<py::ssize_t>(values.missing.size());
      list.append(
          py::make_tuple(values.array(), py::array_t<std::uint8_t>(size, values.missing.data()).attr("view")("bool")));
    }
    return list;
  }

  [[nodiscard]] std::vector<std::string> notes() const { return decoded_.notes(); }

 private:
  void fill(std::vector<Values>& columns, std::size_t most) {
    if (!std::exchange(begun_, true)) static_cast<void>(decoded_.begin());
    for (std::size_t taken = 0; taken < most && decoded_.current() != nullptr; ++taken) {
      const client::Row& row = *decoded_.current();
      for (std::size_t i = 0; i < columns.size(); ++i) columns[i].add(row.values[i]);
      decoded_.advance();
    }
  }

  client::Decoded decoded_;
  SignalWatch watch_;
  bool begun_ = false;
};

std::optional<Parity> parity_of(const std::string& name) {
  if (name.empty()) return {};
  if (name == "none") return Parity::none;
  if (name == "odd") return Parity::odd;
  if (name == "even") return Parity::even;
  throw client::UsageError("parity is \"" + name + "\", but must be none, odd or even");
}

}  // namespace

void bind_decode(py::module_& module) {
  py::class_<Rows>(module, "Rows")
      .def(py::init([](const std::string& path, const std::string& unit, std::vector<std::string> channels,
                       unsigned raw_channels, std::uint64_t samples_per_second, double baud, const std::string& parity,
                       const std::string& model, std::vector<std::string> options) {
        client::DecodeChoices choices{.channels = std::move(channels),
                                      .raw_channels = raw_channels,
                                      .samples_per_second = samples_per_second,
                                      .baud = baud,
                                      .parity = parity_of(parity),
                                      .model = model,
                                      .options = std::move(options)};
        const py::gil_scoped_release released;
        return std::make_unique<Rows>(path, unit, choices);
      }))
      .def("columns", &Rows::columns)
      .def("take", &Rows::take)
      .def("notes", &Rows::notes);
}

}  // namespace absenc::python
