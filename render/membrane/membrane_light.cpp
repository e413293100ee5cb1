#include "render/membrane/membrane_light.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/error.h"
#include "render/cameras/camera_rays.h"
#include "render/materials/fresnel.h"
#include "render/membrane/face_shadow.h"
#include "render/membrane/face_spectrum.h"

namespace touchstone::render {
namespace {

constexpr int kSectors = kFaceSectors;
constexpr int kMostRounds = 2000;
constexpr int kLensSamples = 16;
constexpr int kTerms = 6;  // of a view kernel, see ViewTerms

using Sectors = std::array<double, kSectors>;
using Fields = std::array<cv::Mat, kSectors>;

/// Fresnel's reflectance from inside, mean over a sector of even light.
Sectors even_reflectance(const MembraneKernels& kernels) {
  constexpr int kSteps = 200;
  Sectors out = {};
  for (int j = 0; j < kSectors; ++j) {
    for (int k = 0; k < kSteps; ++k) {
      const double squared = kernels.limits[j] + (kernels.limits[j + 1] - kernels.limits[j]) * (k + 0.5) / kSteps;
      out[j] += fresnel(kernels.optics.index, 1.0, std::sqrt(squared)).mean_reflectance() / kSteps;
    }
  }
  return out;
}

/// The light that walks bring from a face without an end that is in one state all over.
struct EvenFace {
  Sectors g, h;
};

/// `contact` is 0 or 1 (or a share), before surroundings of `behind`.
EvenFace solve_even(const MembraneKernels& kernels, double behind, double contact, double albedo) {
  Eigen::Matrix<double, kSectors, kSectors> crossing;
  Eigen::Matrix<double, kSectors, 1> out;
  for (int i = 0; i < kSectors; ++i) {
    out[i] = 1.0 - kernels.exchange_absorbed[i];
    for (int j = 0; j < kSectors; ++j) {
      crossing(i, j) = kernels.exchange[i][j].total();
      out[i] -= crossing(i, j);
    }
  }
  // h = R g + s with R_ji; g = out + crossing h.
  Eigen::Matrix<double, kSectors, kSectors> returns;
  Eigen::Matrix<double, kSectors, 1> given;
  for (int j = 0; j < kSectors; ++j) {
    const double mirrored = (1.0 - contact) * kernels.exchange_reflectance[j];
    given[j] = (1.0 - contact) * (1.0 - kernels.exchange_reflectance[j]) * behind;
    for (int i = 0; i < kSectors; ++i) {
      returns(j, i) = contact * albedo * (kernels.limits[i + 1] - kernels.limits[i]) + (i == j ? mirrored : 0.0);
    }
  }
  const Eigen::Matrix<double, kSectors, kSectors> one = Eigen::Matrix<double, kSectors, kSectors>::Identity();
  const Eigen::Matrix<double, kSectors, 1> g = (one - crossing * returns).inverse() * (out + crossing * given);
  const Eigen::Matrix<double, kSectors, 1> h = returns * g + given;
  EvenFace face;
  for (int i = 0; i < kSectors; ++i) {
    face.g[i] = g[i];
    face.h[i] = h[i];
  }
  return face;
}

double mean_over_sectors(const MembraneKernels& kernels, const Sectors& g) {
  double mean = 0.0;
  for (int i = 0; i < kSectors; ++i) mean += (kernels.limits[i + 1] - kernels.limits[i]) * g[i];
  return mean;
}

double even_face_radiance(const MembraneKernels& kernels, const EvenFace& face, double behind, double contact,
                          double albedo, double squared_sine) {
  const MembraneOptics& optics = kernels.optics;
  const double square = kernels.largest_sine * kernels.largest_sine;
  const double slant = squared_sine - square / 2.0;
  const double matt = contact * albedo * mean_over_sectors(kernels, face.g);
  const double length = optics.thickness_mm / std::sqrt(1.0 - squared_sine);
  double out =
      1.0 - std::exp(-optics.scattering_per_mm * length) - kernels.view_absorbed[0] - slant * kernels.view_absorbed[1];
  double seen = 0.0;
  for (int j = 0; j < kSectors; ++j) {
    const double share = kernels.view[j].even.total() + slant * kernels.view[j].slant.total();
    const double mirrored = kernels.view_reflectance[j];
    out -= share;
    seen += share * ((1.0 - contact) * (mirrored * face.g[j] + (1.0 - mirrored) * behind) + matt);
  }
  const double mirrored = fresnel(optics.index, 1.0, std::sqrt(1.0 - squared_sine)).mean_reflectance();
  seen += straight_share(optics, squared_sine) *
          ((1.0 - contact) * (mirrored * face.g[kSectors - 1] + (1.0 - mirrored) * behind) + matt);
  return out + seen;
}

/// How often a coarse cell holds a fine one; 0 where it isn't a whole number.
int whole_factor(double coarse, double fine) {
  const double ratio = coarse / fine;
  const auto factor = static_cast<int>(std::lround(ratio));
  return factor >= 1 && std::abs(ratio - factor) < 1e-6 * ratio ? factor : 0;
}

void check(const FaceGrid& grid, const MembraneLightSettings& settings) {
  if (!(grid.spacing_mm > 0.0) || !std::isfinite(grid.spacing_mm) || grid.columns < 1 || grid.rows < 1 ||
      !std::isfinite(grid.left_mm) || !std::isfinite(grid.top_mm)) {
    fail("membrane light: the grid has {} x {} cells of {} mm; allowed are at least one cell and a finite place",
         grid.columns, grid.rows, grid.spacing_mm);
  }
  if (!(settings.behind >= 0.0) || !std::isfinite(settings.behind)) {
    fail("membrane light: behind is {}; it must be at least 0", settings.behind);
  }
  if (!(settings.tolerance > 0.0)) fail("membrane light: tolerance is {}; it must be above 0", settings.tolerance);
  const int view = whole_factor(settings.view_cell_mm, grid.spacing_mm);
  const int coarse = whole_factor(settings.exchange_cell_mm, settings.view_cell_mm);
  if (view == 0 || coarse == 0 || grid.columns % (view * coarse) != 0 || grid.rows % (view * coarse) != 0) {
    fail(
        "membrane light: cells of {} mm for the view and {} mm for the exchange don't fit a grid of {} x {} cells of "
        "{} mm; each must be a multiple of the one before, and the grid one of the coarsest",
        settings.view_cell_mm, settings.exchange_cell_mm, grid.columns, grid.rows, grid.spacing_mm);
  }
  for (const double reach : {settings.view_reach_mm, settings.exchange_reach_mm}) {
    if (!(reach >= settings.exchange_cell_mm && reach <= 1e3)) {
      fail("membrane light: a kernel's reach is {} mm; allowed is {} to 1000", reach, settings.exchange_cell_mm);
    }
  }
}

/// A pixel's ray where it enters the membrane.
struct PixelRay {
  bool sees_membrane = false;
  float column = 0.0F, row = 0.0F;     // on the view grid, in cells: where the straight ray meets the face
  float sine_x = 0.0F, sine_y = 0.0F;  // in the membrane
  float slant = 0.0F;                  // squared sine less half of the largest
  float straight = 0.0F;               // share that gets to the face straight
  float mirrored = 0.0F;               // Fresnel there
  float free = 0.0F;                   // what is seen of the free face
  float weight = 0.0F;                 // irradiance of what is seen
  float veil = 0.0F;                   // irradiance of what is mirrored before
};

/// Bilinear look-up in maps of one size.
struct Place {
  int at[4];
  float weight[4];
};
Place place_of(const PixelRay& ray, int columns, int rows) {
  const float x = std::clamp(ray.column - 0.5F, 0.0F, static_cast<float>(columns - 1));
  const float y = std::clamp(ray.row - 0.5F, 0.0F, static_cast<float>(rows - 1));
  const int i = std::min(static_cast<int>(x), std::max(columns - 2, 0));
  const int j = std::min(static_cast<int>(y), std::max(rows - 2, 0));
  const float u = x - static_cast<float>(i);
  const float v = y - static_cast<float>(j);
  const int right = columns > 1 ? 1 : 0;
  const int down = rows > 1 ? columns : 0;
  const int corner = j * columns + i;
  return {{corner, corner + right, corner + down, corner + down + right},
          {(1.0F - u) * (1.0F - v), u * (1.0F - v), (1.0F - u) * v, u * v}};
}
float look_up(const cv::Mat& map, const Place& place) {
  const auto* values = map.ptr<float>();
  float sum = 0.0F;
  for (int k = 0; k < 4; ++k) sum += place.weight[k] * values[place.at[k]];
  return sum;
}

/// The plate and the membrane as the tracer knows them, in an even room.
Scene fixture_of(const MembraneOptics& optics) {
  Scene scene;
  scene.media = {Medium{}, Medium{optics.plate_index}, Medium{optics.index}};
  scene.faces = {{-optics.thickness_mm - optics.plate_thickness_mm, 0, 1}, {-optics.thickness_mm, 1, 2}};
  scene.environment = flat_spectrum(1, 1.0);
  return scene;
}
constexpr int kMembraneLayer = 2;

/// Calls `take(pixel, origin, direction, through, veil)` for every pixel of a camera whose ray enters the membrane, and
/// `miss(pixel, veil)` for others.
template <typename Take, typename Miss>
void for_each_ray(const MembraneOptics& optics, const Camera& camera, const Take& take, const Miss& miss) {
  const ReadyCamera ready = make_ready(camera);
  const Scene fixture = fixture_of(optics);
  if (!(pose_of(ready).translation.z() < fixture.faces[0].z)) {
    fail("membrane light: the camera is at z = {} mm; it must be below the plate, which ends at {} mm",
         pose_of(ready).translation.z(), fixture.faces[0].z);
  }
  const ImageGrid grid = pixel_grid(ready);
  const CameraRays rays = trace_to_layer(fixture, ready, grid, kMembraneLayer, 1, 0);
  // The light is the mean over the stop and the pixel; where it comes from is approximated by their middles.
  const CameraRays spread = trace_to_layer(fixture, ready, grid, kMembraneLayer, kLensSamples, 0);
  const auto mean_of = [&](const std::vector<float>& parts, std::size_t slot) {
    double sum = 0.0;
    for (int sample = 0; sample < kLensSamples; ++sample) {
      sum += parts[static_cast<std::size_t>(sample) * rays.tiles * kPacket + slot];
    }
    return static_cast<float>(sum);
  };
  for (int tile = 0; tile < rays.tiles; ++tile) {
    const RayPacket& packet = rays.packets[tile];
    for (int lane = 0; lane < kPacket; ++lane) {
      const int column = tile % rays.tiles_across * CameraRays::kSide + lane % CameraRays::kSide;
      const int row = tile / rays.tiles_across * CameraRays::kSide + lane / CameraRays::kSide;
      if (column >= grid.columns || row >= grid.rows) continue;
      const auto pixel = static_cast<std::size_t>(row) * grid.columns + column;
      const std::size_t slot = static_cast<std::size_t>(tile) * kPacket + lane;
      const float veil = mean_of(spread.veil, slot);
      if (packet.valid[lane] == 0) {
        miss(pixel, veil);
        continue;
      }
      const Eigen::Vector3d origin(packet.origin[0][lane], packet.origin[1][lane], packet.origin[2][lane]);
      const Eigen::Vector3d direction(packet.direction[0][lane], packet.direction[1][lane], packet.direction[2][lane]);
      take(pixel, origin, direction.normalized(), mean_of(spread.through, slot), veil);
    }
  }
}

}  // namespace

struct MembraneLight::Parts {
  Parts(const MembraneKernels& kernels_of, const Camera& camera, const FaceGrid& grid_of,
        const MembraneLightSettings& settings_of)
      : kernels(kernels_of),
        grid(grid_of),
        settings(settings_of),
        to_view(whole_factor(settings.view_cell_mm, grid.spacing_mm)),
        to_exchange(whole_factor(settings.exchange_cell_mm, grid.spacing_mm)),
        exchange(grid.columns / to_exchange, grid.rows / to_exchange, settings.exchange_cell_mm,
                 settings.exchange_reach_mm),
        view(grid.columns / to_view, grid.rows / to_view, settings.view_cell_mm, settings.view_reach_mm),
        free(solve_even(kernels, settings.behind, 0.0, 0.0)) {
    const Eigen::Vector2i pixels = size_of(camera);
    size = {pixels.x(), pixels.y()};
    prepare_kernels();
    prepare_rays(camera);
    const Sectors mirrored = even_reflectance(kernels);
    for (int i = 0; i < kSectors; ++i) leaving[i] = (kernels.limits[i + 1] - kernels.limits[i]) * (1.0 - mirrored[i]);
    double sum = 0.0;
    for (double share : leaving) sum += share;
    for (double& share : leaving) share /= sum;
    entering = std::min(1.0, sum * kernels.optics.index * kernels.optics.index);
  }

