#include "sensors/reflex/reflex_model.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/reflex/shear_law_json.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone.reflex_model";
constexpr int kVersion = 1;
constexpr std::int64_t kMostTreeNodes = 1 << 20;

Json tree_json(const ContactTree& tree) {
  Json nodes = Json::array();
  for (const ContactTreeNode& node : tree.nodes) {
    if (node.above == 0) {
      nodes.push_back({{"force_present", node.force_present}});
    } else {
      nodes.push_back({{"feature", name_of(node.feature)},
                       {"threshold", node.threshold},
                       {"above", node.above},
                       {"below", node.below}});
    }
  }
  return nodes;
}

ContactTree tree_of(const JsonField& json) {
  if (!json.value.is_array()) json.refuse("is a {}, a list is needed", json.value.type_name());
  ContactTree tree;
  for (std::size_t i = 0; i < json.value.size(); ++i) {
    const JsonField one = json.at(i);
    ContactTreeNode node;
    if (one.value.is_object() && one.value.contains("force_present")) {
      one.expect_map({"force_present"});
      node.force_present = one.at("force_present").truth();
    } else {
      one.expect_map({"feature", "threshold", "above", "below"});
      node.feature = one.at("feature").name_among(kChipFeatures);
      node.threshold = one.at("threshold").number();
      node.above = static_cast<int>(one.at("above").whole_number(1, kMostTreeNodes));
      node.below = static_cast<int>(one.at("below").whole_number(1, kMostTreeNodes));
    }
    tree.nodes.push_back(node);
  }
  return tree;
}

}  // namespace

std::string fault_of(const ReflexModel& model) {
  if (const std::string fault = fault_of(model.tree); !fault.empty()) return fault;
  if (model.force.degree != 1 && model.force.degree != 2) {
    return fmt::format("the force's degree is {}, it must be 1 or 2", model.force.degree);
  }
  const auto& coefficients = model.force.coefficients;
  if (!std::all_of(coefficients.begin(), coefficients.end(), [](double one) { return std::isfinite(one); }) ||
      !std::isfinite(model.force.rms_residual_N)) {
    return "the force has coefficients that aren't finite";
  }
  return model.shear ? fault_of(*model.shear) : std::string();
}

std::string to_json(const ReflexModel& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("reflex model: {}", fault);
  const Eigen::Map<const Eigen::VectorXd> coefficients(model.force.coefficients.data(), kStatisticsTerms);
  Json json = {{"format", kFormat},
               {"version", kVersion},
               {"rule", rule_of(model.tree)},
               {"tree", tree_json(model.tree)},
               {"force",
                {{"degree", model.force.degree},
                 {"coefficients_N", json_of(Eigen::VectorXd(coefficients))},
                 {"rms_residual_N", model.force.rms_residual_N}}}};
  if (model.shear) json["shear"] = json_of(*model.shear, "count");
  return seal(std::move(json));
}

ReflexModel reflex_model_from_json(const std::string& text, const std::string& name) {
  const Json json = unseal(text, name, kFormat, kVersion);
  const JsonField root{json, "", name};
  std::vector<std::string> names = {"format", "version", "rule", "tree", "force"};
  if (json.contains("shear")) names.emplace_back("shear");
  root.expect_map(names);
  ReflexModel model;
  model.tree = tree_of(root.at("tree"));
  const JsonField force = root.at("force");
  force.expect_map({"degree", "coefficients_N", "rms_residual_N"});
  model.force.degree = static_cast<int>(force.at("degree").whole_number(1, 2));
  const auto coefficients = force.at("coefficients_N").vector<static_cast<int>(kStatisticsTerms)>();
  std::copy(coefficients.begin(), coefficients.end(), model.force.coefficients.begin());
  model.force.rms_residual_N = force.at("rms_residual_N").number();
  if (json.contains("shear")) model.shear = shear_law_of(root.at("shear"), "count");
  if (const std::string fault = fault_of(model); !fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const ReflexModel& model, const std::filesystem::path& path) {
  write_whole_file(path, to_json(model));
}

ReflexModel load_reflex_model(const std::filesystem::path& path) {
  return reflex_model_from_json(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
