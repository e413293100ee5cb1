#include "bench/light_peer_sections.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "bench/cycles_peer.h"
#include "bench/light_scenes.h"
#include "bench/picture_comparison.h"
#include "bench/stopwatch.h"
#include "core/error.h"
#include "core/units.h"
#include "render/paths/path_tracer.h"

namespace touchstone::bench {
namespace {

/// What is drawn: see peer_scene.
struct PeerCase {
  std::string name;
  bool slab = true;
  bool interreflection = true;
  int lamps = 1;
  double lens_radius = 2.5;      // mm
  bool shadow_caustics = false;  // in Cycles
};

/// A dented matt membrane of 20 x 20 mm and 20,000 triangles, seen from below through 2 mm of glass and 5 mm of gel (or
/// bare), lit by disc lamps 20 mm below and 25 mm beside it. No mirror image of a lamp is in the camera's view: our
/// lamps can't be seen.
render::Scene peer_scene(const PeerCase& one) {
  render::Scene scene;
  if (one.slab) {
    scene.media = {render::Medium{1.0}, render::Medium{1.5}, render::Medium{1.41}};
    scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}};
  }
  scene.environment = render::flat_spectrum(3, 0.0);
  scene.interreflection = one.interreflection;
  TriangleMesh mesh =
      height_field(100, [](double x, double y) { return -std::exp(-((x - 1.0) * (x - 1.0) + y * y) / 4.0); });
  scene.surfaces.push_back({std::move(mesh), render::Lambertian{render::flat_spectrum(3, 0.6)}});
  for (int k = 0; k < one.lamps; ++k) {
    const double angle = 0.5 + 2.0 * kPi * k / one.lamps;
    render::SpotLamp lamp;
    lamp.position = {25.0 * std::cos(angle), 25.0 * std::sin(angle), -20.0};
    lamp.direction = Eigen::Vector3d(0, 0, -3) - lamp.position;
    lamp.lens_radius = one.lens_radius;
    lamp.half_angle = 35.0 * kRadiansPerDegree;
    lamp.soft_angle = 0.0;
    lamp.power_W = render::flat_spectrum(3, 0.5);
    scene.lamps.push_back(lamp);
  }
  return scene;
}

/// 64 x 48 pixels behind a point.
render::PinholeCamera peer_camera() {
  render::PinholeCamera camera;
  camera.width = 64;
  camera.height = 48;
  camera.pixel_pitch_um = 69.0;
  camera.hole_diameter_um = 1.0;
  camera.foil_thickness_um = 0.0;
  camera.distance_mm = 5.0;
  camera.gel_from_camera = look_at({0, 0, -22.4}, {0, 0, 0}, {0, 1, 0});
  return camera;
}

/// The irradiance that a radiance of one gives in each pixel: Cycles' pixels are mean radiances.
cv::Mat irradiance_per_radiance(const render::PinholeCamera& camera) {
  cv::Mat factor(camera.height, camera.width, CV_32FC1);
  constexpr int kGrid = 4;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      double sum = 0.0;
      for (int k = 0; k < kGrid * kGrid; ++k) {
        const double x = column + (k % kGrid + 0.5) / kGrid;
        const double y = row + (k / kGrid + 0.5) / kGrid;
        const auto ray = render::pinhole_ray(camera, x, y, 0.5, 0.5);
        TS_ASSERT(ray.has_value());
        sum += ray->weight;
      }
      factor.at<float>(row, column) = static_cast<float>(sum / (kGrid * kGrid));
    }
  }
  return factor;
}

/// Per pixel, central differences.
std::array<cv::Mat, 2> gradient(const cv::Mat& picture) {
  std::array<cv::Mat, 2> slopes;
  cv::Sobel(picture, slopes[0], CV_32F, 1, 0, 1, 0.5, 0.0, cv::BORDER_REPLICATE);
  cv::Sobel(picture, slopes[1], CV_32F, 0, 1, 1, 0.5, 0.0, cv::BORDER_REPLICATE);
  return slopes;
}

