// SPDX-License-Identifier: Apache-2.0
// Opens an encoder for a verb, and returns texts and JSON about its readings and exchanges.
#pragma once

#include <memory>
#include <string>

#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::tool {

using namespace client;

/// Opens the encoder's port and prints the notes about it. Throws the exceptions of Connection::open.
[[nodiscard]] std::unique_ptr<Connection> open_connection(const EncoderAddress& uri);
/// Opens the port of an encoder for samples, memory and settings, and prints the notes about the port. `period`: time
/// between readings, see make_encoder.
[[nodiscard]] Encoder open_encoder(const EncoderAddress& uri, Time period = {});

/// Returns {"ok":false,"error":...} with message and advice, the state of a change, and the bytes sent and received.
[[nodiscard]] Json to_json(const Trouble& trouble);

/// Sets the key "change" to the state of the change, and "change_advice" and "change_note" if these texts exist; sets
/// nothing for a command that changes no encoder.
void set_change(Json& json, const Change& change);

/// Returns one line with the likely cause of the failure and the command that explains it, as "Looks like only_echo:
/// ...; `absenc doctor tformat:/dev/ttyUSB0` says more".
[[nodiscard]] std::string finding_line(const Trouble& trouble, const EncoderAddress& address);

/// Returns the counters of exchanges as "1234 good, 2 failed (2 bad_checksum), 2 repeated".
[[nodiscard]] std::string summary(const host::Counters& counters);
/// Returns `summary` of the counters, and the reason if more good exchanges than readings were made.
[[nodiscard]] std::string exchanges_text(const host::Counters& counters, std::uint64_t readings);

/// Returns the number of each error that occurred, as {"timeout":2}.
[[nodiscard]] Json errors_to_json(const host::Counters& counters);

/// Sets the position in counts ("position") and the speed with its uncertainty, in rpm; for linear encoders (`unit_um`
/// is not 0) the speed in mm/s, and the position also in mm. A value that is not valid is null.
void set_motion(Json& json, const Sample& sample, double unit_um);
/// Sets the keys of the joint's speed and its uncertainty, null if unknown; sets nothing if the address has no joint
/// settings.
void set_joint_speed(Json& json, const Sample& sample, const Joint& joint, double unit_um);
/// Returns the angles as "   joint 12.3450 deg   electrical 90.00 deg", each only if the address has settings for it;
/// an angle that cannot be given is "unknown".
[[nodiscard]] std::string angles_text(const Joint& joint, const Sample& sample);

}  // namespace absenc::tool
