// Height maps read further: materials (sensors/texture) and places on a map of an object (sensors/touch_map).

#include <pybind11/stl.h>

#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "core/error.h"
#include "core/units.h"
#include "python/src/ball_presses.h"
#include "python/src/bindings.h"
#include "python/src/estimator.h"
#include "sensors/texture/texture_model_file.h"
#include "sensors/touch_map/tactile_map_file.h"

namespace touchstone::python {
namespace {

using sensors::Registration;
using sensors::TextureModel;
using Textures = Guarded<TextureModel>;
using Map = Guarded<sensors::TactileMap>;

/// An array (height, width) of numbers, not large. @throws Error naming `what`
py::array plane_from(const py::handle& value, const char* what) {
  constexpr py::ssize_t kMost = 8192;
  const auto array = py::array::ensure(value);
  if (!array) fail("{}: an array (height, width) is needed", what);
  if (std::string("fiub").find(array.dtype().kind()) == std::string::npos) fail("{}: numbers are needed", what);
  if (array.ndim() != 2 || array.size() == 0) fail("{}: an array (height, width) is needed", what);
  if (array.shape(0) > kMost || array.shape(1) > kMost) {
    fail("{}: is {} x {}; allowed are at most {} a side", what, array.shape(0), array.shape(1), kMost);
  }
  return array;
}

/// A copy as 32 bit floats. @throws Error naming `what` unless it's an array (height, width) of finite numbers
cv::Mat heights_from(const py::handle& value, const char* what) {
  const py::array_t<double, py::array::c_style | py::array::forcecast> numbers(plane_from(value, what));
  const cv::Mat given(static_cast<int>(numbers.shape(0)), static_cast<int>(numbers.shape(1)), CV_64FC1,
                      const_cast<double*>(numbers.data()));  // which nobody writes to
  cv::Mat heights;
  given.convertTo(heights, CV_32F);
  if (!cv::checkRange(heights)) fail("{}: has heights that aren't finite", what);
  return heights;
}

/// @param contact a mask of the heights' size, or None: the higher part
sensors::TouchImage touch_from(const py::object& height_mm, const py::object& contact, const py::object& mm_per_px) {
  sensors::TouchImage touch{heights_from(height_mm, "height_mm"), {}, number_from(mm_per_px, "mm_per_px")};
  require_scale(touch.mm_per_px);
  const cv::Size size = touch.height_mm.size();
  if (contact.is_none()) {
    touch.contact = sensors::higher_part(touch.height_mm);
    return touch;
  }
  const py::array_t<bool, py::array::c_style | py::array::forcecast> mask(plane_from(contact, "contact"));
  if (mask.shape(0) != size.height || mask.shape(1) != size.width) {
    fail("contact: is {} x {}, the heights are {} x {}", mask.shape(0), mask.shape(1), size.height, size.width);
  }
  touch.contact.create(size, CV_8UC1);
  const bool* from = mask.data();
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) touch.contact.at<std::uint8_t>(v, u) = *from++ ? 255 : 0;
  }
  return touch;
}

struct NamedMatch {
  std::string material;
  sensors::TextureMatch match;
};

std::shared_ptr<Textures> make_textures(const py::object& mm_per_px, const py::object& grey_step_mm) {
  TextureModel model;
  model.mm_per_px = number_from(mm_per_px, "mm_per_px");
  model.gray_step_mm = number_from(grey_step_mm, "grey_step_mm");
  require_scale(model.mm_per_px);
  if (const std::string fault = fault_of(model); !fault.empty()) fail("texture model: {}", fault);
  return std::make_shared<Textures>(model);
}