  MembraneKernels kernels;
  FaceGrid grid;
  MembraneLightSettings settings;
  int to_view, to_exchange;  // cells of the grid a side
  FaceConvolution exchange, view;
  EvenFace free;
  Sectors leaving = {};   // how what leaves through a dry face is made up of the sectors
  double entering = 1.0;  // transmittance of a dry face for even light from outside
  cv::Size size;
  std::array<std::array<FaceKernel, kSectors>, kSectors> exchange_kernels;
  std::array<std::array<FaceKernel, kTerms>, kSectors> view_kernels;
  std::array<std::array<std::array<FaceKernel, 2>, kSectors>, kSectors> exchange_outward;  // along x and y
  std::array<std::array<FaceKernel, 2>, kSectors> view_outward;
  std::vector<PixelRay> rays;
  bool any_straight = false;

  void prepare_kernels() {
    for (int i = 0; i < kSectors; ++i) {
      for (int j = 0; j < kSectors; ++j) {
        exchange_kernels[i][j] = exchange.kernel(kernels.radii_mm, kernels.exchange[i][j], FaceSymmetry::kEven);
      }
    }
    const auto both = [&](const FaceConvolution& face, const RadialShare& share) {
      return std::array<FaceKernel, 2>{face.kernel(kernels.radii_mm, share, FaceSymmetry::kAlongX),
                                       face.kernel(kernels.radii_mm, share, FaceSymmetry::kAlongY)};
    };
    for (int j = 0; j < kSectors; ++j) {
      for (int i = 0; i < kSectors; ++i) exchange_outward[i][j] = both(exchange, kernels.exchange_outward[i][j]);
      view_outward[j] = both(view, kernels.view_outward[j]);
      const ViewKernel& seen = kernels.view[j];
      view_kernels[j] = {view.kernel(kernels.radii_mm, seen.even, FaceSymmetry::kEven),
                         view.kernel(kernels.radii_mm, seen.slant, FaceSymmetry::kEven),
                         view.kernel(kernels.radii_mm, seen.aside, FaceSymmetry::kAlongX),
                         view.kernel(kernels.radii_mm, seen.aside, FaceSymmetry::kAlongY),
                         view.kernel(kernels.radii_mm, seen.oval, FaceSymmetry::kAlongAxes),
                         view.kernel(kernels.radii_mm, seen.oval, FaceSymmetry::kAlongDiagonals)};
    }
  }

