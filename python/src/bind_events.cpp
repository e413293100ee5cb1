// Force and material from an event camera's grasps: sensors/events/grasp_force_reader.h, material_classifier.h.

#include <pybind11/stl.h>

#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "python/src/bindings.h"
#include "python/src/estimator.h"
#include "sensors/events/event_file.h"
#include "sensors/events/grasp_force_model_file.h"
#include "sensors/events/grasp_force_reader.h"
#include "sensors/events/grasp_sequence.h"
#include "sensors/events/material_classifier_file.h"

namespace touchstone::python {
namespace {

using sensors::GraspForceModel;
using sensors::MaterialClassifier;
using sensors::WindowForce;

constexpr std::int64_t kNotBegun = std::numeric_limits<std::int64_t>::min();

/// One field of records. @throws Error naming it
template <typename T>
py::array_t<T> field_of(const py::array& records, const char* field) {
  constexpr int kExact = py::array::c_style | py::array::forcecast;
  const py::array column = py::array::ensure(records[py::str(field)]);
  const char kind = column.dtype().kind();
  if (kind != 'i' && kind != 'u' && kind != 'b') fail("events: the field '{}' must be whole numbers", field);
  return py::array_t<T, kExact>(column);
}

/// Records as Touch.events has them. @throws Error
std::vector<Event> events_from(const py::handle& value) {
  const auto records = py::array::ensure(value);
  constexpr const char* kWanted =
      "events: records with the fields t_us, x, y and on are needed, as Touch.events has them";
  if (!records || records.ndim() != 1 || records.dtype().attr("names").is_none()) fail("{}", kWanted);
  for (const char* name : {"t_us", "x", "y", "on"}) {
    if (!records.dtype().attr("names").contains(py::str(name))) fail("{}", kWanted);
  }
  const auto t_us = field_of<std::int64_t>(records, "t_us");
  const auto x = field_of<std::int64_t>(records, "x"), y = field_of<std::int64_t>(records, "y");
  const auto on = field_of<bool>(records, "on");
  std::vector<Event> events(static_cast<std::size_t>(records.size()));
  constexpr std::int64_t kMost = std::numeric_limits<std::uint16_t>::max();
  for (py::ssize_t k = 0; k < records.size(); ++k) {
    if (x.at(k) < 0 || x.at(k) > kMost || y.at(k) < 0 || y.at(k) > kMost) {
      fail("events: number {} is at ({}, {}); places are from 0 to {}", k, x.at(k), y.at(k), kMost);
    }
    events[static_cast<std::size_t>(k)] = {t_us.at(k), static_cast<std::uint16_t>(x.at(k)),
                                           static_cast<std::uint16_t>(y.at(k)), on.at(k)};
  }
  return events;
}

cv::Size size_from(const py::handle& value) {
  const py::sequence both = sequence_from(value, "size");
  if (both.size() != 2) fail("size: (width, height) is needed");
  constexpr int kMost = 8192;
  return {whole_number_from<int>(both[0], "size", 1, kMost), whole_number_from<int>(both[1], "size", 1, kMost)};
}

/// A reader of one grasp, which begins with the first event that it's given.
class Reader {
 public:
  Reader(const GraspForceModel& model, const cv::Size& size) : model_(model), size_(size) { begin(kNotBegun); }

  void add(const std::vector<Event>& events) {
    if (events.empty()) return;
    if (!begun_) begin(events.front().t_us);
    reader_->add(events);
  }
  void end_at(std::int64_t t_us) {
    if (begun_) reader_->end_at(t_us);
  }
  void restart() { begin(kNotBegun); }
  std::vector<WindowForce> forces() const { return {reader_->forces().begin(), reader_->forces().end()}; }

 private:
  void begin(std::int64_t start_us) {
    begun_ = start_us != kNotBegun;
    reader_.emplace(model_, sensors::EventWindowSettings{.start_us = begun_ ? start_us : 0, .size = size_});
  }