void bind_textures(py::module_& module) {
  py::class_<NamedMatch>(module, "TextureMatch", "The material of one height map.")
      .def_property_readonly(
          "material", [](const NamedMatch& self) { return text_of(self.material); }, "Its name.")
      .def_property_readonly(
          "votes", [](const NamedMatch& self) { return self.match.votes; },
          "Of the three nearest samples, how many are of this material.")
      .def_property_readonly(
          "distance", [](const NamedMatch& self) { return self.match.distance; },
          "Hellinger, 0 to 1, to the nearest sample: a large one means an unknown material.");
  py::class_<Textures, std::shared_ptr<Textures>>(
      module, "TextureModel",
      "Materials by the texture of their height maps. TextureModel(*, mm_per_px, grey_step_mm=0.002)\n\n"
      "mm_per_px: of the maps, which the texture isn't invariant to. grey_step_mm: height of a grey level, above the "
      "maps' noise and below the relief.")
      .def(py::init(&make_textures), py::kw_only(), py::arg("mm_per_px"), py::arg("grey_step_mm") = 0.002)
      .def_static(
          "load",
          [](const py::object& path) {
            return std::make_shared<Textures>(sensors::load_texture_model(needed_path(path, "path")));
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save",
          [](Textures& self, const py::object& path) {
            const std::string file = needed_path(path, "path");
            self.with([&](const TextureModel& model) { return sensors::save(model, file), 0; });
          },
          py::arg("path"), "Writes it, whole or not at all.")
      .def(
          "learn",
          [](Textures& self, const py::object& material, const py::object& height_mm) {
            const std::string name = text_from(material, "material");
            const cv::Mat heights = heights_from(height_mm, "height_mm");
            self.with([&](TextureModel& model) { return sensors::learn_texture(model, name, heights), 0; });
          },
          py::arg("material"), py::arg("height_mm"), "A sample more: (height, width), mm.")
      .def(
          "classify",
          [](Textures& self, const py::object& height_mm, const py::object& mm_per_px) {
            const cv::Mat heights = heights_from(height_mm, "height_mm");
            const double pitch = mm_per_px.is_none() ? 0.0 : number_from(mm_per_px, "mm_per_px");
            if (!mm_per_px.is_none()) require_scale(pitch);
            return self.with([&](const TextureModel& model) {
              const sensors::TextureMatch match = sensors::classify_texture(model, heights, pitch);
              return NamedMatch{model.classes[static_cast<std::size_t>(match.label)], match};
            });
          },
          py::arg("height_mm"), py::kw_only(), py::arg("mm_per_px") = py::none(),
          "The TextureMatch of a height map. mm_per_px: must be the model's, where it's given.")
      .def_property_readonly(
          "materials",
          [](Textures& self) {
            const auto names = self.with([](const TextureModel& model) { return model.classes; });
            py::list list;
            for (const std::string& name : names) list.append(text_of(name));
            return list;
          },
          "Their names.")
      .def_property_readonly(
          "samples",
          [](Textures& self) { return self.with([](const TextureModel& model) { return model.labels.size(); }); },
          "That it has learnt from.")
      .def_property_readonly(
          "mm_per_px",
          [](Textures& self) { return self.with([](const TextureModel& model) { return model.mm_per_px; }); },
          "Of its maps.");
}

void bind_places(py::module_& module) {
  py::class_<Registration>(module, "Registration", "Where a touch lies on a map, or why that can't be said.")
      .def_property_readonly("localised", &Registration::localised, "Its place is known.")
      .def_property_readonly(
          "outcome", [](const Registration& self) { return sensors::name_of(self.outcome); },
          "'localised', 'no contact', 'no texture', 'no match', 'low confidence', 'ambiguous', 'disagrees'.")
      .def_property_readonly(
          "place_mm",
          [](const Registration& self) -> py::object {
            if (!self.localised()) return py::none();
            return small_array(self.to_from_from.translation);
          },
          "(2,): the touch's middle on the map, from the middle of the map's first touch; None if not localised.")
      .def_property_readonly(
          "angle_deg",
          [](const Registration& self) -> std::optional<double> {
            if (!self.localised()) return std::nullopt;
            return self.to_from_from.angle / kRadiansPerDegree;
          },
          "How far the touch is turned on the map, from x (right) towards y (down); None if not localised.")
      .def_readonly("confidence", &Registration::confidence,
                    "0 to 1: how nearly the features' pairs are a turn and a shift.")
      .def_readonly("inliers", &Registration::inliers, "Pairs of features that agree.")
      .def_readonly("correlation", &Registration::correlation, "Of the relief with the map's, there.")
      .def_readonly("overlap", &Registration::overlap, "Share of the touch that lies on the map.");
  py::class_<Map, std::shared_ptr<Map>>(module, "TactileMap",
                                        "A map of an object's face that grows by touches, and the places of touches on "
                                        "it. Its frame is the first touch's: mm from the picture's middle.")
      .def(py::init([] { return std::make_shared<Map>(sensors::TactileMap()); }))
      .def_static(
          "load",
          [](const py::object& path) {
            const std::string file = needed_path(path, "path");
            return unlocked(
                [&] { return std::make_shared<Map>(sensors::TactileMap(sensors::load_tactile_map(file))); });
          },
          py::arg("path"), "Reads a map's file.")
      .def(
          "save",
          [](Map& self, const py::object& path) {
            const std::string file = needed_path(path, "path");
            self.with([&](const sensors::TactileMap& map) {
              if (map.empty()) fail("the map is empty: there is nothing to save");
              return sensors::save(map.data(), file), 0;
            });
          },
          py::arg("path"), "Writes it, whole or not at all.")
      .def(
          "add",
          [](Map& self, const py::object& height_mm, const py::object& mm_per_px, const py::object& contact) {
            const sensors::TouchImage touch = touch_from(height_mm, contact, mm_per_px);
            return self.with([&](sensors::TactileMap& map) { return map.add(touch); });
          },
          py::arg("height_mm"), py::kw_only(), py::arg("mm_per_px"), py::arg("contact") = py::none(),
          "Adds a touch if it is localised; the first one with contact is where the map begins. Returns a "
          "Registration.\n\n"
          "height_mm: (height, width), of a HeightEstimator with free borders. contact: a mask; None: the higher part.")
      .def(
          "localise",
          [](Map& self, const py::object& height_mm, const py::object& mm_per_px, const py::object& contact) {
            const sensors::TouchImage touch = touch_from(height_mm, contact, mm_per_px);
            return self.with([&](const sensors::TactileMap& map) { return map.localise(touch); });
          },
          py::arg("height_mm"), py::kw_only(), py::arg("mm_per_px"), py::arg("contact") = py::none(),
          "The Registration of a touch; the map stays as it is.")
      .def_property_readonly(
          "touches",
          [](Map& self) { return self.with([](const sensors::TactileMap& map) { return map.data().touches; }); },
          "That it is made of.")
      .def_property_readonly(
          "height_mm",
          [](Map& self) {
            return array_of(self.with([](const sensors::TactileMap& map) { return map.data().height_mm.clone(); }));
          },
          "float32: mean heights; 0 where never touched. None of an empty map.")
      .def_property_readonly(
          "origin_px",
          [](Map& self) {
            return small_array(self.with([](const sensors::TactileMap& map) { return map.data().frame.origin_px; }));
          },
          "(2,): column and row of the map's origin, whole numbers at pixels' centres.");
}

}  // namespace

void bind_surface(py::module_& module) {
  bind_textures(module);
  bind_places(module);
}

}  // namespace touchstone::python