  void prepare_rays(const Camera& camera) {
    rays.resize(static_cast<std::size_t>(size.area()));
    const MembraneOptics& optics = kernels.optics;
    const double square = kernels.largest_sine * kernels.largest_sine;
    const auto take = [&](std::size_t pixel, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                          float through, float veil) {
      PixelRay& ray = rays[pixel];
      ray.weight = through;
      ray.veil = veil;
      const Eigen::Vector2d place = origin.head<2>() + optics.thickness_mm / direction.z() * direction.head<2>();
      const double column = (place.x() - grid.left_mm) / settings.view_cell_mm;
      const double row = (place.y() - grid.top_mm) / settings.view_cell_mm;
      ray.free = static_cast<float>(settings.behind);  // beside the membrane
      ray.sees_membrane = column >= 0.0 && row >= 0.0 && column <= view.columns() && row <= view.rows();
      if (!ray.sees_membrane) return;
      const double squared_sine = direction.head<2>().squaredNorm();
      if (squared_sine > square) {
        fail("membrane light: a pixel sees the face at a sine of {:.3f} in the membrane; its kernels end at {:.3f}",
             std::sqrt(squared_sine), kernels.largest_sine);
      }
      ray.column = static_cast<float>(column);
      ray.row = static_cast<float>(row);
      ray.sine_x = static_cast<float>(direction.x());
      ray.sine_y = static_cast<float>(direction.y());
      ray.slant = static_cast<float>(squared_sine - square / 2.0);
      ray.straight = static_cast<float>(straight_share(optics, squared_sine));
      ray.mirrored = static_cast<float>(fresnel(optics.index, 1.0, direction.z()).mean_reflectance());
      ray.free = static_cast<float>(even_face_radiance(kernels, free, settings.behind, 0.0, 0.0, squared_sine));
      constexpr float kSeenStraight = 1e-5F;
      any_straight = any_straight || ray.straight > kSeenStraight;
    };
    for_each_ray(optics, camera, take, [&](std::size_t pixel, float veil) { rays[pixel].veil = veil; });
  }

