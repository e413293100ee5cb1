#include "lab/press/pressed_marker.h"

#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "fem/contact/press.h"
#include "fem/finite_strain/finite_press.h"
#include "render/cameras/first_hits.h"

namespace touchstone::lab {
namespace {

constexpr int kPointsASide = 32;          // of an outline: a straight side stays straight but for the press's own bend
constexpr double kBesideTriangle = 1e-9;  // of its area: points on an edge belong to either

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Twice the signed area of a polygon, by Gauss's formula.
template <typename Point>
double twice_area(std::span<const Point> outline) {
  double sum = 0.0;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const Eigen::Vector2d a = outline[k].template head<2>();
    const Eigen::Vector2d b = outline[(k + 1) % outline.size()].template head<2>();
    sum += cross(a, b);
  }
  return sum;
}

PressedMarker seen_in(const fem::PressState& state, const MarkerPoints& marker, double force) {
  PressedMarker pressed;
  pressed.force_N = force;
  pressed.outline = displaced(marker.outline, state.surface_displacement);
  const std::vector<Eigen::Vector3d> area = displaced(marker.area, state.surface_displacement);
  for (const Eigen::Vector3d& point : area) pressed.displacement_mm -= point.z() / static_cast<double>(area.size());
  const double now = twice_area(std::span<const Eigen::Vector3d>(pressed.outline));
  pressed.stretch = std::sqrt(now / twice_area(std::span<const Eigen::Vector2d>(marker.outline.material_mm)));
  pressed.largest_strain = state.largest_strain;
  return pressed;
}

/// `Press` is fem::Press or fem::FinitePress.
template <typename Press>
MarkerPresses press_in_turn(Press& press, const MarkerPoints& marker, std::span<const double> forces_N) {
  double before = 0.0;
  for (const double force : forces_N) {
    if (!(force > before && std::isfinite(force))) fail("forces must be above 0 and rise; {} N doesn't", force);
    before = force;
  }
  MarkerPresses result;
  for (const double force : forces_N) {
    fem::PressTarget target;
    target.axis[2] = fem::AxisControl::with_force(force);
    try {
      result.presses.push_back(seen_in(press.step(target), marker, force));
    } catch (const Error& error) {
      result.stopped = error.what();
      break;
    }
  }
  return result;
}

}  // namespace

SurfacePoints locate_points(std::span<const Eigen::Vector3d> vertices, std::span<const std::array<int, 3>> triangles,
                            std::vector<Eigen::Vector2d> points) {
  SurfacePoints located;
  located.material_mm = std::move(points);
  for (const Eigen::Vector2d& point : located.material_mm) {
    bool found = false;
    for (const std::array<int, 3>& triangle : triangles) {
      const Eigen::Vector2d a = vertices[triangle[0]].head<2>();
      const Eigen::Vector2d b = vertices[triangle[1]].head<2>();
      const Eigen::Vector2d c = vertices[triangle[2]].head<2>();
      const double whole = cross(b - a, c - a);
      const std::array<double, 3> weights = {cross(b - point, c - point) / whole, cross(c - point, a - point) / whole,
                                             cross(a - point, b - point) / whole};
      if (std::min({weights[0], weights[1], weights[2]}) < -kBesideTriangle) continue;
      located.corners.push_back(triangle);
      located.weights.push_back(weights);
      found = true;
      break;
    }
    if (!found) fail("the point ({:.4g}, {:.4g}) mm isn't on the gel's surface", point.x(), point.y());
  }
  return located;
}

std::vector<Eigen::Vector3d> displaced(const SurfacePoints& points, const Eigen::MatrixX3d& displacement) {
  std::vector<Eigen::Vector3d> places;
  for (std::size_t k = 0; k < points.material_mm.size(); ++k) {
    Eigen::Vector3d place(points.material_mm[k].x(), points.material_mm[k].y(), 0.0);
    for (int i = 0; i < 3; ++i) place += points.weights[k][i] * displacement.row(points.corners[k][i]).transpose();
    places.push_back(place);
  }
  return places;
}

