#pragma once
// A device file: a gel, its beads, its plate, its lamps and its camera. See docs/file-formats.md.

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/yaml_reader.h"
#include "fem/contact/relaxation.h"
#include "render/cameras/lens_camera.h"
#include "render/imager/imager.h"
#include "render/materials/print.h"
#include "sim/files/colour.h"
#include "sim/scene/accuracy.h"
#include "sim/scene/device_lamps.h"
#include "sim/scene/event_camera_spec.h"
#include "sim/scene/residual_map.h"

namespace touchstone::render {
EnumNames<BayerPattern> enum_names(BayerPattern);  // of the field `camera.bayer`
EnumNames<MarkShape> enum_names(MarkShape);        // of `coating.print.shape`
}  // namespace touchstone::render

namespace touchstone::sim {

/// One term of the gel's relaxation: `share` of the instantaneous modulus fades with the time constant `time_s`.
struct RelaxationTermSpec {
  double share = 0.0;
  double time_s = 0.0;
};

struct GelSurface;

/// A flat gel with upright sides.
struct SlabSpec {
  double size_x_mm = 0.0;
  double size_y_mm = 0.0;
};

/// A spherical cap; where the gel is thicker than the cap is high, on a cylinder (fem::DomeGel).
struct DomeSpec {
  double sphere_radius_mm = 0.0;
  double base_radius_mm = 0.0;
};

/// A hemisphere on a cylinder, held in a sleeve (fem::FingertipGel).
struct FingertipSpec {
  double radius_mm = 0.0;
  double length_mm = 0.0;
  double sleeve_mm = 0.0;
};

/// A solid from a file (fem::SolidGel).
struct GelMeshSpec {
  std::filesystem::path file;                 ///< glTF with named faces, relative to the device file
  double mm_per_unit = 1000.0;                ///< glTF's unit is the metre
  std::shared_ptr<const GelSurface> surface;  ///< as read
};

/// A layer of a gel. Optically it is the gel's body.
struct GelLayerSpec {
  std::string name;  ///< for the reader; may be empty
  double thickness_mm = 0.0;
  double youngs_modulus_MPa = 0.0;
  double poisson_ratio = 0.49;
};

/// What holds a pad at its sides: something painted, or the same clear stuff that goes on round it (a clear case,
/// potting or glue), so that light passes the sides as if they weren't there.
enum class GelFrame { painted, clear };
EnumNames<GelFrame> enum_names(GelFrame);

/// The soft body, clamped to the plate on its back. Gel frame: origin in the middle of the outer surface, +z out of the
/// gel, back at z = -thickness. `shape` in the file says which shape it has; fields of other shapes may not stand
/// there.
struct GelSpec {
  std::variant<SlabSpec, DomeSpec, FingertipSpec, GelMeshSpec> shape;
  double thickness_mm = 0.0;         ///< of a slab and a dome as given, else worked out; layers are part of it
  std::vector<GelLayerSpec> layers;  ///< from the outer surface inwards; not for a mesh
  double youngs_modulus_MPa = 0.0;   ///< of the body below the layers; instantaneous, where the gel relaxes
  double poisson_ratio = 0.49;       ///< constant in time
  double density_kg_m3 = 1000.0;
  std::vector<RelaxationTermSpec> relaxation;  ///< of all moduli: a Prony series; empty: elastic
  double refractive_index = 1.0;
  Colour absorption_per_mm = 0.0;      ///< natural logarithm
  Colour scattering_per_mm = 0.0;      ///< of a milky gel
  double scattering_anisotropy = 0.0;  ///< mean cosine of a scattering
  GelFrame frame = GelFrame::painted;  ///< at the pad's sides; clear ones are for coated gels
  Colour frame_albedo = 0.0;           ///< of a painted one; 0 is black