  void check_state(const FaceState& state) const {
    const auto fits = [&](const cv::Mat& map) {
      return map.type() == CV_32FC1 && map.cols == grid.columns && map.rows == grid.rows;
    };
    if (!fits(state.contact) || !(state.gap_mm.empty() || fits(state.gap_mm))) {
      fail("membrane light: a face state of {} x {} cells; the grid has {} x {} (32-bit floats, one channel)",
           state.contact.cols, state.contact.rows, grid.columns, grid.rows);
    }
    if (!(state.albedo >= 0.0 && state.albedo <= 1.0)) {
      fail("membrane light: the body's albedo is {}; allowed is 0 to 1", state.albedo);
    }
    if (!(state.height_mm > 0.0)) {
      fail("membrane light: the body's height is {} mm; it must be above 0", state.height_mm);
    }
    for (int row = 0; row < grid.rows; ++row) {
      const auto* contact = state.contact.ptr<float>(row);
      const auto* gap = state.gap_mm.empty() ? nullptr : state.gap_mm.ptr<float>(row);
      for (int column = 0; column < grid.columns; ++column) {
        if (!(contact[column] >= 0.0F && contact[column] <= 1.0F)) {
          fail("membrane light: the contact at column {}, row {} is {}; allowed is 0 to 1", column, row,
               contact[column]);
        }
        if (gap != nullptr && !(gap[column] >= 0.0F)) {
          fail("membrane light: the gap at column {}, row {} is {} mm; it must be at least 0", column, row,
               gap[column]);
        }
      }
    }
  }

