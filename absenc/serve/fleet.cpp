// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/fleet.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <new>
#include <system_error>
#include <unordered_set>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/client/port/named_encoder.hpp"
#include "absenc/client/port/realtime.hpp"
#include "absenc/client/port/shared_link.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::serve {

using namespace client;

namespace {

// An encoder begins only if this much memory is left, in bytes: the reading threads and the server's answers need some
// at any time. It is more than fits into the addresses that glibc has already reserved for a heap, from which no thread
// gets a stack: 64 MiB, on a machine of 32 bits 1 MiB, where addresses are too few to ask for more.
constexpr std::size_t memory_to_spare = std::size_t{sizeof(void*) == 8 ? 64 : 2} << 20;

bool is_named(std::string_view name) { return name.find_first_of(":?") == std::string_view::npos; }

// Returns a text of all settings of the encoder: it is the same after a reload if no setting has changed.
std::string description_of(const NamedEncoder& named) {
  std::string text = fmt::format("{} {} {}", named.address, named.rate_hz, named.has_company);
  for (const auto* settings : {&named.settings, &named.defaults}) {
    text += " /";
    for (const FileSetting& setting : *settings) text += fmt::format(" {}={}", setting.name, setting.values);
  }
  return text;
}

}  // namespace

struct Fleet::Configured {
  std::string name;
  std::string description;
  EncoderAddress address;
  double rate;
};

Fleet::Fleet(std::vector<std::string> names, double rate, int realtime, ServerEvents& server_events)
    : names_(std::move(names)), rate_(rate), realtime_(realtime), server_events_(&server_events) {
  try {
    const Reloaded changes = change_to(configured());
    if (changes.failure) throw Failure(*changes.failure);
  } catch (...) {
    end();
    throw;
  }
}

Fleet::~Fleet() { end(); }

void Fleet::end() {
  const Watches watches = all();
  // All reading threads are asked to stop before the first one is waited for, so that they stop at the same time.
  for (const auto& watch : watches) watch->request_stop();
  for (const auto& watch : watches) watch->wait();
}

std::vector<Fleet::Configured> Fleet::configured() const {
  std::vector<std::string> names = names_;
  std::optional<NamedEncoders> file;
  if (names.empty() || std::any_of(names.begin(), names.end(), is_named)) {
    file = require_names("the names of encoders stand in absenc.toml");
  }
  if (names.empty()) {
    for (const FileSection& encoder : file->file().encoders) names.push_back(encoder.name);
    if (names.empty()) throw UsageError(fmt::format("there is no encoder in {}", file->file().path));
  }
  std::vector<Configured> all;
  for (const std::string& name : names) {
    if (os::interrupted()) throw os::Interrupted{};
    NamedEncoder named;
    if (is_named(name)) named = file->require(name);
    const double rate = named.rate_hz > 0 ? named.rate_hz : rate_;
    all.push_back(
        {name, description_of(named), is_named(name) ? parse_address(name, *file) : parse_address(name), rate});
    if (all.back().address.realtime == 0) all.back().address.realtime = realtime_;
  }
  std::vector<EncoderAddress> addresses;
  for (const Configured& one : all) addresses.push_back(one.address);
  require_different(addresses, names);
  check_realtime(addresses);
  std::unordered_set<std::string_view> seen;
  for (const std::string& name : names) {
    if (!seen.insert(name).second) throw UsageError(fmt::format("{} is named twice", name));
  }
  return all;
}

std::shared_ptr<Watch> Fleet::start(const Configured& encoder, Time offset, std::size_t others) const {
  const auto failure = [&](std::string_view reason) {
    return Failure(
        fmt::format("{} cannot be read beside {} other encoders, because this computer gives it no {}; "
                    "serve fewer of them, or raise the limits of memory and threads (ulimit -v, ulimit -u)",
                    encoder.name, others, reason));
  };
  try {
    ::operator delete(::operator new(memory_to_spare));  // the compiler may leave out a `new` of memory without use
    return std::make_shared<Watch>(encoder.name, encoder.address, encoder.rate, offset, *server_events_);
  } catch (const std::system_error& error) {
    throw failure(fmt::format("thread: {}", error.code().message()));
  } catch (const std::bad_alloc&) {
    throw failure("memory");
  }
}

std::string Fleet::reload() {
  const Reloaded changes = change_to(configured());
  const auto listed = [](const std::vector<std::string>& names) {
    return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
  };
  std::string text = fmt::format("{} unchanged; ended: {}; begun: {}", changes.unchanged, listed(changes.ended),
                                 listed(changes.begun));
  if (changes.failure) text += fmt::format("; not begun: {}: {}", listed(changes.left_out), changes.failure->what());
  return text;
}

Fleet::Reloaded Fleet::change_to(const std::vector<Configured>& all) {
  Reloaded changes;
  Watches ending;
  std::vector<Served> unchanged;
  {
    const std::lock_guard lock(mutex_);
    for (const Served& one : served_) {
      const bool stays = std::any_of(all.begin(), all.end(), [&](const Configured& now) {
        return now.name == one.watch->name() && now.description == one.description;
      });
      if (stays) {
        unchanged.push_back(one);
      } else {
        changes.ended.push_back(one.watch->name());
        ending.push_back(one.watch);
      }
    }
  }
  changes.unchanged = unchanged.size();
  // The encoders to remove are stopped before new ones start, because a new encoder may need the port of a removed
  // one.
  for (const auto& watch : ending) watch->request_stop();
  for (const auto& watch : ending) watch->wait();
  std::vector<Served> next;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Configured& now = all[i];
    const auto same = std::find_if(unchanged.begin(), unchanged.end(),
                                   [&](const Served& one) { return one.watch->name() == now.name; });
    if (same != unchanged.end()) {
      next.push_back(*same);
      continue;
    }
    if (changes.failure || os::interrupted()) {
      changes.left_out.push_back(now.name);
      continue;
    }
    // New encoders with the same rate of readings are read at different times, spread over one period.
    const double share = now.rate > 0 ? static_cast<double>(i) / (now.rate * static_cast<double>(all.size())) : 0;
    try {
      next.push_back({now.description, start(now, Time(static_cast<std::int64_t>(1e9 * share)), next.size())});
      changes.begun.push_back(now.name);
    } catch (const Failure& failure) {
      changes.failure = failure;
      changes.left_out.push_back(now.name);
    }
  }
  {
    const std::lock_guard lock(mutex_);
    served_ = std::move(next);
  }
  if (os::interrupted()) throw os::Interrupted{};
  return changes;
}

Fleet::Watches Fleet::all() const {
  const std::lock_guard lock(mutex_);
  Watches watches;
  for (const Served& one : served_) watches.push_back(one.watch);
  return watches;
}

std::shared_ptr<Watch> Fleet::find(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  for (const Served& one : served_) {
    if (one.watch->name() == name) return one.watch;
  }
  return nullptr;
}

std::vector<std::string> Fleet::others_on_line(const Watch& watch) const {
  std::vector<std::string> names;
  for (const auto& other : all()) {
    if (other.get() == &watch || other->name() == watch.name()) continue;
    if (share_line(other->address(), watch.address())) names.push_back(other->name());
  }
  return names;
}

}  // namespace absenc::serve
