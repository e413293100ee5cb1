#include "datasets/inspection/inspected_draw.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "core/error.h"
#include "core/hdf5_file.h"
#include "core/whole_file.h"
#include "core/yaml_reader.h"
#include "datasets/inspection/truth_overlay.h"
#include "datasets/jobs/draw.h"
#include "sim/scene/device_gel.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kCellsAcross = 110;  // of the surface in 3D

struct Place {
  const ManifestBlock& block;
  std::int64_t row;
};

Place place_of(const InspectedSet& set, std::size_t sample) {
  const auto number = static_cast<std::int64_t>(sample);
  const auto after = std::upper_bound(set.blocks.begin(), set.blocks.end(), number,
                                      [](std::int64_t n, const ManifestBlock& one) { return n < one.first_sample; });
  TS_ASSERT(after != set.blocks.begin());
  const ManifestBlock& block = *(after - 1);
  return {block, number - block.first_sample};
}

/// Rows x columns (x channels) of a sample's picture; empty if the set has none of that name.
template <typename T>
cv::Mat picture_of(const InspectedSet& set, std::size_t sample, const std::string& name) {
  const Place place = place_of(set, sample);
  const Hdf5Reader file(set.folder / place.block.name);
  if (!file.has(name)) return {};
  Hdf5Array<T> array = file.read_rows<T>(name, place.row, 1);
  if (array.shape.size() < 3) fail("{}: '{}' isn't a picture", (set.folder / place.block.name).string(), name);
  const int channels = array.shape.size() > 3 ? static_cast<int>(array.shape[3]) : 1;
  return cv::Mat(static_cast<int>(array.shape[1]), static_cast<int>(array.shape[2]),
                 CV_MAKETYPE(cv::DataType<T>::depth, channels), array.values.data())
      .clone();
}

/// Between the pixels' centres; of the pixel alone where one beside it has none. @pre `at` is within the picture
double height_at(const cv::Mat& height, const cv::Point2d& at) {
  const auto low = [](double x, int size) {
    return std::clamp(static_cast<int>(std::floor(x - 0.5)), 0, std::max(0, size - 2));
  };
  const int column = low(at.x, height.cols);
  const int row = low(at.y, height.rows);
  const int right = std::min(column + 1, height.cols - 1);
  const int below = std::min(row + 1, height.rows - 1);
  const double u = std::clamp(at.x - 0.5 - column, 0.0, 1.0);
  const double v = std::clamp(at.y - 0.5 - row, 0.0, 1.0);
  const double mean = (1.0 - v) * ((1.0 - u) * height.at<float>(row, column) + u * height.at<float>(row, right)) +
                      v * ((1.0 - u) * height.at<float>(below, column) + u * height.at<float>(below, right));
  return std::isfinite(mean) ? mean : height.at<float>(static_cast<int>(at.y), static_cast<int>(at.x));
}

/// The device that a block carries; null if it can't be read back, as where it names files that aren't here.
std::shared_ptr<const sim::DeviceSpec> device_in(const Hdf5Reader& file, const std::string& name) {
  try {
    return std::make_shared<const sim::DeviceSpec>(
        parse_yaml<sim::DeviceSpec>(file.read_texts("/device_yaml").at(0), name));
  } catch (const Error&) {
    return nullptr;
  }
}

void read_arrays(const Hdf5Reader& file, InspectedSet& set) {
  for (const char* name : {"frame",
                           "height",
                           "contact",
                           "background",
                           "wrench",
                           "wrench_error",
                           "pose",
                           "deepest_mm",
                           "contact_area_mm2",
                           "largest_strain",
                           "under_resolved",
                           "sample",
                           "seed",
                           "attempt",
                           "unit",
                           "object",
                           "piece",
                           "split",
                           "drawn/place_x_mm",
                           "drawn/place_y_mm",
                           "drawn/turn_deg",
                           "drawn/tilt_deg",
                           "drawn/tilt_axis_deg",
                           "drawn/force_N",
                           "drawn/depth_mm",
                           "drawn/drag_mm",
                           "drawn/drag_toward_deg"}) {
    const std::string path = std::string("/") + name;
    if (!file.has(path)) continue;
    set.arrays.push_back(
        {path, fmt::format("{}: [{}]", file.text_attribute(path, "shape"), fmt::join(file.extents(path), ", ")),
         file.text_attribute(path, "unit")});
  }
}

