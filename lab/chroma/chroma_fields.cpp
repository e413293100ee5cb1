#include "lab/chroma/chroma_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/error.h"
#include "core/whole_file_writer.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"
#include "sensors/tractions/friction_state.h"
#include "sensors/tractions/seen_markers.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr double kSpacingTolerance = 0.02;

void check(const sensors::MarkerCompliance& compliance, const sensors::HueModel& model, const Eigen::Vector2i& grid) {
  if (compliance.marker_grid != grid) {
    fail("the compliance is of a grid of {} x {} markers, the pictures are of {} x {}", compliance.marker_grid.x(),
         compliance.marker_grid.y(), grid.x(), grid.y());
  }
  const double spacing = (compliance.marker_rest[1] - compliance.marker_rest[0]).norm();
  if (std::abs(spacing - model.spacing_mm) > kSpacingTolerance * model.spacing_mm) {
    fail("the compliance's markers are {:.3f} mm apart, the model's {:.3f} mm", spacing, model.spacing_mm);
  }
}

constexpr const char* kDisplacementColumns = "file,marker,x_mm,y_mm,z_mm,measured,extrapolated,flaw";
constexpr const char* kElasticColumns = ",elastic_x_mm,elastic_y_mm,elastic_z_mm";

/// A line for each marker; cells of what isn't measured are empty. @param elastic null without forces; otherwise the
/// displacements under the tractions, none where there were too few markers for them
void add_displacements(const std::string& file, const sensors::ColourMarkerReading& reading,
                       const sensors::HueField& field, const sensors::MarkerField* elastic, std::string& csv) {
  for (std::size_t i = 0; i < reading.markers.size(); ++i) {
    if (field.field.measured[i]) {
      const Eigen::Vector3d& d = field.field.displacement[i];
      csv += fmt::format("{},{},{:.5f},{:.5f},{:.5f},1,{},none", file, i, d.x(), d.y(), d.z(), field.extrapolated[i]);
    } else {
      const sensors::MarkerFlaw flaw = reading.markers[i].flaw;
      csv += fmt::format("{},{},,,,0,0,{}", file, i,
                         flaw == sensors::MarkerFlaw::kNone ? "undetermined" : sensors::name_of(flaw));
    }
    if (elastic && elastic->displacement.empty()) csv += ",,,";
    if (elastic && !elastic->displacement.empty()) {
      const Eigen::Vector3d& d = elastic->displacement[i];
      csv += fmt::format(",{:.5f},{:.5f},{:.5f}", d.x(), d.y(), d.z());
    }
    csv += '\n';
  }
}

/// Without the markers that look as nothing did in calibration: a polynomial may be far off there, and one such marker
/// spoils the whole frame's forces.
sensors::MarkerField trusted(const sensors::HueField& field) {
  sensors::MarkerField markers = field.field;
  for (std::size_t i = 0; i < markers.measured.size(); ++i) {
    if (field.extrapolated[i]) markers.measured[i] = 0;
  }
  return markers;
}

/// Fields in the order of time to lines of forces.csv. Lateral displacements are inverted as seen, for hue hardly tells
/// the press that undoing their parallax would take (sensors/tractions/seen_markers.h).
class ForceTable {
 public:
  ForceTable(const FieldForces& forces, const sensors::ViewParallax& parallax)
      : parallax_(parallax),
        inversion_(sensors::as_seen(forces.compliance, parallax), forces.settings),
        observer_({.lateral_noise_mm = forces.settings.lateral_noise_mm}) {}

  /// Adds a line. Its cells are empty if too few markers are measured for a force.
  /// @return how the markers moved under the tractions; of none where there are no tractions
  /// @param shown given the force and slip
  sensors::MarkerField add(const std::string& file, const sensors::HueField& field, std::string& csv,
                           ShownField& shown) {
    const sensors::MarkerField markers = sensors::as_seen(trusted(field), inversion_.compliance(), parallax_);
    const auto used = std::count(markers.measured.begin(), markers.measured.end(), 1);
    csv += fmt::format("{},{}", file, used);
    if (used < sensors::TractionInversion::kLeastMarkers) {
      observer_.restart();
      shown.slip = "too few markers";
      csv += fmt::format("{},{},,,,\n", std::string(13, ','), shown.slip);
      return {};
    }
    const sensors::TractionField tractions = inversion_.invert(markers);
    const sensors::FrictionState& friction = observer_.update(markers, tractions);
    shown.force_N = tractions.wrench.head<3>();
    shown.slip = sensors::name_of(friction.state);
    for (int i = 0; i < 6; ++i) csv += fmt::format(",{:.5f}", tractions.wrench[i]);
    for (int i = 0; i < 6; ++i) csv += fmt::format(",{:.5f}", tractions.sigma(i));
    csv += fmt::format(",{:.3f},{}", tractions.misfit, sensors::name_of(friction.state));
    if (tractions.in_contact) {
      csv += fmt::format(",{:.4f},{:.4f}", friction.ratio, friction.ratio_error);
    } else {
      csv += ",,";
    }
    if (friction.friction) {
      csv += fmt::format(",{:.4f},{:.4f}\n", friction.friction->value, friction.friction->error);
    } else {
      csv += ",,\n";
    }
    return sensors::as_they_are(sensors::displacements_under(inversion_.compliance(), tractions.traction),
                                inversion_.compliance(), parallax_);
  }

