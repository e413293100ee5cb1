#include "lab/press/marker_compliance_export.h"

#include <Eigen/SparseCholesky>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace touchstone::lab {
namespace {

using Polygon = std::vector<Eigen::Vector2d>;  // convex, counter-clockwise

constexpr int kDiscCorners = 64;
constexpr double kFlat = 1e-9;       // mm
constexpr double kUncovered = 1e-6;  // part of an area

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double area_of(const Polygon& polygon) {
  double twice = 0.0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    twice += cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
  }
  return 0.5 * twice;
}

Polygon square_about(const Eigen::Vector2d& centre, double half) {
  const Eigen::Vector2d x(half, 0.0), y(0.0, half);
  return {centre - x - y, centre + x - y, centre + x + y, centre - x + y};
}

Polygon disc_about(const Eigen::Vector2d& centre, double radius) {
  constexpr double kStep = 2.0 * std::numbers::pi / kDiscCorners;
  const double corner = radius * std::sqrt(kStep / std::sin(kStep));  // of the polygon with the disc's area
  Polygon polygon;
  for (int k = 0; k < kDiscCorners; ++k) {
    polygon.push_back(centre + corner * Eigen::Vector2d(std::cos(kStep * k), std::sin(kStep * k)));
  }
  return polygon;
}

/// The part of a convex polygon within another one [Sutherland1974].
Polygon common_part(Polygon subject, const Polygon& window) {
  for (std::size_t e = 0; e < window.size() && !subject.empty(); ++e) {
    const Eigen::Vector2d& from = window[e];
    const Eigen::Vector2d along = window[(e + 1) % window.size()] - from;
    Polygon kept;
    for (std::size_t i = 0; i < subject.size(); ++i) {
      const Eigen::Vector2d& a = subject[i];
      const Eigen::Vector2d& b = subject[(i + 1) % subject.size()];
      const double in_a = cross(along, a - from);
      const double in_b = cross(along, b - from);
      if (in_a >= 0.0) kept.push_back(a);
      if ((in_a >= 0.0) != (in_b >= 0.0)) kept.push_back(a + in_a / (in_a - in_b) * (b - a));
    }
    subject = std::move(kept);
  }
  return subject;
}

void check_flat(const fem::Compliance& gel) {
  for (const Eigen::Vector3d& vertex : gel.vertices) {
    if (std::abs(vertex.z()) > kFlat) fail("the gel's outer surface isn't flat: marker compliances are of slabs only");
  }
}

/// The integrals of the hats over each area: n x areas, mm^2.
Eigen::SparseMatrix<double> hat_integrals(const fem::Compliance& gel, const std::vector<Polygon>& areas,
                                          const char* what) {
  check_flat(gel);
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < areas.size(); ++k) {
    Eigen::Array2d low = areas[k].front(), high = low;
    for (const Eigen::Vector2d& corner : areas[k]) {
      low = low.min(corner.array());
      high = high.max(corner.array());
    }
    double covered = 0.0;
    for (const std::array<int, 3>& triangle : gel.triangles) {
      Polygon corners;
      for (const int v : triangle) corners.push_back(gel.vertices[static_cast<std::size_t>(v)].head<2>());
      const Eigen::Array2d least = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
      const Eigen::Array2d most = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
      if ((least >= high).any() || (most <= low).any()) continue;
      const Polygon common = common_part(corners, areas[k]);
      const double whole = area_of(corners);
      for (std::size_t i = 1; i + 1 < common.size(); ++i) {
        const double area = 0.5 * cross(common[i] - common[0], common[i + 1] - common[0]);
        const Eigen::Vector2d middle = (common[0] + common[i] + common[i + 1]) / 3.0;
        covered += area;
        for (std::size_t c = 0; c < 3; ++c) {
          const double hat = 0.5 * cross(corners[(c + 1) % 3] - middle, corners[(c + 2) % 3] - middle) / whole;
          entries.emplace_back(triangle[c], static_cast<int>(k), area * hat);
        }
      }
    }
    const double wanted = area_of(areas[k]);
    if (covered < (1.0 - kUncovered) * wanted) {
      const Eigen::Array2d middle = 0.5 * (low + high);
      fail("{} {} of {:.3f} mm^2 about ({:.3f}, {:.3f}) mm isn't wholly on the gel's outer surface", what, k, wanted,
           middle.x(), middle.y());
    }
  }
  Eigen::SparseMatrix<double> result(static_cast<int>(gel.vertices.size()), static_cast<int>(areas.size()));
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

