// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/client/memory.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

namespace {

// Wait after an unanswered write, before the byte is read back.
constexpr Time settling = std::chrono::milliseconds(50);

}  // namespace

MemoryChange::MemoryChange(Memory memory, MemoryImage wanted, MemoryAccess access)
    : memory_(memory), wanted_(std::move(wanted)), access_(access) {
  require_memory(memory_.unit(), access_);
  require_open(memory_.unit(), wanted_, access_);
}

void MemoryChange::look(const MemoryProgress& progress) {
  before_change([&] {
    memory_.check_model();
    found_ = memory_.read(wanted_, progress);
  });
  left_ = differing_ = client::differing(wanted_, found_);
}

void MemoryChange::write(const MemoryProgress& progress) {
  const std::size_t all = left_.size();
  while (!left_.empty()) {
    const auto [at, value] = *left_.begin();
    in_flight_ = at;
    try {
      memory_.write(at, value, access_, found_.at(at));
    } catch (const std::exception& failure) {
      const Change* change = change_of(failure);
      state_ = change != nullptr ? change->state : ChangeState::not_sent;
      if (state_ != ChangeState::unknown) in_flight_.reset();
      throw;
    }
    in_flight_.reset();
    state_ = ChangeState::confirmed;
    written_[at] = value;
    left_.erase(at);
    if (progress) progress(written_.size(), all);
  }
}

void MemoryChange::verify(const MemoryProgress& progress) {
  const MemoryImage wrong = [&] {
    try {
      return client::differing(written_, memory_.read(written_, progress));
    } catch (const std::exception&) {
      rethrow_with({state_});
    }
  }();
  if (wrong.empty()) return;
  for (const auto& [at, value] : wrong) {
    written_.erase(at);
    left_[at] = value;
  }
  state_ = ChangeState::unknown;
  const Failure failure("bytes that were written and read back have changed again");
  throw OfChange<Failure>(failure, Change{state_, "the same again writes only what differs now"});
}

void MemoryChange::settle() {
  if (!in_flight_) return;
  const MemoryAddress at = *in_flight_;
  const std::uint32_t value = left_.at(at);
  try {
    os::sleep_until(os::now() + settling);
    const bool there = memory_.read({{at, 0}}).at(at) == value;
    in_flight_.reset();
    state_ = there ? ChangeState::confirmed : ChangeState::refused;
    if (!there) return;
    written_[at] = value;
    left_.erase(at);
  } catch (const std::exception&) {  // the byte cannot be read, so it stays unknown whether it was written
  }
}

MemoryImage MemoryChange::not_written() const {
  MemoryImage image = left_;
  if (in_flight_) image.erase(*in_flight_);
  return image;
}

MemoryImage MemoryChange::unknown() const {
  return in_flight_ ? MemoryImage{{*in_flight_, left_.at(*in_flight_)}} : MemoryImage{};
}

}  // namespace absenc::client
