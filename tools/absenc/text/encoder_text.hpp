// SPDX-License-Identifier: Apache-2.0
// Opens an encoder for a verb, and returns texts and JSON about its readings and exchanges.
#pragma once

#include <memory>
#include <string>

#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::tool {

using namespace client;

/// Opens and connects the encoder and prints the notes of its port. Throws the exceptions of Connection::connect.
[[nodiscard]] std::unique_ptr<Connection> open_connection(const EncoderAddress& uri);
/// Opens an encoder for samples, memory and settings, and prints the notes of its port. `period`: time between
/// readings, see make_encoder.
[[nodiscard]] Encoder open_encoder(const EncoderAddress& uri, Time period = {});

/// Returns {"ok":false,"error":...} with all texts of the failure `trouble`.
[[nodiscard]] Json to_json(const Trouble& trouble);

/// Sets the key "change" to the state of the change, and "change_advice" if an advice exists; sets nothing for a
/// command that changes no encoder.
void set_change(Json& json, const Change& change);

/// Returns one line with the likely cause of the failure and the verb that explains it: "Looks like only_echo: ...;
/// `absenc doctor ...".
[[nodiscard]] std::string finding_line(const Trouble& trouble, const EncoderAddress& address);

/// Returns the counters as "1234 readings, 2 failed attempts (2 bad_checksum), 2 repeated".
[[nodiscard]] std::string summary(const host::Counters& counters);
/// Returns `summary` of the counters, and the reason if more exchanges than readings were made.
[[nodiscard]] std::string exchanges_text(const host::Counters& counters, std::uint64_t readings);

/// Returns the number of each error that occurred, as {"timeout":2}.
[[nodiscard]] Json errors_to_json(const host::Counters& counters);

/// Sets the keys of the position in counts and of the speed; for linear encoders (`unit_um` is not 0) both in
/// millimetres. An invalid value is null.
void set_motion(Json& json, const Sample& sample, double unit_um);
/// Sets the keys of the joint's speed and its uncertainty, if the address has joint settings.
void set_joint_speed(Json& json, const Sample& sample, const Joint& joint, double unit_um);
/// Returns the angles as "   joint 12.345 deg   electrical 90.00 deg"; "" if the address has no joint settings.
[[nodiscard]] std::string angles_text(const Joint& joint, const Sample& sample);

}  // namespace absenc::tool
