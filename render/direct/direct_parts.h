#pragma once
// What a DirectRenderer keeps from frame to frame, and how it is set up (direct_parts.cpp); direct_renderer.cpp draws.

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/triangle_mesh.h"
#include "render/cameras/camera_footprint.h"
#include "render/cameras/camera_rays.h"
#include "render/direct/direct_batch.h"
#include "render/direct/direct_fixture.h"
#include "render/direct/direct_renderer.h"
#include "render/direct/shadow_reach.h"
#include "render/direct/sheet_horizons.h"
#include "render/direct/sheet_points.h"
#include "render/materials/ggx.h"
#include "render/scene/packet_scene.h"

namespace touchstone::render {
/// The light that still things keep from a sheet which moves before them. What a pixel sees of it lies on the pixel's
/// ray, so it's known from some heights of the sheet, whatever the sheet's shape.
struct StillShadows {
  ShadowReach reach;  ///< of the still things
  /// One height of the sheet.
  struct Level {
    std::vector<float> z;              ///< by grid point, where its ray met the sheet, mm; infinite where it didn't
    std::vector<std::uint8_t> shares;  ///< [grid point][lamp]: of 255, what gets through to there
  };
  std::vector<Level> levels;  ///< the sheet at rest, moved along z: from outside inwards
};

/// All that a renderer keeps from frame to frame.
struct DirectRenderer::Parts {
  DirectFixture fixture;
  ReadyCamera camera;
  DirectSettings settings;
  float pixel_mm;                // between the rays of pixels beside each other, in the middle of the field's box
  Eigen::AlignedBox2d seen_box;  // x and y of all that rays to the field's layer pass between its lowest and highest
  std::optional<HorizonSettings> horizon_settings;  // where one sample is taken and light comes from one side
  bool lone_sheet;  // the first surface alone moves: asked for by SheetIndex and SheetHorizons, not in `tree`
  std::vector<TriangleMesh> others;  // of a lone sheet: all but the first surface, at rest
  PacketScene tree;
  std::vector<Surface> films;
  std::optional<StillShadows> still;  // where a lone sheet isn't alone in casting shadows
  bool connected;                     // the first surface
  bool spreads;                       // central rays, then the footprint
  bool refines = false;               // more rays at edges
  CameraFootprint footprint;
  CameraRays rays;
  // By pixel and band, where central rays are spread; see CameraRays.
  std::vector<float> through, veil;
  std::vector<float> radiance;                // [band][grid point], memory for a frame
  std::vector<DirectBatch::Visibility> seen;  // by grid point, where edges get more rays
  std::vector<std::int32_t> sheet_triangles;  // by grid point, the first surface's triangle or -1; memory for a frame
  std::vector<float> bounced;                 // [grid point][band], irradiance; empty for none
  std::map<double, GgxAlbedo> conductors;     // by roughness

  Parts(const LightField& field, const Camera& camera_of, const Scene& rest,
        const DirectSettings& settings_of);  ///< as DirectRenderer's

  int width() const { return size_of_grid(pixel_grid(camera)).x(); }
  int height() const { return size_of_grid(pixel_grid(camera)).y(); }
  /// Does the first surface alone move, as far as a scene at rest says, and do horizons say where it casts shadows?
  bool is_lone_sheet(const Scene& rest) const;
  /// Does all but the first surface stand where it stood at rest?
  bool stands_still(const Scene& scene) const;

  /// Are still things' shadows on the frame's sheet known? Then each lane takes them before it asks by rays.
  bool knows_still(const DirectFrame& frame) const { return still && frame.horizons != nullptr; }
  void take_still(DirectBatch& batch, int first_tile, int packets) const;  ///< all lanes of a batch
  void take_still(DirectBatch& batch, int lane, std::size_t point) const;  ///< a lane that sees near a grid point
  /// Casts the rays and shades what they meet: into `radiance`, or into the picture where nothing is spread.
  void cast(const DirectFrame& frame, DirectImage& image);
  /// Casts more rays where `radiance` has edges.
  void refine(const DirectFrame& frame, DirectImage& image);
  /// From `sheet_triangles` to pixels; nothing where grid points aren't pixels.
  std::vector<std::int32_t> triangles_by_pixel() const;
  /// From `radiance` to the picture.
  void spread(DirectImage& image) const;

  struct Prepared;
  /// Looks a scene over and gets all ready that its rays will ask for. @throws Error as render
  std::unique_ptr<Prepared> prepare(const Scene& scene);
  /// What the rays of one picture meet of the sheet, its first surface.
  SheetPoints points_of(const DirectFrame& frame, const Surface& sheet) const;

 private:
  DirectBatch::Visibility known_round(int point) const;

  static Eigen::Vector2i size_of_grid(const ImageGrid& grid) { return {grid.columns, grid.rows}; }

  /// What the hole or lens sees of a point at rest it sees through a disc of the films' plane; lamps' light rises to
  /// the membrane so flat that it comes from about as far aside as films are below.
  void set_up_films(const Scene& rest);

  /// The footprint on what the scene shows at rest, by block; in the middle of the field's box where it shows nothing.
  void find_footprint(const Scene& rest);

  std::optional<HorizonSettings> find_horizon_settings() const;

  /// The scene with nothing of its first surface.
  static Scene still_things(const Scene& rest);
  StillShadows find_still_shadows(const Scene& rest);
  StillShadows::Level find_still_level(const ShadowReach& reach, const Surface& sheet,
                                       const std::vector<DirectMaterial>& materials) const;

  /// Of a coarse grid of pixels, with what lies beside the outermost by half its spacing and by the blur.
  Eigen::AlignedBox2d find_seen_box() const;

  float find_pixel() const;

  void keep_by_pixel(const CameraRays& pixels, const std::vector<float>& from, std::vector<float>& to) const;
};

}  // namespace touchstone::render
