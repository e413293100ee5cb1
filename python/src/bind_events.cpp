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
#include "python/src/records.h"
#include "sensors/events/event_file.h"
#include "sensors/events/grasp_force_model_file.h"
#include "sensors/events/grasp_force_reader.h"
#include "sensors/events/grasp_training.h"
#include "sensors/events/known_grasp.h"
#include "sensors/events/material_classifier_file.h"

namespace touchstone::python {
namespace {

using sensors::GraspForceModel;
using sensors::MaterialClassifier;
using sensors::WindowForce;

constexpr std::int64_t kNotBegun = std::numeric_limits<std::int64_t>::min();

/// Records as Touch.events has them. @throws Error
std::vector<Event> events_from(const py::handle& value) {
  const py::array records =
      records_from(value, {"t_us", "x", "y", "on"},
                   "events: records with the fields t_us, x, y and on are needed, as Touch.events has them");
  const auto t_us = field_of<std::int64_t>(records, "events", "t_us");
  const auto x = field_of<std::int64_t>(records, "events", "x"), y = field_of<std::int64_t>(records, "events", "y");
  const auto on = field_of<bool>(records, "events", "on");
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

/// The grasp in all events of a recording. @param readings null: forces aren't known. @throws Error
sensors::KnownGrasp grasp_of(const std::vector<Event>& events, const cv::Size& size,
                             const sensors::ForceReadings* readings) {
  if (events.empty()) fail("events: there are none");
  return unlocked([&] {
    const sensors::EventWindowSettings settings{.start_us = events.front().t_us, .size = size};
    sensors::EventWindows windows(settings);
    windows.add(events);
    return sensors::known_grasp(windows.finished(), settings, readings, "readings");
  });
}

/// What a force sensor said: (t_us, force_N), each an array. @throws Error
sensors::ForceReadings readings_from(const py::handle& value) {
  const py::sequence both = sequence_from(value, "readings");
  if (both.size() != 2) fail("readings: of each grasp (t_us, force_N) is needed");
  sensors::ForceReadings readings;
  readings.force_N = row_from(both[1], "readings: force_N");
  const auto times = py::array::ensure(both[0]);
  if (!times || times.ndim() != 1 || (times.dtype().kind() != 'i' && times.dtype().kind() != 'u')) {
    PyErr_Clear();
    fail("readings: t_us must be an array of whole numbers");
  }
  if (times.size() != std::ssize(readings.force_N)) {
    fail("readings: {} times are given with {} forces", times.size(), readings.force_N.size());
  }
  const py::array_t<std::int64_t, py::array::c_style | py::array::forcecast> t_us(times);
  readings.t_us.assign(t_us.data(), t_us.data() + t_us.size());
  if (const std::string fault = fault_of(readings); !fault.empty()) fail("readings: {}", fault);
  return readings;
}

/// Calls `add(events, number)` for each grasp. @throws Error naming a grasp's number
template <typename Add>
std::size_t for_each_grasp(const py::object& grasps, const Add& add) {
  std::size_t number = 0;
  for_each_item(grasps, "grasps", [&](const py::object& one) {
    try {
      add(events_from(one), number);
    } catch (const Error& error) {
      fail("grasps: number {}: {}", number, error.what());
    }
    ++number;
  });
  return number;
}

std::vector<py::object> list_from(const py::object& value, const char* what) {
  std::vector<py::object> list;
  for_each_item(value, what, [&](const py::object& one) { list.push_back(one); });
  return list;
}

py::tuple train_force(const py::object& grasps, const py::object& readings, const py::object& size,
                      const py::object& method_name, const py::object& left_out, const py::object& hidden_layers,
                      const py::object& units, const py::object& threads) {
  const std::string method = text_from(method_name, "method");
  if (method != "process" && method != "network") {
    fail("method: '{}' is not known; allowed is one of: process, network", method);
  }
  sensors::GraspForceTraining training;
  if (method == "network") training.method = sensors::GraspForceMethod::network;
  training.left_out = whole_number_from<int>(left_out, "left_out", 0, 1000);
  training.network.hidden_layers = whole_number_from<int>(hidden_layers, "hidden_layers", 1, 8);
  training.network.units = whole_number_from<int>(units, "units", 1, 200);
  training.threads = whole_number_from<int>(threads, "threads", 0, 4096);
  const cv::Size camera = size_from(size);
  const std::vector<py::object> forces = list_from(readings, "readings");
  std::vector<sensors::KnownGrasp> known;
  const std::size_t count = for_each_grasp(grasps, [&](const std::vector<Event>& events, std::size_t number) {
    if (number >= forces.size()) fail("readings: {} are given, there are more grasps", forces.size());
    const sensors::ForceReadings of_grasp = readings_from(forces[number]);
    known.push_back(grasp_of(events, camera, &of_grasp));
  });
  if (count != forces.size()) fail("readings: {} are given, there are {} grasps", forces.size(), count);
  const sensors::GraspForceCalibration made = unlocked([&] { return sensors::calibrate_grasp_force(known, training); });
  py::dict report;
  report["windows"] = made.windows;
  report["left_out"] = made.left_out;
  report["left_out_error_N"] = made.model.error ? py::object(py::float_(made.model.error->left_out_N)) : py::none();
  report["within_two"] = made.within_two;
  return py::make_tuple(std::make_shared<GraspForceModel>(made.model), report);
}

py::tuple train_material(const py::object& grasps, const py::object& materials, const py::object& size,
                         const py::object& units, const py::object& threads) {
  sensors::MaterialClassifierSettings settings;
  settings.units = whole_number_from<int>(units, "units", 1, 200);
  const int at_once = whole_number_from<int>(threads, "threads", 0, 4096);
  const cv::Size camera = size_from(size);
  std::vector<std::string> names;
  for_each_item(materials, "materials", [&](const py::object& one) { names.push_back(text_from(one, "materials")); });
  std::vector<sensors::KnownGrasp> known;
  const std::size_t count = for_each_grasp(grasps, [&](const std::vector<Event>& events, std::size_t number) {
    if (number >= names.size()) fail("materials: {} are given, there are more grasps", names.size());
    if (names[number].empty()) fail("materials: number {} is empty", number);
    known.push_back(grasp_of(events, camera, nullptr));
    known.back().material = names[number];
  });
  if (count != names.size()) fail("materials: {} are given, there are {} grasps", names.size(), count);
  const sensors::GraspMaterialCalibration made =
      unlocked([&] { return sensors::calibrate_grasp_material(known, settings, at_once); });
  py::dict report;
  report["left_out_right"] = made.left_out.accuracy();
  return py::make_tuple(std::make_shared<MaterialClassifier>(made.model), report);
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
      module, "EventForceModel", "What `touchstone calibrate event-force` or train_event_force has learnt of grasps.")
      .def_static(
          "load",
          [](const py::object& path) {
            const std::string file = needed_path(path, "path");
            return unlocked([&] { return std::make_shared<GraspForceModel>(sensors::load_grasp_force_model(file)); });
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save",
          [](const GraspForceModel& self, const py::object& path) { sensors::save(self, needed_path(path, "path")); },
          py::arg("path"), "Writes it, whole or not at all.")
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
      module, "EventMaterialModel",
      "What `touchstone calibrate event-material` or train_event_material has learnt of grasps.")
      .def_static(
          "load",
          [](const py::object& path) {
            return std::make_shared<MaterialClassifier>(sensors::load_material_classifier(needed_path(path, "path")));
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save",
          [](const MaterialClassifier& self, const py::object& path) {
            sensors::save(self, needed_path(path, "path"));
          },
          py::arg("path"), "Writes it, whole or not at all.")
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
            const cv::Size camera = size_from(size);
            const sensors::GraspSequence grasp = grasp_of(list, camera, nullptr).sequence;
            const sensors::MaterialGuess guess =
                sensors::classify(self, sensors::grasp_features(grasp.counts, grasp.judged));
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
  const sensors::GraspForceTraining usual;
  module.def(
      "train_event_force", &train_force, py::arg("grasps"), py::arg("readings"), py::kw_only(), py::arg("size"),
      py::arg("method") = "process", py::arg("left_out") = usual.left_out,
      py::arg("hidden_layers") = usual.network.hidden_layers, py::arg("units") = usual.network.units,
      py::arg("threads") = 0,
      "Learns force from an event camera's grasps: returns (EventForceModel, report), as `touchstone calibrate "
      "event-force`.\n\n"
      "grasps: a list, of each all events in order of time: records of t_us, x, y, on; rest, touch, hold and "
      "release. readings: for each (t_us, force_N), what a force sensor said on the events' clock. size: of the "
      "camera, (width, height). method: 'process' (Gaussian, of counts and time) or 'network' (the published one, "
      "of hidden_layers with units each). left_out: so many grasps are each left out of a training of their own; "
      "their errors are those that are stated later. threads: 0: as many as the machine has.");
  module.def(
      "train_event_material", &train_material, py::arg("grasps"), py::arg("materials"), py::kw_only(), py::arg("size"),
      py::arg("units") = sensors::MaterialClassifierSettings{}.units, py::arg("threads") = 0,
      "Learns materials from an event camera's grasps: returns (EventMaterialModel, report), as `touchstone "
      "calibrate event-material`.\n\n"
      "grasps and size: as of train_event_force. materials: the name of each; three grasps or more of one. units: of "
      "the network, in each of its two hidden layers. The report's left_out_right is the share named right of "
      "grasps that were left out in turn.");
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
