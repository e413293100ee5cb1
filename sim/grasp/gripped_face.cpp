#include "sim/grasp/gripped_face.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/number_checks.h"
#include "core/units.h"
#include "fem/contact/press.h"
#include "fem/contact/rough_contact.h"
#include "fem/mesh/triangle_tree.h"
#include "sim/grasp/gripped_cells.h"
#include "sim/scene/device_gel.h"

namespace touchstone::sim {
namespace {

constexpr double kInset = 1.0;  // in fine edges: vertices nearer to the flat's rim have hats that reach beyond it
constexpr double kRim = 0.6;    // likewise: vertices that far beyond the rim may still bear
constexpr int kSubcells = 8;    // a side, to tell how much of a cell lies under the flat
constexpr double kLeastStep_mm = 1e-7;  // by which the travel grows from state to state at least

constexpr const char* kWhose = "the gripped face's ";  // begins what a refusal says

void check_settings(const GrippedFaceSettings& s, const GrippedPose& pose) {
  check_above_zero(kWhose, s.least_force_N, "least_force_N");
  check_above_zero(kWhose, s.largest_force_N, "largest_force_N");
  check_above_zero(kWhose, s.cell_mm, "cell_mm");
  if (!(s.largest_force_N > s.least_force_N)) {
    fail("the gripped face's largest_force_N is {}, it must be above least_force_N, {}", s.largest_force_N,
         s.least_force_N);
  }
  if (!(s.force_ratio >= 1.05) || !(s.force_ratio <= 10.0)) {
    fail("the gripped face's force_ratio is {}, it must be from 1.05 to 10", s.force_ratio);
  }
  if (!(s.tilt_deg >= 0.0) || !(s.tilt_deg <= 45.0)) {
    fail("the gripped face's tilt_deg is {}, it must be from 0 to 45", s.tilt_deg);
  }
  if (!(s.rms_slope >= 0.0) || !std::isfinite(s.rms_slope)) {
    fail("the gripped face's rms_slope is {}, it must be at least 0 and finite", s.rms_slope);
  }
  if (!pose.place_mm.allFinite()) fail("the gripped piece's place_mm holds NaN or infinity");
  for (const double angle : {pose.pitch_deg, pose.roll_deg}) {
    if (!(std::abs(angle) <= 5.0)) fail("the gripped piece is tilted by {} degrees, at most 5 are allowed", angle);
  }
  if (!(std::abs(pose.yaw_deg) <= 180.0)) {
    fail("the gripped piece's yaw_deg is {}, it must be from -180 to 180", pose.yaw_deg);
  }
}

/// Mean displacement along y, per N of shear, of the gel under tractions along y in proportion to the pressure.
double shear_compliance_of(const fem::Compliance& gel, const Eigen::VectorXd& pressure, double force) {
  Eigen::VectorXd traction = Eigen::VectorXd::Zero(3 * pressure.size());
  for (Eigen::Index v = 0; v < pressure.size(); ++v) traction[3 * v + 1] = pressure[v];
  return traction.dot(gel.surface.times(traction)) / (force * force);
}

}  // namespace

GrippedFace::GrippedFace(const DeviceSpec& device, const fem::Compliance& gel, const ObjectSpec& piece,
                         const std::shared_ptr<const fem::Compliance>& elastic, const GrippedPose& pose,
                         const GrippedFaceSettings& settings)
    : settings_(settings),
      cosine_(std::cos(settings.tilt_deg * kRadiansPerDegree)),
      sine_(std::sin(settings.tilt_deg * kRadiansPerDegree)) {
  check_settings(settings, pose);
  if (!device.gel.slab()) fail("device {}: a gripped face needs a gel that is a slab", device.name);
  if (piece.shape.type != ShapeKind::hexagon) {
    fail("object {}: a gripped piece must be of the shape hexagon", piece.name);
  }
  if (!piece.print.empty()) {
    fail("object {}: has a print, which the pictures of a gripped piece don't show; it may have one albedo",
         piece.name);
  }
  if (piece.friction < sine_ / cosine_) {
    fail("object {}: friction {} doesn't hold it under a force that leans by {} degrees, it must be at least {:.3g}",
         piece.name, piece.friction, settings.tilt_deg, sine_ / cosine_);
  }
  const double half_height = 0.5 * piece.shape.across_flats_mm;
  const Eigen::Vector2d flat(piece.shape.length_mm, flat_width_mm(piece.shape));

  RigidTransform touching;
  touching.rotation =
      rotation_from_xyz(kRadiansPerDegree * Eigen::Vector3d(pose.roll_deg, -pose.pitch_deg, pose.yaw_deg));
  double lowest = std::numeric_limits<double>::infinity();
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) {
      lowest = std::min(lowest, touching.turn({x * flat.x(), y * flat.y(), -half_height}).z());
    }
  }
  touching.translation << pose.place_mm, -lowest;
  lay_out(device, piece, touching, flat);

  // The vertices that the flat bears on.
  const RigidTransform piece_from_gel = touching.inverse();
  const Eigen::Vector2d inset = 0.5 * flat - Eigen::Vector2d::Constant(kInset * device.mesh.fine_mm);
  std::vector<int> loaded;  // and those at its rim
  std::vector<int> vertices;
  std::vector<Eigen::Vector2d> places;  // of the former on the flat, -1 to 1 along and across it
  for (std::size_t v = 0; v < gel.vertices.size(); ++v) {
    const Eigen::Vector3d at = piece_from_gel * gel.vertices[v];
    const Eigen::Vector2d out = at.head<2>().cwiseAbs() - inset;
    if (out.maxCoeff() < (kInset + kRim) * device.mesh.fine_mm) loaded.push_back(static_cast<int>(v));
    if (out.maxCoeff() > 0.0) continue;
    vertices.push_back(static_cast<int>(v));
    places.emplace_back(2.0 * at.head<2>().cwiseQuotient(flat));
  }
  if (static_cast<int>(vertices.size()) < 2 * kTerms) {
    fail(
        "object {}: only {} vertices of the membrane's mesh lie under its flat, {} are needed: it lies over the edge, "
        "or "
        "mesh.fine_mm is too large",
        piece.name, vertices.size(), 2 * kTerms);
  }
  const std::vector<fem::ElasticMaterial> materials =
      gel_materials(device.gel);  // the body's, then from outside inwards
  const fem::ElasticMaterial& membrane = materials[materials.size() > 1 ? 1 : 0];
  contact_modulus_ = elastic ? fem::contact_modulus(membrane, elastic->material) : fem::contact_modulus(membrane);
  per_gap_ = gel.material.youngs_modulus / gel.thickness;
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(gel.mass.cols());
  std::optional<PieceAnswer> answer;
  if (elastic) answer.emplace(*elastic, gel, loaded, touching);
  std::vector<Eigen::Vector2d> at_cells;
  for (const int cell : bearing_) {
    const Eigen::Vector2d centre = grid_.centre(cell % grid_.nx, cell / grid_.nx);
    const Eigen::Vector2d at = (piece_from_gel * Eigen::Vector3d(centre.x(), centre.y(), 0.0)).head<2>();
    at_cells.emplace_back(2.0 * at.cwiseQuotient(flat));
  }
  const double nu = membrane.poisson_ratio;
  const CellContact fine({contact_modulus_ * (1.0 - nu * nu), nu}, gel, grid_, bearing_, vertices, places, at_cells,
                         0.5 * flat.x());

  // No load: the flat's own distance.
  const FlatPlane rest(touching, half_height);
  states_.emplace_back();
  signed_.emplace_back();
  for (const double gap : fine.heights(rest))
    signed_.back().push_back(static_cast<float>(-per_gap_ * std::max(0.0, gap)));

  fem::PressBody body;
  body.shape = fem::BoxShape{{flat.x(), flat.y(), piece.shape.across_flats_mm}};
  body.elastic = elastic;
  fem::Press press(gel, {body});
  const int steps = std::max(1, static_cast<int>(std::ceil(std::log(settings.largest_force_N / settings.least_force_N) /
                                                           std::log(settings.force_ratio))));
  double piece_shear = 0.0;
  std::vector<double> start;
  for (int step = steps; step >= 0; --step) {
    GripPoint point;
    point.normal_N = settings.largest_force_N *
                     std::pow(settings.least_force_N / settings.largest_force_N, static_cast<double>(step) / steps);
    point.force_N = point.normal_N / cosine_;
    point.shear_N = point.force_N * sine_;
    fem::PressTarget target;
    target.rotation = touching.rotation;
    target.axis = {fem::AxisControl::at(pose.place_mm.x()), fem::AxisControl::at(pose.place_mm.y()),
                   fem::AxisControl::with_force(point.normal_N)};
    const fem::PressState& state = press.step(target);
    point.approach_mm = touching.translation.z() - state.gel_from_object.translation.z();

    const Eigen::VectorXd pressure = -state.traction.col(2);
    Eigen::VectorXd apart = -(gel.mass * state.surface_displacement.col(2)).cwiseQuotient(weight);
    if (answer) {
      std::vector<Eigen::Vector3d> forces, shears;
      for (const int v : loaded) {
        forces.emplace_back(0, 0, weight[v] * pressure[v]);
        shears.emplace_back(0, -weight[v] * pressure[v], 0);
      }
      const std::vector<Eigen::Vector3d> moved = answer->displacements(forces);
      for (std::size_t k = 0; k < loaded.size(); ++k) apart[loaded[k]] += moved[k].z();
      if (step == 0) {
        const std::vector<Eigen::Vector3d> leant = answer->displacements(shears);
        for (std::size_t k = 0; k < loaded.size(); ++k) {
          piece_shear += shears[k].y() * leant[k].y() / (point.normal_N * point.normal_N);
        }
      }
    }
    if (step == 0) gel_shear_ = shear_compliance_of(gel, pressure, point.normal_N);

    const CellContact::Answer cells =
        fine.solve(FlatPlane(state.gel_from_object, half_height), pressure, apart, point.normal_N, start);
    signed_.emplace_back();
    for (std::size_t k = 0; k < bearing_.size(); ++k) {
      signed_.back().push_back(
          static_cast<float>(cells.pressure[k] > 0.0 ? cells.pressure[k] : -per_gap_ * std::max(0.0, cells.gap[k])));
    }
    start = cells.start;
    states_.push_back(point);
  }
  for (std::size_t k = 1; k < states_.size(); ++k) {
    GripPoint& point = states_[k];
    const GripPoint& before = states_[k - 1];
    // A tilted flat's corner may lie between vertices: the first states can then come out a little higher than
    // touching.
    point.approach_mm = std::max(point.approach_mm, before.approach_mm + kLeastStep_mm);
    point.travel_mm = point.approach_mm * cosine_ + (gel_shear_ + piece_shear) * point.shear_N * sine_;
    point.stiffness_N_mm = (point.force_N - before.force_N) / (point.travel_mm - before.travel_mm);
  }
}

