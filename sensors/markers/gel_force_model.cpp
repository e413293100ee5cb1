#include "sensors/markers/gel_force_model.h"

#include <fmt/ranges.h>

#include <cmath>
#include <limits>
#include <set>

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/models/json_field.h"

namespace touchstone::sensors {

namespace {

constexpr const char* kFormat = "touchstone.gel_force_model";
constexpr int kVersion = 2;

std::string fault_of_line(const LinearForce& line) {
  for (const double number : {line.newton_per_unit, line.offset_N, line.r2, line.rms_residual_N,
                              line.largest_residual_N, line.lowest_seen, line.highest_seen}) {
    if (!std::isfinite(number)) return fmt::format("has {}, finite numbers are needed", number);
  }
  if (!(line.newton_per_unit > 0.0)) return fmt::format("has the slope {}, above 0 is needed", line.newton_per_unit);
  if (line.r2 > 1.0) return fmt::format("has r2 {}, at most 1 is allowed", line.r2);
  if (line.rms_residual_N < 0.0 || line.largest_residual_N < 0.0) return "has a residual below 0";
  if (!(line.lowest_seen < line.highest_seen)) {
    return fmt::format("has seen {} to {}, a range is needed", line.lowest_seen, line.highest_seen);
  }
  if (line.samples < 3) return fmt::format("has {} samples, at least 3 are needed", line.samples);
  return "";
}

Json line_to_json(const LinearForce& line) {
  return {{"newton_per_unit", line.newton_per_unit},
          {"offset_N", line.offset_N},
          {"r2", line.r2},
          {"rms_residual_N", line.rms_residual_N},
          {"largest_residual_N", line.largest_residual_N},
          {"lowest_seen", line.lowest_seen},
          {"highest_seen", line.highest_seen},
          {"samples", line.samples}};
}

LinearForce line_from_json(const JsonField& field) {
  field.expect_map({"newton_per_unit", "offset_N", "r2", "rms_residual_N", "largest_residual_N", "lowest_seen",
                    "highest_seen", "samples"});
  LinearForce line;
  line.newton_per_unit = field.at("newton_per_unit").number();
  line.offset_N = field.at("offset_N").number();
  line.r2 = field.at("r2").number();
  line.rms_residual_N = field.at("rms_residual_N").number();
  line.largest_residual_N = field.at("largest_residual_N").number();
  line.lowest_seen = field.at("lowest_seen").number();
  line.highest_seen = field.at("highest_seen").number();
  line.samples = static_cast<int>(field.at("samples").whole_number(0, std::numeric_limits<int>::max()));
  return line;
}

}  // namespace

const LinearForce& normal_line(const GelForceModel& model, const std::string& indenter) {
  std::vector<std::string> known;
  for (const GelForceModel::Normal& one : model.normal) {
    if (one.indenter == indenter) return one.line;
    known.push_back(one.indenter);
  }
  fail("force model of {}: no line for '{}', it has {}{}", model.gel, indenter, fmt::join(known, ", "),
       did_you_mean(indenter, known));
}

const LinearForce& shear_line(const GelForceModel& model) {
  if (!model.shear) fail("force model of {}: no line for shear", model.gel);
  return *model.shear;
}

std::string fault_of(const GelForceModel& model) {
  if (model.normal.empty() && !model.shear) return "has neither a line for normal force nor one for shear";
  if (!(model.mm_per_px > 0.0) || !std::isfinite(model.mm_per_px)) {
    return fmt::format("has {} mm a pixel, above 0 is needed", model.mm_per_px);
  }
  std::set<std::string> names;
  for (const GelForceModel::Normal& one : model.normal) {
    if (one.indenter.empty()) return "has an indenter without a name";
    if (!names.insert(one.indenter).second) return fmt::format("has the indenter '{}' twice", one.indenter);
    if (const std::string fault = fault_of_line(one.line); !fault.empty()) return one.indenter + " " + fault;
  }
  if (model.shear) {
    if (const std::string fault = fault_of_line(*model.shear); !fault.empty()) return "shear " + fault;
  }
  return "";
}

std::string to_json(const GelForceModel& model) {
  if (const std::string fault = fault_of(model); !fault.empty()) fail("force model of {}: {}", model.gel, fault);
  Json normal = Json::array();
  for (const GelForceModel::Normal& one : model.normal) {
    normal.push_back({{"indenter", one.indenter}, {"line", line_to_json(one.line)}});
  }
  Json json;
  json["format"] = kFormat;
  json["version"] = kVersion;
  json["gel"] = model.gel;
  json["mm_per_px"] = model.mm_per_px;
  json["normal_of_height_sum_mm3"] = normal;
  json["shear_of_displacement_mm"] = model.shear ? line_to_json(*model.shear) : Json();
  return json.dump(1) + "\n";
}

GelForceModel gel_force_model_from_json(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  const JsonField root{json, "", name};
  root.expect_format(kFormat, kVersion);
  root.expect_map({"format", "version", "gel", "mm_per_px", "normal_of_height_sum_mm3", "shear_of_displacement_mm"});
  GelForceModel model;
  model.gel = root.at("gel").text();
  model.mm_per_px = root.at("mm_per_px").number();
  const JsonField normal = root.at("normal_of_height_sum_mm3");
  if (!normal.value.is_array()) normal.refuse("is a {}, a list is needed", normal.value.type_name());
  for (std::size_t i = 0; i < normal.value.size(); ++i) {
    const JsonField one = normal.at(i);
    one.expect_map({"indenter", "line"});
    model.normal.push_back({one.at("indenter").text(), line_from_json(one.at("line"))});
  }
  const JsonField shear = root.at("shear_of_displacement_mm");
  if (!shear.value.is_null()) model.shear = line_from_json(shear);
  if (const std::string fault = fault_of(model); !fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const GelForceModel& model, const std::filesystem::path& path) {
  write_whole_file(path, to_json(model));
}

GelForceModel load_gel_force_model(const std::filesystem::path& path) {
  return gel_force_model_from_json(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
