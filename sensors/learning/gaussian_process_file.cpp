#include "sensors/learning/gaussian_process_file.h"

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/models/sealed_json.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone.gaussian_process";
constexpr int kVersion = 1;

}  // namespace

std::string to_json(const GaussianProcess& process) {
  if (process.factor.rows() == 0 || !process.weights.allFinite())
    fail("Gaussian process: it wasn't conditioned on data");
  return seal({{"format", kFormat},
               {"version", kVersion},
               {"lengths", json_of(process.parameters.lengths)},
               {"signal", process.parameters.signal},
               {"noise", process.parameters.noise},
               {"inputs", json_of(process.inputs)},
               {"targets", json_of(process.targets)}});
}

GaussianProcess gaussian_process_from_json(const std::string& text, const std::string& name) {
  const Json json = unseal(text, name, kFormat, kVersion);
  const JsonField root{json, "", name};
  root.expect_map({"format", "version", "lengths", "signal", "noise", "inputs", "targets"});
  const GaussianProcessParameters parameters{vector_of(root.at("lengths")), root.at("signal").number(),
                                             root.at("noise").number()};
  const Eigen::MatrixXd inputs = matrix_of(root.at("inputs"));
  const Eigen::VectorXd targets = vector_of(root.at("targets"));
  try {
    return condition(parameters, inputs, targets);
  } catch (const Error& error) {
    root.refuse("{}", error.what());
  }
}

void save(const GaussianProcess& process, const std::filesystem::path& path) {
  write_whole_file(path, to_json(process));
}

GaussianProcess load_gaussian_process(const std::filesystem::path& path) {
  return gaussian_process_from_json(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
