// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/process.hpp"

#include <fcntl.h>
#include <io.h>
#include <windows.h>
// This header needs the types of windows.h.
#include <shellapi.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <utility>

#include "absenc/os/error.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/files.hpp"
#include "absenc/os/windows/text.hpp"

namespace absenc::os {

namespace {

bool is_console(HANDLE stream) {
  DWORD mode = 0;
  return ::GetConsoleMode(stream, &mode) != 0;
}

// A console takes UTF-16, whatever its code page is; it takes a limited number of characters at once.
int write_console(HANDLE console, std::string_view bytes) {
  constexpr std::size_t most_at_once = 8192;
  const std::wstring wide = utf16(bytes);
  for (std::wstring_view text = wide; !text.empty();) {
    DWORD written = 0;
    const auto size = static_cast<DWORD>(std::min(text.size(), most_at_once));
    if (::WriteConsoleW(console, text.data(), size, &written, nullptr) == 0) return errno_of(::GetLastError());
    text.remove_prefix(written);
  }
  return 0;
}

int write_stream(HANDLE stream, std::string_view bytes) {
  if (stream == nullptr || stream == INVALID_HANDLE_VALUE) return EBADF;
  if (is_console(stream)) return write_console(stream, bytes);
  const bool is_file = ::GetFileType(stream) == FILE_TYPE_DISK;
  LARGE_INTEGER begin{};
  const bool is_placed = is_file && ::SetFilePointerEx(stream, LARGE_INTEGER{}, &begin, FILE_CURRENT) != 0;
  while (!bytes.empty()) {
    DWORD written = 0;
    if (::WriteFile(stream, bytes.data(), static_cast<DWORD>(std::min<std::size_t>(bytes.size(), 1 << 30)), &written,
                    nullptr) == 0 ||
        written == 0) {
      const DWORD error = ::GetLastError();
      // A partly written text is removed from a file, so that it ends with a whole line.
      if (is_placed && ::SetFilePointerEx(stream, begin, nullptr, FILE_BEGIN) != 0) ::SetEndOfFile(stream);
      return error == 0 ? ENOSPC : errno_of(error);
    }
    bytes.remove_prefix(written);
  }
  return 0;
}

// Returns the standard stream with this number of the C library.
HANDLE standard_stream(int number) {
  constexpr std::array names{STD_INPUT_HANDLE, STD_OUTPUT_HANDLE, STD_ERROR_HANDLE};
  return ::GetStdHandle(names[static_cast<std::size_t>(number)]);
}

}  // namespace

void protect_standard_streams() {
  for (const int stream : {0, 1, 2}) ::_setmode(stream, _O_BINARY);  // line ends stay as they are
}

int write_standard_output(std::string_view bytes) { return write_stream(standard_stream(1), bytes); }

void write_standard_error(std::string_view bytes) { static_cast<void>(write_stream(standard_stream(2), bytes)); }

void limit_thread_stacks() {}

bool is_terminal(int descriptor) {
  return descriptor >= 0 && descriptor <= 2 && is_console(standard_stream(descriptor));
}

// Without this name, ncurses would look for TERM, which some shells set. It would show faint text on a light
// background.
TerminalKind terminal_kind() { return {.name = "#win32con", .has_faint_text = false}; }

std::vector<std::string> command_words(int, char**) {
  int count = 0;
  wchar_t** const all = ::CommandLineToArgvW(::GetCommandLineW(), &count);
  if (all == nullptr) throw windows_failure("reading the command line", ::GetLastError());
  std::vector<std::string> words;
  for (int i = 0; i < count; ++i) words.push_back(utf8(all[i]));
  ::LocalFree(all);
  return words;
}

Time processor_time() {
  FILETIME begun{}, ended{}, kernel{}, user{};
  ::GetProcessTimes(::GetCurrentProcess(), &begun, &ended, &kernel, &user);
  const auto of = [](const FILETIME& time) {  // in units of 100 ns
    return Time(static_cast<std::int64_t>((std::uint64_t{time.dwHighDateTime} << 32 | time.dwLowDateTime) * 100));
  };
  return of(kernel) + of(user);
}

RunDelay::RunDelay() = default;

Time RunDelay::take() { return std::exchange(last_total_, Time{}); }  // Windows does not report it

int replaceable(const std::string& path) { return ::_waccess(utf16(path).c_str(), 2) == 0 ? 0 : errno; }

// The file may be opened a second time, read and renamed while it is open here.
NewFile::NewFile(const std::string& path)
    : path_(path), temporary_path_(os::temporary_path(path)), temporary_name_(temporary_path_) {
  constexpr DWORD share = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;
  file_ = open_file(temporary_path_, share, CREATE_NEW);
  if (!file_) {
    temporary_name_.clear();
    throw system_failure("writing " + path_, errno);
  }
}

NewFile::~NewFile() {
  file_ = Descriptor();
  if (!temporary_name_.empty()) ::DeleteFileW(utf16(temporary_name_).c_str());
}

void NewFile::write(std::string_view content) {
  const int error = write_at(file_.get(), static_cast<std::uint64_t>(::_lseeki64(file_.get(), 0, SEEK_END)), content);
  if (error != 0) throw system_failure("writing " + path_, error);
}

Descriptor NewFile::take_place(Durable durable) {
  if (durable == Durable::yes && ::FlushFileBuffers(handle_of_file(file_.get())) == 0) {
    throw windows_failure("writing " + path_, ::GetLastError());
  }
  if (const int error = rename_file(temporary_name_, path_, true); error != 0) {
    throw system_failure("writing " + path_, error);
  }
  temporary_name_.clear();
  return std::move(file_);
}

Descriptor nameless_file(const std::string& folder) {
  const std::filesystem::path where = path_of(folder.empty() ? "." : folder);
  // Windows has no files without a name, but removes this one together with its last handle.
  Descriptor file = open_file(temporary_path(name_of(where / "absenc")), FILE_SHARE_READ | FILE_SHARE_DELETE,
                              CREATE_NEW, FILE_ATTRIBUTE_TEMPORARY | FILE_FLAG_DELETE_ON_CLOSE);
  if (!file) throw system_failure("writing to " + name_of(where), errno);
  return file;
}

}  // namespace absenc::os
