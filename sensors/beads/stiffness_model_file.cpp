#include "sensors/beads/stiffness_model_file.h"

#include <array>
#include <limits>
#include <vector>

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/models/json_field.h"

namespace touchstone::sensors {

namespace {

constexpr const char* kFormat = "touchstone.stiffness_force_model";
constexpr int kVersion = 1;

template <int N>
Json vector_to_json(const Eigen::Matrix<double, N, 1>& vector) {
  Json list = Json::array();
  for (const double value : vector) list.push_back(value);
  return list;
}

template <int N>
Json list_to_json(const std::vector<Eigen::Matrix<double, N, 1>>& vectors) {
  Json list = Json::array();
  for (const auto& vector : vectors) list.push_back(vector_to_json(vector));
  return list;
}

}  // namespace

std::string to_json(const StiffnessForceModel& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("force model: {}", fault);
  Json stiffness = Json::array();
  for (const Eigen::Matrix3d& h : model.stiffness) {
    Json rows = Json::array();
    for (int row = 0; row < 3; ++row) rows.push_back(vector_to_json<3>(h.row(row).transpose()));
    stiffness.push_back(rows);
  }
  Json json;
  json["format"] = kFormat;
  json["version"] = kVersion;
  json["grid"] = model.grid;
  json["form"] = name_of(model.form);
  json["stiffness_N_per_px"] = stiffness;
  json["rest_px"] = list_to_json<2>(model.rest);
  json["lowest_seen_px"] = list_to_json<3>(model.lowest_seen);
  json["highest_seen_px"] = list_to_json<3>(model.highest_seen);
  json["training"] = {{"samples", model.training.samples},
                      {"stop", name_of(model.training.stop)},
                      {"iterations", model.training.iterations},
                      {"rms_error_N", vector_to_json<3>(model.training.rms_error_N)}};
  return json.dump(1) + "\n";
}

StiffnessForceModel stiffness_model_from_json(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  const JsonField root{json, "", name};
  root.expect_format(kFormat, kVersion);
  root.expect_map({"format", "version", "grid", "form", "stiffness_N_per_px", "rest_px", "lowest_seen_px",
                   "highest_seen_px", "training"});

  StiffnessForceModel model;
  model.grid = static_cast<int>(root.at("grid").whole_number(2, 32));
  model.form =
      root.at("form").name_among(std::array{MatrixForm::kAsymmetric, MatrixForm::kSymmetric, MatrixForm::kDiagonal});
  const auto beads = static_cast<std::size_t>(model.grid) * static_cast<std::size_t>(model.grid);
  const auto squares = static_cast<std::size_t>(model.grid - 1) * static_cast<std::size_t>(model.grid - 1);
  const JsonField stiffness = root.at("stiffness_N_per_px");
  stiffness.expect_list(squares);
  for (std::size_t i = 0; i < squares; ++i) {
    const std::vector<Eigen::Vector3d> rows = stiffness.at(i).vectors<3>(3);
    Eigen::Matrix3d h;
    h << rows[0].transpose(), rows[1].transpose(), rows[2].transpose();
    model.stiffness.push_back(h);
  }
  model.rest = root.at("rest_px").vectors<2>(beads);
  model.lowest_seen = root.at("lowest_seen_px").vectors<3>(beads);
  model.highest_seen = root.at("highest_seen_px").vectors<3>(beads);
  const JsonField training = root.at("training");
  training.expect_map({"samples", "stop", "iterations", "rms_error_N"});
  constexpr std::int64_t kMany = std::numeric_limits<std::int64_t>::max();
  model.training.samples = training.at("samples").whole_number(0, kMany);
  model.training.stop = training.at("stop").name_among(std::array{StopRule::kLossDrop, StopRule::kConvergence});
  model.training.iterations = training.at("iterations").whole_number(0, kMany);
  model.training.rms_error_N = training.at("rms_error_N").vector<3>();
  const std::string fault = fault_of(model);
  if (!fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const StiffnessForceModel& model, const std::filesystem::path& path) {
  write_whole_file(path, to_json(model));
}

StiffnessForceModel load_stiffness_model(const std::filesystem::path& path) {
  return stiffness_model_from_json(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