std::vector<Polygon> areas_of(const SurfaceMarkers& markers) {
  if (markers.grid.minCoeff() < 1 || markers.markers.size() != static_cast<std::size_t>(markers.grid.prod())) {
    fail("{} markers don't make a grid of {} x {}", markers.markers.size(), markers.grid.x(), markers.grid.y());
  }
  std::vector<Polygon> areas;
  for (const SurfaceMarker& marker : markers.markers) {
    if (!marker.centre.allFinite() || !(marker.half_width > 0.0) || !std::isfinite(marker.half_width)) {
      fail("marker {} has a half width of {} mm; it must be above 0, at a finite place", areas.size(),
           marker.half_width);
    }
    areas.push_back(marker.square ? square_about(marker.centre, marker.half_width)
                                  : disc_about(marker.centre, marker.half_width));
  }
  return areas;
}

std::vector<Polygon> areas_of(const PatchGrid& patches) {
  std::vector<Polygon> areas;
  for (int j = 0; j < patches.grid.y(); ++j) {
    for (int i = 0; i < patches.grid.x(); ++i) {
      areas.push_back(square_about(patches.first + patches.side * Eigen::Vector2d(i, j), 0.5 * patches.side));
    }
  }
  return areas;
}

/// M^-1 v for each column v.
Eigen::MatrixXd projected(const fem::Compliance& gel, const Eigen::SparseMatrix<double>& integrals) {
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> mass(gel.mass);
  TS_ASSERT(mass.info() == Eigen::Success);
  return mass.solve(Eigen::MatrixXd(integrals));
}

sensors::MarkerCompliance described(const fem::Compliance& gel, const PatchGrid& patches) {
  sensors::MarkerCompliance result;
  result.patch_grid = patches.grid;
  result.patch_side = patches.side;
  result.first_patch = patches.first;
  result.thickness = gel.thickness;
  result.youngs_modulus = gel.material.youngs_modulus;
  result.poisson_ratio = gel.material.poisson_ratio;
  return result;
}

sensors::MarkerCompliance checked(sensors::MarkerCompliance compliance) {
  const std::string fault = sensors::fault_of(compliance);
  if (!fault.empty()) fail("marker compliance: {}", fault);
  return compliance;
}

using Columns = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// Columns a, a + 3, a + 6, ... of a compliance: those of tractions along the axis `a`.
Columns along_axis(const fem::SharedMatrix& matrix, int a) {
  const Eigen::Index rows = matrix.rows();
  return {matrix.view().data() + a * rows, rows, matrix.cols() / 3, Eigen::OuterStride<>(3 * rows)};
}

}  // namespace

