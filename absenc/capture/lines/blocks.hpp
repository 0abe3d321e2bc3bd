// SPDX-License-Identifier: Apache-2.0
// Blocks of a reader on their way through several threads: expanded and decoded by guess in any order, joined in
// theirs.
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

/// A part of a capture as level changes, in the order of the channels that were asked for.
struct Levels {
  Tick first = 0;
  Tick end = 0;
  std::vector<Changes> changes;
};

/// Chosen channels of a reader, whatever it reads.
class LevelReader {
 public:
  LevelReader(Reader& reader, std::vector<unsigned> channels) : reader_(reader), channels_(std::move(channels)) {}

  /// Why it cannot be read as levels: a sentence, or "".
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] std::string name(unsigned channel) const;
  [[nodiscard]] const Layout& layout() const { return reader_.layout(); }

  /// One caller at a time.
  [[nodiscard]] bool claim(Block& block) { return reader_.claim(block); }
  /// Any number of callers, each with a block of its own that was claimed.
  void expand(Block& block, Levels& levels) const;

 private:
  Reader& reader_;
  std::vector<unsigned> channels_;
};

/// Reads parts into `parts` until `enough(levels)` is true, which sees each in turn, or the capture ends. What is
/// silent takes no room, however long it is.
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

/// Decodes all that is left of the reader. `Decoding` has
/// - `bool decode(const Levels&)`: the next part, in order; false: no more is wanted
/// - `Guess`, and `void guess(const Levels&, Guess&) const`: from any thread, a part whose beginning is not known
/// - `bool join(const Levels&, Guess&)`: as decode, with what was guessed
/// A guess takes a character or word to begin with the first change. The true state runs into the block until it begins
/// one where the guess did too: from there on both depend on nothing but what follows, and the guess is right. Where
/// they never meet the block is decoded twice, and still right.
///
/// decode and join are called by the calling thread. Blocks in flight: two for each thread. What a reader or the
/// decoding throws is thrown here.
template <class Decoding>
class BlockRun {
 public:
  BlockRun(LevelReader& reader, Decoding& decoding, unsigned threads)
      : reader_(reader), decoding_(decoding), threads_(threads), jobs_(threads < 2 ? 1 : 2 * threads) {
    for (Job& job : jobs_) free_.push_back(&job);
  }

  /// False: no more was wanted.
  bool run() {
    if (threads_ < 2) return run_alone();
    bool wanted = true;
    {
      std::vector<std::jthread> workers;
      const Stop stop{*this};  // before the workers are waited for
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
    unsigned thread = 0;  // in whose cache it is
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

  [[nodiscard]] bool can_claim() const { return !exhausted_ && !stopped_ && !claiming_ && !free_.empty(); }

  // Takes a block and prepares it; the lock is held before and after. One thread claims, which of text is most of the
  // work, while the others decode what was claimed before.
  void prepare(std::unique_lock<std::mutex>& lock, unsigned thread) {
    // The last that this thread had is still in its cache.
    const auto last = std::find_if(free_.rbegin(), free_.rend(), [&](const Job* job) { return job->thread == thread; });
    const auto own = last == free_.rend() ? free_.begin() : last.base() - 1;
    Job& job = **own;
    free_.erase(own);
    job.thread = thread;
    claiming_ = true;
    lock.unlock();
    try {
      const bool claimed = reader_.claim(job.block);
      lock.lock();
      claiming_ = false;
      exhausted_ = !claimed;
      if (claimed) flying_.push_back(&job);
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
      if (!flying_.empty() && flying_.front()->ready) {
        Job& job = *flying_.front();
        lock.unlock();
        if (!decoding_.join(job.levels, job.guess)) return false;
        lock.lock();
        job.ready = false;
        flying_.pop_front();
        free_.push_back(&job);
        changed_.notify_all();
      } else if (can_claim()) {
        prepare(lock, 0);
      } else if (exhausted_ && flying_.empty()) {
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
  std::vector<Job*> free_;
  std::deque<Job*> flying_;  // in the order of the capture
  bool claiming_ = false;
  bool exhausted_ = false;
  bool stopped_ = false;
  std::exception_ptr failure_;
};

}  // namespace absenc::capture
