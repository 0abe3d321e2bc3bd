// SPDX-License-Identifier: Apache-2.0
// Binds an open encoder to Python.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <mutex>
#include <utility>

#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/recording.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "python/src/bind.hpp"
#include "python/src/sample.hpp"

namespace absenc::python {

namespace {

/// Collects the replies to a scan: a field with Role::encoder begins a new record.
struct ScanReplies final : FieldSink {
  void put(const FieldValue& value) override {
    if (value.info->role == Role::encoder || all.empty()) all.emplace_back();
    all.back().put(value);
  }
  void put_reading(const Reading& reading) override {
    if (!all.empty()) all.back().put_reading(reading);
  }
  std::vector<client::AnswerSink> all;
};

void require_rate(double rate_hz) {
  if (!(rate_hz >= 0 && rate_hz <= 1e6)) throw client::UsageError("rate is 0 to 1e6 readings a second");
}

struct Closed : client::UsageError {
  Closed() : UsageError("this encoder is closed: open it again") {}
};

/// An encoder that any Python thread may use. Threads take turns and wait without the GIL.
class PyEncoder {
 public:
  /// Calls `work` without holding the GIL. The result of `work` must not contain Python objects.
  template <class Work>
  auto use(const Work& work) {
    try {
      const py::gil_scoped_release released;
      const std::lock_guard lock(mutex_);
      if (closed_) throw Closed();
      return work(encoder_);
    } catch (const client::Cancelled&) {
      watch_.rethrow();
      throw;
    }
  }

  PyEncoder(const std::string& text, const std::vector<std::string>& settings)
      : encoder_(client::make_encoder(client::parse_address(text, settings), Time{})) {
    encoder_.end_when([this] { return stopping_ || watch_.wants_end(); });
    use([](client::Encoder& encoder) { encoder.connect(); });
  }
  PyEncoder(const PyEncoder&) = delete;
  PyEncoder& operator=(const PyEncoder&) = delete;

  /// Throws the exception that a Python signal handler has raised during a wait, if any.
  void check() { watch_.rethrow(); }

  void close() {
    encoder_.cancel();  // ends the encoder's waits in other threads; any thread may call it
    const py::gil_scoped_release released;
    const std::lock_guard lock(mutex_);
    if (!std::exchange(closed_, true)) encoder_.disconnect();
  }

  /// Ends the waits of the encoder if `stopping` is true; otherwise permits waits again.
  void stop(bool stopping) { stopping_ = stopping; }

  [[nodiscard]] const client::Encoder& encoder() const { return encoder_; }
  [[nodiscard]] const Unit& unit() const { return encoder_.unit(); }

 private:
  std::mutex mutex_;
  SignalWatch watch_;
  std::atomic<bool> stopping_ = false;
  bool closed_ = false;
  client::Encoder encoder_;
};

class PySamples {
 public:
  PySamples(PyEncoder& encoder, double rate_hz, std::uint64_t count)
      : encoder_(&encoder),
        samples_(encoder.use([&](client::Encoder& one) { return one.samples({.rate_hz = rate_hz, .count = count}); })) {
  }

  PySample next() try {
    const client::Sample* sample = encoder_->use([this](client::Encoder&) {
      if (!std::exchange(begun_, true)) {
        static_cast<void>(samples_.begin());
      } else {
        samples_.advance();
      }
      return samples_.current();
    });
    encoder_->check();
    if (sample == nullptr) throw py::stop_iteration();
    return {&encoder_->unit(), *sample};
  } catch (const Closed&) {
    if (!begun_) throw;
    throw py::stop_iteration();
  }

