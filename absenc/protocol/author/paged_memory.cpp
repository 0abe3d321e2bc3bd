// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/author/paged_memory.hpp"

namespace absenc::author {

auto PagedMemoryDevice::access(const Access& request, Time at, Time since) -> std::optional<MemoryAnswer> {
  const bool immediate = memory_->is_immediate != nullptr && memory_->is_immediate(page_, request.address);
  check_rules(request, immediate, at);
  if (at < page_ready_at_ || (at < written_at_ && !immediate)) return MemoryAnswer{.busy = true, .value = 0};
  if (!exists(request)) return std::nullopt;
  const bool selects = request.address == memory_->select_address;
  if (request.writes) {
    fetching_ = false;
    if (selects) {
      select(request.value, since);
    } else {
      store(page_, request.address, request.value);
      if (!immediate) write_lasts(since + memory_->write_time);
    }
    return MemoryAnswer{.busy = false, .value = request.value};
  }
  if (!immediate && fetches(request.address, at, since)) return MemoryAnswer{.busy = true, .value = 0};
  return MemoryAnswer{.busy = false, .value = selects ? page_ : load(page_, request.address)};
}

bool PagedMemoryDevice::exists(const Access& request) const {
  if (request.address == memory_->select_address) return !request.writes || has_page(memory_->areas, request.value);
  const MemoryArea* const area = find_area(memory_->areas, page_, request.address);
  return area != nullptr && (!request.writes || area->writable);
}

void PagedMemoryDevice::check_rules(const Access& request, bool immediate, Time at) {
  if (refused_address_) note(!request.writes && request.address == *refused_address_, memory_->refused_rule);
  if (fetching_) note(!request.writes && request.address == fetch_address_, memory_->fetch_rule);
  const bool writing = at < written_at_;
  refused_address_.reset();
  if (writing && !request.writes && !memory_->refused_rule.empty()) refused_address_ = request.address;
  const bool follows_write = written_at_ > Time{} && !page_changed_;
  if (request.writes && !immediate && follows_write) note(!writing, memory_->write_rule);
  if (page_changed_) page_changed_ = !expect(at >= page_ready_at_, memory_->page_rule, at);
}

// Returns whether a read of `address` is answered as busy; if so, begins to fetch the byte.
bool PagedMemoryDevice::fetches(std::uint8_t address, Time at, Time since) {
  if (memory_->fetch_time == Time{}) return false;
  const bool fetched = fetching_ && at - fetch_begin_ >= memory_->fetch_time;
  if (fetching_) expect(fetched, memory_->fetch_time_rule, at);
  fetching_ = !fetched || fetch_address_ != address;
  if (!fetching_) return false;
  fetch_address_ = address;
  fetch_begin_ = since;
  return true;
}

void PagedMemoryDevice::select(std::uint8_t page, Time since) {
  if (memory_->exclusive) written_at_ = Time{};
  page_ = page;
  page_ready_at_ = since + memory_->page_time;
  page_changed_ = true;
}

void PagedMemoryDevice::write_lasts(Time until) {
  if (memory_->exclusive) {
    page_ready_at_ = Time{};
    page_changed_ = false;
  }
  written_at_ = until;
}

void PagedMemoryDevice::restart_memory() {
  page_ = memory_->start_page;
  page_changed_ = false;
  page_ready_at_ = written_at_ = Time{};
  refused_address_.reset();
  fetching_ = false;
}

}  // namespace absenc::author
