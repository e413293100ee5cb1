// The module touchstone._core. What users see is put together and described in python/touchstone/.

#include "datasets/sets/processor.h"
#include "datasets/sets/run_identity.h"
#include "python/src/bindings.h"

PYBIND11_MODULE(_core, module) {
  namespace datasets = touchstone::datasets;
  namespace python = touchstone::python;
  module.doc() = "Touchstone's C++ part; use the package `touchstone`.";
  datasets::use_one_blas_thread();
  module.attr("__version__") = datasets::program_version();
  module.def("blas_core", &datasets::blas_core, "The processor that OpenBLAS takes this one for.");
  module.def("vector_instructions", &datasets::vector_instructions, "'avx512', 'avx2' or 'baseline'.");
  python::bind_errors(module);
  python::bind_files(module);
  python::bind_frames(module);
  python::bind_sensor(module);
  python::bind_session(module);
  python::bind_gelsight(module);
  python::bind_dtact(module);
  python::bind_vhs(module);
  python::bind_markers(module);
  python::bind_touch(module);
  python::bind_surface(module);
  python::bind_events(module);
  python::bind_reflex(module);
  python::bind_skin(module);
  python::bind_chroma(module);
}
