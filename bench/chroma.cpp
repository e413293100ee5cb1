// Frames a second of the chroma sensor's estimator on one core: pictures to readings, and pictures to the field of
// displacements, at the resolution of its design (600 x 600 px), at 640 x 480, and on a picture as large as the camera
// of [Lin2019] gives (7952 x 5304, of which the grid is a small part, and of which it is most). The paper gives no
// speed.

#include <benchmark/benchmark.h>

#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "sensors/colour/colour_marker_finder.h"
#include "sensors/colour/hue_estimator.h"
#include "tests/sensors/colour/painted_colour_markers.h"

namespace touchstone::sensors {
namespace {

constexpr int kFrames = 4;

struct Clip {
  cv::Mat rest;
  std::vector<cv::Mat> frames;
};

enum class View { kDesign, kVga, kSmallInLarge, kLarge };

/// Pictures of a grid of 10 x 10 markers that shear and are pressed, each differently.
Clip make_clip(View view) {
  fixtures::ColourPicture picture;
  picture.noise = 2.0;
  picture.samples = 4;
  if (view == View::kVga) {
    picture.width = 640;
    picture.height = 480;
    picture.spacing_px = 42.0;
    picture.marker_px = picture.film_px = 28.0;
    picture.middle_px = {320.4, 239.7};
  }
  const auto paint = [&] {
    const cv::Mat small = fixtures::paint_colour_markers(picture);
    cv::Mat image = small;
    if (view == View::kSmallInLarge) {
      cv::copyMakeBorder(small, image, 2352, 2352, 3676, 3676, cv::BORDER_REPLICATE);
    } else if (view == View::kLarge) {
      cv::resize(small, image, {5304, 5304}, 0, 0, cv::INTER_LINEAR);
      cv::copyMakeBorder(image, image, 0, 0, 1324, 1324, cv::BORDER_REPLICATE);
    }
    return image;
  };
  Clip clip;
  clip.rest = paint();
  for (int frame = 0; frame < kFrames; ++frame) {
    std::vector<Eigen::Vector3d> displacements;
    for (std::size_t i = 0; i < picture.count(); ++i) {
      const double far = (picture.rest(i) - picture.middle_px).norm() / (4.0 * picture.spacing_px);
      displacements.push_back(std::exp(-far * far) * Eigen::Vector3d(0.2 * frame, -0.1 * frame, -0.5 * frame));
    }
    fixtures::displace(picture, displacements);
    picture.seed = static_cast<std::uint64_t>(2 + frame);
    clip.frames.push_back(paint());
  }
  return clip;
}

/// Of the usual form and size. The figures don't matter for the speed.
HueModel make_model() {
  HueModel model;
  model.form = HueForm::kIsotropic;
  model.isotropic.features = {.coloured_area = false};
  model.isotropic.degree = 2;
  model.isotropic.scale = Eigen::Vector4d(0.2, 0.4, 0.4, 0.2);
  model.isotropic.press = Eigen::VectorXd::Constant(hue_terms(4, 2).rows(), 0.1);
  model.isotropic.lateral = Eigen::VectorXd::Constant(2 * (1 + count_lower_terms(4, 2)), 0.1);
  return model;
}

void run(benchmark::State& state, View view, bool to_field) {
  const Clip clip = make_clip(view);
  ColourMarkerFinder finder({});
  const HueEstimator estimator(make_model(), finder.find_rest(clip.rest));
  std::int64_t frame = 0;
  bool all = true;
  for (auto _ : state) {
    const ColourMarkerReading& reading = finder.find(clip.frames[static_cast<std::size_t>(frame++ % kFrames)]);
    for (const ColourMarker& marker : reading.markers) all = all && marker.flaw == MarkerFlaw::kNone;
    if (to_field) benchmark::DoNotOptimize(estimator.estimate(reading));
  }
  if (!all) state.SkipWithError("a marker was lost");
  state.counters["frames/s"] = benchmark::Counter(static_cast<double>(frame), benchmark::Counter::kIsRate);
}

void find_rest(benchmark::State& state, View view) {
  const Clip clip = make_clip(view);
  ColourMarkerFinder finder({});
  for (auto _ : state) finder.find_rest(clip.rest);
}

BENCHMARK_CAPTURE(run, read_600x600, View::kDesign, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, field_600x600, View::kDesign, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, read_640x480, View::kVga, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, field_640x480, View::kVga, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, field_42MP_small_grid, View::kSmallInLarge, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, field_42MP_large_grid, View::kLarge, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(find_rest, rest_600x600, View::kDesign)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(find_rest, rest_42MP_small_grid, View::kSmallInLarge)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(find_rest, rest_42MP_large_grid, View::kLarge)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace touchstone::sensors

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
