#include "sensors/heights/darkness_model_file.h"

#include <limits>
#include <utility>

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/models/json_payload.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone.darkness_model";
constexpr int kVersion = 1;
constexpr int kLargestSide = 8192;

std::vector<double> numbers_of(const JsonField& field, std::size_t count) {
  field.expect_list(count);
  std::vector<double> numbers;
  for (std::size_t i = 0; i < count; ++i) numbers.push_back(field.at(i).number());
  return numbers;
}

}  // namespace

std::string to_bytes(const DarknessModel& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("darkness model: {}", fault);
  const cv::Mat rest = model.rest.mean.isContinuous() ? model.rest.mean : model.rest.mean.clone();
  std::string payload;
  append(payload, rest.ptr<float>(), rest.total());

  Json json;
  json["format"] = kFormat;
  json["version"] = kVersion;
  json["width_px"] = rest.cols;
  json["height_px"] = rest.rows;
  json["channels"] = model.rest.channels;
  json["mm_per_px"] = model.mm_per_px;
  json["presses"] = model.presses;
  json["rest_frames"] = model.rest.frames;
  json["rest_noise_DN"] = nullptr;
  if (model.rest.noise_DN) json["rest_noise_DN"] = *model.rest.noise_DN;
  json["follow_exposure"] = model.darkening.follow_exposure ? 1 : 0;
  json["smoothing_px"] = model.darkening.smoothing_px;
  json["first_knot"] = model.curve.first;
  json["knots"] = model.curve.heights_mm.size();
  json["heights_mm"] = model.curve.heights_mm;
  json["spread_mm"] = model.curve.spread_mm;
  return with_payload(std::move(json), payload);
}

DarknessModel darkness_model_from_bytes(std::string_view bytes, const std::string& name) {
  auto [json, payload] = split_payload(bytes, "a darkness model", name);
  const JsonField root{json, "", name};
  root.expect_format(kFormat, kVersion);
  root.expect_map({"format", "version", "width_px", "height_px", "channels", "mm_per_px", "presses", "rest_frames",
                   "rest_noise_DN", "follow_exposure", "smoothing_px", "first_knot", "knots", "heights_mm", "spread_mm",
                   "sha256"});
  constexpr int kMany = std::numeric_limits<int>::max();
  DarknessModel model;
  const auto width = static_cast<int>(root.at("width_px").whole_number(2, kLargestSide));
  const auto height = static_cast<int>(root.at("height_px").whole_number(2, kLargestSide));
  model.rest.channels = static_cast<int>(root.at("channels").whole_number(1, 3));
  model.mm_per_px = root.at("mm_per_px").number();
  model.presses = static_cast<int>(root.at("presses").whole_number(1, kMany));
  model.rest.frames = static_cast<int>(root.at("rest_frames").whole_number(1, kMany));
  if (const JsonField noise = root.at("rest_noise_DN"); !noise.value.is_null()) model.rest.noise_DN = noise.number();
  model.darkening.follow_exposure = root.at("follow_exposure").whole_number(0, 1) == 1;
  model.darkening.smoothing_px = root.at("smoothing_px").number();
  model.curve.first = static_cast<int>(root.at("first_knot").whole_number(-DarknessCurve::kMostKnots, 0));
  const auto knots = static_cast<std::size_t>(root.at("knots").whole_number(2, DarknessCurve::kMostKnots));
  model.curve.heights_mm = numbers_of(root.at("heights_mm"), knots);
  model.curve.spread_mm = numbers_of(root.at("spread_mm"), knots);

  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  expect_payload(root, payload, pixels * sizeof(float));
  model.rest.mean.create(height, width, CV_32FC1);
  take(payload, model.rest.mean.ptr<float>(), pixels);
  const std::string fault = fault_of(model);
  if (!fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const DarknessModel& model, const std::filesystem::path& path) {
  write_whole_file(path, to_bytes(model));
}

DarknessModel load_darkness_model(const std::filesystem::path& path) {
  return darkness_model_from_bytes(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
