#include "sensors/tractions/marker_compliance_file.h"

#include <utility>

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/models/json_payload.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone.marker_compliance";
constexpr int kVersion = 1;

std::size_t count_of(const Eigen::MatrixXd& matrix) {
  return static_cast<std::size_t>(matrix.size());
}

Eigen::Vector2i grid_of(const JsonField& field, int most) {
  field.expect_list(2);
  return {static_cast<int>(field.at(std::size_t{0}).whole_number(1, most)),
          static_cast<int>(field.at(std::size_t{1}).whole_number(1, most))};
}

}  // namespace

std::string to_bytes(const MarkerCompliance& compliance) {
  const std::string fault = fault_of(compliance);
  if (!fault.empty()) fail("marker compliance: {}", fault);
  std::string payload;
  for (const Eigen::Vector3d& rest : compliance.marker_rest) append(payload, rest.data(), 3);
  append(payload, compliance.displacement.data(), count_of(compliance.displacement));

  Json json;
  json["format"] = kFormat;
  json["version"] = kVersion;
  json["gel"] = compliance.gel;
  json["marker_grid"] = {compliance.marker_grid.x(), compliance.marker_grid.y()};
  json["patch_grid"] = {compliance.patch_grid.x(), compliance.patch_grid.y()};
  json["patch_side_mm"] = compliance.patch_side;
  json["first_patch_mm"] = {compliance.first_patch.x(), compliance.first_patch.y()};
  json["thickness_mm"] = compliance.thickness;
  json["youngs_modulus_MPa"] = compliance.youngs_modulus;
  json["poisson_ratio"] = compliance.poisson_ratio;
  return with_payload(std::move(json), payload);
}

MarkerCompliance marker_compliance_from_bytes(std::string_view bytes, const std::string& name) {
  auto [json, payload] = split_payload(bytes, "a marker compliance", name);
  const JsonField root{json, "", name};
  root.expect_format(kFormat, kVersion);
  root.expect_map({"format", "version", "gel", "marker_grid", "patch_grid", "patch_side_mm", "first_patch_mm",
                   "thickness_mm", "youngs_modulus_MPa", "poisson_ratio", "sha256"});
  MarkerCompliance compliance;
  compliance.gel = root.at("gel").text();
  compliance.marker_grid = grid_of(root.at("marker_grid"), kMostMarkers);
  compliance.patch_grid = grid_of(root.at("patch_grid"), kMostPatches);
  compliance.patch_side = root.at("patch_side_mm").number();
  compliance.first_patch = root.at("first_patch_mm").vector<2>();
  compliance.thickness = root.at("thickness_mm").number();
  compliance.youngs_modulus = root.at("youngs_modulus_MPa").number();
  compliance.poisson_ratio = root.at("poisson_ratio").number();

  const Eigen::Index markers = compliance.markers();
  const Eigen::Index patches = compliance.patches();
  if (markers > kMostMarkers || patches > kMostPatches) {
    root.refuse("has {} markers and {} patches; at most {} and {} are allowed", markers, patches, kMostMarkers,
                kMostPatches);
  }
  const auto length = static_cast<std::size_t>(3 * markers + 9 * markers * patches) * sizeof(double);
  expect_payload(root, payload, length);
  compliance.marker_rest.resize(static_cast<std::size_t>(markers));
  for (Eigen::Vector3d& rest : compliance.marker_rest) take(payload, rest.data(), 3);
  compliance.displacement.resize(3 * markers, 3 * patches);
  take(payload, compliance.displacement.data(), count_of(compliance.displacement));
  const std::string fault = fault_of(compliance);
  if (!fault.empty()) root.refuse("{}", fault);
  return compliance;
}

void save(const MarkerCompliance& compliance, const std::filesystem::path& path) {
  write_whole_file(path, to_bytes(compliance));
}

MarkerCompliance load_marker_compliance(const std::filesystem::path& path) {
  return marker_compliance_from_bytes(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
