#include <fmt/format.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/nearest_name.h"
#include "core/transform.h"
#include "core/units.h"
#include "datasets/jobs/scenes_folder.h"
#include "python/src/bindings.h"
#include "python/src/named_objects.h"
#include "python/src/sensor.h"
#include "sim/press/first_touch.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/object.h"

namespace touchstone::python {
namespace {

namespace fs = std::filesystem;

constexpr double kLongestWatch_s = 100.0;   // event pixels fire without end, even if nothing moves
constexpr double kLongestShear_mm = 100.0;  // friction's history is stepped in fifths of a mm

/// The file of this name, or the shipped one: "gelsight-flat" is scenes/devices/gelsight-flat.yaml.
fs::path named_file(const std::string& name, const char* folder) {
  const fs::path given(name);
  std::error_code ignored;
  if (given.has_parent_path() || fs::exists(given, ignored)) return given;
  const fs::path shipped = datasets::scenes_folder() / folder;
  const fs::path file = shipped / (name + ".yaml");
  if (fs::exists(file, ignored)) return file;
  // "ball.yaml" is a file that isn't there; "cylinder-8.4mm" a name.
  const std::string extension = given.extension().string();
  if (extension.size() > 1 && !(extension[1] >= '0' && extension[1] <= '9')) return given;
  std::vector<std::string> known;
  for (const auto& entry : fs::directory_iterator(shipped, ignored)) {
    if (entry.path().extension() == ".yaml") known.push_back(entry.path().stem().string());
  }
  std::sort(known.begin(), known.end());
  fail("'{}' is neither a file nor one of the shipped {}{}; there are: {}", name, folder, did_you_mean(name, known),
       fmt::join(known, ", "));
}

/// What stands for a value that JSON doesn't know: of NumPy's numbers and arrays and of other libraries' plain ones, of
/// a path its name. @throws py::type_error for any other
py::object plain_value(const py::object& value) {
  if (py::hasattr(value, "tolist")) return value.attr("tolist")();
  if (py::hasattr(value, "__fspath__")) return py::module_::import("os").attr("fsdecode")(value);
  if (PyIndex_Check(value.ptr()) != 0) return py::module_::import("operator").attr("index")(value);
  if (py::hasattr(value, "__float__")) return py::float_(value);
  throw py::type_error("a value of " + std::string(py::str(py::type::of(value))) + " isn't one that a file may have");
}

/// A dict as text. @throws Error for what isn't of JSON's types
std::string json_of(const py::handle& value) {
  try {
    const py::object dumps = py::module_::import("json").attr("dumps");
    // YAML knows no halves of a letter (\\ud83d\\ude00), which JSON writes without this.
    return dumps(value, py::arg("ensure_ascii") = false, py::arg("default") = py::cpp_function(&plain_value))
        .attr("encode")("utf-8")
        .cast<std::string>();
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_ValueError) && !error.matches(PyExc_RecursionError) && !error.matches(PyExc_TypeError)) {
      throw;
    }
    fail("dict: can't be written as JSON ({})", std::string(py::str(error.value())));
  }
}

/// The file of a path, or of a shipped file's name.
fs::path file_from(const py::handle& value, const char* folder) {
  return named_file(path_from(value, folder), folder);
}

/// From a dict of a file's fields (JSON is YAML), a path, or a shipped file's name.
template <typename Spec>
Spec spec_from(const py::handle& value, const char* folder) {
  if (py::isinstance<py::dict>(value)) return parse_yaml<Spec>(json_of(value), "dict");
  return read_yaml<Spec>(file_from(value, folder));
}

std::shared_ptr<Sensor> make_sensor(const py::object& device, const py::object& unit, double deepest_mm,
                                    double widest_mm, double membrane_um, bool friction, const py::object& cache,
                                    const py::object& progress) {
  sim::VirtualSensorSettings settings;
  settings.seed = seed_from(unit, "unit");
  settings.deepest_mm = deepest_mm;
  settings.widest_mm = widest_mm;
  settings.membrane_um = membrane_um;
  settings.always_friction = friction;
  const auto check = [](const char* name, double value, const Allowed& allowed) {
    if (!allowed.holds(value)) fail("{}: {} is not allowed; allowed is {}", name, value, allowed.text());
  };
  check("deepest_mm", deepest_mm, Allowed::above_up_to(0.0, 100.0));
  check("widest_mm", widest_mm, Allowed::above_up_to(0.0, 100.0));
  check("membrane_um", membrane_um, Allowed::within(1.0, 1000.0));
  const std::string kept = cache.is_none() ? "" : path_from(cache, "cache");
  const Progress listener = progress_to(progress);
  sim::DeviceSpec spec = spec_from<sim::DeviceSpec>(device, "devices");
  const fs::path folder = kept.empty() ? sim::default_cache_folder() : fs::path(kept);
  return unlocked([&] { return std::make_shared<Sensor>(std::move(spec), folder, settings, listener); });
}