PatchGrid patches_over(const fem::Compliance& gel, const SurfaceMarkers& markers, double side) {
  if (!std::isfinite(side) || side <= 0.0) fail("a patch's side is {} mm; it must be finite and above 0", side);
  areas_of(markers);  // checks them
  Eigen::Array2d low = markers.markers.front().centre, high = low;
  for (const SurfaceMarker& marker : markers.markers) {
    low = low.min(marker.centre.array());
    high = high.max(marker.centre.array());
  }
  Eigen::Array2d face_low = gel.vertices.front().head<2>(), face_high = face_low;
  for (const Eigen::Vector3d& vertex : gel.vertices) {
    face_low = face_low.min(vertex.head<2>().array());
    face_high = face_high.max(vertex.head<2>().array());
  }
  const Eigen::Array2d steps = (markers.grid.array() - 1).max(1).cast<double>();
  const double beyond = 2.0 / 3.0 * std::max(((high - low) / steps).mean(), side);
  const Eigen::Array2d middle = 0.5 * (low + high);
  PatchGrid patches;
  patches.side = side;
  for (int a = 0; a < 2; ++a) {
    const double margin = std::min(middle[a] - face_low[a], face_high[a] - middle[a]);
    const double reach = 0.5 * (high - low)[a] + beyond;
    const double wanted = std::ceil(2.0 * reach / side - 1e-9);
    const double most = std::floor(2.0 * margin / side + 1e-9);
    const double count = std::min(wanted, most);
    if (!(count >= 1.0 && count <= sensors::kMostPatches)) {
      fail("patches of {} mm don't suit the gel: {:.0f} would stand in a row", side, count);
    }
    patches.grid[a] = static_cast<int>(count);
    patches.first[a] = middle[a] - 0.5 * side * (count - 1.0);
  }
  if (static_cast<double>(patches.grid.x()) * patches.grid.y() > sensors::kMostPatches) {
    fail("patches of {} mm are too small: {} x {} would be needed, {} are allowed", side, patches.grid.x(),
         patches.grid.y(), sensors::kMostPatches);
  }
  return patches;
}

sensors::MarkerCompliance marker_compliance(const fem::Compliance& gel, const SurfaceMarkers& markers,
                                            const PatchGrid& patches) {
  const std::vector<Polygon> areas = areas_of(markers);
  const Eigen::MatrixXd of_markers = projected(gel, hat_integrals(gel, areas, "marker"));
  const Eigen::MatrixXd of_patches = projected(gel, hat_integrals(gel, areas_of(patches), "patch"));
  sensors::MarkerCompliance result = described(gel, patches);
  result.marker_grid = markers.grid;
  for (const SurfaceMarker& marker : markers.markers) {
    result.marker_rest.emplace_back(marker.centre.x(), marker.centre.y(), 0.0);
  }
  const Eigen::Index m = of_markers.cols();
  const Eigen::Index p = of_patches.cols();
  result.displacement.resize(3 * m, 3 * p);
  // The surface matrix is symmetric and large: it is read once, times the fewer columns of the two.
  const Eigen::Index n = of_markers.rows();
  const bool by_markers = m <= p;
  const Eigen::MatrixXd& fewer = by_markers ? of_markers : of_patches;
  const Eigen::MatrixXd& more = by_markers ? of_patches : of_markers;
  for (int a = 0; a < 3; ++a) {
    const Eigen::MatrixXd answer = gel.surface.times_along(a, fewer);  // 3n x fewer
    for (int b = 0; b < 3; ++b) {
      const Eigen::Map<const Eigen::MatrixXd, 0, Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>> component(
          answer.data() + b, n, answer.cols(), {3 * n, 3});
      const Eigen::MatrixXd block = component.transpose() * more;  // fewer x more
      for (Eigen::Index i = 0; i < m; ++i) {
        for (Eigen::Index j = 0; j < p; ++j) {
          if (by_markers) {
            result.displacement(3 * i + a, 3 * j + b) = block(i, j);
          } else {
            result.displacement(3 * i + b, 3 * j + a) = block(j, i);
          }
        }
      }
    }
  }
  for (Eigen::Index i = 0; i < m; ++i) {
    result.displacement.middleRows(3 * i, 3) /= area_of(areas[static_cast<std::size_t>(i)]);
  }
  return checked(std::move(result));
}

