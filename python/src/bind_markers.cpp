// Printed markers in any layout: sensors/markers/marker_tracker.h.

#include <limits>

#include "python/src/bindings.h"
#include "python/src/estimator.h"
#include "python/src/frame_clock.h"
#include "sensors/markers/marker_tracker.h"

namespace touchstone::python {
namespace {

using sensors::MarkerAppearance;
using sensors::TrackedMarkers;

/// A tracker that has seen the gel at rest, and its clock.
struct Follower {
  explicit Follower(const cv::Mat& rest) { begin(rest); }

  void begin(const cv::Mat& rest) {
    sensors::MarkerTracker fresh({});
    fresh.track({rest, std::numeric_limits<std::int64_t>::min()});  // before any frame, whatever clock they have
    tracker = std::move(fresh);                                     // only if the picture is taken
    clock = {};
  }

  TrackedMarkers track(const cv::Mat& frame, const std::optional<std::int64_t>& t_us) {
    const std::int64_t now_us = clock.time_of_next(t_us);
    const TrackedMarkers& markers = tracker.track({frame, now_us});
    clock.note(now_us);
    return markers;
  }

  sensors::MarkerTracker tracker{{}};
  FrameClock clock;
};
using Tracker = Guarded<Follower>;

py::array trusted(const TrackedMarkers& markers) {
  py::array_t<bool> out(static_cast<py::ssize_t>(markers.rest.size()));
  bool* to = out.mutable_data();
  for (std::size_t i = 0; i < markers.rest.size(); ++i) *to++ = markers.trusted(i);
  return out;
}

py::array displacements(const TrackedMarkers& markers) {
  std::vector<Eigen::Vector2d> rows;
  for (std::size_t i = 0; i < markers.rest.size(); ++i) rows.push_back(markers.displacement(i));
  return points_array(rows);
}

MarkerAppearance appearance_of(Tracker& self) {
  return self.with([](Follower& one) { return one.tracker.appearance().value(); });
}

}  // namespace

void bind_markers(py::module_& module) {
  py::class_<TrackedMarkers>(module, "TrackedMarkers",
                             "What was found in one frame; markers in the order in which the frame at rest shows them, "
                             "by rows.")
      .def_readonly("t_us", &TrackedMarkers::t_us, "The frame's time.")
      .def_property_readonly(
          "rest_px", [](const TrackedMarkers& self) { return points_array(self.rest); },
          "(markers, 2): x, y in the frame at rest; pixel centres are at + 0.5.")
      .def_property_readonly(
          "positions_px", [](const TrackedMarkers& self) { return points_array(self.positions); },
          "(markers, 2): measured, or where it isn't trusted, held where the neighbours carry it.")
      .def_property_readonly("displacement_px", &displacements, "(markers, 2): positions_px less rest_px.")
      .def_property_readonly("trusted", &trusted,
                             "(markers,) bool: measured in this frame, and surely the same marker.")
      .def_property_readonly(
          "status",
          [](const TrackedMarkers& self) {
            py::list names;
            for (const sensors::MarkerStatus status : self.status) {
              names.append(sensors::name_of(status));
            }
            return names;
          },
          "Of each marker: 'found', 'found again', 'hidden', 'merged', 'at border', 'too far', 'stray'.")
      .def_property_readonly("found", &TrackedMarkers::found, "Markers measured in this frame.")
      .def_readonly("jumped", &TrackedMarkers::jumped,
                    "Markers went farther than can be followed: until the gel is at rest again none is trusted.")
      .def_readonly(
          "rest_was_touched", &TrackedMarkers::rest_was_touched,
          "This frame or one before has shown that the gel was touched in the frame at rest, so displacements "
          "are from no rest. Known where markers lie in rows.")
      .def_property_readonly(
          "light", [](const TrackedMarkers& self) { return sensors::name_of(self.light); },
          "Of the frame: 'normal', 'dark', 'saturated' or 'flat'; only in a normal one markers are measured.");
  py::class_<Tracker, std::shared_ptr<Tracker>>(
      module, "MarkerTracker",
      "Follows printed markers in any layout, dark or bright, from frame to frame. MarkerTracker(rest)\n\n"
      "rest: a picture of the untouched gel, uint8, (height, width) or (height, width, 3). How large markers are, how "
      "far apart and whether they are dark or bright is read from it. At least 4 are needed.")
      .def(py::init([](const py::object& rest) {
             const Picture picture = picture_from(rest, "rest");
             return unlocked([&] { return std::make_shared<Tracker>(picture.mat); });
           }),
           py::arg("rest"))
      .def(
          "track",
          [](Tracker& self, const py::object& frame, const py::object& t_us) {
            const Picture picture = picture_from(frame, "frame");
            std::optional<std::int64_t> time_us;
            if (!t_us.is_none()) time_us = whole_number_from(t_us, "t_us");
            return self.with([&](Follower& one) { return one.track(picture.mat, time_us); });
          },
          py::arg("frame"), py::arg("t_us") = py::none(),
          "The next frame, of the size of the one at rest: TrackedMarkers.\n\nt_us: its time, later than the last "
          "one's; None: frames come at equal intervals. With times a dropped frame is bridged better.")
      .def(
          "restart",
          [](Tracker& self, const py::object& rest) {
            const Picture picture = picture_from(rest, "rest");
            self.with([&](Follower& one) { return one.begin(picture.mat), 0; });
          },
          py::arg("rest"), "Forgets all frames; rest is a new picture of the untouched gel, of any size.")
      .def_property_readonly(
          "rest_px",
          [](Tracker& self) {
            return points_array(self.with([](Follower& one) { return one.tracker.tracked().rest; }));
          },
          "(markers, 2): x, y in the frame at rest.")
      .def_property_readonly(
          "polarity", [](Tracker& self) { return sensors::name_of(appearance_of(self).polarity); },
          "'dark' or 'bright', against the gel between them.")
      .def_property_readonly(
          "diameter_px", [](Tracker& self) { return appearance_of(self).diameter_px; }, "Of a usual marker.")
      .def_property_readonly(
          "spacing_px", [](Tracker& self) { return self.with([](Follower& one) { return one.tracker.spacing_px(); }); },
          "Median distance of a marker to its nearest neighbour.");
}

}  // namespace touchstone::python