std::shared_ptr<Touch> press(const Sensor& sensor, const py::object& touched, std::optional<double> depth_mm,
                             std::optional<double> force_N, const py::object& at_mm, const py::object& angles_deg,
                             const py::object& pose, const py::object& shear_mm, const py::object& shear_N,
                             double seconds, const py::object& noise_seed, const py::object& frame, bool look,
                             bool truth) {
  const int given = (depth_mm ? 1 : 0) + (force_N ? 1 : 0) + (pose.is_none() ? 0 : 1);
  if (given != 1) fail("press: exactly one of depth_mm, force_N and pose says how far; {} of them are given", given);
  if (!shear_mm.is_none() && !shear_N.is_none()) fail("press: shear_mm and shear_N exclude each other");
  sim::PressSpec order;
  order.depth_mm = depth_mm;
  order.force_N = force_N;
  order.place_mm = vector2_from(at_mm, "at_mm");
  order.angles_deg = vector3_from(angles_deg, "angles_deg");
  if (!pose.is_none()) {
    const RigidTransform gel_from_object = pose_from(pose, "pose");
    const Eigen::Matrix3d& turned = gel_from_object.rotation;
    if (!(turned * turned.transpose()).isIdentity(1e-6) || turned.determinant() < 0.0)
      fail("pose: its rotation isn't one");
    order.place_mm = gel_from_object.translation.head<2>();
    order.height_mm = gel_from_object.translation.z();
    order.angles_deg = xyz_from_rotation(gel_from_object.rotation) / kRadiansPerDegree;
  }
  if (!shear_mm.is_none()) order.drag_mm = vector2_from(shear_mm, "shear_mm");
  if (!shear_N.is_none()) order.shear_N = vector2_from(shear_N, "shear_N");
  if (order.drag_mm.norm() > kLongestShear_mm) {
    fail("shear_mm: ({}, {}) is {:g} mm long; allowed is at most {} mm", order.drag_mm.x(), order.drag_mm.y(),
         order.drag_mm.norm(), kLongestShear_mm);
  }
  const bool events = sensor.device().camera && sensor.device().camera->events;
  const Allowed times = Allowed::within(1e-6, events ? kLongestWatch_s : 1e6);
  if (!times.holds(seconds)) fail("seconds is {}; allowed is {}", seconds, times.text());
  order.seconds = seconds;
  sim::check(order);
  const sim::TouchOptions options{look, truth, seed_from(noise_seed, "noise_seed"), frame_from(frame)};
  const SharedObject object = object_for(sensor, touched);
  return unlocked([&] { return std::make_shared<Touch>(sensor.press(object, order, options)); });
}

template <typename Rows>
py::object rows_of(const Rows& rows, const py::handle& owner) {
  return rows.size() == 0 ? py::object(py::none()) : py::object(array_within(rows, owner));
}

/// A view of a list of points that `owner` holds.
template <typename T, typename Point>
py::array rows_in(const std::vector<Point>& points, py::ssize_t columns, const py::handle& owner) {
  static_assert(sizeof(Point) % sizeof(T) == 0);
  const auto item = static_cast<py::ssize_t>(sizeof(T));
  return py::array_t<T>({static_cast<py::ssize_t>(points.size()), columns},
                        {static_cast<py::ssize_t>(sizeof(Point)), item}, reinterpret_cast<const T*>(points.data()),
                        owner);
}

}  // namespace

SharedObject object_from(const py::handle& value) {
  if (py::isinstance<sim::ObjectSpec>(value)) return value.cast<std::shared_ptr<sim::ObjectSpec>>();
  if (py::isinstance<py::dict>(value)) {
    return std::make_shared<const sim::ObjectSpec>(spec_from<sim::ObjectSpec>(value, "objects"));
  }
  static NamedObjects named;
  return named.of(file_from(value, "objects"));
}

SharedObject object_for(const Sensor& sensor, const py::handle& value) {
  const SharedObject object = object_from(value);
  const std::string warning = unlocked([&] { return sensor.object(object).warning(); });
  if (!warning.empty() && PyErr_WarnEx(PyExc_UserWarning, text_of(warning).cast<std::string>().c_str(), 1) != 0) {
    throw py::error_already_set();
  }
  return object;
}