  /// What light from outside loses in a shadow: the room behind, less the body's own light.
  cv::Mat kept_off(const Fields& g, double albedo) const {
    cv::Mat leaves = g[0] * leaving[0];
    for (int i = 1; i < kSectors; ++i) cv::scaleAdd(g[i], leaving[i], leaves, leaves);
    // The body lights itself by what the dry face mirrors.
    const double glow = albedo * entering / (1.0 - (1.0 - entering) * albedo);
    return settings.behind - leaves * glow;
  }

  /// What comes from outside into a sector, where `kept` is what a shadow keeps off.
  cv::Mat from_outside(int sector, const cv::Mat& kept, const ShadowMoments& shadow) const {
    if (shadow[sector][0].empty()) return cv::Mat(kept.size(), CV_32FC1, cv::Scalar(settings.behind));
    return settings.behind - shadow[sector][0].mul(kept);
  }

  /// What is lost beside the mean because light that comes over the face in one direction goes out in the same: the
  /// first moments of the shadow over azimuth. Spectra by sector and axis; empty where there are none.
  std::array<std::array<cv::Mat, 2>, kSectors> outward_spectra(const FaceConvolution& face, const Fields& g,
                                                               const ShadowMoments& shadow, const cv::Mat& contact,
                                                               double albedo) const {
    const cv::Mat twice = (2.0 - 2.0 * contact).mul(kept_off(g, albedo));
    std::array<std::array<cv::Mat, 2>, kSectors> spectra;
    for (int j = 0; j < kSectors; ++j) {
      for (int k = 0; k < 2; ++k) {
        if (!shadow[j][0].empty()) spectra[j][k] = face.spectrum(twice.mul(shadow[j][1 + k]));
      }
    }
    return spectra;
  }

  /// The share of each cell of the grid that has the body above it.
  cv::Mat share_under(const FaceState& state) const {
    cv::Mat under;
    cv::Mat(state.gap_mm < std::min(state.height_mm, 1e6)).convertTo(under, CV_32FC1, 1.0 / 255.0);
    return under;
  }

  cv::Mat mean_of(const Fields& g) const {
    cv::Mat mean = g[0] * (kernels.limits[1] - kernels.limits[0]);
    for (int i = 1; i < kSectors; ++i) cv::scaleAdd(g[i], kernels.limits[i + 1] - kernels.limits[i], mean, mean);
    return mean;
  }

