// SPDX-License-Identifier: Apache-2.0
// Opens a capture file of any known format.
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
  // number of channels; raw samples: 1 to 64, required; other levels: their number, or 0; other captures: 0
  unsigned channels = 0;
  // sample rate; raw samples: required; other files: used only if they state no rate for their samples
  std::uint64_t samples_per_second = 0;
};

/// Opens a session of sigrok (sigrok.hpp), a value change dump (vcd.hpp), CSV of logic analysers (logic_csv.hpp),
/// Saleae's binary export, as a file or a folder (saleae.hpp), a candump log (candump.hpp), bytes as text
/// (hex_text.hpp), or raw samples, which need `choices.channels` (raw.hpp). Throws OpenError.
[[nodiscard]] std::unique_ptr<Reader> open_capture(const std::filesystem::path& path, const OpenChoices& choices);

/// Opens a capture from any source; `name` is its name in messages. Throws OpenError.
[[nodiscard]] std::unique_ptr<Reader> open_capture(std::unique_ptr<Source> source, std::string_view name,
                                                   const OpenChoices& choices);

}  // namespace absenc::capture
