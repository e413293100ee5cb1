// What a clear gel touches: colours (sensors/skin/colour_model.h), marks of skin (sensors/skin/skin_marks.h), forces
// over time as pictures of their frequencies (sensors/skin/force_spectrogram.h), and softness
// (sensors/skin/softness_model.h).

#include <pybind11/stl.h>

#include <cmath>
#include <memory>
#include <numeric>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/error.h"
#include "python/src/bindings.h"
#include "sensors/skin/colour_model.h"
#include "sensors/skin/force_spectrogram.h"
#include "sensors/skin/skin_marks.h"
#include "sensors/skin/softness_model.h"

namespace touchstone::python {
namespace {

using sensors::ColourModel;
using sensors::SkinMark;
using sensors::SoftnessModel;

/// A part of pictures of a size: a mask (height, width), or (left, top, width, height). @throws Error naming `what`
cv::Mat region_from(const py::handle& value, const cv::Size& size, const char* what) {
  const auto array = py::array::ensure(value);
  if (!array) fail("{}: a mask (height, width) or (left, top, width, height) is needed", what);
  const char kind = array.dtype().kind();
  if (array.ndim() == 1) {
    if (array.shape(0) != 4 || (kind != 'i' && kind != 'u')) {
      fail("{}: a rectangle is four whole numbers (left, top, width, height)", what);
    }
    const py::sequence numbers = array.attr("tolist")();
    const auto side = [&](std::size_t at) { return whole_number_from<int>(numbers[at], what); };
    return sensors::rectangle_mask(size, {side(0), side(1), side(2), side(3)});
  }
  if (array.ndim() != 2 || (kind != 'b' && kind != 'u' && kind != 'i')) {
    fail("{}: a mask must be (height, width), of bool or whole numbers", what);
  }
  if (array.shape(0) != size.height || array.shape(1) != size.width) {
    fail("{}: a mask of {} x {}, the pictures are {} x {}", what, array.shape(1), array.shape(0), size.width,
         size.height);
  }
  const py::array_t<bool, py::array::c_style | py::array::forcecast> mask(array);
  cv::Mat out(size, CV_8UC1);
  const bool* from = mask.data();
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) out.at<std::uint8_t>(v, u) = *from++ ? 255 : 0;
  }
  return out;
}

/// @param patches (frame, region, lab) each
py::tuple calibrate_colour(const py::object& card, const py::object& patches, const py::object& smooth_px) {
  const std::vector<Picture> white = pictures_from(card, "card");
  const double smooth = number_from(smooth_px, "smooth_px");
  constexpr double kMostSmooth_px = 100.0;
  if (!(smooth >= 0.0 && smooth <= kMostSmooth_px)) {
    fail("smooth_px: {} is not allowed; allowed is 0 to {}", smooth, kMostSmooth_px);
  }
  std::vector<cv::Mat> pictures;
  for (const Picture& picture : white) pictures.push_back(picture.mat);
  const sensors::FlatField field = unlocked([&] { return sensors::flat_field(pictures, smooth); });
  std::vector<sensors::ColourPatch> seen;
  for_each_item(patches, "patches", [&](const py::object& one) {
    const py::sequence parts = sequence_from(one, "patches");
    if (parts.size() != 3) fail("patches: each must be (frame, region, lab)");
    const Picture frame = picture_from(parts[0], "patches: frame");
    const cv::Mat mask = region_from(parts[1], frame.mat.size(), "patches: region");
    const Eigen::Vector3d lab = vector3_from(parts[2], "patches: lab");
    seen.push_back({unlocked([&] { return sensors::mean_of_white(frame.mat, field, mask); }), lab});
  });
  std::vector<double> left_out;
  auto model = unlocked([&] {
    left_out = sensors::cross_validate_colour(seen);
    return std::make_shared<ColourModel>(sensors::calibrate_colour(field, seen));
  });
  py::dict report;
  report["mean_error_de2000"] = model->mean_error_de2000;
  report["largest_error_de2000"] = model->largest_error_de2000;
  report["left_out_de2000"] = small_array(Eigen::Map<const Eigen::VectorXd>(left_out.data(), std::ssize(left_out)));
  return py::make_tuple(model, report);
}

