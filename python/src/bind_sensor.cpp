#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/nearest_name.h"
#include "core/transform.h"
#include "core/units.h"
#include "datasets/jobs/scenes_folder.h"
#include "python/src/bindings.h"
#include "python/src/sensor.h"
#include "sim/press/touch_height.h"
#include "sim/scene/object.h"

namespace touchstone::python {
namespace {

namespace fs = std::filesystem;

/// The file of this name, or the shipped one: "gelsight-flat" is scenes/devices/gelsight-flat.yaml.
fs::path named_file(const std::string& name, const char* folder) {
  const fs::path given(name);
  if (given.has_extension() || given.has_parent_path() || fs::exists(given)) return given;
  const fs::path shipped = datasets::scenes_folder() / folder;
  const fs::path file = shipped / (name + ".yaml");
  if (fs::exists(file)) return file;
  std::vector<std::string> known;
  for (const auto& entry : fs::directory_iterator(shipped)) {
    if (entry.path().extension() == ".yaml") known.push_back(entry.path().stem().string());
  }
  std::sort(known.begin(), known.end());
  fail("'{}' is neither a file nor one of the shipped {}{}; there are: {}", name, folder, did_you_mean(name, known),
       fmt::join(known, ", "));
}

/// From a dict of a file's fields (JSON is YAML), a path, or a shipped file's name.
template <typename Spec>
Spec spec_from(const py::handle& value, const char* folder) {
  if (py::isinstance<py::dict>(value)) {
    const py::object dumps = py::module_::import("json").attr("dumps");
    return parse_yaml<Spec>(dumps(value).cast<std::string>(), "dict");
  }
  const py::object path = py::module_::import("os").attr("fspath")(value);
  return read_yaml<Spec>(named_file(path.cast<std::string>(), folder));
}

std::shared_ptr<Sensor> make_sensor(const py::object& device, std::uint64_t unit, double deepest_mm, double widest_mm,
                                    double membrane_um, const std::string& cache, const py::object& progress) {
  sim::TouchRigSettings settings;
  settings.seed = unit;
  settings.deepest_mm = deepest_mm;
  settings.widest_mm = widest_mm;
  settings.membrane_um = membrane_um;
  const auto check = [](const char* name, double value, const Allowed& allowed) {
    if (!allowed.holds(value)) fail("{}: {} is not allowed; allowed is {}", name, value, allowed.text());
  };
  check("deepest_mm", deepest_mm, Allowed::above_up_to(0.0, 100.0));
  check("widest_mm", widest_mm, Allowed::above_up_to(0.0, 100.0));
  check("membrane_um", membrane_um, Allowed::within(1.0, 1000.0));
  const Progress listener = progress_to(progress);
  sim::DeviceSpec spec = spec_from<sim::DeviceSpec>(device, "devices");
  const fs::path folder = cache.empty() ? sim::default_cache_folder() : fs::path(cache);
  return unlocked([&] { return std::make_shared<Sensor>(std::move(spec), folder, settings, listener); });
}

/// How press() shall bring the object to the gel.
struct PressOrder {
  std::optional<double> depth_mm, force_N;
  std::optional<RigidTransform> pose;
  Eigen::Vector2d at_mm;
  Eigen::Matrix3d rotation;
  std::optional<Eigen::Vector2d> shear_mm, shear_N;
  double seconds = 0.0;
};

void check_order(const PressOrder& order) {
  const int ways = (order.depth_mm ? 1 : 0) + (order.force_N ? 1 : 0) + (order.pose ? 1 : 0);
  if (ways != 1) fail("press: exactly one of depth_mm, force_N and pose says how far; {} of them are given", ways);
  if (order.shear_mm && order.shear_N) fail("press: shear_mm and shear_N exclude each other");
  if (order.depth_mm && !std::isfinite(*order.depth_mm)) fail("press: depth_mm is {}", *order.depth_mm);
  if (order.force_N && !(std::isfinite(*order.force_N) && *order.force_N > 0.0)) {
    fail("press: force_N is {}; allowed is a finite force above 0", *order.force_N);
  }
}

void carry_out(const PressOrder& order, const Sensor& sensor, const sim::ObjectSpec& object,
               sim::TouchSession& session) {
  fem::PressTarget target;
  target.seconds = order.seconds;
  if (order.pose) {
    target.rotation = order.pose->rotation;
    for (int a = 0; a < 3; ++a) target.axis[a] = fem::AxisControl::at(order.pose->translation[a]);
  } else {
    target.rotation = order.rotation;
    for (int a = 0; a < 2; ++a) target.axis[a] = fem::AxisControl::at(order.at_mm[a]);
    const fem::ContactShape felt = sim::coarse_contact_shape(object, sensor.device().mesh.fine_mm);
    const bool by_force = order.force_N.has_value();
    target.axis[2] =
        by_force ? fem::AxisControl::with_force(*order.force_N)
                 : fem::AxisControl::at(sim::touch_height(sensor.device().gel, felt, order.at_mm, order.rotation) -
                                        *order.depth_mm);
  }
  session.step(target);
  if (!order.shear_mm && !order.shear_N) return;
  for (int a = 0; a < 2; ++a) {
    target.axis[a] = order.shear_N ? fem::AxisControl::with_force((*order.shear_N)[a])
                                   : fem::AxisControl::at(target.axis[a].value + (*order.shear_mm)[a]);
  }
  session.step(target);
}

std::shared_ptr<Touch> press(const Sensor& sensor, const py::object& touched, std::optional<double> depth_mm,
                             std::optional<double> force_N, const py::object& at_mm, const py::object& angles_deg,
                             const py::object& pose, const py::object& shear_mm, const py::object& shear_N,
                             double seconds, std::uint64_t noise_seed, int frame, bool look, bool truth) {
  PressOrder order;
  order.depth_mm = depth_mm;
  order.force_N = force_N;
  if (!pose.is_none()) order.pose = pose_from(pose, "pose");
  order.at_mm = vector2_from(at_mm, "at_mm");
  order.rotation = rotation_from_xyz(vector3_from(angles_deg, "angles_deg") * kRadiansPerDegree);
  if (!shear_mm.is_none()) order.shear_mm = vector2_from(shear_mm, "shear_mm");
  if (!shear_N.is_none()) order.shear_N = vector2_from(shear_N, "shear_N");
  order.seconds = seconds;
  check_order(order);
  const SharedObject object = object_from(touched);
  return unlocked([&] {
    sim::TouchSession session = sensor.session(object, {});
    carry_out(order, sensor, *object, session);
    return std::make_shared<Touch>(sensor.touch(object, session, {look, truth, noise_seed, frame}));
  });
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
  return std::make_shared<const sim::ObjectSpec>(spec_from<sim::ObjectSpec>(value, "objects"));
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
          "name", [](const sim::ObjectSpec& self) { return self.name; }, "As the object file has it.")
      .def_property_readonly(
          "friction", [](const sim::ObjectSpec& self) { return self.friction; },
          "Coulomb's coefficient against the gel.")
      .def("__repr__", [](const sim::ObjectSpec& self) { return fmt::format("<touchstone.Object '{}'>", self.name); });

