#include "sensors/stiffness_model_file.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/error.h"
#include "core/nearest_name.h"
#include "core/whole_file.h"

namespace touchstone::sensors {

namespace {

using Json = nlohmann::json;

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

/// A value of the file and the path of names that leads to it.
struct Field {
  const Json& value;
  std::string path;
  const std::string& file;

  template <typename... Args>
  [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
    const std::string message = fmt::format(format, std::forward<Args>(args)...);
    fail_at({file, 0}, "{}{}{}", path, path.empty() ? "" : ": ", message);
  }

  Field at(const char* key) const {
    const auto found = value.find(key);
    if (found == value.end()) refuse("'{}' is missing", key);
    return {*found, path.empty() ? key : path + "." + key, file};
  }
  Field at(std::size_t index) const { return {value[index], fmt::format("{}[{}]", path, index), file}; }

  /// Refuses what isn't a map of exactly these names.
  void expect_map(const std::vector<std::string>& names) const {
    if (!value.is_object()) refuse("is a {}, a map is needed", value.type_name());
    for (const auto& [key, unused] : value.items()) {
      if (std::find(names.begin(), names.end(), key) == names.end()) {
        refuse("'{}' isn't known{}", key, did_you_mean(key, names));
      }
    }
    for (const std::string& name : names) at(name.c_str());
  }

  void expect_list(std::size_t size) const {
    if (!value.is_array()) refuse("is a {}, a list of {} is needed", value.type_name(), size);
    if (value.size() != size) refuse("has {} entries, {} are needed", value.size(), size);
  }

  double number() const {
    if (!value.is_number()) refuse("is a {}, a number is needed", value.type_name());
    const double number = value.get<double>();
    if (!std::isfinite(number)) refuse("is {}, a finite number is needed", number);
    return number;
  }

  std::int64_t whole_number(std::int64_t low, std::int64_t high) const {
    if (!value.is_number_integer()) refuse("is {}, a whole number is needed", value.dump());
    // Unsigned values beyond the signed range would turn negative: compare them as they are.
    const bool too_large = value.is_number_unsigned() && value.get<std::uint64_t>() > static_cast<std::uint64_t>(high);
    if (too_large || value.get<std::int64_t>() < low || value.get<std::int64_t>() > high) {
      refuse("is {}, it must be from {} to {}", value.dump(), low, high);
    }
    return value.get<std::int64_t>();
  }

  std::string text() const {
    if (!value.is_string()) refuse("is a {}, text is needed", value.type_name());
    return value.get<std::string>();
  }

  template <int N>
  Eigen::Matrix<double, N, 1> vector() const {
    expect_list(N);
    Eigen::Matrix<double, N, 1> result;
    for (std::size_t i = 0; i < N; ++i) result[static_cast<Eigen::Index>(i)] = at(i).number();
    return result;
  }

  template <int N>
  std::vector<Eigen::Matrix<double, N, 1>> vectors(std::size_t size) const {
    expect_list(size);
    std::vector<Eigen::Matrix<double, N, 1>> result;
    for (std::size_t i = 0; i < size; ++i) result.push_back(at(i).vector<N>());
    return result;
  }

  template <typename E, std::size_t N>
  E name_among(const std::array<E, N>& values) const {
    const std::string name = text();
    std::vector<std::string> known;
    for (const E one : values) {
      if (name == name_of(one)) return one;
      known.emplace_back(name_of(one));
    }
    refuse("is '{}', it must be one of {}{}", name, fmt::format("{}", fmt::join(known, ", ")),
           did_you_mean(name, known));
  }
};

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
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::parse_error& error) {
    const auto byte = std::min(error.byte, text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(byte), '\n');
    throw Error({name, static_cast<int>(line)}, "isn't valid JSON");
  } catch (const Json::exception& error) {  // a number beyond the range of double
    throw Error({name, 0}, fmt::format("isn't usable JSON: {}", error.what()));
  }
  const Field root{json, "", name};
  if (!json.is_object()) root.refuse("is a {}, a map is needed", json.type_name());
  if (root.at("format").text() != kFormat) {
    root.at("format").refuse("is '{}', '{}' is needed", root.at("format").text(), kFormat);
  }
  root.at("version").whole_number(kVersion, kVersion);
  root.expect_map({"format", "version", "grid", "form", "stiffness_N_per_px", "rest_px", "lowest_seen_px",
                   "highest_seen_px", "training"});

  StiffnessForceModel model;
  model.grid = static_cast<int>(root.at("grid").whole_number(2, 32));
  model.form =
      root.at("form").name_among(std::array{MatrixForm::kAsymmetric, MatrixForm::kSymmetric, MatrixForm::kDiagonal});
  const auto beads = static_cast<std::size_t>(model.grid) * static_cast<std::size_t>(model.grid);
  const auto squares = static_cast<std::size_t>(model.grid - 1) * static_cast<std::size_t>(model.grid - 1);
  const Field stiffness = root.at("stiffness_N_per_px");
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
  const Field training = root.at("training");
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
