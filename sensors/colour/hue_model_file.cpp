#include "sensors/colour/hue_model_file.h"

#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/models/json_field.h"

namespace touchstone::sensors {

namespace {

constexpr const char* kFormat = "touchstone.hue_model";
constexpr int kVersion = 2;
constexpr std::int64_t kMany = std::numeric_limits<std::int64_t>::max();
constexpr int kSize = MarkerChange::kSize;

const std::array<std::pair<const char*, bool HueFeatures::*>, 7>& feature_names() {
  static const std::array<std::pair<const char*, bool HueFeatures::*>, 7> kNames{
      {{"hue", &HueFeatures::hue},
       {"centroid", &HueFeatures::centroid},
       {"ink_centroid", &HueFeatures::ink_centroid},
       {"coloured_area", &HueFeatures::coloured_area},
       {"ink_area", &HueFeatures::ink_area},
       {"cell_area", &HueFeatures::cell_area},
       {"neighbour_area", &HueFeatures::neighbour_area}}};
  return kNames;
}

template <typename Vector>
Json list_of(const Vector& vector) {
  Json list = Json::array();
  for (Eigen::Index i = 0; i < vector.size(); ++i) list.push_back(vector[i]);
  return list;
}

template <typename Matrix>
Json rows_of(const Matrix& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) rows.push_back(list_of(matrix.row(i)));
  return rows;
}

Json hue_json(const HueLine& line) {
  return {{"hue_slope_rad_per_mm", line.hue_slope},
          {"hue_offset_rad", line.hue_offset},
          {"gain_slope_per_mm", line.gain_slope},
          {"gain", line.gain},
          {"centroid", line.of_ink ? "ink" : "all"}};
}

Json hue_json(const HueFeatures& features) {
  Json names = Json::array();
  for (const auto& [name, member] : feature_names()) {
    if (features.*member) names.push_back(name);
  }
  return names;
}

Json hue_json(const HueIsotropic& isotropic) {
  return {{"features", hue_json(isotropic.features)},
          {"degree", isotropic.degree},
          {"scale", list_of(isotropic.scale)},
          {"press_mm", list_of(isotropic.press)},
          {"lateral_mm", list_of(isotropic.lateral)}};
}

Json hue_json(const HuePolynomial& polynomial) {
  return {{"features", hue_json(polynomial.features)},
          {"degree", polynomial.degree},
          {"scale", list_of(polynomial.scale)},
          {"coefficients_mm", rows_of(polynomial.coefficients)}};
}

bool flag_of(const JsonField& field, const char* no, const char* yes) {
  const std::string text = field.text();
  if (text != no && text != yes) field.refuse("is '{}', it must be '{}' or '{}'", text, no, yes);
  return text == yes;
}

HueLine line_of(const JsonField& json) {
  json.expect_map({"hue_slope_rad_per_mm", "hue_offset_rad", "gain_slope_per_mm", "gain", "centroid"});
  HueLine line;
  line.hue_slope = json.at("hue_slope_rad_per_mm").number();
  line.hue_offset = json.at("hue_offset_rad").number();
  line.gain_slope = json.at("gain_slope_per_mm").number();
  line.gain = json.at("gain").number();
  line.of_ink = flag_of(json.at("centroid"), "all", "ink");
  return line;
}

HueFeatures features_of(const JsonField& json) {
  HueFeatures features{false, false, false, false, false, false, false};
  if (!json.value.is_array()) json.refuse("is a {}, a list is needed", json.value.type_name());
  for (std::size_t i = 0; i < json.value.size(); ++i) {
    const std::string name = json.at(i).text();
    bool known = false;
    for (const auto& [feature, member] : feature_names()) {
      if (name != feature) continue;
      if (features.*member) json.at(i).refuse("'{}' is there twice", name);
      features.*member = known = true;
    }
    if (!known) json.at(i).refuse("'{}' isn't a feature", name);
  }
  if (json.value.empty()) json.refuse("has no feature");
  return features;
}

Eigen::VectorXd numbers_of(const JsonField& json, Eigen::Index size) {
  json.expect_list(static_cast<std::size_t>(size));
  Eigen::VectorXd numbers(size);
  for (Eigen::Index i = 0; i < size; ++i) numbers[i] = json.at(static_cast<std::size_t>(i)).number();
  return numbers;
}

HueIsotropic isotropic_of(const JsonField& json) {
  json.expect_map({"features", "degree", "scale", "press_mm", "lateral_mm"});
  HueIsotropic isotropic;
  isotropic.features = features_of(json.at("features"));
  isotropic.degree = static_cast<int>(json.at("degree").whole_number(1, 4));
  const int scalars = IsotropicFeatures::count(isotropic.features);
  const int centroids = isotropic.features.centroid + isotropic.features.ink_centroid;
  isotropic.scale = numbers_of(json.at("scale"), scalars);
  isotropic.press = numbers_of(json.at("press_mm"), hue_terms(scalars, isotropic.degree).rows());
  isotropic.lateral = numbers_of(json.at("lateral_mm"), centroids * (1 + count_lower_terms(scalars, isotropic.degree)));
  return isotropic;
}

HuePolynomial polynomial_of(const JsonField& json) {
  json.expect_map({"features", "degree", "scale", "coefficients_mm"});
  HuePolynomial polynomial;
  polynomial.features = features_of(json.at("features"));
  const auto count = static_cast<int>(polynomial.features.indices().size());
  polynomial.degree = static_cast<int>(json.at("degree").whole_number(1, 4));
  polynomial.scale = numbers_of(json.at("scale"), count);
  const Eigen::Index terms = hue_terms(count, polynomial.degree).rows();
  const auto rows = json.at("coefficients_mm").vectors<3>(static_cast<std::size_t>(terms));
  polynomial.coefficients.resize(terms, 3);
  for (Eigen::Index i = 0; i < terms; ++i) {
    polynomial.coefficients.row(i) = rows[static_cast<std::size_t>(i)].transpose();
  }
  return polynomial;
}

HueRange range_of(const JsonField& json) {
  json.expect_map({"lowest_hue_rad", "highest_hue_rad", "largest_shift_mm", "largest_ink_shift_mm", "precision",
                   "largest_distance"});
  HueRange range;
  range.lowest_hue = json.at("lowest_hue_rad").number();
  range.highest_hue = json.at("highest_hue_rad").number();
  range.largest_shift_mm = json.at("largest_shift_mm").number();
  range.largest_ink_shift_mm = json.at("largest_ink_shift_mm").number();
  const auto rows = json.at("precision").vectors<kSize>(kSize);
  for (int i = 0; i < kSize; ++i) range.precision.row(i) = rows[static_cast<std::size_t>(i)].transpose();
  range.largest_distance = json.at("largest_distance").number();
  return range;
}

}  // namespace