/// Makes the cells.
void GrippedFace::lay_out(const DeviceSpec& device, const ObjectSpec& piece, const RigidTransform& gel_from_piece,
                          const Eigen::Vector2d& flat) {
  const double cell = settings_.cell_mm;
  const auto& slab = std::get<SlabSpec>(device.gel.shape);
  grid_.pitch = cell;
  grid_.nx = std::max(1, static_cast<int>(std::lround(slab.size_x_mm / cell)));
  grid_.ny = std::max(1, static_cast<int>(std::lround(slab.size_y_mm / cell)));
  grid_.first = -0.5 * cell * Eigen::Vector2d(grid_.nx - 1, grid_.ny - 1);
  fem::check(grid_);

  const RigidTransform piece_from_gel = gel_from_piece.inverse();
  const Eigen::Vector3d up = piece_from_gel.turn(Eigen::Vector3d::UnitZ());
  const FlatPlane plane(gel_from_piece, 0.5 * piece.shape.across_flats_mm);
  const fem::ContactShape shape = contact_shape(piece.shape);
  const double reach = fem::bounding_ball(shape).radius + cell;
  const auto on_flat = [&](const Eigen::Vector2d& place) {
    const Eigen::Vector3d at = piece_from_gel * Eigen::Vector3d(place.x(), place.y(), plane.at(place.x(), place.y()));
    return std::abs(at.x()) <= 0.5 * flat.x() && std::abs(at.y()) <= 0.5 * flat.y();
  };
  for (int j = 0; j < grid_.ny; ++j) {
    for (int i = 0; i < grid_.nx; ++i) {
      const Eigen::Vector2d centre = grid_.centre(i, j);
      if ((centre - gel_from_piece.translation.head<2>()).norm() > reach) continue;
      Cell c;
      c.place = static_cast<int>(grid_.at(i, j));
      int inside = 0;
      for (int b = 0; b < kSubcells; ++b) {
        for (int a = 0; a < kSubcells; ++a) {
          inside += on_flat(centre + cell * Eigen::Vector2d((a + 0.5) / kSubcells - 0.5, (b + 0.5) / kSubcells - 0.5));
        }
      }
      c.under = static_cast<float>(inside) / (kSubcells * kSubcells);
      const auto entry = fem::first_entry(shape, piece_from_gel * Eigen::Vector3d(centre.x(), centre.y(), 0.0), up);
      if (inside == 0 && !entry) continue;
      if (entry) c.rise = static_cast<float>(std::max(0.0, *entry - plane.at(centre.x(), centre.y())));
      c.bears = -1;
      if (2 * inside >= kSubcells * kSubcells) {
        c.bears = static_cast<int>(bearing_.size());
        bearing_.push_back(c.place);
      }
      cells_.push_back(c);
    }
  }
  if (bearing_.empty()) fail("object {}: its flat isn't over the membrane of {}", piece.name, device.name);
  const auto centre_of = [&](int place) { return grid_.centre(place % grid_.nx, place / grid_.nx); };
  for (Cell& c : cells_) {
    if (c.bears >= 0) continue;
    const Eigen::Vector2d centre = centre_of(c.place);
    const auto nearest = std::min_element(bearing_.begin(), bearing_.end(), [&](int a, int b) {
      return (centre_of(a) - centre).squaredNorm() < (centre_of(b) - centre).squaredNorm();
    });
    c.bears = static_cast<int>(nearest - bearing_.begin());
  }
}

