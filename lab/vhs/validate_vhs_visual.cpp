// What the vhs sensor's camera shows of the thing it touches [VisioHaptic2024, secs. 2.1, 2.2, 4.1 and 5.1, fig. 5]:
// the divisions of a rule, colours, brightness over the field, and a skin's marks under pressure.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "closed_forms/light_closed_forms.h"
#include "core/cie_colour.h"
#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "lab/validation/row_list.h"
#include "lab/validation/validation.h"
#include "lab/vhs/vhs_pictures.h"
#include "sensors/skin/colour_correction.h"
#include "sensors/skin/skin_marks.h"
#include "sim/files/srgb_reflectance.h"

namespace touchstone::lab {
namespace {

constexpr double kSubMillimetre_mm = 1.0;  // sec. 4.1 and 5
constexpr double kAllowedTransfer = 0.02;  // of the printed contrast, absolute
constexpr double kAllowedFalloff_percent = 1.0;
constexpr double kAllowedColour_de2000 = 5.0;  // as [ISO12647] lets printed solids be off (as CIE 1976's)
constexpr double kHalfGone = 0.5;
constexpr double kStays = 0.2;
constexpr double kSkins_percent = 95.0;
constexpr std::uint64_t kSeed = 9;

cv::Mat grey_picture(const cv::Mat& frame) {
  cv::Mat out;
  cv::cvtColor(frame, out, cv::COLOR_BGR2GRAY);
  out.convertTo(out, CV_32F);
  return out;
}

/// Irradiance of all bands together.
cv::Mat sum_of_bands(const cv::Mat& irradiance) {
  cv::Mat sum;
  cv::reduce(irradiance.reshape(1, static_cast<int>(irradiance.total())), sum, 1, cv::REDUCE_SUM);
  return sum.reshape(1, irradiance.rows);
}

sim::ObjectSpec card(double albedo) {
  sim::ObjectSpec object;
  object.name = "card";
  object.shape.type = sim::ShapeKind::box;
  object.shape.size_mm = {30, 30, 1};
  object.albedo = albedo;
  return object;
}

template <typename Kind>
sim::PrintLayer layer(Kind kind) {
  sim::PrintLayer out;
  out.kind = std::move(kind);
  return out;
}

// ---- a rule's divisions ----

/// One scale of a test rule: lines half as wide as the pitch, clear of the beads.
struct TestScale {
  double pitch_mm = 0.0;
  double y_mm = 0.0;  // of its middle
};

constexpr double kScaleHeight_mm = 1.4;
constexpr double kScaleHalf_mm = 6.5;  // along x, on either side
constexpr double kEdge_mm = 0.35;      // of a scale's height, left out: the hole's blur
constexpr double kLeastLeft = 0.1;  // of the printed contrast: the usual limit of resolution. Means over a scale tell
                                    // lines of a hundredth of that, which no eye sees
constexpr double kSlowest_per_mm = 0.7;
constexpr double kFastest_per_mm = 9.0;

sim::ObjectSpec test_rule(const std::vector<TestScale>& scales) {
  sim::ObjectSpec object = card(0.55);
  sim::RulePrint rule;
  for (const TestScale& scale : scales) {
    const int half = static_cast<int>(kScaleHalf_mm / scale.pitch_mm) + 2;
    rule.scales.push_back({scale.pitch_mm,
                           0.5 * scale.pitch_mm,
                           kScaleHeight_mm,
                           2 * half + 1,
                           {-half * scale.pitch_mm, scale.y_mm - 0.5 * kScaleHeight_mm}});
  }
  object.print = {layer(rule)};
  return object;
}

/// Contrast of the printed lines' first wave: of a square wave of two reflectances.
double printed_contrast() {
  constexpr double kSteel = 0.55;
  constexpr double kInk = 0.05;
  return 2.0 / kPi * (kSteel - kInk) / (0.5 * (kSteel + kInk));
}

/// As many whole divisions as a length holds, about the middle.
RuleProfile scale_profile(const cv::Mat& picture, const VhsView& view, const TestScale& scale, double half_mm) {
  const double half = std::floor(half_mm / scale.pitch_mm) * scale.pitch_mm;
  return profile_along_x(picture, view, -half, half, scale.y_mm, 0.5 * kScaleHeight_mm - kEdge_mm);
}

constexpr std::array<double, 4> kHeights_mm = {-5.3, -3.6, 3.6, 5.3};

std::vector<TestScale> scales_from(const std::vector<double>& pitches, std::size_t first) {
  std::vector<TestScale> scales;
  for (std::size_t k = 0; k < kHeights_mm.size(); ++k) scales.push_back({pitches[first + k], kHeights_mm[k]});
  return scales;
}

bool is_read(const cv::Mat& frame, const VhsView& view, const TestScale& scale) {
  const RuleProfile seen = scale_profile(grey_picture(frame), view, scale, kScaleHalf_mm);
  const RuleReading reading = read_rule(seen, kSlowest_per_mm, kFastest_per_mm);
  return reads(reading, seen, scale.pitch_mm, 0.0) && reading.contrast >= kLeastLeft * printed_contrast();
}

/// What transfer_at and the pixel leave, over the places that a contrast is measured at.
double expected_transfer(const sim::DeviceSpec& device, const VhsView& view, const TestScale& scale, double half_mm) {
  constexpr int kPlaces = 7;
  const double per_mm = 1.0 / scale.pitch_mm;
  double sum = 0.0;
  for (int k = 0; k < kPlaces; ++k) {
    const double x = half_mm * (2.0 * (k + 0.5) / kPlaces - 1.0);
    sum += transfer_at(device, view, {x, scale.y_mm}, per_mm) / kPlaces;
  }
  PinholeOptics pixel_alone = optics_of(device);
  pixel_alone.hole_mm = 0.0;
  return sum * transfer_of_disc(pixel_alone, per_mm);
}

/// What Hopkins' function and the pixel leave on the axis, the mean over the bands' light.
double expected_transfer_with_diffraction(const sim::DeviceSpec& device, const TestScale& scale,
                                          const cv::Mat& irradiance, const render::Spectrum& wavelengths_nm) {
  const cv::Scalar light = cv::mean(irradiance);
  double sum = 0.0;
  double whole = 0.0;
  for (int band = 0; band < irradiance.channels() && band < 4; ++band) {
    sum += light[band] * transfer_with_diffraction(optics_of(device), 1.0 / scale.pitch_mm, wavelengths_nm[band]);
    whole += light[band];
  }
  return sum / whole;
}

/// What pictures of test rules show.
struct FineLines {
  double smallest_mm = std::numeric_limits<double>::infinity();  ///< division that is read, as are all coarser ones
  double worst = 0.0;  ///< largest difference of a contrast from what is expected, of the printed contrast
  ValidationSeries series;
};

/// `expected(scale, half_mm, picture)`: the part of the printed contrast that is expected within half_mm of the middle.
/// @pre pitches fall, a whole number of pictures
template <typename Expected>
FineLines read_lines(const ValidateOptions& options, sim::SceneSpec scene, const VhsView& view,
                     const std::vector<double>& pitches, const char* what, const Expected& expected) {
  FineLines found;
  found.series = {"divisions a mm", what, {}};
  bool all_so_far = true;
  for (std::size_t first = 0; first < pitches.size(); first += kHeights_mm.size()) {
    const std::vector<TestScale> scales = scales_from(pitches, first);
    scene.object = test_rule(scales);
    const VhsPicture picture = vhs_picture(scene, options.quick ? 16 : 32, options.cache, options.progress);
    const cv::Mat irradiance = sum_of_bands(picture.irradiance);
    for (const TestScale& scale : scales) {
      all_so_far = all_so_far && is_read(picture.frame, view, scale);
      if (all_so_far) found.smallest_mm = std::min(found.smallest_mm, scale.pitch_mm);
      // Farther out the foil leaves less of the hole open, and fine lines are seen better.
      constexpr double kNear_mm = 3.0;
      const RuleProfile light = scale_profile(irradiance, view, scale, kNear_mm);
      const double left = contrast_at(light, 1.0 / scale.pitch_mm, 0.0) / printed_contrast();
      found.series.points.emplace_back(1.0 / scale.pitch_mm, left);
      found.worst = std::max(found.worst, std::abs(left - expected(scale, kNear_mm, picture)));
    }
  }
  return found;
}

void add_diffraction_rows(const ValidateOptions& options, sim::SceneSpec scene, RowList& rows) {
  constexpr double kAllowed = 0.05;  // of what lies off the axis, where the foil hides a part of the hole
  const VhsView view(scene.device, 0.0);
  const std::vector<double> pitches = options.quick
                                          ? std::vector<double>{1.0, 0.6, 0.5, 0.4, 0.4, 0.33, 0.3, 0.25}
                                          : std::vector<double>{1.0,  0.6,  0.5,  0.45, 0.4,  0.36, 0.33, 0.3,
                                                                0.27, 0.25, 0.22, 0.2,  0.18, 0.16, 0.14, 0.12};
  scene.effects.diffraction = sim::Switch::on;
  const render::Spectrum wavelengths = sim::make_plan(scene).bands.centres_nm;
  const FineLines found =
      read_lines(options, scene, view, pitches, "contrast left with diffraction",
                 [&](const TestScale& scale, double, const VhsPicture& picture) {
                   return expected_transfer_with_diffraction(scene.device, scale, picture.irradiance, wavelengths);
                 });
  rows.add_bounded("smallest_division_diffraction_mm",
                   "the same with the hole's diffraction: at this Fresnel number, about 1, it sharpens", "mm",
                   Better::lower, kSubMillimetre_mm, true, found.smallest_mm);
  ValidationRow& transfer = rows.add("transfer_error_diffraction",
                                     "largest difference of the contrast of fine lines from Hopkins' transfer function "
                                     "on the axis and the pixel, of the printed contrast",
                                     "1", found.worst, Better::lower, found.worst <= kAllowed);
  transfer.reference = kAllowed;
  transfer.series = found.series;
}

void add_rule_rows(const ValidateOptions& options, RowList& rows) {
  sim::SceneSpec scene = sim::read_scene(options.scenes / "vhs" / "steel-rule.yaml");
  const VhsView view(scene.device, 0.0);
  const std::vector<double> pitches =
      options.quick ? std::vector<double>{1.0, 0.6, 0.5, 0.4}
                    : std::vector<double>{1.0, 0.8, 0.7, 0.6, 0.55, 0.5, 0.48, 0.46, 0.44, 0.42, 0.4, 0.35};
  const FineLines found = read_lines(options, scene, view, pitches, "contrast left",
                                     [&](const TestScale& scale, double half_mm, const VhsPicture&) {
                                       return expected_transfer(scene.device, view, scale, half_mm);
                                     });
  rows.add_bounded("smallest_division_mm",
                   "smallest division of a rule that is read through the gel: a tenth of its contrast left, lines "
                   "counted right and dark where they are, as are all coarser ones",
                   "mm", Better::lower, kSubMillimetre_mm, true, found.smallest_mm);
  ValidationRow& transfer = rows.add("transfer_error",
                                     "largest difference of the contrast of fine lines from what the geometry of "
                                     "hole, foil, faces and pixel leaves, of the printed contrast",
                                     "1", found.worst, Better::lower, found.worst <= kAllowedTransfer);
  transfer.reference = kAllowedTransfer;
  transfer.series = found.series;
  add_diffraction_rows(options, scene, rows);
}

// ---- brightness over the field ----

/// E by the closed form of a hole in a foil, of a luminous face behind glass, by that in the picture's middle.
double falloff_at(const sim::DeviceSpec& device, double angle) {
  const auto& pinhole = std::get<sim::PinholeSpec>(device.camera->optics);
  const double hole = pinhole.hole_diameter_um / kMicrometresPerMillimetre;
  const double foil = pinhole.foil_thickness_um / kMicrometresPerMillimetre;
  // Both faces of the plate, without what goes to and fro: the luminous face reflects nothing.
  const auto fresnel = [](double n1, double n2, double sine) {  // `sine` in n1
    const double c1 = std::sqrt(1.0 - sine * sine);
    const double c2 = std::sqrt(1.0 - std::pow(n1 / n2 * sine, 2));
    const double s = (n1 * c1 - n2 * c2) / (n1 * c1 + n2 * c2);
    const double p = (n1 * c2 - n2 * c1) / (n1 * c2 + n2 * c1);
    return 0.5 * (s * s + p * p);
  };
  const auto passed = [&](double at) {
    const double sine = std::sin(at);
    const double glass = device.plate.refractive_index;
    return (1.0 - fresnel(1.0, glass, sine)) * (1.0 - fresnel(glass, device.gel.refractive_index, sine / glass));
  };
  const auto light = [&](double at) {
    return closed_forms::pinhole_irradiance(1.0, hole, pinhole.hole_to_sensor_mm, at, foil) * passed(at);
  };
  return light(angle) / light(0.0);
}

void add_falloff_rows(const ValidateOptions& options, RowList& rows) {
  sim::SceneSpec scene = sim::read_scene(options.scenes / "vhs" / "steel-rule.yaml");
  scene.object = card(0.0);
  scene.object.radiance = 10.0;  // even from everywhere, so that lamps don't matter
  scene.device.beads.reset();
  const VhsPicture picture = vhs_picture(scene, 16, options.cache, options.progress);
  const cv::Mat light = sum_of_bands(picture.irradiance);
  const double pitch = scene.device.camera->pixel_pitch_um / kMicrometresPerMillimetre;
  const double to_sensor = std::get<sim::PinholeSpec>(scene.device.camera->optics).hole_to_sensor_mm;
  // Means over rings of 20 pixels; the last one are the corners.
  constexpr double kRing_px = 20.0;
  const auto rings = static_cast<std::size_t>(std::hypot(0.5 * light.cols, 0.5 * light.rows) / kRing_px);
  std::vector<double> sums(rings, 0.0);
  std::vector<double> expected(rings, 0.0);
  std::vector<int> counts(rings, 0);
  for (int row = 0; row < light.rows; ++row) {
    for (int column = 0; column < light.cols; ++column) {
      const double away = std::hypot(column + 0.5 - 0.5 * light.cols, row + 0.5 - 0.5 * light.rows);
      const auto ring = static_cast<std::size_t>(away / kRing_px);
      if (ring >= rings) continue;
      sums[ring] += light.at<float>(row, column);
      expected[ring] += falloff_at(scene.device, std::atan(away * pitch / to_sensor));
      ++counts[ring];
    }
  }
  const double middle = sums[0] / expected[0];
  double worst = 0.0;
  ValidationSeries series{"px from the middle", "brightness by that in the middle", {}};
  for (std::size_t k = 0; k < rings; ++k) {
    worst = std::max(worst, std::abs(sums[k] / expected[k] / middle - 1.0));
    series.points.emplace_back((static_cast<double>(k) + 0.5) * kRing_px, sums[k] / counts[k] / middle);
  }
  const double corner = sums.back() / counts.back() / middle;
  const double reference = expected.back() / counts.back();
  ValidationRow& row =
      rows.add("falloff", "brightness of an even luminous face at the picture's corners by that in its middle", "1",
               corner, Better::near, std::abs(corner / reference - 1.0) <= kAllowedFalloff_percent / 100);
  row.reference = reference;
  row.series = std::move(series);
  rows.add_bounded("falloff_error_percent",
                   "largest difference of that brightness from the closed form of a hole in a foil behind glass", "%",
                   Better::lower, kAllowedFalloff_percent, false, 100 * worst);
}

// ---- colours ----

struct Patch {
  Eigen::Vector2d centre_mm;
  double radius_mm = 0.0;  // of what is looked at: the disc less the blur
  Eigen::Vector3d srgb;
};

constexpr double kBlur_mm = 0.3;

std::vector<Patch> patches_of(const std::vector<sim::HueCirclePrint>& circles) {
  std::vector<Patch> patches;
  for (const sim::HueCirclePrint& circle : circles) {
    for (int k = 0; k < circle.patches; ++k) {
      patches.push_back({disc_centre(circle, k), 0.5 * circle.diameter_mm - kBlur_mm, disc_srgb(circle, k)});
    }
  }
  return patches;
}

sim::ObjectSpec printed_card(const std::vector<sim::HueCirclePrint>& circles) {
  sim::ObjectSpec object = card(0.85);
  for (const sim::HueCirclePrint& circle : circles) object.print.push_back(layer(circle));
  return object;
}

sim::HueCirclePrint circle(int patches, double radius, double diameter, double saturation, double lightness,
                           double first_hue = 0.0, Eigen::Vector2d centre = {0, 0}) {
  return {patches, radius, diameter, saturation, lightness, first_hue, centre};
}

struct ColourErrors {
  double with_field = 0.0, without_field = 0.0;
};

void add_colour_rows(const ValidateOptions& options, RowList& rows) {
  sim::SceneSpec scene = sim::read_scene(options.scenes / "vhs" / "hue-circle.yaml");
  const VhsView view(scene.device, 0.0);
  const int paths = options.quick ? 16 : 32;
  const auto frame_of = [&](const sim::ObjectSpec& object) {
    scene.object = object;
    return vhs_picture(scene, paths, options.cache, options.progress).frame;
  };
  const cv::Mat white = frame_of(card(0.85));
  const sensors::FlatField field = sensors::flat_field({&white, 1}, 4.0);

  // What the matrix is learned on: other hues, saturations and lightnesses, and greys.
  const std::vector<sim::HueCirclePrint> known = {
      circle(10, 3.6, 1.4, 0.4, 0.45, 15), circle(14, 5.5, 1.4, 0.9, 0.4, 7),
      circle(1, 1.41, 1.2, 0.0, 0.25, 0, {0.41 - 1.0, 1}), circle(1, 1.41, 1.2, 0.0, 0.5, 0, {0.41 - 3.0, -1}),
      circle(1, 1.41, 1.2, 0.0, 0.75, 0, {0.41 - 1.0, -1})};
  const cv::Mat chart = frame_of(printed_card(known));
  const auto measured = [&](const cv::Mat& frame, const Patch& patch, bool with_field) {
    const cv::Mat mask = view.disc_mask(patch.centre_mm, patch.radius_mm);
    return with_field ? sensors::mean_of_white(frame, field, mask) : sensors::mean_of_one_white(frame, field, mask);
  };
  const auto learn = [&](bool with_field) {
    const std::vector<Patch> patches = patches_of(known);
    Eigen::MatrixX3d rgb(std::ssize(patches), 3);
    Eigen::MatrixX3d xyz(std::ssize(patches), 3);
    for (Eigen::Index k = 0; k < rgb.rows(); ++k) {
      const Patch& patch = patches[static_cast<std::size_t>(k)];
      rgb.row(k) = measured(chart, patch, with_field);
      xyz.row(k) = xyz_from_linear_srgb(linear_from_srgb(patch.srgb));
    }
    return sensors::fit_colour_matrix(rgb, xyz);
  };
  const sensors::ColourMatrix matrix = learn(true);
  const sensors::ColourMatrix plain = learn(false);

  const auto errors = [&](const cv::Mat& frame, const std::vector<Patch>& patches) {
    ColourErrors mean;
    const double share = 1.0 / static_cast<double>(patches.size());
    for (const Patch& patch : patches) {
      const Eigen::Vector3d truth = lab_from_srgb(patch.srgb);
      mean.with_field += share * ciede2000(matrix.lab(measured(frame, patch, true)), truth);
      mean.without_field += share * ciede2000(plain.lab(measured(frame, patch, false)), truth);
    }
    return mean;
  };
  const sim::HueCirclePrint inner = circle(12, 3.6, 1.4, 0.7, 0.5);
  const sim::HueCirclePrint outer = circle(16, 5.5, 1.4, 0.7, 0.5);
  const cv::Mat rings = frame_of(printed_card({inner, outer}));
  const ColourErrors centre = errors(rings, patches_of({inner}));
  const ColourErrors edge = errors(rings, patches_of({outer}));
  std::vector<sim::HueCirclePrint> corners;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) corners.push_back(circle(6, 1.4, 1.2, 0.7, 0.5, 0, {6.5 * x, 4.3 * y}));
  }
  const ColourErrors corner = errors(frame_of(printed_card(corners)), patches_of(corners));

