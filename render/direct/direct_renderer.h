#pragma once
// Pictures of a lit membrane without interreflection, fast: light looked up in a LightField, packets of rays.

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "render/cameras/camera.h"
#include "render/direct/light_field.h"
#include "render/direct/sheet_points.h"
#include "render/scene/scene.h"

namespace touchstone::render {

/// How finely a picture is sampled, and what of its blur is drawn.
struct DirectSettings {
  /// Per pixel, at most 64. With 1 rays go through the middle of the hole or lens, and shadows are cast from the middle
  /// of each lamp's lens; the picture is then spread over what the whole hole sees (camera_footprint.h). With more,
  /// pixel, hole and lens are sampled as by the path tracer.
  int samples = 1;
  std::uint64_t seed = 0;
  bool shadows = true;
  /// Of hole or lens and of the pixel's area, with one sample; false: each ray as it is, one a pixel.
  bool blur = true;
  /// Where the blur is wide, rays are cast for squares of pixels, at least so many along the blur's diameter; 1 to 64.
  double rays_across_blur = 3.0;
  /// Where the blur is narrower than 4 pixels, `edge_side` x `edge_side` (1, 2 or 4) rays are cast instead of one in
  /// pixels that differ from one beside them by more than `edge_contrast` of the picture's root mean square: rims,
  /// beads, borders of shadows.
  int edge_side = 4;
  double edge_contrast = 0.1;
};

/// Which of DirectSettings::samples are drawn: each `step`-th from `first` on. Pictures of a moving scene at `step`
/// moments, each with another part, have on the mean as many rays as one picture with all.
struct SamplePart {
  int first = 0;
  int step = 1;
};

/// `irradiance`: CV_32FC(bands), W/m^2 on the sensor, as RenderedImage::irradiance.
struct DirectImage {
  cv::Mat irradiance;
  std::uint64_t primary = 0;        ///< camera rays traced
  std::uint64_t shadow_rays = 0;    ///< traced
  std::uint64_t shadow_spared = 0;  ///< lamp connections that nothing could stand in the way of
  std::uint64_t edge_pixels = 0;    ///< that got more rays than one
  /// By pixel: the triangle of the first surface that the ray through its middle met, or -1; empty where no such ray
  /// was cast for each pixel.
  std::vector<std::int32_t> sheet_triangle;
};

/// Tier 1 of the renderers: what Scene::interreflection = false means, from a light field. For a static fixture (faces,
/// lamps, camera) before which surfaces and balls move; they must lie in one layer, the field's.
///
/// Where it differs from the path tracer without interreflection: the field's interpolation error; a lens that a
/// surface's own horizon cuts counts by its middle; shadows' soft rims (hard with one sample); the hole's blur, which
/// is that of things at the rest surface's height (with one sample); mirror images of the membrane in the faces stand
/// at the thing itself, their light is kept; a camera ray that goes through the layer without a hit sees the
/// surroundings; rough metal sees each lamp as a point.
///
/// Keeps 28 + 4 bands bytes a ray (twice the latter with surroundings): 12 to 16 MB for 640 x 480 at 3 bands.
class DirectRenderer {
 public:
  /// `rest` is any scene of the fixture with the triangles that later scenes will have: the ray tree is built for it.
  /// @throws Error if scene, camera or settings are faulty, or the scene isn't for this renderer (see render)
  DirectRenderer(const LightField& field, const Camera& camera, const Scene& rest, const DirectSettings& settings = {});
  ~DirectRenderer();
  DirectRenderer(DirectRenderer&&) noexcept;

  /// A pure function of the constructor's arguments and `scene`, the same bytes for any number of threads. Not for
  /// several threads at once. A scene with other triangles than `rest` gets a tree of its own, which costs some ms.
  /// @throws Error if the scene is faulty; asks for interreflection without set_bounced_light; has other media, faces,
  /// lamps or surroundings than the field; has materials other than Lambertian, RoughConductor, Black and Emitter, or
  /// scattering media; films other than `rest`'s or than film_screen.h takes; or things outside of the field's layer,
  /// or lit ones outside of its box
  /// @pre the part has a sample
  DirectImage render(const Scene& scene, const SamplePart& part = {});

  /// What the first surface of a scene shows ray by ray, to be moved by SheetBetween; nothing where that can't be had:
  /// with several samples a pixel, without blur, of a sheet that isn't Lambertian or has no print (of no marks, at
  /// least) to say where its material was, or of a scene with films. @throws Error as render
  std::optional<SheetPoints> sheet_points(const Scene& scene);
  /// The picture of a radiance for each of sheet_points' points, [band][point], as DirectImage::irradiance, whose
  /// memory is used again. The radiance is taken, and memory of the same size is left in its place.
  void picture_of(std::vector<float>& radiance, cv::Mat& irradiance);

  /// Irradiance that reaches what each pixel shows from everywhere, on top of the lamps' (rest_light.h): W/m^2,
  /// CV_32FC(bands) of the camera's size, or empty for none. With it scenes may ask for interreflection.
  /// @throws Error for another size or type, or numbers that aren't finite
  void set_bounced_light(const cv::Mat& irradiance);
  /// The same, of the sheet of `rest`, its first surface, which changes it where it has been tilted since: see
  /// rest_light.h. @throws Error as above and as render
  void set_bounced_light(const cv::Mat& irradiance, const Scene& rest);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::render
