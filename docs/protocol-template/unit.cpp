// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/protocol_name/unit.hpp"

#include <array>
#include <optional>

#include "absenc/protocol/author/unit.hpp"

namespace absenc::protocol_name {

namespace {

using namespace author;
using Dialog = DialogOf<Protocol>;

template <Ask ask>
constexpr Request request(const Format& format, Arguments = {}) {
  return {ask, format.address};
}

// ---- Procedures: each reads like its paragraph of the document

Procedure set_zero(Dialog& dialog, Looked<Protocol>& found) {
  const Request position = request<Ask::position>(dialog.format());
  co_await may_set_zero(dialog, found, position);
  co_await dialog.ask(request<Ask::zero>(dialog.format())).or_say("whether the encoder obeyed is not known");
  co_await dialog.rest(20ms);  // time in which the encoder writes its memory
  const std::uint64_t now = co_await look(dialog, found, position);
  if (!is_near(now, 0, 16))
    co_return {Error::cross_check_failed, "the position is still not zero",
               "hold the shaft still, then `absenc zero` again"};
  co_return done;
}

// ---- The virtual encoder

// the memory of the encoder has 4 bytes, which contain its zero position
class Encoder final : public BusDevice<Protocol, Encoder, 4> {
 public:
  using BusDevice::BusDevice;
  [[nodiscard]] bool is_mine(const Request& asked) const { return asked.address == format().address; }
  std::optional<Reply> answer(const Request& asked, Time at) {
    if (asked.ask == Ask::zero) store_zero(at, 0);
    return Reply{static_cast<std::uint16_t>(counts(at, 16, 0) & 0xFFFF)};
  }
};

// ---- Options, fields, commands and declaration

struct Values {
  std::optional<std::uint8_t> encoder_address{};
  std::optional<std::uint16_t> singleturn{};
};

constexpr auto options = OptionsOf{
    with_role<Role::encoder>(option<&Format::address>("address", "of the encoder on its line", 0, 255)),
};
constexpr auto models = std::array{ModelText{"unnamed", "one sentence", 6000, ""}};
constexpr auto fields =
    fields_of<Values>(field<&Values::encoder_address>("encoder_address", "", "address of the request", Role::encoder),
                      field<&Values::singleturn>("singleturn", "counts", "position within the turn", Role::position));

constexpr Values values_of_request(const Format&, const Request& asked) { return {.encoder_address = asked.address}; }
constexpr Values values_of_reply(const Format&, const Request& asked, const Reply& reply) {
  return {.encoder_address = asked.address, .singleturn = reply.singleturn};
}
constexpr Values values_of_found(const Format&, const Looked<Protocol>& found) {
  return {.singleturn = found.reply.singleturn};
}

constexpr Report<Protocol> report{
    .put_request = put_values<fields, values_of_request>,
    .put_reply = put_values<fields, values_of_reply>,
};
constexpr Finding<Format, Looked<Protocol>> found{.put = put_values<fields, values_of_found>};

constexpr auto commands = std::array{
    reading<report, request<Ask::position>>({"position", Verb::read, 0, "position"}),
    command<report, found, set_zero, request<Ask::zero>>(
        {"zero", Verb::zero, 0, "make this the zero of the turn", {}, true, false}),
};
constexpr auto vectors = std::array{
    VectorText{"position", "a position", "invented", "", "500151", "01123447", "encoder_address=1 singleturn=4660"},
    VectorText{"sum", "a wrong sum", "invented", "", "500151", "01123448", "bad_checksum"},
};

constexpr Result<Request> guess_request(const Format& format, Bytes) { return request<Ask::position>(format); }

constexpr Declaration<Protocol, Encoder> declaration{
    .id = "protocol_name",
    .name = "maker and protocol",
    .document = "title of the document",
    .link = LinkKind::half_duplex,
    .options = options.infos,
    .format = format_of<options>,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = vectors,
    .frames_size = 1200,
    .report = report,
    .guess_request = guess_request,
    .timing = {.turnaround_limit = answer_limit},
};

}  // namespace

constinit const Unit unit = Descriptor<declaration>::make();

}  // namespace absenc::protocol_name
