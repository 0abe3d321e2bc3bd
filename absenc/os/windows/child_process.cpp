// SPDX-License-Identifier: Apache-2.0
// The channel is a named pipe whose other end is standard input of the child: that is a handle that it knows.
#include "absenc/os/child_process.hpp"

#include <windows.h>
// This header needs the types of windows.h.
#include <psapi.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <utility>
#include <vector>

#include "absenc/os/error.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/overlapped.hpp"
#include "absenc/os/windows/text.hpp"

namespace absenc::os {

namespace {

constexpr DWORD pipe_size = 1 << 16;

/// The process and its job: if the last handle of the job is closed, as at the end of the parent, the process ends.
class Child final : public Waitable {
 public:
  Child(Handle child, Handle job) : process(std::move(child)), job_(std::move(job)) {}
  HANDLE readable() override { return process.get(); }  // is set when the process has ended

  const Handle process;

 private:
  Handle job_;
};

struct PipeEnds {
  PipeEnds() {
    static std::atomic<unsigned> count{0};
    const std::wstring name =
        LR"(\\.\pipe\absenc-)" + std::to_wstring(::GetCurrentProcessId()) + L"-" + std::to_wstring(++count);
    ours = Handle(::CreateNamedPipeW(name.c_str(),
                                     PIPE_ACCESS_DUPLEX | FILE_FLAG_OVERLAPPED | FILE_FLAG_FIRST_PIPE_INSTANCE,
                                     PIPE_TYPE_BYTE | PIPE_REJECT_REMOTE_CLIENTS, 1, pipe_size, pipe_size, 0, nullptr));
    if (!ours) throw windows_failure("making a pipe", ::GetLastError());
    SECURITY_ATTRIBUTES inherited{sizeof(SECURITY_ATTRIBUTES), nullptr, TRUE};
    other = Handle(::CreateFileW(name.c_str(), GENERIC_READ | GENERIC_WRITE, 0, &inherited, OPEN_EXISTING,
                                 FILE_FLAG_OVERLAPPED, nullptr));
    nowhere = Handle(::CreateFileW(L"NUL", GENERIC_READ | GENERIC_WRITE, FILE_SHARE_READ | FILE_SHARE_WRITE, &inherited,
                                   OPEN_EXISTING, 0, nullptr));
    if (!other || !nowhere) throw windows_failure("opening a pipe", ::GetLastError());
  }
  Handle ours, other, nowhere;
};

/// The settings with which a process starts. It inherits its standard streams and nothing else.
class Startup {
 public:
  explicit Startup(const PipeEnds& ends) : inherited_{ends.other.get(), ends.nowhere.get()} {
    SIZE_T size = 0;
    ::InitializeProcThreadAttributeList(nullptr, 1, 0, &size);
    storage_.resize(size);
    info.lpAttributeList = reinterpret_cast<LPPROC_THREAD_ATTRIBUTE_LIST>(storage_.data());
    if (::InitializeProcThreadAttributeList(info.lpAttributeList, 1, 0, &size) == 0 ||
        ::UpdateProcThreadAttribute(info.lpAttributeList, 0, PROC_THREAD_ATTRIBUTE_HANDLE_LIST, inherited_.data(),
                                    sizeof inherited_, nullptr, nullptr) == 0) {
      throw windows_failure("starting this program again", ::GetLastError());
    }
    info.StartupInfo.cb = sizeof info;
    info.StartupInfo.dwFlags = STARTF_USESTDHANDLES;
    info.StartupInfo.hStdInput = ends.other.get();
    info.StartupInfo.hStdOutput = info.StartupInfo.hStdError = ends.nowhere.get();
  }
  ~Startup() { ::DeleteProcThreadAttributeList(info.lpAttributeList); }
  Startup(const Startup&) = delete;
  Startup& operator=(const Startup&) = delete;

  STARTUPINFOEXW info{};

