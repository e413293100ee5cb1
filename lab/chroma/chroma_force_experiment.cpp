#include "lab/chroma/chroma_force_experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/random.h"
#include "sim/press/gel_setup.h"

namespace touchstone::lab {
namespace {

constexpr double kEdgeRadius = 0.3;                                           // mm, of the flat cylinder's rim
constexpr double kPunchHeight = 10.0;                                         // mm
constexpr double kTruthEdge = 0.85, kEstimatorEdge = 1.0, kCoarseEdge = 2.5;  // mm, of meshes
constexpr double kSideStrip = 2.0, kFineDepth = 1.0;                          // mm
constexpr double kWhole = 0.9;  // share of a marker's square that touches, for its state to be scored
constexpr double kMostly = 0.5;
constexpr double kStillSticking = 0.05;  // of the touching vertices: a discrete contact sheds them one by one

/// Height of the object frame's origin over what first touches.
double standoff(const ForceProbe& probe) {
  switch (probe.shape) {
    case ProbeShape::square:
      return 0.5 * kPunchHeight;
    case ProbeShape::cylinder:
      return 0.0;
    case ProbeShape::hemisphere:
      return 0.5 * probe.width_mm;
  }
  return 0.0;
}

fem::PressTarget target_at(const ForceProbe& probe, double drag_mm) {
  const Eigen::Vector2d place =
      probe.place + drag_mm * Eigen::Vector2d(std::cos(probe.direction_rad), std::sin(probe.direction_rad));
  fem::PressTarget target;
  target.axis = {fem::AxisControl::at(place.x()), fem::AxisControl::at(place.y()),
                 fem::AxisControl::at(standoff(probe) - probe.depth_mm)};
  return target;
}

/// Squares of a spacing about the markers, over which tractions and states are averaged.
SurfaceMarkers squares_about(const SurfaceMarkers& markers) {
  SurfaceMarkers result = markers;
  double spacing = 0.0;
  int count = 0;
  for (int m = 0; m + 1 < markers.grid.prod(); ++m) {
    if ((m + 1) % markers.grid.x() == 0) continue;
    spacing +=
        (markers.markers[static_cast<std::size_t>(m) + 1].centre - markers.markers[static_cast<std::size_t>(m)].centre)
            .norm();
    ++count;
  }
  if (count == 0) fail("the markers make no grid: two in a row are needed");
  for (SurfaceMarker& marker : result.markers) {
    marker.half_width = 0.5 * spacing / count;
    marker.square = true;
  }
  return result;
}

bool has_come_to_slide(const fem::PressState& press) {
  int stick = 0, slip = 0;
  for (const fem::NodeState state : press.node_state) {
    stick += state == fem::NodeState::stick;
    slip += state == fem::NodeState::slip;
  }
  return stick + slip > 0 && stick <= kStillSticking * (stick + slip);
}

/// Means over the markers and over their squares.
class TruthReader {
 public:
  TruthReader(const fem::Compliance& gel, const SurfaceMarkers& markers)
      : markers_(gel, markers), squares_(gel, squares_about(markers)) {}

  std::vector<MarkerTruth> of(const fem::PressState& press) const {
    Eigen::MatrixX3d states = Eigen::MatrixX3d::Zero(press.surface_displacement.rows(), 3);
    for (std::size_t v = 0; v < press.node_state.size(); ++v) {
      states(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(press.node_state[v])) = 1.0;
    }
    const std::vector<Eigen::Vector3d> displacement = markers_.of(press.surface_displacement);
    const std::vector<Eigen::Vector3d> traction = squares_.of(press.traction);
    const std::vector<Eigen::Vector3d> state = squares_.of(states);
    std::vector<MarkerTruth> result;
    for (std::size_t m = 0; m < displacement.size(); ++m) {
      result.push_back({displacement[m], traction[m], state[m][static_cast<int>(fem::NodeState::stick)],
                        state[m][static_cast<int>(fem::NodeState::slip)]});
    }
    return result;
  }

