#include "render/paths/path_tracer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <variant>
#include <vector>

#include "core/error.h"
#include "render/cameras/sampled_ray.h"
#include "render/paths/path_integrator.h"

namespace touchstone::render {
namespace {

constexpr int kTile = 16;  // pixels a side
// Where none of n samples sees the light that is at stake, the share that does is taken for evenly spread from 0 to
// 1/n; this is its standard deviation times n, 1 / sqrt(12).
constexpr double kShareMissed = 0.28867513459481287;
// Shadow is rarer than light, and missing some of it matters less beside the light's own noise.
constexpr std::uint32_t kProbesInTheDark = 8;
constexpr std::uint32_t kProbesInTheLight = 4;
constexpr std::uint64_t kOfDiffraction = 0xd6e8feb86659fd93ull;  // from a seed to one that shares no numbers with it

void check_settings(const RenderSettings& settings, Eigen::Index bands) {
  if (settings.min_samples < 1 || settings.max_samples < settings.min_samples || settings.max_samples > (1 << 24)) {
    fail("render: min_samples {} and max_samples {}; they must be 1 <= min <= max <= 16777216", settings.min_samples,
         settings.max_samples);
  }
  if (settings.max_depth < 0 || settings.max_depth > 10000) {
    fail("render: max_depth is {}; it must be from 0 to 10000", settings.max_depth);
  }
  if (!settings.noise) return;
  const NoiseTarget& noise = *settings.noise;
  if (noise.electrons_per_irradiance.size() != bands) {
    fail("render: electrons_per_irradiance has {} bands; the scene has {}", noise.electrons_per_irradiance.size(),
         bands);
  }
  for (double value : noise.electrons_per_irradiance) {
    if (!(value >= 0.0) || !std::isfinite(value)) {
      fail("render: electrons_per_irradiance is {}; it must be finite and 0 or more", value);
    }
  }
  if (!(noise.read_noise_e >= 0.0 && noise.quantisation_e >= 0.0 && noise.fraction > 0.0) ||
      !std::isfinite(noise.read_noise_e + noise.quantisation_e + noise.fraction)) {
    fail("render: noise target read {} e, quantisation {} e, fraction {}; all finite, the fraction above 0",
         noise.read_noise_e, noise.quantisation_e, noise.fraction);
  }
}

template <typename AnyCamera>
void check_mask(const cv::Mat& mask, const AnyCamera& camera) {
  if (mask.empty()) return;
  if (mask.type() != CV_8UC1 || mask.cols != camera.width || mask.rows != camera.height) {
    fail("render: the mask is {} x {} of OpenCV type {}; it must be {} x {} of type {} (CV_8UC1)", mask.cols, mask.rows,
         mask.type(), camera.width, camera.height, CV_8UC1);
  }
}

/// Mean and standard error of a pixel's scalar signal, from the spread of the means of blocks of samples. An aligned
/// block of 2^k samples is stratified in itself, so the spread of blocks says more truly how good the mean is than that
/// of single samples; blocks hold 4 samples at first and are joined in pairs when there are 32 of them.
class ErrorEstimate {
 public:
  void add(double value) {
    block_ += value;
    if (++in_block_ < block_size_) return;
    sums_[blocks_++] = block_;
    block_ = 0.0;
    in_block_ = 0;
    if (blocks_ < kMostBlocks) return;
    for (int i = 0; i < kMostBlocks / 2; ++i) sums_[i] = sums_[2 * i] + sums_[2 * i + 1];
    blocks_ = kMostBlocks / 2;
    block_size_ *= 2;
  }
  /// Of the whole blocks; infinite below two.
  double standard_error() const {
    if (blocks_ < 2) return std::numeric_limits<double>::infinity();
    const double centre = mean();
    double squares = 0.0;
    for (int i = 0; i < blocks_; ++i) squares += std::pow(sums_[i] / block_size_ - centre, 2);
    return std::sqrt(squares / (static_cast<double>(blocks_ - 1) * blocks_));
  }
  double mean() const {
    double sum = 0.0;
    for (int i = 0; i < blocks_; ++i) sum += sums_[i];
    return blocks_ > 0 ? sum / (static_cast<double>(blocks_) * block_size_) : 0.0;
  }

