// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/protocol_name/unit.hpp"

#include <array>

#include "absenc/protocol/protocol_name/frame.hpp"
#include "absenc/protocol/protocol_name/vectors.hpp"

namespace absenc::protocol_name {

namespace {

constexpr std::array<Model, 1> models{{{"unnamed", "one sentence", 6000, {}}}};

constexpr std::array<Command, 1> commands{{{"position", Verb::read, 0, "position"}}};

Error decode(const Options&, Frame, Frame reply, FieldSink& sink) {
  const Result<Reply> result = decode_reply(reply.bytes);
  if (!result) return result.error();
  sink.put({&fields[0], result->singleturn});
  // Give sink.put_reading the position too: captures take it from there.
  return Error::none;
}

Result<std::size_t> encode(const Options&, const Command&, Arguments, MutableBytes) { return Error::unsupported; }

Delimit delimit(const Options&, Direction, Bytes) { return {Delimit::Kind::no_frame}; }

// The machines: host.hpp (one class a conversation) and device.hpp (the virtual encoder), as in tformat.
Any<Conversation> host(const Options&, const Command&, Arguments, std::span<std::byte>) { return {}; }
Any<Device> device(const Options&, const Shaft&, std::span<std::byte>) { return {}; }

Resolution resolution(const Options&) { return {.singleturn_bits = 17}; }

}  // namespace

constinit const Unit unit{
    .id = "protocol_name",
    .name = "maker and protocol",
    .document = "title of the document",
    .link = LinkKind::half_duplex,
    .line = {.rate = 2'500'000},
    .options = {},
    .models = models,
    .fields = fields,
    .commands = commands,
    .vectors = vectors,
    .status = nullptr,
    .alarms = nullptr,
    .host_storage = 0,
    .device_storage = 0,
    .decode = decode,
    .encode = encode,
    .delimit = delimit,
    .host = host,
    .device = device,
    .resolution = resolution,
};

}  // namespace absenc::protocol_name