/// What each block of a sensor says of it.
void describe(const Hdf5Reader& file, const std::string& name, InspectedScene& scene) {
  scene.device_spec = device_in(file, name);
  if (scene.device_spec) scene.device = scene.device_spec->name;
  for (const char* output :
       {"frame", "height", "contact", "bead_displacement", "marker_displacement", "traction", "events", "statistics"}) {
    if (file.has(output)) scene.outputs.emplace_back(output);
  }
  scene.light.emplace_back(file.text_attribute("/", "light"), 0);
}

/// Also walks through the pictures that are read later.
void read_block(const ManifestBlock& block, InspectedSet& set, std::vector<std::array<std::int64_t, 3>>& splits,
                std::vector<std::set<std::string>>& objects) {
  const fs::path path = set.folder / block.name;
  const Hdf5Reader file(path);
  InspectedScene& scene = set.scenes[static_cast<std::size_t>(block.unit)];
  if (scene.light.empty()) describe(file, path.string(), scene);
  scene.light.front().second += block.samples;
  if (set.arrays.empty()) read_arrays(file, set);
  for (const char* picture : {"/frame", "/height", "/contact"}) {
    if (file.has(picture)) file.walk_rows(picture);
  }
  const auto count = static_cast<std::size_t>(block.samples);
  const auto whole = [&](const char* name) {
    auto values = file.read<std::int32_t>(name).values;
    if (values.size() != count) fail("{}: '{}' has another shape than it should", path.string(), name);
    return values;
  };
  std::vector<InspectedSample> samples = read_sample_columns(file, path, "/wrench_error", count);
  const auto split = whole("/split");
  const auto object = whole("/object");
  const std::vector<std::string> names = file.read_texts("/object_name");
  const auto unit = static_cast<std::size_t>(block.unit);
  for (std::size_t i = 0; i < count; ++i) {
    if (split[i] < 0 || split[i] > 2) fail("{}: '/split' has a {}; allowed is 0 to 2", path.string(), split[i]);
    if (object[i] < 0 || static_cast<std::size_t>(object[i]) >= names.size()) {
      fail("{}: '/object' has a {}; there are {} objects", path.string(), object[i], names.size());
    }
    ++splits[unit][static_cast<std::size_t>(split[i])];
    objects[unit].insert(names[static_cast<std::size_t>(object[i])]);
    samples[i].scene = block.unit;
    samples[i].frame = static_cast<int>(block.first_sample) + static_cast<int>(i);
  }
  set.samples.insert(set.samples.end(), samples.begin(), samples.end());
}

void read_scenes(const Manifest& manifest, const ordered_json& json, InspectedSet& set) {
  for (const ordered_json& unit : json.at("units")) {
    InspectedScene scene;
    scene.name = fmt::format("unit {}", unit.at("unit").get<int>());
    for (const auto& [path, value] : unit.at("drawn").items()) scene.drawn.emplace_back(path, value.get<double>());
    scene.first_sample = manifest.samples;
    set.scenes.push_back(std::move(scene));
  }
  for (const ManifestBlock& block : manifest.blocks) {
    if (block.unit < 0 || static_cast<std::size_t>(block.unit) >= set.scenes.size()) {
      fail("{}: is of unit {}; there are {}", block.name, block.unit, set.scenes.size());
    }
    InspectedScene& scene = set.scenes[static_cast<std::size_t>(block.unit)];
    scene.first_sample = std::min(scene.first_sample, block.first_sample);
    scene.samples += block.samples;
  }
}

}  // namespace

void read_drawn_samples(const Manifest& manifest, InspectedSet& set) {
  const fs::path file = set.folder / "dataset.json";
  try {
    const ordered_json json = ordered_json::parse(read_whole_file(file));
    set.job_file = json.at("job").at("file");
    set.job_text = json.at("job").at("text");
    read_scenes(manifest, json, set);
  } catch (const nlohmann::json::exception& error) {
    fail("{}: isn't a whole manifest ({})", file.string(), error.what());
  }
  std::vector<std::array<std::int64_t, 3>> splits(set.scenes.size(), {0, 0, 0});
  std::vector<std::set<std::string>> objects(set.scenes.size());
  for (const ManifestBlock& block : set.blocks) {
    read_hdf5(set.folder / block.name, [&] { read_block(block, set, splits, objects); });
  }
  for (std::size_t k = 0; k < set.scenes.size(); ++k) {
    for (std::size_t s = 0; s < splits[k].size(); ++s) {
      if (splits[k][s] == 0) continue;
      set.scenes[k].split +=
          fmt::format("{}{} {}", set.scenes[k].split.empty() ? "" : ", ", name_of(static_cast<Split>(s)), splits[k][s]);
    }
    set.scenes[k].object = fmt::format("{}", fmt::join(objects[k], ", "));
  }
}

