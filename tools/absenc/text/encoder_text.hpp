// SPDX-License-Identifier: Apache-2.0
// Opens an encoder for a verb, and returns texts and JSON about its readings and exchanges.
#pragma once

#include <memory>
#include <string>

#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::tool {

using namespace client;

/// Opens the encoder's port and prints notes about it. Throws as Connection::open does.
[[nodiscard]] std::unique_ptr<Connection> open_connection(const EncoderAddress& uri);
/// Opens an encoder and prints notes about its port. `period`: intended time between readings, 0: none.
[[nodiscard]] Encoder open_encoder(const EncoderAddress& uri, Time period = {});

/// Returns a trouble as {"ok":false,"error":...}.
[[nodiscard]] Json to_json(const Trouble& trouble);

/// Sets keys about the state of the change; none for a command that changes no encoder.
void set_change(Json& json, const Change& change);

/// Returns "Looks like only_echo: ...; `absenc doctor tformat:/dev/ttyUSB0` says more".
[[nodiscard]] std::string finding_line(const Trouble& trouble, const EncoderAddress& address);

/// Returns the counters of exchanges as "1234 good, 2 failed (2 bad_checksum), 2 repeated".
[[nodiscard]] std::string summary(const host::Counters& counters);
/// Returns `summary`, and the reason if there are more good exchanges than readings.
[[nodiscard]] std::string exchanges_text(const host::Counters& counters, std::uint64_t readings);

/// Returns the number of each error that occurred, as {"timeout":2}.
[[nodiscard]] Json errors_to_json(const host::Counters& counters);

/// Sets position and speed, in rpm or mm/s, with its uncertainty; invalid values are null.
void set_motion(Json& json, const Sample& sample, double unit_um);
/// Sets the joint's speed and its uncertainty, null if unknown; nothing without joint settings.
void set_joint_speed(Json& json, const Sample& sample, const Joint& joint, double unit_um);
/// Returns the angles for which the address has settings, as "   joint 12.3450 deg".
[[nodiscard]] std::string angles_text(const Joint& joint, const Sample& sample);

}  // namespace absenc::tool