std::size_t GrippedFace::state_below(double normal_N) const {
  std::size_t k = 0;
  while (k + 2 < states_.size() && states_[k + 1].normal_N <= normal_N) ++k;
  return k;
}

GripPoint GrippedFace::at_travel(double travel_mm) const {
  TS_ASSERT(std::isfinite(travel_mm));
  GripPoint point;
  point.travel_mm = travel_mm;
  if (travel_mm <= 0.0) {
    point.approach_mm = travel_mm * cosine_;
    return point;
  }
  std::size_t k = 0;
  while (k + 1 < states_.size() && states_[k + 1].travel_mm < travel_mm) ++k;
  if (k + 1 == states_.size()) {
    fail("the finger goes {:.4g} mm beyond the touch, which takes more than the {} N that the face was solved for",
         travel_mm, settings_.largest_force_N);
  }
  const GripPoint& low = states_[k];
  const GripPoint& high = states_[k + 1];
  const double part = (travel_mm - low.travel_mm) / (high.travel_mm - low.travel_mm);
  point.normal_N = low.normal_N + part * (high.normal_N - low.normal_N);
  point.force_N = point.normal_N / cosine_;
  point.shear_N = point.force_N * sine_;
  point.approach_mm = low.approach_mm + part * (high.approach_mm - low.approach_mm);
  point.stiffness_N_mm = high.stiffness_N_mm;
  return point;
}

