// Forces, friction and stick or slip from the chroma sensor's pictures ([Lin2019] leaves them open): punches and balls
// are pressed on the gel and dragged until they slide; each frame's picture is read, its markers' displacements
// estimated by a calibrated model and inverted. The paper gives no figure. Asked for here: forces to a tenth of the
// mean normal force, as [VisioHaptic2024] asks for 0.1 N of some newtons; friction to 0.1, which tells rubber from
// steel and the dry from the oiled.

#include <cmath>
#include <utility>

#include "core/error.h"
#include "lab/chroma/chroma_force_pictures.h"
#include "lab/validation/row_list.h"
#include "sensors/tractions/seen_markers.h"

namespace touchstone::lab {
namespace {

constexpr double kForceShare = 0.1;             // of the mean normal force
constexpr double kFrictionError = 0.1;          // of a coefficient between 0.3 and 1.2
constexpr double kStateAgreement_percent = 80;  // of true displacements with 10 to 30 um of noise it is 88 or 89
constexpr double kMostUnread_percent = 5;       // ours to choose
constexpr double kWidest_mm = 3.0;              // friction of 1.2 shears the gel so far
constexpr std::uint64_t kUnit = 6001, kCalibration = 6100, kVerification = 6200, kProbes = 6300;

/// How far off a model's displacements are, root mean square over all measured markers, on probes that are neither
/// those of the calibration nor those of the rows; lateral ones as seen.
struct FieldNoise {
  double lateral_mm = 0.0, normal_mm = 0.0;
};

FieldNoise verify(const ForceSetup& setup, const ChromaSetup& camera, const sensors::HueModel& model, int count) {
  const DragSettings drag{.step_mm = 0.4, .frames_after = 3};
  FieldNoise noise;
  int markers = 0;
  std::uint64_t seed = kVerification;
  for (const ForceProbe& probe : draw_force_probes(count, kVerification)) {
    const std::vector<ChromaRecord> records = photograph_probe(setup, camera, probe, drag, ++seed);
    const std::vector<sensors::MarkerField> fields = fields_of(records, camera, model, setup.compliance);
    for (std::size_t k = 0; k < records.size(); ++k) {
      sensors::MarkerField truth = fields[k];
      truth.displacement = records[k].truth;
      truth = sensors::as_seen(std::move(truth), setup.compliance, model.parallax);
      for (std::size_t m = 0; m < truth.displacement.size(); ++m) {
        if (!truth.measured[m]) continue;
        const Eigen::Vector3d error = fields[k].displacement[m] - truth.displacement[m];
        noise.lateral_mm += 0.5 * error.head<2>().squaredNorm();
        noise.normal_mm += error.z() * error.z();
        ++markers;
      }
    }
  }
  if (markers == 0) fail("no marker was measured on the verification's probes");
  return {std::sqrt(noise.lateral_mm / markers), std::sqrt(noise.normal_mm / markers)};
}

void add_force_rows(RowList& rows, const ForceScore& pictures, const ForceScore& ideal, const FieldNoise& noise) {
  const double mean_normal_N = pictures.mean_truth_N.z();
  const double bar_N = kForceShare * mean_normal_N;
  rows.add_bounded("chroma.force.error_N",
                   fmt::format("normal force from pictures, mean absolute error over {} frames of {:.1f} N on average",
                               pictures.frames, mean_normal_N),
                   "N", Better::lower, bar_N, false, pictures.mean_absolute_N.z());
  for (const int axis : {0, 1}) {
    const char name = axis == 0 ? 'x' : 'y';
    rows.add_bounded(fmt::format("chroma.force.error_{}_N", name),
                     fmt::format("shear force along {}, of {:.1f} N on average", name, pictures.mean_truth_N[axis]),
                     "N", Better::lower, bar_N, false, pictures.mean_absolute_N[axis]);
  }
  rows.add_bounded("chroma.force.relative_percent", "error of the force's vector, part of its length, mean over frames",
                   "%", Better::lower, 100.0 * kForceShare, false, 100.0 * pictures.relative);
  rows.add_bounded("chroma.force.unread_percent",
                   "frames that couldn't be read: sheared so far that the markers are under two filters each", "%",
                   Better::lower, kMostUnread_percent, false,
                   100.0 * pictures.unread / (pictures.frames + pictures.unread));
  rows.add_bounded(
      "chroma.force.ideal_error_N",
      fmt::format("normal force from true displacements with independent noise of what pictures err by, {:.0f} um "
                  "lateral and {:.0f} um normal",
                  1000.0 * noise.lateral_mm, 1000.0 * noise.normal_mm),
      "N", Better::lower, bar_N, false, ideal.mean_absolute_N.z());
}

void add_friction_rows(RowList& rows, const ForceScore& score, bool from_pictures) {
  const std::string id = from_pictures ? "chroma.friction." : "chroma.friction.ideal_";
  const std::string from = from_pictures ? "from pictures" : "from true displacements with that noise";
  if (score.friction_known > 0) {
    rows.add_bounded(id + "error",
                     fmt::format("friction coefficient {}, mean absolute error over {} of {} probes that slid", from,
                                 score.friction_known, score.slid),
                     "1", Better::lower, kFrictionError, false, score.friction_error);
  }
  const double agreement = score.markers.agreement();
  if (std::isfinite(agreement)) {
    rows.add_bounded(
        id + "state_percent",
        fmt::format("stick or slip of markers under the probe, {}, that agrees with the finite elements ({} more "
                    "left unknown)",
                    from, score.markers.stick_as_unknown + score.markers.slip_as_unknown),
        "%", Better::higher, kStateAgreement_percent, false, 100.0 * agreement);
  }
}

}  // namespace

std::vector<ValidationRow> validate_chroma_force(const ValidateOptions& options) {
  RowList rows("", options, RowList::Since::begin);
  const sim::DeviceSpec device = sim::read_device(options.scenes / "devices" / "chroma.yaml");
  ForceSetup setup = set_up_force(device, options.cache, options.progress);
  sim::VirtualSensorSettings light = chroma_sensor_settings(kUnit);
  light.widest_mm = kWidest_mm;
  const sim::VirtualSensor sensor(with_probe_mesh(device), options.cache, light);
  const ChromaSetup camera(sensor, kUnit);

  const sensors::HueModel model = calibrate_on_probes(setup, camera, options.quick, kCalibration);
  const FieldNoise noise = verify(setup, camera, model, options.quick ? 2 : 3);
  setup.inversion.lateral_noise_mm = setup.friction.lateral_noise_mm = noise.lateral_mm;
  setup.inversion.normal_noise_mm = noise.normal_mm;

  // What the camera sees has parallax in it; the ideal is of displacements without.
  const ForceSetup straight = setup;
  setup.compliance = sensors::as_seen(setup.compliance, model.parallax);

  DragSettings drag;
  drag.step_mm = options.quick ? 0.3 : 0.2;
  drag.frames_after = options.quick ? 5 : 8;
  std::vector<ForceRun> pictures, ideal;
  std::uint64_t seed = kProbes;
  for (const ForceProbe& probe : draw_force_probes(options.quick ? 2 : 9, kProbes)) {
    const std::vector<sensors::MarkerField> fields =
        fields_of(photograph_probe(setup, camera, probe, drag, ++seed), camera, model, straight.compliance);
    pictures.push_back(run_force_probe(setup, probe, fields_from(fields), drag));
    const MarkerReader noisy = noisy_truth(setup.compliance.marker_grid, noise.lateral_mm, noise.normal_mm, seed);
    const MarkerReader ideal_reader = [&](const ForceFrame& frame) {
      sensors::MarkerField field = noisy(frame);
      field.measured = fields[static_cast<std::size_t>(frame.number)].measured;
      return field;
    };
    ideal.push_back(run_force_probe(straight, probe, ideal_reader, drag));
  }
  const ForceScore of_pictures = score(pictures);
  const ForceScore of_ideal = score(ideal);
  add_force_rows(rows, of_pictures, of_ideal, noise);
  add_friction_rows(rows, of_pictures, true);
  add_friction_rows(rows, of_ideal, false);
  return rows.rows();
}

}  // namespace touchstone::lab
