// Errors, pictures on disk, and data sets from jobs.

#include <tbb/global_control.h>

#include <filesystem>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/field_error.h"
#include "core/hdf5_file.h"
#include "datasets/jobs/scenes_folder.h"
#include "datasets/sets/generate.h"
#include "python/src/bindings.h"
#include "sim/files/image_file.h"

namespace touchstone::python {
namespace {

constexpr int kMostThreads = 4096;  // as the command's --threads

py::object text_or_none(const std::string& text) {
  return text.empty() ? py::object(py::none()) : text_of(text);
}

void set_error(const Error& error, const std::string& field) {
  const py::object type = py::module_::import("touchstone._errors").attr("Error");
  const SourceLocation& where = error.where();
  const py::object line = where.line <= 0 ? py::object(py::none()) : py::int_(where.line);
  const py::object instance = type(text_or_none(error.what()), text_or_none(where.file), line, text_or_none(field));
  PyErr_SetObject(type.ptr(), instance.ptr());
}

/// The GIL, and the lock that h5py holds while it uses the same library.
class Hdf5Lock {
 public:
  Hdf5Lock() {
    const py::object h5py = py::module_::import("sys").attr("modules").attr("get")("h5py._objects", py::none());
    if (h5py.is_none() || !py::hasattr(h5py, "phil")) return;
    lock_ = h5py.attr("phil");
    lock_.attr("acquire")();
  }
  Hdf5Lock(const Hdf5Lock&) = delete;
  Hdf5Lock& operator=(const Hdf5Lock&) = delete;
  ~Hdf5Lock() {
    if (!lock_) return;
    const py::error_scope kept;
    lock_.attr("release")();
    lock_ = py::object();
  }

 private:
  py::gil_scoped_acquire acquire_;  // first in, last out
  py::object lock_;
};

py::dict dict_of(const datasets::GenerateReport& report) {
  py::dict result;
  result["was_finished"] = report.was_finished;
  result["samples"] = report.samples;
  result["made"] = report.made;
  result["kept"] = report.kept;
  result["damaged_blocks"] = report.damaged_blocks;
  result["drawn_again"] = report.drawn_again;
  result["warning"] = text_of(report.warning);
  return result;
}

py::dict generate(const py::object& job_file, const py::object& out_folder, const py::object& threads, bool timings,
                  const py::object& cache_folder, const py::object& shard_text, const py::object& progress) {
  const std::string shard = text_from(shard_text, "shard");
  const std::string job = needed_path(job_file, "job"), out = needed_path(out_folder, "out");
  const std::string cache = path_from(cache_folder, "cache");
  const Progress listener = progress_to(progress);
  datasets::GenerateOptions how =
      datasets::simulated(cache.empty() ? sim::default_cache_folder() : std::filesystem::path(cache));
  how.threads = whole_number_from<int>(threads, "threads", 0, kMostThreads);
  how.timings = timings;
  if (!shard.empty()) how.shard = datasets::shard_of(shard);
  return dict_of(unlocked([&] { return datasets::generate(job, out, how, listener); }));
}

py::dict merge(const py::object& job_file, const py::object& out_folder, const py::object& progress) {
  const std::string job = needed_path(job_file, "job"), out = needed_path(out_folder, "out");
  const Progress listener = progress_to(progress);
  return dict_of(unlocked([&] { return datasets::merge(job, out, listener); }));
}

}  // namespace

void bind_errors(py::module_&) {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const FieldError& error) {
      set_error(error, error.field());
    } catch (const Error& error) {
      set_error(error, "");
    } catch (const std::filesystem::filesystem_error& error) {
      set_error(Error(fmt::format("{}: {}", error.path1().string(), error.code().message())), "");
    } catch (const cv::Exception& error) {
      if (error.code == cv::Error::StsNoMem) {
        PyErr_SetString(PyExc_MemoryError, error.err.c_str());
      } else {
        set_error(Error(fmt::format("OpenCV refuses it: {}", error.err)), "");
      }
    }
  });
  set_hdf5_guard([]() -> std::shared_ptr<void> { return std::make_shared<Hdf5Lock>(); });
}

void bind_files(py::module_& module) {
  module.def(
      "scenes_folder",
      [] { return py::module_::import("os").attr("fsdecode")(py::bytes(datasets::scenes_folder().string())); },
      "Where the shipped devices, objects and scenes lie.");
  module.def(
      "read_image",
      [](const py::object& path) {
        const std::string file = needed_path(path, "path");
        return array_of(unlocked([&] { return sim::read_image(file); }));
      },
      py::arg("path"), "Reads a picture as it is stored: uint8 or uint16, grey or BGR.");
  module.def(
      "write_png",
      [](const py::object& path, const py::object& image) {
        const std::string file = needed_path(path, "path");
        const Picture picture = picture_from(image, "image");
        unlocked([&] { sim::write_png(file, picture.mat); });
      },
      py::arg("path"), py::arg("image"), "Writes a PNG: uint8 or uint16, grey or BGR.");
  module.def("generate", &generate, py::arg("job"), py::arg("out"), py::arg("threads") = 0, py::arg("timings") = true,
             py::arg("cache") = "", py::arg("shard") = "", py::arg("progress") = py::none());
  module.def("merge", &merge, py::arg("job"), py::arg("out"), py::arg("progress") = py::none());
}

}  // namespace touchstone::python