  // The same colours as single inks' spectra: what a chart of another printer is worth.
  sim::ObjectSpec single_inks = card(0.85);
  sim::SkinPrint discs;
  for (const Patch& patch : patches_of({inner, outer})) {
    sim::Colour colour;
    colour.curve = sim::single_ink_reflectance(patch.srgb);
    discs.patches.push_back(
        {sim::LesionKind::purpura, patch.centre_mm, 2.0 * (patch.radius_mm + kBlur_mm), 0.0, colour});
  }
  single_inks.print = {layer(discs)};
  const ColourErrors others = errors(frame_of(single_inks), patches_of({inner, outer}));

  const double mean = (centre.with_field + edge.with_field + corner.with_field) / 3.0;
  const double mean_without = (centre.without_field + edge.without_field + corner.without_field) / 3.0;
  const auto add = [&](const char* id, const char* title, double ours) {
    rows.add_bounded(id, title, "CIEDE2000", Better::lower, kAllowedColour_de2000, false, ours);
  };
  add("color_error_de2000",
      "mean colour error of a printed hue circle through the gel, after a flat field and a 3 x 3 matrix from other "
      "patches: centre, edge and corners alike",
      mean);
  add("color_error_centre_de2000", "the same 3.6 mm from the middle", centre.with_field);
  add("color_error_edge_de2000", "the same 5.5 mm from the middle", edge.with_field);
  add("color_error_corner_de2000", "the same in the corners, 6.5 to 9 mm from the middle", corner.with_field);
  add("color_error_other_inks_de2000",
      "the same colours, centre and edge, of inks with other spectra than those that the matrix was learned on",
      others.with_field);
  ValidationRow& row =
      rows.add("color_error_no_flat_field_de2000", "the mean without a flat field; the reference is with it",
               "CIEDE2000", mean_without, Better::higher, mean_without > mean);
  row.reference = mean;
}

