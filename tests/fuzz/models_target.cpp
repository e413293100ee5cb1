// Saved models of the estimators, each format that sensors reads. Checksums, which no chance gets right, are made anew
// for a second try. What was read must come back the same when it's written and read again.

#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "core/json_depth.h"
#include "core/sha256.h"
#include "sensors/beads/stiffness_model_file.h"
#include "sensors/colour/hue_model_file.h"
#include "sensors/events/grasp_force_model_file.h"
#include "sensors/events/material_classifier_file.h"
#include "sensors/events/time_delay_network_file.h"
#include "sensors/heights/darkness_model_file.h"
#include "sensors/heights/height_model_file.h"
#include "sensors/learning/gaussian_process_file.h"
#include "sensors/markers/gel_force_model.h"
#include "sensors/reflex/explore_model.h"
#include "sensors/reflex/reflex_model.h"
#include "sensors/skin/colour_model.h"
#include "sensors/skin/softness_model.h"
#include "sensors/texture/texture_model_file.h"
#include "sensors/touch_map/tactile_map_file.h"
#include "sensors/tractions/marker_compliance_file.h"
#include "tests/fuzz/fuzz_target.h"

namespace touchstone::fuzz {
namespace {

using Json = nlohmann::json;
using namespace touchstone::sensors;

/// Reads a model and writes it; `read` and `write` are those of its format.
template <typename Read, typename Write>
bool comes_back(const std::string& bytes, const Read& read, const Write& write) {
  std::string written;
  if (!gives_result([&] { written = write(read(bytes, "a.model")); })) return false;
  TS_ASSERT(write(read(written, "b.model")) == written);
  return true;
}

constexpr auto to_text = [](const auto& model) { return to_json(model); };
constexpr auto to_binary = [](const auto& model) { return to_bytes(model); };

struct Format {
  std::string_view mark;  ///< stands in each file of it
  bool (*comes_back)(const std::string& bytes);
};

const std::array<Format, 16> kFormats{
    {{"touchstone.explore_model", [](auto& b) { return comes_back(b, explore_model_from_json, to_text); }},
     {"touchstone.gaussian_process", [](auto& b) { return comes_back(b, gaussian_process_from_json, to_text); }},
     {"touchstone.gel_force_model", [](auto& b) { return comes_back(b, gel_force_model_from_json, to_text); }},
     {"touchstone.grasp_force_model", [](auto& b) { return comes_back(b, grasp_force_model_from_json, to_text); }},
     {"touchstone.hue_model", [](auto& b) { return comes_back(b, hue_model_from_json, to_text); }},
     {"touchstone.material_classifier", [](auto& b) { return comes_back(b, material_classifier_from_json, to_text); }},
     {"touchstone.reflex_model", [](auto& b) { return comes_back(b, reflex_model_from_json, to_text); }},
     {"touchstone.softness_model", [](auto& b) { return comes_back(b, softness_model_from_json, to_text); }},
     {"touchstone.stiffness_force_model", [](auto& b) { return comes_back(b, stiffness_model_from_json, to_text); }},
     {"touchstone.time_delay_network", [](auto& b) { return comes_back(b, time_delay_network_from_json, to_text); }},
     {"touchstone.colour_model", [](auto& b) { return comes_back(b, colour_model_from_bytes, to_binary); }},
     {"touchstone.darkness_model", [](auto& b) { return comes_back(b, darkness_model_from_bytes, to_binary); }},
     {"touchstone.height_model", [](auto& b) { return comes_back(b, height_model_from_bytes, to_binary); }},
     {"touchstone.marker_compliance", [](auto& b) { return comes_back(b, marker_compliance_from_bytes, to_binary); }},
     {"touchstone.tactile_map", [](auto& b) { return comes_back(b, tactile_map_from_bytes, to_binary); }},
     {"touchstone.texture_model", [](auto& b) { return comes_back(b, texture_model_from_bytes, to_binary); }}}};

/// By the reader of the format whose name stands in the bytes; by all if there's none.
bool any_reads(const std::string& bytes) {
  bool named = false;
  bool read = false;
  for (const Format& format : kFormats) {
    if (bytes.find(format.mark) == std::string::npos) continue;
    named = true;
    read |= format.comes_back(bytes);
  }
  if (named) return read;
  for (const Format& format : kFormats) read |= format.comes_back(bytes);
  return read;
}

/// The map that a text holds; something else if it holds none.
Json map_of(const std::string& text) {
  if (deepest_json(text) > kDeepestJson) return {};
  return Json::parse(text, nullptr, false);
}

/// The same file with the checksum that its content has; empty if there's no place for one.
std::string resealed(const std::string& bytes) {
  Json whole = map_of(bytes);
  if (whole.is_object()) {
    whole.erase("sha256");
    whole["sha256"] = sha256_of(whole.dump());
    return whole.dump();
  }
  // A line of JSON, before it perhaps one of the format's name, behind it the payload.
  std::size_t begin = 0;
  if (bytes.starts_with("touchstone.")) begin = bytes.find('\n') + 1;
  const std::size_t end = bytes.find('\n', begin);
  if (end == std::string::npos) return {};
  Json line = map_of(bytes.substr(begin, end - begin));
  if (!line.is_object()) return {};
  const std::string payload = bytes.substr(end + 1);
  line["sha256"] = sha256_of(payload);
  return bytes.substr(0, begin) + line.dump() + "\n" + payload;
}

}  // namespace

bool reads(std::string_view bytes) {
  const std::string given(bytes);
  const bool read = any_reads(given);
  const std::string sealed = resealed(given);
  return (!sealed.empty() && any_reads(sealed)) || read;
}

}  // namespace touchstone::fuzz
