// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/spidev_node.hpp"

#include <fcntl.h>
#include <fuse3/cuse_lowlevel.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "absenc/os/descriptor.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

using Kind = Failure::Kind;

namespace {

constexpr const char* control_path = "/dev/cuse";

Failure control_failure(int error) {
  const std::string path = control_path;
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return {Kind::not_found, "there is no " + path + ": load the kernel's module (`sudo modprobe cuse`)"};
    case EACCES:
    case EPERM:
      return {Kind::no_permission, "no permission to open " + path +
                                       ", which makes devices: run this with sudo, or let a udev rule give it "
                                       "to your group"};
    default:
      return system_failure("opening " + path, error);
  }
}

std::string checked(const std::string& name) {
  const auto belongs = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-';
  };
  if (name.empty() || name.front() == '.' || name.size() > 64 || !std::all_of(name.begin(), name.end(), belongs)) {
    throw Failure(Kind::unsupported, "\"" + name +
                                         "\" is no name for a device: write letters, digits, '.', '_' and '-', "
                                         "as in spidev9.0");
  }
  return name;
}

std::vector<iovec> ranges(const std::vector<UserMemory>& memory) {
  std::vector<iovec> found;
  for (const UserMemory& one : memory) {
    // The pointer is an address in the memory of another process; only the kernel uses it.
    found.push_back({reinterpret_cast<void*>(static_cast<std::uintptr_t>(one.address)), one.size});
  }
  return found;
}

}  // namespace

/// Callbacks of libfuse. They must not throw, because libfuse is C.
struct SpidevNodeCalls {
  using Operation = SpidevNode::Operation;

  static SpidevNode& node(fuse_req_t request) { return *static_cast<SpidevNode*>(fuse_req_userdata(request)); }

  static void made(void* node) { static_cast<SpidevNode*>(node)->made_ = true; }

  static void open(fuse_req_t request, fuse_file_info* file) {
    node(request).spidev_->open();
    fuse_reply_open(request, file);
  }
  static void release(fuse_req_t request, fuse_file_info*) {
    node(request).spidev_->close();
    fuse_reply_err(request, 0);
  }
  static void read(fuse_req_t request, std::size_t size, off_t, fuse_file_info*) {
    node(request).pending_ = {request, node(request).spidev_->read(size, now()), Operation::read};
  }
  static void write(fuse_req_t request, const char* bytes, std::size_t size, off_t, fuse_file_info*) {
    const Bytes out(reinterpret_cast<const std::uint8_t*>(bytes), size);
    node(request).pending_ = {request, node(request).spidev_->write(out, now()), Operation::write};
  }
  static void control(fuse_req_t request, int command, void* argument, fuse_file_info*, unsigned, const void* in,
                      std::size_t in_size, std::size_t room) {
    const auto number = static_cast<unsigned long>(static_cast<unsigned>(command));
    const Bytes bytes(static_cast<const std::uint8_t*>(in), in_size);
    const auto address = static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(argument));
    node(request).pending_ = {request, node(request).spidev_->control(number, address, bytes, room, now()),
                              Operation::control};
  }

  static constexpr cuse_lowlevel_ops all{.init = nullptr,
                                         .init_done = made,
                                         .destroy = nullptr,
                                         .open = open,
                                         .read = read,
                                         .write = write,
                                         .flush = nullptr,
                                         .release = release,
                                         .fsync = nullptr,
                                         .ioctl = control,
                                         .poll = nullptr};
};

void SpidevNode::CloseSession::operator()(fuse_session* session) const { fuse_session_destroy(session); }

