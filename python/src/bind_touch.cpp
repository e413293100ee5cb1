// Contact, slip and force of a gel with printed markers: sensors/markers/touch_reader.h.

#include <pybind11/stl.h>

#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "python/src/ball_presses.h"
#include "python/src/bindings.h"
#include "python/src/estimator.h"
#include "python/src/frame_clock.h"
#include "sensors/markers/touch_forces.h"
#include "sensors/markers/touch_reader.h"

namespace touchstone::python {
namespace {

using sensors::GelForceModel;

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// A reading of its own, apart from the reader's.
struct ReadTouch {
  std::int64_t t_us = 0;
  sensors::TouchReading reading;
  sensors::TrackedMarkers markers;
  double mm_per_px = 0.0;  ///< 0: not known
};

/// A reader that has seen the gel at rest, and its clock.
struct TouchFollower {
  TouchFollower(const sensors::TouchCalibration& known, const cv::Mat& rest)
      : parts(known), reader(sensors::at_rest(parts, rest)) {}

  ReadTouch read(const cv::Mat& frame, const std::optional<std::int64_t>& t_us) {
    const std::int64_t now_us = clock.time_of_next(t_us);
    ReadTouch touch{now_us, reader.read({frame, now_us}), reader.markers(), parts.mm_per_px};
    touch.reading.height_mm = touch.reading.height_mm.clone();
    clock.note(now_us);
    return touch;
  }
  void restart(const cv::Mat& rest) {
    reader = sensors::TouchReader(sensors::at_rest(parts, rest));
    clock = {};
  }

