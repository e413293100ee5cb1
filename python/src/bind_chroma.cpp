// Coloured markers and their displacements: sensors/colour/colour_marker_finder.h, sensors/colour/hue_estimator.h.

#include <limits>

#include "core/error.h"
#include "core/yaml_reader.h"
#include "python/src/bindings.h"
#include "python/src/estimator.h"
#include "sensors/colour/colour_marker_finder.h"
#include "sensors/colour/hue_calibration.h"
#include "sensors/colour/hue_estimator.h"
#include "sensors/colour/hue_model_file.h"

namespace touchstone::python {
namespace {

using sensors::ColourMarker;
using sensors::ColourMarkerReading;
using sensors::HueField;
using sensors::HueModel;

/// A finder with the picture at rest that it began with.
struct Finder {
  Finder(const sensors::ColourMarkerAppearance& appearance, const cv::Mat& rest) : finder(appearance) {
    finder.find_rest(rest);
  }
  sensors::ColourMarkerFinder finder;
};
using Reader = Guarded<Finder>;

// As the command's.
const Allowed kSides = Allowed::within(2, 64);
const Allowed kSpacings = Allowed::within(0.01, 100.0);
const Allowed kViewingDistances = Allowed::within(10.0, 1e6);

std::shared_ptr<Reader> make_reader(const py::object& rest, const py::object& grid) {
  const Picture picture = picture_from(rest, "rest");
  sensors::ColourMarkerAppearance appearance;
  const Eigen::Vector2d sides = vector2_from(grid, "grid");
  if (!kSides.holds(sides.x()) || !kSides.holds(sides.y())) {
    fail("grid: ({}, {}) is not allowed; allowed is {} for each", sides.x(), sides.y(), kSides.text());
  }
  appearance.grid = sides.cast<int>();
  if (appearance.grid.cast<double>() != sides) fail("grid: ({}, {}) are not whole numbers", sides.x(), sides.y());
  return unlocked([&] { return std::make_shared<Reader>(appearance, picture.mat); });
}

template <typename Number>
py::array column_of(const ColourMarkerReading& reading, const Number& number) {
  py::array_t<double> out(static_cast<py::ssize_t>(reading.markers.size()));
  double* to = out.mutable_data();
  for (const ColourMarker& marker : reading.markers) {
    *to++ = marker.flaw == sensors::MarkerFlaw::kNone ? number(marker) : std::numeric_limits<double>::quiet_NaN();
  }
  return out;
}

py::array places_of(const ColourMarkerReading& reading) {
  std::vector<Eigen::Vector2d> places;
  for (const ColourMarker& marker : reading.markers) {
    places.push_back(marker.flaw == sensors::MarkerFlaw::kNone
                         ? marker.ink_centroid_px
                         : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
  }
  return points_array(places);
}

/// Samples are (reading, marker, displacement_mm, series). Flawed markers are an error, as in sensors::calibrate_hue.
std::shared_ptr<HueModel> calibrate(const ColourMarkerReading& rest, const py::object& samples, double spacing_mm,
                                    double viewing_distance_mm, const py::object& form_name) {
  const std::string form = text_from(form_name, "form");
  sensors::HueCalibrationSettings settings;
  settings.spacing_mm = spacing_mm;
  settings.parallax.viewing_distance_mm = viewing_distance_mm;
  if (form == "polynomial") {
    settings.form.form = sensors::HueForm::kPolynomial;
  } else if (form == "equation4") {
    settings.form.form = sensors::HueForm::kEquation4;
  } else if (form != "isotropic" && form != "best") {
    fail("form: '{}' is not known; allowed is one of: isotropic, polynomial, equation4, best", form);
  }
  if (!kSpacings.holds(spacing_mm)) {
    fail("spacing_mm: {} is not allowed; allowed is {}", spacing_mm, kSpacings.text());
  }
  if (viewing_distance_mm != 0.0 && !kViewingDistances.holds(viewing_distance_mm)) {
    fail("viewing_distance_mm: {} is not allowed; allowed is 0 or {}", viewing_distance_mm, kViewingDistances.text());
  }
  std::vector<sensors::HueSample> all;
  for_each_item(samples, "samples", [&](const py::object& one) {
    const bool is_list = py::isinstance<py::sequence>(one);
    const auto parts = is_list ? py::reinterpret_borrow<py::sequence>(one) : py::sequence(py::tuple());
    if (parts.size() != 4 || !py::isinstance<ColourMarkerReading>(parts[0])) {
      fail("samples: sample {} isn't (reading, marker, displacement_mm, series)", all.size());
    }
    const auto& reading = py::object(parts[0]).cast<const ColourMarkerReading&>();
    if (reading.grid != rest.grid) {
      fail("samples: sample {} is of a grid of {} x {}, the one at rest has {} x {}", all.size(), reading.grid.x(),
           reading.grid.y(), rest.grid.x(), rest.grid.y());
    }
    sensors::HueSample sample;
    const std::int64_t marker = whole_number_from(parts[1], fmt::format("samples: marker of sample {}", all.size()));
    if (marker < 0 || marker >= static_cast<std::int64_t>(reading.markers.size())) {
      fail("samples: sample {} is of marker {}; allowed is from 0 to {}", all.size(), marker,
           static_cast<std::int64_t>(reading.markers.size()) - 1);
    }
    sample.marker = static_cast<std::size_t>(marker);
    sample.seen = reading.markers[sample.marker];
    sample.displacement_mm = vector3_from(parts[2], "samples: displacement_mm");
    const std::int64_t series = whole_number_from(parts[3], fmt::format("samples: series of sample {}", all.size()));
    if (series < std::numeric_limits<int>::min() || series > std::numeric_limits<int>::max()) {
      fail("samples: series of sample {} is {}; allowed is from {} to {}", all.size(), series,
           std::numeric_limits<int>::min(), std::numeric_limits<int>::max());
    }
    sample.series = static_cast<int>(series);
    all.push_back(std::move(sample));
  });
  return unlocked([&] {
    if (form == "best") {
      settings.form = sensors::rank_hue_forms(rest, all, settings, sensors::usual_hue_forms()).front().form;
    }
    return std::make_shared<HueModel>(sensors::calibrate_hue(rest, all, settings));
  });
}

py::array displacements_of(const HueField& field) {
  std::vector<Eigen::Vector3d> rows = field.field.displacement;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!field.field.measured[i]) rows[i].setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return points_array(rows);
}

py::array bools_of(const std::vector<std::uint8_t>& values) {
  py::array_t<bool> out(static_cast<py::ssize_t>(values.size()));
  std::copy(values.begin(), values.end(), out.mutable_data());
  return out;
}

}  // namespace

void bind_chroma(py::module_& module) {
  py::class_<ColourMarkerReading>(module, "ColourMarkerReading",
                                  "What one picture shows of a grid of coloured markers, row by row; NaN where flawed.")
      .def_property_readonly(
          "grid", [](const ColourMarkerReading& self) { return py::make_tuple(self.grid.x(), self.grid.y()); },
          "(columns, rows).")
      .def_property_readonly(
          "flaws",
          [](const ColourMarkerReading& self) {
            py::list names;
            for (const ColourMarker& marker : self.markers) {
              names.append(sensors::name_of(marker.flaw));
            }
            return names;
          },
          "Why a marker can't be used: 'none', 'missing', ...")
      .def_property_readonly(
          "hue",
          [](const ColourMarkerReading& self) {
            return column_of(self, [](const auto& marker) { return marker.hue; });
          },
          "(markers,): radians in [0, 2 pi), 0 is red.")
      .def_property_readonly(
          "ink_area_px",
          [](const ColourMarkerReading& self) {
            return column_of(self, [](const auto& marker) { return marker.ink_area_px; });
          },
          "(markers,): px^2.")
      .def_property_readonly("places_px", &places_of, "(markers, 2): the ink's centroids.");
  py::class_<Reader, std::shared_ptr<Reader>>(module, "ColourMarkerReader",
                                              "Reads pictures of coloured markers behind filters. "
                                              "ColourMarkerReader(rest, *, grid=(10, 10)): rest is a picture of "
                                              "the unloaded sensor, grid its columns and rows.")
      .def(py::init(&make_reader), py::arg("rest"), py::kw_only(), py::arg("grid") = py::make_tuple(10, 10))
      .def_property_readonly(
          "rest", [](Reader& self) { return self.with([](Finder& one) { return one.finder.rest(); }); },
          "The reading of the picture at rest.")
      .def(
          "read",
          [](Reader& self, const py::object& frame) {
            const Picture picture = picture_from(frame, "frame");
            return self.with([&](Finder& one) { return ColourMarkerReading(one.finder.find(picture.mat)); });
          },
          py::arg("frame"), "The reading of a picture, uint8, BGR, of the size of the one at rest.");

  py::class_<HueModel, std::shared_ptr<HueModel>>(
      module, "HueModel", "From how a coloured marker looks to how it has moved; see calibrate_hue.")
      .def_static(
          "load",
          [](const py::object& path) {
            return std::make_shared<HueModel>(sensors::load_hue_model(needed_path(path, "path")));
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save", [](const HueModel& self, const py::object& path) { sensors::save(self, needed_path(path, "path")); },
          py::arg("path"), "Writes it, whole or not at all.")
      .def_readonly("spacing_mm", &HueModel::spacing_mm, "Of the grid.")
      .def_readonly("samples", &HueModel::samples, "It was calibrated on.")
      .def_readonly("rms_error_mm", &HueModel::rms_error_mm, "On them, of the displacement's length.")
      .def("__repr__", [](const HueModel& self) { return "<touchstone.HueModel: " + sensors::summary_of(self) + ">"; });
  module.def(
      "calibrate_hue", &calibrate, py::arg("rest"), py::arg("samples"), py::kw_only(), py::arg("spacing_mm"),
      py::arg("viewing_distance_mm") = 0.0, py::arg("form") = "isotropic",
      "Makes a HueModel. samples: (reading, marker, displacement_mm, series) each, markers not flawed; a press is -z; "
      "samples of one press or shear share a series.\nform: 'isotropic', 'polynomial', 'equation4', or the 'best' on "
      "series left out.");

  py::class_<HueField>(module, "HueField", "Displacements of a whole grid of markers.")
      .def_property_readonly("displacement_mm", &displacements_of,
                             "(markers, 3): gel frame, a press is -z; NaN where not measured.")
      .def_property_readonly(
          "measured", [](const HueField& self) { return bools_of(self.field.measured); }, "(markers,) bool.")
      .def_property_readonly(
          "extrapolated", [](const HueField& self) { return bools_of(self.extrapolated); },
          "(markers,) bool: looks as nothing did in calibration.");
  py::class_<sensors::HueEstimator, std::shared_ptr<sensors::HueEstimator>>(
      module, "HueEstimator",
      "Displacements from readings. HueEstimator(model, rest): rest is the reading of the unloaded sensor as it is "
      "now.")
      .def(py::init<const HueModel&, const ColourMarkerReading&>(), py::arg("model"), py::arg("rest"))
      .def(
          "estimate",
          [](const sensors::HueEstimator& self, const ColourMarkerReading& reading) { return self.estimate(reading); },
          py::arg("reading"), "The HueField of a reading.", py::call_guard<py::gil_scoped_release>());
}

}  // namespace touchstone::python
