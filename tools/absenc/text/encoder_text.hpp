// SPDX-License-Identifier: Apache-2.0
// Opens an encoder for a verb, and returns texts and JSON about its readings and exchanges.
#pragma once

#include <memory>
#include <string>

#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::tool {

using namespace client;

/// Opens the encoder's port and prints notes about the port. Throws the same exceptions as Connection::open.
[[nodiscard]] std::unique_ptr<Connection> open_connection(const EncoderAddress& uri);
/// Opens an encoder and prints notes about its port. `period`: intended time between readings; 0: no intended time.
[[nodiscard]] Encoder open_encoder(const EncoderAddress& uri, Time period = {});

/// Returns a failure as the JSON object {"ok":false,"error":...}.
[[nodiscard]] Json to_json(const Trouble& trouble);

/// Sets the keys of `json` that state whether the command has changed the encoder; sets none if the command changes no
/// encoder.
void set_change(Json& json, const Change& change);

/// Returns the finding about a failure as text: "Looks like only_echo: ...; `absenc doctor tformat:/dev/ttyUSB0` says
/// more".
[[nodiscard]] std::string finding_line(const Trouble& trouble, const EncoderAddress& address);

/// Returns the counters of exchanges as "1234 good, 2 failed (2 bad_checksum), 2 repeated".
[[nodiscard]] std::string summary(const host::Counters& counters);
/// Returns the text of `summary`. If there are more good exchanges than readings, adds the reason.
[[nodiscard]] std::string exchanges_text(const host::Counters& counters, std::uint64_t readings);

/// Returns how often each error occurred, as a JSON object like {"timeout":2}.
[[nodiscard]] Json errors_to_json(const host::Counters& counters);

/// Sets the keys of `json` for position, speed (in rpm or mm/s) and the uncertainty of the speed; an invalid value
/// becomes null.
void set_motion(Json& json, const Sample& sample, double unit_um);
/// Sets the keys of `json` for the joint's speed and its uncertainty; unknown values become null. Sets no keys if the
/// address has no settings of the joint.
void set_joint_speed(Json& json, const Sample& sample, const Joint& joint, double unit_um);
/// Returns the angles of joint and motor, for which the address has settings, as "   joint 12.3450 deg".
[[nodiscard]] std::string angles_text(const Joint& joint, const Sample& sample);

}  // namespace absenc::tool
