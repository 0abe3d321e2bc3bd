// SPDX-License-Identifier: Apache-2.0
// Decodes the blocks of a reader in several threads, and joins them in the capture's order.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// A part of a capture as level changes of the requested channels, in the order of the request.
struct Levels {
  Tick first = 0;
  Tick end = 0;
  std::vector<Changes> changes;
};

/// Reads selected channels as level changes from a reader of samples or of changes.
class LevelReader {
 public:
  LevelReader(Reader& reader, std::vector<unsigned> channels) : reader_(reader), channels_(std::move(channels)) {}

  /// Returns why the capture cannot be read as levels, as a sentence; "" if it can be read.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] std::string name(unsigned channel) const;
  [[nodiscard]] const Layout& layout() const { return reader_.layout(); }

  /// Claims the next block, by one thread at a time; returns false if there is none.
  [[nodiscard]] bool claim(Block& block) { return reader_.claim(block); }
  /// Converts a claimed block to level changes; threads may do so at once with different blocks.
  void expand(Block& block, Levels& levels) const;

 private:
  Reader& reader_;
  std::vector<unsigned> channels_;
};

/// Reads parts of the capture into `parts` until `enough(levels)` is true or the capture ends. Consecutive parts
/// without level changes are merged.
template <class Enough>
void look_ahead(LevelReader& reader, std::vector<Levels>& parts, Enough&& enough) {
  Block block;
  for (bool more = true; more && reader.claim(block);) {
    Levels levels;
    reader.expand(block, levels);
    more = !enough(std::as_const(levels));
    const auto follows = [&](const Levels& before) {
      bool silent = before.end == levels.first;
      for (std::size_t i = 0; i < levels.changes.size(); ++i) {
        silent = silent && before.changes[i].at.empty() && levels.changes[i].at.empty() &&
                 before.changes[i].before == levels.changes[i].before;
      }
      return silent;
    };
    if (!parts.empty() && follows(parts.back())) {
      parts.back().end = levels.end;
    } else if (levels.first != levels.end) {
      parts.push_back(std::move(levels));
    }
  }
}

/// Decodes the rest of a reader's capture with several threads. `Decoding` must have
/// - `bool decode(const Levels&)`: decodes the next part, in order; returns false to end the run
/// - `Guess`, and `void guess(const Levels&, Guess&) const`: decodes in any thread a part at whose beginning the state
///   of the line is unknown
/// - `bool join(const Levels&, Guess&)`: works like `decode`, with the result of `guess`
///
/// The calling thread calls `decode` and `join`. `run` throws exceptions of the reader and the decoding.
template <class Decoding>
class BlockRun {
 public:
  BlockRun(LevelReader& reader, Decoding& decoding, unsigned threads)
      : reader_(reader), decoding_(decoding), threads_(threads), jobs_(threads < 2 ? 1 : 2 * threads) {
    for (Job& job : jobs_) free_jobs_.push_back(&job);
  }

  /// Decodes all blocks. Returns false if `decode` or `join` of the decoding ended the run.
  bool run() {
    if (threads_ < 2) return run_alone();
    bool wanted = true;
    {
      std::vector<std::jthread> workers;
      // the destructor of `stop` makes the worker threads end; it runs before the destructor of `workers`, which joins
      // these threads
      const Stop stop{*this};
      for (unsigned i = 1; i < threads_; ++i) workers.emplace_back([this, i] { work(i); });
      wanted = join_all();
      stop.now();
      workers.clear();
    }
    if (failure_) std::rethrow_exception(failure_);
    return wanted;
  }

 private:
  struct Job {
    Block block;
    Levels levels;
    typename Decoding::Guess guess;
    unsigned thread = 0;  // index of the thread whose cache holds the block
    bool ready = false;
  };
  struct Stop {
    BlockRun& run;
    void now() const {
      const std::lock_guard lock(run.mutex_);
      run.stopped_ = true;
      run.changed_.notify_all();
    }
    ~Stop() { now(); }
  };

  bool run_alone() {
    Job& job = jobs_.front();
    while (reader_.claim(job.block)) {
      reader_.expand(job.block, job.levels);
      if (!decoding_.decode(job.levels)) return false;
    }
    return true;
  }

  [[nodiscard]] bool can_claim() const { return !exhausted_ && !stopped_ && !claiming_ && !free_jobs_.empty(); }

  // Claims a block and prepares it; the lock is held before and after the call.
  void prepare(std::unique_lock<std::mutex>& lock, unsigned thread) {
    // Takes the block that this thread used last, because it is still in the cache of the processor.
    const auto last =
        std::find_if(free_jobs_.rbegin(), free_jobs_.rend(), [&](const Job* job) { return job->thread == thread; });
    const auto own = last == free_jobs_.rend() ? free_jobs_.begin() : last.base() - 1;
    Job& job = **own;
    free_jobs_.erase(own);
    job.thread = thread;
    claiming_ = true;
    lock.unlock();
    try {
      const bool claimed = reader_.claim(job.block);
      lock.lock();
      claiming_ = false;
      exhausted_ = !claimed;
      if (claimed) in_order_.push_back(&job);
      changed_.notify_all();
      if (!claimed) return;
      lock.unlock();
      reader_.expand(job.block, job.levels);
      std::as_const(decoding_).guess(job.levels, job.guess);
      lock.lock();
      job.ready = true;
    } catch (...) {
      if (!lock.owns_lock()) lock.lock();
      failure_ = std::current_exception();
      stopped_ = true;
    }
    changed_.notify_all();
  }

  void work(unsigned thread) {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return stopped_ || exhausted_ || can_claim(); });
      if (stopped_ || exhausted_) return;
      prepare(lock, thread);
    }
  }

  bool join_all() {
    std::unique_lock lock(mutex_);
    for (;;) {
      if (stopped_) return false;
      if (!in_order_.empty() && in_order_.front()->ready) {
        Job& job = *in_order_.front();
        lock.unlock();
        if (!decoding_.join(job.levels, job.guess)) return false;
        lock.lock();
        job.ready = false;
        in_order_.pop_front();
        free_jobs_.push_back(&job);
        changed_.notify_all();
      } else if (can_claim()) {
        prepare(lock, 0);
      } else if (exhausted_ && in_order_.empty()) {
        return true;
      } else {
        changed_.wait(lock);
      }
    }
  }

  LevelReader& reader_;
  Decoding& decoding_;
  unsigned threads_;
  std::vector<Job> jobs_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Job*> free_jobs_;
  std::deque<Job*> in_order_;  // blocks that were claimed and not yet joined, in the order of the capture
  bool claiming_ = false;
  bool exhausted_ = false;
  bool stopped_ = false;
  std::exception_ptr failure_;
};

}  // namespace absenc::capture