  // Null if the gel has another shape.
  const SlabSpec* slab() const { return std::get_if<SlabSpec>(&shape); }
  const DomeSpec* dome() const { return std::get_if<DomeSpec>(&shape); }
  const FingertipSpec* fingertip() const { return std::get_if<FingertipSpec>(&shape); }
  const GelMeshSpec* mesh() const { return std::get_if<GelMeshSpec>(&shape); }
};

/// How fine the gel is meshed: `fine_mm` where contact and beads are, graded to `coarse_mm` elsewhere; or, in their
/// place, how far the force may be off (see fem::ErrorGoal), from which set-up finds them. On a dome or a fingertip the
/// fine part is round: the larger half extent is its radius along the surface.
struct MeshSpec {
  double fine_mm = 0.5;
  double coarse_mm = 1.5;
  Eigen::Vector2d fine_half_extent_mm = {5.0, 5.0};
  double fine_depth_mm = 1.25;
  std::optional<double> force_error;  ///< relative, one standard error
  double contact_radius_mm = 0.0;     ///< of contacts of this radius or larger
  bool sharp_bodies = false;          ///< also of bodies with sharp edges
};

/// A square grid of balls embedded in the gel.
struct BeadSpec {
  int grid = 3;             ///< beads a side
  double spacing_mm = 2.0;  ///< between neighbours
  double diameter_mm = 0.5;
  double depth_mm = 0.5;  ///< of the centres, below the outer surface
  Colour reflectance = 0.5;
  double roughness = 0.3;  ///< GGX alpha
};

/// The flat plate that holds the gel, between it and the camera.
struct PlateSpec {
  double thickness_mm = 0.0;
  double refractive_index = 1.0;
};

/// How the dots of a coating's print lie.
enum class PrintPattern { grid, scattered };
EnumNames<PrintPattern> enum_names(PrintPattern);  // of `coating.print.pattern`

/// Markers on the inside of a coating: a grid, or with `jitter_mm` a semi-random field, laid out over the gel's x and
/// y; or scattered dots, laid out along its surface (sim/scene/scattered_print.h). They stretch with it.
struct PrintSpec {
  PrintPattern pattern = PrintPattern::grid;
  Eigen::Vector2i grid = {1, 1};            ///< markers along x and y, centred on the gel's origin
  Eigen::Vector2d spacing_mm = {1.0, 1.0};  ///< between neighbours' centres; scattered: one number, in both
  render::MarkShape shape = render::MarkShape::round;
  double width_mm = 0.0;         ///< in the file `diameter_mm` of round ones, `side_mm` of square ones
  double jitter_mm = 0.0;        ///< grid: each centre is moved along x and y by up to this, evenly distributed
  double radius_mm = 0.0;        ///< scattered: of the disc that they fill
  double diameter_spread = 0.0;  ///< scattered: each diameter is changed by up to this part, evenly distributed
  std::uint64_t seed = 0;        ///< of the jitter or the places and sizes
  Colour colour = 0.05;
};

/// How the coating sends light back: as a Lambertian, or as a RoughConductor.
enum class CoatingType { matt, metal };
EnumNames<CoatingType> enum_names(CoatingType);

/// A coat on the gel's outer surface, seen from within. Of the objects the camera then sees nothing, or, through a coat
/// with a transmittance, whether what touches it is bright or dark. For mechanics it isn't there: give a layer
/// (GelLayerSpec) if it is stiff.
struct CoatingSpec {
  CoatingType type = CoatingType::matt;
  Colour albedo = 0.5;     ///< of a matt one; of a metal one the reflectance at normal incidence
  double roughness = 0.3;  ///< of a metal one: GGX alpha
  /// Of a matt one: what it lets through of the light that meets it, diffusely, while it lies between two gels.
  /// `albedo` is then what it sends back by itself, with nothing behind it (sim/scene/translucent_coat.h).
  Colour transmittance = 0.0;
  std::optional<PrintSpec> print;
};

/// Pins on the inside of a coated gel's skin, as a TacTip's [TacTipGenerator]: black, with a white tip. One stands in
/// the middle, 6 k in the k-th ring round it (sim/scene/device_pins.h). The skin is the gel's first layer; without
/// layers pins stand on the coating. For mechanics they aren't there (sim/view/skin_pins.h).
struct PinSpec {
  int rings = 0;
  double first_ring_mm = 0.0;  ///< from the gel's axis to the feet of the first ring; the k-th stands k times as far
                               ///< off, on a dome or a fingertip in angle
  double diameter_mm = 0.0;
  double height_mm = 0.0;  ///< with the tip, over the skin's inner face
  double tip_mm = 0.0;     ///< of the height, white
  Colour colour = 0.8;     ///< albedo of the tips, which are matt
};

/// Squares of a clear coloured film between plate and gel, as yellow filters over markers. Wetted on both sides.
struct FilmSpec {
  Eigen::Vector2i grid = {1, 1};
  Eigen::Vector2d spacing_mm = {1.0, 1.0};
  double side_mm = 0.0;
  double refractive_index = 1.5;
  Colour transmittance = 1.0;  ///< of one passage at normal incidence
};

/// A hole in a foil.
struct PinholeSpec {
  double hole_diameter_um = 0.0;
  double foil_thickness_um = 0.0;
  double hole_to_sensor_mm = 0.0;
};

/// A lens. The file has either focal_length_mm or camera_matrix, and at most one of focus_distance_mm and
/// sensor_distance_mm (neither: sharp at infinity; with a camera matrix, which gives the sensor's distance,
/// focus_distance_mm only).
struct LensSpec {
  std::optional<double> focal_length_mm;
  std::optional<Eigen::Vector4d> camera_matrix;  ///< OpenCV's fx, fy, cx, cy, pixels (centres are whole numbers)
  double f_number = 0.0;                         ///< focal length / diameter of the stop
  std::optional<double> focus_distance_mm;       ///< to what is sharp, in air
  std::optional<double> sensor_distance_mm;
  std::vector<double> distortion;                ///< OpenCV's k1 k2 p1 p2 [k3 [k4 k5 k6]]; empty: none
  std::optional<render::Vignetting> vignetting;  ///< beside cos^4; in the file a polynomial or points
};

/// What an optical mouse's chip does by itself beside exposing its pixels (render/imager/motion_chip.h). Its longest
/// exposure is the camera's.
struct MotionChipSpec {
  bool automatic_shutter = true;
  int darkest_maximum = 45;
  int brightest_maximum = 62;
  SourceLocation where;
};

/// A camera and its imager (in the terms of [EMVA1288]). `type` in the file says whether it has a hole or a lens; the
/// fields of the other may not stand there. A `preset` in the file gives the imager's figures, which the other fields
/// override (sim/scene/camera_preset.h).
struct CameraSpec {
  std::variant<PinholeSpec, LensSpec> optics;
  int width = 0;
  int height = 0;
  double frame_rate_Hz = 30.0;
  double pixel_pitch_um = 0.0;
  double active_area_um2 = 0.0;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  ///< in the file `hole_position_mm` or `lens_position_mm`
  Eigen::Vector3d look_at_mm = Eigen::Vector3d::Zero();
  double roll_deg = 0.0;  ///< about its axis; what it sees turns in the opposite direction in its picture
  double exposure_us = 1000.0;
  double row_time_us = 0.0;  ///< from row to row of a rolling shutter, the top row first; 0: all rows at once
  int bits = 8;              ///< 1 to 16
  render::BayerPattern bayer = render::BayerPattern::none;
  // Of the red, green and blue pixels; a grey camera has the green one only, by itself 1 in all bands. A colour
  // camera's own three are for the bands red, green and blue.
  Colour quantum_efficiency_red = {1, 0, 0};
  Colour quantum_efficiency_green = {0, 1, 0};
  Colour quantum_efficiency_blue = {0, 0, 1};
  std::optional<Eigen::Vector3d> white_balance;  ///< fixed gains of red, green, blue; absent: the lamps' light is grey
  double full_well_e = 0.0;
  double gain_dB = 0.0;  ///< analogue: at 0 the full well gives the largest number, at 20 a tenth of it does
  double read_noise_e = 0.0;
  double dark_current_e_per_s = 0.0;
  double prnu = 0.0;  ///< relative
  double dsnu_e = 0.0;
  double black_level_DN = 0.0;
  render::HotPixels hot_pixels;
  std::optional<render::AutoExposure> auto_exposure;
  std::optional<render::AutoWhiteBalance> auto_white_balance;
  render::ToneCurve tone_curve;
  std::optional<render::JpegSettings> jpeg;
  std::optional<MotionChipSpec> motion_chip;
  std::optional<EventCameraSpec> events;  ///< its pixels also, or only, report changes of their light
};

/// The range of wavelengths that is simulated, and into how many bands it is cut.
struct BandsSpec {
  double from_nm = 400.0;
  double to_nm = 720.0;
  std::optional<int> count;  ///< 1, 3, 8 or 16; without it as many as `tolerance` takes
  double tolerance = 0.02;   ///< relative, of what a pixel reads on any of the device's light paths
  SourceLocation where;
};

/// All of a device file, checked.
struct DeviceSpec {
  std::string name;
  GelSpec gel;
  MeshSpec mesh;
  std::optional<BeadSpec> beads;
  PlateSpec plate;
  std::optional<CoatingSpec> coating;
  std::optional<PinSpec> pins;  ///< beside a coating without print
  std::optional<FilmSpec> films;
  std::vector<LampSpec> lamps;
  std::optional<BandsSpec> bands;                             ///< for spectra; else:
  std::vector<double> band_wavelengths_nm = {610, 540, 455};  ///< centres of the bands, which are just numbers
  Colour room_radiance = 0.0;                                 ///< W/m^2/sr in each band
  std::optional<Colour> room_radiance_behind;                 ///< of what is behind a clear gel; absent: the same
  std::optional<CameraSpec> camera;
  /// A frame of the untouched unit, CV_8UC3 (blue, green, red); in the file its name, relative to the device file.
  /// Empty: none. Pictures then show what it shows where nothing is pressed (sim/sensor/background_light.h).
  cv::Mat background;
  std::shared_ptr<const ResidualMap> residual;  ///< in the file its name, relative to the device file; null: none
  std::optional<AccuracySpec> accuracy;         ///< of all scenes of the device that don't state their own
  SourceLocation where;
};

void fields(YamlReader& in, GelLayerSpec& layer);
void fields(YamlReader& in, RelaxationTermSpec& term);
void fields(YamlReader& in, SlabSpec& slab);
void fields(YamlReader& in, DomeSpec& dome);
void fields(YamlReader& in, FingertipSpec& tip);
void fields(YamlReader& in, GelMeshSpec& mesh);
void fields(YamlReader& in, GelSpec& gel);
void fields(YamlReader& in, MeshSpec& mesh);
void fields(YamlReader& in, BeadSpec& beads);
void fields(YamlReader& in, PlateSpec& plate);
void fields(YamlReader& in, PrintSpec& print);
void fields(YamlReader& in, CoatingSpec& coating);
void fields(YamlReader& in, PinSpec& pins);
void fields(YamlReader& in, FilmSpec& films);
void fields(YamlReader& in, BandsSpec& bands);
void fields(YamlReader& in, MotionChipSpec& chip);
void fields(YamlReader& in, CameraSpec& camera);
void fields(YamlReader& in, DeviceSpec& device);

/// Gives the device a frame of the untouched unit. @throws Error if it has no coating or colour camera, or the frame
/// another size or kind
void set_background(DeviceSpec& device, const cv::Mat& frame);

/// Gives the device a residual map. @throws Error if it has no coating or colour camera, or another size of picture
void set_residual(DeviceSpec& device, std::shared_ptr<const ResidualMap> map);

/// Reads and checks a device file. @throws Error with file and line
DeviceSpec read_device(const std::filesystem::path& file);

/// The gel's relaxation as mechanics takes it.
fem::PronySeries prony_series(const GelSpec& gel);

/// Rest positions of the beads' centres in the gel frame, row by row: y grows from row to row and x along a row,
/// as the upright picture shows them.
std::vector<Eigen::Vector3d> bead_centres(const BeadSpec& beads);

}  // namespace touchstone::sim