void bind_colours(py::module_& module) {
  py::class_<ColourModel, std::shared_ptr<ColourModel>>(
      module, "ColourModel",
      "Colours seen through a clear gel, by a white card and known patches; see calibrate_colour.")
      .def_static(
          "load",
          [](const py::object& path) {
            const std::string file = needed_path(path, "path");
            return unlocked([&] { return std::make_shared<ColourModel>(sensors::load_colour_model(file)); });
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save",
          [](const ColourModel& self, const py::object& path) {
            const std::string file = needed_path(path, "path");
            unlocked([&] { return sensors::save(self, file), 0; });
          },
          py::arg("path"), "Writes it, whole or not at all.")
      .def_property_readonly(
          "picture_shape",
          [](const ColourModel& self) { return py::make_tuple(self.field.white.rows, self.field.white.cols); },
          "(height, width) of the frames that it is for.")
      .def_property_readonly(
          "trusted", [](const ColourModel& self) { return bool_array_of(self.field.trusted / 255); },
          "(height, width) bool: where the white card was seen, not behind beads.")
      .def_readonly("patches", &ColourModel::patches, "That it was fitted to.")
      .def_readonly("mean_error_de2000", &ColourModel::mean_error_de2000, "Of these, CIEDE2000; 1 is just seen.")
      .def_readonly("largest_error_de2000", &ColourModel::largest_error_de2000, "Of these.")
      .def(
          "lab",
          [](const ColourModel& self, const py::object& frame, const py::object& region) {
            const Picture picture = picture_from(frame, "frame");
            const cv::Mat mask = region_from(region, picture.mat.size(), "region");
            return small_array(
                unlocked([&] { return Eigen::Vector3d(sensors::colour_of(self, picture.mat, mask).lab); }));
          },
          py::arg("frame"), py::arg("region"),
          "(3,): the mean colour of a part of a frame, CIE L*a*b* under D65. region: a mask (height, width), or (left, "
          "top, "
          "width, height) in pixels. Pixels behind beads and at 255 are left out.");
  module.def(
      "calibrate_colour", &calibrate_colour, py::arg("card"), py::arg("patches"), py::kw_only(),
      py::arg("smooth_px") = 4.0,
      "Makes a ColourModel of a white card and known patches: returns (ColourModel, report).\n\n"
      "card: pictures of an even white card through the gel, uint8 BGR, linear in light. patches: a list of (frame, "
      "region, lab), region as of ColourModel.lab, lab the known CIE L*a*b* under D65; three or more, of colours "
      "that differ. smooth_px: of the card. The report has the errors on these patches and on each left out, "
      "CIEDE2000.");
}

void bind_marks(py::module_& module) {
  py::class_<SkinMark>(module, "SkinMark", "A mark of skin, and whether it fades under pressure.")
      .def_property_readonly(
          "kind", [](const SkinMark& self) { return sensors::name_of(self.kind); },
          "'erythema' (fades), 'purpura' (stays), or 'unknown': a frame doesn't show it, or it isn't touched.")
      .def_property_readonly(
          "centre_px", [](const SkinMark& self) { return small_array(self.centre); }, "(2,): in the frame before.")
      .def_readonly("area_px", &SkinMark::area_px, "In the frame before.")
      .def_readonly("index_before", &SkinMark::index_before,
                    "Erythema index (100 log10 of red by green) less that of the skin round it.")
      .def_readonly("index_pressed", &SkinMark::index_pressed, "The same under pressure.")
      .def_readonly("blanched", &SkinMark::blanched, "The part of index_before that is gone.")
      .def_readonly("darkened", &SkinMark::darkened, "Its red light under pressure by that before.");
  const sensors::SkinMarkSettings usual;
  module.def(
      "skin_marks",
      [](const py::object& before, const py::object& pressed, const py::object& smooth_px,
         const py::object& least_index, const py::object& least_area_px, const py::object& rim_px,
         const py::object& ring_px, const py::object& bead_px, const py::object& blanched_share,
         const py::object& wetted_part) {
        const Picture first = picture_from(before, "before"), second = picture_from(pressed, "pressed");
        sensors::SkinMarkSettings settings;
        settings.smooth_px = number_from(smooth_px, "smooth_px");
        settings.least_index = number_from(least_index, "least_index");
        settings.least_area_px = number_from(least_area_px, "least_area_px");
        settings.rim_px = number_from(rim_px, "rim_px");
        settings.ring_px = number_from(ring_px, "ring_px");
        settings.bead_px = number_from(bead_px, "bead_px");
        settings.blanched_share = number_from(blanched_share, "blanched_share");
        settings.wetted_part = number_from(wetted_part, "wetted_part");
        return unlocked([&] { return sensors::skin_marks(first.mat, second.mat, settings); });
      },
      py::arg("before"), py::arg("pressed"), py::kw_only(), py::arg("smooth_px") = usual.smooth_px,
      py::arg("least_index") = usual.least_index, py::arg("least_area_px") = usual.least_area_px,
      py::arg("rim_px") = usual.rim_px, py::arg("ring_px") = usual.ring_px, py::arg("bead_px") = usual.bead_px,
      py::arg("blanched_share") = usual.blanched_share, py::arg("wetted_part") = usual.wetted_part,
      "Marks of skin in a frame before pressure and one under it: a list of SkinMark, largest first.\n\n"
      "Frames: uint8 BGR, of one size, exposure and light, linear in light. smooth_px: against noise. least_index: how "
      "much redder than the skin a mark is. least_area_px: how large. rim_px: of a mark, left out. ring_px: of skin "
      "round "
      "it that it is compared with. bead_px: dark things narrower than this are beads. blanched_share: from this part "
      "lost on it's erythema. wetted_part: a mark that keeps more of its light isn't touched; 0: no check.");
}

py::tuple calibrate_softness(const py::object& presses, const py::object& levels, const py::object& rate_Hz,
                             const py::object& trigger_N, const py::object& highest_Hz, const py::object& units,
                             const py::object& networks, const py::object& threads) {
  std::vector<std::string> names;
  for_each_item(levels, "levels", [&](const py::object& one) {
    names.push_back(text_from(one, "levels"));
    if (names.back().empty()) fail("levels: number {} is empty", names.size() - 1);
  });
  std::vector<sensors::KnownSoftness> known;
  for_each_item(presses, "presses", [&](const py::object& one) {
    if (known.size() == names.size()) fail("levels: {} are given, there are more presses", names.size());
    known.push_back({row_from(one, "presses"), names[known.size()]});
  });
  if (known.size() != names.size()) fail("levels: {} are given, there are {} presses", names.size(), known.size());
  const double rate = number_from(rate_Hz, "rate_Hz");
  sensors::SoftnessTraining training = sensors::usual_softness_training();
  training.spectrogram.trigger_N = number_from(trigger_N, "trigger_N");
  training.highest_Hz = number_from(highest_Hz, "highest_Hz");
  if (!(training.highest_Hz >= 0.0)) fail("highest_Hz: {} is not allowed; allowed is 0 and more", training.highest_Hz);
  training.classifier.units = whole_number_from<int>(units, "units", 1, 200);
  training.networks = whole_number_from<int>(networks, "networks", 1, 100);
  const int at_once = whole_number_from<int>(threads, "threads", 0, 4096);
  const sensors::SoftnessCalibration made =
      unlocked([&] { return sensors::calibrate_softness(known, rate, training, at_once); });
  py::dict report;
  report["left_out_right"] = made.right / static_cast<double>(known.size());
  return py::make_tuple(std::make_shared<SoftnessModel>(made.model), report);
}

void bind_softness(py::module_& module) {
  py::class_<SoftnessModel, std::shared_ptr<SoftnessModel>>(
      module, "SoftnessModel", "How soft a pressed piece is, from the force over time; see calibrate_softness.")
      .def_static(
          "load",
          [](const py::object& path) {
            return std::make_shared<SoftnessModel>(sensors::load_softness_model(needed_path(path, "path")));
          },
          py::arg("path"), "Reads a model file.")
      .def(
          "save",
          [](const SoftnessModel& self, const py::object& path) { sensors::save(self, needed_path(path, "path")); },
          py::arg("path"), "Writes it, whole or not at all.")
      .def_readonly("rate_Hz", &SoftnessModel::rate_Hz, "Of the forces.")
      .def_property_readonly(
          "levels",
          [](const SoftnessModel& self) {
            py::list names;
            for (const std::string& name : self.networks.front().materials) names.append(text_of(name));
            return names;
          },
          "Their names.")
      .def(
          "classify",
          [](const SoftnessModel& self, const py::object& force_N) {
            const std::vector<double> forces = row_from(force_N, "force_N");
            return small_array(unlocked([&] { return sensors::classify(self, forces).probabilities; }));
          },
          py::arg("force_N"), "(levels,): the probability of each, of one press: forces evenly in time, rate_Hz.");
  module.def(
      "calibrate_softness", &calibrate_softness, py::arg("presses"), py::arg("levels"), py::arg("rate_Hz"),
      py::kw_only(), py::arg("trigger_N") = 0.1, py::arg("highest_Hz") = 0.0, py::arg("units") = 10,
      py::arg("networks") = 5, py::arg("threads") = 0,
      "Learns levels of softness from presses: returns (SoftnessModel, report).\n\n"
      "presses: of each the force over time, N, evenly, rate_Hz, from before the touch on. levels: the name of each; "
      "three presses or more of one. trigger_N: above the noise. highest_Hz: frequencies above are left out; 0: "
      "none. units: of each network's hidden layer. networks: whose answers are averaged. The report's left_out_right "
      "is the share named right of presses that were left out in turn.");
}

}  // namespace

