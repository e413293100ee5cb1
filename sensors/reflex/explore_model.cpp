#include "sensors/reflex/explore_model.h"

#include <cmath>

#include "core/dense_solvers.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/reflex/shear_law_json.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone.explore_model";
constexpr int kVersion = 1;

}  // namespace

ExploreForce estimate(const ExploreModel& model, const DotsMotion& motion) {
  ExploreForce result;
  result.press_mm = model.press.press_mm(motion.dilation);
  result.force_N = model.force.force_N(result.press_mm);
  result.lateral_mm = model.lateral_mm_per_px * (motion.shift_px / motion.dilation);
  if (model.shear) result.shear_N = model.shear->force_N(result.lateral_mm, result.force_N);
  return result;
}

Eigen::Matrix2d fit_lateral(std::span<const LateralSample> samples) {
  constexpr double kLeastPart = 1e-6;
  if (samples.size() < 4) fail("lateral displacement: {} samples, at least 4 are needed", samples.size());
  Eigen::MatrixX2d shifts(static_cast<Eigen::Index>(samples.size()), 2), lateral = shifts;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const LateralSample& one = samples[i];
    if (!(one.motion.dilation > 0.0) || !one.motion.shift_px.allFinite() || !one.lateral_mm.allFinite()) {
      fail("lateral displacement: sample {} has values that aren't finite or a dilation not above 0", i);
    }
    shifts.row(static_cast<Eigen::Index>(i)) = one.motion.shift_px.transpose() / one.motion.dilation;
    lateral.row(static_cast<Eigen::Index>(i)) = one.lateral_mm.transpose();
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors{Eigen::MatrixXd(shifts)};
  factors.setThreshold(kLeastPart);
  if (factors.rank() < 2) fail("lateral displacement: all shifts lie along one line, both directions are needed");
  return factors.solve(Eigen::MatrixXd(lateral)).transpose();
}

std::string fault_of(const ExploreModel& model) {
  const DilationPress& press = model.press;
  if (press.terms < 1 || press.terms > 3) return fmt::format("the press has {} terms; 1 to 3 are known", press.terms);
  for (std::size_t i = 0; i < press.mm.size(); ++i) {
    if (!std::isfinite(press.mm[i])) return "the press has coefficients that aren't finite";
    if (static_cast<int>(i) >= press.terms && press.mm[i] != 0.0) return "the press has coefficients beyond its terms";
  }
  const ExponentialForce& force = model.force;
  if (!(force.scale_N > 0.0) || !std::isfinite(force.scale_N) || !(force.rate_per_mm > 0.0) ||
      !std::isfinite(force.rate_per_mm)) {
    return fmt::format("the force's law has {} N and {}/mm; both must be above 0 and finite", force.scale_N,
                       force.rate_per_mm);
  }
  if (!std::isfinite(press.rms_residual_mm) || !std::isfinite(force.rms_residual_N)) {
    return "a residual isn't finite";
  }
  if (!model.lateral_mm_per_px.allFinite()) return "lateral_mm_per_px isn't finite";
  return model.shear ? fault_of(*model.shear) : std::string();
}

std::string to_json(const ExploreModel& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("explore model: {}", fault);
  Json press = Json::array();
  for (int i = 0; i < model.press.terms; ++i) press.push_back(model.press.mm[static_cast<std::size_t>(i)]);
  Json json = {{"format", kFormat},
               {"version", kVersion},
               {"press", {{"mm", press}, {"rms_residual_mm", model.press.rms_residual_mm}}},
               {"force",
                {{"scale_N", model.force.scale_N},
                 {"rate_per_mm", model.force.rate_per_mm},
                 {"rms_residual_N", model.force.rms_residual_N}}},
               {"lateral_mm_per_px", json_of(Eigen::MatrixXd(model.lateral_mm_per_px))}};
  if (model.shear) json["shear"] = json_of(*model.shear, "mm");
  return seal(std::move(json));
}

ExploreModel explore_model_from_json(const std::string& text, const std::string& name) {
  const Json json = unseal(text, name, kFormat, kVersion);
  const JsonField root{json, "", name};
  std::vector<std::string> names = {"format", "version", "press", "force", "lateral_mm_per_px"};
  if (json.contains("shear")) names.emplace_back("shear");
  root.expect_map(names);
  ExploreModel model;
  const JsonField press = root.at("press");
  press.expect_map({"mm", "rms_residual_mm"});
  const Eigen::VectorXd terms = vector_of(press.at("mm"));
  if (terms.size() > 3) press.at("mm").refuse("has {} entries, 1 to 3 are known", terms.size());
  model.press.terms = static_cast<int>(terms.size());
  for (Eigen::Index i = 0; i < terms.size(); ++i) model.press.mm[static_cast<std::size_t>(i)] = terms[i];
  model.press.rms_residual_mm = press.at("rms_residual_mm").number();
  const JsonField force = root.at("force");
  force.expect_map({"scale_N", "rate_per_mm", "rms_residual_N"});
  model.force = {force.at("scale_N").number(), force.at("rate_per_mm").number(), force.at("rms_residual_N").number()};
  root.at("lateral_mm_per_px").expect_list(2);
  for (int row = 0; row < 2; ++row) {
    model.lateral_mm_per_px.row(row) =
        root.at("lateral_mm_per_px").at(static_cast<std::size_t>(row)).vector<2>().transpose();
  }
  if (json.contains("shear")) model.shear = shear_law_of(root.at("shear"), "mm");
  if (const std::string fault = fault_of(model); !fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const ExploreModel& model, const std::filesystem::path& path) {
  write_whole_file(path, to_json(model));
}

ExploreModel load_explore_model(const std::filesystem::path& path) {
  return explore_model_from_json(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
