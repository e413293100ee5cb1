// Heights from frames of a gel that shows depth as darkness: sensors/heights/darkness_estimator.h.

#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/yaml_reader.h"
#include "python/src/ball_presses.h"
#include "python/src/bindings.h"
#include "python/src/estimator.h"
#include "sensors/heights/darkness_calibration.h"
#include "sensors/heights/darkness_estimator.h"
#include "sensors/heights/darkness_model_file.h"

namespace touchstone::python {
namespace {

using sensors::DarknessModel;
using sensors::DarknessResult;
const Allowed kCameraDistances = Allowed::within(1.0, 1e6);  // mm; as the command's --camera-distance-mm

using Darkness = Guarded<sensors::DarknessEstimator>;

py::dict dict_of(const sensors::ProfileError& error) {
  py::dict dict;
  dict["mean_mm"] = error.mean_mm;
  dict["rms_mm"] = error.rms_mm;
  dict["largest_mm"] = error.largest_mm;
  dict["pixel_rms_mm"] = error.pixel_rms_mm;
  return dict;
}

/// Frames of pressed balls, each with the outline (u, v, radius in pixels) of its touched part, or None to look for it.
py::tuple calibrate_darkness(const py::object& frames, const py::object& ball_diameters_mm, const py::object& rest,
                             double mm_per_px, const py::object& circles, std::optional<double> camera_distance_mm,
                             double smoothing_px, bool follow_exposure) {
  const Allowed smoothings = Allowed::within(0.0, sensors::kMostSmoothing_px);
  const GivenPresses given = presses_from(frames, ball_diameters_mm, circles);
  const std::vector<Picture> untouched = pictures_from(rest, "rest");
  require_scale(mm_per_px);
  if (!smoothings.holds(smoothing_px)) {
    fail("smoothing_px: {} is not allowed; allowed is {}", smoothing_px, smoothings.text());
  }
  if (camera_distance_mm && !kCameraDistances.holds(*camera_distance_mm)) {
    fail("camera_distance_mm: {} is not allowed; allowed is {}", *camera_distance_mm, kCameraDistances.text());
  }
  sensors::DarknessCalibrationSettings settings;
  settings.scale.mm_per_px = mm_per_px;
  if (camera_distance_mm) settings.scale.camera_distance_mm = *camera_distance_mm;
  settings.darkening = {follow_exposure, smoothing_px};
  settings.cross_validate = true;
  std::vector<sensors::BallPress> presses;
  const sensors::DarknessCalibration made = unlocked([&] {
    std::vector<cv::Mat> pictures;
    for (const Picture& picture : untouched) pictures.push_back(picture.mat);
    const sensors::RestPicture mean = sensors::mean_rest(pictures);
    presses = given.presses([&](const sensors::BallPress& press) {
      return sensors::find_dark_circle(press.frame, mean, settings.darkening, press.ball_radius_mm, settings.scale,
                                       press.name);
    });
    return sensors::calibrate_darkness(presses, mean, settings);
  });
  py::list used;
  for (const sensors::BallPress& press : presses) {
    used.append(py::make_tuple(press.circle->centre.x(), press.circle->centre.y(), press.circle->radius));
  }
  py::list depths;
  for (const double depth : made.depths_mm) depths.append(depth);
  py::dict report;
  report["pixels"] = made.pixels;
  report["circles"] = used;
  report["depths_mm"] = depths;
  report["nearest_to_rest"] = made.nearest_to_rest;
  report["fitted"] = dict_of(made.fitted);
  report["held_out"] = dict_of(*made.held_out);
  return py::make_tuple(std::make_shared<DarknessModel>(made.model), report);
}

/// A result of its own, apart from the estimator's.
DarknessResult copy_of(const DarknessResult& result) {
  DarknessResult copy = result;
  copy.height_mm = result.height_mm.clone();
  copy.doubt = result.doubt.clone();
  copy.contact = result.contact.clone();
  copy.contact.setTo(1, copy.contact != 0);
  return copy;
}

}  // namespace

void bind_dtact(py::module_& module) {
  py::class_<DarknessModel, std::shared_ptr<DarknessModel>>(module, "DarknessModel",
                                                            "What calibrate_darkness has found of one sensor.")
      .def_static(
          "load",
          [](const py::object& path) {
            return std::make_shared<DarknessModel>(sensors::load_darkness_model(needed_path(path, "path")));
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save",
          [](const DarknessModel& self, const py::object& path) { sensors::save(self, needed_path(path, "path")); },
          py::arg("path"), "Writes it, whole or not at all.")
      .def_readonly("mm_per_px", &DarknessModel::mm_per_px, "Of the gel.")
      .def_readonly("presses", &DarknessModel::presses, "That it was made of.")
      .def_property_readonly(
          "picture_shape",
          [](const DarknessModel& self) { return py::make_tuple(self.rest.mean.rows, self.rest.mean.cols); },
          "(height, width).")
      .def_property_readonly(
          "deepest_mm", [](const DarknessModel& self) { return self.curve.deepest_mm(); }, "Calibrated.")
      .def(
          "height_at",
          [](const DarknessModel& self, double darkening) {
            if (!(std::abs(darkening) <= 1e6)) fail("darkening: {} is not allowed; allowed is up to 1", darkening);
            return self.curve.height_at(std::min(darkening, 1.0));
          },
          py::arg("darkening"), "mm, of a place whose brightness is 1 - darkening times that at rest.");
  module.def(
      "calibrate_darkness", &calibrate_darkness, py::arg("frames"), py::arg("ball_diameters_mm"), py::arg("rest"),
      py::kw_only(), py::arg("mm_per_px"), py::arg("circles") = py::none(), py::arg("camera_distance_mm") = py::none(),
      py::arg("smoothing_px") = sensors::DarkeningSettings{}.smoothing_px, py::arg("follow_exposure") = true,
      "Learns from frames of pressed balls how darkness shows depth: returns (DarknessModel, report).\n\n"
      "frames: pictures, uint8, BGR. ball_diameters_mm: one each. rest: frames of the untouched gel.\n"
      "mm_per_px: of the gel. circles: for each frame (u, v, radius) in pixels of the touched part, or None to look "
      "for it.\ncamera_distance_mm: how far before the gel the camera seems to stand; what is pressed in looks larger. "
      "None "
      "leaves that out.\nsmoothing_px: of pictures, a Gaussian's standard deviation. follow_exposure: read it from "
      "each "
      "picture's border; not for presses that cover most of it.");

  py::class_<DarknessResult>(module, "DarknessResult", "What one frame gives; arrays are its own memory.")
      .def_property_readonly(
          "height_mm", [](const DarknessResult& self) { return array_of(self.height_mm); },
          "float32: pressed in is positive.")
      .def_property_readonly(
          "doubt", [](const DarknessResult& self) { return array_of(self.doubt); },
          "uint8: adds 1 if saturated, 2 if unlit, 4 if darker, 8 if brighter than calibrated.")
      .def_property_readonly(
          "contact", [](const DarknessResult& self) { return bool_array_of(self.contact); },
          "bool: higher than floor and share of the highest point.")
      .def_readonly("contact_pixels", &DarknessResult::contact_pixels, "In contact.")
      .def_readonly("exposure", &DarknessResult::exposure, "The frame's over the rest picture's.")
      .def_readonly("exposure_followed", &DarknessResult::exposure_followed, "It was read from the picture's border.")
      .def_readonly("saturated_share", &DarknessResult::saturated_share, "Of the pixels.")
      .def_readonly("dark_share", &DarknessResult::dark_share, "Of the pixels.")
      .def_readonly("deeper_share", &DarknessResult::deeper_share, "Of the pixels: darker than calibrated.")
      .def_readonly("bulged_share", &DarknessResult::bulged_share, "Of the pixels: brighter than calibrated.")
      .def_readonly("contact_at_border", &DarknessResult::contact_at_border, "The contact runs out of the picture.")
      .def_property_readonly("trusted", &DarknessResult::trusted, "Neither overexposed nor dark.");
  py::class_<Darkness, std::shared_ptr<Darkness>>(
      module, "DarknessEstimator",
      "Frame in, height map out, by darkness. Calls from several threads wait for each other.")
      .def(py::init([](const DarknessModel& model) {
             return unlocked([&] { return std::make_shared<Darkness>(model, sensors::DarknessSettings{}); });
           }),
           py::arg("model"))
      .def(
          "estimate",
          [](Darkness& self, const py::object& frame) {
            const Picture picture = picture_from(frame, "frame");
            return self.with([&](auto& estimator) { return copy_of(estimator.estimate(picture.mat)); });
          },
          py::arg("frame"), "The DarknessResult of a frame, uint8, of the model's size and kind.");
}

}  // namespace touchstone::python
