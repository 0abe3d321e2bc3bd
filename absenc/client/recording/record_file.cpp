// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/recording/record_file.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "absenc/client/error.hpp"
#include "absenc/os/file_name.hpp"

namespace absenc::client {

namespace {

Hdf5FileMaker make_hdf5_file = nullptr;

}  // namespace

void set_hdf5_file_maker(Hdf5FileMaker maker) { make_hdf5_file = maker; }

RecordForm record_form(const std::string& path) {
  const std::string ending = os::name_of(os::path_of(path).extension());
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
  if (form != RecordForm::hdf5) return make_text_file(path, form, columns, header);
  if (make_hdf5_file != nullptr) return make_hdf5_file(path, columns, header);
  throw UsageError(fmt::format(
      "this program cannot write {}: it was built without HDF5; choose a name that ends in .csv or .jsonl", path));
}

}  // namespace absenc::client
