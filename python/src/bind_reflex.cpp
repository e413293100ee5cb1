// A fingertip on a motion chip: its registers (sensors/reflex/reflex_loop.h) and pictures of its dots
// (sensors/reflex/explore_tracker.h).

#include <pybind11/stl.h>

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "python/src/bindings.h"
#include "python/src/estimator.h"
#include "python/src/frame_clock.h"
#include "python/src/records.h"
#include "sensors/reflex/explore_tracker.h"
#include "sensors/reflex/explore_training.h"
#include "sensors/reflex/reflex_loop.h"
#include "sensors/reflex/reflex_training.h"

namespace touchstone::python {
namespace {

using sensors::ExploreModel;
using sensors::ExploreReading;
using sensors::ReflexDecision;
using sensors::ReflexModel;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Forces on the object: (n, 3), or (n,) along z where shear isn't known.
struct GivenForces {
  std::vector<double> normal_N;
  std::vector<Eigen::Vector2d> shear_N;  ///< as many, or none

  std::optional<Eigen::Vector2d> shear(std::size_t at) const {
    return shear_N.empty() ? std::nullopt : std::optional(shear_N[at]);
  }
};
GivenForces forces_from(const py::handle& value) {
  GivenForces forces;
  const auto array = py::array::ensure(value);
  if (!array) PyErr_Clear();
  if (array && array.ndim() == 1) {
    forces.normal_N = row_from(value, "forces_N");
    return forces;
  }
  for (const Eigen::Vector3d& force : points3_from(value, "forces_N")) {
    forces.normal_N.push_back(force.z());
    forces.shear_N.emplace_back(force.head<2>());
  }
  return forces;
}

// ---- reflex mode ----

/// One frame's: a dict, or a record of an array. @throws Error
ChipStatistics statistics_from(const py::handle& value) {
  const auto item = [&](const char* name) -> py::object {
    try {
      return value[py::str(name)];
    } catch (const py::error_already_set&) {
      fail("statistics: '{}' is missing; a dict or a record of dx, dy, squal, maximum, minimum and average is needed",
           name);
    }
  };
  const auto whole = [&](const char* name) {
    return whole_number_from<int>(item(name), std::string("statistics: ") + name);
  };
  ChipStatistics statistics;
  statistics.dx = whole("dx");
  statistics.dy = whole("dy");
  statistics.squal = whole("squal");
  statistics.maximum = whole("maximum");
  statistics.minimum = whole("minimum");
  statistics.average = number_from(item("average"), "statistics: average");
  return statistics;
}

/// A recording with the force of each of its frames. @throws Error
sensors::ReflexRecording recording_from(const py::handle& value, const py::handle& forces_N, double contact_N) {
  constexpr const char* kWhat = "recordings";
  const py::array records =
      records_from(value, {"dx", "dy", "squal", "maximum", "minimum", "average"},
                   "recordings: each must be records with the fields dx, dy, squal, maximum, minimum and average");
  const auto column = [&](const char* name) { return field_of<int>(records, kWhat, name); };
  const auto dx = column("dx"), dy = column("dy"), squal = column("squal");
  const auto maximum = column("maximum"), minimum = column("minimum");
  const auto average = field_of<double>(records, kWhat, "average", "fiub");
  const GivenForces forces = forces_from(forces_N);
  if (std::ssize(forces.normal_N) != records.size()) {
    fail("forces_N: {} are given for a recording of {} frames", forces.normal_N.size(), records.size());
  }
  sensors::ReflexRecording recording(forces.normal_N.size());
  for (py::ssize_t i = 0; i < records.size(); ++i) {
    sensors::ReflexSample& sample = recording[static_cast<std::size_t>(i)];
    sample.statistics = {.dx = dx.at(i),
                         .dy = dy.at(i),
                         .maximum = maximum.at(i),
                         .minimum = minimum.at(i),
                         .squal = squal.at(i),
                         .average = average.at(i)};
    sample.normal_N = forces.normal_N[static_cast<std::size_t>(i)];
    sample.contact = sample.normal_N > contact_N;
    sample.shear_N = forces.shear(static_cast<std::size_t>(i));
  }
  return recording;
}

py::dict dict_of(const sensors::ReflexErrors& errors) {
  py::dict dict;
  dict["frames"] = errors.samples;
  dict["missed"] = errors.missed;
  dict["false_alarms"] = errors.alarms;
  dict["rms_error_N"] = errors.rms_N;
  dict["shear_rms_error_N"] = errors.shear_rms_N.value_or(kUnknown);
  return dict;
}

py::tuple calibrate_reflex(const py::object& recordings, const py::object& forces_N, const py::object& contact_N,
                           const py::object& degree) {
  const double contact = number_from(contact_N, "contact_N");
  if (!(contact >= 0.0) || !std::isfinite(contact))
    fail("contact_N: {} is not allowed; allowed is 0 and more", contact);
  std::vector<py::object> forces;
  for_each_item(forces_N, "forces_N", [&](const py::object& one) { forces.push_back(one); });
  std::vector<sensors::ReflexRecording> given;
  for_each_item(recordings, "recordings", [&](const py::object& one) {
    if (given.size() == forces.size())
      fail("forces_N: there are more recordings than the {} that have forces", forces.size());
    given.push_back(recording_from(one, forces[given.size()], contact));
  });
  if (given.size() != forces.size()) {
    fail("forces_N: are given for {} recordings, there are {}", forces.size(), given.size());
  }
  sensors::ReflexTraining training;
  training.degree = whole_number_from<int>(degree, "degree");
  std::optional<sensors::ReflexErrors> left_out;
  sensors::ReflexErrors fitted;
  const sensors::TrainedReflex made = unlocked([&] {
    sensors::TrainedReflex trained = sensors::train_reflex(given, training);
    fitted = sensors::test_reflex(trained.model, given);
    left_out = sensors::cross_validate_reflex(given, training);
    return trained;
  });
  py::dict report;
  report["frames"] = made.samples;
  report["contacts"] = made.contacts;
  report["fitted"] = dict_of(fitted);
  report["left_out"] = left_out ? py::object(dict_of(*left_out)) : py::none();
  report["no_shear"] = text_of(made.no_shear);
  return py::make_tuple(std::make_shared<ReflexModel>(made.model), report);
}

using Loop = Guarded<sensors::ReflexLoop>;

/// A decision, and whether its model knows shear.
struct ReadRegisters {
  ReflexDecision decision;
  bool shear = false;
};
struct RegisterReader {
  RegisterReader(const ReflexModel& model, const sensors::ReflexSettings& settings)
      : shear(model.shear.has_value()), loop(model, settings) {}
  bool shear;
  Loop loop;
};

void bind_registers(py::module_& module) {
  py::class_<ReflexModel, std::shared_ptr<ReflexModel>>(
      module, "ReflexModel", "Contact, force and shear by a motion chip's statistics; see calibrate_reflex.")
      .def_static(
          "load",
          [](const py::object& path) {
            return std::make_shared<ReflexModel>(sensors::load_reflex_model(needed_path(path, "path")));
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save",
          [](const ReflexModel& self, const py::object& path) { sensors::save(self, needed_path(path, "path")); },
          py::arg("path"), "Writes it, whole or not at all.")
      .def_property_readonly(
          "rule", [](const ReflexModel& self) { return sensors::rule_of(self.tree); },
          "When a force is present: 'MAX > 40 or (MAX > 38 and SQ < 82)'.")
      .def_property_readonly(
          "degree", [](const ReflexModel& self) { return self.force.degree; },
          "Of the normal force in the statistics: 1 or 2.")
      .def_property_readonly(
          "knows_shear", [](const ReflexModel& self) { return self.shear.has_value(); }, "It has a law for shear.");
  py::class_<ReadRegisters>(module, "ReflexReading", "What one frame's statistics lead to.")
      .def_property_readonly(
          "fault", [](const ReadRegisters& self) { return sensors::name_of(self.decision.fault); },
          "'none', or why they can't be believed: 'impossible statistics', 'dark', 'saturated', 'flat', 'no features'. "
          "Force and contact are then those of the last frame that could be.")
      .def_property_readonly(
          "force_present", [](const ReadRegisters& self) { return self.decision.force_present; }, "Something presses.")
      .def_property_readonly(
          "force_N",
          [](const ReadRegisters& self) {
            Eigen::Vector3d force(kUnknown, kUnknown, self.decision.force_N);
            if (self.shear) force.head<2>() = self.decision.shear_N;
            return small_array(force);
          },
          "(3,): in the axes of the calibration's forces; NaN along x and y without a law for shear.")
      .def_property_readonly(
          "stop", [](const ReadRegisters& self) { return self.decision.stop; },
          "To the actuator; it stays until restart().");
  py::class_<RegisterReader, std::shared_ptr<RegisterReader>>(
      module, "ReflexReader",
      "Each frame's statistics to a decision. ReflexReader(model, *, stop_above_N=0, stop_frames=1, release_frames=15, "
      "stop_when_blind=True, blind_frames=3)\n\n"
      "stop_above_N: 0: any force that is seen stops, after stop_frames in a row. release_frames: after so many frames "
      "without force shear is summed anew. stop_when_blind: so do blind_frames in a row that can't be believed.")
      .def(py::init([](const ReflexModel& model, const py::object& stop_above_N, const py::object& stop_frames,
                       const py::object& release_frames, bool stop_when_blind, const py::object& blind_frames) {
             sensors::ReflexSettings settings;
             settings.stop_above_N = number_from(stop_above_N, "stop_above_N");
             settings.stop_frames = whole_number_from<int>(stop_frames, "stop_frames");
             settings.release_frames = whole_number_from<int>(release_frames, "release_frames");
             settings.stop_when_blind = stop_when_blind;
             settings.blind_frames = whole_number_from<int>(blind_frames, "blind_frames");
             return std::make_shared<RegisterReader>(model, settings);
           }),
           py::arg("model"), py::kw_only(), py::arg("stop_above_N") = 0.0, py::arg("stop_frames") = 1,
           py::arg("release_frames") = 15, py::arg("stop_when_blind") = true, py::arg("blind_frames") = 3)
      .def(
          "read",
          [](RegisterReader& self, const py::object& statistics) {
            const ChipStatistics frame = statistics_from(statistics);
            return ReadRegisters{self.loop.with([&](sensors::ReflexLoop& one) { return one.next(frame); }), self.shear};
          },
          py::arg("statistics"),
          "The next frame's: ReflexReading. statistics: a dict as Touch.statistics, or a record, of dx, dy, squal, "
          "maximum, minimum and average.")
      .def(
          "restart",
          [](RegisterReader& self) { self.loop.with([](sensors::ReflexLoop& one) { return one.reset(), 0; }); },
          "Lets the actuator move again; shear is summed from here.");
  module.def(
      "calibrate_reflex", &calibrate_reflex, py::arg("recordings"), py::arg("forces_N"), py::kw_only(),
      py::arg("contact_N") = 0.02, py::arg("degree") = 1,
      "Learns contact, force and shear from registers with known forces: returns (ReflexModel, report).\n\n"
      "recordings: a list, of each recording its frames one after the other: records with the fields dx, dy, "
      "squal, maximum, minimum and average. forces_N: for each an array (frames, 3), on the object, or (frames,), "
      "along z alone. contact_N: above it something presses. degree: 1, force is linear in the "
      "statistics, or 2, with their products. Frames that can't be believed (dark, saturated, ...) are left out. "
      "The report has the errors on these frames, and on recordings left out in turn.");
}

// ---- explore mode ----

/// A tracker that has seen the fingertip at rest, and its clock.
struct DotFollower {
  DotFollower(const cv::Mat& rest, const sensors::ExploreSettings& with) : settings(with), tracker(rest, with) {}

  ExploreReading track(const cv::Mat& frame, const std::optional<std::int64_t>& t_us) {
    if (!t_us && !settings.times.empty()) fail("t_us: with pixel_rate_Hz it must be given");
    const std::int64_t now_us = clock.time_of_next(t_us);
    const ExploreReading reading = tracker.next({frame, now_us});
    clock.note(now_us);
    return reading;
  }
  void restart(const cv::Mat& rest) {
    tracker = sensors::ExploreTracker(rest, settings);
    clock = {};
  }

  sensors::ExploreSettings settings;
  sensors::ExploreTracker tracker;
  FrameClock clock;
};
using DotTracker = Guarded<DotFollower>;

/// One picture, or the mean of several. @throws Error
cv::Mat rest_from(const py::object& value) {
  const bool several = py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value);
  const std::vector<Picture> pictures =
      several ? pictures_from(value, "rest") : std::vector<Picture>{picture_from(value, "rest")};
  if (pictures.empty()) fail("rest: there is no picture");
  cv::Mat sum;
  for (const Picture& picture : pictures) {
    if (picture.mat.type() != CV_8UC1) fail("rest: pictures of uint8, (height, width), are needed");
    if (sum.empty()) sum = cv::Mat::zeros(picture.mat.size(), CV_32FC1);
    if (picture.mat.size() != sum.size()) fail("rest: pictures of one size are needed");
    cv::Mat numbers;
    picture.mat.convertTo(numbers, CV_32F);
    sum += numbers;
  }
  return sum / static_cast<double>(pictures.size());
}

void require_count(const char* what, std::size_t given, std::size_t readings) {
  if (given != readings) fail("{}: {} are given, there are {} readings", what, given, readings);
}

py::dict dict_of(const sensors::ExploreErrors& errors) {
  py::dict dict;
  dict["readings"] = errors.samples;
  dict["press_rms_error_mm"] = errors.press_rms_mm;
  dict["rms_error_N"] = errors.normal_rms_N;
  dict["shear_rms_error_N"] = errors.shear_rms_N.value_or(kUnknown);
  return dict;
}

py::tuple calibrate_explore(const py::object& readings, const py::object& press_mm, const py::object& forces_N,
                            const py::object& lateral_mm, const py::object& series, const py::object& terms) {
  const std::vector<double> presses = row_from(press_mm, "press_mm");
  const GivenForces forces = forces_from(forces_N);
  std::vector<Eigen::Vector2d> lateral;
  if (!lateral_mm.is_none()) lateral = points2_from(lateral_mm, "lateral_mm");
  std::vector<int> numbers;
  if (!series.is_none()) {
    for_each_item(series, "series",
                  [&](const py::object& one) { numbers.push_back(whole_number_from<int>(one, "series")); });
  }
  std::vector<ExploreReading> seen;
  for_each_item(readings, "readings", [&](const py::object& one) {
    if (!py::isinstance<ExploreReading>(one)) fail("readings: number {} isn't an ExploreReading", seen.size());
    seen.push_back(one.cast<ExploreReading>());
  });
  require_count("press_mm", presses.size(), seen.size());
  require_count("forces_N", forces.normal_N.size(), seen.size());
  if (!lateral_mm.is_none()) require_count("lateral_mm", lateral.size(), seen.size());
  if (!series.is_none()) require_count("series", numbers.size(), seen.size());
  std::vector<sensors::ExploreSample> samples;
  std::map<int, std::vector<sensors::ExploreSample>> by_series;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i].mode == sensors::ExploreMode::held) continue;
    sensors::ExploreSample sample{seen[i].motion, presses[i], forces.normal_N[i]};
    if (!lateral.empty()) sample.lateral_mm = lateral[i];
    sample.shear_N = forces.shear(i);
    samples.push_back(sample);
    if (!numbers.empty()) by_series[numbers[i]].push_back(sample);
  }
  const int how = whole_number_from<int>(terms, "terms");
  sensors::ExploreErrors fitted;
  std::optional<sensors::ExploreErrors> left_out;
  const sensors::TrainedExplore made = unlocked([&] {
    sensors::TrainedExplore trained = sensors::train_explore(samples, how);
    fitted = sensors::test_explore(trained.model, samples);
    std::vector<std::vector<sensors::ExploreSample>> sequences;
    for (auto& [number, sequence] : by_series) sequences.push_back(std::move(sequence));
    left_out = sensors::cross_validate_explore(sequences, how);
    return trained;
  });
  py::dict report;
  report["fitted"] = dict_of(fitted);
  report["left_out"] = left_out ? py::object(dict_of(*left_out)) : py::none();
  report["no_shear"] = text_of(made.no_shear);
  return py::make_tuple(std::make_shared<ExploreModel>(made.model), report);
}

