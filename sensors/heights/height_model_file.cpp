#include "sensors/heights/height_model_file.h"

#include <limits>
#include <utility>

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/learning/network_json.h"
#include "sensors/models/json_payload.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone.height_model";
// 5: a network takes what is above a ceiling for the ceiling; 4: a network sees to its pixel's sides; 3 had means round
// it only; 2 had no network and no white balance; 1 had a polynomial for lamps.
constexpr int kVersion = 5;
constexpr int kLargestSide = 8192;
constexpr int kMostCells = 1024;

Json matrix_to_json(const Eigen::Matrix3d& matrix) {
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({matrix(i, 0), matrix(i, 1), matrix(i, 2)});
  return rows;
}

Eigen::Matrix3d square_of(const JsonField& field) {
  const std::vector<Eigen::Vector3d> rows = field.vectors<3>(3);
  Eigen::Matrix3d matrix;
  matrix << rows[0].transpose(), rows[1].transpose(), rows[2].transpose();
  return matrix;
}

}  // namespace

std::string to_bytes(const HeightModel& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("height model: {}", fault);
  const cv::Mat background =
      model.background.mean.isContinuous() ? model.background.mean : model.background.mean.clone();
  std::string payload;
  append(payload, background.ptr<float>(), background.total() * 3);
  for (const Eigen::Vector2f& slope : model.table.slopes) append(payload, slope.data(), 2);
  append(payload, model.table.hits.data(), model.table.hits.size());

  Json json;
  json["format"] = kFormat;
  json["version"] = kVersion;
  json["width_px"] = background.cols;
  json["height_px"] = background.rows;
  json["mm_per_px"] = model.mm_per_px;
  json["presses"] = model.presses;
  json["steepest_calibrated"] = model.steepest_calibrated;
  json["background_frames"] = model.background.frames;
  json["background_noise_DN"] = nullptr;
  if (const auto& noise = model.background.noise_DN)
    json["background_noise_DN"] = {(*noise)[0], (*noise)[1], (*noise)[2]};
  json["white_balance"] = model.white_balance;
  json["network"] = nullptr;
  if (model.network) json["network"] = json_of(model.network->network);
  json["correction"] = name_of(model.correction);
  json["lamps"] = Json::array();
  for (const Eigen::Matrix3d& node : model.lamps.nodes) json["lamps"].push_back(matrix_to_json(node));
  json["lamp_columns"] = model.lamps.columns;
  json["lamp_rows"] = model.lamps.rows;
  json["table_cells"] = model.table.cells;
  json["table_lowest_DN"] = {static_cast<double>(model.table.lowest[0]), static_cast<double>(model.table.lowest[1]),
                             static_cast<double>(model.table.lowest[2])};
  json["table_step_DN"] = static_cast<double>(model.table.step);
  return with_payload(std::move(json), payload);
}

HeightModel height_model_from_bytes(std::string_view bytes, const std::string& name) {
  auto [json, payload] = split_payload(bytes, "a height model", name);
  const JsonField root{json, "", name};
  if (root.at("format").text() == kFormat && root.at("version").number() < kVersion) {
    root.refuse("is of version {}, before {}: calibrate again from the same pictures", root.at("version").number(),
                kVersion);
  }
  root.expect_format(kFormat, kVersion);
  root.expect_map({"format", "version", "width_px", "height_px", "mm_per_px", "presses", "steepest_calibrated",
                   "background_frames", "background_noise_DN", "white_balance", "network", "correction", "lamps",
                   "lamp_columns", "lamp_rows", "table_cells", "table_lowest_DN", "table_step_DN", "sha256"});
  constexpr int kMany = std::numeric_limits<int>::max();
  HeightModel model;
  const auto width = static_cast<int>(root.at("width_px").whole_number(2, kLargestSide));
  const auto height = static_cast<int>(root.at("height_px").whole_number(2, kLargestSide));
  model.mm_per_px = root.at("mm_per_px").number();
  model.presses = static_cast<int>(root.at("presses").whole_number(1, kMany));
  model.steepest_calibrated = root.at("steepest_calibrated").number();
  model.background.frames = static_cast<int>(root.at("background_frames").whole_number(1, kMany));
  if (const JsonField noise = root.at("background_noise_DN"); !noise.value.is_null()) {
    const Eigen::Vector3d values = noise.vector<3>();
    model.background.noise_DN = cv::Vec3d(values[0], values[1], values[2]);
  }
  model.white_balance = root.at("white_balance").truth();
  if (const JsonField network = root.at("network"); !network.value.is_null())
    model.network = SlopeNetwork{network_of(network)};
  model.correction =
      root.at("correction")
          .name_among(std::array{LightCorrection::none, LightCorrection::background, LightCorrection::fitted});
  model.lamps.width = width;
  model.lamps.height = height;
  model.lamps.columns = static_cast<int>(root.at("lamp_columns").whole_number(1, kMostNodes));
  model.lamps.rows = static_cast<int>(root.at("lamp_rows").whole_number(1, kMostNodes));
  const JsonField lamps = root.at("lamps");
  const auto nodes = static_cast<std::size_t>(model.lamps.columns * model.lamps.rows);
  lamps.expect_list(nodes);
  for (std::size_t i = 0; i < nodes; ++i) model.lamps.nodes.push_back(square_of(lamps.at(i)));

  const JsonField sides = root.at("table_cells");
  sides.expect_list(3);
  std::size_t cells = 1;
  for (std::size_t c = 0; c < 3; ++c) {
    model.table.cells[c] = static_cast<int>(sides.at(c).whole_number(1, kMostCells));
    cells *= static_cast<std::size_t>(model.table.cells[c]);
  }
  model.table.lowest = root.at("table_lowest_DN").vector<3>().cast<float>();
  model.table.step = static_cast<float>(root.at("table_step_DN").number());

  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::size_t length = pixels * 3 * sizeof(float) + cells * (2 * sizeof(float) + sizeof(std::uint16_t));
  expect_payload(root, payload, length);
  model.background.mean.create(height, width, CV_32FC3);
  take(payload, model.background.mean.ptr<float>(), pixels * 3);
  model.table.slopes.resize(cells);
  take(payload, reinterpret_cast<float*>(model.table.slopes.data()), 2 * cells);
  model.table.hits.resize(cells);
  take(payload, model.table.hits.data(), cells);
  const std::string fault = fault_of(model);
  if (!fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const HeightModel& model, const std::filesystem::path& path) {
  write_whole_file(path, to_bytes(model));
}

HeightModel load_height_model(const std::filesystem::path& path) {
  return height_model_from_bytes(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
