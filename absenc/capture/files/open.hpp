// SPDX-License-Identifier: Apache-2.0
// Opens a capture file by what it holds, whatever its name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// What a file does not tell by itself.
struct OpenChoices {
  unsigned channels = 0;                 // raw samples: 1 to 64, needed; of another file: must be what it holds
  std::uint64_t samples_per_second = 0;  // raw samples: needed; else used where the file has no rate
};

/// Knows, each described in its own header: sessions of sigrok (sigrok.hpp), value change dumps (vcd.hpp), CSV of logic
/// analysers (logic_csv.hpp), Saleae's binary export, a file or a folder of them (saleae.hpp), logs of candump
/// (candump.hpp), bytes as text (hex_text.hpp); and with `channels`, what is none of the first four is raw samples
/// (raw.hpp). Throws OpenError when the file cannot be opened, is none of them, or is not understood from its
/// beginning.
[[nodiscard]] std::unique_ptr<Reader> open_capture(const std::filesystem::path& path, const OpenChoices& choices);

/// The same for bytes that are no file; `name` is for messages and for the channel of a binary export.
[[nodiscard]] std::unique_ptr<Reader> open_capture(std::unique_ptr<Source> source, std::string_view name,
                                                   const OpenChoices& choices);

}  // namespace absenc::capture
