// Beads and forces: sensors/beads/bead_tracker.h, sensors/beads/stiffness_force_model.h.

#include "core/error.h"
#include "python/src/bindings.h"
#include "python/src/estimator.h"
#include "sensors/beads/bead_tracker.h"
#include "sensors/beads/stiffness_model_file.h"
#include "sensors/beads/stiffness_training.h"

namespace touchstone::python {
namespace {

using sensors::BeadTrackerSettings;
using sensors::StiffnessForceModel;
using sensors::TrackedBeads;
using Tracker = Guarded<sensors::BeadTracker>;

std::shared_ptr<Tracker> make_tracker(const py::object& grid, const py::object& roi_a_px, const py::object& roi_b_px,
                                      const py::object& polarity_name, const py::object& centre_px) {
  const std::string polarity = text_from(polarity_name, "polarity");
  BeadTrackerSettings settings;
  settings.grid = whole_number_from<int>(grid, "grid");
  settings.roi_a_px = whole_number_from<int>(roi_a_px, "roi_a_px");
  settings.roi_b_px = whole_number_from<int>(roi_b_px, "roi_b_px");
  if (polarity == "bright") {
    settings.appearance.polarity = sensors::BeadPolarity::kBright;
  } else if (polarity != "dark") {
    fail("polarity: '{}' is not known; allowed is one of: dark, bright", polarity);
  }
  if (!centre_px.is_none()) settings.first_centre_px = vector2_from(centre_px, "centre_px");
  return std::make_shared<Tracker>(settings);
}

py::dict train(const py::object& rest, const py::object& positions, const py::object& forces_N, const py::object& grid,
               const py::object& form_name) {
  const std::string form = text_from(form_name, "form");
  sensors::ForceSamples samples;
  samples.grid = whole_number_from<int>(grid, "grid");
  samples.rest = points2_from(rest, "rest");
  for_each_item(positions, "positions",
                [&](const py::object& one) { samples.positions.push_back(points2_from(one, "positions")); });
  samples.forces = points3_from(forces_N, "forces_N");
  sensors::TrainingSettings settings = sensors::TrainingSettings::to_convergence();
  if (form == "symmetric") {
    settings.form = sensors::MatrixForm::kSymmetric;
  } else if (form == "diagonal") {
    settings.form = sensors::MatrixForm::kDiagonal;
  } else if (form != "asymmetric") {
    fail("form: '{}' is not known; allowed is one of: asymmetric, symmetric, diagonal", form);
  }
  const sensors::TrainedModel trained = unlocked([&] { return sensors::train(samples, settings); });
  py::dict result;
  result["model"] = std::make_shared<StiffnessForceModel>(trained.model);
  result["rms_error_N"] = small_array(Eigen::Vector3d(trained.report.final_loss.cwiseSqrt()));
  result["r2"] = small_array(trained.report.r2);
  result["iterations"] = trained.report.iterations;
  return result;
}

sensors::ForceEstimate estimate(const StiffnessForceModel& model, const TrackedBeads& beads, const py::object& rest) {
  if (rest.is_none()) return sensors::estimate(model, beads);
  const std::vector<Eigen::Vector2d> points = points2_from(rest, "rest");
  if (points.size() != model.rest.size()) {
    fail("rest: {} positions are given, the model has {} beads", points.size(), model.rest.size());
  }
  return sensors::estimate(model, beads, points);
}

}  // namespace

void bind_vhs(py::module_& module) {
  py::class_<TrackedBeads>(module, "TrackedBeads", "What was found in one frame; beads row by row.")
      .def_readonly("t_us", &TrackedBeads::t_us, "The frame's time.")
      .def_property_readonly(
          "positions_px", [](const TrackedBeads& self) { return points_array(self.positions); },
          "(beads, 2), filtered; pixel centres are at + 0.5.")
      .def_property_readonly(
          "measured_px", [](const TrackedBeads& self) { return points_array(self.measured); },
          "(beads, 2), before the filter.")
      .def_property_readonly(
          "status",
          [](const TrackedBeads& self) {
            py::list names;
            for (const sensors::BeadStatus status : self.status) {
              names.append(sensors::name_of(status));
            }
            return names;
          },
          "Of each bead: 'found', 'found again', 'hidden', 'reset'.")
      .def_property_readonly("found", &TrackedBeads::found, "Beads measured in this frame.")
      .def_readonly("mean_grey", &TrackedBeads::mean_grey, "Of the square with all beads.");
  py::class_<Tracker, std::shared_ptr<Tracker>>(
      module, "BeadTracker",
      "Follows a grid of beads from frame to frame. BeadTracker(*, grid=3, roi_a_px=220, roi_b_px=30, polarity='dark', "
      "centre_px=None)\n\nThe first frame shows the sensor without load, its beads round centre_px (the picture's "
      "centre). roi_a_px: side of the square with all beads; roi_b_px: of the window round one.")
      .def(py::init(&make_tracker), py::kw_only(), py::arg("grid") = 3, py::arg("roi_a_px") = 220,
           py::arg("roi_b_px") = 30, py::arg("polarity") = "dark", py::arg("centre_px") = py::none())
      .def(
          "track",
          [](Tracker& self, const py::object& frame, const py::object& t_us) {
            const Picture picture = picture_from(frame, "frame");
            const auto time_us = whole_number_from(t_us, "t_us");
            return self.with([&](auto& tracker) { return TrackedBeads(tracker.track({picture.mat, time_us})); });
          },
          py::arg("frame"), py::arg("t_us"), "The next frame, later than the last one: TrackedBeads.")
      .def(
          "restart", [](Tracker& self) { self.with([](auto& tracker) { return tracker.restart(), 0; }); },
          "Forgets all frames.");

  using sensors::ForceEstimate;
  py::class_<ForceEstimate>(module, "ForceEstimate", "Force from one tracked frame.")
      .def_readonly("t_us", &ForceEstimate::t_us, "The frame's time.")
      .def_readonly("extrapolated", &ForceEstimate::extrapolated, "Beads went beyond what training saw.")
      .def_readonly("beads_missing", &ForceEstimate::beads_missing,
                    "Beads that were not measured; the force is doubtful if any is.")
      .def_property_readonly(
          "force_N", [](const ForceEstimate& self) { return small_array(self.force); },
          "(3,): in the axes of the training samples.");
  py::class_<StiffnessForceModel, std::shared_ptr<StiffnessForceModel>>(
      module, "StiffnessForceModel",
      "Force from bead positions by a matrix of stiffness coefficients; see train_stiffness.")
      .def_static(
          "load",
          [](const py::object& path) {
            return std::make_shared<StiffnessForceModel>(sensors::load_stiffness_model(needed_path(path, "path")));
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save",
          [](const StiffnessForceModel& self, const py::object& path) {
            sensors::save(self, needed_path(path, "path"));
          },
          py::arg("path"), "Writes it, whole or not at all.")
      .def_readonly("grid", &StiffnessForceModel::grid, "Beads a side.")
      .def_property_readonly(
          "rest_px", [](const StiffnessForceModel& self) { return points_array(self.rest); },
          "(grid^2, 2): positions without load.")
      .def("estimate", &estimate, py::arg("beads"), py::kw_only(), py::arg("rest") = py::none(),
           "The ForceEstimate of tracked beads, against the model's rest positions or those given.");
  module.def("train_stiffness", &train, py::arg("rest"), py::arg("positions"), py::arg("forces_N"), py::kw_only(),
             py::arg("grid") = 3, py::arg("form") = "asymmetric",
             "Trains a StiffnessForceModel: returns a dict of model, rms_error_N (3,), r2 (3,), iterations.\n\n"
             "rest: (grid^2, 2) px without load. positions: as many for each sample. forces_N: (samples, 3).\n"
             "form: 'asymmetric' (that of [VisioHaptic2024]), 'symmetric' or 'diagonal'.");
}

}  // namespace touchstone::python
