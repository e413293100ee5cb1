#include "sensors/touch_map/tactile_map_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "sensors/models/json_field.h"

namespace touchstone::sensors {
namespace {

constexpr std::string_view kFormatLine = "touchstone.tactile_map 1\n";
constexpr std::string_view kFormatName = "touchstone.tactile_map ";
static_assert(std::endian::native == std::endian::little, "the file's floats are little endian");

std::string_view bytes_of(const cv::Mat& image) {
  TS_ASSERT(image.isContinuous() && image.type() == CV_32FC1);
  return {reinterpret_cast<const char*>(image.ptr()), image.total() * sizeof(float)};
}

cv::Mat image_from(std::string_view bytes, int columns, int rows) {
  cv::Mat image(rows, columns, CV_32FC1);
  TS_ASSERT(bytes.size() == image.total() * sizeof(float));
  std::memcpy(image.ptr(), bytes.data(), bytes.size());
  return image;
}

/// The JSON line's fields, each checked.
class Header {
 public:
  Header(std::string_view line, const std::string& file) : file_(file) {
    refuse_deep_json(line, {file_, 2});
    json_ = Json::parse(line, nullptr, false);
    if (!json_.is_object()) fail_at({file_, 2}, "isn't a JSON map");
    for (const auto& [key, unused] : json_.items()) {
      static constexpr std::array kKnown = {"columns", "rows", "touches", "mm_per_px", "origin_px", "sha256"};
      if (std::find(kKnown.begin(), kKnown.end(), key) == kKnown.end()) fail_at({file_, 2}, "'{}' isn't known", key);
    }
  }

  int whole_number(const char* key, int low, int high) const {
    const Json& value = at(key);
    if (!value.is_number_integer() || value < low || value > high) {
      fail_at({file_, 2}, "{} is {}; it must be a whole number from {} to {}", key, value.dump(), low, high);
    }
    return value.get<int>();
  }
  double number(const char* key) const { return number(at(key), key); }
  Eigen::Vector2d pair(const char* key) const {
    const Json& value = at(key);
    if (!value.is_array() || value.size() != 2) fail_at({file_, 2}, "{} must be a list of two numbers", key);
    return {number(value[0], key), number(value[1], key)};
  }
  std::string text(const char* key) const {
    const Json& value = at(key);
    if (!value.is_string()) fail_at({file_, 2}, "{} must be text", key);
    return value.get<std::string>();
  }

 private:
  const Json& at(const char* key) const {
    const auto found = json_.find(key);
    if (found == json_.end()) fail_at({file_, 2}, "'{}' is missing", key);
    return *found;
  }
  double number(const Json& value, const char* key) const {
    if (!value.is_number()) fail_at({file_, 2}, "{} is {}; a number is needed", key, value.dump());
    return value.get<double>();
  }

  Json json_;
  std::string file_;
};

}  // namespace

std::string to_bytes(const TactileMapData& data) {
  check(data);
  const cv::Mat height = data.height_mm.isContinuous() ? data.height_mm : data.height_mm.clone();
  const cv::Mat weight = data.weight.isContinuous() ? data.weight : data.weight.clone();
  std::string pixels(bytes_of(height));
  pixels += bytes_of(weight);
  const Json header = {{"columns", height.cols},
                       {"rows", height.rows},
                       {"touches", data.touches},
                       {"mm_per_px", data.frame.mm_per_px},
                       {"origin_px", {data.frame.origin_px.x(), data.frame.origin_px.y()}},
                       {"sha256", sha256_of(pixels)}};
  return std::string(kFormatLine) + header.dump() + "\n" + pixels;
}

TactileMapData tactile_map_from_bytes(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with(kFormatLine)) {
    const std::string line(bytes.substr(0, std::min<std::size_t>(bytes.find('\n'), kFormatLine.size())));
    if (line.starts_with(kFormatName))
      fail_at({name, 1}, "has version {}; version 1 is known", line.substr(kFormatName.size()));
    fail_at({name, 1}, "isn't a tactile map of Touchstone");
  }
  bytes.remove_prefix(kFormatLine.size());
  const std::size_t end = bytes.find('\n');
  if (end == std::string_view::npos) fail_at({name, 2}, "the map's description is cut short");
  const Header header(bytes.substr(0, end), name);
  const std::string_view pixels = bytes.substr(end + 1);

  const int columns = header.whole_number("columns", 1, TactileMap::kMostPixelsASide);
  const int rows = header.whole_number("rows", 1, TactileMap::kMostPixelsASide);
  const std::size_t plane = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) * sizeof(float);
  if (pixels.size() != 2 * plane) {
    fail_at({name, 0}, "has {} bytes of pixels; {} x {} need {}", pixels.size(), columns, rows, 2 * plane);
  }
  if (sha256_of(pixels) != header.text("sha256")) fail_at({name, 0}, "its checksum is wrong: the file is damaged");
  TactileMapData data;
  data.touches = header.whole_number("touches", 1, 1 << 30);
  data.frame = {header.pair("origin_px"), header.number("mm_per_px")};
  data.height_mm = image_from(pixels.substr(0, plane), columns, rows);
  data.weight = image_from(pixels.substr(plane), columns, rows);
  try {
    check(data);
  } catch (const Error& error) {
    throw Error({name, 0}, error.what());
  }
  return data;
}

void save(const TactileMapData& data, const std::filesystem::path& path) {
  write_whole_file(path, to_bytes(data));
}

TactileMapData load_tactile_map(const std::filesystem::path& path) {
  return tactile_map_from_bytes(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
