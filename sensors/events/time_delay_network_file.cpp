#include "sensors/events/time_delay_network_file.h"

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/learning/network_json.h"
#include "sensors/models/sealed_json.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone.time_delay_network";
constexpr int kVersion = 1;

}  // namespace

std::string to_json(const TimeDelayNetwork& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("time delay network: {}", fault);
  return seal({{"format", kFormat},
               {"version", kVersion},
               {"delays", model.delays},
               {"features", json_of(model.features)},
               {"force_N", json_of(model.force_N)},
               {"network", json_of(model.network)}});
}

TimeDelayNetwork time_delay_network_from_json(const std::string& text, const std::string& name) {
  const Json json = unseal(text, name, kFormat, kVersion);
  const JsonField root{json, "", name};
  root.expect_map({"format", "version", "delays", "features", "force_N", "network"});
  TimeDelayNetwork model;
  model.delays = static_cast<int>(root.at("delays").whole_number(1, 1000));
  model.features = range_scaling_of(root.at("features"));
  model.force_N = range_scaling_of(root.at("force_N"));
  model.network = network_of(root.at("network"));
  const std::string fault = fault_of(model);
  if (!fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const TimeDelayNetwork& model, const std::filesystem::path& path) {
  write_whole_file(path, to_json(model));
}

TimeDelayNetwork load_time_delay_network(const std::filesystem::path& path) {
  return time_delay_network_from_json(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