void bind_sensor(py::module_& module) {
  py::class_<sim::ObjectSpec, std::shared_ptr<sim::ObjectSpec>>(
      module, "Object",
      "What touches a sensor: Object(of), of a dict of an object file's fields, a path, or a shipped object's name. "
      "Make "
      "it once: a sensor keeps what pictures of it share.")
      .def(py::init([](const py::object& of) {
             return std::make_shared<sim::ObjectSpec>(spec_from<sim::ObjectSpec>(of, "objects"));
           }),
           py::arg("of"))
      .def_property_readonly(
          "name", [](const sim::ObjectSpec& self) { return text_of(self.name); }, "As the object file has it.")
      .def_property_readonly(
          "friction", [](const sim::ObjectSpec& self) { return self.friction; },
          "Coulomb's coefficient against the gel.")
      .def("__repr__",
           [](const sim::ObjectSpec& self) { return text_of(fmt::format("<touchstone.Object '{}'>", self.name)); });

  const auto of_touch = [](auto member) {
    return [member](const py::object& self) { return array_of(self.cast<Touch&>().of.*member); };
  };
  py::class_<Touch, std::shared_ptr<Touch>>(module, "Touch",
                                            "One touch: pictures and what is true of it. Its arrays of pictures and of "
                                            "surface vertices are its own memory, not "
                                            "copies. What wasn't asked for is None.")
      .def_property_readonly(
          "frame", of_touch(&sim::Touch::frame),
          "uint8: what the camera delivers, with noise; (height, width, 3) in BGR order, or (height, width) grey.")
      .def_property_readonly(
          "ideal", [](const py::object& self) { return array_of(self.cast<Touch&>().ideal); },
          "The frame without noise and fixed pattern.")
      .def_property_readonly(
          "exposure_factor", [](const Touch& self) { return self.of.control.exposure; },
          "Of a camera with auto_exposure: what it has made of exposure_us for this frame; else 1.")
      .def_property_readonly(
          "gain_factors", [](const Touch& self) { return small_array(self.of.control.gains); },
          "(3,): of a camera with auto_white_balance: what it has made of its gains of red, green, blue; else 1.")
      .def_property_readonly(
          "height_mm", of_touch(&sim::Touch::height),
          "float32: how far the membrane that a pixel sees is pressed in, along z; NaN where it sees none.")
      .def_property_readonly(
          "contact", [](const Touch& self) { return bool_array_of(self.of.contact); },
          "bool: the pixel sees membrane that lies on the object.")
      .def_property_readonly(
          "wrench", [](const Touch& self) { return small_array(self.of.press.wrench); },
          "(6,): force N and torque N mm about the gel frame's origin, on the object.")
      .def_property_readonly(
          "force_N", [](const Touch& self) { return small_array(self.of.press.wrench.head<3>().eval()); },
          "(3,): on the object, gel frame; pressing gives a positive z.")
      .def_property_readonly(
          "pose", [](const Touch& self) { return pose_array(self.of.press.gel_from_object); },
          "(3, 4): gel_from_object, rotation and position in mm.")
      .def_property_readonly(
          "contact_state", [](const Touch& self) { return sim::name_of(self.reading.contact); },
          "'none', 'sticking', 'partly_slipping' or 'sliding'.")
      .def_property_readonly(
          "slipping_share", [](const Touch& self) { return self.reading.slipping_share; }, "Of the contact's area.")
      .def_property_readonly(
          "contact_area_mm2", [](const Touch& self) { return self.of.press.contact_area; }, "Of the coarse contact.")
      .def_property_readonly(
          "force_error_N", [](const Touch& self) { return small_array(self.of.error.force); },
          "(3,): one standard error of each force component, from the mesh.")
      .def_property_readonly(
          "displacement_error_mm", [](const Touch& self) { return self.of.error.displacement; },
          "One standard error of the surface's displacement near the contact, root mean square.")
      .def_property_readonly(
          "bead_error_mm", [](const Touch& self) { return self.of.error.beads; },
          "One standard error of the bead that is furthest off.")
      .def_property_readonly(
          "traction_error_MPa", [](const Touch& self) { return self.of.error.traction; },
          "One standard error of the traction over the contact, root mean square.")
      .def_property_readonly(
          "largest_strain", [](const Touch& self) { return self.of.press.largest_strain; },
          "Of the gel: above some 0.2 linear elasticity is off by percents.")
      .def_property_readonly(
          "under_resolved", [](const Touch& self) { return self.of.press.under_resolved; },
          "Too few vertices touch for a force exact to a percent.")
      .def_property_readonly(
          "doubts", [](const Touch& self) { return self.doubts; },
          "list of str: what the gel's surface does that no press computes: it folds, wrinkles under its skin, or "
          "reaches into the object. Empty if nothing.")
      .def_property_readonly(
          "surface_displacement_mm",
          [](const py::object& self) { return rows_of(self.cast<Touch&>().of.press.surface_displacement, self); },
          "(n, 3): of the gel's surface vertices (Sensor.gel_vertices_mm).")
      .def_property_readonly(
          "traction_MPa", [](const py::object& self) { return rows_of(self.cast<Touch&>().of.press.traction, self); },
          "(n, 3): on the gel.")
      .def_property_readonly(
          "bead_displacement_mm",
          [](const py::object& self) { return rows_of(self.cast<Touch&>().of.press.bead_displacement, self); },
          "(m, 3), or None for a gel without beads.")
      .def_property_readonly(
          "background", of_touch(&sim::Touch::background),
          "The untouched device's frame, with other noise; of a clear gel the object stands just above it.")
      .def_property_readonly(
          "markers_mm", [](const py::object& self) { return rows_of(self.cast<Touch&>().of.markers_mm, self); },
          "(m, 3): the middles of printed markers, or of pins' tips, on the undeformed gel, or None without either.")
      .def_property_readonly(
          "marker_displacement_mm",
          [](const py::object& self) { return rows_of(self.cast<Touch&>().of.marker_displacement, self); },
          "(m, 3): how far the gel under each marker's middle has gone, or the middle of each pin's tip, or None.")
      .def_property_readonly(
          "events",
          [](const Touch& self) -> py::object {
            if (self.of.events.empty() && self.of.frame.empty()) return py::none();
            return events_array(self.of.events);
          },
          "Structured array (t_us, x, y, on) of a device with event pixels, from the press's start to its end.")
      .def_property_readonly(
          "statistics",
          [](const Touch& self) -> py::object {
            if (!self.of.statistics) return py::none();
            const ChipStatistics& s = *self.of.statistics;
            py::dict of;
            of["t_us"] = s.t_us;
            of["dx"] = s.dx;
            of["dy"] = s.dy;
            of["maximum"] = s.maximum;
            of["minimum"] = s.minimum;
            of["squal"] = s.squal;
            of["average"] = s.average;
            return of;
          },
          "Of a device with a motion chip, a dict: the last frame's statistics; dx and dy are summed over the press.")
      .def_property_readonly(
          "node_state",
          [](const py::object& self) {
            const auto& states = self.cast<Touch&>().of.press.node_state;
            return py::array_t<std::uint8_t>({static_cast<py::ssize_t>(states.size())}, {py::ssize_t{1}},
                                             reinterpret_cast<const std::uint8_t*>(states.data()), self);
          },
          "(n,) uint8: 0 open, 1 stick, 2 slip.");

  py::class_<Sensor, std::shared_ptr<Sensor>>(
      module, "Sensor",
      "A virtual device. Sensor(device, *, unit=1, deepest_mm=1.2, widest_mm=0.5, membrane_um=40, "
      "friction=False, cache='', progress=None)\n\n"
      "device: a dict of a device file's fields, a path, or a shipped device's name ('gelsight-flat').\n"
      "unit: which unit of the design: its imager's fixed pattern.\n"
      "deepest_mm, widest_mm: how far the gel will be pressed in and sheared, which the light has to hold for.\n"
      "membrane_um: pixels of the fine contact.\n"
      "friction: also in straight presses, where it's left out: then the surface sticks to the object as it does in "
      "drawn sets. It matters to deep presses into thin gels.\n"
      "cache: folder of set-up results; '': $TOUCHSTONE_CACHE or ~/.cache/touchstone.\n"
      "progress: called as progress(stage, done, total).\n\n"
      "Its gel is set up at once (seconds; later from the cache), its light with the first picture. Pictures need a "
      "device with a camera; forces and sessions need none. May be used from several threads.")
      .def(py::init(&make_sensor), py::arg("device"), py::kw_only(), py::arg("unit") = 1, py::arg("deepest_mm") = 1.2,
           py::arg("widest_mm") = 0.5, py::arg("membrane_um") = 40.0, py::arg("friction") = false,
           py::arg("cache") = "", py::arg("progress") = py::none())
      .def_property_readonly(
          "name", [](const Sensor& self) { return text_of(self.device().name); }, "As the device file has it.")
      .def_property_readonly(
          "picture_shape",
          [](const Sensor& self) -> py::object {
            if (!self.device().camera) return py::none();
            return py::make_tuple(self.device().camera->height, self.device().camera->width);
          },
          "(height, width), or None without a camera.")
      .def_property_readonly(
          "gel_vertices_mm",
          [](const py::object& self) {
            return read_only(rows_in<double>(self.cast<Sensor&>().gel().vertices, 3, self));
          },
          "(n, 3): the outer surface's vertices at rest, gel frame; read-only.")
      .def_property_readonly(
          "gel_triangles",
          [](const py::object& self) { return read_only(rows_in<int>(self.cast<Sensor&>().gel().triangles, 3, self)); },
          "(triangles, 3): vertices of each; read-only.")
      .def_property_readonly(
          "mm_per_px", [](const Sensor& self) { return unlocked([&] { return self.virtual_sensor().mm_per_px(); }); },
          "In the middle of the undeformed membrane.")
      .def_property_readonly(
          "light",
          [](const Sensor& self) {
            return text_of(unlocked([&] { return std::string(self.virtual_sensor().light().reason); }));
          },
          "How pictures are lit, and why.")
      .def(
          "gel_from_pixel",
          [](const Sensor& self, const py::object& pixel) {
            const Eigen::Vector2d at = vector2_from(pixel, "pixel");
            return small_array(unlocked([&] {
              try {
                return self.virtual_sensor().gel_from_pixel(at);
              } catch (const Error& error) {
                fail("pixel: ({:g}, {:g}) has no place on the gel: {}", at.x(), at.y(), error.what());
              }
            }));
          },
          py::arg("pixel"),
          "Where on the undeformed membrane a point of the picture lies (mm); pixel centres are at + 0.5.")
      .def(
          "pixel_from_gel",
          [](const Sensor& self, const py::object& place) {
            const Eigen::Vector2d at = vector2_from(place, "place_mm");
            return small_array(unlocked([&] { return self.virtual_sensor().pixel_from_gel(at); }));
          },
          py::arg("place_mm"), "The inverse of gel_from_pixel.")
      .def(
          "background",
          [](const Sensor& self, const py::object& noise_seed, const py::object& frame) {
            const std::uint64_t seed = seed_from(noise_seed, "noise_seed");
            const int number = frame_from(frame);
            return array_of(unlocked([&] { return self.virtual_sensor().background(seed, number); }));
          },
          py::kw_only(), py::arg("noise_seed") = 0, py::arg("frame") = 0,
          "The frame of the untouched device; noise by noise_seed and frame.")
      .def(
          "touch_height_mm",
          [](const Sensor& self, const py::object& touched, const py::object& at_mm, const py::object& angles_deg) {
            const Eigen::Vector2d at = vector2_from(at_mm, "at_mm");
            const Eigen::Matrix3d rotation =
                rotation_from_xyz(vector3_from(angles_deg, "angles_deg") * kRadiansPerDegree);
            const SharedObject object = object_from(touched);
            return unlocked(
                [&] { return sim::first_touch(self.device().gel, sim::contact_shape(*object), at, rotation); });
          },
          py::arg("object"), py::kw_only(), py::arg("at_mm") = py::make_tuple(0.0, 0.0),
          py::arg("angles_deg") = py::make_tuple(0.0, 0.0, 0.0),
          "z of the object's origin at which it just touches the undeformed gel, coming straight down.")
      .def("press", &press, py::arg("object"), py::kw_only(), py::arg("depth_mm") = py::none(),
           py::arg("force_N") = py::none(), py::arg("at_mm") = py::make_tuple(0.0, 0.0),
           py::arg("angles_deg") = py::make_tuple(0.0, 0.0, 0.0), py::arg("pose") = py::none(),
           py::arg("shear_mm") = py::none(), py::arg("shear_N") = py::none(), py::arg("seconds") = 0.1,
           py::arg("noise_seed") = 0, py::arg("frame") = 0, py::arg("look") = true, py::arg("truth") = true,
           "Presses an object on the untouched gel and takes a picture.\n\nExactly one of: depth_mm, beyond the first "
           "touch; "
           "force_N, the normal force (above 0); pose, a (3, 4) or (4, 4) array gel_from_object in mm.\nat_mm: place "
           "of the object's origin, with depth_mm and force_N. angles_deg: turned about x, then y, then z.\nshear_mm, "
           "shear_N: moved aside afterwards, or until this force is on it.\nseconds: of each of these steps; matters "
           "to gels that relax.\nnoise_seed, frame: choose the imager's noise.\nlook: make a picture at all. truth: "
           "with ideal, height and contact.\n\nRaises Error for a press that can't be had (gross slip, deeper than the "
           "gel) or shown (beyond deepest_mm).")
      .def("__repr__",
           [](const Sensor& self) { return text_of(fmt::format("<touchstone.Sensor '{}'>", self.device().name)); });
}

}  // namespace touchstone::python
