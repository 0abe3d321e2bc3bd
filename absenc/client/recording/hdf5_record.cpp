// SPDX-License-Identifier: Apache-2.0
// Records rows as HDF5, in a thread of its own.
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "absenc/client/recording/hdf5_table.hpp"
#include "absenc/client/recording/record_file.hpp"
#include "absenc/os/line_file.hpp"

namespace absenc::client {

namespace {

constexpr std::chrono::milliseconds between_commits{250};

Hdf5Attributes attributes_of(const RecordHeader& header) {
  return {{"absenc_record", std::uint64_t{1}},
          {"encoder", header.encoder},
          {"protocol", header.protocol},
          {"model", header.model},
          {"options", header.options},
          {"started", header.started},
          {"rate_hz", header.rate_hz},
          {"every", header.every},
          {"part", header.part}};
}

// Makes the new file visible under its name, so that readers can already open it.
std::uint64_t appear(os::BlockFile& file) {
  file.appear();
  return file.size();
}

class Hdf5Record final : public RecordFile {
 public:
  Hdf5Record(const std::string& path, std::span<const Column> columns, const RecordHeader& header)
      : file_(path),
        table_({.grow = [this](std::uint64_t size) { file_.grow(size); },
                .write = [this](std::uint64_t at, Bytes bytes) { file_.write(at, bytes); },
                .read = [this](std::uint64_t at, MutableBytes bytes) { file_.read(at, bytes); }},
               columns, attributes_of(header)),
        rows_(columns),
        size_(appear(file_)),
        thread_([this](const std::stop_token& stop) { work(stop); }) {}

  ~Hdf5Record() override {
    thread_.request_stop();
    thread_.join();
  }

  void append(const Row& row, const RecordCounts& counts) override {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    rows_.add(row);
    counts_ += counts;
  }

  void sync() override {
    {
      std::unique_lock lock(mutex_);
      const std::uint64_t mine = ++asked_;
      changed_.notify_all();
      changed_.wait(lock, [&] { return served_ >= mine || failure_; });
      if (failure_) std::rethrow_exception(failure_);
    }
    file_.sync();
  }

  void finish() override {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
    }
    sync();
  }

  void require_there() const override {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    file_.require_there();
  }

  std::uint64_t size() const override {
    const std::lock_guard lock(mutex_);
    return size_;
  }
  RecordCounts counts() const override {
    const std::lock_guard lock(mutex_);
    return committed_;
  }

 private:
  void work(const std::stop_token& stop) {
    try {
      while (!stop.stop_requested()) {
        {
          std::unique_lock lock(mutex_);
          changed_.wait_for(lock, stop, between_commits, [this] { return asked_ != served_; });
        }
        commit();
      }
    } catch (...) {  // stores the exception; `append`, `sync`, `finish` and `require_there` throw it to the caller
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
      changed_.notify_all();
    }
  }

  void commit() {
    Hdf5Rows rows = rows_of_now();
    table_.commit(rows);
    if (is_last_) table_.finish();
    const std::lock_guard lock(mutex_);
    committed_ += taken_;
    size_ = file_.size();
    served_ = serving_;
    changed_.notify_all();
  }

  Hdf5Rows rows_of_now() {
    const std::lock_guard lock(mutex_);
    Hdf5Rows rows = rows_;
    rows_.clear();
    taken_ = std::exchange(counts_, {});
    serving_ = asked_;
    is_last_ = ending_;
    return rows;
  }

  os::BlockFile file_;
  Hdf5Table table_;  // table in the HDF5 file; only the thread that writes the file uses it
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  Hdf5Rows rows_;        // rows that wait to be written
  RecordCounts counts_;  // counts of the rows that wait to be written
  RecordCounts taken_;   // counts of the rows that the thread is writing now
  RecordCounts committed_;
  std::uint64_t size_;
  // `sync` numbers its calls. Numbers of the last call that was made, the call that the thread is executing, and the
  // last call that is finished:
  std::uint64_t asked_ = 0;
  std::uint64_t serving_ = 0;
  std::uint64_t served_ = 0;
  bool ending_ = false;
  bool is_last_ = false;  // whether the thread is writing the last rows of the file now
  std::exception_ptr failure_;
  std::jthread thread_;  // declared last, because the thread uses all other members of this object
};

}  // namespace

std::unique_ptr<RecordFile> make_hdf5_file(const std::string& path, std::span<const Column> columns,
                                           const RecordHeader& header) {
  return std::make_unique<Hdf5Record>(path, columns, header);
}

}  // namespace absenc::client