/// Force of a reading, and whether its model knows what goes sideways.
struct ReadForce {
  sensors::ExploreForce force;
  bool shear = false;
};

void bind_pictures(py::module_& module) {
  py::class_<ExploreReading>(module, "ExploreReading", "How the dots have moved since rest, in one picture.")
      .def_readonly("t_us", &ExploreReading::t_us, "What the motion is of: the mean of the pixels' times.")
      .def_property_readonly(
          "mode", [](const ExploreReading& self) { return sensors::name_of(self.mode); },
          "'absolute' (against rest: no drift), 'relative' (a step from an earlier picture) or 'held' (the last "
          "motion, "
          "since nothing could be measured).")
      .def_property_readonly(
          "fault", [](const ExploreReading& self) { return sensors::name_of(self.fault); },
          "Why it is held, else 'none'.")
      .def_property_readonly(
          "dilation", [](const ExploreReading& self) { return self.motion.dilation; },
          "A dot at x goes to dilation x + shift_px, px from the picture's middle.")
      .def_property_readonly(
          "shift_px", [](const ExploreReading& self) { return small_array(self.motion.shift_px); },
          "(2,): along columns and rows.")
      .def_readonly("correlation", &ExploreReading::correlation, "With the picture at rest, at the best motion found.")
      .def_readonly("overlap", &ExploreReading::overlap, "The part of the picture at rest that is in view there.");
  py::class_<DotTracker, std::shared_ptr<DotTracker>>(
      module, "ExploreTracker",
      "Follows the dots of a fingertip from picture to picture. ExploreTracker(rest, *, white=63, "
      "pixel_rate_Hz=None)\n\n"
      "rest: a picture of the fingertip untouched, uint8, (height, width), or a list of them: their mean is taken. "
      "white: the largest number of a pixel. pixel_rate_Hz: 18 x 18 pixels came one after the other, so many a second, "
      "in the order of the ADNS-2620.")
      .def(py::init([](const py::object& rest, const py::object& white, const py::object& pixel_rate_Hz) {
             const cv::Mat untouched = rest_from(rest);
             sensors::ExploreSettings settings;
             settings.white = number_from(white, "white");
             if (!pixel_rate_Hz.is_none()) {
               const double rate_Hz = number_from(pixel_rate_Hz, "pixel_rate_Hz");
               if (!(rate_Hz > 0.0) || !std::isfinite(rate_Hz)) {
                 fail("pixel_rate_Hz: {} is not allowed; it must be above 0 and finite", rate_Hz);
               }
               settings.times = sensors::chip_pixel_times(1.0 / rate_Hz);
             }
             return unlocked([&] { return std::make_shared<DotTracker>(untouched, settings); });
           }),
           py::arg("rest"), py::kw_only(), py::arg("white") = 63.0, py::arg("pixel_rate_Hz") = py::none())
      .def(
          "track",
          [](DotTracker& self, const py::object& frame, const py::object& t_us) {
            const Picture picture = picture_from(frame, "frame");
            std::optional<std::int64_t> time_us;
            if (!t_us.is_none()) time_us = whole_number_from(t_us, "t_us");
            return self.with([&](DotFollower& one) { return one.track(picture.mat, time_us); });
          },
          py::arg("frame"), py::arg("t_us") = py::none(),
          "The next picture: ExploreReading. t_us: of its first pixel, later than the last one's; None: pictures come "
          "at "
          "equal intervals.")
      .def(
          "restart",
          [](DotTracker& self, const py::object& rest) {
            const cv::Mat untouched = rest_from(rest);
            self.with([&](DotFollower& one) { return one.restart(untouched), 0; });
          },
          py::arg("rest"), "Forgets all pictures; rest as of the constructor.");
  py::class_<ReadForce>(module, "ExploreForce", "Press and forces of one picture.")
      .def_property_readonly(
          "press_mm", [](const ReadForce& self) { return self.force.press_mm; }, "Beyond the first touch.")
      .def_property_readonly(
          "force_N",
          [](const ReadForce& self) {
            Eigen::Vector3d force(kUnknown, kUnknown, self.force.force_N);
            if (self.shear) force.head<2>() = self.force.shear_N;
            return small_array(force);
          },
          "(3,): in the axes of the calibration's forces; NaN along x and y without a law for shear.")
      .def_property_readonly(
          "lateral_mm",
          [](const ReadForce& self) {
            return small_array(self.shear ? self.force.lateral_mm
                                          : Eigen::Vector2d(Eigen::Vector2d::Constant(kUnknown)));
          },
          "(2,): how far the skin went sideways; likewise.");
  py::class_<ExploreModel, std::shared_ptr<ExploreModel>>(
      module, "ExploreModel", "Press, force and shear by the motion of a fingertip's dots; see calibrate_explore.")
      .def_static(
          "load",
          [](const py::object& path) {
            return std::make_shared<ExploreModel>(sensors::load_explore_model(needed_path(path, "path")));
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save",
          [](const ExploreModel& self, const py::object& path) { sensors::save(self, needed_path(path, "path")); },
          py::arg("path"), "Writes it, whole or not at all.")
      .def_property_readonly(
          "knows_shear", [](const ExploreModel& self) { return self.shear.has_value(); }, "It has a law for shear.")
      .def(
          "estimate",
          [](const ExploreModel& self, const ExploreReading& reading) {
            return ReadForce{sensors::estimate(self, reading.motion), self.shear.has_value()};
          },
          py::arg("reading"), "The ExploreForce of a reading.");
  module.def("calibrate_explore", &calibrate_explore, py::arg("readings"), py::arg("press_mm"), py::arg("forces_N"),
             py::kw_only(), py::arg("lateral_mm") = py::none(), py::arg("series") = py::none(), py::arg("terms") = 3,
             "Learns press, force and shear from readings of known presses: returns (ExploreModel, report).\n\n"
             "press_mm: beyond the first touch, 0 or less without contact. forces_N: (readings, 3), on the object, "
             "or (readings,), along z alone. lateral_mm: (readings, 2), how far the object went sideways while it "
             "stuck; for shear. series: a number each, alike for readings of one press; errors are then also found on "
             "series left out. terms: of the law from dilation to press, 1 (as published) to 3. Held readings have no "
             "say.");
}

}  // namespace

void bind_reflex(py::module_& module) {
  bind_registers(module);
  bind_pictures(module);
}

}  // namespace touchstone::python
