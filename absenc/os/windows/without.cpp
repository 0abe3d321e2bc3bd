// SPDX-License-Identifier: Apache-2.0
// Places of Linux that Windows does not have: SocketCAN, spidev, devices that a program serves, the list of FTDI chips.
#include <cerrno>

#include "absenc/os/error.hpp"
#include "absenc/os/ftdi_usb.hpp"
#include "absenc/os/socketcan.hpp"
#include "absenc/os/spi_port.hpp"
#include "absenc/os/spidev.hpp"
#include "absenc/os/spidev_node.hpp"

struct fuse_session {};

namespace absenc::os {

namespace {

Failure not_here(const std::string& what, const std::string& instead) {
  return {Failure::Kind::unsupported, what + " is a place of Linux, which Windows does not have: use " + instead};
}

int lacks_call() {
  errno = ENOSYS;
  return -1;
}

class NoFtdi final : public FtdiUsb {
 public:
  std::vector<FtdiAdapter> adapters() override { return {}; }
  std::unique_ptr<FtdiChannel> open(const FtdiAdapter& adapter, char) override {
    throw not_here("the clock of the " + adapter.words(), "a computer with Linux");
  }
};

NoFtdi no_ftdi;
FtdiUsb* all_ftdi = &no_ftdi;

}  // namespace

int CanKernel::open() { return lacks_call(); }
int CanKernel::control(int, unsigned long, void*) { return lacks_call(); }
int CanKernel::set(int, int, int, const void*, std::size_t) { return lacks_call(); }
int CanKernel::bind(int, int) { return lacks_call(); }
std::ptrdiff_t CanKernel::write(int, const can_frame&) { return lacks_call(); }
std::ptrdiff_t CanKernel::read(int, can_frame&, std::optional<Time>&) { return lacks_call(); }
ClockPair CanKernel::clocks() { return {}; }

CanKernel& system_can_kernel() {
  static CanKernel kernel;
  return kernel;
}

SocketCan::SocketCan(const std::string& interface, const LineSettings&, CanKernel& kernel)
    : kernel_(&kernel), stamps_(kernel.clocks()) {
  throw not_here("the CAN interface " + interface, "an slcan adapter, as in slcan:COM5");
}

void SocketCan::collect(Time) {}
void SocketCan::send(const CanFrame&) {}
void SocketCan::apply(const LineSettings&) {}

std::vector<std::string> can_interfaces(const std::filesystem::path&) { return {}; }

int SpiKernel::open(const std::string&) { return lacks_call(); }
int SpiKernel::control(int, unsigned long, void*) { return lacks_call(); }

SpiKernel& system_kernel() {
  static SpiKernel kernel;
  return kernel;
}

SpiPort::SpiPort(const std::string& path, LinkKind kind, const LineSettings&, const SpiChoice&, SpiKernel& kernel)
    : TransferPort(kind), kernel_(&kernel) {
  throw not_here("the SPI controller " + path, "a computer with Linux");
}

void SpiPort::exchange(const Step<std::uint8_t>&, TransferResult&) {}
void SpiPort::change_rate(std::uint32_t) {}

std::vector<std::string> spi_devices(const std::filesystem::path&) { return {}; }

Spidev::Spidev(SpiDevice& device) : device_(&device), board_speed_(0) {}

SpidevNode::SpidevNode(const std::string& name, Spidev& spidev) : spidev_(&spidev) {
  throw not_here("the SPI device " + name, "sim: in place of a port");
}

SpidevNode::~SpidevNode() = default;

void SpidevNode::serve(Time) {}

void SpidevNode::CloseSession::operator()(fuse_session*) const {}

FtdiUsb& system_ftdi() { return *all_ftdi; }

void set_system_ftdi(FtdiUsb& usb) { all_ftdi = &usb; }

}  // namespace absenc::os
