// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/ftdi_usb.hpp"

#include <algorithm>

#include "absenc/os/error.hpp"

namespace absenc::os {

using Kind = Failure::Kind;

namespace {

std::string listed(const std::vector<FtdiAdapter>& adapters) {
  std::string text;
  for (const FtdiAdapter& one : adapters) {
    text += (text.empty() ? "" : ", ") + one.words() + (one.channels == 0 ? ", which has no MPSSE" : "");
  }
  return text;
}

}  // namespace

std::string FtdiAdapter::words() const {
  const AdapterChip* const chip = chip_of(usb);
  const std::string name = chip != nullptr ? std::string(chip->name) : usb.name.empty() ? "FTDI chip" : usb.name;
  return name + (usb.serial_number.empty() ? " without a serial number" : " (serial number " + usb.serial_number + ")");
}

FtdiPlace ftdi_place(std::string_view text) {
  const std::size_t slash = text.rfind('/');
  FtdiPlace place{.serial = std::string(text.substr(0, slash))};
  if (slash == std::string_view::npos) return place;
  const std::string_view channel = text.substr(slash + 1);
  if (channel.size() != 1 || channel[0] < 'A' || channel[0] > 'D') {
    throw Failure(Kind::unsupported, "\"" + std::string(channel) + "\" is no channel of an FTDI chip: write A or B");
  }
  place.channel = channel[0];
  return place;
}

// From the data sheets DS_FT232H, DS_FT2232H, DS_FT4232H, DS_FT2232D. FTDI's makers of boards keep the chip's product
// number or program their own; the release number tells the chip in any case, as libftdi and the kernel's ftdi_sio.c
// read it.
void describe_chip(FtdiAdapter& adapter) {
  switch (adapter.usb.release) {
    case 0x0900:  // FT232H
      adapter.channels = 1;
      break;
    case 0x0700:  // FT2232H
    case 0x0800:  // FT4232H: its channels C and D have none
      adapter.channels = 2;
      break;
    case 0x0500:  // FT2232C and D
      adapter.channels = 1;
      adapter.base = 12'000'000;
      break;
    default:
      adapter.channels = 0;
  }
}

FtdiAdapter find_ftdi(FtdiUsb& usb, const FtdiPlace& place) {
  const std::vector<FtdiAdapter> all = usb.adapters();
  std::vector<FtdiAdapter> suited;
  std::copy_if(all.begin(), all.end(), std::back_inserter(suited), [&](const FtdiAdapter& one) {
    return place.serial.empty() ? one.channels > 0 : one.usb.serial_number == place.serial;
  });
  if (suited.empty()) {
    const std::string what = place.serial.empty() ? "there is no FTDI chip with an MPSSE on USB"
                                                  : "there is no FTDI chip with the serial number " + place.serial;
    throw Failure(Kind::not_found,
                  what + (all.empty() ? ", nor any other FTDI chip: plug in an FT232H, FT2232H or FT4232H"
                                      : ": this computer has " + listed(all)));
  }
  if (suited.size() > 1) {
    throw Failure(Kind::unsupported,
                  "more than one FTDI chip is plugged in: say which by its serial number, as in ftdi:" +
                      suited.front().usb.serial_number + "; there are " + listed(suited));
  }
  const FtdiAdapter& adapter = suited.front();
  if (adapter.channels == 0) {
    throw Failure(
        Kind::unsupported,
        "the " + adapter.words() + " has no MPSSE, so it cannot clock an encoder: use an FT232H, FT2232H or FT4232H");
  }
  if (place.channel >= 'A' + adapter.channels) {
    throw Failure(Kind::unsupported, "channel " + std::string(1, place.channel) + " of the " + adapter.words() +
                                         " has no MPSSE: use channel A" + (adapter.channels > 1 ? " or B" : ""));
  }
  return adapter;
}

}  // namespace absenc::os
