// SPDX-License-Identifier: Apache-2.0
// A thread for long tasks, so that the threads that request them do not wait.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace absenc::serve {

class Worker {
 public:
  static constexpr std::size_t most = 64;

  Worker() : thread_([this](const std::stop_token& stop) { work(stop); }) {}

  /// Adds a job, which must not throw. With `always` false, refuses the job and returns false if too many jobs wait.
  bool add(std::function<void()> job, bool always = false) {
    const std::lock_guard lock(mutex_);
    if (jobs_.size() >= most && !always) return false;
    jobs_.push_back(std::move(job));
    changed_.notify_one();
    return true;
  }

 private:
  void work(const std::stop_token& stop) {
    for (;;) {
      std::function<void()> job;
      {
        std::unique_lock lock(mutex_);
        if (!changed_.wait(lock, stop, [&] { return !jobs_.empty(); })) return;
        job = std::move(jobs_.front());
        jobs_.pop_front();
      }
      if (stop.stop_requested()) return;
      job();
    }
  }

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<std::function<void()>> jobs_;
  std::jthread thread_;  // the last member: when the thread starts, all members that it uses exist
};

}  // namespace absenc::serve