MarkerPoints square_marker(std::span<const Eigen::Vector3d> vertices, std::span<const std::array<int, 3>> triangles,
                           double side_mm) {
  if (!(side_mm > 0.0 && std::isfinite(side_mm))) fail("the marker's side: {} mm must be above 0", side_mm);
  const double half = 0.5 * side_mm;
  const std::array<Eigen::Vector2d, 4> corners = {Eigen::Vector2d(-half, -half), Eigen::Vector2d(half, -half),
                                                  Eigen::Vector2d(half, half), Eigen::Vector2d(-half, half)};
  std::vector<Eigen::Vector2d> outline;
  std::vector<Eigen::Vector2d> area;
  for (int side = 0; side < 4; ++side) {
    for (int k = 0; k < kPointsASide; ++k) {
      const double share = static_cast<double>(k) / kPointsASide;
      outline.push_back(corners[side] + share * (corners[(side + 1) % 4] - corners[side]));
    }
  }
  for (int i = 0; i < kPointsASide; ++i) {
    for (int j = 0; j < kPointsASide; ++j) {
      area.emplace_back(side_mm * ((i + 0.5) / kPointsASide - 0.5), side_mm * ((j + 0.5) / kPointsASide - 0.5));
    }
  }
  return {locate_points(vertices, triangles, std::move(outline)), locate_points(vertices, triangles, std::move(area))};
}

MarkerPresses press_marker(const fem::Compliance& gel, const MarkerPoints& marker, const fem::ContactShape& body,
                           double friction, std::span<const double> forces_N) {
  fem::Press press(gel, body, friction);
  return press_in_turn(press, marker, forces_N);
}

MarkerPresses press_marker(const fem::FiniteGel& gel, const MarkerPoints& marker, const fem::ContactShape& body,
                           double friction, std::span<const double> forces_N, int most_factorisations) {
  fem::PressTolerance tolerance;
  tolerance.most_factorisations = most_factorisations;
  fem::FinitePress press(gel, body, friction, tolerance);
  return press_in_turn(press, marker, forces_N);
}

render::Scene bare_faces(double gel_mm, double gel_index, double plate_mm, double plate_index) {
  render::Scene scene;
  scene.media = {{1.0}, {plate_index}, {gel_index}};
  scene.faces = {{-gel_mm - plate_mm, 0, 1}, {-gel_mm, 1, 2}};
  scene.environment = render::flat_spectrum(1, 0.0);
  return scene;
}

render::ReadyCamera camera_before(double focal_length_mm, double distance_mm) {
  render::PinholeCamera camera;
  camera.pixel_pitch_um = 1.0;
  camera.width = camera.height = 1000;  // only where points are pictured matters, be it beside the picture
  camera.distance_mm = focal_length_mm;
  camera.hole_diameter_um = 10.0;
  camera.foil_thickness_um = 0.0;
  camera.gel_from_camera.translation = {0.0, 0.0, -distance_mm};
  return render::make_ready(camera);
}

double pictured_area(const render::Scene& faces, const render::ReadyCamera& camera,
                     std::span<const Eigen::Vector3d> outline) {
  TS_ASSERT(!faces.faces.empty());
  const double eye = render::pose_of(camera).translation.z();
  if (!(eye < faces.faces.front().z)) {
    fail("the camera, at z = {:.4g} mm, isn't in front of the plate, which begins at z = {:.4g} mm", eye,
         faces.faces.front().z);
  }
  std::vector<Eigen::Vector2d> picture;
  for (const Eigen::Vector3d& point : outline) {
    const auto pixel = render::project_through_faces(faces, camera, point);
    if (!pixel) fail("the point ({:.4g}, {:.4g}, {:.4g}) mm can't be seen", point.x(), point.y(), point.z());
    picture.push_back(*pixel);
  }
  constexpr double kMm2PerUm2 = 1.0 / (kMicrometresPerMillimetre * kMicrometresPerMillimetre);
  return 0.5 * std::abs(twice_area(std::span<const Eigen::Vector2d>(picture))) * kMm2PerUm2;
}

}  // namespace touchstone::lab
