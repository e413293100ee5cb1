#include "datasets/sets/run_identity.h"

#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/installed_copy.h"
#include "core/sha256.h"
#include "datasets/sets/processor.h"

#ifndef TOUCHSTONE_VERSION
#error "CMake gives TOUCHSTONE_VERSION"
#endif

namespace touchstone::datasets {
namespace {

using nlohmann::ordered_json;

constexpr const char* kFormat = "touchstone-run";

}  // namespace

std::string program_version() {
  return TOUCHSTONE_VERSION;
}

std::string program_name() {
  return "touchstone " + program_version();
}

RunIdentity identity_of(const std::string& job_text, const std::vector<InputFile>& inputs) {
  RunIdentity identity;
  identity.job_sha256 = sha256_of(job_text);
  std::string list;
  for (const InputFile& file : inputs) list += file.sha256 + "  " + file.name + "\n";
  identity.inputs_sha256 = sha256_of(list);
  identity.version = program_version();
  static const std::string program = sha256_of_file(own_file());
  identity.program_sha256 = program;
  identity.processor = processor_kind();
  return identity;
}

RunIdentity identity_of(const PreparedJob& job) {
  return identity_of(job.text, job.inputs);
}

std::string difference(const RunIdentity& before, const RunIdentity& now, const std::string& what) {
  if (before.job_sha256 != now.job_sha256) return fmt::format("the {} file", what);
  if (before.inputs_sha256 != now.inputs_sha256) return fmt::format("a file that the {} names", what);
  if (before.version != now.version) {
    return fmt::format("the program's version ({} before, {} now)", before.version, now.version);
  }
  if (before.program_sha256 != now.program_sha256) return "the program, which was built anew";
  if (before.processor != now.processor) {
    return fmt::format("the kind of processor ({} before, {} now)", before.processor, now.processor);
  }
  return "";
}

std::string to_json(const RunIdentity& identity) {
  return ordered_json{{"format", kFormat},
                      {"job_sha256", identity.job_sha256},
                      {"inputs_sha256", identity.inputs_sha256},
                      {"version", identity.version},
                      {"program_sha256", identity.program_sha256},
                      {"processor", identity.processor}}
             .dump(2) +
         "\n";
}

RunIdentity run_identity_from_json(const std::string& text, const std::string& name) {
  try {
    const ordered_json parsed = ordered_json::parse(text);
    if (parsed.at("format") != kFormat) fail("{}: isn't the record of a run", name);
    return {parsed.at("job_sha256"), parsed.at("inputs_sha256"), parsed.at("version"), parsed.at("program_sha256"),
            parsed.at("processor")};
  } catch (const nlohmann::json::exception&) {
    fail("{}: isn't the record of a run", name);
  }
}

}  // namespace touchstone::datasets