// ---- a skin's marks ----

/// A frame's mark found nearest to a place of the object.
const sensors::SkinMark* mark_near(const std::vector<sensors::SkinMark>& marks, const Eigen::Vector2d& pixel) {
  constexpr double kNear_px = 40.0;
  const sensors::SkinMark* nearest = nullptr;
  double least = kNear_px;
  for (const sensors::SkinMark& mark : marks) {
    const double away = (mark.centre - pixel).norm();
    if (away < least) {
      least = away;
      nearest = &mark;
    }
  }
  return nearest;
}

const sim::SkinPrint& skin_of(const sim::ObjectSpec& object) {
  return std::get<sim::SkinPrint>(object.print.front().kind);
}

/// A skin of another tone with marks of other strengths, sizes and places within the contact.
sim::ObjectSpec random_skin(const sim::ObjectSpec& like, int number) {
  RandomStream random(kSeed, static_cast<std::uint64_t>(number), Purpose::kPlacement);
  sim::ObjectSpec object = like;
  auto& skin = std::get<sim::SkinPrint>(object.print.front().kind);
  const double tone = 0.75 + 0.35 * random.uniform();
  const auto scaled = [](sim::Colour colour, double by) {
    for (double& value : colour.curve->values) value = std::min(1.0, value * by);
    return colour;
  };
  object.albedo = scaled(object.albedo, tone);
  for (sim::SkinPatch& patch : skin.patches) {
    patch.colour = scaled(patch.colour, tone * (0.85 + 0.3 * random.uniform()));
    patch.diameter_mm = 2.0 + 1.2 * random.uniform();
    patch.centre_mm.x() = (patch.centre_mm.x() < 0.0 ? -1.0 : 1.0) * (3.6 + 0.6 * random.uniform());
    patch.centre_mm.y() = 2.0 * random.uniform() - 1.0;
  }
  if (random.uniform() < 0.5) std::swap(skin.patches[0].kind, skin.patches[1].kind);
  if (skin.patches[0].kind != sim::LesionKind::erythema) std::swap(skin.patches[0].colour, skin.patches[1].colour);
  return object;
}

