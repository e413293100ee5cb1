#pragma once
// The light that a GuideLamp sends to a point of the scene, by way of mirror images in its plate.
//
// Unfold the plate: light that is mirrored at its faces goes straight on through a pile of plates, so that the exit
// face becomes an endless upright strip in which a place of the plate sees whatever rises steeply enough. Looking back
// along a direction with the rise V over the path to the exit face, one counts the faces that it crosses; each costs
// Fresnel's reflectance at that angle, and an odd number turns the lobe upside down. So the vector irradiance at a
// receiver is
//   F = - int L(w') T_up(w) R_low(w)^i R_high(w)^j w dw  over the directions w whose line back meets the strip's width,
// L the exit face's radiance, w' = w or its mirror image, T what the faces on the path from plate to receiver pass.
// A direction stands for a point of the lamp: its azimuth is drawn within what the exit face's width leaves, azimuth
// and elevation about those of the lobe with normal densities that are nowhere far below it (cos^m x <= exp(-m x^2 /
// 2)). That leaves an integrand without peaks, however narrow the lobe and however far the receiver is, and the path
// from the receiver back to the exit face is known without an equation to solve.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "render/lamps/lamp_connection.h"
#include "render/lamps/prepared_scene.h"
#include "render/materials/fresnel.h"
#include "render/sampling/truncated_normal.h"

