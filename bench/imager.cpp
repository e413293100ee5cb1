// Milliseconds a frame of what a camera does to its pictures, 640 x 480 pixels on one core: the sensor's noise, then
// each step of the pipeline (render/imager/imager.h) by itself.

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "render/cameras/lens_camera.h"
#include "render/imager/automatic_control.h"

namespace touchstone::render {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;

/// A binned colour sensor, three bands.
Imager colour_imager() {
  Imager imager = imx273_skipping(10, 1e-3);
  imager.bayer = BayerPattern::binned;
  imager.tone_curve = LinearTone{};
  return imager;
}

/// A slope with waves, a half of full scale in its middle.
cv::Mat light_for(const Imager& imager) {
  const double full = imager.full_well_e / response_of(imager).electrons_per_irradiance.sum();
  cv::Mat light(kHeight, kWidth, CV_32FC3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double level = full * (0.2 + 0.6 * x / kWidth + 0.1 * std::sin(0.05 * x * y / 100.0));
      light.at<cv::Vec3f>(y, x) = cv::Vec3f::all(static_cast<float>(level));
    }
  }
  return light;
}

const cv::Mat& raw() {
  static const cv::Mat one = expose(light_for(colour_imager()), colour_imager(), 1, 1);
  return one;
}

void expose_with(benchmark::State& state, const HotPixels& hot) {
  Imager imager = colour_imager();
  imager.hot_pixels = hot;
  const cv::Mat light = light_for(imager);
  const FixedPattern pattern = fixed_pattern(imager, light.size(), 1);
  for (auto _ : state) benchmark::DoNotOptimize(expose(light, imager, pattern, 1, 1).data);
}

void develop_with(benchmark::State& state, const ToneCurve& curve, std::optional<JpegSettings> jpeg) {
  Imager imager = colour_imager();
  imager.tone_curve = curve;
  imager.jpeg = jpeg;
  for (auto _ : state) benchmark::DoNotOptimize(develop(raw(), imager).data);
}

void meter(benchmark::State& state) {
  Imager imager = colour_imager();
  imager.auto_exposure = AutoExposure{};
  imager.auto_white_balance = AutoWhiteBalance{};
  const cv::Mat light = light_for(imager);
  ControlState control;
  for (auto _ : state) {
    control = next_state(imager, control, metering_of(light, imager), 1.0 / 30.0);
    benchmark::DoNotOptimize(control);
  }
}

/// One ray for each pixel.
void lens_rays(benchmark::State& state, std::optional<Vignetting> vignetting) {
  LensCamera camera;
  camera.matrix = {700.0, 700.0, 319.5, 239.5};
  camera.vignetting = std::move(vignetting);
  const PreparedLens lens = prepare(camera);
  for (auto _ : state) {
    double sum = 0.0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) sum += lens_ray(lens, x + 0.5, y + 0.5, 0.3, 0.6).weight;
    }
    benchmark::DoNotOptimize(sum);
  }
}

const MonotoneCurve kFourPoints({{0.0, 1.0}, {0.5, 0.94}, {0.8, 0.82}, {1.0, 0.7}});

}  // namespace
}  // namespace touchstone::render

int main(int argc, char** argv) {
  using namespace touchstone;
  using namespace touchstone::render;
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  cv::setNumThreads(1);
  const auto add = [](const char* name, const auto& run) {
    benchmark::RegisterBenchmark(name, run)->Unit(benchmark::kMillisecond);
  };
  add("expose", [](benchmark::State& s) { expose_with(s, {}); });
  add("expose/hot_pixels",
      [](benchmark::State& s) { expose_with(s, {.share = 1e-3, .dark_current_e_per_s = 1e5, .spread = 1.0}); });
  add("develop", [](benchmark::State& s) { develop_with(s, LinearTone{}, {}); });
  add("develop/srgb", [](benchmark::State& s) { develop_with(s, SrgbTone{}, {}); });
  add("develop/points", [](benchmark::State& s) { develop_with(s, MonotoneCurve(), {}); });
  add("develop/jpeg_444", [](benchmark::State& s) { develop_with(s, LinearTone{}, JpegSettings{.quality = 85}); });
  add("develop/jpeg_420", [](benchmark::State& s) {
    develop_with(s, LinearTone{}, JpegSettings{.quality = 85, .chroma = JpegChroma::quarter});
  });
  add("automatic_control", meter);
  add("lens_rays", [](benchmark::State& s) { lens_rays(s, {}); });
  add("lens_rays/polynomial", [](benchmark::State& s) { lens_rays(s, std::vector<double>{-0.3, 0.05}); });
  add("lens_rays/points", [](benchmark::State& s) { lens_rays(s, kFourPoints); });
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