void add_skin_rows(const ValidateOptions& options, RowList& rows) {
  sim::SceneSpec scene = sim::read_scene(options.scenes / "vhs" / "skin.yaml");
  const VhsView view(scene.device, 0.0);
  const sim::ObjectSpec shipped = scene.object;
  const int skins = options.quick ? 1 : 8;
  const int last = scene.motion.frame_count() - 1;
  int right = 0;
  int all = 0;
  for (int number = 0; number < skins; ++number) {
    scene.object = number == 0 ? shipped : random_skin(shipped, number);
    scene.seed = kSeed + static_cast<std::uint64_t>(number);
    const std::vector<VhsPicture> pictures = vhs_pictures(scene, {0, last}, 16, options.cache, options.progress);
    const std::vector<sensors::SkinMark> marks = sensors::skin_marks(pictures[0].frame, pictures[1].frame);
    for (const sim::SkinPatch& patch : skin_of(scene.object).patches) {
      const bool fades = patch.kind == sim::LesionKind::erythema;
      const sensors::SkinMark* mark = mark_near(marks, view.pixel_of(patch.centre_mm));
      ++all;
      if (mark != nullptr && mark->kind == (fades ? sensors::SkinMarkKind::erythema : sensors::SkinMarkKind::purpura)) {
        ++right;
      }
      if (number != 0) continue;
      const double gone = mark != nullptr ? mark->blanched : std::numeric_limits<double>::quiet_NaN();
      if (fades) {
        rows.add_bounded("erythema_blanches",
                         "part of an erythema's redness, above the skin's round it, that 5 N press out", "1",
                         Better::higher, kHalfGone, false, gone);
      } else {
        rows.add_bounded("purpura_stays", "the same of a purpura", "1", Better::lower, kStays, false, gone);
      }
    }
  }
  rows.add_bounded("marks_distinguished_percent",
                   "marks of skins of several tones that the estimator calls rightly erythema or purpura", "%",
                   Better::higher, kSkins_percent, false, 100.0 * right / all);
}

}  // namespace

std::vector<ValidationRow> validate_vhs_visual(const ValidateOptions& options) {
  RowList rows("vhs.visual.", options, RowList::Since::last_row);
  add_falloff_rows(options, rows);
  add_rule_rows(options, rows);
  add_colour_rows(options, rows);
  add_skin_rows(options, rows);
  return rows.rows();
}

}  // namespace touchstone::lab