std::string to_json(const HueModel& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("hue model: {}", fault);
  Json gains = Json::array();
  for (const MarkerGain& gain : model.gains) {
    gains.push_back({{"marker", gain.marker}, {"lateral", gain.lateral}, {"press", gain.press}});
  }
  const HueRange& range = model.range;
  Json json;
  json["format"] = kFormat;
  json["version"] = kVersion;
  json["form"] = name_of(model.form);
  json["spacing_mm"] = model.spacing_mm;
  json["viewing_distance_mm"] = model.parallax.viewing_distance_mm;
  json["view_axis_mm"] = list_of(model.parallax.axis_mm);
  if (model.form == HueForm::kEquation4) json["line"] = hue_json(model.line);
  if (model.form == HueForm::kIsotropic) json["isotropic"] = hue_json(model.isotropic);
  if (model.form == HueForm::kPolynomial) json["polynomial"] = hue_json(model.polynomial);
  json["gains"] = gains;
  json["range"] = {{"lowest_hue_rad", range.lowest_hue},         {"highest_hue_rad", range.highest_hue},
                   {"largest_shift_mm", range.largest_shift_mm}, {"largest_ink_shift_mm", range.largest_ink_shift_mm},
                   {"precision", rows_of(range.precision)},      {"largest_distance", range.largest_distance}};
  json["samples"] = model.samples;
  json["rms_error_mm"] = model.rms_error_mm;
  return json.dump(1) + "\n";
}

HueModel hue_model_from_json(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  const JsonField root{json, "", name};
  root.expect_format(kFormat, kVersion);
  HueModel model;
  model.form = root.at("form").name_among(std::array{HueForm::kEquation4, HueForm::kIsotropic, HueForm::kPolynomial});
  const char* form = model.form == HueForm::kEquation4 ? "line" : name_of(model.form);
  root.expect_map({"format", "version", "form", "spacing_mm", "viewing_distance_mm", "view_axis_mm", form, "gains",
                   "range", "samples", "rms_error_mm"});
  model.spacing_mm = root.at("spacing_mm").number();
  model.parallax.viewing_distance_mm = root.at("viewing_distance_mm").number();
  model.parallax.axis_mm = root.at("view_axis_mm").vector<2>();
  if (model.form == HueForm::kEquation4) model.line = line_of(root.at(form));
  if (model.form == HueForm::kIsotropic) model.isotropic = isotropic_of(root.at(form));
  if (model.form == HueForm::kPolynomial) model.polynomial = polynomial_of(root.at(form));
  const JsonField gains = root.at("gains");
  if (!gains.value.is_array()) gains.refuse("is a {}, a list is needed", gains.value.type_name());
  for (std::size_t i = 0; i < gains.value.size(); ++i) {
    const JsonField gain = gains.at(i);
    if (!gain.value.is_object()) gain.refuse("is a {}, a map is needed", gain.value.type_name());
    gain.expect_map({"marker", "lateral", "press"});
    model.gains.push_back(
        {gain.at("marker").whole_number(0, kMany), gain.at("lateral").number(), gain.at("press").number()});
  }
  model.range = range_of(root.at("range"));
  model.samples = root.at("samples").whole_number(0, kMany);
  model.rms_error_mm = root.at("rms_error_mm").number();
  const std::string fault = fault_of(model);
  if (!fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const HueModel& model, const std::filesystem::path& path) {
  write_whole_file(path, to_json(model));
}

HueModel load_hue_model(const std::filesystem::path& path) {
  return hue_model_from_json(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
