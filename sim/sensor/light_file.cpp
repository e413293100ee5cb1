#include "sim/sensor/light_file.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <string_view>
#include <type_traits>

#include "core/error.h"
#include "core/matrix_file.h"
#include "core/whole_file.h"
#include "render/direct/shadow_reach.h"

namespace touchstone::sim {
namespace {

// A matrix file (core/matrix_file.h): scalars, beams, flow, pass, bounced light; after the matrices the choice's
// reason.
constexpr std::string_view kMark = "TSLIGHT1";
constexpr int kScalars = 25;
constexpr int kBesides = 5;  // numbers of a beam before its intensities
constexpr int kMostNumber = 1'000'000'000;
constexpr int kMostNodes = 1'000'000;  // along an axis

/// Takes each number to or from a column, in one order. `visit` gets a reference.
template <typename Light, typename Error, typename Visit>
void each_scalar(Light& light, Error& error, const Visit& visit) {
  visit(light.choice.direct);
  visit(error.rms);
  visit(error.rms_error);
  visit(error.mean);
  visit(error.mean_error);
  visit(error.pixels);
  visit(light.rays);
  auto& field = light.field;
  visit(field.layer);
  visit(field.index);
  visit(field.error);
  for (int a = 0; a < 3; ++a) {
    visit(field.nodes[a]);
    visit(field.step[a]);
    visit(field.reach.min()[a]);
    visit(field.reach.max()[a]);
  }
}

/// A whole number as it's stored. @throws Error if it isn't one, or out of range
int index_from(double stored, int least, int most) {
  if (!(stored >= least && stored <= most) || stored != std::floor(stored)) {
    fail("it has {} where a whole number from {} to {} should be", stored, least, most);
  }
  return static_cast<int>(stored);
}

template <typename T>
Eigen::MatrixXd columns_of(const std::vector<T>& numbers, Eigen::Index rows) {
  if (rows == 0) return {};
  return Eigen::Map<const Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>>(
             numbers.data(), rows, static_cast<Eigen::Index>(numbers.size()) / rows)
      .template cast<double>();
}

std::vector<float> floats_of(const Eigen::MatrixXd& columns) {
  std::vector<float> numbers(static_cast<std::size_t>(columns.size()));
  for (Eigen::Index i = 0; i < columns.size(); ++i) {
    numbers[static_cast<std::size_t>(i)] = static_cast<float>(columns.data()[i]);
  }
  return numbers;
}

FoundLight light_in(const std::string& content, const std::string& key) {
  MatrixFile matrices(content, kMark, "a sensor's light", key, "sensor");
  const Eigen::MatrixXd scalars = matrices.take();
  const Eigen::MatrixXd beams = matrices.take();
  const Eigen::MatrixXd flow = matrices.take();
  const Eigen::MatrixXd pass = matrices.take();
  const Eigen::MatrixXd bounced = matrices.take();
  if (scalars.size() != kScalars) fail("it has {} scalars, not {}", scalars.size(), kScalars);
  FoundLight light;
  render::DirectError error;
  Eigen::Index row = 0;
  for (const Eigen::MatrixXd* numbers : {&scalars, &beams, &flow, &pass, &bounced}) {
    if (!numbers->allFinite()) fail("it has numbers that aren't finite");
  }
  each_scalar(light, error, [&](auto& value) {
    using Value = std::remove_reference_t<decltype(value)>;
    if constexpr (std::is_same_v<Value, int>) {
      value = index_from(scalars.data()[row++], 0, kMostNumber);
    } else {
      value = static_cast<Value>(scalars.data()[row++]);
    }
  });
  const int channels = index_from(scalars.data()[row++], 0, CV_CN_MAX);
  const bool measured = scalars.data()[row++] != 0.0;
  TS_ASSERT(row == kScalars - 1);
  const int bands = index_from(scalars.data()[row], 0, CV_CN_MAX);
  if (measured) light.choice.error = error;
  light.choice.reason = std::string(matrices.rest());
  render::LightField& field = light.field;
  const Eigen::Index count = beams.cols();
  const Eigen::Index nodes = field.nodes.cast<Eigen::Index>().prod();
  if (light.rays < 1 || (count > 0 && (field.nodes < 2).any()) || (field.nodes > kMostNodes).any() ||
      count > render::kMostDirectLamps || (count > 0 && !(field.step > 0.0).all())) {
    fail("its grid isn't one");
  }
  if (beams.rows() != kBesides + bands || flow.rows() != 4 * count || (count > 0 && flow.cols() != nodes) ||
      (pass.size() > 0 && (pass.rows() != bands * count || pass.cols() != nodes))) {
    fail("its matrices don't fit each other");
  }
  for (Eigen::Index k = 0; k < count; ++k) {
    const int beam = static_cast<int>(k);
    const int last = static_cast<int>(count) - 1;
    field.lamp_of.push_back(index_from(beams(0, k), 0, kMostNumber));
    // A flatter beam stands before, a steeper one after: who follows them comes to an end.
    field.beside.push_back({index_from(beams(1, k), -1, beam - 1), index_from(beams(2, k), -1, last),
                            index_from(beams(3, k), -1, last), index_from(beams(4, k), -1, last)});
    if (const int steeper = field.beside.back().steeper; steeper >= 0 && steeper <= beam) {
      fail("its beams don't fit each other");
    }
    field.intensity.emplace_back(beams.col(k).tail(bands).array());
  }
  field.flow = floats_of(flow);
  field.pass = floats_of(pass);
  if (bounced.size() > 0) {
    if (channels < 1 || bounced.rows() % channels != 0) fail("its bounced light has another shape than it should");
    light.bounced.create(static_cast<int>(bounced.cols()), static_cast<int>(bounced.rows()) / channels,
                         CV_32FC(channels));
    for (Eigen::Index j = 0; j < bounced.cols(); ++j) {
      float* to = light.bounced.ptr<float>(static_cast<int>(j));
      for (Eigen::Index i = 0; i < bounced.rows(); ++i) to[i] = static_cast<float>(bounced(i, j));
    }
  }
  return light;
}

}  // namespace

std::filesystem::path light_file(const std::filesystem::path& folder, const std::string& key) {
  return folder / ("light-" + key + ".bin");
}

void write_light(const std::filesystem::path& folder, const std::string& key, const FoundLight& light) {
  const render::LightField& field = light.field;
  const Eigen::Index bands = field.intensity.empty() ? 0 : field.intensity.front().size();
  const Eigen::Index count = field.beam_count();
  Eigen::MatrixXd scalars(kScalars, 1);
  Eigen::Index row = 0;
  const render::DirectError error = light.choice.error.value_or(render::DirectError{});
  each_scalar(light, error, [&](const auto& value) { scalars(row++, 0) = static_cast<double>(value); });
  scalars(row++, 0) = light.bounced.channels();
  scalars(row++, 0) = light.choice.error ? 1.0 : 0.0;
  scalars(row++, 0) = static_cast<double>(bands);
  TS_ASSERT(row == kScalars);
  Eigen::MatrixXd beams(kBesides + bands, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto beam = static_cast<std::size_t>(k);
    const render::BesideBeam& beside = field.beside[beam];
    beams.col(k).head(kBesides) << field.lamp_of[beam], beside.flatter, beside.steeper, beside.left, beside.right;
    beams.col(k).tail(bands) = field.intensity[beam].matrix();
  }
  Eigen::MatrixXd bounced;
  if (!light.bounced.empty()) {
    TS_ASSERT(light.bounced.depth() == CV_32F);
    const Eigen::Index width = Eigen::Index{light.bounced.cols} * light.bounced.channels();
    bounced.resize(width, light.bounced.rows);
    for (int j = 0; j < light.bounced.rows; ++j) {
      bounced.col(j) = Eigen::Map<const Eigen::VectorXf>(light.bounced.ptr<float>(j), width).cast<double>();
    }
  }
  write_whole_file(
      light_file(folder, key),
      matrix_file(kMark, key,
                  {scalars, beams, columns_of(field.flow, 4 * count),
                   field.pass.empty() ? Eigen::MatrixXd() : columns_of(field.pass, bands * count), bounced},
                  light.choice.reason));
}

std::optional<FoundLight> read_light(const std::filesystem::path& folder, const std::string& key) {
  const std::filesystem::path file = light_file(folder, key);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  try {
    return light_in(read_whole_file(file), key);
  } catch (const Error&) {
    return std::nullopt;  // it's made anew, and the file replaced
  }
}

}  // namespace touchstone::sim