  const auto of_touch = [](auto member) {
    return [member](const py::object& self) { return array_of(self.cast<Touch&>().pictures.*member); };
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
          "height_mm", of_touch(&sim::Touch::height),
          "float32: how far the membrane that a pixel sees is pressed in, along z; NaN where it sees none.")
      .def_property_readonly(
          "contact", [](const Touch& self) { return bool_array_of(self.pictures.contact); },
          "bool: the pixel sees membrane that lies on the object.")
      .def_property_readonly(
          "wrench", [](const Touch& self) { return small_array(self.press.wrench); },
          "(6,): force N and torque N mm about the gel frame's origin, on the object.")
      .def_property_readonly(
          "force_N", [](const Touch& self) { return small_array(self.press.wrench.head<3>().eval()); },
          "(3,): on the object, gel frame; pressing gives a positive z.")
      .def_property_readonly(
          "pose", [](const Touch& self) { return pose_array(self.press.gel_from_object); },
          "(3, 4): gel_from_object, rotation and position in mm.")
      .def_property_readonly(
          "contact_state", [](const Touch& self) { return sim::name_of(self.reading.contact); },
          "'none', 'sticking', 'partly_slipping' or 'sliding'.")
      .def_property_readonly(
          "slipping_share", [](const Touch& self) { return self.reading.slipping_share; }, "Of the contact's area.")
      .def_property_readonly(
          "contact_area_mm2", [](const Touch& self) { return self.press.contact_area; }, "Of the coarse contact.")
      .def_property_readonly(
          "force_error_N", [](const Touch& self) { return small_array(self.error.force); },
          "(3,): one standard error of each force component, from the mesh.")
      .def_property_readonly(
          "displacement_error_mm", [](const Touch& self) { return self.error.displacement; },
          "One standard error of the surface's displacement near the contact, root mean square.")
      .def_property_readonly(
          "bead_error_mm", [](const Touch& self) { return self.error.beads; },
          "One standard error of the bead that is furthest off.")
      .def_property_readonly(
          "traction_error_MPa", [](const Touch& self) { return self.error.traction; },
          "One standard error of the traction over the contact, root mean square.")
      .def_property_readonly(
          "largest_strain", [](const Touch& self) { return self.press.largest_strain; },
          "Of the gel: above some 0.2 linear elasticity is off by percents.")
      .def_property_readonly(
          "under_resolved", [](const Touch& self) { return self.press.under_resolved; },
          "Too few vertices touch for a force exact to a percent.")
      .def_property_readonly(
          "surface_displacement_mm",
          [](const py::object& self) { return rows_of(self.cast<Touch&>().press.surface_displacement, self); },
          "(n, 3): of the gel's surface vertices (Sensor.gel_vertices_mm).")
      .def_property_readonly(
          "traction_MPa", [](const py::object& self) { return rows_of(self.cast<Touch&>().press.traction, self); },
          "(n, 3): on the gel.")
      .def_property_readonly(
          "bead_displacement_mm",
          [](const py::object& self) { return rows_of(self.cast<Touch&>().press.bead_displacement, self); },
          "(m, 3), or None for a gel without beads.")
      .def_property_readonly(
          "node_state",
          [](const py::object& self) {
            const auto& states = self.cast<Touch&>().press.node_state;
            return py::array_t<std::uint8_t>({static_cast<py::ssize_t>(states.size())}, {py::ssize_t{1}},
                                             reinterpret_cast<const std::uint8_t*>(states.data()), self);
          },
          "(n,) uint8: 0 open, 1 stick, 2 slip.");