cv::Mat drawn_frame(const InspectedSet& set, std::size_t sample) {
  cv::Mat frame = picture_of<std::uint8_t>(set, sample, "/frame");
  if (frame.channels() == 3) cv::cvtColor(frame, frame, cv::COLOR_RGB2BGR);
  return frame;
}

cv::Mat drawn_contact(const InspectedSet& set, std::size_t sample) {
  const cv::Mat mask = picture_of<std::uint8_t>(set, sample, "/contact");
  return mask.empty() ? mask : cv::Mat(mask != 0);
}

InspectedGel drawn_gel(const InspectedSet& set, std::size_t sample) {
  InspectedGel gel;
  const auto& device = set.scenes[static_cast<std::size_t>(set.samples[sample].scene)].device_spec;
  const cv::Mat height = picture_of<float>(set, sample, "/height");
  if (height.empty() || !device || !device->camera || device->gel.mesh()) return gel;
  const cv::Mat contact = drawn_contact(set, sample);
  const GelView view(*device);
  const auto pixel_of = [](const cv::Point2d& at) {
    return cv::Point(static_cast<int>(std::floor(at.x)), static_cast<int>(std::floor(at.y)));
  };
  const auto place_in_picture = [&](const Eigen::Vector3d& point) -> std::optional<cv::Point2d> {
    const auto at = view(point);
    if (!at || !cv::Rect({}, height.size()).contains(pixel_of(*at))) return std::nullopt;
    if (!std::isfinite(height.at<float>(pixel_of(*at)))) return std::nullopt;
    return at;
  };
  const sim::GelSpec& spec = device->gel;
  const auto face = sim::round_face(spec);
  const double half_x = face ? face->radius_mm : 0.5 * spec.slab()->size_x_mm;
  const double half_y = face ? face->radius_mm : 0.5 * spec.slab()->size_y_mm;
  const double step = 2.0 * std::max(half_x, half_y) / kCellsAcross;
  const int columns = static_cast<int>(std::floor(2.0 * half_x / step)) + 1;
  const int rows = static_cast<int>(std::floor(2.0 * half_y / step)) + 1;
  std::vector<int> number(static_cast<std::size_t>(columns) * rows, -1);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Eigen::Vector2d place(-half_x + i * step, -half_y + j * step);
      const Eigen::Vector3d rest(place.x(), place.y(), sim::rest_height(spec, place));
      // A pixel says how deep what it sees lies; which pixel sees this point depends on that.
      constexpr int kRounds = 4;
      double pressed = 0.0;
      std::optional<cv::Point2d> at;
      for (int round = 0; round < kRounds; ++round) {
        at = place_in_picture(rest - pressed * Eigen::Vector3d::UnitZ());
        if (!at) break;
        pressed = height_at(height, *at);
      }
      if (!at) continue;
      number[static_cast<std::size_t>(j) * columns + i] = static_cast<int>(gel.rest.size());
      gel.rest.push_back(rest);
      gel.displaced.emplace_back(rest - pressed * Eigen::Vector3d::UnitZ());
      gel.contact.push_back(!contact.empty() && contact.at<std::uint8_t>(pixel_of(*at)) != 0);
    }
  }
  for (int j = 0; j + 1 < rows; ++j) {
    for (int i = 0; i + 1 < columns; ++i) {
      const int* at = number.data() + static_cast<std::size_t>(j) * columns + i;
      const int a = at[0];
      const int b = at[1];
      const int c = at[columns];
      const int d = at[columns + 1];
      if (a >= 0 && b >= 0 && d >= 0) gel.triangles.push_back({a, b, d});
      if (a >= 0 && d >= 0 && c >= 0) gel.triangles.push_back({a, d, c});
    }
  }
  return gel;
}

}  // namespace touchstone::datasets