  GraspForceModel model_;
  cv::Size size_;
  std::optional<sensors::GraspForceReader> reader_;
  bool begun_ = false;
};
using GuardedReader = Guarded<Reader>;

/// A column of the windows.
template <typename T, typename Value>
py::array column(const std::vector<WindowForce>& windows, const Value& value) {
  py::array_t<T> out(static_cast<py::ssize_t>(windows.size()));
  T* to = out.mutable_data();
  for (const WindowForce& window : windows) *to++ = value(window);
  return out;
}

void bind_force(py::module_& module) {
  py::class_<GraspForceModel, std::shared_ptr<GraspForceModel>>(
      module, "EventForceModel", "What `touchstone calibrate event-force` has learnt of grasps.")
      .def_static(
          "load",
          [](const py::object& path) {
            const std::string file = needed_path(path, "path");
            return unlocked([&] { return std::make_shared<GraspForceModel>(sensors::load_grasp_force_model(file)); });
          },
          py::arg("path"), "Reads a model file.")
      .def_property_readonly(
          "method",
          [](const GraspForceModel& self) {
            return std::holds_alternative<sensors::GaussianProcess>(self.estimator) ? "process" : "network";
          },
          "'process' or 'network'.")
      .def_property_readonly(
          "left_out_error_N",
          [](const GraspForceModel& self) { return self.error ? std::optional(self.error->left_out_N) : std::nullopt; },
          "Root mean square error on grasps that were left out of training; None if that wasn't tried.");
  py::class_<GuardedReader, std::shared_ptr<GuardedReader>>(
      module, "EventForceReader",
      "Force of a grasp from events as they come, every 7 ms. EventForceReader(model, *, size)\n\n"
      "size: of the camera, (width, height). Windows begin with the first event; for 140 ms the scene is at rest, then "
      "first touch is found. One reader reads one grasp.")
      .def(py::init([](const GraspForceModel& model, const py::object& size) {
             return std::make_shared<GuardedReader>(model, size_from(size));
           }),
           py::arg("model"), py::kw_only(), py::arg("size"))
      .def(
          "add",
          [](GuardedReader& self, const py::object& events) {
            const std::vector<Event> list = events_from(events);
            self.with([&](Reader& one) { return one.add(list), 0; });
          },
          py::arg("events"), "The next events, in order of time: records of t_us, x, y, on, as Touch.events.")
      .def(
          "end_at",
          [](GuardedReader& self, const py::object& t_us) {
            const auto time_us = whole_number_from(t_us, "t_us");
            self.with([&](Reader& one) { return one.end_at(time_us), 0; });
          },
          py::arg("t_us"), "No event before this time is to come: windows until then are over.")
      .def(
          "restart", [](GuardedReader& self) { self.with([](Reader& one) { return one.restart(), 0; }); },
          "Forgets all events: the next ones are another grasp's.")
      .def_property_readonly(
          "t_us",
          [](GuardedReader& self) {
            return column<std::int64_t>(self.with([](Reader& one) { return one.forces(); }),
                                        [](const WindowForce& window) { return window.end_us; });
          },
          "(windows,): the end of each window that is over.")
      .def_property_readonly(
          "force_N",
          [](GuardedReader& self) {
            return column<double>(self.with([](Reader& one) { return one.forces(); }),
                                  [](const WindowForce& window) { return window.force_N; });
          },
          "(windows,): 0 before the touch.")
      .def_property_readonly(
          "force_error_N",
          [](GuardedReader& self) {
            return column<double>(self.with([](Reader& one) { return one.forces(); }), [](const WindowForce& window) {
              return window.sigma_N.value_or(std::numeric_limits<double>::quiet_NaN());
            });
          },
          "(windows,): standard errors; NaN before the touch, and of a network that was tried on no other grasp.")
      .def_property_readonly(
          "touched",
          [](GuardedReader& self) {
            return column<bool>(self.with([](Reader& one) { return one.forces(); }),
                                [](const WindowForce& window) { return window.touched; });
          },
          "(windows,) bool: first touch's window or a later one.")
      .def_property_readonly(
          "extrapolated",
          [](GuardedReader& self) {
            return column<bool>(self.with([](Reader& one) { return one.forces(); }),
                                [](const WindowForce& window) { return window.extrapolates; });
          },
          "(windows,) bool: more events, or longer in touch, than in training.");
}

void bind_material(py::module_& module) {
  py::class_<MaterialClassifier, std::shared_ptr<MaterialClassifier>>(
      module, "EventMaterialModel", "What `touchstone calibrate event-material` has learnt of grasps.")
      .def_static(
          "load",
          [](const py::object& path) {
            return std::make_shared<MaterialClassifier>(sensors::load_material_classifier(needed_path(path, "path")));
          },
          py::arg("path"), "Reads a model file.")
      .def_property_readonly(
          "materials",
          [](const MaterialClassifier& self) {
            py::list names;
            for (const std::string& name : self.materials) names.append(text_of(name));
            return names;
          },
          "Their names.")
      .def(
          "classify",
          [](const MaterialClassifier& self, const py::object& events, const py::object& size) {
            const std::vector<Event> list = events_from(events);
            if (list.empty()) fail("events: there are none");
            const cv::Size camera = size_from(size);
            const sensors::MaterialGuess guess = unlocked([&] {
              sensors::EventWindows windows({.start_us = list.front().t_us, .size = camera});
              windows.add(list);
              const sensors::GraspSequence grasp =
                  sensors::grasp_sequence(windows.finished(), sensors::find_grasp_phases(windows.finished()));
              return sensors::classify(self, sensors::grasp_features(grasp.counts, grasp.judged));
            });
            return small_array(guess.probabilities);
          },
          py::arg("events"), py::kw_only(), py::arg("size"),
          "(materials,): the probability of each, of a whole grasp's events: rest, touch, hold and release. size: of "
          "the "
          "camera, (width, height).");
}

}  // namespace

void bind_events(py::module_& module) {
  bind_force(module);
  bind_material(module);
  module.def(
      "read_events",
      [](const py::object& path, const py::object& size) {
        sensors::EventReadOptions options;
        if (!size.is_none()) options.size = size_from(size);
        const std::string file = needed_path(path, "path");
        return events_array(unlocked([&] {
          static std::mutex one_at_a_time;  // HDF5's library has one state for all
          const std::lock_guard<std::mutex> lock(one_at_a_time);
          return sensors::read_events(file, options).events;
        }));
      },
      py::arg("path"), py::kw_only(), py::arg("size") = py::none(),
      "All events of a file (text, HDF5 as of DSEC, EVT 3.0, AEDAT 4.0) as records of t_us, x, y, on. size: of the "
      "camera, "
      "(width, height), where the file doesn't say it.");
}

}  // namespace touchstone::python
