#include <pybind11/stl.h>

#include "core/error.h"
#include "python/src/bindings.h"
#include "python/src/sensor.h"

namespace touchstone::python {
namespace {

/// A contact session with what it stands on. One call at a time: a second thread is refused, not queued.
class Session {
  template <typename Work>
  auto alone(const Work& work) {
    const std::unique_lock<std::mutex> lock(mutex_, std::try_to_lock);
    if (!lock) fail("this session is at work in another thread; each thread needs a session of its own");
    return unlocked(work);
  }

 public:
  Session(std::shared_ptr<Sensor> sensor, SharedObject object, const sim::TouchSessionSettings& settings)
      : sensor_(std::move(sensor)),
        object_(std::move(object)),
        session_(sensor_->virtual_sensor().session(sensor_->object(object_), settings)) {}

  sim::TouchReading step(const RigidTransform& pose, double seconds) {
    return alone([&] { return session_.step(pose, seconds); });
  }
  sim::TouchReading reading() {
    return alone([&] { return session_.reading(); });
  }
  std::shared_ptr<Touch> look(const sim::TouchOptions& how, bool frame_of_step) {
    return alone([&] {
      sim::TouchOptions look = how;
      if (frame_of_step) look.frame = static_cast<int>(session_.reading().step);
      return std::make_shared<Touch>(sensor_->touch(object_, session_, look));
    });
  }
  void restart() {
    alone([&] { return session_.restart(), 0; });
  }

 private:
  std::shared_ptr<Sensor> sensor_;
  SharedObject object_;
  std::mutex mutex_;
  sim::TouchSession session_;
};

std::shared_ptr<Session> make_session(const std::shared_ptr<Sensor>& sensor, const py::object& touched,
                                      double largest_step_mm, double largest_part_mm) {
  const SharedObject object = object_for(*sensor, touched);
  sim::TouchSessionSettings settings;
  settings.largest_step_mm = largest_step_mm;
  settings.largest_part_mm = largest_part_mm;
  return unlocked([&] { return std::make_shared<Session>(sensor, object, settings); });
}

}  // namespace

void bind_session(py::module_& module) {
  using Reading = sim::TouchReading;
  py::class_<Reading>(module, "Reading", "What a step of a Session gives.")
      .def_readonly("step", &Reading::step, "Counted from 1; 0 before the first.")
      .def_readonly("t_s", &Reading::t_s, "The steps' times, summed.")
      .def_readonly("contact_area_mm2", &Reading::contact_area_mm2, "Of the contact.")
      .def_readonly("slipping_share", &Reading::slipping_share, "Of the contact's area.")
      .def_readonly("under_resolved", &Reading::under_resolved,
                    "Too few vertices touch for a force exact to a percent.")
      .def_property_readonly(
          "contact", [](const Reading& self) { return sim::name_of(self.contact); },
          "'none', 'sticking', 'partly_slipping' or 'sliding'.")
      .def_property_readonly(
          "touching", [](const Reading& self) { return self.contact != sim::TouchContact::none; },
          "Whether anything touches.")
      .def_property_readonly(
          "wrench", [](const Reading& self) { return small_array(self.wrench); },
          "(6,): force N and torque N mm about the gel frame's origin, on the object.")
      .def_property_readonly(
          "force_N", [](const Reading& self) { return small_array(self.wrench.head<3>().eval()); },
          "(3,): on the object, gel frame.")
      .def_property_readonly(
          "pose", [](const Reading& self) { return pose_array(self.gel_from_object); }, "(3, 4): gel_from_object.")
      .def_property_readonly(
          "centre_mm", [](const Reading& self) { return small_array(self.centre_mm); },
          "(3,): mean place of the contact on the undeformed gel, weighted by pressure; NaN without contact.")
      .def_property_readonly(
          "force_error_N", [](const Reading& self) { return small_array(self.error.force); },
          "(3,): one standard error of each force component, from the mesh.")
      .def("__repr__", [](const Reading& self) {
        return fmt::format("<touchstone.Reading step {}: {}, force ({:.4g}, {:.4g}, {:.4g}) N>", self.step,
                           sim::name_of(self.contact), self.wrench[0], self.wrench[1], self.wrench[2]);
      });
  py::class_<Session, std::shared_ptr<Session>>(
      module, "Session",
      "An object on a sensor's gel, step by step, for a control loop. Session(sensor, object, *, largest_step_mm=5, "
      "largest_part_mm=0.1)\n\n"
      "Friction and relaxation remember all steps. A step costs milliseconds; pictures are made when look() asks.\n"
      "largest_step_mm: a step in contact that goes further is refused as a mistake (metres for millimetres).\n"
      "largest_part_mm: steps are cut into parts of this length, since friction depends on the path.\n"
      "For one thread at a time; sessions of one sensor are independent.")
      .def(py::init(&make_session), py::arg("sensor").none(false), py::arg("object"), py::kw_only(),
           py::arg("largest_step_mm") = 5.0, py::arg("largest_part_mm") = 0.1)
      .def(
          "step",
          [](Session& self, const py::object& pose, double dt_s) { return self.step(pose_from(pose, "pose"), dt_s); },
          py::arg("pose"), py::arg("dt_s"),
          "Leads the object straight to a pose ((3, 4) or (4, 4), gel_from_object, mm) within dt_s seconds. The first "
          "step places it.\n\nRaises Error, the session being as before, for a pose that isn't one, goes too far in a "
          "step or reaches deeper than the gel, or a time that isn't above 0.")
      .def_property_readonly("reading", &Session::reading, "Of the last step.")
      .def(
          "look",
          [](Session& self, const py::object& noise_seed, const py::object& frame, bool picture, bool truth) {
            const int number = frame.is_none() ? 0 : frame_from(frame);
            return self.look({picture, truth, seed_from(noise_seed, "noise_seed"), number}, frame.is_none());
          },
          py::kw_only(), py::arg("noise_seed") = 0, py::arg("frame") = py::none(), py::arg("picture") = true,
          py::arg("truth") = true,
          "A Touch of the present state, with a picture unless picture=False. frame: chooses the noise; None: the "
          "number of the step.")
      .def("restart", &Session::restart, "Lifts the object off and forgets all steps.");
}

}  // namespace touchstone::python
