#include "sensors/texture/texture_model_file.h"

#include <bit>
#include <cstdint>
#include <cstring>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "sensors/models/json_field.h"

namespace touchstone::sensors {
namespace {

static_assert(std::endian::native == std::endian::little, "the file's numbers are written as they stand in memory");

constexpr std::string_view kFormat = "touchstone.texture_model ";
constexpr std::string_view kFirstLine = "touchstone.texture_model 1";
constexpr std::int64_t kMostSamples = 10'000'000;

std::size_t sample_bytes(const TextureOperator& op) {
  return sizeof(std::uint16_t) + sizeof(float) * static_cast<std::size_t>(feature_size(op));
}

/// Takes the text up to the next line break off `rest`.
std::string_view take_line(std::string_view& rest, const SourceLocation& where) {
  const std::size_t end = rest.find('\n');
  if (end == std::string_view::npos) fail_at(where, "the texture model ends within its header");
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end + 1);
  return line;
}

std::int64_t whole_number(const Json& header, const char* key, std::int64_t low, std::int64_t high,
                          const SourceLocation& where) {
  const Json& value = header.at(key);
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() < static_cast<std::uint64_t>(low) ||
      value.get<std::uint64_t>() > static_cast<std::uint64_t>(high)) {
    fail_at(where, "{}: is {}, it must be a whole number from {} to {}", key, value.dump(), low, high);
  }
  return value.get<std::int64_t>();
}

}  // namespace

std::string to_bytes(const TextureModel& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("the texture model can't be written: {}", fault);
  std::string body;
  body.reserve(model.labels.size() * sample_bytes(model.op));
  for (std::size_t i = 0; i < model.labels.size(); ++i) {
    const auto label = static_cast<std::uint16_t>(model.labels[i]);
    body.append(reinterpret_cast<const char*>(&label), sizeof label);
    const auto row = static_cast<Eigen::Index>(i);
    body.append(reinterpret_cast<const char*>(model.features.row(row).data()),
                sizeof(float) * static_cast<std::size_t>(model.features.cols()));
  }
  const Json header = {{"neighbours", model.op.circle.neighbours},
                       {"radius_px", model.op.circle.radius_px},
                       {"levels", model.op.levels},
                       {"gray_step_mm", model.gray_step_mm},
                       {"mm_per_px", model.mm_per_px},
                       {"classes", model.classes},
                       {"samples", model.labels.size()},
                       {"sha256", sha256_of(body)}};
  return fmt::format("{}\n{}\n", kFirstLine, header.dump()) + body;
}

TextureModel texture_model_from_bytes(std::string_view bytes, const std::string& name) {
  const SourceLocation where{name, 0};
  if (bytes.substr(0, kFormat.size()) != kFormat) fail_at(where, "isn't a texture model of Touchstone");
  const std::string_view first = take_line(bytes, where);
  if (first != kFirstLine) {
    fail_at(where, "is a texture model of version '{}'; version 1 is read", first.substr(kFormat.size()));
  }
  TextureModel model;
  std::string sum;
  std::size_t samples = 0;
  try {
    const std::string_view line = take_line(bytes, where);
    refuse_deep_json(line, where);
    const Json header = Json::parse(line);
    constexpr std::size_t kFields = 8;
    if (!header.is_object() || header.size() != kFields)
      fail_at(where, "its header hasn't the {} known fields", kFields);
    model.op.circle.neighbours = static_cast<int>(whole_number(header, "neighbours", 0, kMostNeighbours, where));
    model.op.circle.radius_px = header.at("radius_px").get<double>();
    model.op.levels = static_cast<int>(whole_number(header, "levels", 1, 100, where));
    model.gray_step_mm = header.at("gray_step_mm").get<double>();
    model.mm_per_px = header.at("mm_per_px").get<double>();
    model.classes = header.at("classes").get<std::vector<std::string>>();
    samples = static_cast<std::size_t>(whole_number(header, "samples", 0, kMostSamples, where));
    sum = header.at("sha256").get<std::string>();
    check(model.op);
  } catch (const Json::exception& error) {
    fail_at(where, "its header can't be read: {}", error.what());
  } catch (const Error& error) {
    if (!error.where().file.empty()) throw;
    fail_at(where, "{}", error.what());
  }
  if (bytes.size() != samples * sample_bytes(model.op)) {
    fail_at(where, "has {} bytes of samples; {} samples take {}", bytes.size(), samples,
            samples * sample_bytes(model.op));
  }
  if (sha256_of(bytes) != sum) fail_at(where, "is damaged: its checksum doesn't fit");
  model.features.resize(static_cast<Eigen::Index>(samples), feature_size(model.op));
  const char* next = bytes.data();
  for (std::size_t i = 0; i < samples; ++i) {
    std::uint16_t label = 0;
    std::memcpy(&label, next, sizeof label);
    model.labels.push_back(label);
    std::memcpy(model.features.row(static_cast<Eigen::Index>(i)).data(), next + sizeof label,
                sample_bytes(model.op) - sizeof label);
    next += sample_bytes(model.op);
  }
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail_at(where, "{}", fault);
  return model;
}

void save(const TextureModel& model, const std::filesystem::path& path) {
  write_whole_file(path, to_bytes(model));
}

TextureModel load_texture_model(const std::filesystem::path& path) {
  return texture_model_from_bytes(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
