#pragma once
// An optical setup for one coloured marker behind its filter: what a tilt of the surface does to the marker's picture
// ([Lin2019, sec. V]: "the center of a marker that experiences a pure tilt will be measured with a systematic error.
// Spherical markers can limit this effect."). Only light, no mechanics: the white sheet is given its shape.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>

#include "render/cameras/camera.h"
#include "render/imager/imager.h"
#include "render/scene/scene.h"
#include "render/spectra/spectral_bands.h"

namespace touchstone::lab {

/// What the marker is.
enum class TiltMarker {
  flat,   ///< a square printed on the sheet: it goes with it, and stretches by eq. 3 as it is pressed in
  rigid,  ///< the same, but it doesn't stretch: what of the flat marker's hue is perspective alone
  ball,   ///< a matt ball as wide as the square, in the gel right under the sheet
};

/// The setup: the chroma sensor's optics (air, plate, gel, three light guides at the plate's sides, one yellow film
/// square at the gel's back, a white sheet for its outer surface) about one marker.
struct TiltSetup {
  double gel_mm = 5.0;
  double plate_mm = 8.0;
  double side_mm = 2.0;          ///< of the marker; the ball's diameter
  double film_mm = 2.0;          ///< side of the film's square
  double poisson_ratio = 0.5;    ///< of eq. 3
  double lens_mm = 24.0;         ///< focal length
  double camera_mm = 382.0;      ///< from the lens to the sheet at rest
  double pixel_pitch_um = 4.51;  ///< 66 um on the sheet
  double f_number = 4.0;
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();  ///< of marker and film, from the camera's axis
  double half_view_mm = 2.6;  ///< of the part of the picture that is made, about the marker at rest
  Eigen::Vector2d phase_px = Eigen::Vector2d::Zero();  ///< by which the picture is shifted on the pixels
  int samples = 256;                                   ///< paths a pixel
};

/// The paper's camera, 66 um a pixel.
TiltSetup far_setup();
/// That of scenes/devices/chroma.yaml: 60 mm (in air) away, with the paper's lens, 55 um a pixel and 8 mm of gel.
TiltSetup near_setup();

/// How the sheet stands at the marker: it is turned and moved as a whole within 1.6 mm, and fades from there to rest at
/// 4.2 mm. The turn is about the marker's own centre, so the centre moves by `moved_mm` only.
struct TiltPose {
  double tilt = 0.0;  ///< radians about y, from 0 to pi / 4
  Eigen::Vector3d moved_mm = Eigen::Vector3d::Zero();
};

/// The bands and what is in them: the project's spectra (scenes/spectra) of the white LED, silicone, magenta print,
/// yellow film and the IMX273's pixels, in sixteen bands placed for them.
struct TiltSpectra {
  render::SpectralBands bands;
  render::Spectrum lamp;  ///< W of one watt
  render::Spectrum white, magenta, film;
  render::QuantumEfficiency efficiency;  ///< 3 x bands
};
/// `spectra` is the folder. @throws Error if a file can't be read
TiltSpectra read_tilt_spectra(const std::filesystem::path& spectra);

/// Colours as a tilt picture has them, of what is level and fully lit: red, green and blue over those of the lamps.
struct TiltColours {
  Eigen::Vector3d white, magenta;            ///< beside the film
  Eigen::Vector3d film_white, film_magenta;  ///< lit and seen through it
};
/// The camera's colours of the four spectra, DN without noise.
TiltColours tilt_colours(const TiltSpectra& spectra);

/// The setup as the tracer takes it. @throws Error for a tilt beyond pi / 4, or a marker that is moved to the film
render::Scene tilt_scene(const TiltSetup& setup, const TiltSpectra& spectra, TiltMarker marker, const TiltPose& pose);
/// Its camera: the part of the picture about the marker.
render::Camera tilt_camera(const TiltSetup& setup);

/// The picture: CV_32FC3, red, green and blue, in proportion to the electrons of pixels of each colour at every place
/// (no mosaic, no noise but the paths'), white balanced so that the lamps' light is grey.
cv::Mat tilt_picture(const TiltSetup& setup, const TiltSpectra& spectra, TiltMarker marker, const TiltPose& pose,
                     std::uint64_t seed);

}  // namespace touchstone::lab
