// SPDX-License-Identifier: Apache-2.0
// Opens an encoder for a verb, and prints how its readings and exchanges went.
#pragma once

#include <memory>
#include <string>

#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::tool {

using namespace client;

/// Opens and connects the encoder and prints the notes of its port. Throws as Connection::connect.
[[nodiscard]] std::unique_ptr<Connection> open_connection(const EncoderAddress& uri);
/// The same for samples, memory and settings. `period`: as of make_encoder.
[[nodiscard]] Encoder open_encoder(const EncoderAddress& uri, Time period = {});

/// Returns {"ok":false,"error":...} with all texts of the failure.
[[nodiscard]] Json to_json(const Trouble& trouble);

/// Sets "change" to the state of the change, and "change_advice" if there is one; sets nothing for a command without a
/// change.
void set_change(Json& json, const Change& change);

/// Returns one line with the likely finding and the verb that explains it: "Looks like only_echo: ...; `absenc doctor
/// ...".
[[nodiscard]] std::string finding_line(const Trouble& trouble, const EncoderAddress& address);

/// Returns "1234 readings, 2 failed attempts (2 bad_checksum), 2 repeated".
[[nodiscard]] std::string summary(const host::Counters& counters);
/// Returns `summary` and why there are more exchanges than readings.
[[nodiscard]] std::string exchanges_text(const host::Counters& counters, std::uint64_t readings);

/// Returns {"timeout":2} with the errors that occurred.
[[nodiscard]] Json errors_to_json(const host::Counters& counters);

/// Sets the position in counts and the speed; both in millimetres for linear encoders (`unit_um` is not 0). An invalid
/// value is null.
void set_motion(Json& json, const Sample& sample, double unit_um);
/// Sets the speed at the joint with its uncertainty, if the address has joint settings.
void set_joint_speed(Json& json, const Sample& sample, const Joint& joint, double unit_um);
/// Returns "   joint 12.345 deg   electrical 90.00 deg"; "" if the address has no joint settings.
[[nodiscard]] std::string angles_text(const Joint& joint, const Sample& sample);

}  // namespace absenc::tool
