#pragma once
// What each part of the module adds to it.

#include "python/src/convert.h"
#include "python/src/sensor.h"

namespace touchstone::python {

/// An Object, or what makes one. @throws Error
SharedObject object_from(const py::handle& value);
/// The same, for this sensor: with a Python warning where its size is likely a mistake (sim::size_doubt).
SharedObject object_for(const Sensor& sensor, const py::handle& value);

void bind_errors(py::module_& module);
void bind_files(py::module_& module);
void bind_frames(py::module_& module);
void bind_sensor(py::module_& module);
void bind_session(py::module_& module);
void bind_gelsight(py::module_& module);
void bind_dtact(py::module_& module);
void bind_vhs(py::module_& module);
void bind_markers(py::module_& module);
void bind_touch(py::module_& module);
void bind_surface(py::module_& module);
void bind_events(py::module_& module);
void bind_reflex(py::module_& module);
void bind_skin(py::module_& module);
void bind_chroma(py::module_& module);

}  // namespace touchstone::python