/// The mean radiance over each pixel: with the irradiance E = mean of w L, it is (E - covariance of w and L) / mean of
/// w; for a pixel over which both run straight the covariance is a twelfth of the product of their slopes. That is
/// less than 1e-4 of E, but the bare membrane is compared as finely as 1e-5.
cv::Mat mean_radiance(const cv::Mat& irradiance, const cv::Mat& factor) {
  const cv::Mat radiance = irradiance / factor;
  const auto of_radiance = gradient(radiance);
  const auto of_factor = gradient(factor);
  const cv::Mat covariance = (of_radiance[0].mul(of_factor[0]) + of_radiance[1].mul(of_factor[1])) / 12.0;
  return radiance - covariance / factor;
}

int threads() {
  return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

/// Some pictures of one scene, each with a seed of its own, and the mean cost of one.
struct PictureSet {
  std::vector<cv::Mat> radiance;  // first band
  int samples = 0;
  double seconds = 0.0;
  double processor_seconds = 0.0;

  /// Variance times processor seconds: the less, the better the program.
  double cost() const { return relative_noise(radiance) * relative_noise(radiance) * processor_seconds; }
};

class Ours {
 public:
  explicit Ours(const PeerCase& one) : tracer_(peer_scene(one)) {}

  PictureSet draw(int samples, int pictures) const {
    PictureSet set;
    set.samples = samples;
    render::RenderSettings settings;
    settings.min_samples = settings.max_samples = samples;
    settings.max_depth = 64;  // Cycles' paths end by chance only, too
    const Stopwatch clock;
    const ProcessorStopwatch processor;
    std::vector<cv::Mat> irradiance;
    for (int k = 0; k < pictures; ++k) {
      settings.seed = 1000 + static_cast<std::uint64_t>(k);
      irradiance.push_back(tracer_.render(camera_, settings).irradiance);
    }
    set.seconds = clock.seconds() / pictures;
    set.processor_seconds = processor.seconds() / pictures;
    for (const cv::Mat& picture : irradiance) {
      cv::Mat band;
      cv::extractChannel(picture, band, 0);
      set.radiance.push_back(mean_radiance(band, factor_));
    }
    return set;
  }

 private:
  render::PinholeCamera camera_ = peer_camera();
  cv::Mat factor_ = irradiance_per_radiance(camera_);
  render::Tracer tracer_;
};

/// What Cycles draws in one process: `pictures` of each number of samples.
std::vector<PictureSet> draw_with_cycles(const PeerCase& one, const std::vector<int>& samples, int pictures,
                                         const std::filesystem::path& scratch, double* overhead = nullptr) {
  CyclesOptions options;
  options.threads = threads();
  if (!one.interreflection) (one.slab ? options.most_matt_bounces : options.most_bounces) = one.slab ? 1 : 0;
  options.shadow_caustics = one.shadow_caustics;
  std::vector<CyclesJob> jobs;
  for (const int count : samples) {
    // Far apart: neighbouring seeds aren't known to be independent.
    for (int k = 0; k < pictures; ++k) jobs.push_back({static_cast<std::uint32_t>(jobs.size() + 1) * 104729, count});
  }
  const CyclesRun run = run_cycles(peer_scene(one), peer_camera(), options, jobs, scratch);
  if (overhead != nullptr) *overhead = run.overhead_seconds;
  std::vector<PictureSet> sets;
  for (std::size_t k = 0; k < jobs.size(); ++k) {
    if (k % static_cast<std::size_t>(pictures) == 0) sets.push_back({{}, jobs[k].samples, 0.0, 0.0});
    PictureSet& set = sets.back();
    cv::Mat band;
    cv::extractChannel(run.pictures[k].radiance, band, 0);
    set.radiance.push_back(band);
    set.seconds += run.pictures[k].seconds / pictures;
    set.processor_seconds += run.pictures[k].processor_seconds / pictures;
  }
  return sets;
}

}  // namespace

