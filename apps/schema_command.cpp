#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "apps/command.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "lab/schema/file_schema.h"

namespace touchstone::apps {
namespace {

void schema(const std::string& kind, const std::filesystem::path& out) {
  if (out.empty()) {
    if (kind.empty()) fail("either KIND or -o DIR is needed; kinds are {}", fmt::join(lab::file_kinds(), ", "));
    fmt::print("{}", lab::file_schema(kind));
    return;
  }
  std::error_code error;
  std::filesystem::create_directories(out, error);
  if (error) fail("{}: the folder can't be made: {}", out.string(), error.message());
  const std::vector<std::string> kinds = kind.empty() ? lab::file_kinds() : std::vector<std::string>{kind};
  for (const std::string& one : kinds) {
    const std::filesystem::path file = out / (one + ".schema.json");
    write_whole_file(file, lab::file_schema(one));
    fmt::print("{}\n", file.string());
  }
}

}  // namespace

void add_schema_command(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "schema", "JSON Schemas of the YAML files, with which editors complete and check what is typed");
  auto kind = std::make_shared<std::string>();
  auto out = std::make_shared<std::filesystem::path>();
  command->add_option("KIND", *kind, fmt::format("One of {}", fmt::join(lab::file_kinds(), ", ")));
  command->add_option("-o,--out", *out, "Folder for KIND.schema.json, or all of them; is made");
  command->callback([&action, kind, out] { action = [kind, out] { schema(*kind, *out); }; });
}

}  // namespace touchstone::apps