sensors::MarkerCompliance bead_compliance(const fem::Compliance& gel, const std::vector<Eigen::Vector3d>& rest,
                                          const PatchGrid& patches) {
  const auto side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(rest.size()))));
  if (rest.empty() || static_cast<std::size_t>(side) * static_cast<std::size_t>(side) != rest.size() ||
      gel.beads.rows() != 3 * static_cast<Eigen::Index>(rest.size())) {
    fail("{} rest positions don't fit the gel's {} beads, or make no square grid", rest.size(), gel.beads.rows() / 3);
  }
  const Eigen::MatrixXd of_patches = projected(gel, hat_integrals(gel, areas_of(patches), "patch"));
  sensors::MarkerCompliance result = described(gel, patches);
  result.marker_grid = {side, side};
  result.marker_rest = rest;
  result.displacement.resize(gel.beads.rows(), 3 * of_patches.cols());
  for (int a = 0; a < 3; ++a) {
    const Eigen::MatrixXd answer = along_axis(gel.beads, a) * of_patches;
    for (Eigen::Index j = 0; j < of_patches.cols(); ++j) result.displacement.col(3 * j + a) = answer.col(j);
  }
  return checked(std::move(result));
}

MarkerMeans::MarkerMeans(const fem::Compliance& gel, const SurfaceMarkers& markers) {
  const std::vector<Polygon> areas = areas_of(markers);
  weights_ = hat_integrals(gel, areas, "marker");
  for (int k = 0; k < weights_.cols(); ++k) weights_.col(k) /= area_of(areas[static_cast<std::size_t>(k)]);
}

std::vector<Eigen::Vector3d> MarkerMeans::of(const Eigen::MatrixX3d& surface_displacement) const {
  TS_ASSERT(surface_displacement.rows() == weights_.rows());
  const Eigen::MatrixX3d means = weights_.transpose() * surface_displacement;
  std::vector<Eigen::Vector3d> result;
  for (Eigen::Index k = 0; k < means.rows(); ++k) result.emplace_back(means.row(k).transpose());
  return result;
}

SurfaceMarkers printed_markers(const sim::DeviceSpec& device) {
  if (!device.coating || !device.coating->print) fail_at(device.where, "the device has no printed markers");
  const sim::PrintSpec& print = *device.coating->print;
  if (print.jitter_mm != 0.0) fail_at(device.where, "the device's markers are jittered: they make no grid");
  SurfaceMarkers result;
  result.grid = print.grid;
  for (int j = 0; j < print.grid.y(); ++j) {
    for (int i = 0; i < print.grid.x(); ++i) {
      const Eigen::Vector2d place = print.spacing_mm.cwiseProduct(
          Eigen::Vector2d(i, j) - 0.5 * (print.grid.cast<double>().array() - 1.0).matrix());
      result.markers.push_back({place, 0.5 * print.width_mm, print.shape == render::MarkShape::square});
    }
  }
  return result;
}

void check_marker_compliance(const sim::DeviceSpec& device) {
  if (!device.gel.slab()) {
    fail_at(device.where, "the gel isn't a slab: how markers move under tractions is exported of slabs only");
  }
  if (device.coating && device.coating->print) {
    printed_markers(device);
  } else if (!device.beads) {
    fail_at(device.where, "the device has neither printed markers nor beads");
  }
}

sensors::MarkerCompliance export_marker_compliance(const sim::DeviceSpec& device, const fem::Compliance& gel,
                                                   std::optional<double> patch_side_mm) {
  check_marker_compliance(device);
  sensors::MarkerCompliance result;
  if (device.coating && device.coating->print) {
    const SurfaceMarkers markers = printed_markers(device);
    const double side = patch_side_mm.value_or(0.5 * device.coating->print->spacing_mm.mean());
    result = marker_compliance(gel, markers, patches_over(gel, markers, side));
  } else {
    TS_ASSERT(device.beads.has_value());
    const std::vector<Eigen::Vector3d> rest = sim::bead_centres(*device.beads);
    SurfaceMarkers markers;  // over the beads, to place the patches
    markers.grid = {device.beads->grid, device.beads->grid};
    for (const Eigen::Vector3d& bead : rest) {
      markers.markers.push_back({bead.head<2>(), 0.5 * device.beads->diameter_mm, false});
    }
    const double side = patch_side_mm.value_or(0.5 * device.beads->spacing_mm);
    result = bead_compliance(gel, rest, patches_over(gel, markers, side));
  }
  result.gel = device.name;
  return result;
}

}  // namespace touchstone::lab
