// Heights from frames of a coated gel: sensors/heights/height_estimator.h.

#include "core/error.h"
#include "python/src/ball_presses.h"
#include "python/src/bindings.h"
#include "python/src/estimator.h"
#include "sensors/heights/height_calibration.h"
#include "sensors/heights/height_estimator.h"
#include "sensors/heights/height_model_file.h"

namespace touchstone::python {
namespace {

using sensors::HeightModel;
using Heights = Guarded<sensors::HeightEstimator>;

const Allowed kThicknesses = Allowed::within(0.01, 1000.0);  // mm
const Allowed kFollowed = Allowed::within(0.0, 1e6);         // frames

std::optional<sensors::LightCorrection> correction_named(const std::string& name) {
  if (name == "best") return std::nullopt;
  if (name == "none") return sensors::LightCorrection::none;
  if (name == "background") return sensors::LightCorrection::background;
  if (name == "fitted") return sensors::LightCorrection::fitted;
  fail("correction: '{}' is not known; allowed is one of: best, none, background, fitted", name);
}

sensors::SlopeRegressor regressor_named(const std::string& name) {
  if (name == "best") return sensors::SlopeRegressor::best;
  if (name == "table") return sensors::SlopeRegressor::table;
  if (name == "network") return sensors::SlopeRegressor::network;
  fail("slopes: '{}' is not known; allowed is one of: best, table, network", name);
}

/// Frames of pressed balls, each with the outline (u, v, radius in pixels) of its touched part, or None to look for it.
py::tuple calibrate_height(const py::object& frames, const py::object& ball_diameters_mm, const py::object& background,
                           double mm_per_px, const py::object& circles, const py::object& correction,
                           const py::object& slopes, double gel_thickness_mm) {
  const GivenPresses given = presses_from(frames, ball_diameters_mm, circles);
  const std::vector<Picture> rest = pictures_from(background, "background");
  sensors::HeightCalibrationSettings settings;
  settings.mm_per_px = mm_per_px;
  settings.correction = correction_named(text_from(correction, "correction"));
  settings.slopes = regressor_named(text_from(slopes, "slopes"));
  settings.gel_thickness_mm = gel_thickness_mm;
  if (!kThicknesses.holds(gel_thickness_mm)) {
    fail("gel_thickness_mm: {} is not allowed; allowed is {}", gel_thickness_mm, kThicknesses.text());
  }
  require_scale(mm_per_px);
  const sensors::HeightCalibration made = unlocked([&] {
    std::vector<cv::Mat> untouched;
    for (const Picture& picture : rest) untouched.push_back(picture.mat);
    const sensors::Background mean = sensors::mean_background(untouched);
    const std::vector<sensors::BallPress> presses = given.presses();
    return sensors::calibrate_height(presses, mean, settings);
  });
  py::dict report;
  report["pixels"] = made.pixels;
  report["rms_slope_error"] = made.rms_slope_error;
  report["correction"] = sensors::name_of(made.model.correction);
  report["steepest_slope"] = made.coverage.steepest_slope;
  report["slopes"] = made.model.network ? "network" : "table";
  py::dict left_out;
  for (const sensors::PressUse& use : made.presses) {
    if (!use.flaw.empty()) left_out[py::str(use.name)] = use.flaw;
  }
  report["left_out"] = left_out;
  return py::make_tuple(std::make_shared<HeightModel>(made.model), report);
}

/// A result of its own, apart from the estimator's.
sensors::HeightResult copy_of(const sensors::HeightResult& result) {
  sensors::HeightResult copy = result;
  copy.height_mm = result.height_mm.clone();
  copy.slope_u = result.slope_u.clone();
  copy.slope_v = result.slope_v.clone();
  copy.contact = result.contact.clone();
  copy.contact.setTo(1, copy.contact != 0);
  return copy;
}

std::shared_ptr<Heights> make_estimator(const HeightModel& model, const py::object& border_name, double follow_frames) {
  const std::string border = text_from(border_name, "border");
  sensors::HeightSettings settings;
  if (!kFollowed.holds(follow_frames)) {
    fail("follow_frames: {} is not allowed; allowed is {}", follow_frames, kFollowed.text());
  }
  settings.follow.frames = follow_frames;
  if (border == "free") {
    settings.border = sensors::HeightBorder::free;
  } else if (border != "zero") {
    fail("border: '{}' is not known; allowed is one of: zero, free", border);
  }
  return unlocked([&] { return std::make_shared<Heights>(model, settings); });
}

}  // namespace

void bind_gelsight(py::module_& module) {
  using sensors::HeightResult;
  py::class_<HeightModel, std::shared_ptr<HeightModel>>(module, "HeightModel",
                                                        "What calibrate_height has found of one sensor.")
      .def_static(
          "load",
          [](const py::object& path) {
            return std::make_shared<HeightModel>(sensors::load_height_model(needed_path(path, "path")));
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save",
          [](const HeightModel& self, const py::object& path) { sensors::save(self, needed_path(path, "path")); },
          py::arg("path"), "Writes it, whole or not at all.")
      .def_readonly("mm_per_px", &HeightModel::mm_per_px, "Of the membrane.")
      .def_readonly("presses", &HeightModel::presses, "That it was made of.")
      .def_property_readonly(
          "picture_shape",
          [](const HeightModel& self) { return py::make_tuple(self.background.mean.rows, self.background.mean.cols); },
          "(height, width).");
  module.def(
      "calibrate_height", &calibrate_height, py::arg("frames"), py::arg("ball_diameters_mm"), py::arg("background"),
      py::kw_only(), py::arg("mm_per_px"), py::arg("circles") = py::none(), py::arg("correction") = "best",
      py::arg("slopes") = "best", py::arg("gel_thickness_mm") = 4.0,
      "Learns from frames of pressed balls: returns (HeightModel, report).\n\n"
      "frames: pictures, uint8, BGR. ball_diameters_mm: one each. background: frames of the untouched gel.\n"
      "mm_per_px: of the membrane. circles: for each frame (u, v, radius) in pixels of the touched part, or None to "
      "look for it.\ncorrection: of colours for the place: 'none', 'background', 'fitted' lamps or the 'best'.\n"
      "slopes: read by a 'table', a 'network' or the 'best' on presses that were left out. gel_thickness_mm: says how "
      "far "
      "the gel sinks round a ball.\nFrames that can't be used are left out: report['left_out'] says which and why.");

  py::class_<HeightResult>(module, "HeightResult", "What one frame gives; arrays are its own memory.")
      .def_property_readonly(
          "height_mm", [](const HeightResult& self) { return array_of(self.height_mm); },
          "float32: pressed in is positive.")
      .def_property_readonly(
          "slope_u", [](const HeightResult& self) { return array_of(self.slope_u); },
          "float32: derivative of the height along u (right).")
      .def_property_readonly(
          "slope_v", [](const HeightResult& self) { return array_of(self.slope_v); }, "float32: along v (down).")
      .def_property_readonly(
          "contact", [](const HeightResult& self) { return bool_array_of(self.contact); },
          "bool: higher than floor and share of the highest point.")
      .def_readonly("contact_pixels", &HeightResult::contact_pixels, "In contact.")
      .def_readonly("saturated_share", &HeightResult::saturated_share, "Of the pixels.")
      .def_readonly("lost_share", &HeightResult::lost_share, "Of the pixels: two channels are at 255.")
      .def_readonly("dark_share", &HeightResult::dark_share, "Of the pixels.")
      .def_property_readonly(
          "gain", [](const HeightResult& self) { return py::make_tuple(self.gain[0], self.gain[1], self.gain[2]); },
          "(blue, green, red): what the frame's channels were stronger by than the background's.")
      .def_readonly("contact_at_border", &HeightResult::contact_at_border, "The contact runs out of the picture.")
      .def_readonly("rest_share", &HeightResult::rest_share, "Of the picture: as the gel at rest.")
      .def_property_readonly("trusted", &HeightResult::trusted,
                             "Neither overexposed nor dark nor of one colour, and somewhere as the gel at rest.");
  py::class_<Heights, std::shared_ptr<Heights>>(
      module, "HeightEstimator",
      "Frame in, height map out. HeightEstimator(model, *, border='zero', follow_frames=0); border 'free' where "
      "contacts "
      "run out of the picture. With follow_frames the picture of the gel at rest is followed as light drifts, where "
      "nothing touches, to 63 % within so many frames: a result then depends on the frames before it. Calls from "
      "several threads wait for each other.")
      .def(py::init(&make_estimator), py::arg("model"), py::kw_only(), py::arg("border") = "zero",
           py::arg("follow_frames") = 0.0)
      .def(
          "estimate",
          [](Heights& self, const py::object& frame) {
            const Picture picture = picture_from(frame, "frame");
            return self.with([&](auto& estimator) { return copy_of(estimator.estimate(picture.mat)); });
          },
          py::arg("frame"), "The HeightResult of a frame, uint8, BGR, of the model's size.")
      .def(
          "set_rest",
          [](Heights& self, const py::object& frames) {
            const std::vector<Picture> rest = pictures_from(frames, "frames");
            std::vector<cv::Mat> mats;
            for (const Picture& picture : rest) mats.push_back(picture.mat);
            self.with([&](auto& estimator) {
              estimator.set_rest(mats);
              return true;
            });
          },
          py::arg("frames"), "Takes frames of the gel at rest in place of the calibration's, as after a scratch.")
      .def(
          "doubts",
          [](Heights& self, const py::object& frame) {
            const Picture picture = picture_from(frame, "frame");
            return self.with([&](auto& estimator) { return array_of(estimator.doubts(picture.mat)); });
          },
          py::arg("frame"),
          "uint8: for each pixel the sum of 1 (one channel is at 255), 2 (two are, or all are 0), 4 (calibration has "
          "seen no colour like it), 8 (steeper than what it has seen).");
}

}  // namespace touchstone::python
