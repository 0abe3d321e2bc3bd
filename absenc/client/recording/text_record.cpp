// SPDX-License-Identifier: Apache-2.0
// Records rows as CSV or JSON lines; each line is written to the file at once.
#include <fmt/format.h>

#include "absenc/client/recording/record_file.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/os/line_file.hpp"

namespace absenc::client {

namespace {

bool is_explained(const Column& column) { return !column.presentation.is_detail && !column.meaning.empty(); }

std::string csv_begin(std::span<const Column> columns, const RecordHeader& header) {
  std::string text = fmt::format(
      "# absenc record 1\n# encoder: {}\n# protocol: {}\n# model: {}\n# options: {}\n# started: {}\n# rate_hz: {}\n"
      "# every: {}\n# part: {}\n",
      header.encoder, header.protocol, header.model, header.options, header.started, header.rate_hz, header.every,
      header.part);
  for (const Column& column : columns) {
    if (is_explained(column)) text += fmt::format("# {}: {}\n", column.name, column.meaning);
  }
  return text + csv_header(columns) + '\n';
}

std::string json_begin(std::span<const Column> columns, const RecordHeader& header) {
  Json json = Json::object().set("absenc_record", 1).set("encoder", header.encoder).set("protocol", header.protocol);
  json.set("model", header.model).set("options", header.options);
  json.set("started", header.started).set("rate_hz", header.rate_hz).set("every", header.every);
  json.set("part", header.part);
  Json units = Json::object();
  for (const Column& column : columns) {
    if (is_explained(column)) units.set(column.name, column.meaning);
  }
  return json.set("units", units).line() + '\n';
}

class TextRecord final : public RecordFile {
 public:
  TextRecord(const std::string& path, RecordForm form, std::span<const Column> columns, const RecordHeader& header)
      : file_(path), is_csv_(form == RecordForm::csv) {
    file_.append(is_csv_ ? csv_begin(columns, header) : json_begin(columns, header));
  }
  void append(const Row& row, const RecordCounts& counts) override {
    file_.append((is_csv_ ? to_csv(row) : to_json(row).line()) + '\n');
    counts_ += counts;
    ++rows_;
  }
  void finish() override {
    file_.append(is_csv_ ? fmt::format("# end: {} rows\n", rows_)
                         : Json::object().set("absenc_end", 1).set("rows", rows_).line() + '\n');
    sync();
  }
  void sync() override { file_.sync(); }
  void require_there() const override { file_.require_there(); }
  std::uint64_t size() const override { return file_.size(); }
  RecordCounts counts() const override { return counts_; }

 private:
  os::LineFile file_;
  bool is_csv_;
  RecordCounts counts_;
  std::uint64_t rows_ = 0;
};

}  // namespace

std::unique_ptr<RecordFile> make_text_file(const std::string& path, RecordForm form, std::span<const Column> columns,
                                           const RecordHeader& header) {
  return std::make_unique<TextRecord>(path, form, columns, header);
}

}  // namespace absenc::client