namespace touchstone::render {

/// The layers from a plate's face to a receiver beyond it, in the order in which light crosses them.
struct LayersBeyondPlate {
  Layer layers[kMaxLayers];
  int media[kMaxLayers];
  int count = 0;
  bool bends_at_surface = false;  ///< the last is beyond a Refractive surface, taken as flat (see connect_to_lamp)
};

/// @pre the receiver isn't in the plate's layer
template <int N>
LayersBeyondPlate layers_beyond_plate(const PreparedScene<N>& scene, int plate, const Receiver& receiver) {
  LayersBeyondPlate out;
  const bool up = receiver.layer > plate;
  double z = scene.faces[up ? plate : plate - 1].z;
  const auto add = [&](double until, int medium) {
    out.layers[out.count] = {std::abs(until - z), scene.media[medium].index};
    out.media[out.count++] = medium;
    z = until;
  };
  for (int layer = plate + (up ? 1 : -1); layer != receiver.layer; layer += up ? 1 : -1) {
    add(scene.faces[up ? layer : layer - 1].z, scene.medium_of_layer(layer));
  }
  const double end = receiver.position.z();
  const int usual = scene.medium_of_layer(receiver.layer);
  if (receiver.medium != usual) {
    const double off = scene.rays.refractive_along_z(receiver.position, !up, std::abs(end - z));
    out.bends_at_surface = off >= 0.0;
    if (off >= 0.0) add(up ? std::max(z, end - off) : std::min(z, end + off), usual);
  }
  add(end, receiver.medium);
  return out;
}

/// The path from a guide's exit face to a receiver at one azimuth (from `ahead`), seen in the level plane, where
/// nothing bends.
struct GuideBearing {
  double azimuth;
  double distance;         ///< from the exit face to the receiver, in the level plane, mm
  double crest, reach;     ///< at an elevation e the lobe's cosine is reach cos(e - crest)
  Eigen::Vector3d toward;  ///< unit, level: along the light's path
};

/// How far a receiver stands before a guide's exit face, and how far aside from its middle (mm).
struct BeforeGuide {
  double forward, beside;
};
/// Where a place lies before the guide's exit face.
template <int N>
BeforeGuide before_guide(const PreparedLamp<N>& lamp, const Eigen::Vector3d& place) {
  const Eigen::Vector3d& ahead = lamp.exit_normal;
  return {(place - lamp.position).dot(ahead), (place - lamp.position).dot(Eigen::Vector3d(-ahead.y(), ahead.x(), 0.0))};
}

/// The direction with this azimuth, at a place `forward` mm before the exit face.
template <int N>
GuideBearing guide_bearing(const PreparedLamp<N>& lamp, double forward, double azimuth) {
  const Eigen::Vector3d& ahead = lamp.exit_normal;
  const double axis_rise = lamp.frame.z.z();
  const double axis_level = lamp.frame.z.dot(ahead) * std::cos(azimuth);
  return {azimuth, forward / std::cos(azimuth), std::atan2(axis_rise, axis_level), std::hypot(axis_rise, axis_level),
          std::cos(azimuth) * ahead + std::sin(azimuth) * Eigen::Vector3d(-ahead.y(), ahead.x(), 0.0)};
}

/// The azimuths under which a receiver sees the exit face, distributed about as the light is.
template <int N>
TruncatedNormal guide_azimuths(const PreparedLamp<N>& lamp, const BeforeGuide& place) {
  constexpr double kSineBound = 4.0 / (kPi * kPi);  // sin^2 x is at least this times x^2
  return {0.0, 1.0 / (std::sqrt(lamp.exponent * kSineBound) * lamp.frame.z.dot(lamp.exit_normal)),
          std::atan((place.beside - lamp.half_width) / place.forward),
          std::atan((place.beside + lamp.half_width) / place.forward)};
}

/// How steep light must be in the plate to leave it at the height `height` (mm, of the unfolded strip) above the face
/// that it leaves by and to get `distance` mm far to the receiver. 0 where it needn't rise at all.
template <int N>
double steepness_from(const PreparedScene<N>& scene, int plate_medium, const LayersBeyondPlate& beyond, double height,
                      double distance) {
  const double plate_index = scene.media[plate_medium].index;
  Layer layers[kMaxLayers];
  int count = 0;
  if (height > 0.0) layers[count++] = {height, plate_index};
  TS_ASSERT(count + beyond.count <= kMaxLayers);
  for (int k = 0; k < beyond.count; ++k) layers[count++] = beyond.layers[k];
  LayerPath path;
  if (!solve_layer_path({layers, static_cast<std::size_t>(count)}, distance, path)) return 0.0;
  const double cosine = layers[0].index * path.tangent[0] * path.cosine[0] / plate_index;
  return std::acos(std::min(1.0, cosine));
}

/// The light that comes to the receiver at one azimuth and one steepness in the plate (both in radians; `up` gives its
/// sense there): `arrival.irradiance` is that per radian of either. False where none does. Mirroring at faces other
/// than the plate's two is left out, and so are shadows inside the plate. `connections` counts shadow tests.
/// @pre `beyond` is the receiver's, empty for one in the plate, in whose medium it then is
template <int N>
bool guide_light_along(const PreparedScene<N>& scene, const PreparedLamp<N>& lamp, const LayersBeyondPlate& beyond,
                       const GuideBearing& bearing, double steepness, bool up, const Receiver& receiver,
                       std::uint64_t& connections, Arrival<N>& arrival) {
  const int plate = lamp.layer;
  const double plate_low = scene.faces[plate - 1].z;
  const double plate_high = scene.faces[plate].z;
  const int plate_medium = scene.medium_of_layer(plate);
  const double plate_index = scene.media[plate_medium].index;
  const Eigen::Vector3d& p = receiver.position;
  const bool is_inside = receiver.layer == plate;
  const Eigen::Vector3d& toward = bearing.toward;
  const double sense = up ? 1.0 : -1.0;
  const double flat = std::cos(steepness);
  const double rise = std::sin(steepness);
  if (!(rise > 1e-9 && flat > 1e-9)) return false;

  // Back from the receiver to the plate. Basic radiance stays but for losses, and n^2 cos d omega is the same on both
  // sides of a face.
  const double end_sine = plate_index * flat / scene.media[receiver.medium].index;
  if (!(end_sine < 1.0)) return false;
  const double end_rise = std::sqrt(1.0 - end_sine * end_sine);
  const double stretch = rise / end_rise;
  arrival.direction = -end_sine * toward;
  arrival.direction.z() = -sense * end_rise;
  arrival.bends_at_surface = beyond.bends_at_surface;
  arrival.angle_per_lamp_area = 0.0;
  if (!receiver.normal.isZero(0.0) && arrival.direction.dot(receiver.normal) <= 0.0) return false;

  Bands<N> light = lamp.intensity_on_axis;
  double through_s = 1.0;
  double through_p = 1.0;
  double left = bearing.distance;  // to the exit face
  Eigen::Vector3d corner = p;
  Eigen::Vector3d end = p + RayScene::leave_distance(p) * receiver.normal;
  ++connections;
  for (int k = beyond.count - 1; k >= 0; --k) {
    const Layer& layer = beyond.layers[k];
    const double sine = plate_index * flat / layer.index;
    const double sine_before = k > 0 ? plate_index * flat / beyond.layers[k - 1].index : flat;
    if (!(sine < 1.0 && sine_before < 1.0)) return false;
    const double cosine = std::sqrt(1.0 - sine * sine);
    const FresnelFace face = fresnel(k > 0 ? beyond.layers[k - 1].index : plate_index, layer.index,
                                     std::sqrt(1.0 - sine_before * sine_before));
    through_s *= 1.0 - face.reflectance_s;
    through_p *= 1.0 - face.reflectance_p;
    const double step = layer.thickness * sine / cosine;
    left -= step;
    if (!(left > 0.0)) return false;
    Eigen::Vector3d start = corner - step * toward;
    start.z() = corner.z() - sense * layer.thickness;
    if (receiver.shadowed && scene.blocked(end, start)) return false;
    const int medium = beyond.media[k];
    if (scene.has_films) light *= passed_by_films(scene, end, start, medium);
    if (scene.media[medium].weakens) light *= (-scene.media[medium].extinction * (layer.thickness / cosine)).exp();
    corner = end = start;
  }

  // In the plate, unfolded.
  const double climb = left * rise / flat;
  const double to_first = is_inside ? (up ? p.z() - plate_low : plate_high - p.z()) : plate_high - plate_low;
  const double mirrorings = climb <= to_first ? 0.0 : 1.0 + std::floor((climb - to_first) / (plate_high - plate_low));
  const double at_first = std::ceil(0.5 * mirrorings);
  const auto mirror = [&](bool upper, double times) {
    if (times == 0.0) return;
    const int outside = upper ? scene.faces[plate].medium_above : scene.faces[plate - 1].medium_below;
    const FresnelFace face = fresnel(plate_index, scene.media[outside].index, rise);
    through_s *= std::pow(face.reflectance_s, times);
    through_p *= std::pow(face.reflectance_p, times);
  };
  mirror(!up, at_first);
  mirror(up, mirrorings - at_first);
  const bool is_odd = at_first > mirrorings - at_first;
  const double sent_elevation = is_odd ? -sense * steepness : sense * steepness;
  const double sent = std::pow(bearing.reach * std::max(0.0, std::cos(sent_elevation - bearing.crest)), lamp.exponent);
  if (!(sent * (through_s + through_p) > 0.0)) return false;
  if (scene.media[plate_medium].weakens) light *= (-scene.media[plate_medium].extinction * (left / flat)).exp();

  constexpr double kSquareMillimetresPerSquareMetre = 1e6;
  // Radiance is intensity / (area cos(e) cos(a)), and d omega is cos(e) de da.
  arrival.irradiance = light * (sent / std::cos(bearing.azimuth) * stretch * 0.5 * (through_s + through_p) / lamp.area *
                                kSquareMillimetresPerSquareMetre);
  return true;
}

/// How steep a guide's light is in its plate: a choice about as the light is. Seen from beyond the plate the exit face
/// and its mirror images stand above each other, and every second one shows the lobe upside down; so the first two are
/// drawn from the lobe's normal density or that of its mirror image, and all further ones from both.
class GuideSteepness {
 public:
  /// Of a receiver beyond the plate.
  template <int N>
  GuideSteepness(const PreparedScene<N>& scene, const PreparedLamp<N>& lamp, const LayersBeyondPlate& beyond,
                 const GuideBearing& bearing, bool up) {
    const int medium = scene.medium_of_layer(lamp.layer);
    const double thickness = scene.faces[lamp.layer].z - scene.faces[lamp.layer - 1].z;
    // Light flatter than that from the edge of the exit face isn't in the plate any more when it has to leave it.
    const double flattest = (1.0 - 1e-6) * steepness_from(scene, medium, beyond, 0.0, bearing.distance);
    const double first = steepness_from(scene, medium, beyond, thickness, bearing.distance);
    const double second = steepness_from(scene, medium, beyond, 2.0 * thickness, bearing.distance);
    const double outside = up ? 1.0 : -1.0;
    const double deviation = 1.0 / std::sqrt(lamp.exponent);
    const FresnelFace face = fresnel(scene.media[medium].index, beyond.layers[0].index, std::sin(second));
    const double again = 0.5 * (face.reflectance_s + face.reflectance_p);
    parts_ = {Part(outside * bearing.crest, deviation, flattest, first, 1.0),
              Part(-outside * bearing.crest, deviation, first, second, 1.0),
              Part(outside * bearing.crest, deviation, second, 0.5 * kPi, again),
              Part(-outside * bearing.crest, deviation, second, 0.5 * kPi, again)};
    double all = 0.0;
    for (const Part& part : parts_) all += part.chance;
    constexpr double kLeast = 0.01;  // what is dark by the lobe's normal density may still bring something
    for (Part& part : parts_) {
      part.chance = all > 0.0 ? (1.0 - 4.0 * kLeast) * part.chance / all + kLeast : 0.25;
    }
  }

