// SPDX-License-Identifier: Apache-2.0
// A stream of bytes that Windows reads and writes while the program goes on (overlapped I/O).
#pragma once

#include <winsock2.h>

#include <array>
#include <cstdint>
#include <vector>

#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {

/// One read is always under way. A write returns at once; the next one waits for its end.
class OverlappedStream : public Waitable {
 public:
  HANDLE readable() final { return read_done_.get(); }
  HANDLE writable() final { return write_done_.get(); }
  std::ptrdiff_t read(MutableBytes into) final;
  std::ptrdiff_t write(Bytes bytes) final;

  /// Waits until the last write has ended, at most until `deadline`. Returns whether it has. Throws as `wait_any` does.
  bool flush(Time deadline);
  /// The same for destructors: Ctrl-C does not end it.
  void drain(std::chrono::milliseconds longest);

 protected:
  OverlappedStream() : read_done_(make_event()), write_done_(make_event(true)) {}
  /// Begins the first read; the constructor of a derived class calls it last.
  void begin();
  /// Ends what is under way; the destructor of a derived class calls it first.
  void end();

  /// Begin an operation; return 0 or an error of Windows, ERROR_IO_PENDING while it is under way.
  virtual DWORD start_read(void* into, DWORD size, OVERLAPPED& operation) = 0;
  virtual DWORD start_write(const void* bytes, DWORD size, OVERLAPPED& operation) = 0;
  /// Returns the error of an operation, 0 if it has succeeded, ERROR_IO_INCOMPLETE while it is under way.
  virtual DWORD result(OVERLAPPED& operation, DWORD& size, bool waits) = 0;
  virtual void cancel() = 0;
  /// Returns the number of bytes that a read may ask for.
  [[nodiscard]] virtual DWORD read_size() const { return static_cast<DWORD>(received_.size()); }
  /// Reads what is there beside the bytes of the read that has ended, and returns the number of bytes.
  virtual DWORD read_rest(MutableBytes) { return 0; }
  /// Returns whether a read of no bytes is the end of the stream; of a port it is the end of a long time.
  [[nodiscard]] virtual bool ends_with_nothing() const = 0;

 private:
  bool take_read();
  bool settle_write();

  Handle read_done_;
  Handle write_done_;
  OVERLAPPED reading_{};
  OVERLAPPED writing_{};
  std::array<std::uint8_t, 4096> received_;
  std::size_t from_ = 0;  // range of the bytes in `received_` that `read` has not returned yet
  std::size_t to_ = 0;
  bool is_reading_ = false;
  bool is_writing_ = false;
  bool ended_ = false;
  int read_error_ = 0;              // value of errno that has ended the stream
  int write_error_ = 0;             // value of errno of a write that had begun
  std::vector<std::uint8_t> sent_;  // the bytes of the write that is under way
};

/// A serial port. A read waits for one byte, and the bytes behind it are taken without waiting: reads that wait for
/// some bytes, but end with fewer, are not the same in all drivers, and wine has none.
class PortStream final : public OverlappedStream {
 public:
  explicit PortStream(Handle port);
  ~PortStream() override;
  [[nodiscard]] HANDLE port() const { return port_.get(); }
  /// Discards the received bytes that `read` has not returned yet.
  void discard_received();

 private:
  DWORD start_read(void* into, DWORD size, OVERLAPPED& operation) override;
  DWORD start_write(const void* bytes, DWORD size, OVERLAPPED& operation) override;
  DWORD result(OVERLAPPED& operation, DWORD& size, bool waits) override;
  void cancel() override { ::CancelIoEx(port_.get(), nullptr); }
  [[nodiscard]] DWORD read_size() const override { return 1; }
  DWORD read_rest(MutableBytes into) override;
  [[nodiscard]] bool ends_with_nothing() const override { return false; }

  Handle port_;
  Handle rest_done_;
};

/// One end of a pipe between two processes.
class PipeStream final : public OverlappedStream {
 public:
  explicit PipeStream(Handle pipe);
  ~PipeStream() override;

 private:
  DWORD start_read(void* into, DWORD size, OVERLAPPED& operation) override;
  DWORD start_write(const void* bytes, DWORD size, OVERLAPPED& operation) override;
  DWORD result(OVERLAPPED& operation, DWORD& size, bool waits) override;
  void cancel() override { ::CancelIoEx(pipe_.get(), nullptr); }
  [[nodiscard]] bool ends_with_nothing() const override { return false; }

  Handle pipe_;
};

/// A TCP connection.
class SocketStream final : public OverlappedStream {
 public:
  explicit SocketStream(SOCKET socket);
  ~SocketStream() override;

 private:
  DWORD start_read(void* into, DWORD size, OVERLAPPED& operation) override;
  DWORD start_write(const void* bytes, DWORD size, OVERLAPPED& operation) override;
  DWORD result(OVERLAPPED& operation, DWORD& size, bool waits) override;
  void cancel() override { ::CancelIoEx(reinterpret_cast<HANDLE>(socket_), nullptr); }
  [[nodiscard]] bool ends_with_nothing() const override { return true; }

  SOCKET socket_;
};

}  // namespace absenc::os
