#pragma once
// Model files (sensors/models/sealed_json.h) whose content was changed by someone who knows how they are sealed.

#include <nlohmann/json.hpp>
#include <string>

#include "core/sha256.h"

namespace touchstone::test {

/// The file with its map changed and its checksum made anew.
template <typename Change>
std::string resealed(const std::string& text, const Change& change) {
  nlohmann::json json = nlohmann::json::parse(text);
  change(json);
  json.erase("sha256");
  json["sha256"] = sha256_of(json.dump());
  return json.dump();
}

}  // namespace touchstone::test
