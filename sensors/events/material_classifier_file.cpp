#include "sensors/events/material_classifier_file.h"

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/learning/network_json.h"
#include "sensors/models/sealed_json.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone.material_classifier";
constexpr int kVersion = 1;

}  // namespace

std::string to_json(const MaterialClassifier& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("material classifier: {}", fault);
  return seal({{"format", kFormat},
               {"version", kVersion},
               {"materials", model.materials},
               {"features", json_of(model.features)},
               {"network", json_of(model.network)}});
}

MaterialClassifier material_classifier_from_json(const std::string& text, const std::string& name) {
  const Json json = unseal(text, name, kFormat, kVersion);
  const JsonField root{json, "", name};
  root.expect_map({"format", "version", "materials", "features", "network"});
  MaterialClassifier model;
  const JsonField materials = root.at("materials");
  if (!materials.value.is_array()) materials.refuse("is a {}, a list is needed", materials.value.type_name());
  for (std::size_t i = 0; i < materials.value.size(); ++i) model.materials.push_back(materials.at(i).text());
  model.features = range_scaling_of(root.at("features"));
  model.network = network_of(root.at("network"));
  const std::string fault = fault_of(model);
  if (!fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const MaterialClassifier& model, const std::filesystem::path& path) {
  write_whole_file(path, to_json(model));
}

MaterialClassifier load_material_classifier(const std::filesystem::path& path) {
  return material_classifier_from_json(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