  /// free_h - h.
  Fields lost(const Fields& g, const cv::Mat& contact, const ShadowMoments& shadow, double albedo,
              const Sectors& mirrored, const Sectors& free_h) const {
    const cv::Mat matt = mean_of(g) * albedo;
    const cv::Mat kept = kept_off(g, albedo);
    Fields out;
    for (int j = 0; j < kSectors; ++j) {
      const cv::Mat dry = g[j] * mirrored[j] + from_outside(j, kept, shadow) * (1.0 - mirrored[j]);
      out[j] = free_h[j] - dry + contact.mul(dry - matt);
    }
    return out;
  }

  cv::Mat irradiance(const FaceState& state) const {
    check_state(state);
    cv::Mat contact;
    cv::resize(state.contact, contact, {exchange.columns(), exchange.rows()}, 0, 0, cv::INTER_AREA);
    cv::Mat under;
    BodyShadow body;
    ShadowMoments shadow;
    if (!state.gap_mm.empty()) {
      body = shadow_of_body(grid, state, kernels.optics.index, to_exchange);
      under = share_under(state);
      cv::Mat coarse;
      cv::resize(under, coarse, contact.size(), 0, 0, cv::INTER_AREA);
      shadow = mean_shadow(body, coarse);
    }

    Fields g;
    for (int i = 0; i < kSectors; ++i) g[i] = cv::Mat(contact.size(), CV_32FC1, cv::Scalar(free.g[i]));
    // The body's own light is small: what of it goes sideways is taken from the free face's.
    std::array<cv::Mat, kSectors> sideways;
    if (!under.empty()) {
      const auto spectra = outward_spectra(exchange, g, shadow, contact, state.albedo);
      for (int i = 0; i < kSectors; ++i) {
        for (int j = 0; j < kSectors; ++j) {
          for (int k = 0; k < 2 && !spectra[j][k].empty(); ++k) {
            exchange.add(spectra[j][k], exchange_outward[i][j][k], sideways[i]);
          }
        }
      }
    }
    for (int round = 0; round < kMostRounds; ++round) {
      const Fields less = lost(g, contact, shadow, state.albedo, kernels.exchange_reflectance, free.h);
      std::array<cv::Mat, kSectors> spectra;
      for (int j = 0; j < kSectors; ++j) spectra[j] = exchange.spectrum(less[j]);
      double change = 0.0;
      for (int i = 0; i < kSectors; ++i) {
        cv::Mat sum;
        for (int j = 0; j < kSectors; ++j) exchange.add(spectra[j], exchange_kernels[i][j], sum);
        if (!sideways[i].empty()) sum += sideways[i];
        cv::Mat next = free.g[i] - exchange.field(sum);
        change = std::max(change, cv::norm(next, g[i], cv::NORM_INF));
        g[i] = next;
      }
      if (change < settings.tolerance) break;
    }
    return picture(state, g, body, under);
  }