 private:
  static constexpr int kMostBlocks = 32;
  std::array<double, kMostBlocks> sums_;  // the first blocks_ are in use
  double block_ = 0.0;
  int in_block_ = 0;
  int block_size_ = 4;
  int blocks_ = 0;
};

/// What probes find round a pixel, at direct light only: they look over three pixels by three and at lenses twice as
/// wide.
template <int N>
struct ProbedRim {
  bool light = false;                     ///< did lamp light reach one of them?
  bool shadow = false;                    ///< did something stand in the way of it?
  Bands<N> brightest = Bands<N>::Zero();  ///< irradiance of the brightest that lamp light reached
};

template <int N, typename AnyCamera>
ProbedRim<N> probe_rim(const PathIntegrator<N>& prober, const AnyCamera& camera, std::uint64_t seed,
                       std::uint64_t number, double camera_index, int column, int row, std::uint32_t probes,
                       RayCounts& counts) {
  constexpr std::uint64_t kOtherNumbers = 0x5851f42d4c957f2dull;
  ProbedRim<N> rim;
  for (std::uint32_t probe = 0; probe < probes; ++probe) {
    SampleSequence numbers(seed ^ kOtherNumbers, number, probe);
    const auto [px, py] = numbers.next_pair();
    const double x = std::clamp(column - 1.0 + 3.0 * px, 0.0, static_cast<double>(camera.width));
    const double y = std::clamp(row - 1.0 + 3.0 * py, 0.0, static_cast<double>(camera.height));
    SampleSequence other(seed ^ kOtherNumbers ^ kOfDiffraction, number, probe);
    const auto sample = sampled_ray<N>(camera, x, y, numbers, other);
    if (!sample) continue;
    const CameraRay& ray = sample->ray;
    RayCounts own;
    const Bands<N> basic =
        prober.trace(camera.gel_from_camera * ray.origin, camera.gel_from_camera.turn(ray.direction), numbers, own);
    const Bands<N> value = basic * sample->bands * (ray.weight * camera_index * camera_index);
    rim.light = rim.light || own.direct_lit > 0;
    rim.shadow = rim.shadow || own.direct_lit < own.direct;
    if (own.direct_lit > 0 && value.sum() > rim.brightest.sum()) rim.brightest = value;
    counts += own;
  }
  return rim;
}

template <int N>
struct PixelResult {
  Bands<N> irradiance = Bands<N>::Zero();
  double standard_error = 0.0;
  int samples = 0;
};

/// Takes turns of min, 1.5 min, 2 min, 3 min, 4 min ... samples.
int next_turn(int samples, int min_samples, int max_samples) {
  int power = min_samples;
  while (power <= samples / 2) power *= 2;
  const int next = samples == power ? samples + std::max(4, power / 2) : 2 * power;
  return std::min(max_samples, std::max(next, samples + 1));
}

/// `prober` is null where there are no lamps.
template <int N, typename AnyCamera>
PixelResult<N> sample_pixel(const PathIntegrator<N>& integrator, const PathIntegrator<N>* prober,
                            const AnyCamera& camera, const RenderSettings& settings, double camera_index, int column,
                            int row, RayCounts& counts) {
  PixelResult<N> pixel;
  ErrorEstimate total;
  ErrorEstimate electrons;
  Bands<N> sum = Bands<N>::Zero();
  const bool diffracts = camera.diffraction != nullptr;
  Bands<N> evenly = Bands<N>::Zero();   // with diffraction: the sum without the bands' own weights
  Bands<N> weights = Bands<N>::Zero();  // and the sum of those
  Bands<N> electrons_per_irradiance = Bands<N>::Zero();
  if (settings.noise) electrons_per_irradiance = settings.noise->electrons_per_irradiance;
  const std::uint64_t number =
      static_cast<std::uint64_t>(row) * static_cast<std::uint64_t>(camera.width) + static_cast<std::uint64_t>(column);
  const RigidTransform& gel_from_camera = camera.gel_from_camera;
  int target = settings.min_samples;
  std::uint64_t direct = 0;
  std::uint64_t lit = 0;
  Bands<N> brightest = Bands<N>::Zero();
  bool probed = false;
  ProbedRim<N> rim;
  Bands<N> at_stake = Bands<N>::Zero();  // what samples may or may not have seen, at the rim of a shadow
  for (;;) {
    const RayCounts before = counts;
    for (; pixel.samples < target; ++pixel.samples) {
      SampleSequence numbers(settings.seed, number, static_cast<std::uint32_t>(pixel.samples));
      const auto [px, py] = numbers.next_pair();
      ++counts.paths;
      Bands<N> value = Bands<N>::Zero();
      Bands<N> seen = value;
      SampleSequence other(settings.seed ^ kOfDiffraction, number, static_cast<std::uint32_t>(pixel.samples));
      if (const auto sample = sampled_ray<N>(camera, column + px, row + py, numbers, other)) {
        const CameraRay& ray = sample->ray;
        const Bands<N> basic =
            integrator.trace(gel_from_camera * ray.origin, gel_from_camera.turn(ray.direction), numbers, counts);
        const Bands<N> light = basic * (ray.weight * camera_index * camera_index);
        seen = value = light;
        if (diffracts) {
          value *= sample->bands;
          // Weights are 1 on the mean: what they make of evenly lit surroundings is no error.
          seen = value;
          if (pixel.samples > 0) seen -= (sample->bands - 1.0) * (evenly / pixel.samples);
          evenly += light;
          weights += sample->bands;
        }
      } else {
        weights += 1.0;
      }
      sum += value;
      if (value.sum() > brightest.sum()) brightest = value;
      total.add(seen.sum());
      if (settings.noise) electrons.add((seen * electrons_per_irradiance).sum());
    }
    if (!settings.noise || pixel.samples >= settings.max_samples) break;
    direct += counts.direct - before.direct;
    lit += counts.direct_lit - before.direct_lit;
    const NoiseTarget& noise = *settings.noise;
    const double imager_noise = std::sqrt(std::max(0.0, electrons.mean()) + noise.read_noise_e * noise.read_noise_e +
                                          noise.quantisation_e * noise.quantisation_e);
    const double allowed = noise.fraction * imager_noise;
    if (electrons.standard_error() <= allowed) {
      const auto matters = [&](const Bands<N>& light) {
        return kShareMissed / pixel.samples * (light * electrons_per_irradiance).sum() > allowed;
      };
      // What shines by itself, without a lamp in sight, has no rim of a shadow.
      const bool by_lamps = direct > 0 || !(electrons.mean() > 0.0);
      const bool dark = lit == 0;
      const bool bright = lit == direct;
      if (prober != nullptr && by_lamps && !probed && (dark || (bright && matters(brightest)))) {
        probed = true;
        rim = probe_rim(*prober, camera, settings.seed, number, camera_index, column, row,
                        dark ? kProbesInTheDark : kProbesInTheLight, counts);
      }
      at_stake.setZero();
      if (by_lamps && dark && rim.light) at_stake = rim.brightest;
      if (by_lamps && !dark && (!bright || rim.shadow)) at_stake = brightest;
      if (!matters(at_stake)) break;
    }
    target = next_turn(pixel.samples, settings.min_samples, settings.max_samples);
  }
  // With diffraction the weighted mean: off by less than the weights' own scatter over the samples, and never below
  // zero.
  pixel.irradiance = diffracts ? Bands<N>((weights > 0.0).select(sum / weights, 0.0))
                               : Bands<N>(sum / static_cast<double>(pixel.samples));
  pixel.standard_error = std::max(total.standard_error(), kShareMissed / pixel.samples * at_stake.sum());
  return pixel;
}

/// Of the medium that the camera stands in.
template <int N, typename AnyCamera>
double index_at(const PreparedScene<N>& scene, const AnyCamera& camera) {
  return scene.media[scene.medium_of_layer(scene.layer_at(camera.gel_from_camera.translation.z()))].index;
}

/// Calls work(tile, row, left, right, counts) for each row of each tile of kTile x kTile places, tiles side by side in
/// threads; counts are summed in the tiles' order.
template <typename Work>
RayCounts over_tiles(int columns, int rows, const Work& work) {
  const int tiles_across = (columns + kTile - 1) / kTile;
  const int tiles = tiles_across * ((rows + kTile - 1) / kTile);
  std::vector<RayCounts> tile_counts(tiles);
  tbb::parallel_for(0, tiles, [&](int tile) {
    const int left = (tile % tiles_across) * kTile;
    const int top = (tile / tiles_across) * kTile;
    RayCounts counts;
    for (int row = top; row < std::min(top + kTile, rows); ++row) {
      work(tile, row, left, std::min(left + kTile, columns), counts);
    }
    tile_counts[tile] = counts;
  });
  RayCounts sum;
  for (const RayCounts& counts : tile_counts) sum += counts;
  return sum;
}

template <int N, typename AnyCamera>
RenderedImage render_image(const PreparedScene<N>& scene, const AnyCamera& camera, const RenderSettings& settings,
                           const cv::Mat& mask) {
  RenderedImage image;
  image.irradiance = cv::Mat::zeros(camera.height, camera.width, CV_32FC(N));
  image.standard_error = cv::Mat::zeros(camera.height, camera.width, CV_32FC1);
  image.samples = cv::Mat::zeros(camera.height, camera.width, CV_32SC1);
  const PathIntegrator<N> integrator(scene, settings.max_depth, scene.interreflection);
  const PathIntegrator<N> prober(scene, 0, false, 2.0);
  const double camera_index = index_at(scene, camera);
  image.counts = over_tiles(camera.width, camera.height, [&](int, int row, int left, int right, RayCounts& counts) {
    auto* irradiance = image.irradiance.ptr<float>(row);
    auto* error = image.standard_error.ptr<float>(row);
    auto* samples = image.samples.ptr<int>(row);
    const auto* wanted = mask.empty() ? nullptr : mask.ptr<unsigned char>(row);
    for (int column = left; column < right; ++column) {
      if (wanted != nullptr && wanted[column] == 0) continue;
      const PixelResult<N> pixel = sample_pixel(integrator, scene.lamps.empty() ? nullptr : &prober, camera, settings,
                                                camera_index, column, row, counts);
      for (int band = 0; band < N; ++band) irradiance[N * column + band] = static_cast<float>(pixel.irradiance[band]);
      error[column] = static_cast<float>(pixel.standard_error);
      samples[column] = pixel.samples;
    }
  });
  return image;
}

template <int N, typename AnyCamera>
cv::Mat preview_image(const PreparedScene<N>& scene, const AnyCamera& camera, int stride) {
  const int rows = (camera.height + stride - 1) / stride;
  const int columns = (camera.width + stride - 1) / stride;
  cv::Mat image = cv::Mat::zeros(rows, columns, CV_32FC(N));
  const PathIntegrator<N> integrator(scene, 0, false);
  const double camera_index = index_at(scene, camera);
  tbb::parallel_for(0, rows, [&](int row) {
    auto* irradiance = image.ptr<float>(row);
    RayCounts counts;
    for (int column = 0; column < columns; ++column) {
      SampleSequence numbers = SampleSequence::centre();
      const auto ray = camera_ray(camera, (column + 0.5) * stride, (row + 0.5) * stride, 0.5, 0.5);
      if (!ray) continue;
      const Bands<N> basic = integrator.trace(camera.gel_from_camera * ray->origin,
                                              camera.gel_from_camera.turn(ray->direction), numbers, counts);
      for (int band = 0; band < N; ++band) {
        irradiance[N * column + band] = static_cast<float>(basic[band] * ray->weight * camera_index * camera_index);
      }
    }
  });
  return image;
}

/// The place of a point in its tile along the Z curve: an aligned block of 2^k x 2^k points has numbers in a row.
std::uint32_t z_order(int column, int row) {
  std::uint32_t number = 0;
  for (int bit = 0; (1 << bit) < kTile; ++bit) {
    number |= static_cast<std::uint32_t>((column >> bit) & 1) << (2 * bit);
    number |= static_cast<std::uint32_t>((row >> bit) & 1) << (2 * bit + 1);
  }
  return number;
}

template <int N, typename AnyCamera>
cv::Mat central_image(const PreparedScene<N>& scene, const AnyCamera& camera, const ImageGrid& grid,
                      const cv::Mat& paths, const RenderSettings& settings, RayCounts& all_counts) {
  constexpr std::uint64_t kOtherCount = 0x9d2c5680f3a1b7e5ull;  // points with as many paths share a sequence
  cv::Mat image = cv::Mat::zeros(grid.rows, grid.columns, CV_32FC(N));
  const PathIntegrator<N> integrator(scene, settings.max_depth, scene.interreflection);
  const double camera_index = index_at(scene, camera);
  all_counts += over_tiles(grid.columns, grid.rows, [&](int tile, int row, int left, int right, RayCounts& counts) {
    auto* out = image.ptr<float>(row);
    for (int column = left; column < right; ++column) {
      const int count = paths.empty() ? 1 : std::max<int>(1, paths.at<unsigned char>(row, column));
      const std::uint32_t place = z_order(column - left, row % kTile);
      const std::uint64_t seed = settings.seed + kOtherCount * static_cast<std::uint64_t>(count - 1);
      Bands<N> sum = Bands<N>::Zero();
      for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(count); ++i) {
        SampleSequence numbers(seed, static_cast<std::uint64_t>(tile), place * static_cast<std::uint32_t>(count) + i);
        const auto [px, py] = numbers.next_pair();
        numbers.next_pair();  // the place in the hole, which is its centre
        const double x = grid.left + (column + px - 0.5) * grid.spacing;
        const double y = grid.top + (row + py - 0.5) * grid.spacing;
        const auto ray = camera_ray(camera, x, y, 0.5, 0.5);
        if (!ray) continue;
        ++counts.paths;
        sum += integrator.trace(camera.gel_from_camera * ray->origin, camera.gel_from_camera.turn(ray->direction),
                                numbers, counts);
      }
      for (int band = 0; band < N; ++band) {
        out[N * column + band] = static_cast<float>(sum[band] * (camera_index * camera_index / count));
      }
    }
  });
  return image;
}

template <int N>
std::unique_ptr<PreparedScene<N>> prepare_scene(const Scene& scene) {
  auto prepared = std::make_unique<PreparedScene<N>>(scene);
  weigh_lamps(*prepared);
  return prepared;
}

template <int N>
Spectrum mean_radiance(const PreparedScene<N>& scene, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                       const RenderSettings& settings) {
  const PathIntegrator<N> integrator(scene, settings.max_depth, scene.interreflection);
  Bands<N> sum = Bands<N>::Zero();
  RayCounts counts;
  for (int sample = 0; sample < settings.min_samples; ++sample) {
    SampleSequence numbers(settings.seed, 0, static_cast<std::uint32_t>(sample));
    sum += integrator.trace(origin, direction, numbers, counts);
  }
  return sum / static_cast<double>(settings.min_samples);
}

}  // namespace

