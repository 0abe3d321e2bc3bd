// SPDX-License-Identifier: Apache-2.0
// Opens a capture file of any known format, detected from its content, not its name (raw samples: from `OpenChoices`),
// or a folder of Saleae's files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Properties of a capture that the user states, because the file may not contain them.
struct OpenChoices {
  unsigned channels = 0;                 // raw samples: 1 to 64, required; other files: 0, or the number in the file
  std::uint64_t samples_per_second = 0;  // raw samples: required; other files: used if the file has no rate
};

/// Opens a file. The formats are described in their own headers: sessions of sigrok (sigrok.hpp), value change dumps
/// (vcd.hpp), CSV of logic analysers (logic_csv.hpp), Saleae's binary export, as a file or a folder (saleae.hpp),
/// candump logs (candump.hpp), bytes as text (hex_text.hpp); with `channels` set, a file of none of the first four
/// formats is raw samples (raw.hpp). Throws OpenError if the file cannot be opened, has an unknown format, has an
/// invalid beginning, or does not fit `choices`.
[[nodiscard]] std::unique_ptr<Reader> open_capture(const std::filesystem::path& path, const OpenChoices& choices);

/// Opens a capture from any source, like the function for a path; `name` is used in messages and for the channel name
/// of a binary export. Throws OpenError.
[[nodiscard]] std::unique_ptr<Reader> open_capture(std::unique_ptr<Source> source, std::string_view name,
                                                   const OpenChoices& choices);

}  // namespace absenc::capture