  static std::string header() {
    std::string columns = "file,markers";
    for (const char* prefix : {"", "sigma_"}) {
      for (const char axis : {'x', 'y', 'z'}) columns += fmt::format(",{}force_{}_N", prefix, axis);
      for (const char axis : {'x', 'y', 'z'}) columns += fmt::format(",{}torque_{}_Nmm", prefix, axis);
    }
    return columns + ",misfit,slip,shear_ratio,sigma_shear_ratio,friction,sigma_friction\n";
  }

 private:
  sensors::ViewParallax parallax_;
  sensors::TractionInversion inversion_;
  sensors::FrictionObserver observer_;
};

}  // namespace

void find_rest_of(sensors::ColourMarkerFinder& finder, const fs::path& picture) {
  datasets::on_picture(picture, [&](const cv::Mat& image) { finder.find_rest(image); });
}

FieldSummary write_chroma_fields(const sensors::HueModel& model, const Eigen::Vector2i& grid, const fs::path& rest,
                                 const std::vector<datasets::FrameStream>& streams,
                                 const std::optional<FieldForces>& forces, const fs::path& folder,
                                 const Progress& progress, const ShowField& show) {
  sensors::ColourMarkerFinder finder({.grid = grid});
  find_rest_of(finder, rest);
  const sensors::HueEstimator estimator(model, finder.rest());
  std::optional<ForceTable> table;
  if (forces) {
    check(forces->compliance, model, grid);
    table.emplace(*forces, model.parallax);
  }
  fs::create_directories(folder);
  WholeFileWriter displacements(folder / "displacements.csv");
  displacements.append(fmt::format("{}{}\n", kDisplacementColumns, table ? kElasticColumns : ""));
  std::optional<WholeFileWriter> wrenches;
  if (table) wrenches.emplace(folder / "forces.csv");
  if (table) wrenches->append(ForceTable::header());
  const std::int64_t total = datasets::frames_of(streams);
  FieldSummary summary;
  datasets::for_each_frame(streams, [&](const datasets::SourceFrame& frame) {
    const std::string name = datasets::csv_cell(datasets::name_in_table(frame));
    std::string lines, force_line;
    std::string fault = datasets::fault_on_frame(frame, [&](const cv::Mat& image) {
      const sensors::ColourMarkerReading& reading = finder.find(image);
      const sensors::HueField field = estimator.estimate(reading);
      sensors::MarkerField elastic;
      ShownField shown{finder.rest(), reading, field};
      if (table) elastic = table->add(name, field, force_line, shown);
      if (show) show(frame, shown);
      add_displacements(name, reading, field, table ? &elastic : nullptr, lines);
      if (table && elastic.displacement.empty()) ++summary.without_force;
      summary.markers += static_cast<int>(reading.markers.size());
      summary.measured += static_cast<int>(std::count(field.field.measured.begin(), field.field.measured.end(), 1));
      summary.extrapolated += static_cast<int>(std::count(field.extrapolated.begin(), field.extrapolated.end(), 1));
    });
    if (!fault.empty()) {
      lines = fmt::format("{},,,,,0,0,{}{}\n", name, datasets::csv_cell(fault), table ? ",,," : "");
      force_line.clear();
      summary.faults.push_back(std::move(fault));
    }
    displacements.append(lines);
    if (wrenches) wrenches->append(force_line);
    ++summary.frames;
    if (progress) progress("fields", summary.frames, total);
  });
  datasets::require_a_frame(summary.faults, static_cast<std::size_t>(summary.frames));
  displacements.finish();
  if (wrenches) wrenches->finish();
  return summary;
}

}  // namespace touchstone::lab
