#include "lab/vhs/bead_tractions.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/sets/csv_cells.h"
#include "sensors/tractions/bead_field.h"
#include "sensors/tractions/seen_markers.h"

namespace touchstone::lab {

sensors::TractionSettings bead_inversion() {
  sensors::TractionSettings settings;
  settings.lateral_noise_mm = 0.003;
  settings.normal_noise_mm = 10.0;  // as good as nothing
  settings.correlation = 0.2;
  settings.scale = 0.5;
  return settings;
}

TractionSummary write_bead_tractions(const std::vector<TrackedSequence>& sequences,
                                     const std::vector<Eigen::Vector2d>& rest_px,
                                     const sensors::MarkerCompliance& compliance, const sensors::ViewParallax& parallax,
                                     const sensors::TractionSettings& settings, const std::filesystem::path& folder) {
  sensors::TractionInversion inversion(sensors::as_seen(compliance, parallax), settings);
  std::string tractions = "sequence,frame,t_us,x_mm,y_mm,traction_x_MPa,traction_y_MPa,pressure_MPa\n";
  std::string forces =
      "sequence,frame,t_us,beads,force_x_N,force_y_N,force_z_N,sigma_force_x_N,sigma_force_y_N,sigma_force_z_N\n";
  TractionSummary summary;
  for (const TrackedSequence& sequence : sequences) {
    std::vector<Eigen::Vector2d> rest = rest_px;
    if (rest.empty()) {
      require_first(sequence);
      const sensors::TrackedBeads& first = sequence.beads.front();
      if (first.found() != static_cast<int>(first.status.size())) {
        fail("{}: its first frame, without load, shows {} of {} beads", sequence.source.name, first.found(),
             first.status.size());
      }
      rest = first.positions;
    }
    const sensors::BeadView view = sensors::view_of(rest, compliance);
    for (std::size_t k = 0; k < sequence.beads.size(); ++k) {
      const sensors::TrackedBeads& beads = sequence.beads[k];
      const std::string frame = fmt::format("{},{},{}", datasets::csv_cell(sequence.source.name),
                                            sequence.source.frames[k].frame, beads.t_us);
      const sensors::MarkerField field = sensors::bead_field(beads, rest, view, compliance);
      const auto found = static_cast<int>(std::count(field.measured.begin(), field.measured.end(), 1));
      ++summary.frames;
      if (found < sensors::TractionInversion::kLeastMarkers) {
        forces += fmt::format("{},{},,,,,,\n", frame, found);
        ++summary.without_force;
        continue;
      }
      const sensors::TractionField field_estimate = inversion.invert(field);
      forces += fmt::format("{},{},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f}\n", frame, found, field_estimate.wrench[0],
                            field_estimate.wrench[1], field_estimate.wrench[2], field_estimate.sigma(0),
                            field_estimate.sigma(1), field_estimate.sigma(2));
      if (field_estimate.in_contact) ++summary.in_contact;
      for (int p = 0; p < compliance.patches(); ++p) {
        if (field_estimate.contact[static_cast<std::size_t>(p)] == 0) continue;
        const Eigen::Vector2d at = compliance.patch_centre(p);
        const auto traction = field_estimate.traction.col(p);
        tractions += fmt::format("{},{:.3f},{:.3f},{:.6f},{:.6f},{:.6f}\n", frame, at.x(), at.y(), traction.x(),
                                 traction.y(), -traction.z());
      }
    }
  }
  std::filesystem::create_directories(folder);
  write_whole_file(folder / "tractions.csv", tractions);
  write_whole_file(folder / "forces.csv", forces);
  return summary;
}

}  // namespace touchstone::lab