  cv::Mat picture(const FaceState& state, const Fields& coarse_g, const BodyShadow& body, const cv::Mat& under) const {
    const cv::Size cells(view.columns(), view.rows());
    cv::Mat contact;
    cv::resize(state.contact, contact, cells, 0, 0, cv::INTER_AREA);
    Fields g;
    for (int i = 0; i < kSectors; ++i) cv::resize(coarse_g[i], g[i], cells, 0, 0, cv::INTER_LINEAR);
    ShadowMoments shadow;
    if (!under.empty()) {
      cv::Mat fine;
      cv::resize(under, fine, cells, 0, 0, cv::INTER_AREA);
      shadow = mean_shadow(body, fine);
    }

    Sectors free_h = {};
    for (int j = 0; j < kSectors; ++j) {
      const double mirrored = kernels.view_reflectance[j];
      free_h[j] = mirrored * free.g[j] + (1.0 - mirrored) * settings.behind;
    }
    const Fields less = lost(g, contact, shadow, state.albedo, kernels.view_reflectance, free_h);
    std::array<cv::Mat, kTerms> sums;
    for (int j = 0; j < kSectors; ++j) {
      const cv::Mat spectrum = view.spectrum(less[j]);
      for (int term = 0; term < kTerms; ++term) view.add(spectrum, view_kernels[j][term], sums[term]);
    }
    if (!under.empty()) {
      const auto spectra = outward_spectra(view, g, shadow, contact, state.albedo);
      for (int j = 0; j < kSectors; ++j) {
        for (int k = 0; k < 2 && !spectra[j][k].empty(); ++k) view.add(spectra[j][k], view_outward[j][k], sums[0]);
      }
    }
    std::array<cv::Mat, kTerms> terms;
    for (int term = 0; term < kTerms; ++term) terms[term] = view.field(sums[term]).clone();

    // What the straight ray loses of what is mirrored, comes from outside, and is mirrored by the body.
    cv::Mat dry_lost;
    cv::Mat outside_lost;
    cv::Mat matt;
    if (any_straight) {
      const cv::Mat dry = 1.0 - contact;
      dry_lost = free.g[kSectors - 1] - dry.mul(g[kSectors - 1]);
      outside_lost = settings.behind - dry.mul(from_outside(kSectors - 1, kept_off(g, state.albedo), shadow));
      matt = contact.mul(mean_of(g) * state.albedo);
    }

    cv::Mat out(size, CV_32FC1);
    for (int row = 0; row < size.height; ++row) {
      auto* pixel = out.ptr<float>(row);
      const PixelRay* ray = rays.data() + static_cast<std::size_t>(row) * size.width;
      for (int column = 0; column < size.width; ++column, ++ray, ++pixel) {
        float seen = ray->free;
        if (ray->sees_membrane) {
          const Place place = place_of(*ray, cells.width, cells.height);
          seen -= look_up(terms[0], place) + ray->slant * look_up(terms[1], place) +
                  ray->sine_x * look_up(terms[2], place) + ray->sine_y * look_up(terms[3], place) +
                  (ray->sine_x * ray->sine_x - ray->sine_y * ray->sine_y) * look_up(terms[4], place) +
                  2.0F * ray->sine_x * ray->sine_y * look_up(terms[5], place);
          if (any_straight) {
            seen -= ray->straight * (ray->mirrored * look_up(dry_lost, place) +
                                     (1.0F - ray->mirrored) * look_up(outside_lost, place) - look_up(matt, place));
          }
        }
        *pixel = ray->veil + ray->weight * std::max(seen, 0.0F);
      }
    }
    return out;
  }
};

MembraneLight::MembraneLight(const MembraneKernels& kernels, const Camera& camera, const FaceGrid& grid,
                             const MembraneLightSettings& settings) {
  check(grid, settings);
  parts_ = std::make_unique<const Parts>(kernels, camera, grid, settings);
}

MembraneLight::~MembraneLight() = default;
MembraneLight::MembraneLight(MembraneLight&&) noexcept = default;
MembraneLight& MembraneLight::operator=(MembraneLight&&) noexcept = default;

cv::Mat MembraneLight::irradiance(const FaceState& state) const {
  return parts_->irradiance(state);
}

const FaceGrid& MembraneLight::grid() const {
  return parts_->grid;
}

cv::Mat seen_places(const MembraneOptics& optics, const Camera& camera) {
  const Eigen::Vector2i size = size_of(camera);
  constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();
  cv::Mat places(size.y(), size.x(), CV_32FC2, cv::Scalar(kNowhere, kNowhere));
  const auto take = [&](std::size_t pixel, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, float,
                        float) {
    const Eigen::Vector2d place = origin.head<2>() + optics.thickness_mm / direction.z() * direction.head<2>();
    places.ptr<cv::Vec2f>()[pixel] = {static_cast<float>(place.x()), static_cast<float>(place.y())};
  };
  for_each_ray(optics, camera, take, [](std::size_t, float) {});
  return places;
}

double free_face_radiance(const MembraneKernels& kernels, double behind, double squared_sine) {
  return even_face_radiance(kernels, solve_even(kernels, behind, 0.0, 0.0), behind, 0.0, 0.0, squared_sine);
}

double touched_face_radiance(const MembraneKernels& kernels, double albedo, double squared_sine) {
  return even_face_radiance(kernels, solve_even(kernels, 0.0, 1.0, albedo), 0.0, 1.0, albedo, squared_sine);
}

}  // namespace touchstone::render