ResultTable equal_pictures_table(const LightPeerOptions& options) {
  ResultTable table;
  table.name = "light-peer-equal";
  table.title = "The same pictures?";
  table.columns = {"scene",    "our samples",    "Cycles' samples", "Cycles / ours", "standard error",
                   "mean z^2", "of noise alone", "largest z",       "equal"};
  struct Row {
    PeerCase scene;
    int our_samples, cycles_samples;
  };
  std::vector<Row> rows = {{{"bare membrane, direct light", false, false, 1, 5.0}, 32, 32},
                           {{"bare membrane, all light", false, true, 1, 5.0}, 32, 64},
                           {{"slab, all light, lamp of 16 mm", true, true, 1, 8.0}, 64, 256}};
  if (!options.quick) {
    rows = {{{"bare membrane, direct light", false, false, 1, 5.0}, 128, 128},
            {{"bare membrane, all light", false, true, 1, 5.0}, 128, 256},
            {{"slab, direct light, lamp of 16 mm", true, false, 1, 8.0}, 128, 512},
            {{"slab, all light, lamp of 16 mm", true, true, 1, 8.0}, 128, 512},
            {{"slab, all light, four lamps of 10 mm", true, true, 4, 5.0}, 128, 256},
            {{"slab, all light, lamp of 5 mm", true, true, 1, 2.5}, 128, 1024},
            {{"slab, direct light, lamp of 16 mm, shadow caustics", true, false, 1, 8.0, true}, 64, 32},
            {{"slab, all light, lamp of 16 mm, shadow caustics", true, true, 1, 8.0, true}, 64, 32}};
  }
  constexpr int kPictures = 16;
  constexpr int kBlock = 8;
  for (const Row& row : rows) {
    const PictureSet ours = Ours(row.scene).draw(row.our_samples, kPictures);
    const PictureSet theirs = draw_with_cycles(row.scene, {row.cycles_samples}, kPictures, options.scratch).front();
    const PictureComparison result = compare_pictures(ours.radiance, theirs.radiance, kBlock);
    table.rows.push_back({row.scene.name, fmt::format("{}", kPictures * row.our_samples),
                          fmt::format("{}", kPictures * row.cycles_samples), fmt::format("{:.6f}", result.mean_ratio),
                          fmt::format("{:.6f}", result.ratio_error), fmt::format("{:.2f}", result.mean_square_z),
                          fmt::format("{:.2f} +- {:.2f}", result.expected_mean_square_z, result.mean_square_z_error),
                          fmt::format("{:.1f}", result.largest_z), result.equal() ? "yes" : "NO"});
  }
  table.remarks = {
      fmt::format(
          "A dented matt membrane (albedo 0.6, 20,000 triangles) seen by a point camera of 64 x 48 pixels from "
          "below, bare or through 2 mm of glass (1.5) and 5 mm of gel (1.41), lit by disc lamps of equal "
          "intensity in a cone of 35 degrees, 25 mm beside and 20 mm below it; both programs are given the very "
          "same triangles. {} pictures of each program with seeds of their own; samples are a pixel's in all of "
          "them.",
          kPictures),
      fmt::format("z: difference of the two means over a block of {} x {} pixels over its standard error, from how the "
                  "block differs from picture to picture. \"Equal\": ratio of the whole pictures and mean z^2 both "
                  "within three standard errors of what noise alone gives (Student's t, as the variances come from few "
                  "pictures).",
                  kBlock, kBlock),
      "No figure is fitted: radiances are compared in W/m^2/sr. Direct light: straight from a lamp, or through the "
      "faces only."};
  if (!options.quick) {
    table.remarks.push_back(
        "Shadow caustics are Cycles' own connections through smooth faces (manifold next event estimation, off by "
        "default): the last rows show that they give another picture than Cycles' own paths do.");
  }
  return table;
}