  /// From a number in [0, 1).
  double value(double number) const {
    for (std::size_t k = 0;; ++k) {
      const Part& part = parts_[k];
      if (number < part.chance || k + 1 == parts_.size()) {
        return part.normal.value(std::min(number / part.chance, 1.0 - 0x1p-53));
      }
      number -= part.chance;
    }
  }

  /// Of value(), per radian.
  double density(double steepness) const {
    double sum = 0.0;
    for (const Part& part : parts_) {
      if (steepness >= part.low && steepness <= part.high) sum += part.chance * part.normal.density(steepness);
    }
    return sum;
  }

 private:
  struct Part {
    double low = 0.0, high = 1.0;
    TruncatedNormal normal{0.0, 1.0, 0.0, 1.0};
    double chance = 0.0;

    Part() = default;
    Part(double middle, double deviation, double from, double to, double weight)
        : low(from), high(std::max(to, from + 1e-9)), normal(middle, deviation, low, high) {
      chance = weight * normal.mass();
    }
  };
  std::array<Part, 4> parts_;
};

/// One sample of the light of the guide `lamp` at the receiver, as connect_to_lamp; the mean over `numbers` uniform in
/// the unit square is the light.
template <int N>
bool connect_to_guide(const PreparedScene<N>& scene, const PreparedLamp<N>& lamp, const std::array<double, 2>& numbers,
                      const Receiver& receiver, std::uint64_t& connections, Arrival<N>& arrival) {
  const int plate = lamp.layer;
  const bool is_inside = receiver.layer == plate;
  if (is_inside && receiver.medium != scene.medium_of_layer(plate)) return false;
  const BeforeGuide place = before_guide(lamp, receiver.position);
  if (!(place.forward > 0.0)) return false;
  const TruncatedNormal azimuths = guide_azimuths(lamp, place);
  const GuideBearing bearing = guide_bearing(lamp, place.forward, azimuths.value(numbers[0]));

  LayersBeyondPlate beyond;
  bool up = receiver.layer > plate;
  double steepness = 0.0;
  double density = azimuths.density(bearing.azimuth);
  if (is_inside) {
    // From above or from below, about the lobe's crest or about its mirror image.
    const double deviation = 1.0 / std::sqrt(lamp.exponent);
    const TruncatedNormal upright(bearing.crest, deviation, 0.0, 0.5 * kPi);
    const TruncatedNormal turned(-bearing.crest, deviation, 0.0, 0.5 * kPi);
    double number = 2.0 * numbers[1];
    const bool from_upright = number < 1.0;
    number -= from_upright ? 0.0 : 1.0;
    up = number < 0.5;
    number = up ? 2.0 * number : 2.0 * number - 1.0;
    steepness = from_upright ? upright.value(number) : turned.value(number);
    density *= 0.25 * (upright.density(steepness) + turned.density(steepness));
  } else {
    beyond = layers_beyond_plate(scene, plate, receiver);
    const GuideSteepness steepnesses(scene, lamp, beyond, bearing, up);
    steepness = steepnesses.value(numbers[1]);
    density *= steepnesses.density(steepness);
  }
  if (!(density > 0.0)) return false;
  if (!guide_light_along(scene, lamp, beyond, bearing, steepness, up, receiver, connections, arrival)) return false;
  arrival.irradiance /= density;
  return true;
}

/// One sample of a lamp's light at the receiver, by whatever method its kind has: the mean over `numbers` uniform in
/// the unit square is the light. Numbers beyond it stand for a wider lamp; of a guide, whose numbers are directions,
/// they are taken back to its rim.
template <int N>
bool connect(const PreparedScene<N>& scene, const PreparedLamp<N>& lamp, const std::array<double, 2>& numbers,
             const Receiver& receiver, std::uint64_t& connections, Arrival<N>& arrival) {
  constexpr double kBelowOne = 1.0 - 0x1p-53;
  if (lamp.kind == LampKind::kGuide) [[unlikely]] {
    const std::array<double, 2> direction = {std::clamp(numbers[0], 0.0, kBelowOne),
                                             std::clamp(numbers[1], 0.0, kBelowOne)};
    return connect_to_guide(scene, lamp, direction, receiver, connections, arrival);
  }
  return connect_to_lamp(scene, lamp, point_on_lamp(lamp, numbers), receiver, connections, arrival);
}

/// Lets the choice of lamps know what light arrives where (LampChooser::lay_grid), all over the scene's things.
template <int N>
void weigh_lamps(PreparedScene<N>& scene) {
  scene.lamp_chooser.lay_grid(scene.rays.bounds(), [&](int number, const Eigen::Vector3d& place) {
    const int layer = scene.layer_at(place.z());
    const Receiver receiver{place, Eigen::Vector3d::Zero(), layer, scene.medium_of_layer(layer), false};
    const PreparedLamp<N>& lamp = scene.lamps[number];
    // The middle of a small lamp stands for it all; a guide's light comes from many directions.
    const int parts = lamp.kind == LampKind::kGuide ? 3 : 1;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::uint64_t uncounted = 0;
    for (int part = 0; part < parts * parts; ++part) {
      Arrival<N> arrival;
      const std::array<double, 2> numbers = {(part % parts + 0.5) / parts, (part / parts + 0.5) / parts};
      if (connect(scene, lamp, numbers, receiver, uncounted, arrival)) {
        sum += arrival.irradiance.sum() * arrival.direction;
      }
    }
    return Eigen::Vector3d(sum / (parts * parts));
  });
}

}  // namespace touchstone::render
