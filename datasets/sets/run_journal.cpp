#include "datasets/sets/run_journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "core/error.h"
#include "core/whole_file.h"

namespace touchstone::datasets {
namespace {

using nlohmann::json;

std::string line_of(const FrameRecord& record) {
  json files = json::array();
  for (const WrittenFile& file : record.files) files.push_back({file.name, file.sha256, file.bytes});
  return json{{"sample", record.sample},
              {"files", std::move(files)},
              {"pixels", record.pixels_traced},
              {"paths", record.paths_traced},
              {"light", record.light}}
             .dump() +
         "\n";
}

std::optional<FrameRecord> record_of(const std::string& line) {
  try {
    const json parsed = json::parse(line);
    FrameRecord record;
    record.sample = parsed.at("sample").get<std::int64_t>();
    record.pixels_traced = parsed.at("pixels").get<std::int64_t>();
    record.paths_traced = parsed.at("paths").get<std::int64_t>();
    record.light = parsed.at("light").get<std::string>();
    for (const json& file : parsed.at("files")) {
      record.files.push_back(
          {file.at(0).get<std::string>(), file.at(1).get<std::string>(), file.at(2).get<std::int64_t>()});
    }
    return record;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

}  // namespace

std::vector<FrameRecord> read_journal(const std::filesystem::path& file) {
  std::vector<FrameRecord> records;
  if (!std::filesystem::is_regular_file(file)) return records;
  std::istringstream lines(read_whole_file(file));
  for (std::string line; std::getline(lines, line);) {
    if (auto record = record_of(line)) records.push_back(std::move(*record));
  }
  return records;
}

RunJournal::RunJournal(const std::filesystem::path& file, const std::vector<FrameRecord>& kept) : name_(file.string()) {
  std::string text;
  for (const FrameRecord& record : kept) text += line_of(record);
  write_whole_file(file, text);
  descriptor_ = open(file.c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor_ < 0) fail("{}: can't be written ({})", name_, std::strerror(errno));
}

RunJournal::~RunJournal() {
  close(descriptor_);
}

void RunJournal::append(const FrameRecord& record) {
  const std::string line = line_of(record);
  const std::lock_guard<std::mutex> lock(mutex_);
  const ssize_t written = write(descriptor_, line.data(), line.size());
  if (written != static_cast<ssize_t>(line.size())) {
    fail("{}: can't be written ({})", name_, written < 0 ? std::strerror(errno) : "the disk is full");
  }
}

}  // namespace touchstone::datasets
