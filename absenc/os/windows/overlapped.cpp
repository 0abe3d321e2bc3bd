// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/windows/overlapped.hpp"

#include <algorithm>
#include <cerrno>

#include "absenc/os/signals.hpp"
#include "absenc/os/windows/errors.hpp"

namespace absenc::os {

namespace {
constexpr std::chrono::milliseconds last_write{1000};  // time for the last bytes to leave before a stream is closed
}

void OverlappedStream::begin() {
  if (is_reading_ || ended_) return;
  ::ResetEvent(read_done_.get());
  reading_ = {};
  reading_.hEvent = read_done_.get();
  const DWORD error = start_read(received_.data(), read_size(), reading_);
  is_reading_ = error == 0 || error == ERROR_IO_PENDING;
  if (is_reading_) return;
  ended_ = true;
  read_error_ = errno_of(error);
  ::SetEvent(read_done_.get());
}

void OverlappedStream::end() {
  if (!is_reading_ && !is_writing_) return;
  cancel();
  DWORD size = 0;
  if (std::exchange(is_reading_, false)) static_cast<void>(result(reading_, size, true));
  if (std::exchange(is_writing_, false)) static_cast<void>(result(writing_, size, true));
}

// Takes the bytes of the read that was under way. Returns false if it still is.
bool OverlappedStream::take_read() {
  DWORD size = 0;
  const DWORD error = result(reading_, size, false);
  if (error == ERROR_IO_INCOMPLETE) return false;
  is_reading_ = false;
  from_ = 0;
  to_ = error == 0 ? size : 0;
  if (to_ > 0) to_ += read_rest(MutableBytes(received_).subspan(to_));
  if (error == 0 && (size > 0 || !ends_with_nothing())) return true;
  ended_ = true;
  read_error_ = error == 0 ? 0 : errno_of(error);
  return true;
}

std::ptrdiff_t OverlappedStream::read(MutableBytes into) {
  while (from_ == to_ && !ended_) {
    begin();
    if (ended_) break;
    if (!take_read()) {
      errno = EAGAIN;
      return -1;
    }
  }
  if (from_ == to_) {
    errno = read_error_;
    return read_error_ == 0 ? 0 : -1;
  }
  const std::size_t size = std::min(into.size(), to_ - from_);
  std::copy_n(received_.begin() + static_cast<std::ptrdiff_t>(from_), size, into.begin());
  from_ += size;
  if (from_ == to_) begin();  // the event must show whether more bytes are there
  return static_cast<std::ptrdiff_t>(size);
}

// Takes the result of the last write. Returns false if it is still under way.
bool OverlappedStream::settle_write() {
  if (!is_writing_) return true;
  DWORD size = 0;
  const DWORD error = result(writing_, size, false);
  if (error == ERROR_IO_INCOMPLETE) return false;
  is_writing_ = false;
  if (error != 0) write_error_ = errno_of(error);
  ::SetEvent(write_done_.get());
  return true;
}

bool OverlappedStream::flush(Time deadline) {
  const HANDLE done = write_done_.get();
  while (!settle_write()) {
    if (!wait_any({&done, 1}, deadline)) return false;
  }
  return true;
}

void OverlappedStream::drain(std::chrono::milliseconds longest) {
  if (!settle_write()) ::WaitForSingleObject(write_done_.get(), static_cast<DWORD>(longest.count()));
  static_cast<void>(settle_write());
}

std::ptrdiff_t OverlappedStream::write(Bytes bytes) {
  if (!settle_write()) {
    errno = EAGAIN;
    return -1;
  }
  if (write_error_ != 0) {
    errno = std::exchange(write_error_, 0);
    return -1;
  }
  sent_.assign(bytes.begin(), bytes.end());
  ::ResetEvent(write_done_.get());
  writing_ = {};
  writing_.hEvent = write_done_.get();
  const DWORD error = start_write(sent_.data(), static_cast<DWORD>(sent_.size()), writing_);
  is_writing_ = error == 0 || error == ERROR_IO_PENDING;
  if (is_writing_) return static_cast<std::ptrdiff_t>(bytes.size());
  ::SetEvent(write_done_.get());
  errno = errno_of(error);
  return -1;
}

PortStream::PortStream(Handle port) : port_(std::move(port)), rest_done_(make_event()) {
  // With these times a read of one byte waits for it, and other reads return what is there.
  COMMTIMEOUTS times{};
  times.ReadIntervalTimeout = MAXDWORD;
  times.ReadTotalTimeoutMultiplier = MAXDWORD;
  times.ReadTotalTimeoutConstant = MAXDWORD - 1;
  ::SetCommTimeouts(port_.get(), &times);
  begin();
}

PortStream::~PortStream() {
  drain(last_write);
  end();
}

void PortStream::discard_received() {
  std::array<std::uint8_t, 4096> unread;
  ::PurgeComm(port_.get(), PURGE_RXCLEAR);
  while (read(unread) > 0) {
  }
}

DWORD PortStream::start_read(void* into, DWORD size, OVERLAPPED& operation) {
  return ::ReadFile(port_.get(), into, size, nullptr, &operation) != 0 ? 0 : ::GetLastError();
}

DWORD PortStream::read_rest(MutableBytes into) {
  COMSTAT state{};
  DWORD errors = 0;
  if (::ClearCommError(port_.get(), &errors, &state) == 0 || state.cbInQue == 0) return 0;
  OVERLAPPED operation{};
  operation.hEvent = rest_done_.get();
  DWORD size = 0;
  const DWORD error = start_read(into.data(), std::min(state.cbInQue, static_cast<DWORD>(into.size())), operation);
  if (error != 0 && error != ERROR_IO_PENDING) return 0;
  return result(operation, size, true) == 0 ? size : 0;
}

DWORD PortStream::start_write(const void* bytes, DWORD size, OVERLAPPED& operation) {
  return ::WriteFile(port_.get(), bytes, size, nullptr, &operation) != 0 ? 0 : ::GetLastError();
}

DWORD PortStream::result(OVERLAPPED& operation, DWORD& size, bool waits) {
  return ::GetOverlappedResult(port_.get(), &operation, &size, waits ? TRUE : FALSE) != 0 ? 0 : ::GetLastError();
}

PipeStream::PipeStream(Handle pipe) : pipe_(std::move(pipe)) { begin(); }

PipeStream::~PipeStream() {
  drain(last_write);
  end();
}

DWORD PipeStream::start_read(void* into, DWORD size, OVERLAPPED& operation) {
  return ::ReadFile(pipe_.get(), into, size, nullptr, &operation) != 0 ? 0 : ::GetLastError();
}

DWORD PipeStream::start_write(const void* bytes, DWORD size, OVERLAPPED& operation) {
  return ::WriteFile(pipe_.get(), bytes, size, nullptr, &operation) != 0 ? 0 : ::GetLastError();
}

DWORD PipeStream::result(OVERLAPPED& operation, DWORD& size, bool waits) {
  return ::GetOverlappedResult(pipe_.get(), &operation, &size, waits ? TRUE : FALSE) != 0 ? 0 : ::GetLastError();
}

SocketStream::SocketStream(SOCKET socket) : socket_(socket) { begin(); }

SocketStream::~SocketStream() {
  drain(last_write);
  end();
  ::closesocket(socket_);
}

DWORD SocketStream::start_read(void* into, DWORD size, OVERLAPPED& operation) {
  WSABUF buffer{size, static_cast<char*>(into)};
  DWORD flags = 0;
  return ::WSARecv(socket_, &buffer, 1, nullptr, &flags, &operation, nullptr) == 0
             ? 0
             : static_cast<DWORD>(::WSAGetLastError());
}

DWORD SocketStream::start_write(const void* bytes, DWORD size, OVERLAPPED& operation) {
  WSABUF buffer{size, static_cast<char*>(const_cast<void*>(bytes))};  // WSASend does not change the bytes
  return ::WSASend(socket_, &buffer, 1, nullptr, 0, &operation, nullptr) == 0 ? 0
                                                                              : static_cast<DWORD>(::WSAGetLastError());
}

DWORD SocketStream::result(OVERLAPPED& operation, DWORD& size, bool waits) {
  DWORD flags = 0;
  return ::WSAGetOverlappedResult(socket_, &operation, &size, waits ? TRUE : FALSE, &flags) != 0
             ? 0
             : static_cast<DWORD>(::WSAGetLastError());
}

}  // namespace absenc::os
