// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/usb_adapter.hpp"

#include <algorithm>
#include <array>

namespace absenc::os {

namespace {

struct KnownChip {
  std::uint16_t vendor;
  std::uint16_t product;
  std::uint16_t release;  // the chip's release number bcdDevice; 0: the entry is for any release
  AdapterChip chip;
};

constexpr std::uint16_t ftdi = 0x0403;
constexpr std::uint16_t silicon_labs = 0x10C4;
constexpr std::uint16_t wch = 0x1A86;

// Rates from the data sheets: FTDI DS_FT232R, DS_FT232BM, DS_FT2232D, DS_FT2232H, DS_FT4232H, DS_FT232H, DS_FT231X;
// Silicon Labs CP2105; WCH CH340DS1, CH343DS1, CH9102DS1. FTDI's bcdDevice: the kernel's ftdi_sio.c.
constexpr std::array<KnownChip, 11> chips{{
    {ftdi, 0x6001, 0x0600, {"FT232R", 3'000'000}},
    {ftdi, 0x6001, 0x0400, {"FT232B", 3'000'000}},
    {ftdi, 0x6010, 0x0500, {"FT2232D", 3'000'000}},
    {ftdi, 0x6010, 0x0700, {"FT2232H", 12'000'000}},
    {ftdi, 0x6011, 0, {"FT4232H", 12'000'000}},
    {ftdi, 0x6014, 0, {"FT232H", 12'000'000}},
    {ftdi, 0x6015, 0, {"FT231X", 3'000'000}},
    {silicon_labs, 0xEA70, 0, {"CP2105", 2'000'000}},
    {wch, 0x7523, 0, {"CH340", 2'000'000}},
    {wch, 0x55D3, 0, {"CH343", 6'000'000}},
    {wch, 0x55D4, 0, {"CH9102", 4'000'000}},
}};

}  // namespace

const AdapterChip* chip_of(const UsbAdapter& adapter) {
  const auto* const found = std::find_if(chips.begin(), chips.end(), [&](const KnownChip& one) {
    return one.vendor == adapter.vendor && one.product == adapter.product &&
           (one.release == 0 || one.release == adapter.release);
  });
  return found == chips.end() ? nullptr : &found->chip;
}

}  // namespace absenc::os