 private:
  std::array<HANDLE, 2> inherited_;
  std::vector<char> storage_;
};

// Returns a new job of processes with this limit.
Handle make_job(const JOBOBJECT_EXTENDED_LIMIT_INFORMATION& limit) {
  Handle job(::CreateJobObjectW(nullptr, nullptr));
  JOBOBJECT_EXTENDED_LIMIT_INFORMATION copy = limit;
  if (job) ::SetInformationJobObject(job.get(), JobObjectExtendedLimitInformation, &copy, sizeof copy);
  return job;
}

std::string ending_of(DWORD status) {
  constexpr DWORD first_exception = 0xC0000000;
  if (status >= first_exception) return "by an " + text_of_error(status);
  return status == 0 ? std::string() : "with status " + std::to_string(status);
}

}  // namespace

bool Channel::send(std::string& bytes) const {
  Waitable& stream = *waitable_of(end_.get());
  while (!bytes.empty()) {
    const std::size_t size = std::min<std::size_t>(bytes.size(), pipe_size);
    if (stream.write({reinterpret_cast<const std::uint8_t*>(bytes.data()), size}) < 0) return errno == EAGAIN;
    bytes.erase(0, size);
  }
  return true;
}

bool Channel::receive(std::string& bytes) const {
  Waitable& stream = *waitable_of(end_.get());
  std::array<std::uint8_t, 65536> piece;  // the array is not initialised, because only received bytes are read from it
  for (;;) {
    const std::ptrdiff_t size = stream.read(piece);
    if (size < 0) return errno == EAGAIN;
    bytes.append(reinterpret_cast<const char*>(piece.data()), static_cast<std::size_t>(size));
    if (size == 0) return false;
  }
}

ChildProcess::ChildProcess(std::vector<std::string> arguments) : channel_(Descriptor()) {
  const auto failure = [] { return windows_failure("starting this program again", ::GetLastError()); };
  std::array<wchar_t, 32768> program{};
  if (::GetModuleFileNameW(nullptr, program.data(), static_cast<DWORD>(program.size())) == 0) throw failure();
  std::wstring command;
  for (const std::string& one : arguments) command += (command.empty() ? L"\"" : L" \"") + utf16(one) + L"\"";
  PipeEnds ends;
  Startup startup(ends);
  PROCESS_INFORMATION made{};
  // Without a console the child gets no Ctrl-C: the parent still needs it then.
  if (::CreateProcessW(program.data(), command.data(), nullptr, nullptr, TRUE,
                       CREATE_SUSPENDED | CREATE_NO_WINDOW | EXTENDED_STARTUPINFO_PRESENT, nullptr, nullptr,
                       &startup.info.StartupInfo, &made) == 0) {
    throw failure();
  }
  const Handle thread(made.hThread);
  JOBOBJECT_EXTENDED_LIMIT_INFORMATION limit{};
  limit.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE;
  Handle job = make_job(limit);
  ::AssignProcessToJobObject(job.get(), made.hProcess);
  number_ = descriptor_of(std::make_unique<Child>(Handle(made.hProcess), std::move(job))).release();
  channel_ = Channel(descriptor_of(std::make_unique<PipeStream>(std::move(ends.ours))));
  ::ResumeThread(thread.get());
}

ChildProcess::~ChildProcess() { end({}); }

std::string ChildProcess::end(Time longest) {
  const Descriptor ending(std::exchange(number_, -1));
  if (!ending) return {};
  const HANDLE process = dynamic_cast<Child&>(*waitable_of(ending.get())).process.get();
  const auto wait = static_cast<DWORD>(std::chrono::duration_cast<std::chrono::milliseconds>(longest).count());
  const bool by_itself = ::WaitForSingleObject(process, wait) == WAIT_OBJECT_0;
  if (!by_itself) {
    ::TerminateProcess(process, 1);
    ::WaitForSingleObject(process, INFINITE);
  }
  DWORD status = 0;
  ::GetExitCodeProcess(process, &status);
  return by_itself ? ending_of(status) : std::string();
}

Channel become_child(const char*, std::size_t bytes) {  // names of processes are those of their files
  PROCESS_MEMORY_COUNTERS memory{};
  ::GetProcessMemoryInfo(::GetCurrentProcess(), &memory, sizeof memory);
  JOBOBJECT_EXTENDED_LIMIT_INFORMATION limit{};
  limit.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_PROCESS_MEMORY;
  limit.ProcessMemoryLimit = memory.PagefileUsage + bytes;
  Handle job = make_job(limit);
  ::AssignProcessToJobObject(job.get(), ::GetCurrentProcess());
  static_cast<void>(job.release());  // the limit is there until the process ends
  return Channel(descriptor_of(std::make_unique<PipeStream>(Handle(::GetStdHandle(STD_INPUT_HANDLE)))));
}

}  // namespace absenc::os
