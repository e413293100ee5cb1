#include "sim/scene/device.h"

#include <algorithm>
#include <cmath>

#include "fem/mesh/gel_body.h"
#include "sim/files/gltf_mesh.h"
#include "sim/files/image_file.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/device_pins.h"
#include "sim/scene/scattered_print.h"

namespace touchstone::render {

EnumNames<MarkShape> enum_names(MarkShape) {
  return {{"round", MarkShape::round}, {"square", MarkShape::square}};
}

}  // namespace touchstone::render

namespace touchstone::sim {
namespace {

/// `gel.shape` of the file.
enum class GelShape { slab, dome, fingertip, mesh };

EnumNames<GelShape> enum_names(GelShape) {
  return {
      {"slab", GelShape::slab}, {"dome", GelShape::dome}, {"fingertip", GelShape::fingertip}, {"mesh", GelShape::mesh}};
}

Allowed part_of_one() {
  return Allowed::within(0.0, 1.0);
}

Allowed gel_length() {
  return Allowed::above_up_to(0.0, 1000.0);
}

Allowed gel_length_or_none() {
  return Allowed::within(0.0, 1000.0);
}

void check_beads_fit(const DeviceSpec& device, const SourceLocation& where) {
  const BeadSpec& beads = *device.beads;
  const GelSpec& gel = device.gel;
  const double radius = beads.diameter_mm / 2;
  if (beads.depth_mm < radius || beads.depth_mm > gel.thickness_mm - radius) {
    fail_at(where, "beads.depth_mm: {} puts beads of diameter {} mm out of a gel of {} mm; allowed is from {} to {}",
            beads.depth_mm, beads.diameter_mm, gel.thickness_mm, radius, gel.thickness_mm - radius);
  }
  const SlabSpec* slab = gel.slab();
  if (slab == nullptr) return;  // set-up says where a bead isn't wholly inside the gel
  const double half_grid = (beads.grid - 1) * beads.spacing_mm / 2 + radius;
  if (half_grid > std::min(slab->size_x_mm, slab->size_y_mm) / 2) {
    fail_at(where, "beads: a grid of {0} x {0} at {1} mm doesn't fit in a gel of {2} x {3} mm", beads.grid,
            beads.spacing_mm, slab->size_x_mm, slab->size_y_mm);
  }
  if (beads.grid > 1 && beads.spacing_mm <= beads.diameter_mm) {
    fail_at(where, "beads.spacing_mm: {} lets beads of diameter {} mm overlap; it must be above that", beads.spacing_mm,
            beads.diameter_mm);
  }
}

/// The gel can be meshed as it is asked for.
void check_gel(DeviceSpec& device, const SourceLocation& where) {
  try {
    const fem::GelBody body = gel_body(device);
    fem::check(body);
    device.gel.thickness_mm = fem::thickness_of(body);
  } catch (const Error& error) {
    fail_at(where, "gel: {}", error.what());
  }
}

void check_camera_outside(const DeviceSpec& device, const SourceLocation& where) {
  const double plate_face = -device.gel.thickness_mm - device.plate.thickness_mm;
  const CameraSpec& camera = *device.camera;
  if (camera.position_mm.z() >= plate_face) {
    fail_at(where, "camera.{}: z = {} is not in front of the plate, whose lower face is at z = {}",
            std::holds_alternative<LensSpec>(camera.optics) ? "lens_position_mm" : "hole_position_mm",
            camera.position_mm.z(), plate_face);
  }
}

/// Does the straight line between two places pass a pad whose sides are clear, with all of it beyond one of them?
bool is_beside(const GelSpec& gel, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  if (gel.frame != GelFrame::clear || std::max(from.z(), to.z()) >= 0.0) return false;
  if (const SlabSpec* slab = gel.slab()) {
    for (const double side : {-1.0, 1.0}) {
      if (std::min(side * from.x(), side * to.x()) > slab->size_x_mm / 2) return true;
      if (std::min(side * from.y(), side * to.y()) > slab->size_y_mm / 2) return true;
    }
    return false;
  }
  const double radius = gel.dome() ? gel.dome()->base_radius_mm : gel.fingertip() ? gel.fingertip()->radius_mm : 0.0;
  const Eigen::Vector2d way = (to - from).head<2>();
  const double along =
      way.isZero() ? 0.0 : std::clamp(-way.dot(from.head<2>()) / way.squaredNorm(), 0.0, 1.0);  // to the nearest place
  return radius > 0.0 && (from.head<2>() + along * way).norm() > radius;
}

/// No lamp is in the gel; those with a lens are before the plate, the others may be in it, and LEDs beside clear sides.
void check_lamps_outside(const DeviceSpec& device, const SourceLocation& where) {
  const double gel_face = -device.gel.thickness_mm;
  const double plate_face = gel_face - device.plate.thickness_mm;
  for (const LampSpec& lamp : device.lamps) {
    const bool has_lens = lamp.type == LampType::spot || lamp.type == LampType::projector;
    const double z = std::max(lamp.position_mm.z(), lamp.type == LampType::led_strip ? lamp.to_mm.z() : -INFINITY);
    if (has_lens && z >= plate_face) {
      fail_at(where, "lamps: a lamp at z = {} is not in front of the plate, whose lower face is at z = {}", z,
              plate_face);
    }
    const bool strip = lamp.type == LampType::led_strip;
    if ((strip || lamp.type == LampType::led) &&
        is_beside(device.gel, lamp.position_mm, strip ? lamp.to_mm : lamp.position_mm)) {
      continue;
    }
    if (z >= gel_face) {
      fail_at(
          where,
          "lamps: a lamp at z = {} is in the gel, which begins at z = {}; LEDs and strips may stand so high beside a "
          "pad with gel.frame: clear, below z = 0",
          z, gel_face);
    }
  }
}

}  // namespace

EnumNames<GelFrame> enum_names(GelFrame) {
  return {{"painted", GelFrame::painted}, {"clear", GelFrame::clear}};
}

EnumNames<CoatingType> enum_names(CoatingType) {
  return {{"matt", CoatingType::matt}, {"metal", CoatingType::metal}};
}

EnumNames<PrintPattern> enum_names(PrintPattern) {
  return {{"grid", PrintPattern::grid}, {"scattered", PrintPattern::scattered}};
}

void fields(YamlReader& in, GelLayerSpec& layer) {
  in.optional("name", layer.name);
  in.required("thickness_mm", layer.thickness_mm, Allowed::above_up_to(0.0, 1000.0));
  in.required("youngs_modulus_MPa", layer.youngs_modulus_MPa, Allowed::above_up_to(0.0, 1e6));
  in.optional("poisson_ratio", layer.poisson_ratio, Allowed::within(0.0, 0.5));
}

void fields(YamlReader& in, RelaxationTermSpec& term) {
  in.required("share", term.share, Allowed::within(0.0, 1.0));
  in.required("time_s", term.time_s, Allowed::above(0.0));
}

void fields(YamlReader& in, SlabSpec& slab) {
  in.required("size_x_mm", slab.size_x_mm, gel_length());
  in.required("size_y_mm", slab.size_y_mm, gel_length());
}

void fields(YamlReader& in, DomeSpec& dome) {
  in.required("sphere_radius_mm", dome.sphere_radius_mm, Allowed::above_up_to(0.0, 1e5));
  in.required("base_radius_mm", dome.base_radius_mm, gel_length());
}

void fields(YamlReader& in, FingertipSpec& tip) {
  in.required("radius_mm", tip.radius_mm, gel_length());
  in.required("length_mm", tip.length_mm, gel_length_or_none());
  in.required("sleeve_mm", tip.sleeve_mm, gel_length_or_none());
}

void fields(YamlReader& in, GelMeshSpec& mesh) {
  std::string file;
  in.required("file", file);
  mesh.file = in.folder() / file;
  in.optional("mm_per_unit", mesh.mm_per_unit, Allowed::above(0.0));
  if (in.describing()) return;
  try {
    mesh.surface = std::make_shared<const GelSurface>(read_gltf_gel(mesh.file, mesh.mm_per_unit));
  } catch (const Error& error) {
    fail_at(in.where("file"), "gel.file: {}", error.what());
  }
}

void fields(YamlReader& in, GelSpec& gel) {
  auto shape = GelShape::slab;
  in.optional("shape", shape);
  switch (shape) {
    case GelShape::slab:
      fields(in, gel.shape.emplace<SlabSpec>());
      in.required("thickness_mm", gel.thickness_mm, gel_length());
      break;
    case GelShape::dome:
      fields(in, gel.shape.emplace<DomeSpec>());
      in.optional("thickness_mm", gel.thickness_mm, gel_length());
      break;
    case GelShape::fingertip:
      fields(in, gel.shape.emplace<FingertipSpec>());
      break;
    case GelShape::mesh:
      fields(in, gel.shape.emplace<GelMeshSpec>());
      break;
  }
  if (shape != GelShape::mesh) in.optional("layers", gel.layers);
  in.required("youngs_modulus_MPa", gel.youngs_modulus_MPa, Allowed::above_up_to(0.0, 1e6));
  in.optional("poisson_ratio", gel.poisson_ratio, Allowed::within(0.0, 0.5));
  in.optional("density_kg_m3", gel.density_kg_m3, Allowed::above_up_to(0.0, 1e5));
  in.optional("relaxation", gel.relaxation);
  in.optional("refractive_index", gel.refractive_index, Allowed::within(1.0, 4.0));
  in.optional("absorption_per_mm", gel.absorption_per_mm, Allowed::at_least(0.0));
  in.optional("scattering_per_mm", gel.scattering_per_mm, Allowed::within(0.0, 1000.0));
  in.optional("scattering_anisotropy", gel.scattering_anisotropy, Allowed::within(-0.999, 0.999));
  in.optional("frame", gel.frame);
  if (gel.frame == GelFrame::painted) in.optional("frame_albedo", gel.frame_albedo, part_of_one());
  double relaxing = 0.0;
  for (const RelaxationTermSpec& term : gel.relaxation) relaxing += term.share;
  if (relaxing >= 1.0) {
    fail_at(in.where("relaxation"), "relaxation: the shares sum to {}; something must last: allowed is below 1",
            relaxing);
  }
}

void fields(YamlReader& in, MeshSpec& mesh) {
  in.optional("fine_half_extent_mm", mesh.fine_half_extent_mm, Allowed::above(0.0));
  in.optional("fine_depth_mm", mesh.fine_depth_mm, Allowed::above(0.0));
  if (!in.has("force_error")) {
    in.optional("fine_mm", mesh.fine_mm, Allowed::above(0.0));
    in.optional("coarse_mm", mesh.coarse_mm, Allowed::at_least(mesh.fine_mm));
    return;
  }
  in.not_beside("fine_mm", {"force_error"});  // from which they are found
  in.not_beside("coarse_mm", {"force_error"});
  in.optional("force_error", mesh.force_error, Allowed::within(1e-4, 0.5));
  in.required("contact_radius_mm", mesh.contact_radius_mm,
              Allowed::above_up_to(0.0, mesh.fine_half_extent_mm.minCoeff()));
  in.optional("sharp_bodies", mesh.sharp_bodies);
}

void fields(YamlReader& in, BeadSpec& beads) {
  in.required("grid", beads.grid, Allowed::within(1, 100));
  in.required("spacing_mm", beads.spacing_mm, Allowed::above(0.0));
  in.required("diameter_mm", beads.diameter_mm, Allowed::above(0.0));
  in.required("depth_mm", beads.depth_mm, Allowed::above(0.0));
  in.optional("reflectance", beads.reflectance, part_of_one());
  in.optional("roughness", beads.roughness, Allowed::within(0.02, 1.0));
}

void fields(YamlReader& in, PlateSpec& plate) {
  in.required("thickness_mm", plate.thickness_mm, Allowed::above(0.0));
  in.required("refractive_index", plate.refractive_index, Allowed::within(1.0, 4.0));
}

void fields(YamlReader& in, PrintSpec& print) {
  in.optional("pattern", print.pattern);
  in.optional("seed", print.seed);
  in.optional("colour", print.colour, part_of_one());
  if (print.pattern == PrintPattern::scattered) {
    double spacing = 0.0;
    in.required("spacing_mm", spacing, Allowed::above(0.0));
    in.required("radius_mm", print.radius_mm, Allowed::above_up_to(0.0, kMostScatterRadii * spacing));
    print.spacing_mm = {spacing, spacing};
    in.required("diameter_mm", print.width_mm, Allowed::above_up_to(0.0, kScatterDistance * spacing));
    in.optional("diameter_spread", print.diameter_spread, Allowed::within(0.0, 0.5));
    return;
  }
  in.required("grid", print.grid, Allowed::within(1, 1000));
  in.required("spacing_mm", print.spacing_mm, Allowed::above(0.0));
  in.optional("shape", print.shape);
  in.required(print.shape == render::MarkShape::round ? "diameter_mm" : "side_mm", print.width_mm, Allowed::above(0.0));
  in.optional("jitter_mm", print.jitter_mm, Allowed::at_least(0.0));
}

void fields(YamlReader& in, CoatingSpec& coating) {
  in.required("type", coating.type);
  in.required(coating.type == CoatingType::matt ? "albedo" : "reflectance", coating.albedo, part_of_one());
  if (coating.type == CoatingType::metal) in.optional("roughness", coating.roughness, Allowed::within(0.02, 1.0));
  if (coating.type == CoatingType::matt) in.optional("transmittance", coating.transmittance, part_of_one());
  in.optional("print", coating.print);
}

void fields(YamlReader& in, PinSpec& pins) {
  in.required("rings", pins.rings, Allowed::within(0, kMostPinRings));
  in.required("first_ring_mm", pins.first_ring_mm, Allowed::above(0.0));
  in.required("diameter_mm", pins.diameter_mm, Allowed::above(0.0));
  in.required("height_mm", pins.height_mm, Allowed::above(0.0));
  in.required("tip_mm", pins.tip_mm, Allowed::above_up_to(0.0, pins.height_mm));
  in.optional("colour", pins.colour, part_of_one());
}

void fields(YamlReader& in, FilmSpec& films) {
  in.required("grid", films.grid, Allowed::within(1, 1000));
  in.required("spacing_mm", films.spacing_mm, Allowed::above(0.0));
  in.required("side_mm", films.side_mm, Allowed::above_up_to(0.0, films.spacing_mm.minCoeff()));
  in.optional("refractive_index", films.refractive_index, Allowed::within(1.0, 4.0));
  in.required("transmittance", films.transmittance, part_of_one());
}

void fields(YamlReader& in, BandsSpec& bands) {
  bands.where = in.where();
  in.optional("from_nm", bands.from_nm, Allowed::within(200.0, 2000.0));
  in.optional("to_nm", bands.to_nm, Allowed::within(bands.from_nm + 64.0, 3000.0));
  in.optional("tolerance", bands.tolerance, Allowed::within(1e-4, 1.0));
  in.optional("count", bands.count);
  if (bands.count && std::ranges::find(render::kBandCounts, *bands.count) == render::kBandCounts.end()) {
    fail_at(in.where("count"), "bands.count: {}; allowed are 1, 3, 8 and 16", *bands.count);
  }
}

void fields(YamlReader& in, MotionChipSpec& chip) {
  chip.where = in.where();
  in.optional("automatic_shutter", chip.automatic_shutter);
  in.optional("darkest_maximum", chip.darkest_maximum);
  in.optional("brightest_maximum", chip.brightest_maximum);
}

namespace {

void add_background(DeviceSpec& device, const std::filesystem::path& file, const SourceLocation& where) {
  cv::Mat frame;
  try {
    frame = read_image(file);
  } catch (const Error& error) {
    fail_at(where, "background: {}", error.what());
  }
  try {
    set_background(device, frame);
  } catch (const Error& error) {
    fail_at(where, "background: {}: {}", file.string(), error.what());
  }
}

void add_residual(DeviceSpec& device, const std::filesystem::path& file, const SourceLocation& where) {
  std::shared_ptr<const ResidualMap> map;
  try {
    map = std::make_shared<const ResidualMap>(read_residual_map(file));
  } catch (const Error& error) {
    fail_at(where, "residual: {}", error.what());
  }
  try {
    set_residual(device, std::move(map));
  } catch (const Error& error) {
    fail_at(where, "residual: {}: {}", file.string(), error.what());
  }
}

/// What is learned from a unit's frames is for coated gels and colour cameras with their pictures' size.
void check_from_unit(const DeviceSpec& device, int width_px, int height_px) {
  if (!device.coating) fail("is for coated gels, and the device has no coating");
  if (!device.camera) fail("needs a camera, and the device has none");
  const CameraSpec& camera = *device.camera;
  if (camera.bayer == render::BayerPattern::none) fail("is of red, green and blue, and the device's camera is grey");
  if (camera.width != width_px || camera.height != height_px) {
    fail("is of {} x {} pixels, and the device's camera has {} x {}", width_px, height_px, camera.width, camera.height);
  }
}

}  // namespace

void set_background(DeviceSpec& device, const cv::Mat& frame) {
  if (frame.type() != CV_8UC3) {
    fail("has {} channels of {} bits; a background has 3 of 8 bits", frame.channels(), 8 * frame.elemSize1());
  }
  check_from_unit(device, frame.cols, frame.rows);
  device.background = frame;
}

void set_residual(DeviceSpec& device, std::shared_ptr<const ResidualMap> map) {
  check_from_unit(device, map->width_px, map->height_px);
  device.residual = std::move(map);
}

void fields(YamlReader& in, DeviceSpec& device) {
  device.where = in.where();
  in.required("name", device.name);
  in.required("gel", device.gel);
  in.optional("mesh", device.mesh);
  in.optional("beads", device.beads);
  in.optional("plate", device.plate);
  in.optional("lamps", device.lamps);
  in.optional("coating", device.coating);
  if (device.gel.frame == GelFrame::clear && !device.coating) {
    fail_at(in.where("gel"), "gel.frame: clear is for coated gels; a gel that can be seen through has a painted frame");
  }
  in.optional("pins", device.pins);
  in.optional("films", device.films);
  in.optional("bands", device.bands);
  in.optional("band_wavelengths_nm", device.band_wavelengths_nm, Allowed::within(300.0, 1200.0));
  in.not_beside("band_wavelengths_nm", {"bands"});  // which tell them
  in.optional("room_radiance", device.room_radiance, Allowed::at_least(0.0));
  in.optional("room_radiance_behind", device.room_radiance_behind, Allowed::at_least(0.0));
  in.optional("camera", device.camera);
  std::string background, residual;
  in.optional("background", background);
  in.optional("residual", residual);
  in.optional("accuracy", device.accuracy);
  if (in.describing()) return;  // there is nothing to check
  if (std::ranges::find(render::kBandCounts, static_cast<int>(device.band_wavelengths_nm.size())) ==
      render::kBandCounts.end()) {
    fail_at(in.where("band_wavelengths_nm"), "band_wavelengths_nm: {} wavelengths; allowed are 1, 3, 8 or 16 of them",
            device.band_wavelengths_nm.size());
  }
  check_gel(device, in.where("gel"));
  if (device.beads) check_beads_fit(device, in.where("beads"));
  if (device.pins) check_pins(device, in.where("pins"));
  if (device.camera) {
    if (!in.has("plate")) fail_at(device.where, "{}'plate' is missing, through which the camera looks", in.context());
    check_camera_outside(device, in.where("camera"));
  }
  check_lamps_outside(device, in.where("lamps"));
  if (in.has("background")) add_background(device, in.folder() / background, in.where("background"));
  if (in.has("residual")) add_residual(device, in.folder() / residual, in.where("residual"));
}

DeviceSpec read_device(const std::filesystem::path& file) {
  return read_yaml<DeviceSpec>(file);
}

fem::PronySeries prony_series(const GelSpec& gel) {
  fem::PronySeries series;
  for (const RelaxationTermSpec& term : gel.relaxation) series.push_back({term.share, term.time_s});
  return series;
}

std::vector<Eigen::Vector3d> bead_centres(const BeadSpec& beads) {
  std::vector<Eigen::Vector3d> centres;
  const double half = (beads.grid - 1) * beads.spacing_mm / 2;
  for (int row = 0; row < beads.grid; ++row) {
    for (int column = 0; column < beads.grid; ++column) {
      centres.emplace_back(column * beads.spacing_mm - half, row * beads.spacing_mm - half, -beads.depth_mm);
    }
  }
  return centres;
}

}  // namespace touchstone::sim
