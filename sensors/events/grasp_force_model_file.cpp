#include "sensors/events/grasp_force_model_file.h"

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/events/time_delay_network_file.h"
#include "sensors/learning/gaussian_process_file.h"
#include "sensors/models/sealed_json.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone.grasp_force_model";
constexpr int kVersion = 1;

}  // namespace

std::string to_json(const GraspForceModel& model) {
  if (const std::string fault = fault_of(model); !fault.empty()) fail("grasp force: {}", fault);
  Json error;
  if (model.error) {
    error = {{"left_out_N", model.error->left_out_N},
             {"absolute_N", model.error->absolute_N},
             {"relative", model.error->relative}};
  }
  const std::string estimator = std::visit([](const auto& one) { return to_json(one); }, model.estimator);
  return seal({{"format", kFormat}, {"version", kVersion}, {"error", error}, {"estimator", Json::parse(estimator)}});
}

GraspForceModel grasp_force_model_from_json(const std::string& text, const std::string& name) {
  const Json json = unseal(text, name, kFormat, kVersion);
  const JsonField root{json, "", name};
  root.expect_map({"format", "version", "error", "estimator"});
  GraspForceModel model;
  if (const JsonField error = root.at("error"); !error.value.is_null()) {
    error.expect_map({"left_out_N", "absolute_N", "relative"});
    model.error = {error.at("left_out_N").number(), error.at("absolute_N").number(), error.at("relative").number()};
  }
  const JsonField estimator = root.at("estimator");
  if (!estimator.value.is_object()) estimator.refuse("is a {}, a map is needed", estimator.value.type_name());
  const std::string format = estimator.at("format").text(), inner = estimator.value.dump();
  if (format == "touchstone.time_delay_network") {
    model.estimator = time_delay_network_from_json(inner, name + ": estimator");
  } else if (format == "touchstone.gaussian_process") {
    model.estimator = gaussian_process_from_json(inner, name + ": estimator");
  } else {
    estimator.at("format").refuse("is '{}'; 'touchstone.time_delay_network' or 'touchstone.gaussian_process' is needed",
                                  format);
  }
  if (const std::string fault = fault_of(model); !fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const GraspForceModel& model, const std::filesystem::path& path) {
  write_whole_file(path, to_json(model));
}

GraspForceModel load_grasp_force_model(const std::filesystem::path& path) {
  return grasp_force_model_from_json(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
