// SPDX-License-Identifier: Apache-2.0
// Opens an encoder as the command does, and says how readings and exchanges went.
#pragma once

#include <memory>
#include <string>

#include "absenc/client/encoder.hpp"
#include "absenc/client/encoder/connection.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::tool {

using namespace client;

/// Connected, its notes printed. Throws as Connection::connect.
[[nodiscard]] std::unique_ptr<Connection> open_connection(const EncoderAddress& uri);

/// Prints what could be better about the port.
void print_notes(const Connection& encoder);

/// {"ok":false,"error":...}
[[nodiscard]] Json to_json(const Trouble& trouble);

/// Sets "change", the word of its state, and "change_advice" where there is one; nothing of none.
void set_change(Json& json, const Change& change);

/// What a failed reading looks like, on one line, and who says more: "Looks like only_echo: ...; `absenc doctor ...".
[[nodiscard]] std::string finding_line(const Trouble& trouble, const EncoderAddress& address);

/// "1234 readings, 2 failed attempts (2 bad_checksum), 2 repeated"
[[nodiscard]] std::string summary(const host::Counters& counters);
/// `summary`, and why there are more exchanges than readings.
[[nodiscard]] std::string exchanges_text(const host::Counters& counters, std::uint64_t readings);

/// {"timeout":2}: only what happened.
[[nodiscard]] Json errors_to_json(const host::Counters& counters);

/// Sets the position in counts and the speed, of linear encoders (`unit_um` is not 0) both in millimetres; what is not
/// valid is null.
void set_motion(Json& json, const Sample& sample, double unit_um);
/// Sets the speed at the joint with its uncertainty, where the address says how the encoder sits in its drive.
void set_joint_speed(Json& json, const Sample& sample, const Joint& joint, double unit_um);
/// "   joint 12.345 deg   electrical 90.00 deg"; "" where the address does not say how the encoder sits in its drive.
[[nodiscard]] std::string angles_text(const Joint& joint, const Sample& sample);

}  // namespace absenc::tool
