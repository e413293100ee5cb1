// Displacement fields of the chroma device under three punches [Lin2019, sec. IV.E, fig. 10] against the finite
// elements'.

#include "lab/chroma/chroma_marker_experiment.h"
#include "lab/validation/row_list.h"
#include "sim/scene/device.h"

namespace touchstone::lab {
namespace {

constexpr std::uint64_t kUnit = 41;  // the sensor
constexpr std::uint64_t kRest = 1000;
constexpr std::uint64_t kCalibration = 6000;
constexpr std::uint64_t kTest = 7000;
constexpr double kPublishedError_um = 350.0;  // of one marker, sec. IV.D: the paper gives no figure for fields

}  // namespace

std::vector<ValidationRow> validate_chroma_field(const ValidateOptions& options) {
  RowList rows("chroma.field.", options, RowList::Since::last_row);
  const sim::VirtualSensor sensor(sim::read_device(options.scenes / "devices" / "chroma.yaml"), options.cache,
                                  chroma_sensor_settings(kUnit));
  const ChromaSetup setup(sensor, kRest);
  const sensors::HueModel model = calibrate_field(setup, options.quick, kCalibration);
  sensors::TractionInversion inversion = elastic_inversion(setup, options.cache, model.parallax);
  const auto add = [&](const std::string& id, const std::string& title, double ours_um) {
    rows.add_bounded(id, title, "um", Better::lower, kPublishedError_um, false, ours_um);
  };
  int number = 0;
  for (const PunchTest& punch : fig10_punches()) {
    const FieldScore field = field_under(setup, model, inversion, punch.object, punch.height_mm, punch.depth_mm,
                                         {0.4, -0.3}, kTest + number++);
    const std::string under =
        fmt::format("a {} {:.1f} mm deep, {} of 100 markers measured", field.punch, punch.depth_mm, field.measured);
    add(field.punch + "_um", fmt::format("mean length of the displacements' error under {}", under), field.mean_um);
    add(field.punch + "_worst_um",
        fmt::format("the same, the worst marker (the largest displacement is {:.0f} um)", field.largest_true_um),
        field.worst_um);
    add(field.punch + "_elastic_um",
        "mean length of the error of the displacements under the tractions that explain the field best",
        field.elastic_mean_um);
    add(field.punch + "_elastic_worst_um", "the same, the worst marker", field.elastic_worst_um);
    add(field.punch + "_lateral_um",
        "of the field as estimated by markers alone: root mean square error of a lateral component",
        field.lateral_rms_um);
    add(field.punch + "_press_um", "the same, root mean square of the normal component", field.press_rms_um);
  }
  return rows.rows();
}

}  // namespace touchstone::lab