ResultTable equal_noise_table(const LightPeerOptions& options) {
  ResultTable table;
  table.name = "light-peer-noise";
  table.title = "Noise against seconds";
  table.columns = {"scene", "program", "samples", "s", "processor s", "noise, %", "s to 1 %", "variance at equal time"};
  constexpr int kPictures = 4;
  double our_cost = 0.0;
  double least_ratio = INFINITY;  // of Cycles without shadow caustics, through a slab
  double least_ratio_with_caustics = INFINITY;
  double overhead = 0.0;
  const auto add = [&](const PeerCase& scene, const std::string& program, const std::vector<PictureSet>& sets) {
    plots::PlotCurve curve;
    curve.name = program;
    for (const PictureSet& set : sets) {
      const double noise = relative_noise(set.radiance);
      table.rows.push_back({scene.name, program, fmt::format("{}", set.samples), fmt::format("{:.3f}", set.seconds),
                            fmt::format("{:.3f}", set.processor_seconds), fmt::format("{:.3f}", 100.0 * noise),
                            fmt::format("{:.3g}", set.seconds * noise * noise * 1e4),
                            fmt::format("{:.3g}", set.cost() / our_cost)});
      curve.points.emplace_back(set.seconds, noise);
    }
    table.plots.back().curves.push_back(curve);
    return sets.back().cost() / our_cost;
  };
  std::vector<PeerCase> scenes = {{"slab, lamp of 16 mm", true, true, 1, 8.0}};
  if (!options.quick) {
    scenes.insert(scenes.begin(), {"bare membrane", false, true, 1, 5.0});
    scenes.push_back({"slab, lamp of 5 mm", true, true, 1, 2.5});
    scenes.push_back({"slab, lamp of 2 mm", true, true, 1, 1.0});
  }
  for (const PeerCase& scene : scenes) {
    table.plots.push_back(
        {"Noise against seconds: " + scene.name, "seconds a picture", "relative noise of a pixel", true, true, {}});
    const Ours ours(scene);
    std::vector<PictureSet> sets;
    for (const int samples : {4, 16, 64, 256}) sets.push_back(ours.draw(samples, kPictures));
    our_cost = sets.back().cost();
    add(scene, "ours", sets);
    const std::vector<int> samples = options.quick ? std::vector{64, 256} : std::vector{64, 256, 512};
    const double ratio = add(scene, "Cycles", draw_with_cycles(scene, samples, kPictures, options.scratch, &overhead));
    if (!scene.slab) continue;
    least_ratio = std::min(least_ratio, ratio);
    PeerCase with_caustics = scene;
    with_caustics.shadow_caustics = true;
    least_ratio_with_caustics = std::min(
        least_ratio_with_caustics,
        add(scene, "Cycles, shadow caustics", draw_with_cycles(with_caustics, {16, 64}, kPictures, options.scratch)));
  }
  table.remarks = {
      fmt::format(
          "Goal: through a slab at least 50 times less variance than Cycles at equal time; measured at least "
          "{:.3g} times, and {:.3g} times against its shadow caustics (relative to each picture's own mean; theirs "
          "is too dark).",
          least_ratio, least_ratio_with_caustics),
      fmt::format("{} threads each. Seconds are those of tracing a picture: ours without making the tracer, Cycles' "
                  "without its start and without what a picture of one sample takes ({:.3f} s here). Noise: root mean "
                  "square over the pixels of the standard deviation over {} seeds, over the mean.",
                  threads(), overhead, kPictures),
      "Variance at equal time: noise squared times processor seconds, over ours at 256 samples; processor seconds are "
      "summed over the threads, so that what others on the machine take doesn't count. \"s to 1 %\" takes noise to "
      "fall as 1/sqrt(time) from that row.",
      "Cycles finds the lamps through the slab by chance only, so its noise grows as the lamps get smaller. Both "
      "programs connect to the lamps on the bare membrane. Three bands (R, G, B) in both."};
  return table;
}

}  // namespace touchstone::bench
