#include "sim/scene/residual_map.h"

#include "core/error.h"

namespace touchstone::sim {
namespace {

constexpr const char* kFormat = "touchstone residual map";
constexpr int kVersion = 1;
constexpr int kMostNeighbourhoods = 8;
constexpr int kMostCentres = 4096;
constexpr int kNumbersANeighbourhood = 3;  // two slopes and a depth
constexpr int kNumbersOfPlace = 2;
constexpr double kLargest = 1e6;  // of a number in the file

std::string list_of(const double* numbers, std::size_t count) {
  std::string text = "[";
  for (std::size_t i = 0; i < count; ++i) text += fmt::format("{}{:.7g}", i > 0 ? ", " : "", numbers[i]);
  return text + "]";
}

/// A text in YAML, whatever stands in it.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') out += '\\';
    out += letter == '\n' ? ' ' : letter;
  }
  return out + "\"";
}

}  // namespace

int ResidualMap::features() const {
  return kNumbersANeighbourhood * static_cast<int>(neighbourhoods_mm.size()) + (place_scale_mm ? kNumbersOfPlace : 0);
}

void fields(YamlReader& in, ResidualMap& map) {
  in.required_name("format", {kFormat});
  int version = 0;
  in.required("version", version);
  in.required("about", map.about);
  in.required("presses", map.presses, Allowed::within(1, 1e6));
  in.required("left_out_before_DN", map.left_out_before_DN, Allowed::within(0.0, kLargest));
  in.required("left_out_after_DN", map.left_out_after_DN, Allowed::within(0.0, kLargest));
  in.required("width_px", map.width_px, Allowed::within(1, 8192));
  in.required("height_px", map.height_px, Allowed::within(1, 8192));
  in.required("mm_per_px", map.mm_per_px, Allowed::above_up_to(0.0, 10.0));
  in.required("neighbourhoods_mm", map.neighbourhoods_mm, Allowed::above_up_to(0.0, 20.0));
  in.required("slope_scale", map.slope_scale, Allowed::above_up_to(0.0, 100.0));
  in.required("height_scale_mm", map.height_scale_mm, Allowed::above_up_to(0.0, 100.0));
  in.optional("place_scale_mm", map.place_scale_mm, Allowed::above_up_to(0.0, 1e4));
  in.required("centres", map.centres, Allowed::within(-kLargest, kLargest));
  in.required("weights_DN", map.weights_DN, Allowed::within(-kLargest, kLargest));
  if (in.describing()) return;
  if (version != kVersion) {
    fail_at(in.where("version"), "version: {} isn't known; this program reads {}", version, kVersion);
  }
  if (map.neighbourhoods_mm.empty() || map.neighbourhoods_mm.size() > kMostNeighbourhoods) {
    fail_at(in.where("neighbourhoods_mm"), "neighbourhoods_mm: {} numbers; from 1 to {} are allowed",
            map.neighbourhoods_mm.size(), kMostNeighbourhoods);
  }
  if (map.centres.size() > kMostCentres) {
    fail_at(in.where("centres"), "centres: {} of them; at most {} are allowed", map.centres.size(), kMostCentres);
  }
  for (std::size_t i = 0; i < map.centres.size(); ++i) {
    if (static_cast<int>(map.centres[i].size()) == map.features()) continue;
    fail_at(in.where("centres"), "centres: number {} has {} numbers; {} neighbourhoods{} take {}", i + 1,
            map.centres[i].size(), map.neighbourhoods_mm.size(), map.place_scale_mm ? " and a place" : "",
            map.features());
  }
  if (map.weights_DN.size() != map.centres.size()) {
    fail_at(in.where("weights_DN"), "weights_DN: {} rows, but there are {} centres", map.weights_DN.size(),
            map.centres.size());
  }
}

ResidualMap read_residual_map(const std::filesystem::path& file) {
  return read_yaml<ResidualMap>(file);
}

std::string to_yaml(const ResidualMap& map) {
  std::string text =
      "# What a device's pictures are missing against a recorded unit: an empirical correction, no physics.\n";
  text += fmt::format("format: {}\nversion: {}\nabout: {}\npresses: {}\n", kFormat, kVersion, quoted(map.about),
                      map.presses);
  text += fmt::format("left_out_before_DN: {:.4g}\nleft_out_after_DN: {:.4g}\n", map.left_out_before_DN,
                      map.left_out_after_DN);
  text += fmt::format("width_px: {}\nheight_px: {}\nmm_per_px: {:.7g}\n", map.width_px, map.height_px, map.mm_per_px);
  text += fmt::format("neighbourhoods_mm: {}\n", list_of(map.neighbourhoods_mm.data(), map.neighbourhoods_mm.size()));
  text += fmt::format("slope_scale: {:.7g}\nheight_scale_mm: {:.7g}\n", map.slope_scale, map.height_scale_mm);
  if (map.place_scale_mm) text += fmt::format("place_scale_mm: {:.7g}\n", *map.place_scale_mm);
  text += map.centres.empty() ? "centres: []\n" : "centres:\n";
  for (const auto& centre : map.centres) text += fmt::format("  - {}\n", list_of(centre.data(), centre.size()));
  text += map.weights_DN.empty() ? "weights_DN: []\n" : "weights_DN:\n";
  for (const Eigen::Vector3d& weight : map.weights_DN) text += fmt::format("  - {}\n", list_of(weight.data(), 3));
  return text;
}

std::string in_words(const ResidualMap& map) {
  return fmt::format(
      "an empirical correction of the light, learned from {} presses ({}): it takes what is missing in presses that it "
      "doesn't know from {:.3g} to {:.3g} of 255, root mean square",
      map.presses, map.about, map.left_out_before_DN, map.left_out_after_DN);
}

}  // namespace touchstone::sim