  sensors::TouchCalibration parts;
  sensors::TouchReader reader;
  FrameClock clock;
};
using Reader = Guarded<TouchFollower>;

std::shared_ptr<Reader> make_reader(const py::object& rest, const sensors::HeightModel* heights,
                                    const GelForceModel* force, const py::object& indenter,
                                    const py::object& mm_per_px) {
  const Picture picture = picture_from(rest, "rest");
  sensors::TouchCalibration parts;
  if (heights != nullptr) {
    parts.height = *heights;
    parts.mm_per_px = heights->mm_per_px;
  }
  if (!mm_per_px.is_none()) {
    parts.mm_per_px = number_from(mm_per_px, "mm_per_px");
    require_scale(parts.mm_per_px);
  }
  const std::string name = indenter.is_none() ? "" : text_from(indenter, "indenter");
  if (force != nullptr) {
    sensors::use_forces(parts, *force, name);
  } else if (!indenter.is_none()) {
    fail("indenter: it chooses a line of force, which isn't given");
  }
  return unlocked([&] { return std::make_shared<Reader>(parts, picture.mat); });
}

py::array force_of(const ReadTouch& self) {
  Eigen::Vector3d force = Eigen::Vector3d::Constant(kUnknown);
  if (self.reading.shear_N) force.head<2>() = -*self.reading.shear_N;  // on the object
  if (self.reading.normal_N) force.z() = *self.reading.normal_N;
  return small_array(force);
}

py::array force_error_of(const ReadTouch& self) {
  Eigen::Vector3d error = Eigen::Vector3d::Constant(kUnknown);
  if (self.reading.shear_N) error.head<2>().setConstant(self.reading.shear_error_N);
  if (self.reading.normal_N) error.z() = self.reading.normal_error_N;
  return small_array(error);
}

/// @param series a whole number for each reading, or None: all are one
py::tuple fit_forces(const py::object& readings, const py::object& forces_N, const py::object& indenter,
                     const py::object& series, const py::object& gel) {
  const std::vector<Eigen::Vector3d> forces = points3_from(forces_N, "forces_N");
  std::vector<int> of_series;
  if (!series.is_none()) {
    for_each_item(series, "series",
                  [&](const py::object& one) { of_series.push_back(whole_number_from<int>(one, "series")); });
  }
  std::vector<sensors::TouchForceSample> samples;
  double mm_per_px = 0.0;
  std::size_t count = 0;
  for_each_item(readings, "readings", [&](const py::object& one) {
    if (!py::isinstance<ReadTouch>(one)) fail("readings: number {} isn't a TouchReading", count);
    const auto& touch = one.cast<const ReadTouch&>();
    if (!(touch.mm_per_px > 0.0)) fail("readings: their TouchReader must be given heights or mm_per_px");
    if (count > 0 && touch.mm_per_px != mm_per_px) fail("readings: they are of pictures of several mm_per_px");
    mm_per_px = touch.mm_per_px;
    if (count < forces.size() && (series.is_none() || count < of_series.size())) {
      const int number = series.is_none() ? 0 : of_series[count];
      if (auto sample = sensors::force_sample(touch.reading, forces[count], mm_per_px, number)) {
        samples.push_back(*sample);
      }
    }
    ++count;
  });
  if (forces.size() != count) fail("forces_N: {} are given, there are {} readings", forces.size(), count);
  if (!series.is_none() && of_series.size() != count) {
    fail("series: {} are given, there are {} readings", of_series.size(), count);
  }
  const sensors::GelForceFit fit =
      sensors::fit_gel_forces(samples, mm_per_px, text_from(gel, "gel"), text_from(indenter, "indenter"));
  py::dict report;
  report["samples"] = samples.size();
  Eigen::Vector3d rms = Eigen::Vector3d::Constant(kUnknown), left_out = rms;
  if (fit.model.shear) rms.head<2>().setConstant(fit.model.shear->rms_residual_N);
  if (!fit.model.normal.empty()) rms.z() = fit.model.normal.front().line.rms_residual_N;
  for (int axis = 0; axis < 3; ++axis)
    left_out[axis] = fit.left_out_N[static_cast<std::size_t>(axis)].value_or(kUnknown);
  report["rms_error_N"] = small_array(rms);
  report["left_out_error_N"] = small_array(left_out);
  return py::make_tuple(std::make_shared<GelForceModel>(fit.model), report);
}

void bind_reading(py::module_& module) {
  py::class_<ReadTouch>(module, "TouchReading", "What one frame says; arrays are its own memory.")
      .def_readonly("t_us", &ReadTouch::t_us, "The frame's time.")
      .def_readonly("markers", &ReadTouch::markers, "TrackedMarkers of this frame.")
      .def_property_readonly(
          "touched", [](const ReadTouch& self) { return self.reading.patch.has_value(); }, "Something touches the gel.")
      .def_property_readonly(
          "contact_px", [](const ReadTouch& self) { return self.reading.patch ? self.reading.patch->area_px : 0.0; },
          "Pixels that differ from the gel at rest.")
      .def_property_readonly(
          "centre_px",
          [](const ReadTouch& self) -> py::object {
            if (!self.reading.patch) return py::none();
            return small_array(self.reading.patch->centre);
          },
          "(2,): the middle of these; None where nothing touches.")
      .def_property_readonly(
          "moved_px", [](const ReadTouch& self) { return small_array(self.reading.moved.px); },
          "(2,): mean displacement since rest of the contact's markers.")
      .def_property_readonly(
          "moved_markers", [](const ReadTouch& self) { return self.reading.moved.markers; }, "How many these are.")
      .def_property_readonly(
          "turn_deg",
          [](const ReadTouch& self) {
            return self.reading.moved.turn ? kDegrees * *self.reading.moved.turn : kUnknown;
          },
          "How far they have turned, from x (right) towards y (down); NaN with fewer than three.")
      .def_property_readonly(
          "turn_error_deg",
          [](const ReadTouch& self) {
            return self.reading.moved.turn ? kDegrees * self.reading.moved.turn_error : kUnknown;
          },
          "Its standard error.")
      .def_property_readonly(
          "height_mm", [](const ReadTouch& self) { return array_of(self.reading.height_mm); },
          "float32, markers painted over: pressed in is positive. None without a height model.")
      .def_property_readonly("force_N", &force_of,
                             "(3,): on the object, x to the right, y down; what no line is known for is NaN.")
      .def_property_readonly("force_error_N", &force_error_of, "(3,): standard errors, of the calibration's samples.")
      .def_property_readonly(
          "extrapolated", [](const ReadTouch& self) { return self.reading.beyond_calibration; },
          "The touch is larger than any of the calibration's.")
      .def_property_readonly(
          "motion_ratio", [](const ReadTouch& self) { return self.reading.motion_ratio; },
          "Pixels that changed since the last frame over contact_px of that; None without contact.")
      .def_property_readonly(
          "force_ratio", [](const ReadTouch& self) { return self.reading.force_ratio; },
          "Shear over normal force; None where one of them isn't known.")
      .def_property_readonly(
          "ratios_slip", [](const ReadTouch& self) { return self.reading.rule_slip; },
          "Both ratios are above their thresholds, 0.5 and 1: it slides.")
      .def_property_readonly(
          "slip", [](const ReadTouch& self) { return sensors::name_of(self.reading.rim.state); },
          "By the markers alone: 'no contact', 'sticking', 'incipient' (at the rim), 'sliding'.")
      .def_property_readonly(
          "lag", [](const ReadTouch& self) { return self.reading.rim.lag; },
          "How far the contact's rim stays behind its middle, as a part of the middle's motion; None without motion.")
      .def_property_readonly(
          "lag_error", [](const ReadTouch& self) { return self.reading.rim.lag_error; }, "Its standard error.")
      .def_property_readonly(
          "light", [](const ReadTouch& self) { return sensors::name_of(self.reading.light); },
          "Of the frame: 'normal', 'dark', 'saturated' or 'flat'.")
      .def_property_readonly(
          "trusted", [](const ReadTouch& self) { return self.reading.trusted; },
          "It has light, markers have their own names, no frame so far has shown that the gel was touched at rest, and "
          "heights aren't of an overexposed frame.");
}

}  // namespace

void bind_touch(py::module_& module) {
  py::class_<GelForceModel, std::shared_ptr<GelForceModel>>(
      module, "GelForceModel", "Lines from a dent's volume and its markers' motion to forces; see fit_touch_forces.")
      .def_static(
          "load",
          [](const py::object& path) {
            return std::make_shared<GelForceModel>(sensors::load_gel_force_model(needed_path(path, "path")));
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save",
          [](const GelForceModel& self, const py::object& path) { sensors::save(self, needed_path(path, "path")); },
          py::arg("path"), "Writes it, whole or not at all.")
      .def_property_readonly(
          "gel", [](const GelForceModel& self) { return text_of(self.gel); }, "Its name.")
      .def_readonly("mm_per_px", &GelForceModel::mm_per_px, "Of the pictures that it was fitted to.")
      .def_property_readonly(
          "indenters",
          [](const GelForceModel& self) {
            py::list names;
            for (const GelForceModel::Normal& one : self.normal) names.append(text_of(one.indenter));
            return names;
          },
          "That it has a line of normal force for.")
      .def_property_readonly(
          "shear_N_per_mm",
          [](const GelForceModel& self) {
            return self.shear ? std::optional(self.shear->newton_per_unit) : std::nullopt;
          },
          "None if it has no line for shear.");
  bind_reading(module);
  py::class_<Reader, std::shared_ptr<Reader>>(
      module, "TouchReader",
      "Contact, shear, turn and slip of a gel with printed markers, frame by frame; forces and heights by models.\n\n"
      "TouchReader(rest, *, heights=None, force=None, indenter=None, mm_per_px=None)\n\n"
      "rest: a picture of the untouched gel, uint8, (height, width) or (height, width, 3) BGR; with heights BGR.\n"
      "heights: a HeightModel of this gel, or of one like it without markers. force: a GelForceModel; normal force "
      "needs "
      "heights, too. indenter: whose line of it, if it has several. mm_per_px: where no model says it.")
      .def(py::init(&make_reader), py::arg("rest"), py::kw_only(), py::arg("heights").none(true) = py::none(),
           py::arg("force").none(true) = py::none(), py::arg("indenter") = py::none(),
           py::arg("mm_per_px") = py::none())
      .def(
          "read",
          [](Reader& self, const py::object& frame, const py::object& t_us) {
            const Picture picture = picture_from(frame, "frame");
            std::optional<std::int64_t> time_us;
            if (!t_us.is_none()) time_us = whole_number_from(t_us, "t_us");
            return self.with([&](TouchFollower& one) { return one.read(picture.mat, time_us); });
          },
          py::arg("frame"), py::arg("t_us") = py::none(),
          "The next frame, of the size and kind of the one at rest: TouchReading. t_us: as MarkerTracker.track.")
      .def(
          "restart",
          [](Reader& self, const py::object& rest) {
            const Picture picture = picture_from(rest, "rest");
            self.with([&](TouchFollower& one) { return one.restart(picture.mat), 0; });
          },
          py::arg("rest"), "Forgets all frames; rest is a new picture of the untouched gel.");
  module.def("fit_touch_forces", &fit_forces, py::arg("readings"), py::arg("forces_N"), py::kw_only(),
             py::arg("indenter") = "any", py::arg("series") = py::none(), py::arg("gel") = "gel",
             "Fits forces to touches: returns (GelForceModel, report).\n\n"
             "readings: of a TouchReader with heights (for normal force) or mm_per_px. forces_N: (readings, 3), on the "
             "object, x to the picture's right, y down, z out of the gel. series: a number each, alike for readings of "
             "one press; errors are then also found on series left out. Readings in which nothing touches, or that "
             "aren't trusted, have no say.");
}

}  // namespace touchstone::python