 private:
  MarkerMeans markers_, squares_;
};

void count_states(const ForceFrame& frame, const sensors::FrictionState& friction, SlipCounts& counts) {
  for (std::size_t m = 0; m < frame.markers.size(); ++m) {
    const MarkerTruth& truth = frame.markers[m];
    const double touching = truth.stick + truth.slip;
    if (touching < kWhole) continue;
    const sensors::MarkerSlip said = friction.markers[m].state;
    const bool slips = truth.slip > kMostly * touching;
    if (said == sensors::MarkerSlip::kSlip) {
      ++(slips ? counts.slip_as_slip : counts.stick_as_slip);
    } else if (said == sensors::MarkerSlip::kStick) {
      ++(slips ? counts.slip_as_stick : counts.stick_as_stick);
    } else {
      ++(slips ? counts.slip_as_unknown : counts.stick_as_unknown);
    }
  }
}

}  // namespace

const char* name_of(ProbeShape shape) {
  switch (shape) {
    case ProbeShape::square:
      return "square";
    case ProbeShape::cylinder:
      return "cylinder";
    case ProbeShape::hemisphere:
      return "hemisphere";
  }
  return "?";
}

std::string ForceProbe::name() const {
  return fmt::format("{} of {:.1f} mm, {:.2f} mm deep at ({:.1f}, {:.1f}) mm, friction {:.2f}", name_of(shape),
                     width_mm, depth_mm, place.x(), place.y(), friction);
}

fem::ContactShape contact_shape(const ForceProbe& probe) {
  switch (probe.shape) {
    case ProbeShape::square:
      return fem::BoxShape{{probe.width_mm, probe.width_mm, kPunchHeight}};
    case ProbeShape::cylinder:
      return fem::RoundedCylinder{0.5 * probe.width_mm, kEdgeRadius, kPunchHeight};
    case ProbeShape::hemisphere:
      return fem::SphereShape{0.5 * probe.width_mm};
  }
  TS_ASSERT(false);
}

std::vector<ForceProbe> draw_force_probes(int count, std::uint64_t seed) {
  std::vector<ForceProbe> probes;
  for (int k = 0; k < count; ++k) {
    RandomStream random(seed, static_cast<std::uint64_t>(k), Purpose::kPlacement);
    const auto between = [&](double low, double high) { return low + (high - low) * random.uniform(); };
    ForceProbe probe;
    probe.shape = std::array{ProbeShape::square, ProbeShape::cylinder, ProbeShape::hemisphere}[k % 3];
    const bool ball = probe.shape == ProbeShape::hemisphere;
    probe.width_mm = ball ? between(20.0, 30.0) : between(10.0, 14.0);
    probe.depth_mm = ball ? between(0.6, 1.2) : between(0.25, 0.75);
    probe.place = {between(-4.0, 4.0), between(-4.0, 4.0)};
    probe.friction = between(0.3, 1.2);
    probe.direction_rad = between(0.0, 2.0 * std::numbers::pi);
    probes.push_back(probe);
  }
  return probes;
}

sim::DeviceSpec with_probe_mesh(sim::DeviceSpec device) {
  const auto& slab = std::get<sim::SlabSpec>(device.gel.shape);
  device.mesh = {};
  device.mesh.fine_mm = kTruthEdge;
  device.mesh.coarse_mm = kCoarseEdge;
  device.mesh.fine_half_extent_mm =
      (0.5 * Eigen::Vector2d(slab.size_x_mm, slab.size_y_mm).array() - kSideStrip).max(kTruthEdge);
  device.mesh.fine_depth_mm = kFineDepth;
  return device;
}

ForceSetup set_up_force(sim::DeviceSpec device, const std::filesystem::path& cache_folder, const Progress& progress) {
  check_marker_compliance(device);
  ForceSetup setup;
  setup.markers = printed_markers(device);
  device = with_probe_mesh(std::move(device));
  setup.truth_gel = sim::set_up_gel(device, cache_folder, progress);
  device.mesh.fine_mm = kEstimatorEdge;
  setup.compliance = export_marker_compliance(device, *sim::set_up_gel(device, cache_folder, progress));
  return setup;
}

void play_probe(const ForceSetup& setup, const ForceProbe& probe, const DragSettings& drag,
                const std::function<void(const ForceFrame&)>& on_frame) {
  TS_ASSERT(setup.truth_gel != nullptr && drag.step_mm > 0.0);
  const TruthReader reader(*setup.truth_gel, setup.markers);
  fem::Press press(*setup.truth_gel, contact_shape(probe), probe.friction);
  const auto steps = static_cast<int>(std::floor(drag.longest_mm / drag.step_mm + 1e-9));
  int after = 0;
  for (int number = 0; number <= steps; ++number) {
    const double drag_mm = drag.step_mm * number;
    const fem::PressState& state = press.step(target_at(probe, drag_mm));
    const bool slides = has_come_to_slide(state);
    on_frame({probe, state, number, drag_mm, slides, reader.of(state)});
    if ((slides || after > 0) && ++after > drag.frames_after) return;
  }
}

MarkerReader noisy_truth(const Eigen::Vector2i& grid, double lateral_mm, double normal_mm, std::uint64_t seed) {
  const Eigen::Vector3d noise(lateral_mm, lateral_mm, normal_mm);
  return [grid, noise, seed](const ForceFrame& frame) {
    RandomStream random(seed, static_cast<std::uint64_t>(frame.number), Purpose::kImagerNoise);
    sensors::MarkerField field;
    field.grid = grid;
    for (const MarkerTruth& marker : frame.markers) {
      Eigen::Vector3d displacement = marker.displacement;
      for (int a = 0; a < 3; ++a) displacement[a] += noise[a] * random.normal();
      field.displacement.push_back(displacement);
    }
    field.measured.assign(field.displacement.size(), 1);
    return field;
  };
}

SlipCounts& SlipCounts::operator+=(const SlipCounts& other) {
  stick_as_stick += other.stick_as_stick;
  stick_as_slip += other.stick_as_slip;
  stick_as_unknown += other.stick_as_unknown;
  slip_as_stick += other.slip_as_stick;
  slip_as_slip += other.slip_as_slip;
  slip_as_unknown += other.slip_as_unknown;
  return *this;
}

double SlipCounts::agreement() const {
  const int right = stick_as_stick + slip_as_slip;
  const int known = right + stick_as_slip + slip_as_stick;
  return known > 0 ? static_cast<double>(right) / known : std::numeric_limits<double>::quiet_NaN();
}

ForceRun run_force_probe(const ForceSetup& setup, const ForceProbe& probe, const MarkerReader& reader,
                         const DragSettings& drag) {
  ForceRun run;
  run.probe = probe;
  sensors::TractionInversion inversion(setup.compliance, setup.inversion);
  sensors::FrictionObserver observer(setup.friction);
  play_probe(setup, probe, drag, [&](const ForceFrame& frame) {
    const sensors::MarkerField field = reader(frame);
    if (std::count(field.measured.begin(), field.measured.end(), 1) < sensors::TractionInversion::kLeastMarkers) {
      ++run.unread;
      return;
    }
    const auto start = std::chrono::steady_clock::now();
    const sensors::TractionField tractions = inversion.invert(field);
    const sensors::FrictionState& friction = observer.update(field, tractions);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    ForceSample sample;
    sample.frame = frame.number;
    sample.drag_mm = frame.drag_mm;
    sample.slides = frame.slides;
    sample.truth = frame.press.wrench;
    sample.estimate = tractions.wrench;
    for (int a = 0; a < 6; ++a) sample.sigma[a] = tractions.sigma(a);
    sample.misfit = tractions.misfit;
    sample.largest_strain = frame.press.largest_strain;
    sample.milliseconds = took.count();
    sample.slip = friction.state;
    if (friction.friction) sample.friction = friction.friction->value;
    run.samples.push_back(sample);
    count_states(frame, friction, run.markers);
  });
  return run;
}

ForceScore score(const std::vector<ForceRun>& runs) {
  ForceScore result;
  for (const ForceRun& run : runs) {
    bool slid = false;
    for (const ForceSample& sample : run.samples) {
      const Eigen::Vector3d truth = sample.truth.head<3>();
      const Eigen::Vector3d error = sample.estimate.head<3>() - truth;
      const Eigen::Vector3d bar = sample.sigma.head<3>();
      ++result.frames;
      result.mean_absolute_N += error.cwiseAbs();
      result.mean_truth_N += truth.cwiseAbs();
      result.relative += error.norm() / truth.norm();
      for (int a = 0; a < 3; ++a) {
        const double z = bar[a] > 0.0 ? error[a] / bar[a] : std::numeric_limits<double>::infinity();
        result.z_square[a] += z * z;
        result.within_two_bars[a] += std::abs(z) <= 2.0 ? 1.0 : 0.0;
      }
      result.mean_milliseconds += sample.milliseconds;
      const bool seen = sample.slip == sensors::ContactSlip::kSliding;
      (sample.slides ? result.sliding_frames : result.sticking_frames) += 1;
      if (seen) (sample.slides ? result.sliding_seen : result.sliding_false) += 1;
      slid = slid || sample.slides;
    }
    result.unread += run.unread;
    result.markers += run.markers;
    if (!slid) continue;
    ++result.slid;
    if (const std::optional<double>& friction = run.samples.back().friction) {
      ++result.friction_known;
      result.friction_error += std::abs(*friction - run.probe.friction);
      result.friction_relative += std::abs(*friction / run.probe.friction - 1.0);
    }
  }
  const double frames = std::max(1, result.frames);
  result.mean_absolute_N /= frames;
  result.mean_truth_N /= frames;
  result.relative /= frames;
  result.z_square /= frames;
  result.within_two_bars /= frames;
  result.mean_milliseconds /= frames;
  result.friction_error /= std::max(1, result.friction_known);
  result.friction_relative /= std::max(1, result.friction_known);
  return result;
}

std::vector<LargeStrainRow> large_strain_ladder(const ForceSetup& setup, const fem::FiniteGel& finite, ForceProbe probe,
                                                const std::vector<double>& depths_mm, const MarkerReader& reader) {
  TS_ASSERT(setup.truth_gel != nullptr);
  if (finite.outer.mesh_vertex.size() != setup.truth_gel->vertices.size()) {
    fail("the gel at finite strain has {} surface vertices, the linear one {}: they need the same mesh",
         finite.outer.mesh_vertex.size(), setup.truth_gel->vertices.size());
  }
  const TruthReader truth(*setup.truth_gel, setup.markers);
  sensors::TractionInversion inversion(setup.compliance, setup.inversion);
  fem::FinitePress large(finite, contact_shape(probe), probe.friction);
  fem::PressTolerance alike;
  alike.outlines = false;  // as at finite strain: they differ by what the strain makes of the forces alone
  fem::Press linear(*setup.truth_gel, contact_shape(probe), probe.friction, alike);
  std::vector<LargeStrainRow> rows;
  for (std::size_t k = 0; k < depths_mm.size(); ++k) {
    probe.depth_mm = depths_mm[k];
    const fem::PressTarget target = target_at(probe, 0.0);
    const fem::PressState* state = nullptr;
    try {
      state = &large.step(target);
    } catch (const Error&) {
      return rows;
    }
    LargeStrainRow row;
    row.depth_mm = probe.depth_mm;
    row.largest_strain = state->largest_strain;
    row.truth_N = state->wrench[2];
    row.linear_N = linear.step(target).wrench[2];
    const sensors::TractionField tractions =
        inversion.invert(reader({probe, *state, static_cast<int>(k), 0.0, false, truth.of(*state)}));
    row.estimate_N = tractions.wrench[2];
    row.sigma_N = tractions.sigma(2);
    row.misfit = tractions.misfit;
    rows.push_back(row);
  }
  return rows;
}

}  // namespace touchstone::lab
