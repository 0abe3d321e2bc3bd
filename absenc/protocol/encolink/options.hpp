// SPDX-License-Identifier: Apache-2.0
// What can be set about an encoder with EncoLink.
#pragma once

#include <array>
#include <string_view>

#include "absenc/protocol/author/option.hpp"
#include "absenc/protocol/encolink/frame.hpp"

namespace absenc::encolink {

inline constexpr std::array<std::string_view, 2> offset_signs{"add", "subtract"};
inline constexpr std::array<std::string_view, 2> offset_units{"counts", "turn_fraction"};
inline constexpr std::array<std::string_view, 2> generations{"2", "4"};

inline constexpr author::OptionsOf options{
    author::option<&Format::resolution>("resolution",
                                        "bits of a turn; 0: asked from the encoder before each command (decode: 22)", 0,
                                        maximum_resolution),
    author::option<&Format::multiturn_bits>(
        "multiturn_bits",
        "bits of the turn counter; 0: no turns, 5 bytes a frame; -1: asked as well (decode: by the length)", -1,
        maximum_multiturn_bits),
    author::option<&Format::has_ch2>(
        "has_ch2",
        "whether frames end in a byte of channel 2; false: those of an AksIM-1, without status and registers"),
    author::option<&Format::offset_sign>(
        "offset_sign", "whether the position offset is added to the measured position or subtracted", offset_signs),
    author::option<&Format::stream_rate>(
        "stream_rate", "frames a second that the encoder sends by itself (UART): nothing is sent then; 0: it is asked",
        0, 10'000),
    author::option<&Format::offset_unit>(
        "offset_unit", "of the position offset: counts of the resolution, or 2^-32 revolution", offset_units),
    author::option<&Format::generation>(
        "protocol_version", "virtual encoder: 2, or 4 as an AksIM-4, of which only the positions are described",
        generations),
    author::option<&Format::identity_size>(
        "identity_bytes",
        "virtual encoder, UART: bytes of its identity; 20: one is behind it, and the frame before is as long, as "
        "clients with the vendor's library read them",
        identity_bytes, padded_identity_bytes),
};

}  // namespace absenc::encolink