RayCounts& RayCounts::operator+=(const RayCounts& other) {
  paths += other.paths;
  primary += other.primary;
  connections += other.connections;
  bounces += other.bounces;
  direct += other.direct;
  direct_lit += other.direct_lit;
  return *this;
}

struct Tracer::Prepared {
  std::variant<std::unique_ptr<PreparedScene<1>>, std::unique_ptr<PreparedScene<3>>, std::unique_ptr<PreparedScene<8>>,
               std::unique_ptr<PreparedScene<16>>>
      scene;
  Eigen::Index bands = 0;
};

Tracer::Tracer(const Scene& scene) : prepared_(std::make_unique<Prepared>()) {
  check_scene(scene);
  prepared_->bands = scene.environment.size();
  switch (prepared_->bands) {
    case 1:
      prepared_->scene = prepare_scene<1>(scene);
      break;
    case 3:
      prepared_->scene = prepare_scene<3>(scene);
      break;
    case 8:
      prepared_->scene = prepare_scene<8>(scene);
      break;
    case 16:
      prepared_->scene = prepare_scene<16>(scene);
      break;
    default:
      fail("scene: {} bands; the tracer carries 1, 3, 8 or 16", prepared_->bands);
  }
}

Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;
Tracer& Tracer::operator=(Tracer&&) noexcept = default;