  py::class_<Sensor, std::shared_ptr<Sensor>>(
      module, "Sensor",
      "A virtual device. Sensor(device, *, unit=1, deepest_mm=1.2, widest_mm=0.5, membrane_um=40, cache='', "
      "progress=None)\n\n"
      "device: a dict of a device file's fields, a path, or a shipped device's name ('gelsight-flat').\n"
      "unit: which unit of the design: its imager's fixed pattern.\n"
      "deepest_mm, widest_mm: how far the gel will be pressed in and sheared, which the light has to hold for.\n"
      "membrane_um: pixels of the fine contact.\n"
      "cache: folder of set-up results; '': $TOUCHSTONE_CACHE or ~/.cache/touchstone.\n"
      "progress: called as progress(stage, done, total).\n\n"
      "Its gel is set up at once (seconds; later from the cache), its light with the first picture. Pictures need a "
      "device with a camera and a coating; forces and sessions need neither. May be used from several threads.")
      .def(py::init(&make_sensor), py::arg("device"), py::kw_only(), py::arg("unit") = 1, py::arg("deepest_mm") = 1.2,
           py::arg("widest_mm") = 0.5, py::arg("membrane_um") = 40.0, py::arg("cache") = "",
           py::arg("progress") = py::none())
      .def_property_readonly(
          "name", [](const Sensor& self) { return self.device().name; }, "As the device file has it.")
      .def_property_readonly(
          "picture_shape",
          [](const Sensor& self) -> py::object {
            if (!self.device().camera) return py::none();
            return py::make_tuple(self.device().camera->height, self.device().camera->width);
          },
          "(height, width), or None without a camera.")
      .def_property_readonly(
          "gel_vertices_mm",
          [](const py::object& self) { return rows_in<double>(self.cast<Sensor&>().gel().vertices, 3, self); },
          "(n, 3): the outer surface's vertices at rest, gel frame.")
      .def_property_readonly(
          "gel_triangles",
          [](const py::object& self) { return rows_in<int>(self.cast<Sensor&>().gel().triangles, 3, self); },
          "(triangles, 3): vertices of each.")
      .def_property_readonly(
          "mm_per_px", [](const Sensor& self) { return unlocked([&] { return self.rig().mm_per_px(); }); },
          "In the middle of the undeformed membrane.")
      .def_property_readonly(
          "light", [](const Sensor& self) { return unlocked([&] { return self.rig().light().reason; }); },
          "How pictures are lit, and why.")
      .def(
          "gel_from_pixel",
          [](const Sensor& self, const py::object& pixel) {
            const Eigen::Vector2d at = vector2_from(pixel, "pixel");
            return small_array(unlocked([&] { return self.rig().gel_from_pixel(at); }));
          },
          py::arg("pixel"),
          "Where on the undeformed membrane a point of the picture lies (mm); pixel centres are at + 0.5.")
      .def(
          "pixel_from_gel",
          [](const Sensor& self, const py::object& place) {
            const Eigen::Vector2d at = vector2_from(place, "place_mm");
            return small_array(unlocked([&] { return self.rig().pixel_from_gel(at); }));
          },
          py::arg("place_mm"), "The inverse of gel_from_pixel.")
      .def(
          "background",
          [](const Sensor& self, std::uint64_t noise_seed, int frame) {
            return array_of(unlocked([&] { return self.rig().background(noise_seed, frame); }));
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
            return unlocked([&] {
              return sim::touch_height(self.device().gel,
                                       sim::coarse_contact_shape(*object, self.device().mesh.fine_mm), at, rotation);
            });
          },
          py::arg("object"), py::kw_only(), py::arg("at_mm") = py::make_tuple(0.0, 0.0),
          py::arg("angles_deg") = py::make_tuple(0.0, 0.0, 0.0),
          "z of the object's origin at which it just touches the undeformed gel, coming straight down.")
      .def("press", &press, py::arg("object"), py::kw_only(), py::arg("depth_mm") = py::none(),
           py::arg("force_N") = py::none(), py::arg("at_mm") = py::make_tuple(0.0, 0.0),
           py::arg("angles_deg") = py::make_tuple(0.0, 0.0, 0.0), py::arg("pose") = py::none(),
           py::arg("shear_mm") = py::none(), py::arg("shear_N") = py::none(), py::arg("seconds") = 0.1,
           py::arg("noise_seed") = 0, py::arg("frame") = 0, py::arg("look") = true, py::arg("truth") = true,
           "Presses an object on the untouched gel and looks.\n\nExactly one of: depth_mm, beyond the first touch; "
           "force_N, the normal force (above 0); pose, a (3, 4) or (4, 4) array gel_from_object in mm.\nat_mm: place "
           "of the object's origin, with depth_mm and force_N. angles_deg: turned about x, then y, then z.\nshear_mm, "
           "shear_N: moved aside afterwards, or until this force is on it.\nseconds: of each of these steps; matters "
           "to gels that relax.\nnoise_seed, frame: choose the imager's noise.\nlook: make a picture at all. truth: "
           "with ideal, height and contact.\n\nRaises Error for a press that can't be had (gross slip, deeper than the "
           "gel) or shown (beyond deepest_mm).")
      .def("__repr__", [](const Sensor& self) { return fmt::format("<touchstone.Sensor '{}'>", self.device().name); });
}

}  // namespace touchstone::python