 private:
  PyEncoder* encoder_;
  client::Samples samples_;
  bool begun_ = false;
};

std::int64_t whole_number(const Argument& argument, const py::handle& value) {
  try {
    return py::cast<std::int64_t>(value);
  } catch (const py::cast_error&) {  // the value is no whole number, or has more than 64 bits
    throw client::UsageError(std::string(argument.name) + " is " + std::string(py::repr(value)) +
                             ", but must be a whole number of up to 64 bits");
  }
}

/// Returns the arguments in the order in which the command declares them. Throws UsageError.
std::vector<std::int64_t> arguments_of(const Command& command, const py::args& args, const py::kwargs& named) {
  std::vector<std::int64_t> values;
  if (args.size() > command.arguments.size()) {
    throw client::UsageError(std::string(command.name) + " takes " + std::to_string(command.arguments.size()) +
                             " arguments, not " + std::to_string(args.size()));
  }
  for (const py::handle value : args) values.push_back(whole_number(command.arguments[values.size()], value));
  std::size_t used = 0;
  for (std::size_t i = values.size(); i < command.arguments.size() && used < named.size(); ++i) {
    const Argument& argument = command.arguments[i];
    std::string name(argument.name);
    std::replace(name.begin(), name.end(), '-', '_');
    if (named.contains(name.c_str())) {
      values.push_back(whole_number(argument, named[name.c_str()]));
      ++used;
    } else if (argument.required) {
      throw client::UsageError(std::string(command.name) + " needs the argument " + name);
    } else {
      values.push_back(argument.default_value);
    }
  }
  if (used == named.size()) return values;
  std::string names;
  for (const Argument& argument : command.arguments) names += (names.empty() ? "" : ", ") + std::string(argument.name);
  throw client::UsageError(std::string(command.name) + " takes " + (names.empty() ? "no arguments" : "only " + names));
}

py::dict run(PyEncoder& encoder, const std::string& name, const py::args& args, const py::kwargs& named) {
  const std::vector<std::int64_t> arguments = arguments_of(client::require_command(encoder.unit(), name), args, named);
  return to_python(encoder.use([&](client::Encoder& one) { return one.run(name, arguments); }));
}

py::list scan(PyEncoder& encoder) {
  const Command* command = find_command(encoder.unit(), Verb::scan);
  if (command == nullptr) {
    throw client::UsageError(std::string(encoder.unit().id) +
                             " has no addresses to scan: there is one encoder on its line");
  }
  const std::vector<std::int64_t> arguments = client::complete_arguments(*command, {});
  const ScanReplies records = encoder.use([&](client::Encoder& one) {
    ScanReplies found;
    client::run_into(connection_of(one), *command, arguments, found);
    return found;
  });
  py::list list;
  for (const client::AnswerSink& sink : records.all) list.append(to_python(sink.answer));
  return list;
}

std::vector<std::string> questions(const PyEncoder& encoder) {
  std::vector<std::string> names;
  for (const Command* command : client::questions(encoder.unit(), encoder.encoder().options())) {
    names.emplace_back(command->name);
  }
  return names;
}

py::dict settings_set(PyEncoder& encoder, const std::string& name, const py::args& args, const py::kwargs& named) {
  const client::Setting setting = client::require_setting(encoder.unit(), name);
  const std::vector<std::int64_t> arguments = arguments_of(*setting.setter, args, named);
  return to_python(encoder.use([&](client::Encoder& one) { return one.settings().set(name, arguments).now; }));
}

std::vector<std::string> settings_names(const PyEncoder& encoder) {
  std::vector<std::string> names;
  for (const Command& command : encoder.unit().commands) {
    if (command.verb == Verb::config_get) names.emplace_back(command.name);
  }
  return names;
}

using MemoryWords = std::vector<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>>;

MemoryWords to_list(const client::MemoryImage& image) {
  MemoryWords list;
  for (const auto& [at, value] : image) list.emplace_back(at.page, at.address, value);
  return list;
}

// Returns the memory image that `bytes` describe from `address` on. Words consist of several bytes, the low byte first.
client::MemoryImage image_of(const Unit& unit, std::uint32_t page, std::uint32_t address, std::string_view bytes) {
  client::MemoryImage image;
  const std::size_t word = client::word_bytes(unit);
  if (bytes.size() % word != 0) {
    throw client::UsageError("the bytes to write must be whole words of " + std::to_string(word) + " bytes");
  }
  const auto all = bytes_of(bytes);
  for (std::size_t i = 0; i < bytes.size(); i += word) {
    image[{page, address++}] = static_cast<std::uint32_t>(load_little_endian(Bytes(all).subspan(i, word)));
  }
  return image;
}

py::bytes memory_read(PyEncoder& encoder, std::uint32_t address, std::uint32_t count, std::uint32_t page) {
  const Unit& unit = encoder.unit();
  client::require_memory(unit, client::MemoryAccess::read);
  client::MemoryImage wanted;
  for (std::uint32_t i = 0; i < count; ++i) {
    const client::MemoryAddress at{page, address + i};
    // Each address is checked separately, because `count` may be very large.
    client::require_open(unit, {{at, 0}}, client::MemoryAccess::read);
    wanted[at] = 0;
  }
  const client::MemoryImage image = encoder.use([&](client::Encoder& one) { return one.memory().read(wanted); });
  std::vector<std::uint8_t> bytes;
  for (const auto& [at, value] : image) {
    for (unsigned i = 0; i < client::word_bytes(unit); ++i) bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
  }
  return to_bytes(bytes);
}

MemoryWords memory_dump(PyEncoder& encoder) {
  return to_list(encoder.use([](client::Encoder& one) {
    client::require_memory(one.unit(), client::MemoryAccess::read);
    client::Memory memory = one.memory();
    memory.check_model();
    return memory.read(client::dump_addresses(one.unit()));
  }));
}

std::size_t memory_write(PyEncoder& encoder, std::uint32_t address, const py::bytes& data, std::uint32_t page,
                         bool force) {
  const client::MemoryImage wanted = image_of(encoder.unit(), page, address, std::string_view(data));
  return encoder.use([&](client::Encoder& one) {
    const client::MemoryAccess access = force ? client::MemoryAccess::force : client::MemoryAccess::write;
    client::require_memory(one.unit(), access);
    client::MemoryChange change(one.memory(), wanted, access);
    change.look();
    change.write();
    change.verify();
    return change.written().size();
  });
}

std::optional<Time> time_of(std::optional<double> seconds) {
  if (!seconds) return {};
  if (!(*seconds > 0 && *seconds < 1e9)) throw client::UsageError("a time to record for is seconds above 0, below 1e9");
  return Time(static_cast<std::int64_t>(1e9 * *seconds));
}

py::tuple record(PyEncoder& encoder, const std::string& path, double rate_hz, std::uint64_t every, std::uint64_t count,
                 std::optional<double> duration, std::optional<std::uint64_t> part_bytes,
                 std::optional<double> part_duration) {
  require_rate(rate_hz);
  const client::RecordingSettings settings{.path = path,
                                           .encoder = encoder.encoder().address(),
                                           .rate_hz = rate_hz,
                                           .every = every,
                                           .count = count,
                                           .duration = time_of(duration),
                                           .part_bytes = part_bytes,
                                           .part_time = time_of(part_duration)};
  const auto [paths, counts, bytes] = encoder.use([&](client::Encoder& one) {
    client::Recording recording(settings, one);
    recording.run();
    return std::tuple(recording.paths(), recording.counts(), recording.bytes());
  });
  encoder.check();
  return py::make_tuple(paths, counts.readings, counts.failures, counts.gaps, counts.missed, bytes);
}

py::dict counters_of(const PyEncoder& encoder) {
  py::dict counts;
  const host::Counters& counters = encoder.encoder().counters();
  counts["good"] = counters.good;
  for (std::size_t i = 1; i < error_texts.size(); ++i) {
    const auto count = counters.errors[i];
    if (count != 0) counts[py::str(std::string(error_texts[i].name))] = count;
  }
  return counts;
}

}  // namespace

void bind_encoder(py::module_& module) {
  py::class_<PySamples>(module, "Samples").def("next", &PySamples::next);
  py::class_<PyEncoder>(module, "Encoder")
      .def(py::init<const std::string&, const std::vector<std::string>&>())
      .def("close", &PyEncoder::close)
      .def("stop", &PyEncoder::stop)
      .def("read",
           [](PyEncoder& one) {
             return PyReading{&one.unit(), one.use([](client::Encoder& encoder) { return encoder.read(); })};
           })
      .def("read_alarms",
           [](PyEncoder& one) {
             return PyReading{&one.unit(), one.use([](client::Encoder& encoder) { return encoder.read_alarms(); })};
           })
      .def(
          "samples",
          [](PyEncoder& one, double rate, std::uint64_t count) {
            require_rate(rate);
            return std::make_unique<PySamples>(one, rate, count);
          },
          py::keep_alive<0, 1>())
      .def("run", &run)
      .def("scan", &scan)
      .def("questions", &questions)
      .def("settings_names", &settings_names)
      .def("settings_get",
           [](PyEncoder& one, const std::string& name) {
             return to_python(one.use([&](client::Encoder& encoder) { return encoder.settings().get(name); }));
           })
      .def("settings_set", &settings_set)
      .def("memory_read", &memory_read)
      .def("memory_dump", &memory_dump)
      .def("memory_write", &memory_write)
      .def("record", &record)
      .def("counters", &counters_of)
      .def_property_readonly(
          "change", [](const PyEncoder& one) { return std::string(client::word_of(one.encoder().change().state)); })
      .def_property_readonly("unit", [](const PyEncoder& one) { return std::string(one.unit().id); })
      .def_property_readonly("model",
                             [](const PyEncoder& one) -> std::optional<std::string> {
                               const Model* model = one.encoder().options().model;
                               return model == nullptr ? std::nullopt : std::optional<std::string>(model->name);
                             })
      .def_property_readonly("address", [](const PyEncoder& one) { return one.encoder().address(); })
      .def_property_readonly(
          "options", [](const PyEncoder& one) { return client::option_texts(one.unit(), one.encoder().options()); })
      .def_property_readonly("notes", [](const PyEncoder& one) { return one.encoder().notes(); });
}

}  // namespace absenc::python
