// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/recording/record_file.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "absenc/client/error.hpp"

namespace absenc::client {

RecordForm record_form(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension();
  if (ending == ".csv") return RecordForm::csv;
  if (ending == ".jsonl" || ending == ".ndjson") return RecordForm::json_lines;
  if (ending == ".h5" || ending == ".hdf5") return RecordForm::hdf5;
  throw UsageError(
      fmt::format("\"{}\" does not say how to write it: the name must end in .csv, in .jsonl for JSON lines, or in .h5 "
                  "for HDF5",
                  path));
}

std::unique_ptr<RecordFile> make_record_file(const std::string& path, std::span<const Column> columns,
                                             const RecordHeader& header) {
  const RecordForm form = record_form(path);
  return form == RecordForm::hdf5 ? make_hdf5_file(path, columns, header) : make_text_file(path, form, columns, header);
}

}  // namespace absenc::client
