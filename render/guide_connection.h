#pragma once
// The light that a GuideLamp sends to a point of the scene, by way of mirror images in its plate.
//
// Unfold the plate: light that is mirrored at its faces goes straight on through a pile of plates, so that the exit
// face becomes an endless upright strip in which a place of the plate sees whatever rises steeply enough. Looking back
// along a direction with the rise V over the way to the exit face, one counts the faces that it crosses; each costs
// Fresnel's reflectance at that angle, and an odd number turns the lobe upside down. So the vector irradiance at a
// receiver is
//   F = - int L(w') T_up(w) R_low(w)^i R_high(w)^j w dw  over the directions w whose line back meets the strip's width,
// L the exit face's radiance, w' = w or its mirror image, T what the faces on the way from plate to receiver pass.
// A direction of the lobe stands for a point of the lamp: it is drawn with the lobe's own density, which leaves an
// integrand without peaks however narrow the lobe is, and the way from the receiver back to the exit face is then known
// without an equation to solve.

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "render/fresnel.h"
#include "render/lamp_connection.h"
#include "render/prepared_scene.h"

namespace touchstone::render {

/// One sample of the light of the guide `lamp` at the receiver, as connect_to_lamp; the mean over (u, v) uniform in the
/// unit square is the light. Mirroring at faces other than the plate's two is left out, and so are shadows inside the
/// plate. `connections` counts shadow tests.
template <int N>
bool connect_to_guide(const PreparedScene<N>& scene, const PreparedLamp<N>& lamp, const std::array<double, 2>& numbers,
                      const Receiver& receiver, std::uint64_t& connections, Arrival<N>& arrival) {
  const int plate = lamp.layer;
  const bool is_particle = receiver.normal.isZero(0.0);
  const Eigen::Vector3d& p = receiver.position;

  // A direction of the lobe. In the plate light comes from both sides: the mirrored lobe is as good as the lobe.
  auto [u, v] = numbers;
  bool turned = false;
  if (receiver.layer == plate) {
    turned = v < 0.5;
    v = turned ? 2.0 * v : 2.0 * v - 1.0;
  }
  const Eigen::Vector2d disc = square_to_disc(u, v);
  const double inside = disc.squaredNorm();
  const double lobe_cosine = std::pow(std::max(0.0, 1.0 - inside), 1.0 / (lamp.exponent + 1.0));
  const double spread = inside > 0.0 ? std::sqrt(std::max(0.0, 1.0 - lobe_cosine * lobe_cosine) / inside) : 0.0;
  Eigen::Vector3d way = lamp.frame.to_world({spread * disc.x(), spread * disc.y(), lobe_cosine});
  const double forward = way.dot(lamp.exit_normal);
  if (!(forward > 1e-9) || std::abs(way.z()) < 1e-9) return false;
  if (receiver.layer == plate) {
    if (turned) way.z() = -way.z();
  } else {
    way.z() = std::copysign(way.z(), receiver.layer > plate ? 1.0 : -1.0);
  }
  const auto mirrored = [](const Eigen::Vector3d& w) { return Eigen::Vector3d(w.x(), w.y(), -w.z()); };
  const auto lobe = [&](const Eigen::Vector3d& w) {
    return std::pow(std::max(0.0, w.dot(lamp.frame.z)), lamp.exponent);
  };
  // Relative to (m + 1) / (2 pi).
  const double density = (lobe(way) + lobe(mirrored(way))) * (receiver.layer == plate ? 0.5 : 1.0);

  // Back from the receiver to the plate.
  const bool up = way.z() > 0.0;
  const double flat = way.head<2>().norm();
  const Eigen::Vector2d toward = way.head<2>() / flat;
  const int plate_medium = scene.medium_of_layer(plate);
  const double plate_index = scene.media[plate_medium].index;
  Bands<N> light = lamp.intensity_on_axis;
  Eigen::Vector3d corner = p;
  Eigen::Vector3d end = p + RayScene::leave_distance(p) * receiver.normal;
  double through_s = 1.0;
  double through_p = 1.0;
  double stretch = 1.0;  // of solid angle and of cross section, on the way into the receiver's medium
  double cosine = std::abs(way.z());
  const auto leg_back_to = [&](const Eigen::Vector3d& start, int medium) {
    if (scene.blocked(start, end)) return false;
    if (scene.has_films) light *= passed_by_films(scene, start, end, medium);
    if (scene.media[medium].weakens) light *= (-scene.media[medium].extinction * (start - corner).norm()).exp();
    corner = end = start;
    return true;
  };
  const auto sine_in = [&](double index) { return plate_index * flat / index; };
  // From a layer back through the face where light came into it.
  const auto back_to_height = [&](double z, int medium, int before) {
    const double index = scene.media[medium].index;
    const double sine = sine_in(index);
    if (!(sine < 1.0)) return false;
    cosine = std::sqrt(1.0 - sine * sine);
    const double sine_before = sine_in(scene.media[before].index);
    if (!(sine_before < 1.0)) return false;
    const FresnelFace face = fresnel(scene.media[before].index, index, std::sqrt(1.0 - sine_before * sine_before));
    through_s *= 1.0 - face.reflectance_s;
    through_p *= 1.0 - face.reflectance_p;
    const double step = std::abs(corner.z() - z) * sine / cosine;
    const Eigen::Vector3d start(corner.x() - step * toward.x(), corner.y() - step * toward.y(), z);
    return leg_back_to(start, medium);
  };
  const double sense = up ? 1.0 : -1.0;
  Eigen::Vector3d arriving = way;
  if (receiver.layer != plate || receiver.medium != plate_medium) {
    const double sine = sine_in(scene.media[receiver.medium].index);
    if (!(sine < 1.0)) return false;
    const double rise = std::sqrt(1.0 - sine * sine);
    arriving = {sine * toward.x(), sine * toward.y(), sense * rise};
    // Basic radiance stays but for losses, and n^2 cos d omega is the same on both sides of a face.
    stretch = cosine / rise;
  }
  arrival.direction = -arriving;
  arrival.bends_at_surface = false;
  arrival.angle_per_lamp_area = 0.0;
  if (!is_particle && arrival.direction.dot(receiver.normal) <= 0.0) return false;
  ++connections;

  const int usual = scene.medium_of_layer(receiver.layer);
  const double plate_low = scene.faces[plate - 1].z;
  const double plate_high = scene.faces[plate].z;
  if (receiver.medium != usual) {
    const double far = up ? p.z() - plate_low : plate_high - p.z();
    const double off = scene.rays.refractive_along_z(p, !up, far);
    if (off >= 0.0) {
      const double limit = up ? p.z() - off : p.z() + off;
      arrival.bends_at_surface = true;
      if (!back_to_height(limit, receiver.medium, usual)) return false;
    }
  }
  for (int layer = receiver.layer; layer != plate; layer += up ? -1 : 1) {
    const bool last_medium = layer == receiver.layer && !arrival.bends_at_surface;
    const int medium = last_medium ? receiver.medium : scene.medium_of_layer(layer);
    const double z = scene.faces[up ? layer - 1 : layer].z;
    const int before = scene.medium_of_layer(up ? layer - 1 : layer + 1);
    if (!back_to_height(z, medium, before)) return false;
  }

  // In the plate, unfolded: D along the level, V up and down.
  const Eigen::Vector3d level(toward.x(), toward.y(), 0.0);
  const double run = (corner - lamp.position).dot(lamp.exit_normal) / level.dot(lamp.exit_normal);
  if (!(run > 0.0)) return false;
  const Eigen::Vector3d foot = corner - run * level - lamp.position;
  if (std::abs(foot.x() * lamp.exit_normal.y() - foot.y() * lamp.exit_normal.x()) > lamp.half_width) return false;
  const double rise = run * std::abs(way.z()) / flat;
  const double thickness = plate_high - plate_low;
  const double to_first = up ? corner.z() - plate_low : plate_high - corner.z();
  const double crossings = rise <= to_first ? 0.0 : 1.0 + std::floor((rise - to_first) / thickness);
  const double at_first = std::ceil(0.5 * crossings);
  const double at_other = crossings - at_first;
  const bool is_odd = at_first != at_other;
  const auto mirror_at = [&](const FlatFace& face, bool upper, double times) {
    if (times == 0.0) return;
    const double beyond = scene.media[upper ? face.medium_above : face.medium_below].index;
    const FresnelFace one = fresnel(plate_index, beyond, std::abs(way.z()));
    through_s *= std::pow(one.reflectance_s, times);
    through_p *= std::pow(one.reflectance_p, times);
  };
  mirror_at(scene.faces[up ? plate - 1 : plate], !up, at_first);
  mirror_at(scene.faces[up ? plate : plate - 1], up, at_other);
  if (!(through_s + through_p > 0.0)) return false;
  if (scene.media[plate_medium].weakens) {
    light *= (-scene.media[plate_medium].extinction * std::hypot(run, rise)).exp();
  }

  const double sent = lobe(is_odd ? mirrored(way) : way);
  if (!(sent > 0.0)) return false;
  constexpr double kSquareMillimetresPerSquareMetre = 1e6;
  const double inverse_density = 2.0 * kPi / (lamp.exponent + 1.0) / density;
  arrival.irradiance = light * (sent / forward * inverse_density * stretch * 0.5 * (through_s + through_p) / lamp.area *
                                kSquareMillimetresPerSquareMetre);
  return true;
}

/// One sample of a lamp's light at the receiver, by whatever way its kind has: the mean over `numbers` uniform in the
/// unit square is the light.
template <int N>
bool connect(const PreparedScene<N>& scene, const PreparedLamp<N>& lamp, const std::array<double, 2>& numbers,
             const Receiver& receiver, std::uint64_t& connections, Arrival<N>& arrival) {
  if (lamp.kind == LampKind::kGuide) [[unlikely]] {
    return connect_to_guide(scene, lamp, numbers, receiver, connections, arrival);
  }
  return connect_to_lamp(scene, lamp, point_on_lamp(lamp, numbers), receiver, connections, arrival);
}

}  // namespace touchstone::render