GripPoint GrippedFace::at_normal_force(double normal_N) const {
  if (!(normal_N >= 0.0) || normal_N > settings_.largest_force_N) {
    fail("a normal force of {} N is asked of a gripped face that was solved from 0 to {} N", normal_N,
         settings_.largest_force_N);
  }
  const std::size_t k = state_below(normal_N);
  const double part = (normal_N - states_[k].normal_N) / (states_[k + 1].normal_N - states_[k].normal_N);
  return at_travel(states_[k].travel_mm + part * (states_[k + 1].travel_mm - states_[k].travel_mm));
}

FaceMap GrippedFace::map(const GripPoint& point) const {
  TS_ASSERT(point.normal_N >= 0.0);
  const std::size_t k = state_below(point.normal_N);
  const auto part = static_cast<float>(
      std::clamp((point.normal_N - states_[k].normal_N) / (states_[k + 1].normal_N - states_[k].normal_N), 0.0, 1.0));
  const auto apart = static_cast<float>(per_gap_ * std::max(0.0, -point.approach_mm));
  std::vector<float> value(signed_[k].size());
  for (std::size_t v = 0; v < value.size(); ++v) {
    value[v] = signed_[k][v] + part * (signed_[k + 1][v] - signed_[k][v]) - apart;
  }

  FaceMap face;
  face.coverage = cv::Mat(grid_.ny, grid_.nx, CV_32F, cv::Scalar(0));
  face.pressure_MPa = face.coverage.clone();
  face.gap_mm = cv::Mat(grid_.ny, grid_.nx, CV_32F, cv::Scalar(kNoPiece_mm));
  // Where the piece is, less the shear's displacement, which is added below.
  double force = 0.0;
  for (const Cell& c : cells_) {
    const float q = value[static_cast<std::size_t>(c.bears)];
    const float pressure = std::max(0.0F, q) * c.under;
    face.pressure_MPa.ptr<float>()[c.place] = pressure;
    force += pressure;
    face.gap_mm.ptr<float>()[c.place] =
        static_cast<float>(std::min(kNoPiece_mm, static_cast<double>(c.rise) + std::max(0.0F, -q) / per_gap_));
  }
  // The pressures of two states whose contacts differ don't quite make the force, nor do cells that are cut by the rim.
  const double all = force * grid_.pixel_area();
  if (all > 0.0 && point.normal_N > 0.0) face.pressure_MPa = face.pressure_MPa * (point.normal_N / all);
  for (const Cell& c : cells_) {
    const double pressure = face.pressure_MPa.ptr<float>()[c.place];
    if (pressure == 0.0) continue;
    face.coverage.ptr<float>()[c.place] = static_cast<float>(
        c.under * fem::real_contact_share(pressure / c.under, contact_modulus_, settings_.rms_slope));
  }

  const double shift = gel_shear_ * point.shear_N / grid_.pitch;  // cells
  const auto whole = static_cast<int>(std::floor(shift));
  const auto rest = static_cast<float>(shift - whole);
  if (shift == 0.0) return face;
  for (cv::Mat* map : {&face.coverage, &face.gap_mm, &face.pressure_MPa}) {
    cv::Mat moved(map->size(), CV_32F);
    for (int j = 0; j < grid_.ny; ++j) {
      const cv::Mat near = map->row(std::clamp(j - whole, 0, grid_.ny - 1));
      const cv::Mat far = map->row(std::clamp(j - whole - 1, 0, grid_.ny - 1));
      moved.row(j) = (1.0F - rest) * near + rest * far;
    }
    *map = moved;
  }
  return face;
}

}  // namespace touchstone::sim