SpidevNode::SpidevNode(const std::string& name, Spidev& spidev) : spidev_(&spidev), path_("/dev/" + checked(name)) {
  std::error_code ignored;
  if (std::filesystem::exists(std::filesystem::symlink_status(path_, ignored))) {
    throw Failure(Kind::in_use, path_ + " exists: choose another name");
  }
  Descriptor control(::open(control_path, O_RDWR | O_CLOEXEC | O_NONBLOCK));
  if (!control) throw control_failure(errno);

  std::string program = "absenc";
  std::array<char*, 2> words{program.data(), nullptr};
  fuse_args arguments{1, words.data(), 0};
  std::string device_name = "DEVNAME=" + name;
  std::array<const char*, 1> information{device_name.c_str()};
  const cuse_info info{.dev_major = 0,
                       .dev_minor = 0,
                       .dev_info_argc = information.size(),
                       .dev_info_argv = information.data(),
                       .flags = CUSE_UNRESTRICTED_IOCTL};
  session_.reset(cuse_lowlevel_new(&arguments, &info, &SpidevNodeCalls::all, this));
  fuse_opt_free_args(&arguments);
  const std::string what = "making " + path_;
  if (!session_) throw Failure(Kind::system, what + " failed: libfuse made no session");
  // The FUSE session takes ownership of the CUSE descriptor.
  const std::string descriptor_name = "/dev/fd/" + std::to_string(control.get());
  if (fuse_session_mount(session_.get(), descriptor_name.c_str()) != 0) {
    throw Failure(Kind::system, what + " failed: libfuse did not take " + control_path);
  }
  static_cast<void>(control.release());

  while (!made_) {
    Watched readable{.descriptor = fuse_session_fd(session_.get())};
    wait_for({&readable, 1}, never);
    process_one();
  }
  // The kernel reports no error if it refuses the name of the device.
  if (!std::filesystem::exists(path_, ignored)) {
    throw Failure(Kind::system,
                  "the kernel did not make " + path_ + ": see what it says in dmesg, or choose another name");
  }
}

SpidevNode::~SpidevNode() {
  if (pending_) fuse_reply_err(static_cast<fuse_req_t>(pending_->request), ESHUTDOWN);
}

void SpidevNode::serve(Time end) {
  for (;;) {
    Watched readable{.descriptor = fuse_session_fd(session_.get())};
    const bool ready = wait_for({&readable, 1}, std::min(end, spidev_->device().timer()));
    const Time time = now();
    if (time >= end) return;
    if (!ready) {
      spidev_->device().wake(time);
      continue;
    }
    process_one();
    if (pending_) answer();
  }
}

void SpidevNode::process_one() {
  fuse_buf buffer{};
  const int size = fuse_session_receive_buf(session_.get(), &buffer);
  const std::unique_ptr<void, decltype(&std::free)> memory(buffer.mem, std::free);
  // The kernel has no request, for example because the program that made the request has ended.
  if (size == -EINTR || size == -EAGAIN) return;
  if (size > 0) fuse_session_process_buf(session_.get(), &buffer);
  if (size <= 0 || fuse_session_exited(session_.get()) != 0) {
    throw Failure(Kind::lost, "the kernel took " + path_ + " away: see what it says in dmesg");
  }
}

void SpidevNode::answer() {
  reach(pending_->reply.at);
  const Pending pending = *std::exchange(pending_, std::nullopt);
  const auto request = static_cast<fuse_req_t>(pending.request);
  const SpidevReply& reply = pending.reply;
  const auto* const bytes = reinterpret_cast<const char*>(reply.bytes.data());
  if (reply.again) {
    const std::vector<iovec> in = ranges(reply.in);
    const std::vector<iovec> out = ranges(reply.out);
    fuse_reply_ioctl_retry(request, in.data(), in.size(), out.data(), out.size());
  } else if (reply.result < 0) {
    fuse_reply_err(request, -reply.result);
  } else if (pending.operation == Operation::control) {
    fuse_reply_ioctl(request, reply.result, bytes, reply.bytes.size());
  } else if (pending.operation == Operation::read) {
    fuse_reply_buf(request, bytes, reply.bytes.size());
  } else {
    fuse_reply_write(request, static_cast<std::size_t>(reply.result));
  }
}

}  // namespace absenc::os
