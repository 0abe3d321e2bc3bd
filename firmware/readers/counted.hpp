// SPDX-License-Identifier: Apache-2.0
// An object whose member calls are counted. They must not be inlined, because call_graph.py finds them by their names.
#pragma once

#include <cstddef>
#include <new>

#include "firmware/readers/conversation.hpp"

namespace absenc::firmware {

template <class Item>
bool is_result(const Step<Item>& step) {
  return step.kind == Step<Item>::Kind::done || step.kind == Step<Item>::Kind::emit;
}
inline bool is_result(bool) { return true; }

template <class Reader>
class Counted {
 public:
  template <class... Parameters>
  [[gnu::noinline]] void make(const Parameters&... parameters) {
    reader_ = new (memory_) Reader(parameters...);
  }
  template <class Event>
  [[gnu::noinline]] void feed(const Event& event) {
    result_begin();
    feed_begin();
    reader_->feed(event);
    feed_end();
  }
  [[gnu::noinline]] auto next(Time now) {
    next_begin();
    const auto step = reader_->next(now);
    next_end();
    if (is_result(step)) result_end();
    return step;
  }
  [[nodiscard]] auto reading() const { return reader_->reading(); }

 private:
  alignas(Reader) std::byte memory_[sizeof(Reader)];
  Reader* reader_ = nullptr;
};

}  // namespace absenc::firmware