void bind_skin(py::module_& module) {
  bind_colours(module);
  bind_marks(module);
  bind_softness(module);
  const sensors::ForceSpectrogramSettings usual;
  module.def(
      "force_spectrogram",
      [](const py::object& force_N, const py::object& rate_Hz, const py::object& window_s, const py::object& hop_s,
         const py::object& length_s, const py::object& trigger_N, const py::object& before_s,
         const py::object& floor_N) {
        const std::vector<double> waveform = row_from(force_N, "force_N");
        const double rate = number_from(rate_Hz, "rate_Hz");
        sensors::ForceSpectrogramSettings settings;
        settings.window_s = number_from(window_s, "window_s");
        settings.hop_s = number_from(hop_s, "hop_s");
        settings.length_s = number_from(length_s, "length_s");
        settings.trigger_N = number_from(trigger_N, "trigger_N");
        settings.before_s = number_from(before_s, "before_s");
        settings.floor_N = number_from(floor_N, "floor_N");
        Eigen::MatrixXd picture;
        const Eigen::VectorXd frequencies = unlocked([&] {
          picture = sensors::force_spectrogram(waveform, rate, settings);
          return sensors::spectrogram_frequencies(rate, settings);
        });
        return py::make_tuple(small_array(frequencies), small_array(picture));
      },
      py::arg("force_N"), py::arg("rate_Hz"), py::kw_only(), py::arg("window_s") = usual.window_s,
      py::arg("hop_s") = usual.hop_s, py::arg("length_s") = usual.length_s, py::arg("trigger_N") = usual.trigger_N,
      py::arg("before_s") = usual.before_s, py::arg("floor_N") = usual.floor_N,
      "A force's waveform as a picture of its frequencies over time: (frequencies_Hz, picture).\n\n"
      "picture: (frequencies, windows), log10 of each frequency's amplitude, N, with floor_N added. force_N: evenly in "
      "time, rate_Hz. It begins before_s before the force first stays above trigger_N, and is length_s long; windows "
      "of "
      "window_s are hop_s apart.");
}

}  // namespace touchstone::python