RenderedImage Tracer::render(const Camera& camera, const RenderSettings& settings, const cv::Mat& mask) const {
  const ReadyCamera ready = make_ready(camera);
  check_settings(settings, prepared_->bands);
  return std::visit(
      [&](const auto& scene, const auto& one) {
        check_mask(mask, one);
        return render_image(*scene, one, settings, mask);
      },
      prepared_->scene, ready);
}

cv::Mat Tracer::preview(const Camera& camera, int stride) const {
  const ReadyCamera ready = make_ready(camera);
  if (stride < 1) fail("preview: stride is {}; it must be 1 or more", stride);
  return std::visit([&](const auto& scene, const auto& one) { return preview_image(*scene, one, stride); },
                    prepared_->scene, ready);
}

cv::Mat Tracer::central_paths(const Camera& camera, const ImageGrid& grid, const cv::Mat& paths,
                              const RenderSettings& settings, RayCounts& counts) const {
  const ReadyCamera ready = make_ready(camera);
  check_settings(settings, prepared_->bands);
  TS_ASSERT(paths.empty() || (paths.type() == CV_8UC1 && paths.rows == grid.rows && paths.cols == grid.columns));
  return std::visit(
      [&](const auto& scene, const auto& one) { return central_image(*scene, one, grid, paths, settings, counts); },
      prepared_->scene, ready);
}

Spectrum Tracer::radiance(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                          const RenderSettings& settings) const {
  check_settings(settings, prepared_->bands);
  if (!origin.allFinite() || !direction.allFinite() || !(direction.norm() > 1e-9)) {
    fail("radiance: origin and direction must be finite, the direction not zero");
  }
  return std::visit([&](const auto& scene) { return mean_radiance(*scene, origin, direction.normalized(), settings); },
                    prepared_->scene);
}

}  // namespace touchstone::render
